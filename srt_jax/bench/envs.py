"""`srt-jax bench envs`: steps a second of SmartRelocation-v0 beside jumanji's Maze and navix, each in a process of its own.

All do the same: 64 environments under jit, vmap and scan, uniformly random actions, fresh episodes begun by themselves, rewards
summed so that nothing is dropped as unused; "seen" rows sum the observations as well.
"""

import argparse
import importlib
import json
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

NUM_ENVS = 64
BAR = 1e6
"""Steps a second that ours is to reach on two cores."""

ROWS = ("ours", "ours, window seen", "ours, map seen", "jumanji Maze", "jumanji Maze, seen", "navix Empty", "navix Empty, seen")
_SIZE = 16


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "rows": [{name, steps_per_second} or {name, missing}]}."""
    steps = 500 if quick else 4000
    rows = []
    for name in ROWS:
        command = [sys.executable, "-m", "srt_jax.bench.envs", name, "--steps", str(steps)]
        done = subprocess.run(command, capture_output=True, text=True)
        last = (done.stderr.strip().splitlines() or ["no reason told"])[-1]
        rows.append({"name": name, **(json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {"missing": last})})
    return {"machine": {"jax": jax.__version__, "device": jax.devices()[0].platform}, "rows": rows}


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text, with how many times the slowest peer's speed each reaches."""
    machine = result["machine"]
    lines = [
        f"jax {machine['jax']} on {machine['device']}, {NUM_ENVS} environments of {_SIZE} x {_SIZE}; bar for ours {BAR:.0e}",
        f"{'environment':22s}{'steps a second':>16s}",
    ]
    for row in result["rows"]:
        lines.append(
            f"{row['name']:22s}" + (f"{row['steps_per_second']:16,.0f}" if "missing" not in row else f"  {row['missing']}")
        )
    return "\n".join(lines)


def _ours(seen: str) -> tuple[Callable, Callable]:
    from srt_jax import envs

    levels = envs.sample_levels(jax.random.key(0), count=256, size=_SIZE)
    env, params = envs.make(levels=levels, observation="map" if "map" in seen else "window")

    def begin(key):
        return env.reset(key, params)[1]

    def step(key, state):
        action, used = jax.random.bits(key, (2,), jnp.uint32)  # a whole key for each would cost more than the step
        observation, state, reward, *_ = env.step(
            jax.random.wrap_key_data(jnp.stack([action, used])), state, action % 16, params
        )
        return state, reward + (observation.sum() if seen else 0.0)

    return begin, step


def _jumanji(seen: str) -> tuple[Callable, Callable]:
    from jumanji.environments.routing.maze.env import Maze
    from jumanji.environments.routing.maze.generator import RandomGenerator
    from jumanji.wrappers import VmapAutoResetWrapper

    env = VmapAutoResetWrapper(Maze(RandomGenerator(_SIZE, _SIZE)))  # begins anew one by one: its fastest wrapper

    def begin(keys):
        return env.reset(keys)[0]

    def step(keys, states):
        states, timestep = env.step(states, jax.random.randint(keys[0], (NUM_ENVS,), 0, 4))
        observed = timestep.observation.walls.sum() + timestep.observation.agent_position.row.sum()
        return states, timestep.reward.sum() + (observed if seen else 0.0)

    return begin, step


def _navix(seen: str) -> tuple[Callable, Callable]:
    env = importlib.import_module("navix").make(f"Navix-Empty-{_SIZE}x{_SIZE}-v0")

    def begin(key):
        return env.reset(key)

    def step(key, timestep):
        timestep = env.step(timestep, jax.random.randint(key, (), 0, 7))
        return timestep, timestep.reward + (timestep.observation.sum() if seen else 0.0)

    return begin, step


def measured(name: str, steps: int) -> float:
    """Returns the steps a second of one of ROWS, the best of five runs."""
    who, _, seen = name.partition(",")
    begin, step = {"ours": _ours, "jumanji Maze": _jumanji, "navix Empty": _navix}[who](seen.strip())
    if who != "jumanji Maze":
        begin, step = jax.vmap(begin), jax.vmap(step)

    @jax.jit
    def roll(key, states):
        def body(carry, key):
            states, total = carry
            states, reward = step(jax.random.split(key, NUM_ENVS), states)
            return (states, total + reward.sum()), None

        return jax.lax.scan(body, (states, jnp.float32(0)), jax.random.split(key, steps))[0]

    states = jax.jit(begin)(jax.random.split(jax.random.key(0), NUM_ENVS))
    jax.block_until_ready(roll(jax.random.key(1), states))
    taken = []
    for seed in range(5):
        start = time.perf_counter()
        jax.block_until_ready(roll(jax.random.key(seed), states))
        taken.append(time.perf_counter() - start)
    return steps * NUM_ENVS / min(taken)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=ROWS)
    parser.add_argument("--steps", type=int, default=4000)
    options = parser.parse_args()
    print(json.dumps({"steps_per_second": measured(options.name, options.steps)}))
