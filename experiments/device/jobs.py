"""What is run on both sides: each public function on made-up maps, by the size of the batch."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np


class Job(NamedTuple):
    """A function of the library with its inputs.

    name: as in the table.
    prepare: number of maps -> (function, arguments); the arguments are NumPy arrays in a pytree and
      the same on every machine, the function returns a pytree of arrays.
    """

    name: str
    prepare: Callable[[int], tuple[Callable, tuple]]


def jobs(side: int) -> list[Job]:
    """Returns every job on maps of side x side cells, those that most depend on first."""
    made = functools.partial(_prepared, side)
    return [
        Job("reach", made(_reach)),
        Job("cost_to_come", made(_cost_to_come)),
        Job("solve, least", made(_solve, mode="least")),
        Job("shortest_path", made(_shortest_path)),
        Job("path_cost, costs", made(_path_cost)),
        Job("solve, shortest", made(_solve, mode="shortest")),
        Job("solve, paper", made(_solve, mode="paper")),
        Job("gradient of path_cost", made(_gradient)),
        Job("plan_batch, 8 blocks", _blocks),
        Job("environment, 64 steps", _environment),
        Job("toll_to_come", made(_toll_to_come)),
        Job("seed_cell, contour", made(_blockage)),
        Job("critical_cells", made(_critical)),
        Job("approach", made(_approach)),
        Job("trace_path", made(_trace_path)),
        Job("path_within", made(_path_within)),
        Job("least_removal, gradient", made(_removal_gradient)),
        Job("least_total, gradient", made(_total_gradient)),
        Job("perturbed", made(_perturbed)),
        Job("coalition_reach", functools.partial(_coalition, side, name="coalition_reach")),
        Job("solve_coalition", functools.partial(_coalition, side, name="solve_coalition")),
        Job("solve, literal", made(_solve, mode="literal")),
        Job("octile_distance", made(_octile)),
    ]


def _prepared(side: int, make: Callable, **options: Any) -> Callable[[int], tuple[Callable, tuple]]:
    return lambda count: make(side, count, **options)


@functools.lru_cache(maxsize=2)
def _maps(side: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Noise of 20 %: free bool [count, side, side], start and goal int32 [count, 2]."""
    rng = np.random.default_rng([side, count])
    free = rng.random((count, side, side)) >= 0.2
    free[:, 0, 0] = free[:, -1, -1] = True
    start = np.zeros((count, 2), np.int32)
    return free, start, start + np.int32(side - 1)


