"""The campaign in small: its maps are what they claim, it passes, it notices what is wrong. And
what a call compiles.
"""

import jax
import numpy as np
import pytest

import srt_jax
from experiments.campaigns import kernels
from experiments.campaigns.compile_seconds import call_kernel
from experiments.campaigns.inputs import kernel_maps as maps
from experiments.campaigns.judges.kernel_truth import reached_by_scipy, route_problem


@pytest.fixture(scope="module")
def compiled():
    """The programs compiled since it was last cleared."""
    events: list[str] = []
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, duration_secs, **_: (
            events.append(event) if "backend_compile" in event else None
        )
    )
    return events


@pytest.mark.slow
def test_random_maps_snakes_and_slow_twins_agree(capsys):
    assert kernels.main(["--quick"]) == 0
    printed = capsys.readouterr().out
    assert "0 checks failed" in printed and "data: left out" in printed
    for check in (
        "padded on all sides",
        "contour is the wall follower's trace",
        "trace_path holds every cell",
    ):
        assert check in printed


def test_a_wrong_kernel_is_reported_with_what_brings_the_map_back(monkeypatch, capsys):
    def blind(free, start):
        reached = np.array(srt_jax.cost_to_come(free, start))
        return np.where(reached > 40, np.inf, reached).astype(np.float32)  # a false "unreached"

    monkeypatch.setattr(
        kernels.srt_jax, "reach", lambda free, start: np.isfinite(blind(free, start))
    )
    assert kernels.main(["--quick", "--only", "random", "--seed", "3"]) == 1
    printed = capsys.readouterr()
    assert (
        "random, reach equals scipy.ndimage.label: " in printed.err
        and "seed 3, number " in printed.err
    )
    assert "turned by 90: no bit changes" in printed.out


def test_an_unknown_part_is_refused(capsys):
    with pytest.raises(SystemExit):
        kernels.main(["--only", "randon"])
    assert "there is no part 'randon'" in capsys.readouterr().err


@pytest.mark.parametrize("side", [20, 23, 64])
def test_corridors_are_connected_and_are_dense(side):
    for known in (maps.snake(side, side), maps.stairs(side)):
        assert np.array_equal(
            reached_by_scipy(known.free[None], np.array([known.start]))[0], known.free
        )
        assert known.length == known.free.sum() - 1 > side * side / 2 - side
    with pytest.raises(ValueError, match="not a corridor"):
        maps.corridor("square", np.ones((4, 4), bool))


def test_scipy_on_a_batch_keeps_the_maps_apart():
    free = np.ones((3, 4, 5), bool)
    free[1, :, 2] = False
    reached = reached_by_scipy(free, np.array([[0, 0], [0, 0], [-1, 0]]))
    assert reached.sum((1, 2)).tolist() == [20, 8, 0]


def test_a_route_that_cuts_a_corner_is_reported():
    free = np.ones((2, 2), bool)
    route = np.array([[0, 0], [1, 1]])
    assert route_problem(free, (0, 0), (1, 1), route, 2**0.5) == ""
    assert "not 1.4" in route_problem(free, (0, 0), (1, 1), route, 1.4)
    free[0, 1] = False
    assert "blocked" in route_problem(free, (0, 0), (1, 1), route, 2**0.5)


@pytest.mark.parametrize("kernel", kernels.KERNELS)
def test_a_kernel_is_compiled_once_per_size_and_batch_bucket_and_nothing_else_is(kernel, compiled):
    # what all kernels share
    call_kernel("seed_cell" if kernel == "reach" else "reach", np.ones((1, 8, 8), bool))
    for counts in ((1,), (3, 4)):  # two buckets
        num_compiled = []
        for shape in ((count, side, side - 1) for side in (29, 32, 25) for count in counts):
            compiled.clear()
            jax.block_until_ready(call_kernel(kernel, np.ones(shape, bool)))
            num_compiled.append(len(compiled))
        assert num_compiled[0] <= 1 and not any(num_compiled[1:])


def test_single_maps_of_new_sizes_compile_nothing_though_they_are_jax_arrays(compiled):
    for side in (29, 27, 25):
        free, goal = np.ones((side, side - 1), bool), np.array([side - 1, 3], np.int32)
        seed = srt_jax.seed_cell(srt_jax.reach(free, (0, 0)), goal)
        srt_jax.contour(free, seed, goal)
        path = srt_jax.trace_path(srt_jax.cost_to_come(free, (0, 0)), goal, max_cells=90)
        assert path.cells.shape == (90, 2) and path.num_cells.shape == () and seed.shape == (2,)
        assert side == 29 or not compiled
        compiled.clear()
