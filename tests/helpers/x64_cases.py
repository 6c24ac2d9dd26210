"""Small cases of the whole public face. As a program: writes their results, every leaf by its name,
to an npz file.

python x64_cases.py FILE.npz
"""

import sys

import jax
import jax.numpy as jnp
import numpy as np

import srt_jax
from sign_model.blocks import random_blocks_tasks
from sign_model.map_algorithm.heuristics import LANDMARKS
from sign_model.map_batch.ladder import Rung, plan_batch
from sign_model.signs.activation import spread_activation
from srt_jax import envs
from srt_jax.envs.sample import KINDS, sample_levels
from srt_jax.removal.sums import totals
from srt_jax.solver import MODES

_QUICK = (
    "reach",
    "lengths",
    "path",
    "seed",
    "octile",
    "gradient at the goal",
    "exact sums",
    "tolls",
    "critical cells",
    "episode",
    "levels of walls",
    "levels of rooms",
)
"""Those whose bits are compared; the solver's are by its own tests, which `.ci/run` repeats with
x64.
"""


_AS_ONE = ("gradient at the goal", "exact sums")
"""Those jitted here: called step by step, they would be compiled step by step."""


def ground():
    """Returns three noisy maps and what the kernels need besides: a dictionary of NumPy arrays."""
    rng = np.random.default_rng(0)
    free = rng.random((3, 12, 14)) < 0.7
    free[:, 0, 0] = free[:, -1, -1] = True
    return {
        "free": free,
        "start": np.zeros((3, 2), np.int32),
        "goal": np.full((3, 2), [11, 13], np.int32),
        "cost": (rng.random(free.shape) + 0.5).astype(np.float32),
        "removal_cost": rng.choice([0.5, 1.0, 3.0], 100).astype(np.float32),
        "hard_cost": (10.0 ** rng.uniform(-44.8, 38.5, (3, 24))).astype(np.float32),
        "which": rng.random((3, 24)) < 0.5,
    }


def tasks(given):
    """Returns the maps as one batch of tasks, costs of obstacles unequal."""
    few = [srt_jax.make_task(free, (0, 0), (11, 13)) for free in given["free"]]
    few = [
        task.replace(removal_cost=given["removal_cost"][: len(task.removal_cost)]) for task in few
    ]
    return srt_jax.stack(few)


def numeric_cases(given):
    """Returns name -> (function, arguments) of what can be traced."""
    free, start, goal, cost = (given[name] for name in ("free", "start", "goal", "cost"))
    key = jax.random.key(3)
    batch = tasks(given)
    env, params = small_environment(given)

    def at_goal(cost):
        return srt_jax.path_cost(free, start, goal, cost).sum()

    def everywhere(cost):
        come = srt_jax.cost_to_come(free, start, cost)
        return jnp.where(jnp.isfinite(come), come, jnp.float32(0)).sum()

    def tolled(removal_cost, cost):
        come = srt_jax.toll_to_come(batch.labels, removal_cost, start, cost)
        return jnp.where(jnp.isfinite(come), come, jnp.float32(0)).sum()

    def noisy(pathwise):
        def fun(cost):
            return srt_jax.path_cost(free[0], start[0], start[0] + 3, cost)

        smooth = srt_jax.perturbed(fun, num_samples=2, temperature=0.1, pathwise=pathwise)
        return jax.value_and_grad(lambda cost, key: smooth(key, cost))

    def removal(removal_cost):
        return srt_jax.least_removal(batch.replace(removal_cost=removal_cost)).sum()

    def episode(key):
        seen, state = env.reset(key, params)
        return (
            seen,
            env.step(key, state, jnp.int32(4), params),
            env.action_mask(state, params),
            env.action_space().sample(key),
        )

    def solved(mode):
        return lambda batch: srt_jax.solve(batch, mode=mode, max_destroyed=3)

    return {
        "reach": (srt_jax.reach, free, start),
        "lengths": (srt_jax.cost_to_come, free, start),
        "costs": (srt_jax.cost_to_come, free, start, cost),
        "path": (lambda cost, goal: srt_jax.trace_path(cost, goal, max_cells=40), cost, goal),
        "shortest_path": (
            lambda *args: srt_jax.shortest_path(*args, max_cells=40),
            free,
            start,
            goal,
        ),
        "path_cost": (srt_jax.path_cost, free, start, goal),
        "path_within": (
            lambda *args: srt_jax.path_within(*args, 3.0, max_cells=40),
            free,
            start,
            goal,
        ),
        "seed": (srt_jax.seed_cell, free, goal),
        "contour": (srt_jax.contour, free, start, goal),
        "tolls": (srt_jax.toll_to_come, batch.labels, 4 * batch.removal_cost, start),
        "tolls and costs": (srt_jax.toll_to_come, batch.labels, batch.removal_cost, start, cost),
        "gradient of the tolls": (jax.grad(tolled, (0, 1)), batch.removal_cost, cost),
        "critical cells": (srt_jax.critical_cells, free, start, goal),
        "octile": (srt_jax.octile_distance, start, goal),
        "gradient at the goal": (jax.value_and_grad(at_goal), cost),
        "gradient everywhere": (jax.grad(everywhere), cost),
        "perturbed, pathwise": (noisy(True), cost[0], key),
        "perturbed, by the score": (noisy(False), cost[0], key),
        "exact sums": (totals, given["hard_cost"], given["which"]),
        "gradient of the removal": (jax.grad(removal), batch.removal_cost),
        "episode": (episode, key),
        **{
            f"levels of {kind}": (
                lambda key, kind=kind: sample_levels(key, count=3, kind=kind),
                key,
            )
            for kind in KINDS
        },
        **{f"mode {mode}": (solved(mode), batch) for mode in MODES},
    }


def small_environment(given):
    """Returns an environment of three levels, and its parameters; the oracle is not asked."""
    few = [srt_jax.make_task(free, (0, 0), (11, 13)) for free in given["free"]]
    return envs.make(levels=envs.make_levels(few, oracle=False), radius=2)


def symbolic_cases():
    """Returns name -> arrays of the symbolic level."""
    ladder = (Rung(beam=4, branch=8, steps=32, lanes=16),)
    plans = plan_batch(
        random_blocks_tasks(4, 5, seed=1), heuristic=LANDMARKS, ladder=ladder, num_threads=1
    )
    from tests.helpers.sign_worlds import face_signs, model_of

    model = model_of(face_signs())
    active = model.features(["face"]).astype(np.float32)
    decay = np.array([0.5, 0.25, 0.75], np.float32)
    return {
        "plans": np.array([" ".join(plan.actions) for plan in plans]),
        "activation": spread_activation(model.matrices, active, decay=decay, steps=3),
    }


def results():
    """Returns every leaf of the results that compile in a few seconds, NumPy arrays by name."""
    cases = {name: case for name, case in numeric_cases(ground()).items() if name in _QUICK}
    found = {
        name: (jax.jit(fun) if name in _AS_ONE else fun)(*args)
        for name, (fun, *args) in cases.items()
    }
    leaves = jax.tree_util.tree_flatten_with_path(found | symbolic_cases())[0]
    return {jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in leaves}


if __name__ == "__main__":
    jax.config.update("jax_numpy_rank_promotion", "raise")
    jax.config.update("jax_numpy_dtype_promotion", "strict")
    np.savez(sys.argv[1], **results())
