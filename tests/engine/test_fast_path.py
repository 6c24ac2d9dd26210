"""No size takes a kernel off the fast path: what XLA refuses inside a marked call is in none of
them.

The thresholds and how they were found: `sign_model.foundation.marks`. Nothing here is run at full
size, only traced or compiled.
"""

import re
import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from sign_model.foundation import marks
from srt_jax.engine.packing import unpack
from srt_jax.removal.branch_and_bound import search_least
from srt_jax.removal.paper_loop import Symbolic, greedy_walk
from srt_jax.removal.prices import goal_prices
from srt_jax.solver import MODES
from srt_jax.symbols.planning import ATTENDED, first_act, plan_along_chain, plan_on_contour
from srt_jax.types import Task

needs_marks = pytest.mark.skipif(
    not marks.is_marking(), reason="this JAX is older than 0.8: no call can be marked"
)

_TO_A_LIBRARY = 4096
"""Entries from which on XLA hands a reduction of floats to a library (jaxlib 0.10)."""

_CALL = re.compile(r"call @([\w.]+)\(")
_REDUCE = re.compile(
    r"stablehlo\.reduce\(%\S+ init: %\S+ applies stablehlo\.(\w+) across .*? :"
    r" \(tensor<([\dx]*)x(\w+)>,"
)


def shape(*sides, dtype=jnp.int32):
    return jax.ShapeDtypeStruct(sides, dtype)


def task_of(batch=1, layers=1, height=8, width=8, obstacles=8):
    ends = {name: shape(batch, 2) for name in ("start", "goal", "size")}
    flags, costs = (
        shape(batch, obstacles, dtype=jnp.bool_),
        shape(batch, obstacles, dtype=jnp.float32),
    )
    return Task(
        labels=shape(batch, layers, height, width), destroyable=flags, removal_cost=costs, **ends
    )


def marked_functions(text):
    """The functions of a lowered program that lie in a marked call, by name."""
    functions = {part.split("(")[0].split("@")[1]: part for part in text.split("func.func ")[1:]}
    calls = [line for line in text.splitlines() if "xla_cpu_small_call" in line]
    waiting = {name for line in calls for name in _CALL.findall(line)}
    found = {}
    while waiting:
        name = waiting.pop()
        found[name] = functions[name]
        waiting |= set(_CALL.findall(functions[name])) - set(found)
    return found


def refused_reductions(fun, *args):
    """The reductions in marked calls that XLA would hand to a library."""
    marked = marked_functions(jax.jit(fun).lower(*args).as_text())
    assert marked
    found = [one for part in marked.values() for one in _REDUCE.findall(part)]
    return [
        (how, sides, dtype)
        for how, sides, dtype in found
        if np.prod([int(side) for side in sides.split("x")]) >= _TO_A_LIBRARY
        and (dtype.startswith(("f", "bf")) or (dtype in ("i8", "ui8") and how != "add"))
        and how in ("add", "minimum", "maximum")
    ]


def removal(task, room, among, capacity=64, max_nodes=256):
    return search_least(task, room, among, capacity=capacity, max_nodes=max_nodes)


def greedy(task, room, among):
    symbolic = Symbolic(first_act(), plan_on_contour, ATTENDED, False)
    return greedy_walk(task, among, room, symbolic, max_destroyed=8, capacity=128)


def of_room(batch=1):
    return shape(batch), shape(batch, dtype=jnp.bool_)


@needs_marks
def test_the_search_for_operations_that_the_compiler_refuses_finds_them():
    floats = shape(64, 64, dtype=jnp.float32)
    assert refused_reductions(marks.compiled_whole(lambda x: jnp.min(x) + x), floats)
    assert refused_reductions(marks.compiled_whole(lambda x: jnp.sum(x, axis=1)), floats)
    assert not refused_reductions(
        marks.compiled_whole(lambda x: jnp.sum(x)), shape(64, 63, dtype=jnp.float32)
    )
    with pytest.raises(jax.errors.JaxRuntimeError, match="Fusion kind not implemented"):
        jax.jit(marks.compiled_whole(jnp.sum)).lower(shape(4096, dtype=jnp.float32)).compile()


LARGEST = {"height": 4096, "width": 4096, "obstacles": 1 << 20, "layers": 4}


@needs_marks
@pytest.mark.parametrize("sides", [LARGEST, {"batch": 1 << 16}], ids=str)
def test_no_stage_of_the_solver_holds_an_operation_that_is_refused(sides):
    task, rest = task_of(**sides), of_room(sides.get("batch", 1))
    nodes = lambda *args: removal(*args, capacity=1 << 16, max_nodes=1 << 16)  # noqa: E731
    assert not refused_reductions(nodes, task, *rest)
    assert not refused_reductions(goal_prices, task, rest[1])
    assert not refused_reductions(greedy, task, *rest)
    chain = lambda num, here: plan_along_chain(num, here, num_slots=64)  # noqa: E731
    assert not refused_reductions(chain, *of_room(sides.get("batch", 1)))


