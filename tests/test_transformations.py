"""Every public kernel, and solve, inside JAX's transformations: the same bits as called plainly on
the whole batch.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from tests.helpers.labelled import random_tasks
from tests.helpers.maps import any_start, noise
from tests.helpers.slowly import slow

B, H, W = 4, 11, 13


class Case(NamedTuple):
    """A function and a batch of arguments: a tuple of pytrees of arrays with one leading batch
    axis.
    """

    fun: Callable
    args: tuple


def cases() -> dict[str, Case]:
    rng = np.random.default_rng(41)
    free = np.stack([noise(rng, H, W, density) for density in (0.0, 0.2, 0.35, 0.5)])
    start, goal = (np.stack([any_start(rng, one) for one in free]) for _ in range(2))
    costs = rng.uniform(0.5, 4, free.shape).astype(np.float32)
    reached, cost = (
        np.asarray(srt_jax.reach(free, start)),
        np.asarray(srt_jax.cost_to_come(free, start)),
    )
    seed = np.asarray(srt_jax.seed_cell(reached, goal))
    tasks = jax.tree.map(np.asarray, srt_jax.stack(random_tasks(42, B, overlap=True, max_side=11)))
    return {
        "reach": Case(srt_jax.reach, (free, start)),
        "cost_to_come": Case(srt_jax.cost_to_come, (free, start)),
        "cost_to_come of unequal cells": Case(srt_jax.cost_to_come, (free, start, costs)),
        "path_cost": Case(srt_jax.path_cost, (free, start, goal, costs)),
        "path_cost without costs": Case(srt_jax.path_cost, (free, start, goal)),
        "shortest_path": Case(
            lambda *args: srt_jax.shortest_path(*args, max_cells=32), (free, start, goal)
        ),
        "trace_path": Case(
            lambda cost, goal: srt_jax.trace_path(cost, goal, max_cells=32), (cost, goal)
        ),
        "octile_distance": Case(srt_jax.octile_distance, (seed, goal)),
        "seed_cell": Case(srt_jax.seed_cell, (reached, goal)),
        "contour": Case(srt_jax.contour, (free, seed, goal)),
        "solve": Case(lambda task: srt_jax.solve(task, max_cells=64), (tasks,)),
        "least_removal": Case(
            lambda task: srt_jax.least_removal(task, max_cells=64, with_route=True), (tasks,)
        ),
    }


CASES = cases()
# These take longest to compile: test_solver_batches transforms `solve`, too, the tests of gradients
# `least_removal`, and what searches without costs is like `shortest_path`.
LONG = ("solve", "least_removal", "path_cost without costs")
SHORT = [name for name in CASES if name not in LONG]
NAMES = pytest.mark.parametrize("name", [*SHORT, *slow(*LONG)])


def assert_same_bits(got, expected):
    got, expected = jax.tree.leaves(got), jax.tree.leaves(expected)
    assert len(got) == len(expected)
    for one, other in zip(got, expected):
        assert np.array_equal(one, other)


@NAMES
def test_nested_vmap_along_any_axes_in_a_branch_of_a_scan_gives_the_same_bits(name):
    """All in one program, since each takes long to compile: the maps are constants of it, a step of
    the scan takes half of them, seen by two nested vmaps along the last axis and the first.
    """
    fun, args = CASES[name]
    expected = jax.tree.map(lambda x: np.reshape(x, (2, 2, *np.shape(x)[1:])), fun(*args))
    # [scan, 1, ..., 2]: the outer vmap goes along axis 0, the inner one along the last
    square = jax.tree.map(
        lambda x: np.moveaxis(np.reshape(x, (2, 1, 2, *x.shape[1:])), 2, -1), args
    )
    nested = jax.vmap(jax.vmap(fun, in_axes=-1), in_axes=0, out_axes=1)
    first = jax.tree.map(lambda x: jnp.zeros((x.shape[1], 1, *x.shape[2:]), x.dtype), expected)

    def step(carry, index):
        entry = jax.tree.map(lambda x: jnp.asarray(x)[index], square)
        out = jax.lax.cond(index >= 0, lambda: nested(*entry), lambda: first)
        return out, out

    got = jax.jit(lambda order: jax.lax.scan(step, first, order)[1])(jnp.arange(2))
    assert_same_bits(jax.tree.map(lambda x: x[:, :, 0], got), expected)


@pytest.mark.slow  # calls outside jit are padded, and every test here compares with one
@pytest.mark.parametrize(
    "name", [name for name in CASES if name not in ("solve", "least_removal", "octile_distance")]
)
def test_padding_and_the_batch_around_a_map_change_no_bit(name):
    """That of tasks is padded in test_solver_batches; octile_distance has no map."""
    fun, args = CASES[name]
    blocked = np.inf if name == "trace_path" else 0

    def wide(x):
        return (
            np.pad(x, ((0, 2), (0, 6), (0, 9)), constant_values=blocked)
            if np.ndim(x) == 3
            else np.pad(x, ((0, 2), (0, 0)))
        )

    def cropped(x):
        return x[:B, :H, :W] if x.shape[1:] == (H + 6, W + 9) else x[:B]

    got = jax.jit(fun)(*(wide(np.asarray(x)) for x in args))
    assert_same_bits(jax.tree.map(lambda x: cropped(np.asarray(x)), got), fun(*args))


def test_a_map_shared_by_many_starts_need_not_be_repeated():
    free, start, costs = CASES["cost_to_come of unequal cells"].args
    got = jax.jit(jax.vmap(srt_jax.cost_to_come, in_axes=(None, 0, None)))(free[0], start, costs[0])
    assert_same_bits(got, np.stack([srt_jax.cost_to_come(free[0], one, costs[0]) for one in start]))


def _total(costs, free, start):
    cost = srt_jax.cost_to_come(free, start, costs)
    return jnp.where(jnp.isfinite(cost), cost, 0).sum()


def test_gradients_under_vmap_scan_and_jit_are_those_of_the_batch():
    free, start, costs = CASES["cost_to_come of unequal cells"].args
    expected = jax.grad(_total)(costs, free, start)
    one_by_one = jax.jit(jax.vmap(jax.grad(_total)))(costs, free, start)
    through = jax.grad(
        lambda costs: jax.lax.scan(
            lambda c, x: (c + _total(*x), None), jnp.float32(0), (costs, free, start)
        )[0]
    )
    for got in (one_by_one, through(costs)):
        np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.slow
@pytest.mark.skipif(
    not hasattr(jax, "shard_map"), reason="this JAX is older than 0.6: there is no jax.shard_map"
)
def test_arrays_spread_over_devices_give_the_same_bits():
    """In a process of its own, since the number of devices is fixed when JAX starts: shard_map, jit
    on both kinds of mesh.
    """
    env = os.environ | {
        "XLA_FLAGS": "--xla_force_host_platform_device_count=2",
        "JAX_PLATFORMS": "cpu",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    done = subprocess.run([sys.executable, __file__], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    # which is solve
    assert set(done.stdout.split("\n")[:-1]) == {*CASES, "gradient"} - {"least_removal"}


def _spread_over_devices():
    """Prints the name of every case that gives the same bits however its arguments are spread."""
    from jax.sharding import Mesh, NamedSharding, PartitionSpec

    split, meshes = PartitionSpec("maps"), [Mesh(np.array(jax.devices()), ("maps",))]
    if hasattr(jax, "make_mesh"):
        meshes.append(jax.make_mesh((2,), ("maps",)))
    assert len(jax.devices()) == 2
    spread = {name: case for name, case in CASES.items() if name != "least_removal"}
    for name, (fun, args) in spread.items():
        expected = jax.tree.map(np.asarray, fun(*args))
        for mesh in meshes if name != "solve" else ():  # which takes long to compile
            there = jax.tree.map(
                lambda x, mesh=mesh: jax.device_put(x, NamedSharding(mesh, split)), args
            )
            assert_same_bits(jax.jit(fun)(*there), expected)
        sharded = jax.shard_map(fun, mesh=meshes[0], in_specs=split, out_specs=split)
        assert_same_bits(jax.jit(sharded)(*args), expected)
        print(name)
    free, start, costs = CASES["cost_to_come of unequal cells"].args
    gradient = jax.grad(_total)
    sharded = jax.shard_map(gradient, mesh=meshes[0], in_specs=split, out_specs=split)
    np.testing.assert_allclose(
        jax.jit(sharded)(costs, free, start), gradient(costs, free, start), rtol=1e-5, atol=1e-5
    )
    print("gradient")


if __name__ == "__main__":
    _spread_over_devices()
