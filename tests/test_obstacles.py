"""Cells that open, obstacles that border: masks in machine words, equal to NumPy on arrays of
cells.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import ndimage

from srt_jax import obstacles
from srt_jax.engine import packing
from srt_jax.engine.batching import batch_kernel
from tests.helpers.jitted import Jitted
from tests.helpers.slowly import slow

SHAPES = [
    (1, 1, 1, 1, 1),
    (2, 2, 5, 31, 7),
    (3, 1, 9, 32, 40),
    (2, 3, 6, 33, 600),
    (1, 2, 12, 97, 32),
]
"""B, L, H, W, M: beside the ends of words, and more obstacles than are picked by comparing."""


def random_labels(shape, seed=0):
    B, L, H, W, M = shape
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, M, (B, L, H, W)).astype(np.int32)
    labels[rng.random(labels.shape) < 0.6] = -1
    labels[:, 0][rng.random((B, H, W)) < 0.1] = -2
    return labels, rng


jitted = Jitted(packing, unpack=(1,))


def unpacked(words, width):
    return np.asarray(jitted.unpack(words, width))


def open_without(labels, gone):
    return ((labels == -1) | ((labels >= 0) & gone[labels.clip(0)])).all(axis=0)


def covered_by_any(labels, which):
    return ((labels >= 0) & which[labels.clip(0)]).any(axis=0)


# Jitted once, not in each test: the shares of cells are not part of the program.


@functools.cache
def in_batch(fun, count):
    return jax.jit(batch_kernel(lambda *args: fun(*args, count)))


@functools.cache
def alone(fun, count):
    """Returns `fun` of one task of a batch, outside a marked call: there, as on a GPU, it takes
    another way.
    """
    return jax.jit(lambda labels, which, *args: fun(obstacles.Labels(labels, which), *args, count))


@jax.jit
def opened_in_steps(labels, first, new):
    def in_steps(own, first, new):
        known = obstacles.survey(own, len(first))
        before = obstacles.opened(own, known, first, known.free, first)
        return known.free, obstacles.opened(own, known, first | new, before, new)

    return batch_kernel(lambda *args: obstacles.of_all(in_steps, *args))(labels, first, new)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(
    ("cells", "expected"),
    [(obstacles.all_open_cells, open_without), (obstacles.all_cells_of, covered_by_any)],
)
def test_a_cell_opens_when_all_its_owners_are_gone_and_is_of_obstacles_when_any_covers_it(
    shape, cells, expected
):
    labels, rng = random_labels(shape)
    sets = rng.random((shape[0], shape[4])) < 0.5
    got = jax.jit(batch_kernel(cells))(labels, sets)
    for one, which, words in zip(labels, sets, got):
        assert np.array_equal(unpacked(words[None], shape[3])[0], expected(one, which))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.05, 0.5])
def test_cells_opened_step_by_step_are_those_open_at_the_end(shape, share):
    labels, rng = random_labels(shape, seed=2)
    first, new = (rng.random((shape[0], shape[4])) < share for _ in range(2))
    free, end = opened_in_steps(labels, first, new)
    for one, gone, at_first, words in zip(labels, first | new, free, end):
        nothing = np.zeros_like(gone)
        assert np.array_equal(unpacked(at_first[None], shape[3])[0], open_without(one, nothing))
        assert np.array_equal(unpacked(words[None], shape[3])[0], open_without(one, gone))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("num_obstacles", [0, obstacles.MANY])
def test_obstacles_met_by_a_region_cover_a_cell_beside_it(shape, num_obstacles):
    labels, rng = random_labels(shape, seed=4)
    # runs and columns of one label, of which not every cell is looked at
    labels = np.repeat(np.repeat(labels, 3, axis=2), 3, axis=3)[:, :, : shape[2], : shape[3]]
    passable = (labels == -1).all(axis=1)
    reached = passable & (rng.random(passable.shape) < 0.3)

    among = rng.random((len(labels), shape[4])) < np.linspace(1, 0.3, len(labels))[:, None]

    def met(own, *args):
        return obstacles.met_beside(own, obstacles.survey(own, num_obstacles), *args)

    met_by_all = batch_kernel(lambda *args: obstacles.of_all(met, *args))
    words = [packing.pack(jnp.asarray(mask)) for mask in (reached, passable)]
    got = np.asarray(jax.jit(met_by_all)(labels, *words, among))
    for one, region, free, asked, which in zip(labels, reached, passable, among, got):
        padded = np.pad(region, 1)
        beside = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
        owners = one[:, beside & ~free]
        expected = np.intersect1d(owners, np.flatnonzero(asked))
        assert np.array_equal(np.flatnonzero(which), expected)


@pytest.mark.parametrize("num_obstacles", [1, 40, 300])
def test_the_members_of_a_set_are_listed_in_ascending_order(num_obstacles):
    rng = np.random.default_rng(num_obstacles)
    sets = rng.random((4, num_obstacles)) < np.array([0, 0.05, 0.5, 1])[:, None]
    for one, ids in zip(sets, np.asarray(jax.jit(obstacles.ids_of)(sets))):
        members = np.flatnonzero(one)
        assert np.array_equal(ids[: len(members)], members)
        assert (ids[len(members) :] == -1).all()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0.2, *slow(0, 1)])
def test_the_nearness_of_an_obstacle_is_that_of_its_nearest_cell(shape, share):
    labels, rng = random_labels(shape, seed=3)
    B, _, H, W, M = shape
    cells = rng.random((B, H, W)) < share
    goals = np.stack([rng.integers(0, H, B), rng.integers(0, W, B)], axis=1).astype(np.int32)
    words = jitted.pack(cells)
    fast = in_batch(obstacles.all_nearest_of, M)(labels, words, goals)
    plainly = alone(obstacles.nearest_of, M)
    for which, (one, in_mask, (row, col)) in enumerate(zip(labels, cells, goals)):
        down, across = (abs(place) for place in np.mgrid[-row : H - row, -col : W - col])
        order = np.maximum(down, across) * 5741 + np.minimum(down, across) * 2378
        expected = [
            min(order[((one == i).any(axis=0)) & in_mask], default=obstacles.FAR) for i in range(M)
        ]
        assert fast[which].tolist() == expected
        assert plainly(labels, np.int32(which), words[which], goals[which]).tolist() == expected


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("share", [0, 0.2, 1])
def test_the_obstacles_met_are_the_owners_of_the_cells_in_the_mask(shape, share):
    labels, rng = random_labels(shape, seed=1)
    cells = rng.random(labels[:, 0].shape) < share
    words = jitted.pack(cells)
    fast = in_batch(obstacles.all_met_by, shape[4])(labels, words)
    plainly = alone(obstacles.met_by, shape[4])
    for which, (one, in_mask) in enumerate(zip(labels, cells)):
        owners = set(one[:, in_mask].ravel().tolist()) - {-1, -2}
        assert set(np.flatnonzero(fast[which]).tolist()) == owners
        assert (
            set(np.flatnonzero(plainly(labels, np.int32(which), words[which])).tolist()) == owners
        )


@pytest.mark.parametrize("shape", SHAPES)
def test_beside_a_mask_are_the_cells_that_share_a_side_with_it(shape):
    _, _, height, width, _ = shape
    cells = np.random.default_rng(2).random((height, width)) < 0.15
    mask = jitted.pack(cells[None])
    got = unpacked(jax.jit(obstacles.beside)(mask[0])[None], width)[0]
    padded, expected = np.pad(cells, 1), np.zeros_like(cells)
    for down, across in ((0, 1), (2, 1), (1, 0), (1, 2)):
        expected |= padded[down : down + height, across : across + width]
    assert np.array_equal(got, expected)
    assert np.array_equal(got | cells, ndimage.binary_dilation(cells))
    dilated = unpacked(jitted.dilate(mask), width)[0]
    assert np.array_equal(dilated, ndimage.binary_dilation(cells, np.ones((3, 3))))


def test_one_cell_is_in_its_own_mask_and_no_other():
    only = jax.jit(lambda cell: obstacles.only(cell, 5, 3))
    holds = jax.jit(obstacles.holds)
    for row, col in ((0, 0), (0, 31), (2, 32), (4, 69)):
        mask = only(jnp.array([row, col], jnp.int32))
        assert np.argwhere(unpacked(mask[None], 70)[0]).tolist() == [[row, col]]
        held = [
            [bool(holds(mask, jnp.array([r, c], jnp.int32))) for c in (0, 31, 32, 69)]
            for r in (0, 2, 4)
        ]
        assert sum(map(sum, held)) == 1


def test_the_owners_of_a_cell_are_those_that_cover_it():
    labels = np.array([[[[-1, 0, 3]], [[-1, 2, -1]]]], np.int32)
    one = obstacles.Labels(jnp.asarray(labels), jnp.int32(0))
    owners = [
        np.flatnonzero(obstacles.owners_of(one, jnp.array([0, col], jnp.int32), 4)).tolist()
        for col in range(3)
    ]
    assert owners == [[], [0, 2], [3]]
