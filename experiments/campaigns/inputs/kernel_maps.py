"""Maps for the kernels' campaign: random ones that a seed and a number bring back, and corridors
whose length is known.
"""

from typing import NamedTuple

import numpy as np

TALLEST, WIDEST = 130, 97


class Drawn(NamedTuple):
    """A random map. title: kind, seed and size, enough to draw it again; free: bool [H, W]; start:
    int32 [2].
    """

    title: str
    free: np.ndarray
    start: np.ndarray


def draw_map(seed: int, index: int, tallest: int = TALLEST, widest: int = WIDEST) -> Drawn:
    """Returns map number `index`: noise, or a heap of rectangles, from empty to full; the start is
    mostly a free cell.
    """
    rng = np.random.default_rng([seed, index])
    extreme = {0: (1, 1), 1: (1, widest), 2: (tallest, 1), 3: (tallest, widest)}
    height, width = (int(rng.integers(1, side + 1)) for side in (tallest, widest))
    if index % 4 == 1:  # many small ones
        height, width = min(height, 1 + index % 9), min(width, 1 + index // 4 % 9)
    height, width = extreme.get(index, (height, width))
    density = {0: 0.0, 1: 1.0}.get(index % 10, float(rng.random()))
    kind = "rectangles" if index % 10 > 6 else "noise"
    free = (
        rectangles(rng, height, width, density)
        if kind == "rectangles"
        else rng.random((height, width)) >= density
    )
    cells = np.argwhere(free)
    start = (
        cells[rng.integers(len(cells))]
        if len(cells) and index % 13
        else rng.integers(-1, [height + 1, width + 1])
    )
    return Drawn(
        f"{kind}, seed {seed}, number {index}, {height}x{width}", free, start.astype(np.int32)
    )


def rectangles(rng: np.random.Generator, height: int, width: int, density: float) -> np.ndarray:
    """Returns free [H, W] with rectangles put down until `density` of the cells is blocked."""
    free = np.ones((height, width), bool)
    while (~free).mean() < density:
        row, col = rng.integers(height), rng.integers(width)
        free[row : row + 1 + rng.integers(8), col : col + 1 + rng.integers(8)] = False
    return free


class Known(NamedTuple):
    """A map with a length that is known without a search.

    free: bool [H, W]; start, goal: (row, col); straight, diagonal: how many moves of each kind a
      shortest path has.
    is_corridor: no cell but those on the way, and no diagonal.
    """

    title: str
    free: np.ndarray
    start: tuple[int, int]
    goal: tuple[int, int]
    straight: int
    diagonal: int
    is_corridor: bool = False

    @property
    def length(self) -> float:
        return self.straight + self.diagonal * 2**0.5

    def turned(self) -> "Known":
        """Returns the map transposed."""
        ends = {"start": self.start[::-1], "goal": self.goal[::-1]}
        return self._replace(
            title=f"{self.title}, transposed", free=np.ascontiguousarray(self.free.T), **ends
        )

    def reversed(self) -> "Known":
        return self._replace(title=f"{self.title}, reversed", start=self.goal, goal=self.start)


def corridor(title: str, free: np.ndarray) -> Known:
    """Returns a corridor with its two ends. ValueError where `free` is not one, proven cell by
    cell.

    All cells have two free neighbours beside them, but two ends have one; and no four form a
    square, so that no diagonal is legal. A ring beside the corridor would pass; `reach` must tell
    it apart from what is connected.
    """
    wide = np.pad(free, 1).astype(np.int8)
    beside = (wide[:-2, 1:-1] + wide[2:, 1:-1] + wide[1:-1, :-2] + wide[1:-1, 2:])[free]
    squares = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
    ends = np.argwhere(free)[beside == 1].tolist()
    if len(ends) != 2 or (beside < 1).any() or (beside > 2).any() or squares.any():
        raise ValueError(f"{title}: not a corridor")
    return Known(
        title, free, tuple(ends[0]), tuple(ends[1]), int(free.sum()) - 1, 0, is_corridor=True
    )


def snake(height: int, width: int) -> Known:
    """Returns the corridor through every other row: half of the cells are on the way."""
    free = np.zeros((height, width), bool)
    free[: height - (height + 1) % 2 : 2] = True
    free[1 : height - 1 : 4, -1] = True
    free[3 : height - 1 : 4, 0] = True
    return corridor(f"snake {height}x{width}", free)


def stairs(side: int) -> Known:
    """Returns the corridor up and down stairs along the diagonals: two thirds of the cells are on
    the way, all in turns.

    Stair k goes over the diagonals col - row = 3 k and 3 k + 1; one cell of the next diagonal joins
    it with stair k + 1: at its lower end if k is even (which is walked downwards), else at its
    upper end.
    """
    free = np.zeros((side, side), bool)
    most = (side - 8) // 3

    def lay(first: int, last: int, diagonal: int) -> None:
        row = np.arange(first, last + 1)
        free[row, row + diagonal] = True

    def below(k: int) -> int:
        """The row where stair k + 1 begins, one above the joining cell."""
        return min(side - 2, side - 4 - 3 * k)

    def above(k: int) -> int:
        """The row of the joining cell, and where stair k + 1 begins."""
        return max(0, -3 * k - 2)

    for k in range(-most, most + 1):
        if k % 2 == 0:
            lay(above(k - 1), below(k) + 1, 3 * k)
            lay(above(k - 1), below(k) + 1, 3 * k + 1)
            joint = (below(k) + 1, below(k) + 3 * k + 3)
        else:
            lay(above(k) + 2, below(k - 1), 3 * k)
            lay(above(k) + 1, below(k - 1) - 1, 3 * k + 1)
            joint = (above(k), above(k) + 3 * k + 2)
        free[joint] = k < most
    return corridor(f"stairs {side}x{side}", free)


def wide_snake(side: int, broad: int) -> Known:
    """Returns corridors `broad` rows wide between walls of one row, each with a gap of one cell, at
    its ends in turn.

    A path has to pass the gaps, up and down, and between two gaps it is as long as on an empty map.
    """
    free = np.ones((side, side), bool)
    walls = np.arange(broad, side - 1, broad + 1)
    straight = diagonal = 0
    here = (0, 0)
    for number, wall in enumerate(walls.tolist()):
        gap = 0 if number % 2 else side - 1
        free[wall] = False
        free[wall, gap] = True
        down, across = wall - 1 - here[0], abs(gap - here[1])
        straight, diagonal = straight + 2 + abs(down - across), diagonal + min(down, across)
        here = (wall + 1, gap)
    goal = (side - 1, 0 if len(walls) % 2 else side - 1)
    down, across = goal[0] - here[0], abs(goal[1] - here[1])
    title = f"snake {side}x{side}, {broad} rows wide"
    return Known(
        title, free, (0, 0), goal, straight + abs(down - across), diagonal + min(down, across)
    )


def empty(height: int, width: int) -> Known:
    long, short = max(height, width) - 1, min(height, width) - 1
    return Known(
        f"empty {height}x{width}",
        np.ones((height, width), bool),
        (0, 0),
        (height - 1, width - 1),
        long - short,
        short,
    )
