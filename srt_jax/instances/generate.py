"""Instances by the number, each with its least removal where there is a proof of it.

half, quarter, bagel-K: start and goal are connected but for the blocker, which every way crosses:
it is the least removal, whatever all else costs (`srt_jax.instances.paper_blockers`). rooms: a
shortest path over the rooms (`srt_jax.instances.doors`). fences and rings: a choice of one cell a
barrier (`srt_jax.instances.barriers`). mixed: all of these in turn, and tasks that are open,
unsolvable, boxed in, or of unknown optimum.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from srt_jax.instances import maps
from srt_jax.instances.barriers import (
    COSTS,
    Objects,
    fence,
    lay_segments,
    lay_whole,
    least_over,
    ring,
)
from srt_jax.instances.doors import rooms_with_doors
from srt_jax.instances.paper_blockers import block, pick_start_goal
from srt_jax.task import make_task
from srt_jax.types import FREE, Task

KINDS = ("half", "quarter", "bagel-K", "rooms", "fences", "rings", "mixed")
MIN_SIZE = 16
"""The least side of a map on which every kind finds room."""

Instance = tuple[str, Task, float]
Random = np.random.Generator
Maker = Callable[[int, int, Random], tuple[Task, float]]
"""Makes a task of a height and width, and tells its optimum."""


def generate(
    kind: str, *, count: int, size: int | tuple[int, int], seed: int, first: int = 0
) -> list[Instance]:
    """Returns `count` tasks as (name, task, optimum): the least total removal cost, inf where
    unsolvable, NaN where unknown.

    Instance i depends on kind, size, seed and i alone, not on `count`; the same on every machine.

    Args:
      kind: one of KINDS; bagel-K with a number for K, such as bagel-10.
      count: 1 or more.
      size: the side of square maps, or (least, greatest): height and width are drawn between them,
        both included. At least 16.
      seed: 0 or more.
      first: number of the first instance, 0 or more; so that many can be made in parts.

    Raises:
      ValueError: an unknown kind, or a number out of range.
    """
    if count < 1 or seed < 0:
        raise ValueError(
            f"count must be at least 1 and seed at least 0, got count {count}, seed {seed}"
        )
    if first < 0:
        raise ValueError(f"first must be at least 0, got {first}: instances are numbered from 0")
    least, greatest = (size, size) if isinstance(size, int | np.integer) else size
    if not MIN_SIZE <= least <= greatest:
        raise ValueError(
            f"size must be {MIN_SIZE} or more, the least before the greatest, got {size}"
        )
    makers, instances = _makers(kind, int(least)), []
    for index in range(first, first + count):
        rng = np.random.default_rng([seed, index])
        height, width = rng.integers(least, greatest + 1, 2).tolist()
        name, make = makers[index % len(makers)]
        task, optimum = make(height, width, rng)
        instances.append((f"{name}-{index:04d}", task, optimum))
    return instances


def _makers(kind: str, least: int) -> list[tuple[str, Maker]]:
    """Returns the makers that take turns, each with the name of what it makes."""
    if kind == "mixed":
        return _MIXED
    if kind in ("rooms", "fences", "rings"):
        return [(kind, dict(_MIXED)[kind])]
    if kind not in ("half", "quarter") and not (
        kind.startswith("bagel-") and kind[6:].isascii() and kind[6:].isdigit()
    ):
        raise ValueError(
            f"unknown kind {kind!r}: choose one of {', '.join(KINDS)} (K a number, such as"
            " bagel-10); srt-jax generate and srt_jax.coalition have helpers as well"
        )
    if kind.startswith("bagel-"):
        side = int(kind[6:])
        if side < 3:
            raise ValueError(f"{kind}: a ring of side {side} has no inside: K must be at least 3")
        if _apart(least) <= side // 2:
            needed = next(
                length for length in range(least, 2 * side + MIN_SIZE) if _apart(length) > side // 2
            )
            raise ValueError(
                f"{kind}: start and goal need more room than maps of {least} cells have: size must"
                f" be {needed} or more"
            )
    return [(kind, partial(_cut_off, kind=kind))]


def _apart(length: int) -> int:
    """Returns how far apart start and goal lie on a map of that length: in different halves."""
    return 3 * length // 5


def _based(height: int, width: int, rng: Random) -> tuple[np.ndarray, tuple, tuple]:
    """Returns labels int32 [1, H, W] of a base map, and a start and a goal in one region, on
    opposite sides of the map.
    """
    for _ in range(3):
        labels = _base(height, width, rng)
        try:
            return labels, *pick_start_goal(
                (labels == FREE)[0], apart=_apart(max(height, width)), seed=int(rng.integers(2**31))
            )
        except ValueError:
            continue  # its largest region is too narrow: another map
    free = maps.empty(height, width)
    return np.full((1, height, width), FREE, np.int32), *pick_start_goal(
        free, apart=_apart(max(height, width)), seed=0
    )


def _base(height: int, width: int, rng: Random) -> np.ndarray:
    """Returns labels int32 [1, H, W]: a city of many buildings, or one obstacle: noise, the walls
    of a maze or of rooms.
    """
    seed = int(rng.integers(2**31))
    kind = rng.choice(["city", "city", "empty", "noise", "maze", "rooms"])
    if kind == "city":
        return maps.city_buildings(height, width, seed=seed)[None]
    free = {
        "empty": lambda: maps.empty(height, width),
        "noise": lambda: maps.noise(
            height, width, density=float(rng.choice([0.1, 0.2, 0.3])), seed=seed
        ),
        "maze": lambda: maps.maze(height, width, corridor=int(rng.integers(1, 9)), seed=seed),
        "rooms": lambda: maps.rooms(height, width, side=int(rng.integers(5, 16)), seed=seed),
    }[kind]()
    return np.where(free, FREE, 0).astype(np.int32)[None]


def _cut_off(
    height: int, width: int, rng: Random, kind: str, *, fixed: bool = False
) -> tuple[Task, float]:
    """A base map with a blocker; unsolvable where that is `fixed`."""
    labels, start, goal = _based(height, width, rng)
    labels, blocker = block(labels, start, goal, kind)
    flags, costs = _draw_flags_and_costs(blocker + 1, rng)
    flags[blocker] = not fixed
    return _task(labels, start, goal, flags, costs), (
        float("inf") if fixed else float(costs[blocker])
    )


def _random_ring(
    height: int, width: int, rng: Random, *, fixed: bool = False
) -> tuple[Task, float]:
    largest = min(100, 2 * _apart(max(height, width)) - 1)
    sides = [side for side in (10, 50, 100, int(rng.integers(3, largest + 1))) if side <= largest]
    return _cut_off(height, width, rng, f"bagel-{rng.choice(sides)}", fixed=fixed)


def _patched(height: int, width: int, rng: Random) -> tuple[Task, float]:
    """A blocker that only fills gaps between obstacles: whoever removes one of those may get round
    it. Optimum unknown.
    """
    labels, start, goal = _based(height, width, rng)
    labels, blocker = block(labels, start, goal, str(rng.choice(["half", "quarter"])))
    labels = np.where(labels[0] == FREE, labels[-1], labels[0])
    flags, costs = _draw_flags_and_costs(blocker + 1, rng)
    return _task(labels, start, goal, flags, costs), float("nan")


def _open(height: int, width: int, rng: Random) -> tuple[Task, float]:
    """A task with a path."""
    labels, start, goal = _based(height, width, rng)
    return _task(labels, start, goal, *_draw_flags_and_costs(int(labels.max()) + 1, rng)), 0.0


def _covered(height: int, width: int, rng: Random, *, end: str) -> tuple[Task, float]:
    """Start or goal under one or two squares. As the two are connected otherwise, what covers the
    goal must go, and is enough.
    """
    labels, start, goal = _based(height, width, rng)
    row, col = start if end == "start" else goal
    known = int(labels.max()) + 1
    number = int(rng.integers(1, 3))
    for i in range(number):
        layer, reach = np.full((1, height, width), FREE, np.int32), int(rng.integers(0, 4))
        layer[0, max(0, row - reach) : row + reach + 1, max(0, col - reach) : col + reach + 1] = (
            known + i
        )
        labels = np.concatenate([labels, layer])
    flags, costs = _draw_flags_and_costs(known + number, rng)
    is_solvable = end == "goal" and flags[known:].all()
    return _task(labels, start, goal, flags, costs), (
        float(costs[known:].sum()) if is_solvable else float("inf")
    )


def _noise_in_parts(height: int, width: int, rng: Random) -> tuple[Task, float]:
    """Dense noise, all of it in one tile of the map being one obstacle of many parts. Optimum
    unknown.
    """
    free = rng.random((height, width)) >= rng.choice([0.35, 0.45])
    tile = max(height, width) // int(rng.integers(2, 9))
    tiles = (
        np.arange(height)[:, None] // tile * (-(-width // tile)) + np.arange(width)[None, :] // tile
    )
    cells = np.argwhere(free)
    start, goal = cells[rng.integers(len(cells) // 4)], cells[-1 - rng.integers(len(cells) // 4)]
    labels = np.where(free, FREE, tiles).astype(np.int32)
    flags_and_costs = _draw_flags_and_costs(int(tiles.max()) + 1, rng)
    return _task(labels, start, goal, *flags_and_costs), float("nan")


def _rooms(height: int, width: int, rng: Random) -> tuple[Task, float]:
    labels, objects, (start, goal), optimum = rooms_with_doors(height, width, rng)
    return _task(labels, start, goal, objects.destroyable, objects.cost), optimum


def _fences(height: int, width: int, rng: Random, *, doubled: bool = False) -> tuple[Task, float]:
    """One to four fences in segments across the map; `doubled`: one fence, then a wall of two rows,
    each one obstacle.
    """
    is_turned = bool(rng.integers(2))
    length, across = (width, height) if is_turned else (height, width)
    number = 2 if doubled else int(rng.integers(1, 5))
    rows = np.sort(rng.choice(np.arange(1, length - 2, 3), number, replace=False)).tolist()
    start = int(rng.integers(rows[0])), int(rng.integers(across))
    goal = int(rng.integers(rows[-1] + 1 + doubled, length)), int(rng.integers(across))
    barriers = [fence(row, across) for row in rows]
    labels, objects = np.full((2, length, across), FREE, np.int32), Objects(rng)
    if doubled:
        barriers.append(fence(rows[-1] + 1, across))
        for barrier in barriers[1:]:
            lay_whole(labels, barrier, objects)
    for barrier in barriers[: 1 if doubled else number]:
        lay_segments(labels, barrier, objects, rng)
    ends = [start, goal][:: rng.choice([-1, 1])]
    optimum = least_over(labels, barriers, objects)
    if is_turned:
        labels, ends = labels.transpose(0, 2, 1), [end[::-1] for end in ends]
    return _task(labels, *ends, objects.destroyable, objects.cost), optimum


def _rings(height: int, width: int, rng: Random, *, boxed: str = "goal") -> tuple[Task, float]:
    """One to three nested rings in segments round the goal, or the start."""
    radii = np.arange(1, min(40, (min(height, width) - 3) // 2) + 1, 2)
    radii = np.sort(
        rng.choice(radii, int(rng.integers(1, min(3, len(radii)) + 1)), replace=False)
    ).tolist()
    widest = radii[-1]
    row, col = centre = (
        int(rng.integers(widest + 1, height - widest - 1)),
        int(rng.integers(widest + 1, width - widest - 1)),
    )
    inside = (
        row + int(rng.integers(1 - radii[0], radii[0])),
        col + int(rng.integers(1 - radii[0], radii[0])),
    )
    outside = centre
    while all(abs(a - b) <= widest for a, b in zip(outside, centre, strict=True)):
        outside = int(rng.integers(height)), int(rng.integers(width))
    labels, objects, barriers = (
        np.full((2, height, width), FREE, np.int32),
        Objects(rng),
        [ring(centre, r) for r in radii],
    )
    for barrier in barriers:
        lay_segments(labels, barrier, objects, rng)
    ends = (inside, outside) if boxed == "start" else (outside, inside)
    return _task(labels, *ends, objects.destroyable, objects.cost), least_over(
        labels, barriers, objects
    )


def _draw_flags_and_costs(number: int, rng: Random) -> tuple[np.ndarray, np.ndarray]:
    """Returns flags bool [number], about two thirds destroyable or all, and costs float32 [number],
    some of COSTS or all 1.
    """
    flags = rng.random(number) < rng.choice([0.67, 1.0])
    costs = rng.choice(COSTS, number) if rng.random() < 0.5 else np.ones(number)
    return flags, costs.astype(np.float32)


def _task(labels: np.ndarray, start, goal, flags, costs) -> Task:
    """Returns the task, without layers in which nothing lies but the first."""
    if labels.ndim == 3:
        labels = labels[[0, *(i for i in range(1, len(labels)) if (labels[i] != FREE).any())]]
    return make_task(
        labels,
        start,
        goal,
        destroyable=np.array(flags, bool),
        removal_cost=np.array(costs, np.float32),
    )


_MIXED: list[tuple[str, Maker]] = [
    ("half", partial(_cut_off, kind="half")),
    ("quarter", partial(_cut_off, kind="quarter")),
    ("bagel", _random_ring),
    ("rooms", _rooms),
    ("fences", _fences),
    ("rings", _rings),
    ("open", _open),
    ("boxed-start", partial(_rings, boxed="start")),
    ("double-wall", partial(_fences, doubled=True)),
    ("unsolvable", partial(_random_ring, fixed=True)),
    ("covered-goal", partial(_covered, end="goal")),
    ("patched", _patched),
    ("noise-in-parts", _noise_in_parts),
    ("covered-start", partial(_covered, end="start")),
]
"""What the mixed kind makes in turn."""
