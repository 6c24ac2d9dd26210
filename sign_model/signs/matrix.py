"""Prediction matrices, the only store of the sign world model (PY16 §3.1).

A row of a prediction matrix is a feature: a link to a sign. A column is a moment: its 1-bits say
which features are required in that moment to recognise the sign. A causal matrix begins with
condition columns; its effects follow, which are one moment in two columns: the features added and
the features deleted.

All matrices of a world model lie in one table, one slot each, padded to one shape, with rows only
for the features that a matrix has. The table is not padded to the sign with the most matrices, as
an array with an axis of signs would be: an action with two thousand personal meanings takes two
thousand slots and nothing more. Every function here preserves the canonical order: slots by (owner,
component, age), unused slots last; rows by feature; columns from first to last.

Shapes: S signs, N slots, R rows, T columns. Every function takes one table; use `jax.vmap` for
batches.
"""

import dataclasses
import enum
import functools

import jax
import jax.numpy as jnp
import numpy as np

from sign_model.foundation.records import Array, record

NONE = -1
"""Stands for "no sign" in `owner` and `feature`."""


class Component(enum.IntEnum):
    """The three components of a sign that hold matrices; each spans one network (W_p, W_m, W_a)."""

    IMAGE = 0
    SIGNIFICANCE = 1
    MEANING = 2


class ColumnKind(enum.IntEnum):
    """What a column says; within a matrix the kinds ascend."""

    ABSENT = 0
    CONDITION = 1
    ADDS = 2
    DELETES = 3


@record
class Matrices:
    """The prediction matrices of a world model.

    is_sign: bool [..., S], False on padding.
    owner: int32 [..., N], the sign whose matrix lies in the slot; NONE (-1) in an unused slot.
    component: int32 [..., N], a `Component`, -1 in an unused slot.
    feature: int32 [..., N, R], the sign that the row links to, ascending; NONE (-1) on unused rows,
      which come last.
    bits: bool [..., N, R, T], False on unused rows and absent columns.
    kind: int32 [..., N, T], a `ColumnKind`, ABSENT (0) after the last column.
    """

    is_sign: Array
    owner: Array
    component: Array
    feature: Array
    bits: Array
    kind: Array


_PARTS = ("owner", "component", "feature", "bits", "kind")
"""The arrays of a table that have an axis of slots."""


def empty_matrices(num_signs: int, num_slots: int, num_rows: int, num_columns: int) -> Matrices:
    """Returns a table of the given capacity with no sign and no matrix in it, as NumPy arrays."""
    return Matrices(
        is_sign=np.zeros(num_signs, bool),
        owner=np.full(num_slots, NONE, np.int32),
        component=np.full(num_slots, NONE, np.int32),
        feature=np.full((num_slots, num_rows), NONE, np.int32),
        bits=np.zeros((num_slots, num_rows, num_columns), bool),
        kind=np.zeros((num_slots, num_columns), np.int32),
    )


def capacity(matrices: Matrices) -> tuple[int, int, int, int]:
    """Returns how many signs, slots, rows and columns the table can hold."""
    num_slots, num_rows, num_columns = matrices.bits.shape[-3:]
    return matrices.is_sign.shape[-1], num_slots, num_rows, num_columns


def with_capacity(
    matrices: Matrices, num_signs: int, num_slots: int, num_rows: int, num_columns: int
) -> Matrices:
    """Returns the same matrices in a table of at least the same size in every direction (host).

    Raises:
      ValueError: a number is smaller than that of the table.
    """
    wanted = (num_signs, num_slots, num_rows, num_columns)
    if any(want < have for want, have in zip(wanted, capacity(matrices))):
        raise ValueError(
            f"capacity {wanted} is smaller than {capacity(matrices)}: a table can only be enlarged"
        )
    larger = empty_matrices(*wanted)

    def copy_into(new: np.ndarray, old: Array) -> np.ndarray:
        new[tuple(slice(side) for side in old.shape)] = old
        return new

    return jax.tree.map(copy_into, larger, matrices)


def select(matrices: Matrices, slots: Array) -> Matrices:
    """Returns a table of some slots only, int [n], in the given order (host); the order is
    canonical if the slots ascend.
    """
    return dataclasses.replace(
        matrices, **{part: np.asarray(getattr(matrices, part))[slots] for part in _PARTS}
    )


def num_matrices(matrices: Matrices) -> Array:
    """Returns how many slots are in use, int32 [...]."""
    return (matrices.owner >= 0).sum(axis=-1, dtype=np.int32)


