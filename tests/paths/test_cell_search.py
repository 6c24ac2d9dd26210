"""The search cell by cell behind routes on rough ground, and when it is taken, against the slow
twin.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from sign_model.foundation.marks import compiled_whole
from srt_jax.engine import packing
from srt_jax.engine.batching import each
from srt_jax.moves import FIXED_POINTS
from srt_jax.paths import cell_search, shortest
from srt_jax.paths.path import at_front
from srt_jax.reference.first_path import first_path
from tests.helpers.maps import any_start, city, maze, noise, random_maps, rooms, snake

NOWHERE = np.array([[-1, 3], [2, 2**31 - 1]], np.int32)


@functools.cache
def _kernel(width, room=None):
    """A jitted function of (free, start, goal, pair) of a batch: the cells, their number, the cost
    and whether the queue was too short.
    """

    def one_map(words, start, goal, pair):
        straight, diagonal = pair
        costs = cell_search.search(words, start, goal, straight, diagonal, width, room)
        cells = jnp.full((2000, 2), -1, jnp.int32)
        cells, num = cell_search.walk_back(costs, goal, straight, diagonal, width, cells)
        is_there = costs.goal != 0
        return at_front(cells, num, is_there), jnp.where(is_there, num, 0), costs.is_short

    return jax.jit(compiled_whole(functools.partial(each, one_map)))


def _assert_is_first(free, starts, goals, pair=FIXED_POINTS[0]):
    pairs = np.broadcast_to(np.array(pair, np.uint32), (len(free), 2))
    found = _kernel(free.shape[2])(packing.pack(free), starts, goals, pairs)
    cells, nums, is_short = jax.tree.map(np.asarray, found)
    assert not is_short.any()
    for i, (start, goal) in enumerate(zip(starts.tolist(), goals.tolist())):
        _, expected = first_path(free[i], tuple(start), tuple(goal), *pair)
        assert list(map(tuple, cells[i, : nums[i]].tolist())) == expected, (i, start, goal)
        assert (cells[i, nums[i] :] == -1).all()


def _ends(seed, free):
    rng = np.random.default_rng(seed)
    ends = np.stack([[any_start(rng, one) for _ in range(2)] for one in free])
    ends[5::16, rng.integers(2)] = NOWHERE[seed % 2]
    return ends.swapaxes(0, 1)


@pytest.mark.parametrize("shape", [(40, 50), (33, 97)])
def test_the_path_is_the_first_on_random_maps(shape):
    free = random_maps(93, 96, *shape)[0]
    _assert_is_first(free, *_ends(0, free))


def _kinds(tall, wide):
    """Maps on which it is taken, and those on which it is not."""
    rng = np.random.default_rng(1)
    rough = [noise(rng, tall, wide, density) for density in (0.05, 0.1, 0.25, 0.35, 0.42)]
    smooth = [noise(rng, tall, wide, 0.01), maze(rng, tall, wide, 4), np.ones((tall, wide), bool)]
    smooth += [rooms(rng, tall, wide, 16), city(rng, tall, wide), np.zeros((tall, wide), bool)]
    return np.stack([*rough, maze(rng, tall, wide, 1)]), np.stack(smooth)


def test_the_path_is_the_first_on_every_kind_of_map():
    free = np.concatenate([*_kinds(96, 120), snake(96, 120)[None]])
    for seed in (1, 2):
        _assert_is_first(free, *_ends(seed, free))


def test_each_fixed_point_gives_its_own_first_path():
    free = np.stack([noise(np.random.default_rng(7), 40, 50, share) for share in (0.1, 0.3)])
    for pair in FIXED_POINTS:
        _assert_is_first(free, *_ends(3, free), pair)


def test_it_is_taken_where_walls_end_everywhere():
    is_rough = jax.vmap(shortest._is_rough)
    rough, smooth = _kinds(128, 160)
    assert is_rough(packing.pack(rough)).all()
    assert not is_rough(packing.pack(smooth)).any()


def test_where_its_queue_is_too_short_jump_points_find_the_path(monkeypatch):
    free = np.stack([noise(np.random.default_rng(8), 50, 61, share) for share in (0.1, 0.2, 0.4)])
    starts, goals = _ends(4, free)
    pairs = np.broadcast_to(np.array(FIXED_POINTS[0], np.uint32), (len(free), 2))
    is_short = _kernel(61, room=4)(packing.pack(free), starts, goals, pairs)[2]
    assert is_short.any()
    expected = srt_jax.shortest_path(free, starts, goals, max_cells=300)
    costs = srt_jax.path_cost(free, starts, goals)
    monkeypatch.setattr(cell_search, "search", functools.partial(cell_search.search, room=4))
    jax.clear_caches()

    @jax.jit
    def once_more(free, starts, goals):
        path = srt_jax.shortest_path(free, starts, goals, max_cells=300)
        return path, srt_jax.path_cost(free, starts, goals)

    path, lengths = once_more(free, starts, goals)
    assert jax.tree.all(jax.tree.map(np.array_equal, path, expected))
    assert np.array_equal(lengths, costs)
    jax.clear_caches()
