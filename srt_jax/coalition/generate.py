"""Instances in which agents have to help each other, with the least removal by enumeration.

Rooms in a square grid; every wall between two rooms has a door, closed by one obstacle or by two
that overlap. Each agent is able to destroy some of them. As only doors matter, what a set of
obstacles opens is known from the rooms alone: the optimum is the cheapest of all sets.
"""

import itertools
from typing import NamedTuple

import numpy as np

from srt_jax.coalition.task import CoalitionTask, make_coalition
from srt_jax.types import FREE

MOST_ENUMERATED = 12
"""Obstacles; with more the optimum is not known (NaN)."""

MIN_SIZE = 16

Instance = tuple[str, CoalitionTask, float]
Random = np.random.Generator


class _Door(NamedTuple):
    """The rooms on both sides, and what closes the door."""

    rooms: tuple[int, int]
    obstacles: tuple[int, ...]


def helpers(
    *,
    count: int,
    size: int,
    seed: int,
    agents: int = 3,
    rooms: int = 3,
    share: float = 0.5,
    doubled: float = 0.0,
    first: int = 0,
) -> list[Instance]:
    """Returns `count` tasks as (name, task, optimum): the least total removal cost, inf where
    unsolvable, NaN where there are more obstacles than MOST_ENUMERATED.

    Instance i depends on the options, seed and i alone, not on `count`; the same on every machine.

    Args:
      count: 1 or more.
      size: the side of the maps, at least 16 and 4 for each room in a row.
      seed: 0 or more.
      agents: 1 or more; one of four tasks has a shared goal, else about every third agent has
        none, but one always has.
      rooms: in a row and in a column, 2 or more.
      share: how likely an agent is able to destroy an obstacle.
      doubled: how likely a door is closed by two obstacles that overlap.
      first: number of the first instance.

    Raises:
      ValueError: a number out of range.

    Examples:
      >>> from srt_jax.coalition import helpers
      >>> ((name, task, optimum),) = helpers(count=1, size=24, seed=3)
      >>> name, task.able.shape, optimum
      ('helpers-0000', (3, 13), 18.0)
    """
    if count < 1 or seed < 0 or first < 0 or agents < 1:
        raise ValueError(
            "count and agents must be at least 1, seed and first at least 0, got"
            f" {count}, {agents}, {seed}, {first}"
        )
    if rooms < 2 or size < max(MIN_SIZE, 4 * rooms):
        raise ValueError(
            f"size must be at least {max(MIN_SIZE, 4 * max(rooms, 2))} for {max(rooms, 2)} rooms in"
            f" a row, of which there must be 2 or more, got size {size}, rooms {rooms}"
        )
    instances = []
    for index in range(first, first + count):
        rng = np.random.default_rng([seed, index])
        task, optimum = _instance(rng, size, agents, rooms, share, doubled)
        instances.append((f"helpers-{index:04d}", task, optimum))
    return instances


def _instance(
    rng: Random, size: int, agents: int, rooms: int, share: float, doubled: float
) -> tuple[CoalitionTask, float]:
    # The walls: one indestructible obstacle, the last id.
    lines = [round(i * size / rooms) for i in range(1, rooms)]
    layers = np.full((2, size, size), FREE, np.int32)
    walls = np.zeros((size, size), bool)
    walls[lines], walls[:, lines] = True, True
    edges = [-1, *lines, size]
    middles = [(low + high) // 2 for low, high in itertools.pairwise(edges)]

    # A door in each wall between two rooms.
    doors, known = [], 0
    for row in range(rooms):
        for col in range(rooms):
            for down, right in ((0, 1), (1, 0)):
                if row + down == rooms or col + right == rooms:
                    continue
                low, high = (edges[col], edges[col + 1]) if down else (edges[row], edges[row + 1])
                place = int(rng.integers(low + 1, high))
                cell = (lines[row], place) if down else (place, lines[col])
                closed_by = [known, known + 1] if rng.random() < doubled else [known]
                for layer, obstacle in enumerate(closed_by):
                    layers[(layer, *cell)] = obstacle
                walls[cell] = False
                known += len(closed_by)
                there = (row + down) * rooms + col + right
                doors.append(_Door((row * rooms + col, there), tuple(closed_by)))
    layers[0][walls] = known

    # The agents, in the middle of rooms.
    able = np.zeros((agents, known + 1), bool)
    able[:, :known] = rng.random((agents, known)) < share
    begins = rng.integers(0, rooms * rooms, agents)
    ends: list[int | None] = [int(room) for room in rng.integers(0, rooms * rooms, agents)]
    if rng.random() < 0.25:
        ends = [ends[0]] * agents
    else:
        ends = [end if a == 0 or rng.random() < 2 / 3 else None for a, end in enumerate(ends)]
    costs = np.append(rng.integers(1, 10, known), 1).astype(np.float32)

    def cell_of(room: int) -> tuple[int, int]:
        return middles[room // rooms], middles[room % rooms]

    used = layers if (layers[1] != FREE).any() else layers[:1]
    task = make_coalition(
        used,
        [cell_of(int(room)) for room in begins],
        [None if end is None else cell_of(end) for end in ends],
        able=able,
        removal_cost=costs,
    )
    return task, _least(doors, able, costs, begins.tolist(), ends, rooms * rooms)


def _least(
    doors: list[_Door],
    able: np.ndarray,
    costs: np.ndarray,
    begins: list[int],
    ends: list[int | None],
    num_rooms: int,
) -> float:
    """Returns the least cost of all sets of obstacles, over the rooms alone."""
    known = able.shape[1] - 1
    if known > MOST_ENUMERATED:
        return float("nan")
    abilities = [sum(1 << i for i in range(known) if row[i]) for row in able]
    closed = [(a, b, sum(1 << i for i in ids)) for (a, b), ids in doors]
    beside = [sum(bits for a, b, bits in closed if room in (a, b)) for room in range(num_rooms)]
    sums = np.zeros(1)
    for cost in costs[:known]:
        sums = np.concatenate([sums, sums + cost])
    for chosen in np.argsort(sums, kind="stable").tolist():
        gone, before, floods = 0, -1, []
        while gone != before:
            before = gone
            floods = [_flood(begin, closed, gone, num_rooms) for begin in begins]
            for flood, ability in zip(floods, abilities):
                for room in range(num_rooms):
                    if flood >> room & 1:
                        gone |= beside[room] & ability & chosen
        if all(end is None or flood >> end & 1 for flood, end in zip(floods, ends)):
            return float(sums[chosen])
    return float("inf")


def _flood(begin: int, closed: list[tuple[int, int, int]], gone: int, num_rooms: int) -> int:
    flood = 1 << begin
    for _ in range(num_rooms):
        before = flood
        for one, other, bits in closed:
            if not bits & ~gone and (flood >> one | flood >> other) & 1:
                flood |= 1 << one | 1 << other
        if flood == before:
            break
    return flood
