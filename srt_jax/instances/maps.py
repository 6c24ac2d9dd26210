"""Base maps: empty, noise, mazes, rooms, a snake, and a synthetic city whose blocks stand at
angles.

Each is settled by its size and seed alone: only integers decide, so the maps are the same on every
machine.
"""

from math import isqrt

import numpy as np

_SLOPES = ((1, 0), (1, 0), (6, 1), (4, 1), (3, 1), (2, 1), (3, 2), (1, 1))
"""Directions of streets, as whole steps (across, down); the first twice, as most streets follow
the map.
"""


def empty(height: int, width: int) -> np.ndarray:
    """Returns bool [H, W], all free."""
    return np.ones((height, width), bool)


def noise(height: int, width: int, *, density: float, seed: int) -> np.ndarray:
    """Returns bool [H, W], each cell blocked with probability `density`, independent of the
    others.
    """
    return np.random.default_rng(seed).random((height, width)) >= density


def snake(height: int, width: int, *, corridor: int = 1) -> np.ndarray:
    """Returns bool [H, W], one corridor that winds from the top to the bottom: the longest
    shortest paths there are.
    """
    free = empty(height, width)
    walls = np.arange(corridor, height, corridor + 1)
    free[walls] = False
    free[walls, np.where(np.arange(len(walls)) % 2, 0, width - 1)] = True
    return free


def maze(height: int, width: int, *, corridor: int = 1, seed: int) -> np.ndarray:
    """Returns bool [H, W], a maze with one way between any two places: a depth-first walk with
    walls of one cell.

    Rows and columns left over below and on the right are blocked.
    """
    pitch = corridor + 1
    rows, cols = (height + 1) // pitch, (width + 1) // pitch
    free = np.zeros((height, width), bool)
    is_place = np.arange(max(height, width)) % pitch != corridor
    free[: rows * pitch, : cols * pitch] = np.outer(
        is_place[: min(height, rows * pitch)], is_place[: min(width, cols * pitch)]
    )
    for here, there in _tree(rows, cols, np.random.default_rng(seed)):
        (top, left), (bottom, right) = (divmod(place, cols) for place in sorted((here, there)))
        free[top * pitch : bottom * pitch + corridor, left * pitch : right * pitch + corridor] = (
            True
        )
    return free


def rooms(height: int, width: int, *, side: int = 15, seed: int) -> np.ndarray:
    """Returns bool [H, W], square rooms of that side; three walls in four between two rooms have
    a door of one cell.
    """
    rng = np.random.default_rng(seed)
    free = empty(height, width)
    pitch = side + 1
    free[side::pitch] = free[:, side::pitch] = False
    for along, rows, cols in ((free, height, width), (free.T, width, height)):
        walls, places = rows // pitch, -(-cols // pitch)
        doors = np.arange(places)[None, :] * pitch + rng.integers(0, side, (walls, places))
        is_there = (rng.random((walls, places)) < 0.75) & (doors < cols)
        wall, place = np.nonzero(is_there)
        along[side + wall * pitch, doors[wall, place]] = True
    return free


def city(height: int, width: int, *, seed: int) -> np.ndarray:
    """Returns bool [H, W], the streets of `city_buildings`; about a third of the map is blocked."""
    return city_buildings(height, width, seed=seed) < 0


def city_buildings(height: int, width: int, *, seed: int) -> np.ndarray:
    """Returns int32 [H, W], the number of the building on each cell, -1 on streets.

    Avenues part the map into quarters of the town; in each the streets have their own direction,
    width and spacing. A block holds one building, set back by nothing to three cells on each side,
    or none.
    """
    rng = np.random.default_rng(seed)
    labels = np.full((height, width), -1, np.int32)
    num_buildings = 0
    for top, left, bottom, right in _quarters(0, 0, height, width, rng):
        lots = _lots(bottom - top, right - left, rng)
        ids = np.cumsum(np.bincount(lots[lots >= 0]) > 0, dtype=np.int32) - 1 + num_buildings
        if len(ids):
            labels[top:bottom, left:right] = np.append(ids, np.int32(-1))[lots]
            num_buildings = int(ids[-1]) + 1
    return labels


