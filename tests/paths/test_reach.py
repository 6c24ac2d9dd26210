import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import srt_jax
from sign_model.foundation.marks import compiled_whole
from srt_jax.engine import eager, packing
from srt_jax.engine.batching import each
from srt_jax.paths.reach import cells_in_group, flood, flood_group, reach_maps
from tests.helpers.maps import city, maze, noise, random_maps, read_map, rooms, snake
from tests.helpers.pictures import drawn
from tests.helpers.slow_kernels import reach_by_label, reach_by_steps


def test_the_flood_fills_what_the_wall_leaves_open_and_cuts_no_corner():
    free, places = drawn("""
        S.@...
        ..@...
        @@..@.
        ...@..
    """)
    reached = srt_jax.reach(free, places["S"])
    assert np.array_equal(reached, [[1, 1, 0, 0, 0, 0], [1, 1, 0, 0, 0, 0], [0] * 6, [0] * 6])


@pytest.mark.parametrize("seed", range(4))
def test_it_equals_scipy_on_random_maps_of_every_size_and_density(seed):
    free, starts, sizes = random_maps(seed, 500, 130, 97)
    reached = np.asarray(srt_jax.reach(free, starts))
    for one, start, (tall, wide), got in zip(free, starts, sizes, reached):
        assert np.array_equal(got[:tall, :wide], reach_by_label(one[:tall, :wide], start))
        assert got.sum() == got[:tall, :wide].sum()


def test_four_moves_reach_what_eight_moves_do():
    free, starts, _ = random_maps(9, 60, 17, 23)
    for one, start, got in zip(free, starts, np.asarray(srt_jax.reach(free, starts))):
        assert np.array_equal(got, reach_by_steps(one, start))


def test_it_equals_scipy_on_every_outside_map(shared_data):
    rng = np.random.default_rng(0)
    paths = sorted(p for p in shared_data.glob("*/*.map") if p.parent.name != "hunt")
    assert len(paths) > 15
    for path in paths:
        free = read_map(path)
        cells = np.argwhere(free)
        starts = cells[rng.integers(len(cells), size=2)].astype(np.int32)
        for start in starts:
            assert np.array_equal(srt_jax.reach(free, start), reach_by_label(free, start)), (
                path.name
            )


@pytest.mark.parametrize(
    "free",
    [
        maze(np.random.default_rng(0), 255, 190),
        maze(np.random.default_rng(1), 256, 256, 8),
        snake(256, 131),
        snake(131, 256).T,
        rooms(np.random.default_rng(2), 200, 256),
        city(np.random.default_rng(3), 256, 256),
        noise(np.random.default_rng(4), 256, 256, 0.38),
    ],
    ids=["maze", "wide maze", "snake", "upright snake", "rooms", "city", "dense noise"],
)
def test_maps_that_need_many_turns_are_flooded_to_the_end(free):
    start = np.argwhere(free)[0]
    assert np.array_equal(srt_jax.reach(free, start.astype(np.int32)), reach_by_label(free, start))


@pytest.mark.parametrize(
    "start", [(-1, 0), (0, -1), (5, 0), (0, 7), (-5, -7), (2**31 - 1, 0), (-(2**31), 3)]
)
def test_a_start_outside_the_map_reaches_nothing(start):
    assert not srt_jax.reach(np.ones((5, 7), bool), np.array(start, np.int32)).any()


def test_a_blocked_start_reaches_nothing():
    free, places = drawn("..@S".replace("S", "."))
    assert not srt_jax.reach(free, (0, 2)).any()
    assert srt_jax.reach(free, (0, 0)).sum() == 2
    assert not places


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (300, 1), (2, 33), (33, 2)])
def test_an_empty_map_is_reached_whole_and_a_full_one_not_at_all(shape):
    assert srt_jax.reach(np.ones(shape, bool), (0, 0)).all()
    assert not srt_jax.reach(np.zeros(shape, bool), (0, 0)).any()


def test_turning_mirroring_transposing_and_padding_carry_over():
    rng = np.random.default_rng(5)
    free = noise(rng, 45, 70, 0.37)
    mark = np.zeros(free.shape, bool)
    mark[tuple(np.argwhere(free)[700])] = True
    expected = reach_by_label(free, np.argwhere(mark)[0])
    for change in (
        np.rot90,
        np.flipud,
        np.fliplr,
        np.transpose,
        lambda x: np.pad(x, ((3, 9), (40, 1))),
    ):
        start = np.argwhere(change(mark))[0].astype(np.int32)
        assert np.array_equal(srt_jax.reach(change(free).copy(), start), change(expected))


