"""What agents reach on the graph of one map when some obstacles may be destroyed for nothing.

Destroying never hurts, so the answer is a fixpoint: each agent in turn floods what is open and
destroys what it is able to and stands beside; until no agent finds anything new. Agents that can do
nothing more leave behind what stops them: the obstacles on the border of their regions.

One loop for everything, a link of the graph or a region at a step. For use inside a marked call.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jax import lax

from srt_jax.coalition.regions import Graph, Scratch, at, put, put_row, row
from srt_jax.types import Array


class Powers(NamedTuple):
    """Who may do what. Sets are uint32 [Z], as in `regions`.

    begin: int32 [A], the region in which each agent begins, -1 where it does nothing.
    able: uint32 [A, Z], what each agent is able to destroy.
    free: what may be destroyed for nothing. never: what may not be destroyed at all.
    flood: int32 [], the first of the A floods of `Scratch` to use.
    """

    begin: Array
    able: Array
    free: Array
    never: Array
    flood: Array


class Outcome(NamedTuple):
    """gone: uint32 [Z], what is destroyed in the end.

    beside: uint32 [A, Z], the obstacles that each agent stands beside at some time.
    priced, unmet: uint32 [A, Z], one obstacle for each region that an agent might enter next: one
      that is not free, or where all that is in the way is free but no able agent stands beside it.
    """

    gone: Array
    beside: Array
    priced: Array
    unmet: Array


class _Flood(NamedTuple):
    """agent: int32 [], whose turn it is. link: int32 [], to look at, -1 none. head, tail: int32 [],
    regions taken from the agent's queue and put there. idle: int32 [], turns since something was
    destroyed. tails: int32 [A]. near, priced, unmet: uint32 [Z], of this turn. out: of all agents.
    room: carried whole, for XLA copies an array that a loop reads from outside.
    """

    agent: Array
    link: Array
    head: Array
    tail: Array
    idle: Array
    tails: Array
    near: Array
    priced: Array
    unmet: Array
    out: Outcome
    room: Scratch


def fixpoint(graph: Graph, powers: Powers) -> tuple[Outcome, Graph]:
    """Returns what the agents reach and destroy; the graph's `mark` holds the new `epoch` in each
    region that an agent reaches.
    """
    room = graph.room
    num_agents, words = powers.able.shape
    num_cells = room.head.shape[0] - 1
    epoch = room.epoch + 1
    base = powers.flood * num_cells

    # Every agent in its first region.
    def place(agent: Array, arrays: tuple[Array, Array]) -> tuple[Array, Array]:
        mark, queue = arrays
        region, first = at(powers.begin, agent), base + agent * num_cells
        there = first + region.clip(0)
        was = at(mark, there)
        mark = put(mark, jnp.where(region >= 0, epoch, was), there)
        return mark, put(queue, region.clip(0), first)

    mark, queue = lax.fori_loop(jnp.int32(0), jnp.int32(num_agents), place, (room.mark, room.queue))

    def step(state: _Flood) -> _Flood:
        # A region: the next one that a link leads to, or the next one in the queue.
        agent, out, room = state.agent, state.out, state.room
        first = base + agent * num_cells
        is_link = state.link >= 0
        takes = ~is_link & (state.head < state.tail)
        link = state.link.clip(0)
        queued = at(room.queue, first + state.head.clip(0, num_cells - 1))
        region = jnp.where(is_link, at(room.to, link), jnp.where(takes, queued, 0))
        was = at(room.mark, first + region)

        # A link leads into an open region, or to the border.
        left = row(room.own, region) & ~out.gone
        is_new = is_link & (was != epoch)
        enters = is_new & jnp.all(left == 0)
        is_border = is_new & jnp.any(left != 0) & jnp.all(left & powers.never == 0)
        to_pay = left & ~powers.free
        is_priced = jnp.any(to_pay != 0)
        one = jnp.where(is_border, _lowest(jnp.where(is_priced, to_pay, left)), jnp.uint32(0))
        mark = put(room.mark, jnp.where(enters, epoch, was), first + region)
        last = first + state.tail.clip(0, num_cells - 1)
        kept = at(room.queue, last)
        queue = put(room.queue, jnp.where(enters, region, kept), last)
        tail = state.tail + enters.astype(jnp.int32)
        none = jnp.zeros_like(one)
        priced = state.priced | jnp.where(is_priced, one, none)
        unmet = state.unmet | jnp.where(is_priced, none, one)
        near = state.near | jnp.where(takes, row(room.near, region), none)

        # The end of a turn: the agent destroys what it can.
        ends = ~is_link & ~takes
        new = near & row(powers.able, agent) & powers.free & ~out.gone & ~powers.never
        new = jnp.where(ends, new, none)
        finds = jnp.any(new != 0)
        out = Outcome(
            out.gone | new,
            put_row(out.beside, near, agent),
            put_row(out.priced, priced, agent),
            put_row(out.unmet, unmet, agent),
        )
        tails = put(state.tails, tail, agent)
        following = jnp.where(agent + 1 < num_agents, agent + 1, 0)
        next_link = jnp.where(
            is_link, at(room.after, link), jnp.where(takes, at(room.head, region), -1)
        )
        return _Flood(
            agent=jnp.where(ends, following, agent),
            link=next_link,
            head=jnp.where(ends, 0, state.head + takes.astype(jnp.int32)),
            tail=jnp.where(ends, at(tails, following), tail),
            idle=jnp.where(ends, jnp.where(finds, 0, state.idle + 1), state.idle),
            tails=tails,
            near=jnp.where(ends, none, near),
            priced=jnp.where(ends, none, priced),
            unmet=jnp.where(ends, none, unmet),
            out=out,
            room=room._replace(mark=mark, queue=queue),
        )

    nothing = jnp.zeros((num_agents, words), jnp.uint32)
    none = nothing[0]
    tails = (powers.begin >= 0).astype(jnp.int32)
    begin = _Flood(
        agent=jnp.int32(0),
        link=jnp.int32(-1),
        head=jnp.int32(0),
        tail=tails[0],
        idle=jnp.int32(0),
        tails=tails,
        near=none,
        priced=none,
        unmet=none,
        out=Outcome(none, nothing, nothing, nothing),
        room=room._replace(mark=mark, queue=queue),
    )
    # Ends: a turn destroys something new, or all agents in turn find nothing.
    end = lax.while_loop(lambda state: state.idle < num_agents, step, begin)
    return end.out, graph._replace(room=end.room._replace(epoch=epoch))


def are_reached(graph: Graph, flood: Array, region: Array) -> tuple[Array, Graph]:
    """Returns whether the floods of the last fixpoint, from `flood` on, reached the regions (int32
    [A], one each): bool [A]; not where that is -1.

    The marks are carried along and come back with the graph: what reads them beside the loops that
    write them would make XLA copy them.
    """
    num_cells = graph.room.head.shape[0] - 1
    epoch = graph.room.epoch

    def look(agent: Array, state: tuple[Array, Array]) -> tuple[Array, Array]:
        mark, reached = state
        place = at(region, agent)
        was = at(mark, (flood + agent) * num_cells + place.clip(0))
        is_in = (place >= 0) & (was == epoch)
        return mark, put(reached, is_in.astype(jnp.int32), agent)

    none = jnp.zeros(len(region), jnp.int32)
    mark, reached = lax.fori_loop(
        jnp.int32(0), jnp.int32(len(region)), look, (graph.room.mark, none)
    )
    return reached != 0, graph._replace(room=graph.room._replace(mark=mark))


def _lowest(words: Array) -> Array:
    """Returns the least member of a set, as a set; none of an empty one."""
    first = lax.argmax((words != 0).astype(jnp.int32), 0, jnp.int32)
    is_first = jnp.arange(len(words), dtype=jnp.int32) == first
    return jnp.where(is_first, words & -words, jnp.uint32(0))
