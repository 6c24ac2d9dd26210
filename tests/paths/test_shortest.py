"""The shortest path to one goal, cell by cell as the slow twin finds it, in every form."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from sign_model.foundation.marks import compiled_whole
from srt_jax.engine import packing
from srt_jax.engine.batching import each, each_keeping
from srt_jax.moves import FIXED_POINTS, max_path_cells
from srt_jax.paths import jump_points
from srt_jax.paths.corners import NO_COST, Room
from srt_jax.paths.jump_walk import walk_back
from srt_jax.paths.path import at_front
from srt_jax.reference.first_path import first_path
from tests.helpers.maps import any_start, city, maze, noise, random_maps, rooms, snake
from tests.helpers.slowly import slow

STRAIGHT, DIAGONAL = FIXED_POINTS[0]


def ends_on(seed, free):
    """A start and a goal on each map: free cells, some of them any cell, also outside."""
    rng = np.random.default_rng(seed)
    ends = np.stack([[any_start(rng, one) for _ in range(2)] for one in free])
    anywhere = rng.integers(-1, np.array(free.shape[1:]) + 1, ends.shape).astype(np.int32)
    return np.where((np.arange(len(free)) % 11 == 3)[:, None, None], anywhere, ends).swapaxes(0, 1)


def assert_is_first(path, free, starts, goals):
    """The path has the cells of the twin's, and the length of `cost_to_come`, bit for bit."""
    path = jax.tree.map(np.asarray, path)  # JAX would compile a slice of every length
    assert np.array_equal(path.cost, _costs_at(free, starts, goals))
    for i, (one, start, goal) in enumerate(zip(free, starts.tolist(), goals.tolist())):
        _, cells = first_path(one, tuple(start), tuple(goal), STRAIGHT, DIAGONAL)
        num = int(path.num_cells[i])
        assert list(map(tuple, path.cells[i, :num].tolist())) == cells, (i, start, goal)
        assert (path.cells[i, num:] == -1).all() and np.isinf(path.cost[i]) == (num == 0)


def _no_cells(count):
    return jnp.full((count, 2), -1, jnp.int32)


def _costs_at(free, starts, goals):
    costs = np.asarray(srt_jax.cost_to_come(free, starts))
    is_inside = ((goals >= 0) & (goals < free.shape[1:])).all(1)
    row, col = np.where(is_inside[:, None], goals, 0).T
    return np.where(is_inside, costs[np.arange(len(free)), row, col], np.inf)


@pytest.mark.parametrize("shape", [(40, 50), (33, 97), *slow((64, 64), (7, 9))])
def test_on_random_maps_of_all_sizes_from_one_cell(shape):
    free, starts, _ = random_maps(90, 192, *shape)
    _, goals = ends_on(1, free)
    path = srt_jax.shortest_path(free, starts, goals, max_cells=max_path_cells(*shape))
    assert_is_first(path, free, starts, goals)
    assert 60 < (np.asarray(path.num_cells) > 0).sum() < 192


@pytest.mark.parametrize("seed", [*slow(0), 1])
def test_on_rough_and_open_ground_in_rooms_and_mazes(seed):
    rng = np.random.default_rng(seed)
    tall, wide = (95, 127) if seed else (128, 100)
    free = [
        *(maze(rng, tall, wide, corridor) for corridor in (1, 3, 8)),
        snake(tall, wide),
        rooms(rng, tall, wide),
        city(rng, tall, wide),
        np.ones((tall, wide), bool),
        *(noise(rng, tall, wide, density) for density in (0.02, 0.1, 0.2, 0.3, 0.4, 0.45)),
    ]
    free = np.stack(free * 2)
    starts, goals = ends_on(seed, free)
    assert_is_first(srt_jax.shortest_path(free, starts, goals), free, starts, goals)


@pytest.mark.parametrize("shape", [(1, 1), (1, 70), (32, 31), *slow((70, 1), (2, 64), (31, 33))])
def test_on_single_rows_and_columns_and_small_maps(shape):
    rng = np.random.default_rng(3)
    free = rng.random((64, *shape)) >= rng.choice([0, 0.02, 0.2], (64, 1, 1))
    starts, goals = ends_on(3, free)
    assert_is_first(srt_jax.shortest_path(free, starts, goals), free, starts, goals)


