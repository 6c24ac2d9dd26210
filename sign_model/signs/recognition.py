"""Recognition of signs in an input flow, and what each sign expects next (PY16 §3.1: "face",
saccades, attention).

A prediction matrix is recognised when its columns appear one after the other in the flow, each at a
step of its own; other steps may lie between them unless `contiguous` is asked for. Matching each
column as early as it can be matched finds the earliest recognition, so one pass with one bit per
prefix suffices. The effects of a causal matrix are one moment: what it deletes must be absent at
the very step, or at one after it, at which what it adds is present.

A sign recognised at a step is itself a feature of that step for the signs above it, `levels` deep.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import chex
import jax
import jax.numpy as jnp

from sign_model.ground.loops import repeat
from sign_model.ground.records import Array, record
from sign_model.signs.matrix import ColumnKind, Component, Matrices, num_columns


@record
class Recognition:
    """What was recognised in a flow.

    recognised: bool [..., S].
    step: int32 [..., S], the first step at which the sign was recognised, -1 where it was not.
    precedent: int32 [..., S], which matrix of the component did it (0 the oldest; ties go to the
      older), -1 where none.
    passed: int32 [..., N], how many columns each matrix of the component has behind it after the
      last step.
    expected: bool [..., N, R], the rows that each matrix needs next; all False once its sign is
      recognised.
    """

    recognised: Array
    step: Array
    precedent: Array
    passed: Array
    expected: Array


class _Seen(NamedTuple):
    prefix: Array  # bool [N, T + 1]: the first t columns have been seen
    step: Array  # int32 [N]: when the matrix was first complete, _NEVER before


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
    """Returns which signs are recognised in each flow, when, by which precedent, and what is
    expected next.

    Nothing is recognised in an empty flow, and a matrix without columns never is.

    Args:
      matrices: one world model's table.
      flow: bool [..., K, S], the features (signs) present at each of K steps.
      component: whose matrices are matched.
      contiguous: whether the columns must follow each other without a step between them.
      levels: how many times within a step what was just recognised is offered to the signs above
        it.
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
def attention(matrices: Matrices, recognition: Recognition) -> Array:
    """Returns how eagerly each sign expects each feature next; 0 where it does not, 1 where the
    feature would complete it.

    The greatest share of columns that any of the sign's matrices would have behind it after its
    next column.

    Args:
      matrices: the table that was matched.
      recognition: of one flow; batches through `jax.vmap`.

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
    num_slots, num_moments = matrices.kind.shape
    is_ours = matrices.component == component
    place = jnp.arange(num_moments + 1, dtype=jnp.int32)[None, :]
    start = _Seen(
        jnp.broadcast_to(place == 0, (num_slots, num_moments + 1)),
        jnp.full(num_slots, _NEVER, jnp.int32),
    )

    def observe(seen: _Seen, observed: tuple[Array, Array]) -> tuple[_Seen, None]:
        number, features = observed
        prefix, done = _advanced(
            matrices, seen.prefix, features, is_ours, contiguous=contiguous, levels=levels
        )
        return _Seen(prefix, jnp.where(done, jnp.minimum(seen.step, number), seen.step)), None

    steps = jnp.arange(flow.shape[0], dtype=jnp.int32)
    seen, _ = jax.lax.scan(observe, start, (steps, flow))
    step = _least(matrices, seen.step, is_ours, _NEVER)
    recognised = step < _NEVER
    slot = jnp.arange(num_slots, dtype=jnp.int32)
    winner = _least(matrices, slot, is_ours & (seen.step == step[matrices.owner]), num_slots)
    precedent = jnp.where(recognised, winner - _least(matrices, slot, is_ours, num_slots), -1)
    # The furthest prefix; index 0 is always seen.
    passed = jnp.where(is_ours, jnp.where(seen.prefix, place, 0).max(axis=1), 0)
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
    """Returns which matrices wait for an absence: nothing to look for, bool [N]."""
    return (is_next & (matrices.kind == ColumnKind.DELETES)).any(axis=1)


def _advanced(
    matrices: Matrices,
    prefix: Array,
    features: Array,
    is_ours: Array,
    *,
    contiguous: bool,
    levels: int,
) -> tuple[Array, Array]:
    """Returns the prefixes seen after one more step, and which matrices were completed at it."""

    def offer(_: Array, offered: Array) -> Array:
        _, done = _stepped(matrices, prefix, offered, is_ours, contiguous=contiguous)
        found = jnp.where(done, matrices.owner, offered.shape[0])
        return offered.at[found].set(True, mode="drop")

    offered = repeat(levels - 1, offer, jnp.asarray(features))
    return _stepped(matrices, prefix, offered, is_ours, contiguous=contiguous)


def _stepped(
    matrices: Matrices, prefix: Array, features: Array, is_ours: Array, *, contiguous: bool
) -> tuple[Array, Array]:
    present = features[matrices.feature] & (matrices.feature >= 0)
    is_absence = matrices.kind == ColumnKind.DELETES
    wrong = matrices.bits & (present[:, :, None] == is_absence[:, None, :])
    is_match = ~wrong.any(axis=1) & (matrices.kind != ColumnKind.ABSENT)
    passes = prefix[:, :-1] & is_match
    # Deletes right after adds belong to the same moment: they may pass at the step at which the
    # adds pass.
    is_same = is_absence[:, 1:] & (matrices.kind[:, :-1] == ColumnKind.ADDS)
    passes = passes | _shifted(passes[:, :-1] & is_same & is_match[:, 1:])
    place = jnp.arange(prefix.shape[1], dtype=jnp.int32)[None, :]
    kept = jnp.broadcast_to(place == 0, prefix.shape) if contiguous else prefix
    is_last = place[:, 1:] == num_columns(matrices)[:, None]
    return kept | _shifted(passes), (passes & is_last).any(axis=1) & is_ours


def _shifted(columns: Array) -> Array:
    """Returns the columns one place later, the first one False: bool [N, T] -> [N, T + 1]."""
    return jnp.pad(columns, ((0, 0), (1, 0)))


def _least(matrices: Matrices, value: Array, chosen: Array, nothing: int) -> Array:
    """Returns the least value among each sign's chosen slots, `nothing` where it has none; int32
    [S].
    """
    num_signs = matrices.is_sign.shape[0]
    owner = jnp.where(chosen, matrices.owner, num_signs)
    return jnp.full(num_signs, nothing, jnp.int32).at[owner].min(value, mode="drop")
