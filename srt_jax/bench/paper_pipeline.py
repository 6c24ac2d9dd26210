"""The paper's pipeline in C++, compiled on the spot: what `solve` and the reference algorithms are
measured against.
"""

import ctypes
import functools
from typing import Any

import numpy as np

from srt_jax.bench.native import compiled
from srt_jax.types import Cell


class PaperPipeline:
    """The stages of PY16 §3.2, each on one map bool [H, W] with cells (row, col)."""

    def __init__(self, library: Any) -> None:
        self._library = library

    def jps(self, free: np.ndarray, start: Cell, goal: Cell) -> tuple[float, int]:
        """Returns the length of a shortest path, inf where there is none, and the cells
        expanded.
        """
        cost = ctypes.c_double()
        expanded = self._library.paper_jps(
            _at(free), *free.shape, *start, *goal, ctypes.byref(cost)
        )
        return cost.value, expanded

    def astar(self, free: np.ndarray, start: Cell, goal: Cell) -> tuple[float, np.ndarray]:
        """Returns the same length, and CLOSED, bool [H, W]: every cell that can be reached where
        there is no path.
        """
        cost, closed = ctypes.c_double(), np.empty(free.shape, bool)
        self._library.paper_astar(
            _at(free), *free.shape, *start, *goal, ctypes.byref(cost), _at(closed)
        )
        return cost.value, closed

    def seed(self, closed: np.ndarray, goal: Cell) -> Cell:
        """Returns the closed cell nearest the goal, (-1, -1) where none is closed."""
        seed = (ctypes.c_int32 * 2)()
        self._library.paper_seed(_at(closed), *closed.shape, *goal, seed)
        return seed[0], seed[1]

    def contour(self, free: np.ndarray, seed: Cell, goal: Cell) -> np.ndarray:
        """Returns the cells that wall following passes, bool [H, W]."""
        contour = np.zeros(free.shape, bool)
        self._library.paper_contour(
            _at(free), *free.shape, (ctypes.c_int32 * 2)(*seed), *goal, _at(contour)
        )
        return contour


@functools.cache
def paper_pipeline() -> PaperPipeline | None:
    """Returns the pipeline, compiled; None where there is no compiler."""
    library = compiled("paper_pipeline")
    return None if library is None else PaperPipeline(library)


def _at(array: np.ndarray) -> ctypes.c_void_p:
    if array.dtype != bool or not array.flags.c_contiguous:
        raise ValueError(
            f"maps must be contiguous bool arrays, got {array.dtype}: call numpy.ascontiguousarray"
        )
    return ctypes.c_void_p(array.ctypes.data)
