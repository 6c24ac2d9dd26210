"""Random blocks tasks and their optimal plan lengths: training data for learning, and ground truth
for benchmarks.

A state is an array `below`, int [n]: the block under each block, -1 for the table. Every state is
equally likely; for the counting of towers see Slaney & Thiébaux, "Blocks World revisited" (2001).
"""

import dataclasses
import functools
import heapq
from collections.abc import Iterable

import numpy as np

from sign_model.pddl.grounding import ground
from sign_model.pddl.lifted import Atom, Problem
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.reader import parse

TABLE = -1

DOMAIN = """
(define (domain blocks)
  (:requirements :strips)
  (:predicates (on ?upper ?lower) (ontable ?block) (clear ?block) (handempty) (holding ?block))
  (:action pick-up :parameters (?block)
    :precondition (and (clear ?block) (ontable ?block) (handempty))
    :effect (and (holding ?block) (not (clear ?block)) (not (ontable ?block)) (not (handempty))))
  (:action put-down :parameters (?block)
    :precondition (holding ?block)
    :effect (and (ontable ?block) (clear ?block) (handempty) (not (holding ?block))))
  (:action stack :parameters (?upper ?lower)
    :precondition (and (holding ?upper) (clear ?lower))
    :effect (and (on ?upper ?lower) (clear ?upper) (handempty)
                 (not (holding ?upper)) (not (clear ?lower))))
  (:action unstack :parameters (?upper ?lower)
    :precondition (and (on ?upper ?lower) (clear ?upper) (handempty))
    :effect (and (holding ?upper) (clear ?lower)
                 (not (on ?upper ?lower)) (not (clear ?upper)) (not (handempty)))))
"""


def random_blocks_tasks(num_blocks: int, count: int, *, seed: int = 0) -> list[PlanningTask]:
    """Returns `count` random tasks that share one set of matrices; each goal consists of at least
    one `on` fact and nothing else.

    Args:
      num_blocks: at least 2.
      count: of tasks.
      seed: of the random numbers.

    Raises:
      ValueError: there are fewer than 2 blocks, so that a goal could name no fact.
    """
    if num_blocks < 2:
        raise ValueError(f"a blocks task needs at least 2 blocks, got {num_blocks}")
    rng = np.random.default_rng(seed)
    base, tasks = None, []
    for _ in range(count):
        # Two states; the goal must have a block on another.
        start, goal = random_state(num_blocks, rng), random_state(num_blocks, rng)
        while (goal == TABLE).all():
            goal = random_state(num_blocks, rng)
        problem = Problem(
            "random", _objects(num_blocks), frozenset(_atoms(start)), tuple(_on_atoms(goal))
        )
        # Only the first task is grounded.
        if base is None:
            base = ground(parse(DOMAIN, problem_text(problem))[0], problem)
            index = {atom: i for i, atom in enumerate(base.features)}
        tasks.append(
            dataclasses.replace(
                base,
                start=_bits(problem.start, index),
                goal=_bits(problem.goal, index),
                problem=problem,
                seconds={},
            )
        )
    return tasks


def random_state(num_blocks: int, rng: np.random.Generator) -> np.ndarray:
    """Returns a state, int [n], sampled uniformly: floating towers are put on the table or on
    another tower, one after the other.
    """
    # At first every block is a floating tower of its own, in random order. Ends: each round leaves
    # one floating tower less.
    ways, below = _ways(num_blocks), np.full(num_blocks, TABLE)
    floating = [(block, block) for block in rng.permutation(num_blocks).tolist()]  # (bottom, top)
    standing: list[int] = []  # tops of the towers on the table
    while floating:
        bottom, top = floating.pop()
        num_floating, num_standing = len(floating), len(standing)
        # On the table, with the probability that uniform sampling requires.
        if (
            rng.random() * ways[num_floating + 1][num_standing]
            < ways[num_floating][num_standing + 1]
        ):
            standing.append(top)
            continue
        # Else on any other tower, floating or standing.
        choice = int(rng.integers(num_floating + num_standing))
        if choice < num_floating:
            below[bottom], floating[choice] = floating[choice][1], (floating[choice][0], top)
        else:
            number = choice - num_floating
            below[bottom], standing[number] = standing[number], top
    return below


@functools.cache
def _ways(num_blocks: int) -> list[list[float]]:
    """Returns ways[m][k]: in how many ways m floating towers can be placed when k towers stand on
    the table.
    """
    ways = [[1.0] * (2 * num_blocks + 2)]
    for floating in range(1, num_blocks + 1):
        before = ways[-1]
        ways.append(
            [before[k] * (floating - 1 + k) + before[k + 1] for k in range(len(before) - 1)]
        )
    return ways


