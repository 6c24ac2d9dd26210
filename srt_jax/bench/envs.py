"""`srt-jax bench envs`: steps a second of SmartRelocation-v0 beside jumanji's Maze and navix, each
in a process of its own.

All do the same: 64 environments under jit, vmap and scan, half of them on each of two CPU devices
(two cores), actions from the random bits of a key each, fresh episodes begun by themselves (but for
"no resets"), rewards summed so that nothing is dropped as unused; "seen" rows sum every number of
the observations as well.
"""

import argparse
import functools
import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax.sharding import AxisType, PartitionSpec

from srt_jax.bench.machine import machine, machine_line, spread

NUM_ENVS = 64

ROWS = (
    *(
        "ours",
        "ours, window seen",
        "ours, map seen",
        "jumanji Maze",
        "jumanji Maze, seen",
        "jumanji Maze, no resets",
    ),
    *("jumanji Maze, no resets, seen", "navix Empty", "navix Empty, seen"),
)
_SLOW = ("jumanji Maze", "jumanji Maze, seen")
"""Their resets take a hundred times as long as all else: left out of a quick run."""
_SIZE = 16
_DEVICES = 2


def run(quick: bool = False) -> dict[str, Any]:
    """Returns {"machine", "rows": [{name, steps_per_second, spread} or {name, missing}]}.

    steps_per_second: the best run, by which all are compared; spread: {"median", "low", "high",
      "count"} of all runs.
    """
    names = [name for name in ROWS if not (quick and name in _SLOW)]
    facts = machine("jumanji", "navix") | {"device": jax.devices()[0].platform}
    return {"machine": facts, "rows": [_row(name, 500 if quick else 4000) for name in names]}


def _row(name: str, steps: int) -> dict[str, Any]:
    """Measures one of ROWS in a process of its own."""
    print(f"bench envs: {name}", file=sys.stderr, flush=True)
    flags = f"{os.environ.get('XLA_FLAGS', '')} --xla_force_host_platform_device_count={_DEVICES}"
    command = [sys.executable, "-m", "srt_jax.bench.envs", name, "--steps", str(steps)]
    done = subprocess.run(
        command, capture_output=True, text=True, env={**os.environ, "XLA_FLAGS": flags}
    )
    if done.returncode:
        return {
            "name": name,
            "missing": (done.stderr.strip().splitlines() or ["no reason given"])[-1],
        }
    rates = json.loads(done.stdout.splitlines()[-1])["rates"]
    return {"name": name, "steps_per_second": max(rates), "spread": spread(rates)}


def table(result: dict[str, Any]) -> str:
    """Returns the measurements as text, and as multiples of the fastest peer that does as much
    (seen or not).
    """
    facts, rows = result["machine"], [row for row in result["rows"] if "missing" not in row]
    lines = [
        machine_line(facts),
        (
            f"on {facts['device']}, {NUM_ENVS} environments of {_SIZE} x {_SIZE}; best run,"
            " and the median"
        ),
        f"{'environment':30s}{'steps a second':>16s}{'x fastest peer':>16s}  median (quartiles)",
    ]
    for row in result["rows"]:
        if "missing" in row:
            lines.append(f"{row['name']:30s}  {row['missing']}")
            continue
        peers = [other for other in rows if not other["name"].startswith("ours")]
        alike = [
            other["steps_per_second"]
            for other in peers
            if _is_seen(other["name"]) == _is_seen(row["name"])
        ]
        ratio = f"{row['steps_per_second'] / max(alike):.2f}" if alike else ""
        median, low, high = (f"{row['spread'][part]:,.0f}" for part in ("median", "low", "high"))
        lines.append(
            f"{row['name']:30s}{row['steps_per_second']:16,.0f}{ratio:>16s}  {median}"
            f" ({low}-{high})"
        )
    return "\n".join(lines)


def _is_seen(name: str) -> bool:
    return name.endswith("seen")


