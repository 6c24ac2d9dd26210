"""The stages of the paper's loop on goals that are cut off: timed in plain Python, in C++ and as
kernels, and held together.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from experiments.figures.city_fragments import Fragment, free_cells
from srt_jax.bench.paper_pipeline import paper_pipeline
from srt_jax.instances.paper_blockers import BLOCKAGES, block, pick_start_goal
from srt_jax.reference.astar import astar
from srt_jax.reference.jump_point_search import jps
from srt_jax.reference.wall_following import follow_wall
from srt_jax.task import make_task
from srt_jax.types import FREE, Task

STAGES = ("JPS", "A*", "obstacle")
MAKES = ("reference", "C++", "kernels")

_PATIENCE = 50
"""How many pairs of start and goal are drawn for a fragment: a ring may hold the start."""

Cell = tuple[int, int]
Log = Callable[[str], None]


class Case(NamedTuple):
    """A goal cut off on one fragment.

    free, opened: bool [H, W], the cells free with the blocker and without it.
    """

    fragment: str
    blockage: str
    task: Task
    free: np.ndarray
    opened: np.ndarray
    start: Cell
    goal: Cell


def cut_off(fragments: Iterable[Fragment], seed: int, log: Log) -> Iterator[Case]:
    """Yields the five cases of each fragment, start and goal the same in all five; a fragment
    without room is left out.

    Start and goal lie more than 400 of 500 cells apart (PY16 §4), and in that proportion on maps of
    another size.
    """
    for fragment in fragments:
        free = free_cells(fragment.labels)
        apart = 400 * min(free.shape) // 500 + 1
        for draw in range(seed * _PATIENCE, (seed + 1) * _PATIENCE):
            try:
                start, goal = pick_start_goal(free, apart=apart, seed=draw)
                blocked = [block(fragment.labels, start, goal, kind) for kind in BLOCKAGES]
            except ValueError as error:
                reason = error
                continue
            for kind, (labels, blocker) in zip(BLOCKAGES, blocked):
                task = make_task(labels, start, goal, destroyable=[blocker])
                opened = ((labels == FREE) | (labels == blocker)).all(axis=0)
                yield Case(fragment.name, kind, task, free_cells(labels), opened, start, goal)
            break
        else:
            log(f"{fragment.name} is left out: {reason}")


def measure(case: Case, log: Log) -> dict[str, Any]:
    """Returns seconds of each stage by the reference and by C++, counts, and what of it agrees.

    {"fragment", "blockage", "start", "goal", "reference": {stage: seconds}, "C++" where there is a
    compiler, "expansions", "explored": share of the cells reached with no blocker, "seed",
    "contour": cells, "length": with no blocker, "checks": {"no path", "lengths", "C++", "kernels":
    bool}, the last by `measured_kernels`, "agrees": all of them}.
    """
    log(f"{case.fragment}, {case.blockage}")
    free, start, goal = case.free, case.start, case.goal
    jumped, jps_seconds = _time(lambda: jps(free, start, goal))
    explored, astar_seconds = _time(lambda: astar(free, start, goal))
    (seed, walk), obstacle_seconds = _time(lambda: _obstacle(free, explored.closed, goal))
    unblocked, unblocked_seconds = _time(lambda: jps(case.opened, start, goal))
    row = {
        "fragment": case.fragment,
        "blockage": case.blockage,
        "start": start,
        "goal": goal,
        "reference": dict(
            zip(
                (*STAGES, "unblocked JPS"),
                (jps_seconds, astar_seconds, obstacle_seconds, unblocked_seconds),
            )
        ),
        "expansions": {
            "JPS": jumped.num_expansions,
            "A*": explored.num_expansions,
            "unblocked JPS": unblocked.num_expansions,
        },
        "explored": explored.num_expansions / astar(case.opened, start, (-1, -1)).num_expansions,
        "seed": seed,
        "contour": len(set(walk)),
        "length": unblocked.cost,
        "checks": {
            "no path": jumped.cost == explored.cost == float("inf"),
            "lengths": unblocked.cost == astar(case.opened, start, goal).cost,
        },
    }
    _add_cpp(case, row, explored.closed)
    return row | {"agrees": all(row["checks"].values())}


def _add_cpp(case: Case, row: dict[str, Any], closed: np.ndarray) -> None:
    """Puts the seconds of each stage in C++ and what agrees into the row; nothing where there is no
    compiler.
    """
    native = paper_pipeline()
    if native is None:
        return
    (cost, _), jps_seconds = _time(lambda: native.jps(case.free, case.start, case.goal), 5)
    (_, own_closed), astar_seconds = _time(
        lambda: native.astar(case.free, case.start, case.goal), 3
    )

    def obstacle() -> tuple[Cell, np.ndarray]:
        seed = native.seed(own_closed, case.goal)
        return seed, native.contour(case.free, seed, case.goal)

    (seed, contour), obstacle_seconds = _time(obstacle, 5)
    (length, _), unblocked_seconds = _time(
        lambda: native.jps(case.opened, case.start, case.goal), 5
    )
    row["C++"] = dict(
        zip(
            (*STAGES, "unblocked JPS"),
            (jps_seconds, astar_seconds, obstacle_seconds, unblocked_seconds),
        )
    )
    is_same = (
        cost == float("inf")
        and (own_closed == closed).all()
        and np.isclose(length, row["length"], rtol=1e-9)
    )
    row["checks"]["C++"] = bool(is_same) and (seed, int(contour.sum())) == (
        row["seed"],
        row["contour"],
    )


def _obstacle(free: np.ndarray, closed: np.ndarray, goal: Cell) -> tuple[Cell, list[Cell]]:
    """The paper's last step: the cell of CLOSED with the least h, found by going through all of it,
    and the wall followed.
    """
    seed, least = (-1, -1), float("inf")
    for row, col in zip(*(places.tolist() for places in np.nonzero(closed))):
        rows, cols = abs(row - goal[0]), abs(col - goal[1])
        h = max(rows, cols) + (2**0.5 - 1) * min(rows, cols)
        if h < least:
            seed, least = (row, col), h
    return seed, follow_wall(free, seed, goal)


def measured_kernels(
    cases: list[Case], rows: list[dict[str, Any]], repeats: int, log: Log
) -> dict[str, dict[str, list[float]]]:
    """Returns seconds a map of each stage's kernel, {blockage: {stage: one for each repeat}}, all
    fragments in one batch.

    What the kernels find is held against the reference's: the rows' "checks" receive "kernels".
    """
    times = {}
    for blockage in BLOCKAGES:
        log(f"kernels, {blockage}: {repeats} repeats")
        chosen = [place for place, case in enumerate(cases) if case.blockage == blockage]
        times[blockage] = _measured_batch(
            [cases[place] for place in chosen], [rows[place] for place in chosen], repeats
        )
    return times


def _measured_batch(
    cases: list[Case], rows: list[dict[str, Any]], repeats: int
) -> dict[str, list[float]]:
    import jax

    import srt_jax

    free, opened = (
        np.stack([getattr(case, name) for case in cases]) for name in ("free", "opened")
    )
    start, goal = (
        np.array([getattr(case, end) for case in cases], np.int32) for end in ("start", "goal")
    )
    free, opened, start, goal = jax.device_put((free, opened, start, goal))
    reached = srt_jax.reach(free, start)
    seed = srt_jax.seed_cell(reached, goal)
    stages = {
        "JPS": lambda: srt_jax.reach(free, start),
        "A*": lambda: srt_jax.cost_to_come(free, start),
        "obstacle": lambda: (srt_jax.seed_cell(reached, goal), srt_jax.contour(free, seed, goal)),
    }
    times = {}
    for stage, work in stages.items():
        jax.block_until_ready(work())
        taken = [_time(lambda work=work: jax.block_until_ready(work()))[1] for _ in range(repeats)]
        times[stage] = [seconds / len(cases) for seconds in taken]
    found = (reached, seed, srt_jax.contour(free, seed, goal), srt_jax.cost_to_come(opened, start))
    for case, row, *answers in zip(cases, rows, *map(np.asarray, found)):
        row["checks"]["kernels"] = _is_same(case, row, *answers)
        row["agrees"] &= row["checks"]["kernels"]
    return times


def _is_same(
    case: Case,
    row: dict[str, Any],
    reached: np.ndarray,
    seed: np.ndarray,
    contour: np.ndarray,
    length: np.ndarray,
) -> bool:
    """Whether one map's kernels found what the reference found."""
    counts = int(reached.sum()), tuple(seed.tolist()), int(contour.sum())
    is_same = counts == (row["expansions"]["A*"], row["seed"], row["contour"])
    return is_same and bool(np.isclose(length[case.goal], row["length"], rtol=1e-5))


def _time(work: Callable[[], Any], repeats: int = 1) -> tuple[Any, float]:
    """Returns what the work returns, and its median seconds."""
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - began)
    return result, float(np.median(seconds))
