"""What else labels maps on a GPU, where it is installed: CuPy and cuCIM, all maps in one call."""

import importlib
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np


def peers(side: int, batches: Sequence[int]) -> list[dict[str, Any]]:
    """Returns [{"name", "batch", "seconds"}], the median of nine calls; none for what is missing.

    Connected components of the free cells tell what `reach` tells, for every start at once, but
    with diagonal steps that cut corners left out: only rows and columns are joined.
    """
    rows = []
    for module, function, name in (
        ("cupyx.scipy.ndimage", "label", "CuPy label"),
        ("cucim.skimage.measure", "label", "cuCIM label"),
        ("cucim.core.operations.morphology", "distance_transform_edt", "cuCIM distances"),
    ):
        try:
            call = getattr(importlib.import_module(module), function)
            cupy = importlib.import_module("cupy")
        except (ImportError, AttributeError):
            continue
        rows += [
            {"name": name, "batch": batch, "seconds": _seconds(call, cupy, side, batch, name)}
            for batch in batches
        ]
    return rows


def _seconds(call: Callable, cupy: Any, side: int, batch: int, name: str) -> float:
    rng = np.random.default_rng([side, batch])
    maps = rng.random((batch, side, side)) >= 0.2
    if name == "CuPy label":  # a stack of maps: no joins from one to the next
        structure = np.zeros((3, 3, 3), int)
        structure[1] = [[0, 1, 0], [1, 1, 1], [0, 1, 0]]
        array, options = cupy.asarray(maps), {"structure": cupy.asarray(structure)}
    else:  # maps beside each other, a blocked row between them
        array, options = cupy.asarray(np.pad(maps, ((0, 0), (0, 1), (0, 0))).reshape(-1, side)), {}
        if name == "cuCIM label":
            options = {"connectivity": 1}
    taken = []
    for _ in range(10):
        began = time.perf_counter()
        call(array, **options)
        cupy.cuda.Device().synchronize()
        taken.append(time.perf_counter() - began)
    return float(np.median(taken[1:]))
