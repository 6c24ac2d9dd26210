"""The exact judge of removal costs: `cost_oracle.cpp`, compiled on the spot; it shares nothing
with the library.
"""

import ctypes
import functools
import pathlib
import subprocess
import tempfile
from typing import Any, NamedTuple

import numpy as np

from srt_jax import Task

MOST_DESTROYABLE = 12
"""Of one task: twice as many sets with each more."""


class Truth(NamedTuple):
    """What is true of each of B tasks, and of a set chosen for each.

    status: int32 [B], as for one who has no limits. The rest only where that is SOLVED. least:
      float32 [B], the least cost,
    rounded down. sizes: uint32 [B], bit n: some least set has n obstacles. opens, is_least,
    is_thin: bool [B], whether the set chosen opens the way, costs the least exactly, needs each of
    its obstacles. cost: float32 [B], its cost, rounded down.
    """

    status: np.ndarray
    least: np.ndarray
    sizes: np.ndarray
    opens: np.ndarray
    is_least: np.ndarray
    is_thin: np.ndarray
    cost: np.ndarray


def judge(batch: Task, chosen: np.ndarray) -> Truth:
    """Returns the truth on a batch of tasks; maps up to 32 x 32, 64 obstacles, MOST_DESTROYABLE of
    them destroyable.

    Args:
      chosen: bool [B, M].

    Raises:
      ValueError: a task is too large. OSError: there is no compiler g++.
    """
    B, layers, height, width = batch.labels.shape
    known = batch.destroyable.shape[1]
    if (
        max(height, width) > 32
        or known > 64
        or batch.destroyable.sum(axis=1).max(initial=0) > MOST_DESTROYABLE
    ):
        raise ValueError(
            f"the oracle takes 32 x 32 cells, 64 obstacles, {MOST_DESTROYABLE} destroyable:"
            f" {batch.labels.shape}"
        )
    words = (chosen.astype(np.uint64) << np.arange(known, dtype=np.uint64)).sum(
        axis=1, dtype=np.uint64
    )
    arrays = [
        np.ascontiguousarray(array, dtype)
        for array, dtype in (
            (batch.labels, np.int32),
            (batch.destroyable, np.uint8),
            (batch.removal_cost, np.float32),
            (batch.start, np.int32),
            (batch.goal, np.int32),
            (words, np.uint64),
        )
    ]
    status, sizes, facts = np.zeros(B, np.int32), np.zeros(B, np.uint32), np.zeros(B, np.int32)
    least, cost = np.zeros(B, np.float32), np.zeros(B, np.float32)
    out = (status, least, sizes, facts, cost)
    _library().judge(
        B,
        layers,
        height,
        width,
        known,
        *(ctypes.c_void_p(array.ctypes.data) for array in (*arrays, *out)),
    )
    return Truth(status, least, sizes, facts & 1 != 0, facts & 2 != 0, facts & 4 != 0, cost)


@functools.cache
def _library() -> Any:
    source = pathlib.Path(__file__).with_suffix(".cpp")
    with tempfile.TemporaryDirectory() as folder:
        built = pathlib.Path(folder) / "cost_oracle.so"
        subprocess.run(
            ["g++", "-O3", "-std=c++17", "-shared", "-fPIC", str(source), "-o", str(built)],
            check=True,
        )
        return ctypes.CDLL(str(built))