@needs_marks
@pytest.mark.parametrize("sides", [(1, 4096, 4096), (1, 1, 70000), (1 << 16, 4, 4)], ids=str)
def test_no_public_kernel_holds_an_operation_that_is_refused(sides):
    free, cell, costs = (
        shape(*sides, dtype=jnp.bool_),
        shape(sides[0], 2),
        shape(*sides, dtype=jnp.float32),
    )
    summed = lambda costs, free, start: srt_jax.cost_to_come(free, start, costs).sum()  # noqa: E731
    at_goal = lambda costs, free, start, goal: srt_jax.path_cost(free, start, goal, costs).sum()  # noqa: E731
    trace = lambda cost, goal: srt_jax.trace_path(cost, goal, max_cells=1 << 16)  # noqa: E731
    tolled = lambda *args: srt_jax.toll_to_come(*args).sum()  # noqa: E731
    labels, tolls = shape(sides[0], 1, *sides[1:]), shape(sides[0], 8, dtype=jnp.float32)
    for fun, *args in (
        (srt_jax.reach, free, cell),
        (srt_jax.cost_to_come, free, cell),
        (srt_jax.path_cost, free, cell, cell),
        (jax.grad(summed), costs, free, cell),
        (jax.grad(at_goal), costs, free, cell, cell),
        (srt_jax.seed_cell, free, cell),
        (srt_jax.contour, free, cell, cell),
        (trace, costs, cell),
        (srt_jax.critical_cells, free, cell, cell),
        (srt_jax.toll_to_come, labels, tolls, cell),
        (jax.grad(tolled, (1, 3)), labels, tolls, cell, costs),
    ):
        assert not refused_reductions(fun, *args)


@needs_marks
@pytest.mark.parametrize(
    ("fun", "args"),
    [
        (goal_prices, (task_of(obstacles=4096), shape(1, dtype=jnp.bool_))),
        (removal, (task_of(obstacles=1 << 20), *of_room())),
    ],
)
def test_the_compiler_takes_more_obstacles_than_it_once_did(fun, args):
    jax.jit(fun).lower(*args).compile()


@needs_marks
@pytest.mark.parametrize("sides", [(1, 640, 640), (64, 130, 97)], ids=str)
@pytest.mark.parametrize("fun", [srt_jax.reach, srt_jax.contour, srt_jax.seed_cell])
def test_the_compiler_takes_a_large_map_and_many_outside_any_jit(fun, sides):
    free = np.ones(sides, bool)
    ends = [np.zeros((sides[0], 2), np.int32)] * (2 if fun is srt_jax.contour else 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        jax.block_until_ready(fun(free, *ends))


AXES = [
    {"obstacles": 2049},
    {"obstacles": 1 << 20},
    {"layers": 64},
    {"batch": 1 << 14},
    {"height": 4096, "width": 4096},
    {"max_destroyed": 100},
    {"max_cells": 1 << 17},
    {"max_branches": 1 << 16},
]


@needs_marks
@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("axis", AXES, ids=str)
def test_the_compiler_takes_every_axis_of_solve_in_every_mode(mode, axis):
    options = {name: value for name, value in axis.items() if name.startswith("max_")}
    task = task_of(**{name: value for name, value in axis.items() if name not in options})
    jax.jit(lambda task: srt_jax.solve(task, mode=mode, **options)).lower(task).compile()


def test_obstacles_that_cover_no_cell_change_no_bit_of_the_least_removal():
    rng = np.random.default_rng(1)
    labels = np.full((1, 1, 8, 8), -1, np.int32)
    labels[0, 0, :, 3:5] = rng.integers(0, 5, (8, 2))
    costs = rng.lognormal(0, 2, 5).astype(np.float32)

    def found(count):
        task = Task(
            labels=labels,
            destroyable=np.pad(np.ones((1, 5), bool), ((0, 0), (0, count - 5))),
            removal_cost=np.pad(costs[None], ((0, 0), (0, count - 5)), constant_values=1),
            start=np.array([[0, 0]], np.int32),
            goal=np.array([[7, 7]], np.int32),
            size=np.array([[8, 8]], np.int32),
        )
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            out = marks.jitted(removal)(task, np.array([64], np.int32), np.array([True]))
        return jax.tree.map(np.asarray, out._replace(needed=out.needed[:, :5]))

    few, many = found(5), found(2049)
    assert 0 < few.bound < np.inf and (few.needed < 64).any() and unpack(few.reached, 8).any()
    jax.tree.map(np.testing.assert_array_equal, few, many)


@needs_marks
def test_a_refused_search_of_plans_falls_back_alone():
    run = marks.jitted_wide(
        lambda x, *, twice: marks.compiled_whole(lambda x: x.at[x].add(twice))(x),
        static_argnames=("twice",),
    )
    x = np.array([0, 2, 2], np.int32)
    with pytest.warns(UserWarning, match="refuses the fast form") as warned:
        assert run(x, twice=2).tolist() == [2, 2, 6]
    assert len(warned) == 1 and "\n" not in str(warned[0].message) and marks.is_marking()
