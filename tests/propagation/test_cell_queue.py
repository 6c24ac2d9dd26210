"""The parts of cost_to_come: sweeps, the frontier they leave, and the queue that follows it up."""

import jax
import jax.numpy as jnp
import numpy as np

from srt_jax.engine import packing
from srt_jax.propagation import cell_queue, frontier, row_sweeps
from tests.helpers.maps import any_start, noise, random_maps
from tests.helpers.slow_kernels import costs_by_scipy

STRAIGHT, DIAGONAL = np.uint32(5741), np.uint32(8119)


def _field(cost, free):
    """A bordered field from costs of SciPy."""
    value = np.where(free, np.where(np.isinf(cost), 2**31 - 1 - 8119, cost), 2**31).astype(
        np.uint32
    )
    return np.pad(value, 1, constant_values=2**31)


def _can_improve(field):
    """Cells from which a legal move lowers a neighbour's cost, move by move."""
    value = field.astype(np.int64)
    free = value < 2**31
    found = np.zeros(field.shape, bool)
    for r, c in np.argwhere(free):
        for dr, dc in cell_queue.CLOCKWISE:
            cost = 8119 if dr and dc else 5741
            if free[r + dr, c + dc] and free[r, c + dc] and free[r + dr, c]:
                found[r, c] |= value[r, c] + cost < value[r + dr, c + dc]
    return found[1:-1, 1:-1]


def test_the_frontier_is_the_cells_that_can_lower_a_neighbour():
    rng = np.random.default_rng(0)
    find = jax.jit(frontier.frontier)
    for one, start in zip(*random_maps(70, 12, 20, 40)[:2]):
        cost = costs_by_scipy(one, start, 5741, 8119)
        field = _field(cost, one)
        words = find(jnp.asarray(field), STRAIGHT, DIAGONAL)
        assert not words.any()
        raised = np.where(
            (field < 2**30) & (rng.random(field.shape) < 0.1), field + np.uint32(3000), field
        )
        words = find(jnp.asarray(raised), STRAIGHT, DIAGONAL)
        assert np.array_equal(packing.unpack(words[None], one.shape[1])[0], _can_improve(raised))


def test_the_list_holds_every_cell_in_coarse_order_of_cost():
    rng = np.random.default_rng(1)
    mask = rng.random((30, 70)) < 0.1
    cost = jnp.asarray(rng.integers(0, 2**24, 32 * 72).astype(np.uint32))
    cells, num = frontier.list_cells(packing.pack(jnp.asarray(mask)[None])[0], 72, 1024)
    assert int(num) == mask.sum()
    ordered = np.asarray(frontier.cheapest_first(cells, num, cost))
    row, col = np.argwhere(mask).T
    assert sorted(ordered[: int(num)]) == sorted((row + 1) * 72 + col + 1)
    assert not ordered[int(num) :].any()
    bins = np.asarray(cost)[ordered[: int(num)]] >> 14
    assert (np.diff(bins.astype(int)) >= 0).all()


def test_a_list_that_is_too_short_is_full():
    cells, num = frontier.list_cells(packing.pack(jnp.ones((1, 8, 40), bool))[0], 42, 64)
    assert num == 63 and cells.shape == (64,)


def test_a_queue_that_is_too_short_reports_it_and_repeating_ends_at_the_exact_costs():
    free = noise(np.random.default_rng(3), 60, 60, 0.1)
    start = any_start(np.random.default_rng(4), free)
    expected = _field(costs_by_scipy(free, start, 5741, 8119), free)
    beside = cell_queue.neighbours(jnp.asarray(free))

    @jax.jit
    def spread(field):
        cells, num = frontier.list_cells(frontier.frontier(field, STRAIGHT, DIAGONAL), 62, 32)
        cost = field.reshape(-1)
        sources = frontier.cheapest_first(cells, num, cost)
        cost, is_short = cell_queue.spread(
            cost, beside, sources, jnp.uint32(5741), jnp.uint32(8119), 62
        )
        return cost.reshape(62, 62), is_short, num

    field = row_sweeps.new_field(jnp.asarray(free), jnp.asarray(start), jnp.uint32(8119))
    was_short = False
    for _ in range(1000):
        field, is_short, num = spread(field)
        was_short |= bool(is_short)
        if num == 0:
            break
    assert was_short and np.array_equal(field, expected)


def test_sweeps_alone_settle_an_empty_map():
    free = np.ones((40, 70), bool)
    field = row_sweeps.new_field(jnp.asarray(free), jnp.array([13, 50]), jnp.uint32(8119))
    field = jax.jit(row_sweeps.four_sweeps)(field, jnp.uint32(5741), jnp.uint32(8119))
    assert np.array_equal(field, _field(costs_by_scipy(free, (13, 50), 5741, 8119), free))
