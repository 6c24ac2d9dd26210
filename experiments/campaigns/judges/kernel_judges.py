"""What the campaign of the kernels checks of a batch of changed maps, of one search, of one contour
and of a map whose lengths are known.
"""

from collections.abc import Callable, Sequence

import jax.numpy as jnp
import numpy as np

import srt_jax
from experiments.campaigns.inputs import kernel_maps as maps
from experiments.campaigns.judges import kernel_truth as truth
from experiments.campaigns.judges.tally import Tally
from srt_jax.moves import max_path_cells
from srt_jax.propagation import fixed_point
from srt_jax.reference.astar import astar
from srt_jax.reference.dijkstra import dijkstra
from srt_jax.reference.jump_point_search import jps
from srt_jax.reference.wall_following import follow_wall

Cell = tuple[int, int]


def judge_change(
    tally: Tally,
    check: str,
    some: Sequence[maps.Drawn],
    change: Callable[[np.ndarray], np.ndarray],
    shifts: Sequence[tuple[int, int]],
    results: Sequence[np.ndarray],
) -> None:
    """The results of maps changed, then moved by `shifts`, are the results of the maps, changed and
    moved: in every bit.
    """
    squares = [
        np.zeros_like(results[0]),
        np.zeros_like(results[0]),
        np.full_like(results[1], np.inf),
    ]
    starts = np.full((len(squares[0]), 2), -1, np.int32)
    for index, (one, (down, right)) in enumerate(zip(some, shifts)):
        height, width = one.free.shape
        mark = np.zeros((height, width), bool)
        if ((one.start >= 0) & (one.start < one.free.shape)).all():
            mark[tuple(one.start)] = True
            starts[index] = np.argwhere(change(mark))[0] + [down, right]
        for square, own in zip(squares, (one.free, results[0][index], results[1][index])):
            part = change(own[:height, :width])
            square[index, down : down + part.shape[0], right : right + part.shape[1]] = part
    got = [
        np.asarray(kernel(squares[0], starts)) for kernel in (srt_jax.reach, srt_jax.cost_to_come)
    ]
    for index, one in enumerate(some):
        is_same = all(a[index].tobytes() == b[index].tobytes() for a, b in zip(got, squares[1:]))
        tally.judge(
            check, is_same, f"{one.title}, start {one.start.tolist()}, moved by {shifts[index]}"
        )


def judge_search(
    tally: Tally,
    free: np.ndarray,
    start: Cell,
    goal: Cell,
    flood: np.ndarray,
    field: np.ndarray,
    title: str,
) -> bool:
    """Reachability and length by four ways; returns whether the goal can be reached."""
    slow, fast = astar(free, start, goal), jps(free, start, goal)
    is_reached = np.isfinite(slow.cost)
    limit = truth.off_by(0) + truth.HALF_AGAIN
    tally.judge(
        "A*, JPS and reach: is the goal reached",
        is_reached == np.isfinite(fast.cost) == flood[goal],
        title,
    )
    tally.judge(
        "JPS is as long as A*", slow.cost == fast.cost, f"{title}: {slow.cost} and {fast.cost}"
    )
    errors = truth.relative_errors(field[None], dijkstra(free, start)[None])
    tally.near("cost_to_come equals the bucket Dijkstra", errors[0], limit, title)
    if is_reached:
        tally.near(
            "cost_to_come equals A* at the goal",
            abs(float(field[goal]) - slow.cost) / max(slow.cost, 1),
            limit,
            title,
        )
    else:
        tally.judge("A*'s CLOSED is what reach reaches", np.array_equal(slow.closed, flood), title)
    return is_reached


def judge_contour(
    tally: Tally, free: np.ndarray, flood: np.ndarray, seed: Cell, goal: Cell, title: str
) -> None:
    """The seed is the nearest of CLOSED, and the contour, as a set, what the wall follower
    passes.
    """
    tally.judge(
        "seed_cell is the nearest of A*'s CLOSED", seed == truth.nearest_of(flood, goal), title
    )
    trace = set(follow_wall(free, seed, goal))
    walked = {(row, col) for row, col in np.argwhere(srt_jax.contour(free, seed, goal)).tolist()}
    tally.judge("contour is the wall follower's trace", walked == trace, title)


def judge_known(tally: Tally, known: maps.Known, side: int) -> None:
    start = np.array(known.start, np.int32)
    lengths = np.asarray(srt_jax.cost_to_come(known.free, start))
    is_whole = np.array_equal(np.isfinite(lengths), known.free) and np.array_equal(
        srt_jax.reach(known.free, start), known.free
    )
    tally.judge("every free cell is reached, no other", is_whole, known.title)
    limit = truth.off_by(int(fixed_point.finest_scale(jnp.asarray(known.free)))) + truth.HALF_AGAIN
    error = abs(float(lengths[known.goal]) - known.length) / max(known.length, 1)
    kind = "straight" if known.diagonal == 0 else "with diagonals"
    tally.near(
        f"length up to {side} cells a side, {kind}",
        error,
        limit,
        f"{known.title}, scale of error {limit:.1e}",
    )
    if known.is_corridor:
        steps = np.sort(lengths[known.free])
        tally.judge(
            "costs along a corridor are 0, 1, 2, ...",
            np.array_equal(steps, np.arange(len(steps))),
            known.title,
        )
        path = srt_jax.trace_path(
            lengths, np.array(known.goal, np.int32), max_cells=max_path_cells(*known.free.shape)
        )
        is_right = int(path.num_cells) == known.straight + 1 and float(path.cost) == known.length
        tally.judge(
            "trace_path holds every cell of a corridor",
            is_right,
            f"{known.title}: {path.num_cells}, {path.cost}",
        )
