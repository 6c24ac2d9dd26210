"""The blocks tasks of Figure 2: the paper's two, in our own words, and a growing series, IPC's
where its files are.
"""

import itertools
import os
import pathlib
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sign_model.blocks import DOMAIN, TABLE, optimal_length, random_state

SHARED = pathlib.Path(os.environ.get("SRT_SHARED_DATA", "../shared/data")) / "pddl" / "blocks"
"""IPC-2000's files, used where they are there."""

_MOST_FOR_OPTIMUM = 15
"""Blocks up to which the optimum is searched for; the search takes minutes on some tasks beyond."""

Towers = Sequence[str]
"""Towers of one-letter blocks, each from the bottom up."""

PAPER_TASKS: dict[str, tuple[Towers, Towers]] = {
    "BLOCKS-4-0": (("a", "b", "c", "d"), ("abcd",)),
    "BLOCKS-4-1": (("dacb",), ("bacd",)),
}
"""IPC-2000's first two: how the blocks stand at first, and how they shall stand."""


class BlocksTask(NamedTuple):
    """domain, problem: PDDL as text. optimum: steps of a shortest plan, None where it is not
    known.
    """

    name: str
    num_blocks: int
    domain: str
    problem: str
    optimum: int | None


def paper_tasks() -> list[BlocksTask]:
    """Returns the paper's two tasks."""
    return [_from_states(name, *map(_state_of, towers)) for name, towers in PAPER_TASKS.items()]


def series(
    most_blocks: int, *, seed: int, folder: pathlib.Path | None = None
) -> Iterator[BlocksTask]:
    """Yields tasks of 4 to `most_blocks` blocks, smallest first: IPC-2000's where they are there,
    else 3 random ones each.

    A random one is made as IPC's are: any state at first, one tower of all blocks at last.
    """
    folder = folder or SHARED
    files = sorted(
        folder.glob("probBLOCKS-*.pddl"),
        key=lambda path: [int(part) for part in re.findall(r"\d+", path.stem)],
    )
    if files:
        domain = (folder / "domain.pddl").read_text(encoding="utf-8")
        for path in files:
            num_blocks = int(re.findall(r"\d+", path.stem)[0])
            if num_blocks <= most_blocks:
                problem = path.read_text(encoding="utf-8")
                yield BlocksTask(
                    path.stem.removeprefix("prob"),
                    num_blocks,
                    domain,
                    problem,
                    _optimum(problem, num_blocks),
                )
        return
    for num_blocks in range(4, most_blocks + 1):
        for number in range(3):
            rng = np.random.default_rng([seed, num_blocks, number])
            start, order = random_state(num_blocks, rng), rng.permutation(num_blocks)
            goal = np.full(num_blocks, TABLE)
            goal[order[1:]] = order[:-1]
            yield _from_states(f"random-{num_blocks}-{number}", start, goal)


def _from_states(name: str, start: np.ndarray, goal: np.ndarray) -> BlocksTask:
    """Returns the task between two states, int [n]: the block under each block."""
    num_blocks, under = len(start), set(start.tolist())
    facts = [
        f"(on b{block} b{place})" for block, place in enumerate(start.tolist()) if place != TABLE
    ]
    facts += [f"(ontable b{block})" for block, place in enumerate(start.tolist()) if place == TABLE]
    facts += [f"(clear b{block})" for block in range(num_blocks) if block not in under]
    wanted = [
        f"(on b{block} b{place})" for block, place in enumerate(goal.tolist()) if place != TABLE
    ]
    objects = " ".join(f"b{block}" for block in range(num_blocks))
    problem = (
        f"(define (problem {name})\n  (:domain blocks)\n  (:objects {objects})\n"
        f"  (:init {' '.join(facts)} (handempty))\n  (:goal (and {' '.join(wanted)})))\n"
    )
    optimum = optimal_length(start, goal) if num_blocks <= _MOST_FOR_OPTIMUM else None
    return BlocksTask(name, num_blocks, DOMAIN, problem, optimum)


def _state_of(towers: Towers) -> np.ndarray:
    blocks = sorted("".join(towers))
    below = np.full(len(blocks), TABLE)
    for tower in towers:
        for lower, upper in itertools.pairwise(tower):
            below[blocks.index(upper)] = blocks.index(lower)
    return below


def _optimum(problem: str, num_blocks: int) -> int | None:
    """Returns the least number of steps, from the `on` facts of an IPC problem."""
    if num_blocks > _MOST_FOR_OPTIMUM:
        return None
    text = problem.lower()
    names = re.findall(r"[^\s()]+", text[text.index(":objects") : text.index(":init")])[1:]
    names = [name for name in names if name not in ("-", "block")]
    start, goal = np.full(num_blocks, TABLE), np.full(num_blocks, TABLE)
    for state, part in ((start, text[: text.index(":goal")]), (goal, text[text.index(":goal") :])):
        for upper, lower in re.findall(r"\(on\s+(\S+)\s+(\S+?)\s*\)", part):
            state[names.index(upper)] = names.index(lower)
    return optimal_length(start, goal)
