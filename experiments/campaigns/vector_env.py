"""Steps a second of SmartRelocation-v0 through Gymnasium: all environments in one call beside
Gymnasium's own SyncVectorEnv of single ones.

The same 64 levels of rooms, 16 x 16, and the same random actions; the two return the same bits
(tests/envs/test_gym_vector.py). Seconds are of the process on all its cores, and of the clock.

examples:
  python -m experiments.campaigns.vector_env
  python -m experiments.campaigns.vector_env --num-envs 64 --steps 200
"""

import argparse
import functools
import time
from typing import Any

import jax
import numpy as np

from srt_jax import envs
from srt_jax.bench.machine import machine, machine_line


def main() -> int:
    """Prints a table of the two."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--num-envs", type=int, default=1024, help="default: %(default)s")
    parser.add_argument("--steps", type=int, default=200, help="of each (default: %(default)s)")
    given = parser.parse_args()
    import gymnasium

    print(machine_line(machine("gymnasium")))
    levels = envs.sample_levels(jax.random.key(0), count=64, size=16)
    env, params = envs.make(levels=levels)
    one = functools.partial(envs.as_gymnasium, env, params)
    count = given.num_envs
    contenders = {
        "one call (VectorEnv)": (
            envs.as_gymnasium_vector(env, params, num_envs=count),
            given.steps,
        ),
        "SyncVectorEnv": (gymnasium.vector.SyncVectorEnv([one] * count), max(1, given.steps // 50)),
    }
    rates = {
        name: _steps_a_second(vector, count, steps) for name, (vector, steps) in contenders.items()
    }
    print(f"{count} environments         steps a second    a CPU second")
    for name, (by_clock, by_cpu) in rates.items():
        print(f"{name:25s}{by_clock:18,.0f}{by_cpu:16,.0f}")
    ours, theirs = rates.values()
    print(f"ratio {ours[0] / theirs[0]:.0f} by the clock, {ours[1] / theirs[1]:.0f} by CPU time")
    return 0


def _steps_a_second(vector: Any, count: int, steps: int) -> tuple[float, float]:
    """Returns steps a second of the clock and a second of CPU time, compiling not counted."""
    actions = np.random.default_rng(0).integers(0, 16, (steps, count))
    vector.reset(seed=0)
    vector.step(actions[0])
    clock, cpu = time.perf_counter(), time.process_time()
    for row in actions:
        vector.step(row)
    taken = steps * count
    return taken / (time.perf_counter() - clock), taken / (time.process_time() - cpu)


if __name__ == "__main__":
    raise SystemExit(main())