@functools.lru_cache(maxsize=2)
def _tasks(side: int, count: int) -> Any:
    """A batch of tasks of every kind; from 256 on the same ones again."""
    from srt_jax import stack
    from srt_jax.instances.generate import generate

    few = [task for _, task, _ in generate("mixed", count=min(count, 256), size=side, seed=0)]
    batch = jax.tree.map(np.asarray, stack(few))
    again = -(-count // len(few))
    return jax.tree.map(lambda array: np.concatenate([array] * again)[:count], batch)


def _costs(side: int, count: int) -> np.ndarray:
    rng = np.random.default_rng([side, count, 1])
    return rng.uniform(1, 10, (count, side, side)).astype(np.float32)


def _reach(side: int, count: int):
    from srt_jax import reach

    free, start, _ = _maps(side, count)
    return reach, (free, start)


def _cost_to_come(side: int, count: int):
    from srt_jax import cost_to_come

    free, start, _ = _maps(side, count)
    return cost_to_come, (free, start)


def _trace_path(side: int, count: int):
    from srt_jax import cost_to_come, trace_path

    free, start, goal = _maps(side, count)
    return (
        lambda free, start, goal: trace_path(cost_to_come(free, start), goal, max_cells=4 * side),
        (free, start, goal),
    )


def _shortest_path(side: int, count: int):
    from srt_jax import shortest_path

    return shortest_path, _maps(side, count)


def _critical(side: int, count: int):
    from srt_jax import critical_cells

    return critical_cells, _maps(side, count)


def _path_within(side: int, count: int):
    from srt_jax import path_within

    deviation = np.full(count, side / 4, np.float32)
    return (
        lambda *arrays: path_within(*arrays, max_cells=4 * side),
        (*_maps(side, count), deviation),
    )


def _path_cost(side: int, count: int):
    from srt_jax import path_cost

    return path_cost, (*_maps(side, count), _costs(side, count))


def _gradient(side: int, count: int):
    from srt_jax import path_cost

    def total(costs, free, start, goal):
        cost = path_cost(free, start, goal, costs)
        return jnp.where(jnp.isfinite(cost), cost, 0).sum()

    return jax.jit(jax.grad(total)), (_costs(side, count), *_maps(side, count))


def _perturbed(side: int, count: int):
    from srt_jax import path_cost, perturbed

    free, start, goal = (array[0] for array in _maps(side, count))
    smooth = perturbed(
        lambda costs: path_cost(free, start, goal, costs),
        num_samples=2 * max(1, count // 2),
        temperature=0.1,
        pathwise=True,
    )
    return (
        jax.jit(lambda costs: smooth(jax.random.key(0), costs)),
        (_costs(side, 1)[0],),
    )


def _blockage(side: int, count: int):
    from srt_jax import contour, reach, seed_cell

    free, start, goal = _maps(side, count)
    free = free.copy()
    free[:, side // 2] = False

    def both(free, start, goal):
        seed = seed_cell(reach(free, start), goal)
        return seed, contour(free, seed, goal)

    return both, (free, start, goal)


def _octile(side: int, count: int):
    from srt_jax import octile_distance

    rng = np.random.default_rng(side)
    ends = rng.integers(0, side, (2, count, 2), dtype=np.int32)
    return octile_distance, (ends[0], ends[1])


def _solve(side: int, count: int, *, mode: str):
    from srt_jax import solve

    # the answer as a plain dict: one name an array
    return lambda task: dict(solve(task, mode=mode).items()), (_tasks(side, count),)


def _approach(side: int, count: int):
    from srt_jax import approach

    return lambda task: dict(approach(task).items()), (_tasks(side, count),)


def _toll_to_come(side: int, count: int):
    from srt_jax import toll_to_come

    task = _tasks(side, count)
    toll = np.where(task.destroyable, 10 * task.removal_cost, np.inf).astype(np.float32)
    return toll_to_come, (task.labels, toll, task.start)


def _removal_gradient(side: int, count: int):
    from srt_jax import least_removal

    def total(costs, task):
        least = least_removal(task.replace(removal_cost=costs))
        return jnp.where(jnp.isfinite(least), least, 0).sum()

    task = _tasks(side, count)
    return jax.jit(jax.value_and_grad(total)), (task.removal_cost, task)


def _total_gradient(side: int, count: int):
    from srt_jax import least_total

    def total(costs, task):
        least = least_total(task.replace(removal_cost=costs))
        return jnp.where(jnp.isfinite(least), least, 0).sum()

    task = _tasks(side, count)
    return jax.jit(jax.value_and_grad(total)), (task.removal_cost, task)


def _coalition(side: int, count: int, *, name: str):
    from srt_jax import coalition

    few = [task for _, task, _ in coalition.helpers(count=min(count, 64), size=side, seed=0)]
    batch = jax.tree.map(np.asarray, coalition.stack_coalitions(few))
    again = -(-count // len(few))
    batch = jax.tree.map(lambda array: np.concatenate([array] * again)[:count], batch)
    return lambda task: dict(getattr(coalition, name)(task).items()), (batch,)


def _blocks(count: int):
    from sign_model import plan_batch
    from sign_model.blocks import random_blocks_tasks

    tasks = random_blocks_tasks(8, count, seed=0)

    def plans_as_text():
        results = plan_batch(tasks, together=1)
        plans = [[str(action) for action in result.actions] for result in results]
        text = "\n".join(" ".join(plan) for plan in plans)
        return np.frombuffer(text.encode(), np.uint8)

    return plans_as_text, ()


def _environment(count: int):
    from srt_jax import envs

    levels = envs.sample_levels(jax.random.key(0), count=64, size=16)
    env, params = envs.make(levels=levels)

    @jax.jit
    def run(seeds):
        keys = jax.vmap(jax.random.key)(seeds)
        _, states = jax.vmap(env.reset, (0, None))(keys, params)

        def step(states, number):
            steps = jax.vmap(jax.random.fold_in, (0, None))(keys, number)
            actions = jax.vmap(lambda key: jax.random.randint(key, (), 0, env.num_actions))(steps)
            _, states, reward, *ends = jax.vmap(env.step, (0, 0, 0, None))(
                steps, states, actions, params
            )
            return states, (reward, ends[0])

        return jax.lax.scan(step, states, jnp.arange(64))[1]

    return run, (np.arange(count, dtype=np.uint32),)
