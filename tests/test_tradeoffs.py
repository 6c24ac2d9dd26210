"""The front of lengths against removal costs."""

import numpy as np
import pytest

from srt_jax import check, make_task, stack, tradeoffs
from srt_jax.draw import draw_tradeoffs
from srt_jax.tolls.pareto_front import front_of
from srt_jax.tradeoffs import NUM_TOLLS, default_tolls


@pytest.fixture(scope="module")
def walls():
    """Two walls with far gaps, the second cheap: three ways."""
    free = np.full((12, 12), -1)
    free[:11, 3], free[1:, 8] = 0, 1
    return make_task(free, (5, 0), (5, 11), removal_cost=[4.0, 1.0])


def test_points_are_sorted_and_none_is_better_than_another_in_both(walls):
    front = tradeoffs(walls, tolls=(1, 3, 5, 20, 40))
    assert len(front) == 3 and {point.destroyed for point in front} == {(0, 1), (1,), ()}
    lengths, costs = ([point[i] for point in front] for i in (0, 1))
    assert lengths == sorted(lengths) and costs == sorted(costs, reverse=True)
    assert all(point.is_proven and point.tolls[0] <= point.tolls[1] for point in front)
    for point in front:
        assert check(walls, point.solution, mode="shortest", toll=point.tolls[0]) == []


def test_the_tolls_tried_fit_the_costs_and_the_map(walls):
    tolls = default_tolls(walls)
    assert len(tolls) == NUM_TOLLS and tolls[0] * 2.5 == pytest.approx(0.25)
    assert tolls[-1] * 2.5 == pytest.approx(24)


def test_no_route_no_point_and_wrong_input_is_refused(walls):
    closed = walls.replace(destroyable=np.zeros(2, bool), labels=walls.labels.copy())
    closed.labels[0, :, 3] = 0
    assert tradeoffs(closed) == [] and front_of([]) == []
    with pytest.raises(ValueError, match="one task"):
        tradeoffs(stack([walls]))
    with pytest.raises(ValueError, match="tolls is empty"):
        tradeoffs(walls, tolls=[])
    with pytest.raises(ValueError, match="toll is inf"):  # in float32, without a warning
        tradeoffs(walls, tolls=[1e300])


def test_a_picture_of_the_front_appears(walls, tmp_path):
    pytest.importorskip("matplotlib")
    draw_tradeoffs(walls, tradeoffs(walls), tmp_path / "front.svg", title="two walls")
    text = (tmp_path / "front.svg").read_text()
    assert text.startswith("<?xml") and len(text) > 5000
    with pytest.raises(ValueError, match="front is empty"):
        draw_tradeoffs(walls, [], tmp_path / "none.svg")
