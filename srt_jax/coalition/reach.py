"""What each agent of a coalition can reach, alone and with the others' help, and who can ever
destroy what: exact, and the proof of what stands firm.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import lax

from sign_model.ground.marks import jitted
from srt_jax.coalition import batches, regions
from srt_jax.coalition.fixpoint import Outcome, Powers, are_reached, fixpoint
from srt_jax.coalition.records import CoalitionReach, Help
from srt_jax.coalition.regions import Graph, Scratch
from srt_jax.coalition.task import CoalitionTask
from srt_jax.engine import packing
from srt_jax.engine.batching import batch_kernel
from srt_jax.obstacles import Labels
from srt_jax.types import Array


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
    axes = {"reached": "AHW", "alone": "AHW", "destroys": "AM", "firm": "M", "help": "A"}
    return batches.call(_reacher, task, None, axes)


@functools.cache
def _reacher(_: None, is_part: bool) -> Callable[[CoalitionTask], CoalitionReach]:
    @batch_kernel
    def of_arrays(*arrays: Array) -> CoalitionReach:
        labels, able = arrays[:2]
        height, width = labels.shape[2:]
        agents, obstacles = able.shape[1:]
        flags, destroys, firm, help = batches.of_all(
            _reach, lambda: regions.scratch(height * width, obstacles, 2 * agents), *arrays
        )
        shape = (len(labels), agents, height, width)
        return CoalitionReach(
            reached=_bits(flags, 0, agents).reshape(shape),
            alone=_bits(flags, agents, 2 * agents).reshape(shape),
            destroys=destroys,
            firm=firm,
            help=help,
        )

    return jitted(
        lambda task: of_arrays(task.labels, task.able, task.start, task.goal),
        is_part=is_part,
        name=("coalition_reach", is_part),
    )


def _bits(flags: Array, first: int, last: int) -> Array:
    """Returns the bits from `first` on before `last` of uint32 [B, N, words] as bool [B, last -
    first, N].
    """
    floods = np.arange(first, last)
    parts = [
        flags[:, None, :, word]
        >> jnp.asarray(floods[floods // 32 == word] % 32, jnp.uint32)[None, :, None]
        for word in range(first // 32, (last - 1) // 32 + 1)
    ]
    return jnp.concatenate(parts, axis=1) & jnp.uint32(1) != 0


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


def _reach(
    labels: Labels, room: Scratch, able: Array, start: Array, goal: Array
) -> tuple[tuple, Scratch]:
    """The cells of one map with a bit for each flood that reached them, who destroys what, what
    stands firm, and what help each agent needs.
    """
    num_obstacles = able.shape[1]
    graph, able_words, never = prepare(labels, able, start, room)
    found, graph = feasible(labels, graph, able_words, never, start, goal)
    flags, room = _paint(labels, graph, found.epochs)
    destroys = packing.unpack((found.together.beside & able_words)[None], num_obstacles)[0]
    destroys = destroys & (found.begin >= 0)[:, None]
    return (flags, destroys, ~destroys.any(axis=0), found.help), room


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


def _paint(labels: Labels, graph: Graph, epochs: Array) -> tuple[Array, Scratch]:
    """Returns for each cell a bit for each flood that reached it: uint32 [H * W, words]."""
    room = graph.room
    height, width = labels.all.shape[2:]
    num_cells, num_floods = height * width, len(epochs)
    words = packing.num_words(num_floods)
    place = jnp.arange(words, dtype=jnp.int32)

    # Of the first run of each region, then of the others: a run joined has its region before it.
    def of_run(run: Array, state: tuple[Array, Scratch]) -> tuple[Array, Scratch]:
        flags, room = state
        root = regions.at(room.parent, run)

        def of_flood(flood: Array, state: tuple[Array, Array]) -> tuple[Array, Array]:
            flag, mark = state
            is_in = regions.at(mark, flood * num_cells + run) == regions.at(epochs, flood)
            bit = is_in.astype(jnp.uint32) << (flood & 31).astype(jnp.uint32)
            return flag | jnp.where(place == flood >> 5, bit, jnp.uint32(0)), mark

        steps = jnp.where(root == run, num_floods, 0)
        none = jnp.zeros(words, jnp.uint32)
        flag, mark = lax.fori_loop(jnp.int32(0), steps, of_flood, (none, room.mark))
        flag = jnp.where(root == run, flag, regions.row(flags, root))
        return regions.put_row(flags, flag, run), room._replace(mark=mark)

    flags = jnp.zeros((num_cells + 1, words), jnp.uint32)
    flags, room = lax.fori_loop(jnp.int32(0), graph.num_runs, of_run, (flags, room))

    # Row by row: which run each cell belongs to, and the bits of that run.
    which = jnp.arange(packing.num_words(width), dtype=jnp.int32)
    up_to = (jnp.uint32(2) << jnp.arange(32, dtype=jnp.uint32)) - jnp.uint32(1)

    def of_row(row: Array, state: _Painting) -> _Painting:
        starts = packing.pack(regions.run_starts(labels, row)[None, None])[0, 0]
        counts = lax.population_count(starts).astype(jnp.int32)
        earlier = jnp.sum(
            jnp.where(which[None] < which[:, None], counts[None], 0), axis=1, dtype=jnp.int32
        )
        inside = lax.population_count(starts[:, None] & up_to[None]).astype(jnp.int32)
        run = (state.before + earlier[:, None] + inside - 1).reshape(-1)[:width]
        bits = jnp.take(state.flags, run, axis=0)
        out = lax.dynamic_update_slice(state.out, bits, (row * width, jnp.int32(0)))
        return _Painting(run[-1] + 1, state.flags, out)

    begin = _Painting(jnp.int32(0), flags, jnp.zeros((num_cells, words), jnp.uint32))
    end = lax.fori_loop(jnp.int32(0), jnp.int32(height), of_row, begin)
    return end.out, room


class _Painting(NamedTuple):
    """before: int32 [], the runs of the rows painted. flags, out: uint32 [runs or cells, words]."""

    before: Array
    flags: Array
    out: Array
