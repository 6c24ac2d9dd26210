"""How many cores a call may use."""

import os


def num_cores() -> int:
    """Returns how many cores an eager call may use: those of the process, at most SRT_JAX_CORES
    (environment).
    """
    count = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    limit = os.environ.get("SRT_JAX_CORES", "")
    return max(1, min(count, int(limit))) if limit.isdecimal() else count
