"""Recognition of signs in an input data flow, and which features each sign expects next (PY16 §3.1,
the sign "face").

A prediction matrix is recognised when its columns appear one after the other in the flow, each at a
separate step; other steps may lie between them unless `contiguous` is set. Matching each column as
early as possible finds the earliest recognition, so one pass with one bit per prefix suffices. The
effects of a causal matrix are one moment: what it deletes must be absent at the step at which what
it adds is present, or at a later one.

A sign recognised at a step is itself a feature of that step for the signs above it, up to `levels`
levels.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import chex
import jax
import jax.numpy as jnp

from sign_model.foundation.loops import repeat
from sign_model.foundation.records import Array, record
from sign_model.signs.matrix import ColumnKind, Component, Matrices, num_columns


@record
class Recognition:
    """The signs recognised in a flow.

    recognised: bool [..., S].
    step: int32 [..., S], the first step at which the sign was recognised, -1 where it was not.
    precedent: int32 [..., S], the matrix of the component that was recognised first (0 is the
      oldest; ties go to the older one), -1 where there is none.
    passed: int32 [..., N], how many columns of each matrix of the component were matched by the
      last step.
    expected: bool [..., N, R], the rows that each matrix requires next; all False once its sign is
      recognised.
    """

    recognised: Array
    step: Array
    precedent: Array
    passed: Array
    expected: Array


class _Progress(NamedTuple):
    """The carry of the pass over a flow."""

    prefix: Array  # bool [N, T + 1], t: the first t columns of the matrix have been matched
    step: Array  # int32 [N], at which the matrix was first complete; _NEVER before


_NEVER = 2**31 - 1


@functools.partial(jax.jit, static_argnames=("component", "contiguous", "levels"))
def recognise(
    matrices: Matrices,
    flow: Array,
    *,
    component: Component = Component.IMAGE,
    contiguous: bool = False,
    levels: int = 1,
) -> Recognition:
    """Returns which signs are recognised in each flow, when, by which precedent, and which features
    are expected next.

    Nothing is recognised in an empty flow, and a matrix without columns is never recognised.

    Args:
      matrices: the table of one world model.
      flow: bool [..., K, S], the features (signs) present at each of K steps.
      component: whose matrices are matched.
      contiguous: whether the columns must follow each other without other steps between them.
      levels: how many levels of signs may be recognised within one step, each from the level below.
    """
    chex.assert_axis_dimension(flow, -1, matrices.is_sign.shape[0])
    chex.assert_type(flow, bool)
    one: Callable = functools.partial(
        _recognise_one, matrices, component=component, contiguous=contiguous, levels=levels
    )
    for _ in range(flow.ndim - 2):
        one = jax.vmap(one)
    return one(flow)


@jax.jit
def expectation(matrices: Matrices, recognition: Recognition) -> Array:
    """Returns how strongly each sign expects each feature next: 0 if it does not, 1 if the feature
    would complete it.

    The greatest fraction of columns that any matrix of the sign would have matched with its next
    column.

    Args:
      matrices: the table that was matched.
      recognition: of one flow; use `jax.vmap` for batches.

    Returns:
      float32 [S, S], (sign, feature).
    """
    num_signs = matrices.is_sign.shape[0]
    length = jnp.maximum(num_columns(matrices), 1).astype(jnp.float32)
    share = (recognition.passed + 1).astype(jnp.float32) / length
    value = jnp.where(recognition.expected, share[:, None], jnp.float32(0))
    target = jnp.where(recognition.expected, matrices.feature, num_signs)
    return (
        jnp.zeros((num_signs, num_signs), jnp.float32)
        .at[matrices.owner[:, None], target]
        .max(value, mode="drop")
    )


def _recognise_one(
    matrices: Matrices, flow: Array, *, component: Component, contiguous: bool, levels: int
) -> Recognition:
    """Returns the same for one flow, bool [K, S]."""
    # Before the first step only the empty prefix of each matrix is matched.
    num_slots, num_moments = matrices.kind.shape
    is_ours = matrices.component == component
    place = jnp.arange(num_moments + 1, dtype=jnp.int32)[None, :]
    start = _Progress(
        jnp.broadcast_to(place == 0, (num_slots, num_moments + 1)),
        jnp.full(num_slots, _NEVER, jnp.int32),
    )

    def observe(progress: _Progress, observed: tuple[Array, Array]) -> tuple[_Progress, None]:
        number, features = observed
        prefix, done = _advance(
            matrices, progress.prefix, features, is_ours, contiguous=contiguous, levels=levels
        )
        step = jnp.where(done, jnp.minimum(progress.step, number), progress.step)
        return _Progress(prefix, step), None

    steps = jnp.arange(flow.shape[0], dtype=jnp.int32)
    progress, _ = jax.lax.scan(observe, start, (steps, flow))

    # A sign is recognised with the first of its matrices; of several at one step, by the oldest.
    step = _least(matrices, progress.step, is_ours, _NEVER)
    recognised = step < _NEVER
    slot = jnp.arange(num_slots, dtype=jnp.int32)
    winner = _least(matrices, slot, is_ours & (progress.step == step[matrices.owner]), num_slots)
    precedent = jnp.where(recognised, winner - _least(matrices, slot, is_ours, num_slots), -1)

    # What comes next: the column after the longest prefix (the empty one is always matched).
    passed = jnp.where(is_ours, jnp.where(progress.prefix, place, 0).max(axis=1), 0)
    is_next = place[:, :-1] == passed[:, None]
    is_open = is_ours & ~recognised[matrices.owner] & ~_is_delete_next(matrices, is_next)
    return Recognition(
        recognised=recognised,
        step=jnp.where(recognised, step, -1),
        precedent=precedent,
        passed=passed,
        expected=(matrices.bits & is_next[:, None, :]).any(axis=2) & is_open[:, None],
    )


def _is_delete_next(matrices: Matrices, is_next: Array) -> Array:
    """Returns which matrices require an absence next, so that no feature is expected, bool [N]."""
    return (is_next & (matrices.kind == ColumnKind.DELETES)).any(axis=1)


def _advance(
    matrices: Matrices,
    prefix: Array,
    features: Array,
    is_ours: Array,
    *,
    contiguous: bool,
    levels: int,
) -> tuple[Array, Array]:
    """Returns the prefixes matched after one more step, and which matrices were completed at it.

    Args:
      matrices: one table.
      prefix: bool [N, T + 1], matched before the step.
      features: bool [S], present at the step.
      is_ours: bool [N], which matrices are matched at all.
      contiguous, levels: as in `recognise`.
    """

    # Each level adds the signs just completed to the features of the step.
    def offer(_: Array, offered: Array) -> Array:
        _, done = _match_columns(matrices, prefix, offered, is_ours, contiguous=contiguous)
        found = jnp.where(done, matrices.owner, offered.shape[0])
        return offered.at[found].set(True, mode="drop")

    offered = repeat(levels - 1, offer, jnp.asarray(features))
    return _match_columns(matrices, prefix, offered, is_ours, contiguous=contiguous)


def _match_columns(
    matrices: Matrices, prefix: Array, features: Array, is_ours: Array, *, contiguous: bool
) -> tuple[Array, Array]:
    """Returns the same as `_advance` when the step has exactly these features."""
    # Which columns match: all features present, or for deletes all absent.
    present = features[matrices.feature] & (matrices.feature >= 0)
    is_absence = matrices.kind == ColumnKind.DELETES
    wrong = matrices.bits & (present[:, :, None] == is_absence[:, None, :])
    is_match = ~wrong.any(axis=1) & (matrices.kind != ColumnKind.ABSENT)

    # Which columns extend a prefix. Deletes right after adds belong to the same moment: they may
    # match at the step at which the adds match.
    extends = prefix[:, :-1] & is_match
    is_same = is_absence[:, 1:] & (matrices.kind[:, :-1] == ColumnKind.ADDS)
    extends = extends | _shift(extends[:, :-1] & is_same & is_match[:, 1:])

    # A contiguous match loses its prefix unless this step extends it. The last column completes.
    place = jnp.arange(prefix.shape[1], dtype=jnp.int32)[None, :]
    kept = jnp.broadcast_to(place == 0, prefix.shape) if contiguous else prefix
    is_last = place[:, 1:] == num_columns(matrices)[:, None]
    return kept | _shift(extends), (extends & is_last).any(axis=1) & is_ours


def _shift(columns: Array) -> Array:
    """Returns the columns one place later, the first one False: bool [N, T] -> [N, T + 1]."""
    return jnp.pad(columns, ((0, 0), (1, 0)))


def _least(matrices: Matrices, value: Array, is_counted: Array, nothing: int) -> Array:
    """Returns the least value, int32 [N], among the counted slots, bool [N], of each sign; int32
    [S], `nothing` for a sign without such a slot.
    """
    num_signs = matrices.is_sign.shape[0]
    owner = jnp.where(is_counted, matrices.owner, num_signs)
    return jnp.full(num_signs, nothing, jnp.int32).at[owner].min(value, mode="drop")
