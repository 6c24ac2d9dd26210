import itertools
import math

import numpy as np

from srt_jax import moves, octile_distance
from tests.helpers.maps import noise
from tests.helpers.slow_kernels import lengths_by_heap


def test_there_are_eight_moves_in_row_order():
    assert moves.MOVES == ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))


def test_fixed_points_are_pells_pairs_ever_nearer_to_the_root_of_two():
    errors = [abs(diagonal / straight - math.sqrt(2)) for straight, diagonal in moves.FIXED_POINTS]
    assert errors == sorted(errors)
    assert all(abs(d * d - 2 * s * s) == 1 for s, d in moves.FIXED_POINTS)


def test_octile_distance_is_the_length_on_an_empty_map_and_a_lower_bound_on_any_other():
    cells = np.argwhere(np.ones((9, 12), bool)).astype(np.int32)
    h = np.asarray(octile_distance(cells, np.array([[4, 7]], np.int32))).reshape(9, 12)
    np.testing.assert_allclose(h, lengths_by_heap(np.ones((9, 12), bool), (4, 7)), rtol=1e-6)
    free = noise(np.random.default_rng(0), 9, 12, 0.3)
    free[4, 7] = True
    assert (h <= lengths_by_heap(free, (4, 7)) + 1e-5).all()


def test_the_order_of_cells_is_that_of_octile_distance():
    rng = np.random.default_rng(0)
    down, across = rng.integers(-5740, 5741, (2, 20_000)).astype(np.int32)
    order = np.asarray(moves.octile_order(down, across)).tolist()
    exact = [
        abs(abs(d) - abs(a)) + min(abs(d), abs(a)) * math.sqrt(2)
        for d, a in zip(down.tolist(), across.tolist())
    ]
    ranked = sorted(zip(order, exact))
    assert all(one[1] <= two[1] + 1e-9 for one, two in itertools.pairwise(ranked))
    assert max(order) < 2**26


def test_no_shortest_path_has_more_cells_than_the_bound():
    for seed in range(20):
        rng = np.random.default_rng(seed)
        height, width = (int(side) for side in rng.integers(1, 12, 2))
        free = noise(rng, height, width, 0.35)
        free[0, 0] = True
        length = lengths_by_heap(free, (0, 0))
        assert length[np.isfinite(length)].max() <= moves.max_path_cells(height, width) * math.sqrt(
            2
        )


def test_a_cell_is_on_the_map_within_all_four_sides():
    rows, cols = np.array([0, 2, -1, 3, 0, 0]), np.array([0, 3, 0, 0, -1, 4])
    assert moves.is_on_map(rows, cols, 3, 4).tolist() == [True, True, False, False, False, False]
