"""What a measurement is worth nothing without: the machine, the versions, and how far the times
scatter.
"""

import importlib.metadata
import os
import pathlib
import platform
from collections.abc import Sequence
from typing import Any

import numpy as np


def machine(*packages: str) -> dict[str, Any]:
    """Returns {"cpu", "cores", "load", "system", "python", "packages": {name: version}}; None for a
    package that is absent.

    `load` is the number of processes that wanted a core in the minute before: well over 0, times
    are too long.
    """
    return {
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        "load": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in ("jax", "jaxlib", "numpy", *packages)},
    }


def machine_line(facts: dict[str, Any]) -> str:
    """Returns the facts of `machine` in one line."""
    versions = ", ".join(
        f"{name} {version}" for name, version in facts["packages"].items() if version
    )
    load = f", load {facts['load']:.1f}" if facts["load"] is not None else ""
    return (
        f"{facts['cpu']}, {facts['cores']} cores{load}, {facts['system']}, Python"
        f" {facts['python']}, {versions}"
    )


def spread(values: Sequence[float]) -> dict[str, float]:
    """Returns {"median", "low", "high", "count"}: the middle value and the quartiles round it; NaN
    where there is no value.
    """
    if not len(values):
        return {"median": float("nan"), "low": float("nan"), "high": float("nan"), "count": 0}
    low, median, high = np.percentile(values, (25, 50, 75)).tolist()
    return {"median": median, "low": low, "high": high, "count": len(values)}


def _cpu() -> str:
    listing = pathlib.Path("/proc/cpuinfo")
    lines = listing.read_text().splitlines() if listing.is_file() else []
    return next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")),
        platform.processor(),
    )


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None
