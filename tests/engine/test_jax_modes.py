"""JAX's switches round a call: jit disabled, another device, transfers guarded, checks for NaN and
leaks, keys of old form.
"""

import os
import pathlib
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from srt_jax.envs.sample import sample_levels

ROOT = pathlib.Path(__file__).resolve().parents[2]
START, GOAL = np.zeros(2, np.int32), np.array([4, 5], np.int32)


def ground():
    free = np.ones((5, 6), bool)
    free[:3, 3] = False
    return free, np.ones((5, 6), np.float32)


def kernels(place=lambda array: array, only=None):
    """Returns name -> answer of the kernels, on arrays that `place` has put somewhere."""
    free, cost, start, goal = (place(array) for array in (*ground(), START, GOAL))
    calls = {
        "reach": lambda: srt_jax.reach(free, start),
        "lengths": lambda: srt_jax.cost_to_come(free, start),
        "costs": lambda: srt_jax.cost_to_come(free, start, cost),
        "path": lambda: (
            srt_jax.trace_path(srt_jax.cost_to_come(free, start), goal, max_cells=12).cells
        ),
        "seed": lambda: srt_jax.seed_cell(free, goal),
        "contour": lambda: srt_jax.contour(free, start, goal),
        "gradient": lambda: jax.grad(lambda cost: srt_jax.path_cost(free, start, goal, cost))(cost),
    }
    return {name: call() for name, call in calls.items() if only is None or name in only}


def equal(one, other):
    return all(np.asarray(one[name]).tobytes() == np.asarray(other[name]).tobytes() for name in one)


def test_kernels_stay_compiled_where_jit_is_disabled():
    expected = kernels()
    with jax.disable_jit():
        assert equal(expected, kernels())
        free = ground()[0]
        assert jax.vmap(srt_jax.reach)(free[None], START[None]).tolist() == [
            expected["reach"].tolist()
        ]


@pytest.mark.parametrize(
    "mode",
    [jax.checking_leaks, lambda: jax.debug_nans(True), lambda: jax.threefry_partitionable(False)],
)
def test_checks_of_jax_find_nothing(mode):
    free = ground()[0]
    expected = srt_jax.cost_to_come(free, START)
    with mode():  # compiled again under each
        assert srt_jax.cost_to_come(free, START).tolist() == expected.tolist()


def test_guarded_transfers_leave_alone_what_lies_on_the_device():
    free, start = jnp.asarray(ground()[0]), jnp.asarray(START)
    run = jax.jit(srt_jax.reach)
    expected = run(free, start).tolist()
    with jax.transfer_guard("disallow"):
        reached = run(free, start)
    assert reached.tolist() == expected


def test_random_keys_of_both_forms_draw_the_same():
    one, other = (
        sample_levels(key, count=2, kind="walls")
        for key in (jax.random.key(5), jax.random.PRNGKey(5))
    )
    assert all((a == b).all() for a, b in zip(one.to_tuple()[:5], other.to_tuple()[:5]))


_ON_THE_SECOND = """
import sys
import jax
sys.path.insert(0, "tests")
import srt_jax
from tests.engine.test_jax_modes import ground, kernels
second, only = jax.devices()[1], sys.argv[1:] or None
for name, answer in kernels(lambda array: jax.device_put(array, second), only).items():
    assert answer.devices() == {second}, (name, answer.devices())
if only:
    sys.exit()
task = jax.device_put(srt_jax.make_task(ground()[0], (0, 0), (4, 5)), second)
answer = srt_jax.solve(task)
assert all(leaf.devices() == {second} for leaf in jax.tree.leaves(answer)), "solve"
assert srt_jax.reach(ground()[0], (0, 0)).devices() == {jax.devices()[0]}
"""

_MANY_ON_THE_DEFAULT = """
import jax
import numpy as np
import srt_jax
from srt_jax import many_tasks, solver
from tests.engine.test_jax_modes import ground
first, second = jax.devices()
places = []
def noted(*args, **options):
    answer = solver.solve_in_room(*args, **options)
    places.append(answer.num_cells.devices())
    return answer
many_tasks.solve_in_room = noted
task = jax.device_put(srt_jax.make_task(ground()[0], (0, 0), (4, 5)), second)
(answer,) = srt_jax.solve_many([task])
with jax.default_device(second):
    (again,) = srt_jax.solve_many([task])
assert places == [{first}, {second}], places
for one, other in zip(jax.tree.leaves(answer), jax.tree.leaves(again)):
    assert isinstance(one, np.ndarray | np.generic) and one.tobytes() == other.tobytes()
"""


def run_on_two_devices(program, *arguments):
    flags = os.environ.get("XLA_FLAGS", "") + " --xla_force_host_platform_device_count=2"
    env = os.environ | {
        "XLA_FLAGS": flags,
        "JAX_PLATFORMS": "cpu",
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        env=env,
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]


def test_an_input_on_the_second_device_is_answered_there():
    run_on_two_devices(_ON_THE_SECOND, "reach", "seed")


@pytest.mark.slow
def test_every_kernel_and_solve_answer_on_the_second_device():
    run_on_two_devices(_ON_THE_SECOND)


@pytest.mark.slow
def test_many_tasks_are_solved_on_the_default_device_wherever_they_lie():
    run_on_two_devices(_MANY_ON_THE_DEFAULT)
