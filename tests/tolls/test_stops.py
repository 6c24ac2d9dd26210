"""What runs meet ahead, against a walk cell by cell."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.foundation.marks import compiled_whole
from srt_jax import obstacles
from srt_jax.engine.packing import pack
from srt_jax.paths.jump_tables import groups_of
from srt_jax.tolls.stops import changes_of, stops_of

DOWN, RIGHT, UP, LEFT = (1, 0), (0, 1), (-1, 0), (0, -1)


def drawn(rng, num_layers, height, width):
    """Blocks of a few obstacles, which touch and overlap."""
    labels = np.full((num_layers, height, width), -1, np.int32)
    for i in range(60):
        layer, top, left = rng.integers([num_layers, height, width])
        rows, cols = rng.integers(1, 6, size=2)
        labels[layer, top : top + rows, left : left + cols] = i % 20
    return labels


def met(labels, near, goal, cell, step):
    """Whether the next stop is a corner or the goal, and whether it is one of these or a door."""
    _, height, width = labels.shape

    def owners(row, col):
        """Of each layer; nothing outside the map."""
        is_inside = 0 <= row < height and 0 <= col < width
        return labels[:, row, col].tolist() if is_inside else []

    def is_owned(row, col):
        return any(owner >= 0 for owner in owners(row, col))

    before = cell
    while True:
        row, col = before[0] + step[0], before[1] + step[1]
        if not owners(row, col) or not near[row, col]:
            return False, False
        sides = ((step[1], step[0]), (-step[1], -step[0]))
        is_corner = (row, col) == goal or any(
            is_owned(before[0] + down, before[1] + right)
            and owners(before[0] + down, before[1] + right) != owners(*before)
            and owners(before[0] + down, before[1] + right) != owners(row + down, col + right)
            for down, right in sides
        )
        if is_corner:
            return True, True
        if is_owned(row, col) and owners(row, col) != owners(*before):
            return False, True
        before = row, col


@pytest.mark.parametrize("num_layers, height, width", [(1, 40, 70), (2, 33, 33), (2, 64, 20)])
def test_what_is_ahead_of_each_cell_is_what_a_walk_meets(num_layers, height, width):
    rng = np.random.default_rng([num_layers, height])
    labels = drawn(rng, num_layers, height, width)
    goal = tuple(rng.integers([height, width]).tolist())
    near = np.ones((2, height, width), bool)
    near[1, :5] = near[1, :, -9:] = False

    def one_map(own, free, near):
        return stops_of(changes_of(own, free), near, jnp.array(goal, jnp.int32), width).ahead

    def all_maps(labels, near):
        free = compiled_whole(pack)((labels == -1).all(axis=1))
        return obstacles.of_all(one_map, labels, free, compiled_whole(pack)(near))

    ahead = np.asarray(jax.jit(all_maps)(np.stack([labels] * 2), near))
    tall, wide = groups_of(height, width)
    size = 32 * tall * wide
    num_found = 0
    for which, mask in enumerate(near):
        parts = ahead[which].reshape(8, size)
        for row, col in np.argwhere(mask).tolist():
            for part, step in enumerate((DOWN, RIGHT, UP, LEFT)):
                line, place, words = (col, row, tall) if part % 2 else (row, col, wide)
                found = [
                    bool(parts[part + 4 * doors, line * words + place // 32] >> place % 32 & 1)
                    for doors in (False, True)
                ]
                is_goal = (row, col) == goal
                true = met(labels, mask, goal, (row, col), step)
                assert found == [one or is_goal for one in true], (row, col, step)
                num_found += found[0] + found[1]
    assert num_found > 1000
