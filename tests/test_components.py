import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from srt_jax.components import label
from tests.helpers.maps import noise, snake
from tests.helpers.pictures import drawn


def _twin(blocked):
    # numbered in row-major order of the first cell as well
    labels, _ = ndimage.label(blocked, np.ones((3, 3)))
    return labels - 1


def test_components_are_connected_through_corners_and_are_numbered_by_their_first_cell():
    free, _ = drawn("""
        .@.@
        @...
        ..@@
    """)
    assert label(~free).tolist() == [[-1, 0, -1, 1], [0, -1, -1, -1], [-1, -1, 2, 2]]


@settings(max_examples=150, deadline=None)
@given(arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_it_equals_scipy_on_any_small_map(blocked):
    assert np.array_equal(label(blocked), _twin(blocked))


@pytest.mark.parametrize("density", [0, 0.1, 0.35, 0.5, 0.7, 1])
@pytest.mark.parametrize("shape", [(1, 200), (200, 1), (300, 257)])
def test_it_equals_scipy_on_noise_of_every_density(shape, density):
    blocked = ~noise(np.random.default_rng(0), *shape, density)
    assert np.array_equal(label(blocked), _twin(blocked))


@pytest.mark.parametrize("turn", range(4))
def test_spirals_snakes_and_combs_are_one_piece(turn):
    comb = np.zeros((301, 300), bool)
    comb[:, ::2] = True
    comb[-1] = True
    for blocked in (snake(300, 301), comb, np.add.outer(np.arange(90), np.arange(90)) % 2 == 0):
        assert label(np.rot90(blocked, turn)).max() == 0


def test_pieces_that_meet_only_at_the_end_of_a_row_stay_apart():
    blocked = np.zeros((2, 5), bool)
    blocked[0, 4] = blocked[1, 0] = True
    assert label(blocked).max() == 1