def _ours(seen: str) -> tuple[Callable, Callable]:
    from srt_jax import envs

    levels = envs.sample_levels(jax.random.key(0), count=256, size=_SIZE)
    env, params = envs.make(levels=levels, observation="map" if "map" in seen else "window")

    def begin(key):
        return env.reset(key, params)[1]

    def step(key, state):
        # a whole key for each would cost more than the step
        action, used = jax.random.bits(key, (2,), jnp.uint32)
        observation, state, reward, *_ = env.step(
            jax.random.wrap_key_data(jnp.stack([action, used])), state, action % 16, params
        )
        return state, reward + (observation.sum() if seen else 0.0)

    return begin, step


def _jumanji(seen: str) -> tuple[Callable, Callable]:
    from jumanji.environments.routing.maze.env import Maze
    from jumanji.environments.routing.maze.generator import RandomGenerator
    from jumanji.wrappers import VmapAutoResetWrapper, VmapWrapper

    maze: Any = Maze(RandomGenerator(_SIZE, _SIZE))
    # begins again one by one: its fastest
    env = VmapWrapper(maze) if "no resets" in seen else VmapAutoResetWrapper(maze)

    def begin(keys):
        return env.reset(keys)[0]

    def step(keys, states):
        states, timestep = env.step(states, _random_actions(keys, 4))
        observed = sum(jnp.sum(entry) for entry in jax.tree.leaves(timestep.observation))
        return states, timestep.reward.sum() + (observed if _is_seen(seen) else 0.0)

    return begin, step


def _random_actions(keys, number: int):
    """Returns an action for each key."""
    bits = jax.vmap(lambda key: jax.random.bits(key, (), jnp.uint32))(keys)
    return (bits % number).astype(jnp.int32)


def _navix(seen: str) -> tuple[Callable, Callable]:
    env = importlib.import_module("navix").make(f"Navix-Empty-{_SIZE}x{_SIZE}-v0")

    def begin(key):
        return env.reset(key)

    def step(key, timestep):
        timestep = env.step(timestep, _random_actions(key[None], 7)[0])
        return timestep, timestep.reward + (timestep.observation.sum() if seen else 0.0)

    return begin, step


def measured(name: str, steps: int) -> list[float]:
    """Returns the steps a second of one of ROWS in each of five runs."""
    who, _, seen = name.partition(",")
    begin, step = {"ours": _ours, "jumanji Maze": _jumanji, "navix Empty": _navix}[who](
        seen.strip()
    )
    if who != "jumanji Maze":
        begin, step = jax.vmap(begin), jax.vmap(step)

    mesh = jax.make_mesh((len(jax.devices()),), ("cores",), axis_types=(AxisType.Auto,))
    number = NUM_ENVS // len(jax.devices())

    @jax.jit
    @functools.partial(
        jax.shard_map,
        mesh=mesh,
        in_specs=PartitionSpec("cores"),
        out_specs=PartitionSpec("cores"),
        check_vma=False,
    )
    def roll(keys, states):
        def body(carry, key):
            states, total = carry
            states, reward = step(jax.random.split(key, number), states)
            return (states, total + reward.sum()), None

        states, total = jax.lax.scan(
            body, (states, jnp.float32(0)), jax.random.split(keys[0], steps)
        )[0]
        return states, total[None]

    def keys(seed: int):
        return jax.random.split(jax.random.key(seed), len(jax.devices()))

    states = jax.jit(begin)(jax.random.split(jax.random.key(0), NUM_ENVS))
    jax.block_until_ready(roll(keys(1), states))
    taken = []
    for seed in range(5):
        start = time.perf_counter()
        jax.block_until_ready(roll(keys(seed), states))
        taken.append(time.perf_counter() - start)
    return [steps * NUM_ENVS / seconds for seconds in taken]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=ROWS)
    parser.add_argument("--steps", type=int, default=4000)
    options = parser.parse_args()
    print(json.dumps({"rates": measured(options.name, options.steps)}))
