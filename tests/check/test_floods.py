"""The judge's floods against SciPy's labelling."""

import numpy as np
import pytest
from scipy import ndimage

from srt_jax.check.floods import piece_of


def by_scipy(mask, cell, by_corners):
    pieces, _ = ndimage.label(mask, np.ones((3, 3)) if by_corners else None)
    return mask & (pieces == pieces[cell])


@pytest.mark.parametrize("by_corners", [False, True])
def test_a_piece_is_that_of_scipy(by_corners):
    rng = np.random.default_rng(0)
    for side in [1, 2, 3, 5, 13] * 60 + [90] * 6:
        height, width = rng.integers(1, side + 1, 2).tolist()
        mask = rng.random((height, width)) < rng.choice([0.2, 0.45, 0.6, 0.8, 1.0])
        cell = int(rng.integers(height)), int(rng.integers(width))
        piece = piece_of(mask, cell, by_corners=by_corners)
        assert piece.dtype == bool
        np.testing.assert_array_equal(piece, by_scipy(mask, cell, by_corners) & mask[cell])


def test_a_piece_is_found_round_many_corners():
    mask = np.zeros((41, 41), bool)
    mask[::2] = True
    mask[1::4, -1] = mask[3::4, 0] = True  # one corridor to and fro
    combs = mask | mask.T  # and rows that hang on one another the other way round
    for one in (mask, mask[::-1], mask.T, combs):
        assert piece_of(one, (0, 0)).sum() == one.sum()
    mask[-2] = False
    assert piece_of(mask, (0, 0)).sum() == mask.sum() - 41
    assert not piece_of(mask, (41, 0)).any() and not piece_of(mask, (1, 0)).any()