def num_columns(matrices: Matrices) -> Array:
    """Returns how many columns each matrix has, int32 [..., N]."""
    return (matrices.kind != ColumnKind.ABSENT).sum(axis=-1, dtype=np.int32)


def is_causal(matrices: Matrices) -> Array:
    """Returns which slots hold a causal matrix, one with an effect column, bool [..., N]."""
    return (matrices.kind >= ColumnKind.ADDS).any(axis=-1)


@functools.partial(jax.jit, static_argnames=("kind",))
def features_of(matrices: Matrices, kind: ColumnKind) -> Array:
    """Returns the features that the columns of one kind name in each matrix; all False in unused
    slots.

    For the kinds CONDITION, ADDS and DELETES these are the sets (FC, FA, FD) of a causal matrix.

    Args:
      matrices: one table.
      kind: static.

    Returns:
      bool [N, S].
    """
    named = (matrices.bits & (matrices.kind == kind)[:, None, :]).any(axis=2)
    num_signs = matrices.is_sign.shape[0]
    slot = jnp.arange(named.shape[0], dtype=jnp.int32)[:, None]
    # Unused rows point one past the end, where the update is dropped (index -1 would mean the last
    # sign).
    column = jnp.where(matrices.feature >= 0, matrices.feature, num_signs)
    return jnp.zeros((named.shape[0], num_signs), bool).at[slot, column].max(named, mode="drop")


@jax.jit
def insert(
    matrices: Matrices, owner: Array, component: Array, feature: Array, bits: Array, kind: Array
) -> Matrices:
    """Returns a table with one more matrix, the youngest of its sign's component: what an
    experience adds (PY16 §3.1).

    The last slot must be free (`WorldModel.grown` ensures it), else the matrix in it is lost.

    Args:
      matrices: one table.
      owner, component: int32 [].
      feature: int32 [R], ascending, NONE after the last.
      bits: bool [R, T].
      kind: int32 [T].
    """
    # The new slot follows all matrices of its component; later ones move by one.
    num_slots = matrices.owner.shape[0]
    is_before = (matrices.owner >= 0) & (
        (matrices.owner < owner) | ((matrices.owner == owner) & (matrices.component <= component))
    )
    place = is_before.sum(dtype=jnp.int32)
    slot = jnp.arange(num_slots, dtype=jnp.int32)
    source = jnp.where(slot > place, slot - 1, slot)

    def insert_part(old: Array, new: Array) -> Array:
        shifted = jnp.asarray(old)[source]
        return shifted.at[place].set(jnp.asarray(new, shifted.dtype))

    return dataclasses.replace(
        matrices,
        owner=insert_part(matrices.owner, owner),
        component=insert_part(matrices.component, component),
        feature=insert_part(matrices.feature, feature),
        bits=insert_part(matrices.bits, bits),
        kind=insert_part(matrices.kind, kind),
    )


def faults(matrices: Matrices) -> list[str]:
    """Returns the rules of the canonical form that a table breaks, as sentences; [] if it breaks
    none (host).
    """
    owner, component, feature, bits, kind = (np.asarray(getattr(matrices, part)) for part in _PARTS)
    # Sort keys by which unused slots, rows and columns come last.
    used, is_row, is_column = owner >= 0, feature >= 0, kind != ColumnKind.ABSENT
    num_signs = matrices.is_sign.shape[0]
    key = np.where(
        used, owner.astype(np.int64) * len(Component) + component, num_signs * len(Component)
    )
    ranked = np.where(is_row, feature, num_signs)
    order = np.where(is_column, kind, len(ColumnKind))

    rules = {
        "slots lie in the order of (owner, component), unused ones last": (np.diff(key) >= 0).all(),
        "every used slot has a component": (
            ((component >= 0) == used).all() and (component < len(Component)).all()
        ),
        "every owner and feature is a sign": (
            np.asarray(matrices.is_sign)[np.concatenate([owner[used], feature[is_row]])].all()
        ),
        "rows ascend without repetition, unused ones last": (
            ((np.diff(ranked, axis=1) > 0) | ~is_row[:, 1:]).all()
        ),
        "unused slots have no row and no column": (
            not (is_row | is_column[:, :1])[~used].any() and not is_column[~used].any()
        ),
        "columns go from conditions to effects, absent ones last": (
            (np.diff(order, axis=1) >= 0).all()
        ),
        "bits lie in used rows and columns, none of which is empty": (
            (bits.any(axis=2) == is_row).all() and (bits.any(axis=1) == is_column).all()
        ),
    }
    return [rule for rule, holds in rules.items() if not holds]
