"""What each agent of a coalition can reach, alone and with the others' help, and who can ever
destroy what: exact, and the proof of what stands firm.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.foundation.marks import jitted
from srt_jax.coalition import batches, regions
from srt_jax.coalition.joint_reach import Outcome, Powers, are_reached, fixpoint
from srt_jax.coalition.regions import Graph, Scratch
from srt_jax.coalition.task import CoalitionTask
from srt_jax.coalition.types import CoalitionReach, Help
from srt_jax.engine import cores, packing
from srt_jax.engine.arguments import is_traced
from srt_jax.engine.batching import batch_kernel
from srt_jax.engine.buckets import map_bucket
from srt_jax.obstacles import Labels
from srt_jax.types import Array

_AT_ONCE = 1 << 18
"""Cells unpacked at once: that they stay in the caches."""


def coalition_reach(task: CoalitionTask) -> CoalitionReach:
    """Returns what each agent can reach, alone and with help, and who can ever destroy what.

    Exact, with any overlaps, in polynomial time: destroying never hurts, so all that can be
    destroyed is, until nothing changes. What stands then is `firm`. One task or any batch of them;
    may be called inside jit, vmap and scan; the same bits whatever the batch around a task.

    Args:
      task: from `make_coalition` or `stack_coalitions`.

    Raises:
      TypeError, ValueError: an array of the task has a wrong dtype or shape.

    Examples:
      >>> import numpy as np
      >>> from srt_jax.coalition import Help, coalition_reach, make_coalition
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False  # a wall from edge to edge, which only the second agent can destroy
      >>> task = make_coalition(free, [(2, 0), (2, 6)], [(0, 6), None], able=[(), (0,)])
      >>> reach = coalition_reach(task)
      >>> [Help(int(help)).name for help in reach.help]
      ['WITH_HELP', 'HELPER']
      >>> reach.reached[0].sum().item(), reach.alone[0].sum().item()
      (35, 15)
    """
    axes = {"reached": "A.", "alone": "A.", "destroys": "AM", "firm": "M", "help": "A"}
    return batches.call(_reacher, task, not is_traced(task), axes, finish=_unpacked)


@functools.cache
def _reacher(is_packed: bool, is_part: bool) -> Callable[[CoalitionTask], CoalitionReach]:
    """Where `is_packed`, cells come 32 in a word, uint32 [B, A, words]."""

    @batch_kernel
    def of_arrays(*arrays: Array) -> CoalitionReach:
        labels, able = arrays[:2]
        layers, height, width = labels.shape[1:]
        agents, obstacles = able.shape[1:]
        words, destroys, firm, help = batches.of_all(
            _reach, lambda: _room(height * width, layers, obstacles, 2 * agents), *arrays
        )
        cells = jnp.moveaxis(words, 2, 1)
        if not is_packed:
            shape = (len(labels), 2 * agents, height, width)
            cells = packing.unpack(cells, height * width).reshape(shape)
        return CoalitionReach(
            reached=cells[:, :agents],
            alone=cells[:, agents:],
            destroys=destroys,
            firm=firm,
            help=help,
        )

    return jitted(
        lambda task: of_arrays(task.labels, task.able, task.start, task.goal),
        is_part=is_part,
        name=("coalition_reach", is_packed, is_part),
    )


def _unpacked(packed: CoalitionReach, height: int, width: int) -> CoalitionReach:
    """The answer of a batch with its cells as bools, unpacked on the host: a large array that a
    kernel returns is touched for the first time at every call, which takes longer.
    """
    sides = map_bucket(height, width)
    count, agents = packed.help.shape
    num_cells = sides[0] * sides[1]
    size = max(1, _AT_ONCE // (agents * num_cells))

    def cells(words: Array) -> np.ndarray:
        words = np.ascontiguousarray(words).view(np.uint8)

        def unpack(part: slice) -> list[Array]:
            bits = np.unpackbits(words[part], axis=-1, count=num_cells, bitorder="little")
            return [bits.view(bool).reshape(-1, agents, *sides)[:, :, :height, :width]]

        whole = cores.empty((count, agents, height, width), bool)
        cores.run_parts(unpack, count, size, [whole])
        return whole

    return packed.replace(reached=cells(packed.reached), alone=cells(packed.alone))


class Feasible(NamedTuple):
    """What is known of one map before anything is chosen.

    begin, goal: int32 [A], the regions of each agent's start and goal, -1 where it does nothing or
      has no goal.
    together: of the agents together, all they can destroy for nothing. help: int32 [A].
    has_met: bool [A], whether the agent's goal is reached with nothing destroyed at all.
    epochs: int32 [2 A], the epoch of each flood: together, then alone.
    """

    begin: Array
    goal: Array
    together: Outcome
    help: Array
    epochs: Array


def _room(
    num_cells: int, num_layers: int, num_obstacles: int, num_floods: int
) -> tuple[Scratch, Array]:
    flags = jnp.zeros((num_cells + 1, packing.num_words(num_floods)), jnp.uint32)
    return regions.scratch(num_cells, num_layers, num_obstacles, num_floods), flags


def _reach(
    labels: Labels, room: tuple[Scratch, Array], able: Array, start: Array, goal: Array
) -> tuple[tuple, tuple[Scratch, Array]]:
    """The cells that each flood reached on one map (`_paint`), who destroys what, what stands firm,
    and what help each agent needs.
    """
    num_obstacles = able.shape[1]
    scratch, flags = room
    graph, able_words, never = prepare(labels, able, start, scratch)
    found, graph = feasible(labels, graph, able_words, never, start, goal)
    words, room = _paint(labels, graph, found.epochs, flags)
    destroys = packing.unpack((found.together.beside & able_words)[None], num_obstacles)[0]
    destroys = destroys & (found.begin >= 0)[:, None]
    return (words, destroys, ~destroys.any(axis=0), found.help), room


def prepare(labels: Labels, able: Array, start: Array, room: Scratch) -> tuple[Graph, Array, Array]:
    """Returns the graph of one map, what each agent is able to destroy (uint32 [A, Z]), and what no
    agent is: uint32 [Z].
    """
    may_go = able.any(axis=0)
    graph = regions.graph_of(labels, may_go, room)
    able_words = packing.pack(jnp.pad(able, ((0, 0), (0, 1)))[None])[0]
    return graph, able_words, regions.set_of(~jnp.pad(may_go, (0, 1)))


def feasible(
    labels: Labels, graph: Graph, able: Array, never: Array, start: Array, goal: Array
) -> tuple[Feasible, Graph]:
    """Returns what the agents reach when destroying costs nothing: each alone, then all together.

    One and the same code for all, for it takes long to compile.
    """
    height, width = labels.all.shape[2:]
    num_agents = len(able)
    ids = jnp.arange(num_agents, dtype=jnp.int32)

    places, graph = regions.regions_at(graph, jnp.concatenate([start, goal]), height, width)
    begin, ends = places[:num_agents], places[num_agents:]
    is_covered = jnp.any(jnp.take(graph.room.own, begin.clip(0), axis=0) != 0, axis=1)
    begin = jnp.where(is_covered, -1, begin)
    has_goal = (goal >= 0).all(axis=1)

    def turn(number: Array, state: _Turns) -> _Turns:
        is_last = number == num_agents
        acts = is_last | (ids == number)
        flood = jnp.where(is_last, 0, num_agents)
        powers = Powers(jnp.where(acts, begin, -1), able, ~never, never, flood)
        out, graph = fixpoint(state.graph, powers)
        there, graph = are_reached(graph, flood, ends)
        there = there & acts & has_goal
        is_own = jnp.where(
            jnp.arange(2 * num_agents, dtype=jnp.int32) < num_agents, is_last, False
        ) | (jnp.arange(2 * num_agents, dtype=jnp.int32) == num_agents + number)
        return _Turns(
            graph,
            out,
            jnp.where(is_last, state.alone, state.alone | there),
            there,
            jnp.where(is_own, graph.room.epoch, state.epochs),
        )

    none = jnp.zeros_like(able)
    nobody = jnp.zeros(num_agents, bool)
    start_state = _Turns(
        graph,
        Outcome(none[0], none, none, none),
        nobody,
        nobody,
        jnp.zeros(2 * num_agents, jnp.int32),
    )
    end = lax.fori_loop(jnp.int32(0), jnp.int32(num_agents + 1), turn, start_state)
    help = jnp.full(num_agents, Help.NEVER, jnp.int32)
    for applies, value in (  # the first that applies, so it is set last
        (end.there, Help.WITH_HELP),
        (end.alone, Help.ALONE),
        (~has_goal, Help.HELPER),
        (begin < 0, Help.START_BLOCKED),
    ):
        help = jnp.where(applies, jnp.int32(value), help)
    ends = jnp.where(has_goal, ends, -1)
    return Feasible(begin, ends, end.out, help, end.epochs), end.graph


class _Turns(NamedTuple):
    """graph, out: after the last turn. alone, there: bool [A], who reaches its goal alone, and in
    the last turn. epochs: int32 [2 A].
    """

    graph: Graph
    out: Outcome
    alone: Array
    there: Array
    epochs: Array


def _paint(
    labels: Labels, graph: Graph, epochs: Array, flags: Array
) -> tuple[Array, tuple[Scratch, Array]]:
    """Returns which floods reached each cell, 32 cells in a word: uint32 [ceil(H * W / 32), F].

    `flags`: room for the floods that reached each region, as bits, uint32 [N + 1, ceil(F / 32)].
    """
    room = graph.room
    num_cells, num_floods = labels.all.shape[2] * labels.all.shape[3], len(epochs)
    floods = jnp.arange(num_floods, dtype=jnp.int32)
    place = jnp.arange(flags.shape[1], dtype=jnp.int32)
    num_words = packing.num_words(num_cells)

    # The bits of each flood turn where a run differs from the one before.
    def of_run(run: Array, state: _Painting) -> _Painting:
        root = regions.at(state.parent, run)

        def of_flood(flood: Array, both: tuple[Array, Array]) -> tuple[Array, Array]:
            flag, mark = both
            is_in = regions.at(mark, flood * num_cells + root) == regions.at(epochs, flood)
            bit = is_in.astype(jnp.uint32) << (flood & 31).astype(jnp.uint32)
            return flag | jnp.where(place == flood >> 5, bit, jnp.uint32(0)), mark

        # a run that is the first of its region comes before the others
        is_first = root == run
        steps = jnp.where(is_first, num_floods, 0)
        none = jnp.zeros(len(place), jnp.uint32)
        flag, mark = lax.fori_loop(jnp.int32(0), steps, of_flood, (none, state.mark))
        flag = jnp.where(is_first, flag, regions.row(state.flags, root))
        flags = regions.put_row(state.flags, flag, root)
        cell = regions.at(state.first, run)
        word = cell >> 5
        turned = _spread(flag ^ state.before, floods) << (cell & 31).astype(jnp.uint32)
        turns = regions.put_row(state.turns, regions.row(state.turns, word) | turned, word)
        return _Painting(flag, turns, flags, state.first, state.parent, mark)

    begin = _Painting(
        jnp.zeros(len(place), jnp.uint32),
        jnp.zeros((num_words, num_floods), jnp.uint32),
        flags,
        room.first,
        room.parent,
        room.mark,
    )
    end = lax.fori_loop(jnp.int32(0), graph.num_runs, of_run, begin)
    room = room._replace(first=end.first, parent=end.parent, mark=end.mark)

    # From turns to bits: within each word at once, then word after word.
    def of_word(word: Array, state: _Carry) -> _Carry:
        bits = regions.row(state.bits, word)
        for step in (1, 2, 4, 8, 16):
            bits = bits ^ (bits << jnp.uint32(step))
        bits = bits ^ state.carry
        last = jnp.uint32(0) - (bits >> jnp.uint32(31))
        return _Carry(last, regions.put_row(state.bits, bits, word))

    nowhere = jnp.zeros(num_floods, jnp.uint32)
    out = lax.fori_loop(
        jnp.int32(0), jnp.int32(num_words), of_word, _Carry(nowhere, end.turns)
    ).bits
    return out, (room, end.flags)


def _spread(words: Array, places: Array) -> Array:
    """Returns bits of a set, uint32 [words], at int32 [F], as 0 or 1: uint32 [F]."""
    bits = jnp.zeros(len(places), jnp.uint32)
    for number in range(len(words)):
        bit = words[number] >> (places & 31).astype(jnp.uint32) & jnp.uint32(1)
        bits = jnp.where(places >> 5 == number, bit, bits)
    return bits


class _Painting(NamedTuple):
    """before: uint32 [words], the floods that reached the run before. turns: uint32 [words of
    cells, F], the cells where that changes. flags: as in `_paint`. The others: as in `Scratch`.
    """

    before: Array
    turns: Array
    flags: Array
    first: Array
    parent: Array
    mark: Array


class _Carry(NamedTuple):
    """carry: uint32 [F], all bits set where the last cell was reached. bits: uint32 [words, F]."""

    carry: Array
    bits: Array
