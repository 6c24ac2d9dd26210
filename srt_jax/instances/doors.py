"""Rooms whose doors are closed by posts, some of them fixed; and the proven optimum.

Rooms are rectangles, doors the only links, and every post stands in one door. So the least removal
is a shortest path over the rooms, each door as long as its posts cost.
"""

from heapq import heappop, heappush
from itertools import pairwise

import numpy as np

from srt_jax.instances.barriers import Objects

Room = tuple[int, int]


def rooms_with_doors(
    height: int, width: int, rng: np.random.Generator
) -> tuple[np.ndarray, Objects, list, float]:
    """Returns labels int32 [2, H, W], the obstacles (walls are number 0 and fixed), start and goal,
    and the least removal.
    """
    # Walls from edge to edge.
    labels, objects = np.full((2, height, width), -1, np.int32), Objects(rng)
    walls = objects.add(destroyable=False)
    edges = [_edges(length, rng) for length in (height, width)]
    for row in edges[0][1:-1]:
        labels[0, row] = walls
    for col in edges[1][1:-1]:
        labels[0, :, col] = walls
    spans = [[(low + 1, high) for low, high in pairwise(lines)] for lines in edges]
    # A door between each two rooms side by side, with what it costs to open.
    rooms = [(i, j) for i in range(len(spans[0])) for j in range(len(spans[1]))]
    doors: dict[tuple[Room, Room], float] = {}
    for i, j in rooms:
        if i + 1 < len(spans[0]):
            doors[(i, j), (i + 1, j)] = _door(
                labels[:, edges[0][i + 1], slice(*spans[1][j])], objects, rng
            )
        if j + 1 < len(spans[1]):
            doors[(i, j), (i, j + 1)] = _door(
                labels[:, slice(*spans[0][i]), edges[1][j + 1]], objects, rng
            )
    # Start and goal in two different rooms.
    here, there = (rooms[k] for k in rng.choice(len(rooms), 2, replace=False))
    ends = [
        tuple(int(rng.integers(*spans[axis][room[axis]])) for axis in (0, 1))
        for room in (here, there)
    ]
    return labels, objects, ends, _cheapest(doors, here, there)


def _edges(length: int, rng: np.random.Generator) -> list[int]:
    """Returns the walls across one side of the map, from -1 to its length: two to eight rooms, each
    of two cells or more.
    """
    number = int(rng.integers(2, min(8, length // 6) + 1))
    pitch = length // number
    inner = [
        i * length // number + int(rng.integers(-(pitch // 4), pitch // 4 + 1))
        for i in range(1, number)
    ]
    return [-1, *inner, length]


def _door(wall: np.ndarray, objects: Objects, rng: np.random.Generator) -> float:
    """Writes a door into a piece of wall, int32 [2, N], and returns what opening it costs; inf
    where it cannot be opened.
    """
    width = int(rng.integers(1, min(3, wall.shape[1]) + 1))
    first = int(rng.integers(wall.shape[1] - width + 1))
    kind = rng.choice(
        ["open", "none", "post", "fixed", "two posts"], p=[0.12, 0.13, 0.5, 0.1, 0.15]
    )
    if kind == "none":
        return float("inf")
    posts = {"open": [], "post": [True], "fixed": [False], "two posts": [True, True]}[kind]
    ids = [objects.add(destroyable=destroyable) for destroyable in posts]
    wall[:, first : first + width] = np.array([*ids, -1, -1][:2])[:, None]
    return float("inf") if kind == "fixed" else sum(objects.cost[i] for i in ids)


def _cheapest(doors: dict[tuple[Room, Room], float], here: Room, there: Room) -> float:
    """Returns the cost of the cheapest way from room to room; inf where there is none."""
    waiting, met = [(0.0, here)], set()
    while waiting:
        cost, room = heappop(waiting)
        if room == there:
            return cost
        if room in met:
            continue
        met.add(room)
        for ends, price in doors.items():
            if room in ends and price < float("inf"):
                heappush(waiting, (cost + price, ends[room == ends[0]]))
    return float("inf")
