"""Which obstacles no least way enters twice: rectangles that nothing else covers.

Take a way that needs such an obstacle gone at several moves, the first from u, the last to v. With
the obstacle gone a straight line of the octile metric leads through the rectangle from where the way
first meets it to where it last does, and none is shorter: where it enters, the cell entered; where
it only cuts a corner, the cell of that corner, reached by one straight move, which is less than the
diagonal. So what lies between u and v can be replaced by a way that is no longer, stays in the
rectangle, needs nothing else gone, and pays once. One obstacle after the other: what replaces the
way at one meets no other obstacle, so it pays no other a second time.

Of any other shape the way through the inside may be longer than leaving it and coming back.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from sign_model.ground.marks import runs_in_place
from srt_jax.engine import packing
from srt_jax.engine.in_place import read, read_apart, write
from srt_jax.types import Array


class _Boxes(NamedTuple):
    """Of M + 1 obstacles, the last stands for none: int32 [M + 1] each. last_row and so on: of the
    cells seen so far. num: how many cells."""

    first_row: Array
    last_row: Array
    first_col: Array
    last_col: Array
    num: Array


_FAR = 2**30


def rectangles(labels: Array, height: int, width: int, num_obstacles: int) -> Array:
    """Returns which obstacles are rectangles of cells that no other obstacle covers: bool [M]; also
    those that cover no cell.

    Args:
      labels: int32 [(H + 2) * (W + 2), L], from `spread.bordered`.
    """
    is_owned = (labels != -1).astype(jnp.int32)
    num_owners = is_owned.sum(axis=1, dtype=jnp.int32)
    owner = jnp.where(num_owners == 1, labels.max(axis=1), -1)
    owner = owner.reshape(height + 2, width + 2)
    left, right = jnp.roll(owner, 1, axis=1), jnp.roll(owner, -1, axis=1)
    boxes = _boxes(owner, (owner >= 0) & ((owner != left) | (owner != right)), num_obstacles)
    area = (boxes.last_row - boxes.first_row + 1) * (boxes.last_col - boxes.first_col + 1)
    is_full = (boxes.num == jnp.where(boxes.num > 0, area, 0))[:num_obstacles]
    if labels.shape[1] == 1:
        return is_full
    shared = (num_owners > 1).reshape(height + 2, width + 2)
    return is_full & ~_owners_in(labels, shared, num_obstacles)


def _boxes(owner: Array, ends: Array, num_obstacles: int) -> _Boxes:
    """The boxes round obstacles and their numbers of cells.

    Args:
      owner: int32 [rows, columns]. ends: bool, the first and last cells of each run along a row.
    """
    stride = owner.shape[1]
    least, most = (jnp.full(num_obstacles + 1, far, jnp.int32) for far in (_FAR, -_FAR))
    begin = _Boxes(least, most, least, most, jnp.zeros(num_obstacles + 1, jnp.int32))
    if not runs_in_place():
        rows, cols = jnp.indices(owner.shape, jnp.int32)
        at = jnp.where(owner >= 0, owner, num_obstacles)
        return _Boxes(
            begin.first_row.at[at].min(rows),
            begin.last_row.at[at].max(rows),
            begin.first_col.at[at].min(cols),
            begin.last_col.at[at].max(cols),
            begin.num.at[at].add(1),
        )
    flat = jnp.pad(owner.reshape(-1), 1, constant_values=-1)

    def visit(boxes: _Boxes, row: Array, col: Array, is_set: Array) -> _Boxes:
        place = row * jnp.uint32(stride) + col
        here, before, behind = (read(flat, place + jnp.uint32(i)) for i in (1, 0, 2))
        at = jnp.where(is_set & (here >= 0), here, num_obstacles).astype(jnp.uint32)
        row, col = row.astype(jnp.int32), col.astype(jnp.int32)
        more = jnp.where(here != behind, col + 1, 0) - jnp.where(here != before, col, 0)
        return _Boxes(
            write(boxes.first_row, jnp.minimum(read_apart(boxes.first_row, at), row), at),
            write(boxes.last_row, jnp.maximum(read_apart(boxes.last_row, at), row), at),
            write(boxes.first_col, jnp.minimum(read_apart(boxes.first_col, at), col), at),
            write(boxes.last_col, jnp.maximum(read_apart(boxes.last_col, at), col), at),
            write(boxes.num, read_apart(boxes.num, at) + more, at),
        )

    return packing.for_each_cell(packing.pack(ends[None])[0], visit, begin)


def _owners_in(labels: Array, cells: Array, num_obstacles: int) -> Array:
    """Returns the obstacles that cover at least one of the cells: bool [M]."""
    num_layers = labels.shape[1]
    if not runs_in_place():
        at = jnp.where(cells.reshape(-1, 1) & (labels >= 0), labels, num_obstacles)
        return jnp.zeros(num_obstacles + 1, bool).at[at].set(True)[:num_obstacles]
    stride = cells.shape[1]

    def visit(met: Array, row: Array, col: Array, is_set: Array) -> Array:
        place = row * jnp.uint32(stride) + col
        place = jnp.where(is_set, place, jnp.uint32(0))
        owners = lax.dynamic_slice(labels, (place, jnp.uint32(0)), (1, num_layers))[0]
        for layer in range(num_layers):
            is_one = is_set & (owners[layer] >= 0)
            at = jnp.where(is_one, owners[layer], num_obstacles).astype(jnp.uint32)
            met = write(met, jnp.uint32(1), at)
        return met

    met = jnp.zeros(num_obstacles + 1, jnp.uint32)
    return packing.for_each_cell(packing.pack(cells[None])[0], visit, met)[:num_obstacles] != 0