def test_start_and_goal_may_be_one_cell_but_not_a_blocked_one():
    free = np.array([[[True, False]]] * 2)
    cells = np.array([[0, 0], [0, 1]], np.int32)
    path = srt_jax.shortest_path(free, cells, cells, max_cells=2)
    assert path.num_cells.tolist() == [1, 0] and path.cost.tolist() == [0, np.inf]
    assert path.cells.tolist() == [[[0, 0], [-1, -1]], [[-1, -1], [-1, -1]]]


@pytest.mark.parametrize("end", [(-1, 2), (2, 5), (7, 0), (2**31 - 1, -(2**31)), (-(2**31), 3)])
def test_there_is_no_path_to_or_from_a_cell_outside(end):
    free, end = np.ones((3, 5), bool), np.array(end, np.int32)
    for ends in ((end, np.array([1, 1])), (np.array([1, 1]), end), (end, end)):
        path = srt_jax.shortest_path(free, *ends)
        assert path.num_cells == 0 and np.isinf(path.cost) and (path.cells == -1).all()
        assert np.isinf(srt_jax.path_cost(free, *ends))


def test_where_the_queue_is_too_short_corners_wait_outside():
    rng = np.random.default_rng(4)
    free = np.stack(
        [noise(rng, 60, 70, density) for density in (0.1, 0.2, 0.3)]
        + [rooms(rng, 60, 70), city(rng, 60, 70), np.ones((60, 70), bool)]
    )
    starts, goals = ends_on(5, free)

    def one_map(room, words, start, goal, places):
        pair = jnp.uint32(STRAIGHT), jnp.uint32(DIAGONAL)
        best, corners = jump_points.search(words, start, goal, *pair, 70, places, room)
        is_there = best.cost != NO_COST
        cells, num = walk_back(best, corners, goal, *pair, 70, _no_cells(400))
        return (at_front(cells, num, is_there), best.cost), corners.room

    words = packing.pack(free)
    cells, costs = srt_jax.shortest_path(free, starts, goals, max_cells=400).cells, None
    # what the room holds does not matter
    room = Room(*rng.integers(0, 2**32, (2, 60 * 70), dtype=np.uint32))
    for places in (1 << 10, 8, 2):
        search = functools.partial(one_map, places=places)
        run = functools.partial(each_keeping, search)
        got = jax.jit(compiled_whole(run))(room, words, starts, goals)
        costs = got[1] if costs is None else costs
        assert np.array_equal(got[0], cells) and np.array_equal(got[1], costs)


@pytest.mark.parametrize(
    "height, width", [(64, 64), (512, 512), (2048, 2048), (4096, 4096), (9, 900000)]
)
def test_the_ring_of_buckets_holds_any_leg_and_a_bucket_is_no_wider_than_a_cell(height, width):
    buckets, wider = jump_points._buckets(height, width)
    assert buckets & (buckets - 1) == 0 and (wider == 0 or height < 10)
    for straight, diagonal in FIXED_POINTS:
        one = 1 << (straight.bit_length() - 1 + wider)
        most = 2 * (straight * max(height, width) + diagonal * min(height, width))
        assert most // one + 1 < buckets and (one <= straight or wider > 0)


def test_each_fixed_point_gives_its_own_first_path():
    rng = np.random.default_rng(6)
    free = np.stack([noise(rng, 60, 70, 0.2), rooms(rng, 60, 70), city(rng, 60, 70)])
    starts, goals = ends_on(7, free)

    def one_map(words, start, goal, pair):
        best, corners = jump_points.search(words, start, goal, pair[0], pair[1], 70)
        cells, num = walk_back(best, corners, goal, pair[0], pair[1], 70, _no_cells(400))
        is_there = best.cost != NO_COST
        return at_front(cells, num, is_there), jnp.where(is_there, num, 0)

    run = jax.jit(compiled_whole(functools.partial(each, one_map)))
    for pair in FIXED_POINTS[1::2]:
        pairs = np.broadcast_to(np.array(pair, np.uint32), (3, 2))
        cells, nums = jax.tree.map(np.asarray, run(packing.pack(free), starts, goals, pairs))
        for i, (start, goal) in enumerate(zip(starts.tolist(), goals.tolist())):
            _, own = first_path(free[i], tuple(start), tuple(goal), *pair)
            assert list(map(tuple, cells[i, : nums[i]].tolist())) == own, (pair, i)


