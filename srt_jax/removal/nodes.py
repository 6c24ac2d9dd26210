"""The nodes of a branch and bound over which obstacles go and which stay, as arrays: made, closed,
and the next one chosen. For use inside a marked call.

Each node settles one obstacle more than its parent. Costs and bounds are numbers of `sums`, in
columns.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.removal import sums
from srt_jax.removal.sums import Costs
from srt_jax.types import Array


class Nodes(NamedTuple):
    """Nodes in the order they were made; the first settles nothing.

    parent: int32 [n], a node, -1 of the first. obstacle: int32 [n]. is_gone: bool [n], else it
      stays.
    paid, bound: uint32 [WORDS, n], what is gone costs, and the bound, `never` where a node is
      closed.
    """

    parent: Array
    obstacle: Array
    is_gone: Array
    paid: Array
    bound: Array


def first_nodes(most_expanded: int, bound: Array) -> Nodes:
    """Returns the first node alone, with room for all that can be made."""
    size = 2 * most_expanded + 1
    none = jnp.full(size, -1, jnp.int32)
    closed = jnp.broadcast_to(sums.never()[:, None], (sums.WORDS, size))
    bounds = _put_column(closed, bound, jnp.int32(0))
    return Nodes(none, none, jnp.zeros(size, bool), jnp.zeros_like(closed), bounds)


def with_bound(nodes: Nodes, bound: Array, at: Array) -> Nodes:
    """Returns the nodes after one has got another bound: `never` closes it."""
    return nodes._replace(bound=_put_column(nodes.bound, bound, at))


def with_children(
    nodes: Nodes, num: Array, at: Array, branch: Array, bound: Array, costs: Costs
) -> Nodes:
    """Returns the nodes with both children of node `at`, the `num`-th expanded, which settle the
    obstacle `branch`; closed ones where `bound` is. The one with more gone is later.
    """
    paid = paid_at(nodes, at)
    more_paid = sums.with_cost(paid, costs, branch.clip(0))
    for child, (is_gone, cost) in enumerate(((False, paid), (True, more_paid))):
        place = 2 * num + 1 + child
        nodes = Nodes(
            _put(nodes.parent, at, place),
            _put(nodes.obstacle, branch, place),
            _put(nodes.is_gone, jnp.bool_(is_gone), place),
            _put_column(nodes.paid, cost, place),
            _put_column(nodes.bound, bound, place),
        )
    return nodes


def following(nodes: Nodes, costs: Costs) -> tuple[Array, Array]:
    """Returns the least bound of the open nodes, and the latest of those that have it."""
    low, are_least = sums.least(nodes.bound, jnp.ones(nodes.bound.shape[1], bool), costs.num_words)
    ids = jnp.arange(nodes.bound.shape[1], dtype=jnp.int32)
    return low, jnp.max(jnp.where(are_least, ids, -1))


def paid_at(nodes: Nodes, at: Array) -> Array:
    """Returns what is paid for at a node, a number."""
    return lax.dynamic_index_in_dim(nodes.paid, at, axis=1, keepdims=False)


class Decisions(NamedTuple):
    """What each node settles: parent, obstacle and is_gone as in `Nodes`."""

    parent: Array
    obstacle: Array
    is_gone: Array


class _Settling(NamedTuple):
    """On the way from a node to the first one. at: int32 []. settled: uint8 [M], 1 gone, 2
    stays.
    """

    at: Array
    settled: Array


def decisions_at(nodes: Nodes, at: Array, num_obstacles: int) -> tuple[Array, Array]:
    """Returns the obstacles that are gone at a node, and those that stay there: bool [M] each."""
    return decisions_of(Decisions(nodes.parent, nodes.obstacle, nodes.is_gone), at, num_obstacles)


def decisions_of(nodes: Decisions, at: Array, num_obstacles: int) -> tuple[Array, Array]:
    """Returns `decisions_at` from decisions alone."""

    def note(state: _Settling) -> _Settling:
        what = jnp.where(_entry(nodes.is_gone, state.at), jnp.uint8(1), jnp.uint8(2))
        settled = _put(state.settled, what, _entry(nodes.obstacle, state.at))
        return _Settling(_entry(nodes.parent, state.at), settled)

    begin = _Settling(at, jnp.zeros(num_obstacles, jnp.uint8))
    # Ends: every parent was made before its children; the first node settles nothing.
    end = lax.while_loop(lambda state: state.at > 0, note, begin)
    return end.settled == 1, end.settled == 2


def _entry(array: Array, at: Array) -> Array:
    return lax.dynamic_index_in_dim(array, at, keepdims=False)


def _put(array: Array, value: Array, at: Array) -> Array:
    return lax.dynamic_update_index_in_dim(array, value, at, 0)


def _put_column(numbers: Array, number: Array, at: Array) -> Array:
    return lax.dynamic_update_slice(numbers, number[:, None], (jnp.int32(0), at))
