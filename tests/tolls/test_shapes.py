"""Which obstacles count as rectangles, and their bounding boxes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.foundation.marks import compiled_whole
from srt_jax.engine.batching import each
from srt_jax.tolls import shapes
from srt_jax.tolls.spread import Size, ground_of

SIZE = Size(12, 12)
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


def seen(labels):
    def one_map(labels):
        unit, nowhere = jnp.uint32(12), jnp.full(2, -1, jnp.int32)
        ground = ground_of(labels, unit, jnp.uint32(17), nowhere, nowhere, SIZE)
        return shapes.shapes_of(ground, SIZE, 12)

    return jax.jit(lambda labels: compiled_whole(lambda x: each(one_map, x))(labels))(labels)


@pytest.mark.parametrize("is_plain", [False, True])
def test_rectangles_alone_and_whole_are_told_from_all_else(is_plain, monkeypatch):
    if is_plain:
        monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    signs = np.array([list(line) for line in PICTURE.split()])
    labels = np.full((1, 2, 12, 12), -1, np.int32)
    for i, name in enumerate("abcdefghijk"):
        labels[0, 0][signs == name] = i
    labels[0, 1, 11, 9:] = 11  # the last overlaps k
    found = seen(labels)
    are_rectangles = found.is_rectangle[0].tolist()
    assert {name for name, is_one in zip("abcdefghijkl", are_rectangles) if is_one} == set("aefgi")
    for i, box in enumerate(found.boxes[0].tolist()):
        rows, cols = np.nonzero((labels[0] == i).any(axis=0))
        assert box == [rows.min() + 1, rows.max() + 1, cols.min() + 1, cols.max() + 1]
