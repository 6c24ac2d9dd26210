import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from srt_jax.engine import packing
from srt_jax.moves import FIXED_POINTS
from srt_jax.propagation.lengths import UNREACHED, Field, cheapest, cost_field
from tests.helpers.maps import any_start, city, maze, noise, random_maps, read_map, rooms, snake
from tests.helpers.pictures import drawn
from tests.helpers.slow_kernels import costs_by_scipy, lengths_by_heap

_field = jax.jit(cost_field)


def _assert_exact(free, start, cost, scale):
    expected = costs_by_scipy(free, start, *FIXED_POINTS[int(scale)])
    assert np.array_equal(np.where(cost == UNREACHED, np.inf, cost), expected)


def test_lengths_go_round_the_wall_and_diagonals_need_both_sides():
    free, places = drawn("""
        S.@
        .@.
        ...
    """)
    length = np.asarray(srt_jax.cost_to_come(free, places["S"]))
    assert np.allclose(length, [[0, 1, np.inf], [1, np.inf, 5], [2, 3, 4]])
    free[1, 1] = True
    length = np.asarray(srt_jax.cost_to_come(free, places["S"]))
    assert np.allclose(
        length, [[0, 1, np.inf], [1, 2**0.5, 1 + 2**0.5], [2, 1 + 2**0.5, 2 * 2**0.5]]
    )


@pytest.mark.parametrize("seed", range(2))
def test_costs_equal_scipys_dijkstra_on_every_cell_of_random_maps(seed):
    free, starts, sizes = random_maps(100 + seed, 256, 130, 97)
    cost, scale = (np.asarray(part) for part in _field(free, starts))
    for one, start, (tall, wide), got, which in zip(free, starts, sizes, cost, scale):
        _assert_exact(one[:tall, :wide], start, got[:tall, :wide], which)
        assert (got[~one] == UNREACHED).all()


def test_lengths_equal_a_heap_dijkstra_in_floating_point():
    free, starts, _ = random_maps(7, 40, 15, 19)
    for one, start, got in zip(free, starts, np.asarray(srt_jax.cost_to_come(free, starts))):
        np.testing.assert_allclose(got, lengths_by_heap(one, start), rtol=2e-7)


def test_costs_equal_scipys_dijkstra_on_outside_maps(shared_data):
    rng = np.random.default_rng(0)
    for path in sorted(p for p in shared_data.glob("*/*.map") if p.parent.name != "hunt"):
        free = read_map(path)
        if free.size > 70_000:  # the larger ones take SciPy too long
            continue
        start, (height, width) = any_start(rng, free), free.shape
        side = 64 if max(free.shape) <= 64 else 256  # few shapes to compile
        padded = np.zeros((1, side, side), bool)
        padded[0, :height, :width] = free
        cost, scale = _field(padded, start[None])
        _assert_exact(free, start, np.asarray(cost[0, :height, :width]), scale[0])


@pytest.mark.parametrize(
    "free",
    [
        maze(np.random.default_rng(0), 256, 190),
        maze(np.random.default_rng(1), 256, 190, 8),
        rooms(np.random.default_rng(2), 256, 190),
        city(np.random.default_rng(3), 256, 190),
        noise(np.random.default_rng(4), 256, 190, 0.2),
        noise(np.random.default_rng(4), 190, 256, 0.35),
        np.ones((256, 190), bool),
        np.zeros((190, 256), bool),
        snake(256, 190),
    ],
    ids=["maze", "wide maze", "rooms", "city", "noise", "dense noise", "empty", "full", "snake"],
)
def test_sweeps_and_queue_together_are_exact_on_every_kind_of_map(free):
    rng = np.random.default_rng(6)
    for start in (any_start(rng, free), any_start(rng, free)):
        cost, scale = _field(free[None], start[None])
        _assert_exact(free, start, np.asarray(cost[0]), scale[0])


def test_a_snake_of_a_million_cells_is_measured_to_its_end():
    free = snake(1100, 1100)
    length = np.asarray(srt_jax.cost_to_come(free, (0, 0)))
    assert np.array_equal(np.isfinite(length), free)
    assert length[free].max() == free.sum() - 1 > 600_000