def test_the_form_without_marks_gives_the_same_bits(monkeypatch):
    free, starts, _ = random_maps(91, 64, 40, 50)
    _, goals = ends_on(2, free)
    kernel = functools.partial(srt_jax.shortest_path, max_cells=400)
    marked = jax.jit(lambda *args: (kernel(*args), srt_jax.path_cost(*args)))(free, starts, goals)
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    jax.clear_caches()
    plain = jax.jit(lambda *args: (kernel(*args), srt_jax.path_cost(*args)))(free, starts, goals)
    for a, b in zip(jax.tree.leaves(marked), jax.tree.leaves(plain)):
        assert np.array_equal(a, b)


def test_jit_vmap_and_a_batch_give_the_same_path():
    free, starts, _ = random_maps(92, 12, 30, 30)
    _, goals = ends_on(3, free)
    kernel = functools.partial(srt_jax.shortest_path, max_cells=128)
    together = kernel(free, starts, goals)
    forms = (jax.jit(kernel), jax.vmap(kernel), jax.jit(jax.vmap(kernel)))
    for path in (form(free, starts, goals) for form in forms):
        assert jax.tree.all(jax.tree.map(np.array_equal, path, together))
    for i in range(12):
        alone = kernel(free[i], starts[i], goals[i])
        own = jax.tree.map(lambda whole, i=i: whole[i], together)
        assert jax.tree.all(jax.tree.map(np.array_equal, alone, own))
    costs = srt_jax.path_cost(free, starts, goals)
    assert np.array_equal(costs, together.cost) and costs.dtype == np.float32


def test_a_path_longer_than_max_cells_reports_its_true_number_of_cells():
    free = snake(41, 60)
    goal = np.argwhere(free)[-1].astype(np.int32)
    whole = srt_jax.shortest_path(free, (0, 0), goal)
    num = int(whole.num_cells)
    short = srt_jax.shortest_path(free, (0, 0), goal, max_cells=10)
    exactly = srt_jax.shortest_path(free, (0, 0), goal, max_cells=num)
    assert short.num_cells == num > 10 and (short.cells == -1).all() and short.cost == whole.cost
    assert np.array_equal(exactly.cells, whole.cells[:num])


@pytest.mark.slow
def test_large_maps_with_a_coarser_fixed_point_have_the_lengths_of_the_field():
    free = noise(np.random.default_rng(6), 800, 900, 0.1)
    free[1::20, 5:] = False
    free[11::20, :-5] = False
    cells = np.argwhere(free).astype(np.int32)
    start, goal = cells[0], cells[-1]
    path = srt_jax.shortest_path(free, start, goal)
    assert path.cost == srt_jax.cost_to_come(free, start)[tuple(goal)] < np.inf
    assert path.cost == srt_jax.path_cost(free, start, goal)


def test_wrong_arguments_are_refused():
    free = np.ones((3, 3), bool)
    with pytest.raises(ValueError, match="max_cells must be at least 1"):
        srt_jax.shortest_path(free, (0, 0), (2, 2), max_cells=0)
    with pytest.raises(TypeError, match="free must be bool"):
        srt_jax.shortest_path(free.astype(int), (0, 0), (2, 2))
    with pytest.raises(ValueError, match="batch dimensions must be equal"):
        srt_jax.shortest_path(free, np.zeros((2, 2), np.int32), (2, 2))


def test_the_room_of_a_path_does_not_depend_on_the_calls_before():
    """A long path makes room for the next ones of its shape; what they return is as without it."""
    free = snake(20, 20)
    blocked = np.zeros_like(free)
    long = srt_jax.shortest_path(free, (0, 0), _last_cell(free))
    assert int(long.num_cells) > 64  # more than the usual room
    again = srt_jax.shortest_path(free, (0, 0), _last_cell(free))
    short = srt_jax.shortest_path(free, (0, 0), (0, 5))
    once_more = srt_jax.shortest_path(free, (0, 0), (0, 5))
    none = srt_jax.shortest_path(blocked, (0, 0), (0, 5))
    assert again.cells.shape == long.cells.shape and np.array_equal(again.cells, long.cells)
    assert short.cells.shape == once_more.cells.shape == none.cells.shape == (64, 2)
    assert np.array_equal(short.cells, once_more.cells)
    assert short.cells[:6].tolist() == [[0, col] for col in range(6)]


def _last_cell(free):
    return tuple(np.argwhere(free)[-1].tolist())
