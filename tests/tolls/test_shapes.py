"""Where obstacles matter, and which of them count as rectangles there."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.foundation.marks import compiled_whole
from srt_jax import obstacles
from srt_jax.engine.packing import pack
from srt_jax.tolls import entry, shapes
from srt_jax.tolls.paid_sets import Metric
from srt_jax.tolls.stops import changes_of

SIDE, NUM = 12, 12
STRAIGHT, DIAGONAL = 12, 17
PICTURE = """
    aa.b.ccc....
    aa.bb.c.....
    ............
    d.e...ffff.g
    .d....ffff.g
    ......ffff..
    hh.h........
    ............
    iiiiiiiiiiii
    jjj.........
    j.j....kkk..
    jjj....kkk..
"""


def drawn():
    signs = np.array([list(line) for line in PICTURE.split()])
    labels = np.full((1, 2, SIDE, SIDE), -1, np.int32)
    for i, name in enumerate("abcdefghijk"):
        labels[0, 0][signs == name] = i
    labels[0, 1, 11, 9:] = 11  # the last overlaps k
    return labels


def found(labels, toll, start, goal, limit):
    """Places and rectangles of a batch of maps."""

    def one_map(own, free, toll, start, goal, limit):
        metric = Metric(jnp.uint32(STRAIGHT), jnp.uint32(DIAGONAL), start, goal)
        changes = changes_of(own, free)
        places = shapes.places_of(own, changes, toll, metric, limit)
        return places, shapes.rectangles_of(own, changes, places.boxes, places.matters)

    def all_maps(labels, *args):
        free = compiled_whole(pack)((labels == -1).all(axis=1))
        return obstacles.of_all(one_map, labels, free, *args)

    return jax.device_get(jax.jit(all_maps)(labels, toll, start, goal, limit))


@pytest.mark.parametrize("is_plain", [False, True])
def test_rectangles_alone_and_whole_are_told_from_all_else(is_plain, monkeypatch):
    if is_plain:
        monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    labels, ends = drawn(), np.array([[0, 2]], np.int32)
    toll, limit = np.full((1, NUM), 5, np.uint32), np.array([entry.CLOSED], np.uint32)
    places, are_rectangles = found(labels, toll, ends, ends + 1, limit)
    named = zip("abcdefghijkl", are_rectangles[0].tolist())
    assert {name for name, is_one in named if is_one} == set("aefgi")
    for i, box in enumerate(places.boxes[0].tolist()):
        rows, cols = np.nonzero((labels[0] == i).any(axis=0))
        assert box == [rows.min(), rows.max(), cols.min(), cols.max()]


@pytest.mark.parametrize("is_plain", [False, True])
def test_within_a_limit_only_what_a_way_can_come_to_counts(is_plain, monkeypatch):
    if is_plain:
        monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    rng = np.random.default_rng(3)
    number = 40
    labels = np.where(rng.random((number, 2, SIDE, SIDE)) < 0.5, -1, 0).astype(np.int32)
    labels[labels == 0] = rng.integers(-1, NUM, size=(labels == 0).sum())
    labels[::3, 1] = -1
    labels[: number // 2] = np.repeat(np.repeat(labels[: number // 2, :, ::3, ::3], 3, 2), 3, 3)
    start, goal = rng.integers(SIDE, size=(2, number, 2)).astype(np.int32)
    toll = rng.integers(0, 60, size=(number, NUM)).astype(np.uint32)
    limit = rng.integers(1, 300, size=number).astype(np.uint32)
    places, are_rectangles = found(labels, toll, start, goal, limit)
    cells = np.indices((SIDE, SIDE)).transpose(1, 2, 0)
    num_seen = 0
    for b in range(number):
        away = [np.sort(np.abs(cells - end[b]), axis=2) for end in (start, goal)]
        over = sum(a[..., 1] * STRAIGHT + a[..., 0] * (DIAGONAL - STRAIGHT) for a in away)
        over = over - np.minimum(over, 2 * STRAIGHT - DIAGONAL)
        within = over + toll[b].min() < limit[b]
        for i in range(NUM):
            own = (labels[b] == i).any(axis=0)
            near = own & within
            # None that could be entered within the limit is left out.
            if not places.matters[b, i]:
                assert not (own & (over + toll[b, i] < limit[b])).any()
                continue
            num_seen += 1
            top, bottom, left, right = places.boxes[b, i].tolist()
            rows, cols = np.nonzero(near)
            assert [top, bottom, left, right] == [rows.min(), rows.max(), cols.min(), cols.max()]
            inside = labels[b, :, top : bottom + 1, left : right + 1]
            is_alone = (inside == i).any(axis=0).all() and ((inside >= 0).sum(axis=0) == 1).all()
            assert are_rectangles[b, i] <= is_alone
            if (inside == inside[:, :1, :1]).all():
                assert are_rectangles[b, i] == is_alone
    assert num_seen > 50