@pytest.mark.parametrize("shape", [(1, 1), (1, 2000), (2000, 1), (2, 900)])
def test_corridors_of_a_row_or_a_column_are_exact(shape):
    free = np.ones(shape, bool)
    start = (shape[0] - 1, shape[1] // 2)
    np.testing.assert_allclose(
        srt_jax.cost_to_come(free, start), lengths_by_heap(free, start), rtol=2e-7
    )


def test_straight_lengths_are_whole_numbers_and_diagonals_are_exact_to_float32():
    length = np.asarray(srt_jax.cost_to_come(np.ones((700, 700), bool), (0, 0)))
    assert np.array_equal(length[0], np.arange(700))
    np.testing.assert_allclose(np.diag(length), np.arange(700) * 2**0.5, rtol=1.3e-7)


@pytest.mark.parametrize("start", [(-1, 0), (0, -1), (5, 0), (0, 7), (2**31 - 1, 0), (-(2**31), 3)])
def test_from_a_start_outside_the_map_nothing_is_reached(start):
    assert np.isinf(srt_jax.cost_to_come(np.ones((5, 7), bool), np.array(start, np.int32))).all()


def test_from_a_blocked_start_nothing_is_reached():
    free = np.ones((9, 9), bool)
    free[4, 4] = False
    assert np.isinf(srt_jax.cost_to_come(free, (4, 4))).all()


def test_turning_mirroring_transposing_and_padding_change_no_bit():
    free = noise(np.random.default_rng(5), 45, 70, 0.3)
    mark = np.zeros(free.shape, bool)
    mark[tuple(np.argwhere(free)[700])] = True
    expected = np.asarray(srt_jax.cost_to_come(free, np.argwhere(mark)[0].astype(np.int32)))
    for change in (np.rot90, np.flipud, np.fliplr, np.transpose):
        got = srt_jax.cost_to_come(
            change(free).copy(), np.argwhere(change(mark))[0].astype(np.int32)
        )
        assert np.array_equal(got, change(expected))
    padded = jax.jit(srt_jax.cost_to_come)(
        np.pad(free, ((3, 900), (40, 700))), (np.argwhere(mark)[0] + [3, 40]).astype(np.int32)
    )
    assert np.array_equal(padded[3:48, 40:110], expected)


def test_the_path_there_is_as_long_as_the_path_back():
    rng = np.random.default_rng(8)
    free = noise(rng, 60, 60, 0.35)
    a, b = any_start(rng, free), any_start(rng, free)
    assert srt_jax.cost_to_come(free, a)[tuple(b)] == srt_jax.cost_to_come(free, b)[tuple(a)]


def test_each_map_of_a_batch_has_the_bits_it_has_alone():
    free, starts, _ = random_maps(3, 6, 40, 50)
    expected = [np.asarray(srt_jax.cost_to_come(*one)) for one in zip(free, starts)]
    assert np.array_equal(srt_jax.cost_to_come(free, starts), np.stack(expected))


def test_without_the_marks_the_bits_are_the_same(monkeypatch):
    free, starts, _ = random_maps(3, 6, 40, 50)
    expected = np.asarray(_field(free, starts).cost)
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    assert np.array_equal(jax.jit(lambda *args: cost_field(*args).cost)(free, starts), expected)


def test_every_scenario_of_a_street_map_has_its_published_length(shared_data):
    path = shared_data / "street" / "Berlin_0_256.map"
    free = read_map(path)
    rows = [
        line.split() for line in (path.parent / (path.name + ".scen")).read_text().splitlines()[1:]
    ]
    starts = np.array([[int(row[5]), int(row[4])] for row in rows], np.int32)
    goals = np.array([[int(row[7]), int(row[6])] for row in rows], np.int32)
    lengths = np.asarray(srt_jax.cost_to_come(np.broadcast_to(free, (64, 256, 256)), starts[-64:]))
    got = lengths[np.arange(64), goals[-64:, 0], goals[-64:, 1]]
    np.testing.assert_allclose(got, [float(row[8]) for row in rows[-64:]], rtol=1e-6)


@pytest.mark.parametrize("share", [0, 0.01, 1])
def test_the_cheapest_cell_of_a_mask_is_the_first_of_the_least(share):
    rng = np.random.default_rng(7)
    for height, width in ((1, 1), (5, 31), (9, 33), (40, 70)):
        cost = rng.integers(0, 12, (3, height, width)).astype(np.int32)
        cost[rng.random(cost.shape) < 0.3] = UNREACHED
        among = rng.random(cost.shape) < share
        got = jax.jit(cheapest)(
            Field(cost, np.zeros(3, np.int32)), packing.pack(jnp.asarray(among))
        )
        for values, asked, cell in zip(cost, among, got):
            values = np.where(asked, values, UNREACHED)
            best = (
                np.unravel_index(values.argmin(), values.shape)
                if values.min() < UNREACHED
                else (-1, -1)
            )
            assert tuple(cell.tolist()) == tuple(int(place) for place in best)