def test_jit_vmap_and_batches_of_unequal_maps_give_the_same_bits():
    free, starts, _ = random_maps(3, 12, 40, 50)
    expected = np.stack([np.asarray(srt_jax.reach(one, start)) for one, start in zip(free, starts)])
    assert np.array_equal(srt_jax.reach(free, starts), expected)
    assert np.array_equal(jax.jit(srt_jax.reach)(free, starts), expected)
    assert np.array_equal(
        jax.vmap(srt_jax.reach, in_axes=(2, 1), out_axes=1)(free.transpose(1, 2, 0), starts.T),
        expected.swapaxes(0, 1),
    )
    assert np.array_equal(
        srt_jax.reach(free.reshape(2, 6, 40, 50), starts.reshape(2, 6, 2)),
        expected.reshape(2, 6, 40, 50),
    )


def test_one_map_for_many_starts_may_stay_unbatched_under_vmap():
    free = noise(np.random.default_rng(0), 30, 41, 0.4)
    starts = np.argwhere(free)[:6].astype(np.int32)
    for start, got in zip(starts, jax.vmap(srt_jax.reach, in_axes=(None, 0))(free, starts)):
        assert np.array_equal(got, reach_by_label(free, start))


def test_sizes_of_one_bucket_share_one_compilation():
    for height, width in ((100, 120), (128, 97), (99, 128)):
        srt_jax.reach(np.ones((3, height, width), bool), np.zeros((3, 2), np.int32))
    program = eager._jitted(reach_maps, ()).form(True, True)
    count = program.num_programs()
    assert count > 0
    srt_jax.reach(np.zeros((4, 111, 111), bool), np.ones((4, 2), np.int32))
    assert program.num_programs() == count


def test_without_the_marks_the_bits_are_the_same(monkeypatch):
    free, starts, _ = random_maps(3, 12, 40, 50)
    expected = np.asarray(jax.jit(reach_maps)(free, starts))
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    assert np.array_equal(jax.jit(lambda *args: reach_maps(*args))(free, starts), expected)


def test_a_cell_of_each_map_is_set_where_it_is_free_and_none_outside_the_map():
    free = np.ones((4, 4, 40), bool)
    free[1, 0, 0] = False
    lanes = packing.to_lanes(packing.pack(jnp.asarray(free)), 4)[0]
    cells = jnp.array([[2, 33], [0, 0], [-1, 5], [3, 39]], jnp.int32)
    marks = cells_in_group(lanes, cells)
    mask = np.asarray(packing.unpack(packing.from_lanes(marks[None], 4, 4), 40))
    assert [np.argwhere(one).tolist() for one in mask] == [[[2, 33]], [], [], [[3, 39]]]
    outside = jnp.array([[3, 40], [4, 0], [0, 2**31 - 1], [0, -1]], jnp.int32)
    assert not cells_in_group(lanes, outside).any()


@pytest.mark.parametrize("may_be_small", [False, True])
@pytest.mark.parametrize("through_corners", [False, True])
def test_a_flood_from_many_sources_fills_every_piece_that_holds_one(through_corners, may_be_small):
    from scipy import ndimage

    rng = np.random.default_rng(int(through_corners))
    passable, _, _ = random_maps(21, 64, 70, 66)
    # from many cells to a single one, where a short queue is enough and where not
    shares = rng.choice([0.004, 1e-4], len(passable))[:, None, None]
    sources = (rng.random(passable.shape) < shares) & passable

    def one(free, reached):
        words = (packing.pack(mask[None])[0] for mask in (free, reached))
        options = {"through_corners": through_corners, "may_be_small": True}
        return packing.unpack(flood_group(*words, group=1, **options)[None], 66)[0]

    def small(passable, sources):
        return compiled_whole(functools.partial(each, one))(passable, sources)

    large = functools.partial(flood, through_corners=through_corners)
    run = jax.jit(small if may_be_small else large)
    for one, source, got in zip(passable, sources, np.asarray(run(passable, sources))):
        labels, _ = ndimage.label(one, np.ones((3, 3)) if through_corners else None)
        assert np.array_equal(got, np.isin(labels, np.setdiff1d(labels[source], [0])))


def test_wrong_input_is_named_with_its_remedy():
    with pytest.raises(TypeError, match=r"free must be bool.*astype"):
        srt_jax.reach(np.ones((3, 3)), (0, 0))
    with pytest.raises(TypeError, match="start must hold integers"):
        srt_jax.reach(np.ones((3, 3), bool), np.zeros(2))
    with pytest.raises(ValueError, match="batch dimensions must be equal"):
        srt_jax.reach(np.ones((2, 3, 3), bool), np.zeros((3, 2), np.int32))