def optimal_length(start: np.ndarray, goal: np.ndarray) -> int:
    """Returns the length of a shortest plan (with 4 operators); -1 in the goal leaves the place of
    a block open.

    A* over moves of single blocks, each of 2 steps. If the place of some block is ready, it is
    moved there, which is always optimal; else some block that must move goes to the table, and the
    search decides which one.

    Args:
      start, goal: int [n], states.
    """
    # The queue is ordered by moves + misplaced blocks, a lower bound; among equals the deepest
    # state comes first. Ends: there are finitely many states, and one of them meets the goal.
    places = [int(place) for place in goal]
    first = tuple(int(y) for y in start)
    queue, moves_to = [(len(_misplaced(first, places)), 0, first)], {first: 0}
    while queue:
        _, negative_moves, state = heapq.heappop(queue)
        moves = -negative_moves
        wrong = _misplaced(state, places)
        if not wrong:
            return 2 * moves
        if moves > moves_to[state]:
            continue
        for after in _moves(state, places, wrong):
            if moves + 1 < moves_to.get(after, 1 << 30):
                moves_to[after] = moves + 1
                heapq.heappush(
                    queue, (moves + 1 + len(_misplaced(after, places)), -(moves + 1), after)
                )
    raise AssertionError("every blocks task has a plan")


def _moves(state: tuple[int, ...], goal: list[int], wrong: set[int]) -> list[tuple[int, ...]]:
    """Returns the states after the moves worth trying: one onto a final place if there is any, else
    all moves of misplaced tops to the table.
    """
    tops = set(range(len(state))) - set(state)
    to_table = []
    for block in sorted(tops & wrong):
        place = goal[block]
        if place in tops and place not in wrong:
            return [(*state[:block], place, *state[block + 1 :])]
        if state[block] != TABLE:
            to_table.append((*state[:block], TABLE, *state[block + 1 :]))
    return to_table


def _misplaced(state: tuple[int, ...], goal: list[int]) -> set[int]:
    """Returns the blocks that must move: those that are not in their place of the goal, on a block
    that another must be on, or above a block that must move.
    """
    goal_above = {place: block for block, place in enumerate(goal) if place != TABLE}
    fine: dict[int, bool] = {TABLE: True}

    # A block is fine in its place of the goal, or anywhere if it has none, on a block that is fine
    # and that no other block must be on.
    def is_fine(block: int) -> bool:
        if block not in fine:
            place = state[block]
            right = goal[block] in (TABLE, place) and (
                place == TABLE or goal_above.get(place, block) == block
            )
            fine[block] = right and is_fine(place)
        return fine[block]

    return {block for block in range(len(state)) if not is_fine(block)}


def state_of(atoms: frozenset[Atom] | tuple[Atom, ...], num_blocks: int) -> np.ndarray:
    """Returns the state, int [n], that the `on` facts among `atoms` describe."""
    below = np.full(num_blocks, TABLE)
    for atom in atoms:
        if atom[0] == "on":
            below[int(atom[1][1:])] = int(atom[2][1:])
    return below


def _objects(num_blocks: int) -> dict[str, tuple[str, ...]]:
    """Returns the objects of a problem with their types."""
    return {f"b{i}": ("object",) for i in range(num_blocks)}


def _on_atoms(below: np.ndarray) -> list[Atom]:
    """Returns the `on` facts of a state."""
    return [
        ("on", f"b{block}", f"b{place}")
        for block, place in enumerate(below.tolist())
        if place != TABLE
    ]


def _atoms(below: np.ndarray) -> list[Atom]:
    """Returns all facts of a state."""
    under = set(below.tolist())
    on_table = [
        ("ontable", f"b{block}") for block, place in enumerate(below.tolist()) if place == TABLE
    ]
    clear = [("clear", f"b{block}") for block in range(len(below)) if block not in under]
    return [*_on_atoms(below), *on_table, *clear, ("handempty",)]


def _bits(atoms: Iterable[Atom], index: dict[Atom, int]) -> np.ndarray:
    """Returns facts as a set of features, bool [F]; index is {feature: number}."""
    bits = np.zeros(len(index), bool)
    bits[[index[atom] for atom in atoms]] = True
    return bits


def problem_text(problem: Problem) -> str:
    """Returns the problem of a random task as PDDL."""
    start, goal = (
        " ".join(f"({' '.join(atom)})" for atom in atoms)
        for atoms in (sorted(problem.start), problem.goal)
    )
    objects = " ".join(problem.objects)
    return (
        f"(define (problem random) (:domain blocks) (:objects {objects}) (:init {start}) (:goal"
        f" (and {goal})))"
    )
