"""Every kernel against outside truth: SciPy, slow twins, known lengths, and the optimal lengths of
MovingAI's scenarios.

    python -m experiments.campaigns.kernels [--only random,agree,bagels,snakes,data,compile]
    [--quick] [--seed 0] [--data DIR]

random   2,000 maps from 1x1 to 130x97, empty to full: reach, cost_to_come and components equal
         SciPy's, and turning, mirroring, transposing and padding change no bit.
agree    1,000 maps, half of them cut off: A*, JPS and Dijkstra (`srt_jax/reference/`) and the
         kernels have the same reachability, lengths, seed and contour (as the wall follower's
         trace), and each route is walked.
bagels   the contours of the paper's obstacles on the empty map.
snakes   corridors, empty maps and long rows up to 2048x2048 with lengths known without a search:
         all reached, no overflow.
data     every map and scenario under --data (or SRT_SHARED_DATA); left out where there is none.
compile  programs and seconds per kernel at 512x512, each in a process of its own.

Prints a row per check: how many were made, how many failed, the largest relative error. What fails
is printed on standard error with kind, seed and size. Exit code 1 if anything did.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence

import jax.numpy as jnp
import numpy as np

import srt_jax
from experiments.campaigns.inputs import kernel_maps as maps
from experiments.campaigns.judges import kernel_judges as judges
from experiments.campaigns.judges import kernel_truth as truth
from experiments.campaigns.judges.tally import Tally, progress
from srt_jax import components
from srt_jax.moves import max_path_cells
from srt_jax.propagation import fixed_point
from srt_jax.reference.wall_following import follow_wall

KERNELS = ("reach", "cost_to_come", "seed_cell", "contour", "trace_path")
PARTS = ("random", "agree", "bagels", "snakes", "data", "compile")
AT_ONCE = 64
"""Maps in a batch, also in the last one of a part: no other shape is compiled."""
SIDES = (64, 192)
"""Sides of the squares that random maps lie in, the top left corner of each."""
CHANGES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "turned by 90": np.rot90,
    "turned by 180": lambda x: np.rot90(x, 2),
    "turned by 270": lambda x: np.rot90(x, 3),
    "mirrored": np.fliplr,
    "upside down": np.flipud,
    "transposed": np.transpose,
}


def batches(
    drawn: Sequence[maps.Drawn], side: int
) -> Iterator[tuple[Sequence[maps.Drawn], np.ndarray, np.ndarray]]:
    """Yields AT_ONCE maps at a time in squares: the maps, free bool [AT_ONCE, side, side], starts
    int32 [AT_ONCE, 2].
    """
    for first in range(0, len(drawn), AT_ONCE):
        some = drawn[first : first + AT_ONCE]
        free, starts = np.zeros((AT_ONCE, side, side), bool), np.zeros((AT_ONCE, 2), np.int32)
        for index, (_, one, start) in enumerate(some):
            free[index, : one.shape[0], : one.shape[1]], starts[index] = one, start
        yield some, free, starts


def random_part(tally: Tally, count: int, seed: int, largest: tuple[int, int]) -> None:
    drawn = [maps.draw_map(seed, index, *largest) for index in range(count)]
    small = [one for one in drawn if max(one.free.shape) <= SIDES[0]]
    large = [one for one in drawn if max(one.free.shape) > SIDES[0]]
    work = [batch for side, group in zip(SIDES, (small, large)) for batch in batches(group, side)]
    rng = np.random.default_rng([seed, 1])
    for some, free, starts in progress("random maps", work, len(work)):
        results = reached, lengths = [
            np.asarray(kernel(free, starts)) for kernel in (srt_jax.reach, srt_jax.cost_to_come)
        ]
        expected = truth.reached_by_scipy(free, starts)
        errors = truth.relative_errors(lengths, truth.lengths_by_scipy(free, starts))
        limit = truth.off_by(0) + truth.HALF_AGAIN
        for index, one in enumerate(some):
            title = f"{one.title}, start {one.start.tolist()}"
            tally.judge(
                "reach equals scipy.ndimage.label",
                np.array_equal(reached[index], expected[index]),
                title,
            )
            tally.near("cost_to_come equals scipy's dijkstra", errors[index], limit, title)
            pieces = truth.pieces_by_scipy(~one.free)
            tally.judge(
                "components equal scipy's",
                np.array_equal(components.label(~one.free), pieces),
                title,
            )
        nowhere = [(0, 0)] * len(some)
        for name, change in CHANGES.items():
            judges.judge_change(tally, f"{name}: no bit changes", some, change, nowhere, results)
        shifts = [
            tuple(rng.integers(0, free.shape[1] + 1 - np.array(one.free.shape))) for one in some
        ]
        judges.judge_change(
            tally, "padded on all sides: no bit changes", some, lambda x: x, shifts, results
        )


def agree_part(tally: Tally, count: int, seed: int) -> None:
    """Half of the goals can be reached, as far as the map has such cells."""
    drawn, number = [], 0
    while len(drawn) < count:
        one, number = maps.draw_map(seed + 1, number, 48, 48), number + 1
        if truth.starts_inside(one.free[None], one.start[None])[0]:
            drawn.append(one)
    work = list(batches(drawn, SIDES[0]))
    for first, (some, free, starts) in enumerate(progress("maps with a goal", work, len(work))):
        reached = np.asarray(srt_jax.reach(free, starts))
        goals = np.zeros_like(starts)
        for index, one in enumerate(some):
            height, width = one.free.shape
            inside = reached[index, :height, :width]
            cells = np.argwhere(inside if index % 2 or inside.all() else ~inside)
            goals[index] = cells[np.random.default_rng([seed, first, index]).integers(len(cells))]
        lengths, seeds = (
            np.asarray(srt_jax.cost_to_come(free, starts)),
            np.asarray(srt_jax.seed_cell(reached, goals)),
        )
        path = srt_jax.trace_path(lengths, goals, max_cells=max_path_cells(48, 48))
        cells, num_cells, costs = (
            np.asarray(path.cells),
            np.asarray(path.num_cells),
            np.asarray(path.cost),
        )
        for index, one in enumerate(some):
            height, width = one.free.shape
            start, goal = (tuple(ends[index].tolist()) for ends in (starts, goals))
            title = f"{one.title}, start {start}, goal {goal}"
            flood, field = reached[index, :height, :width], lengths[index, :height, :width]
            is_reached = judges.judge_search(tally, one.free, start, goal, flood, field, title)
            if is_reached:
                problem = truth.route_problem(
                    one.free, start, goal, cells[index, : num_cells[index]], float(costs[index])
                )
                problem = problem or (
                    ""
                    if costs[index] == field[goal]
                    else f"{costs[index]} stated, {field[goal]} to come"
                )
                tally.judge(
                    "trace_path is a walk of its stated length", not problem, f"{title}: {problem}"
                )
            else:
                tally.judge(
                    "no path, no cells", num_cells[index] == 0 and np.isinf(costs[index]), title
                )
                judges.judge_contour(
                    tally, one.free, flood, tuple(seeds[index].tolist()), goal, title
                )


def bagels_part(tally: Tally) -> None:
    """PY16 §4: obstacles on the empty map of 500x500, the goal inside or behind."""
    cases = {
        "half": (500, 450),
        "quarter": (501, 450),
        "bagel-10": (44, 400),
        "bagel-50": (204, 400),
        "bagel-100": (404, 400),
    }
    for name, (expected, col) in cases.items():
        free, goal = np.ones((500, 500), bool), (450 if name == "quarter" else 250, col)
        if name == "half":
            free[:, 250] = False
        elif name == "quarter":
            free[250:, 250] = free[250, 250:] = False
        else:
            half = int(name.split("-")[1]) // 2
            free[250 - half : 250 + half, 400 - half : 400 + half] = False
            free[251 - half : 249 + half, 401 - half : 399 + half] = True
        seed = np.asarray(srt_jax.seed_cell(srt_jax.reach(free, (20, 20)), goal))
        got = int(np.asarray(srt_jax.contour(free, seed, goal)).sum())
        trace = len(set(follow_wall(free, tuple(seed.tolist()), goal)))
        tally.judge(
            f"{name}: {expected} cells round it",
            got == trace == expected,
            f"contour {got}, wall follower {trace}",
        )


def snakes_part(tally: Tally, sides: Sequence[int], rows: Sequence[int]) -> None:
    cases: list[Callable[[], maps.Known]] = []
    for side in sides:
        cases += [
            lambda side=side: maps.snake(side, side),
            lambda side=side: maps.snake(side, side).reversed(),
        ]
        cases += [
            lambda side=side: maps.snake(side, side).turned(),
            lambda side=side: maps.stairs(side),
        ]
        cases += [
            lambda side=side, broad=broad: maps.wide_snake(side, broad)
            for broad in (2, 9, side // 2 - 1)
        ]
        cases += [lambda side=side: maps.empty(side, side)]
    for length in rows:
        cases += [
            lambda length=length: maps.empty(1, length),
            lambda length=length: maps.empty(length, 1).reversed(),
        ]
    for make in progress("corridors", cases, len(cases)):
        known = make()
        judges.judge_known(tally, known, max(known.free.shape))


def data_part(tally: Tally, folder: pathlib.Path, seed: int) -> None:
    from srt_jax.answers.scenario_lengths import MATCH, optimal_lengths, relative_errors
    from srt_jax.formats.movingai import read_map, read_scen
    from srt_jax.formats.notes import Notes
    from srt_jax.formats.shared.scenarios import scenario_maps

    paths = sorted(folder.rglob("*.map"))
    for path in progress("maps", paths, len(paths)):
        free = np.asarray(read_map(path))
        cells = np.argwhere(free).astype(np.int32)
        starts = cells[np.random.default_rng(seed).integers(len(cells), size=4)]
        many = np.repeat(free[None], 4, 0)
        reached, expected = (
            np.asarray(srt_jax.reach(many, starts)),
            truth.reached_by_scipy(many, starts),
        )
        for start, got, right in zip(starts.tolist(), reached, expected):
            tally.judge(
                "reach equals scipy.ndimage.label",
                np.array_equal(got, right),
                f"{path.name}, start {start}",
            )
        lengths = np.asarray(srt_jax.cost_to_come(free, starts[0]))
        error = truth.relative_errors(lengths[None], truth.lengths_by_scipy(many[:1], starts[:1]))[
            0
        ]
        limit = truth.off_by(int(fixed_point.finest_scale(jnp.asarray(free)))) + truth.HALF_AGAIN
        tally.near(
            "cost_to_come equals scipy's dijkstra",
            error,
            limit,
            f"{path.name}, start {starts[0].tolist()}",
        )
    scenarios = sorted(folder.rglob("*.scen"))
    for path in progress("scenarios", scenarios, len(scenarios)):
        rows = read_scen(path)
        errors = relative_errors(
            optimal_lengths(
                scenario_maps(str(path), list(enumerate(rows)), None, Notes())[0], rows
            ),
            rows,
        )
        for number, error in enumerate(errors, 1):
            tally.near(
                "rows of scenarios have their optimal length",
                error,
                MATCH,
                f"{path.name}, row {number}",
            )


def compile_part(tally: Tally, side: int = 512) -> None:
    for kernel in KERNELS:
        for batch in (1, 64):
            command = [
                sys.executable,
                "-m",
                "experiments.campaigns.compile_seconds",
                kernel,
                str(side),
                str(batch),
            ]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            record = json.loads(done.stdout)
            is_right = record["programs"] == 1 and record["programs_for_new_sizes"] == 0
            tally.judge(
                "one program per size and batch bucket",
                is_right,
                f"{kernel}, batch {batch}: {record}",
            )
            print(
                f"{kernel}, {batch} of {side}x{side}: compiled in {record['seconds']:.2f} s"
                f" ({record['in_xla']:.2f} in XLA)",
                flush=True,
            )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--only", default=",".join(PARTS), metavar="PARTS", help="some of %(default)s"
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="few and small maps, in under a minute; neither data nor compile",
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--data", type=pathlib.Path, default=os.environ.get("SRT_SHARED_DATA"), metavar="DIR"
    )
    options = parser.parse_args(arguments)
    # Run the parts one after the other; each adds its checks to the tally.
    parts, tally = options.only.split(","), Tally()
    if unknown := sorted(set(parts) - set(PARTS)):
        parser.error(f"--only: there is no part {unknown[0]!r}, only {', '.join(PARTS)}")
    for part in parts:
        tally.part, begin = part, time.perf_counter()
        run_part(tally, options)
        print(f"{part}: {time.perf_counter() - begin:.0f} s", flush=True)
    print(f"\n{tally}\n{tally.num_wrong} checks failed")
    return int(tally.num_wrong > 0)


def run_part(tally: Tally, options: argparse.Namespace) -> None:
    quick, seed = options.quick, options.seed
    match tally.part:
        case "random":
            random_part(
                tally,
                AT_ONCE if quick else 2000,
                seed,
                (60, 45) if quick else (maps.TALLEST, maps.WIDEST),
            )
        case "agree":
            agree_part(tally, AT_ONCE if quick else 1000, seed)
        case "bagels" if not quick:
            bagels_part(tally)
        case "snakes":
            snakes_part(
                tally,
                (64,) if quick else (64, 130, 512, 1024, 1705, 2048),
                (2, 300) if quick else (2, 97, 2048, 4096),
            )
        case "data" if not quick:
            if options.data is None or not pathlib.Path(options.data).is_dir():
                print("data: left out, there is no folder --data (or SRT_SHARED_DATA)")
            else:
                data_part(tally, pathlib.Path(options.data), seed)
        case "compile" if not quick:
            compile_part(tally)
        case _:
            print(f"{tally.part}: left out by --quick")


if __name__ == "__main__":
    sys.exit(main())