def regions(mask: np.ndarray) -> np.ndarray:
    """Returns int64 [H, W], for each cell of `mask` the number of its piece that hangs together by
    sides; -1 elsewhere.

    Runs of cells in a row are linked to those below; a run takes the least number among its links
    until none changes.
    """
    flat = np.pad(mask, ((0, 0), (0, 1))).ravel()
    stride = mask.shape[1] + 1
    run = np.cumsum(flat & ~np.concatenate([[False], flat[:-1]])) - 1
    touching = np.flatnonzero(flat[:-stride] & flat[stride:])
    upper, lower = run[touching], run[touching + stride]
    least = np.arange(run[-1] + 1)
    while len(upper):
        np.minimum.at(least, np.maximum(upper, lower), np.minimum(upper, lower))
        while (least != least[least]).any():
            least = least[least]
        upper, lower = least[upper], least[lower]
        is_apart = upper != lower
        upper, lower = upper[is_apart], lower[is_apart]
    return np.where(flat, np.append(least, -1)[run], -1).reshape(-1, stride)[:, :-1]


def largest_region(free: np.ndarray) -> np.ndarray:
    """Returns bool [H, W], the largest part of `free` that hangs together by sides; the first in
    row order among equals.
    """
    numbers = regions(free)
    return numbers == np.argmax(np.bincount(numbers[free])) if free.any() else free.copy()


def _tree(rows: int, cols: int, rng: np.random.Generator):
    """Yields the steps of a depth-first walk over a grid of places that visits every place once:
    pairs of places.
    """
    order = np.argsort(rng.random((rows * cols, 4)), axis=1).tolist()
    met, path = [False] * (rows * cols), [0] * bool(rows * cols)
    met[:1] = [True] * len(path)
    while path:
        here = path[-1]
        if not order[here]:
            path.pop()
            continue
        row, col = divmod(here, cols)
        down, right = ((0, 1), (1, 0), (0, -1), (-1, 0))[order[here].pop()]
        there = here + down * cols + right
        if 0 <= row + down < rows and 0 <= col + right < cols and not met[there]:
            met[there] = True
            path.append(there)
            yield here, there


def _quarters(top: int, left: int, bottom: int, right: int, rng: np.random.Generator):
    """Yields rectangles (top, left, bottom, right), parted by avenues, none much longer than 180
    cells.
    """
    height, width = bottom - top, right - left
    if max(height, width) <= 180:
        yield top, left, bottom, right
        return
    half, avenue = max(height, width) // 2, int(rng.integers(6, 11))
    cut = half + int(rng.integers(-half // 4, half // 4 + 1))
    if height >= width:
        yield from _quarters(top, left, top + cut, right, rng)
        yield from _quarters(top + cut + avenue, left, bottom, right, rng)
    else:
        yield from _quarters(top, left, bottom, left + cut, rng)
        yield from _quarters(top, left + cut + avenue, bottom, right, rng)


def _lots(height: int, width: int, rng: np.random.Generator) -> np.ndarray:
    """Returns int64 [H, W], the number of the lot whose building stands on each cell, -1 on streets
    and where nothing is built.

    Along and across the streets a cell has whole coordinates, in units of 1 / norm of a cell.
    """
    across, down = _SLOPES[rng.integers(len(_SLOPES))]
    down *= int(rng.choice([-1, 1]))
    rows, cols = np.arange(height)[:, None], np.arange(width)[None, :]
    lot, num_lots, ways = np.zeros((height, width), np.int64), 1, []
    for place in (across * cols + down * rows, across * rows - down * cols):
        block, street = (int(rng.integers(*sizes)) for sizes in ((14, 34), (5, 9)))
        pitch = isqrt((block + street) ** 2 * (across**2 + down**2))
        place = place - place.min() + int(rng.integers(pitch))
        number, number_of_them = place // pitch, int(place.max()) // pitch + 1
        lot, num_lots = lot * number_of_them + number, num_lots * number_of_them
        ways.append((place % pitch * (block + street), pitch, block))
    is_built = np.ones((height, width), bool)
    for within, pitch, block in ways:
        low, high = (
            rng.integers(0, 4, num_lots) * pitch,
            (block - rng.integers(0, 4, num_lots)) * pitch,
        )
        is_built &= (low[lot] <= within) & (within < high[lot])
    is_built &= (rng.random(num_lots) < 0.85)[lot]
    return np.where(is_built, lot, -1)
