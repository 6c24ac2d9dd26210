import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax.engine import packing
from tests.helpers.jitted import Jitted

jitted = Jitted(
    packing,
    unpack=(1,),
    to_lanes=(1,),
    from_lanes=(1, 2),
    quads_to_lanes=(1,),
    words_inside=(1, 2),
    words_of_cell=(1, 2),
    dilate=(1,),
)


@pytest.mark.parametrize("width", [1, 31, 32, 33, 64, 97])
def test_words_hold_the_columns_as_numpy_packs_bits(width):
    mask = np.random.default_rng(width).random((3, 4, width)) < 0.5
    words = np.asarray(jitted.pack(jnp.asarray(mask)))
    wide = np.pad(mask, ((0, 0), (0, 0), (0, -width % 32)))
    assert np.array_equal(words, np.packbits(wide, axis=-1, bitorder="little").view("<u4"))
    assert np.array_equal(jitted.unpack(jnp.asarray(words), width), mask)


@pytest.mark.parametrize("batch, group", [(1, 1), (5, 4), (8, 8), (3, 8)])
def test_lanes_hold_the_maps_of_a_group_side_by_side_and_turn_back_into_words(batch, group):
    words = np.random.default_rng(0).integers(0, 2**32, (batch, 6, 3), dtype=np.uint32)
    lanes = jitted.to_lanes(jnp.asarray(words), group)
    assert lanes.shape == (-(-batch // group), 6, 3 * group)
    assert np.array_equal(lanes[0, :, group::group], words[0, :, 1:])
    assert np.array_equal(jitted.from_lanes(lanes, group, batch), words)


def test_the_bytes_of_a_mask_go_into_the_same_lanes_as_its_words():
    mask = np.random.default_rng(1).random((4, 5, 96)) < 0.5
    lanes = jitted.quads_to_lanes(jnp.asarray(mask.view(np.uint32)), 2)
    assert np.array_equal(lanes, jitted.to_lanes(jitted.pack(jnp.asarray(mask)), 2))


@pytest.mark.parametrize("height, width", [(5, 31), (4, 32), (6, 70), (1, 1)])
def test_words_of_cells_and_of_what_is_inside_are_the_packed_masks(height, width):
    rows, cols = np.mgrid[:height, :width]
    sizes = np.array(
        [[height, width], [1, 1], [height, width - 1], [2, 33], [3, 32]], np.int32
    ).clip(1, [height, width])
    inside = np.stack([(rows < tall) & (cols < wide) for tall, wide in sizes])
    words = jitted.words_inside(jnp.asarray(sizes), height, width)
    assert np.array_equal(words, jitted.pack(jnp.asarray(inside)))
    cells = np.array(
        [[0, 0], [-1, 0], [0, -1], [height - 1, width - 1], [0, width], [height, 0]], np.int32
    )
    only = np.stack([(rows == row) & (cols == col) for row, col in cells])
    words = jitted.words_of_cell(jnp.asarray(cells), height, width)
    assert np.array_equal(words, jitted.pack(jnp.asarray(only)))


def test_groups_fit_the_cache_and_are_no_larger_than_the_batch_needs():
    assert packing.group_size(1, 64, 64) == 1
    assert packing.group_size(3, 64, 64) == 4
    assert packing.group_size(1000, 64, 64) == 32
    assert packing.group_size(1000, 2048, 2048) == 1


@pytest.mark.parametrize("group", [1, 4])
def test_dilated_masks_hold_what_touches_a_cell_by_side_or_corner(group):
    masks = np.random.default_rng(3).random((4, 9, 96)) < 0.06
    lanes = jitted.to_lanes(jitted.pack(jnp.asarray(masks)), group)
    words = jitted.from_lanes(jitted.dilate(lanes, group), group, 4)
    padded, expected = np.pad(masks, ((0, 0), (1, 1), (1, 1))), np.zeros_like(masks)
    for down in range(3):
        for right in range(3):
            expected |= padded[:, down : down + 9, right : right + 96]
    assert np.array_equal(jitted.unpack(words, 96), expected)


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 1.0])
def test_each_set_cell_is_visited_once_in_row_order(share):
    mask = np.random.default_rng(4).random((5, 70)) < share

    def note(out, row, col):
        cells, num = out
        return cells.at[num].set(jnp.stack([row, col])), num + 1

    first = jnp.zeros((5 * 70, 2), jnp.uint32), jnp.int32(0)
    words = jitted.pack(jnp.asarray(mask)[None])[0]
    cells, num = jax.jit(lambda words: packing.for_each_cell(words, note, first))(words)
    assert np.array_equal(cells[:num], np.argwhere(mask))


@pytest.mark.parametrize("width", [1, 31, 32, 33, 512])
def test_a_row_of_tests_is_packed_as_a_mask_is(width):
    row = np.random.default_rng(width).random(width) < 0.5
    assert np.array_equal(jitted.pack_row(row), jitted.pack(row[None, None])[0, 0])
