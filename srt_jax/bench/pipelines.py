"""Whole answers by other means: the paper's pipeline in C++, and what is put together from OpenCV,
SciPy and scikit-image.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from srt_jax.bench.paper_pipeline import paper_pipeline
from srt_jax.bench.peers import module
from srt_jax.types import Cell

Ends = list[tuple[Cell, Cell]]
Maps = list[np.ndarray]

GIVES = {
    "PY16 in C++": "proof, seed, contour, length of the route",
    "SciPy": "proof, seed, contour, length of the route",
    "scikit-image": "proof, a route that cuts corners",
    "OpenCV": "proof, seed, contour",
}


def pipelines(free: Maps, opened: Maps, ends: Ends) -> dict[str, Callable[[], list[Any]] | None]:
    """Returns what does all tasks, by name; None for one that is not installed (or needs g++, which
    is not there).

    Args:
      free, opened: bool [H, W], with the blocker and without it: the peers are given what to
        destroy.
      ends: start and goal, (row, col), of each.
    """
    makers = {"PY16 in C++": _cpp, "SciPy": _scipy, "scikit-image": _skimage, "OpenCV": _opencv}
    return {name: make(free, opened, ends) for name, make in makers.items()}


def _cpp(free: Maps, opened: Maps, ends: Ends) -> Callable[[], list[Any]] | None:
    native = paper_pipeline()
    if native is None:
        return None

    def one(
        blocked: np.ndarray, unblocked: np.ndarray, start: Cell, goal: Cell
    ) -> tuple[Cell, np.ndarray, float]:
        native.jps(blocked, start, goal)
        _, closed = native.astar(blocked, start, goal)
        seed = native.seed(closed, goal)
        return seed, native.contour(blocked, seed, goal), native.jps(unblocked, start, goal)[0]

    return lambda: [one(a, b, start, goal) for a, b, (start, goal) in zip(free, opened, ends)]


def _scipy(free: Maps, opened: Maps, ends: Ends) -> Callable[[], list[Any]] | None:
    ndimage, csgraph = module("scipy.ndimage"), module("scipy.sparse.csgraph")
    if ndimage is None or csgraph is None:
        return None
    square = np.ones((3, 3), bool)

    def one(
        blocked: np.ndarray, unblocked: np.ndarray, start: Cell, goal: Cell
    ) -> tuple[Cell, np.ndarray, float]:
        regions, _ = ndimage.label(blocked)
        reached = regions == regions[start]
        seed = _nearest(reached, goal)
        obstacles, _ = ndimage.label(~blocked, structure=square)
        obstacle = obstacles == obstacles[_ahead(seed, goal)]
        contour = ndimage.binary_dilation(obstacle, structure=square) & reached
        return seed, contour, _dijkstra(csgraph, unblocked, start, goal)

    return lambda: [one(a, b, start, goal) for a, b, (start, goal) in zip(free, opened, ends)]


def _dijkstra(csgraph: Any, free: np.ndarray, start: Cell, goal: Cell) -> float:
    from srt_jax.bench.peers import move_graph
    from srt_jax.moves import FIXED_POINTS

    width = free.shape[1]
    lengths = csgraph.dijkstra(
        move_graph(free), directed=False, indices=start[0] * width + start[1]
    )
    return float(lengths[goal[0] * width + goal[1]]) / FIXED_POINTS[0][0]


def _skimage(free: Maps, opened: Maps, ends: Ends) -> Callable[[], list[Any]] | None:
    measure, graph = module("skimage.measure"), module("skimage.graph")
    if measure is None or graph is None:
        return None

    def one(
        blocked: np.ndarray, unblocked: np.ndarray, start: Cell, goal: Cell
    ) -> tuple[bool, float]:
        regions = measure.label(blocked, connectivity=1)
        _, length = graph.route_through_array(
            np.where(unblocked, 1.0, -1.0), start, goal, fully_connected=True, geometric=True
        )
        return bool(regions[start] == regions[goal]), float(length)

    return lambda: [one(a, b, start, goal) for a, b, (start, goal) in zip(free, opened, ends)]


def _opencv(free: Maps, opened: Maps, ends: Ends) -> Callable[[], list[Any]] | None:
    cv2 = module("cv2")
    if cv2 is None:
        return None
    cv2.setNumThreads(1)
    square = np.ones((3, 3), np.uint8)

    def filled(mask: np.ndarray, cell: Cell, connectivity: int) -> np.ndarray:
        image = mask.astype(np.uint8)
        cv2.floodFill(image, None, cell[::-1], 2, flags=connectivity)
        return image == 2

    def one(blocked: np.ndarray, start: Cell, goal: Cell) -> tuple[Cell, np.ndarray]:
        reached = filled(blocked, start, 4)
        seed = _nearest(reached, goal)
        obstacle = filled(~blocked, _ahead(seed, goal), 8).astype(np.uint8)
        return seed, cv2.dilate(obstacle, square).astype(bool) & reached

    return lambda: [one(blocked, start, goal) for blocked, (start, goal) in zip(free, ends)]


def _nearest(reached: np.ndarray, goal: Cell) -> Cell:
    rows, cols = (np.abs(np.arange(length) - place) for length, place in zip(reached.shape, goal))
    h = np.maximum(rows[:, None], cols) + (2**0.5 - 1) * np.minimum(rows[:, None], cols)
    row, col = np.unravel_index(np.where(reached, h, np.inf).argmin(), reached.shape)
    return int(row), int(col)


def _ahead(seed: Cell, goal: Cell) -> Cell:
    """The blocked cell beside the seed on the longer way to the goal."""
    rows, cols = goal[0] - seed[0], goal[1] - seed[1]
    return (
        (seed[0] + int(np.sign(rows)), seed[1])
        if abs(rows) >= abs(cols)
        else (seed[0], seed[1] + int(np.sign(cols)))
    )
