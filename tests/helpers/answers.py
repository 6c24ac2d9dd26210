"""Tasks from pictures and right answers to them, written down by hand."""

import numpy as np

from srt_jax.types import Act, Solution, Status, Task

INF = np.float32(np.inf)
ROOT = 2**0.5


def task_of(
    picture: str, *, fixed: str = "@", cost: dict[str, float] | None = None, **where
) -> Task:
    """A task from a picture: S start, G goal, '#' outside, other letters obstacles in the order of
    the alphabet.

    A second picture after an empty line is a second layer.
    """
    layers = [
        [list(line.strip()) for line in layer.split()] for layer in picture.strip().split("\n\n")
    ]
    signs = np.array(layers)
    names = sorted(set(signs.flat) - set(".SG#"))
    labels = np.full(signs.shape, -1, np.int32)
    labels[signs == "#"] = -2
    for i, name in enumerate(names):
        labels[signs == name] = i
    cells = {
        sign: np.argwhere((signs == sign).any(axis=0))[0] for sign in "SG" if (signs == sign).any()
    } | where
    return Task(
        labels=labels,
        destroyable=np.array([name not in fixed for name in names]),
        removal_cost=np.array([(cost or {}).get(name, 1) for name in names], np.float32),
        start=np.array(cells["S"], np.int32),
        goal=np.array(cells["G"], np.int32),
        size=np.array(labels.shape[1:], np.int32),
    )


def solution_of(task: Task, status: Status, *, room: int = 12, **fields) -> Solution:
    """A solution with what is not given left empty; `contour` as a list of cells."""
    height, width = task.labels.shape[-2:]
    contour = np.zeros((height, width), bool)
    contour[tuple(np.array(fields.get("contour", np.zeros((0, 2), int))).T)] = True
    padded = lambda values, length: np.array([*values, *[-1] * (length - len(values))], np.int32)  # noqa: E731
    cells, destroyed, plan = (
        fields.get("cells", []),
        fields.get("destroyed", []),
        fields.get("plan", []),
    )
    nothing = 0.0 if status.is_solved else np.inf
    return Solution(
        status=np.int32(status),
        cost=np.float32(fields.get("cost", nothing)),
        cells=np.array([*cells, *[(-1, -1)] * (room - len(cells))], np.int32).reshape(room, 2),
        num_cells=np.int32(len(cells)),
        destroyed=padded(destroyed, 4),
        num_destroyed=np.int32(len(destroyed)),
        destroyed_at=padded(fields.get("destroyed_at", []), 4),
        removal_cost=np.float32(fields.get("removal_cost", nothing)),
        removal_bound=np.float32(fields.get("removal_bound", nothing)),
        total=np.float32(fields.get("total", 0)),
        total_bound=np.float32(fields.get("total_bound", 0)),
        seed=np.array(fields.get("seed", (-1, -1)), np.int32),
        contour=contour,
        blocking=padded(fields.get("blocking", []), len(task.destroyable)),
        plan=np.array([*[step[:2] for step in plan], *[(-1, -1)] * (13 - len(plan))], np.int32),
        plan_at=padded([at for *_, at in plan], 13),
        separating=padded(fields.get("separating", []), len(task.destroyable)),
    )


def destroyed_from(obstacle: int, index: int) -> list[tuple]:
    """The two steps that destroy an obstacle from the cell at an index of the route."""
    return [(Act.APPROACH, obstacle, index), (Act.DESTROY, obstacle, index)]


def open_path():
    task = task_of("""
        S.@
        ..@
        .@G
        ...""")
    cells = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (2, 2)]
    return task, solution_of(
        task, Status.PATH_EXISTS, cells=cells, cost=6, plan=[(Act.RELOCATE, -1, 6)]
    )


def two_walls():
    """Fence a, then fence b with a fixed part: the route goes diagonally once."""
    task = task_of(
        """
        S.a..b.
        ..a..@.
        ..a..@G""",
        cost={"a": 2, "b": 0.5},
    )
    cells = [(0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (0, 5), (0, 6), (1, 6), (2, 6)]
    return task, solution_of(
        task,
        Status.SOLVED,
        cells=cells,
        cost=8,
        destroyed=[1, 2],
        destroyed_at=[1, 4],
        plan=[*destroyed_from(1, 1), (Act.PASS, 1, 3), *destroyed_from(2, 4), (Act.PASS, 2, 8)],
        removal_cost=2.5,
        removal_bound=2.5,
        seed=(2, 1),
        contour=[(0, 1), (1, 1), (2, 1)],
        blocking=[1],
    )


def goal_inside():
    """The goal lies in two overlapping obstacles; both are destroyed from the same cell, then one
    diagonal move.
    """
    task = task_of(
        """
        S....
        ..aaa
        ..a.a
        ..aaa

        .....
        .....
        ..bb.
        .....""",
        G=(2, 2),
    )
    return task, solution_of(
        task,
        Status.SOLVED,
        cells=[(0, 0), (1, 1), (2, 1), (2, 2)],
        cost=2 + ROOT,
        destroyed=[1, 0],
        destroyed_at=[1, 1],
        plan=[*destroyed_from(1, 1), (Act.PASS, 1, 1), *destroyed_from(0, 1), (Act.PASS, 0, 3)],
        removal_cost=2,
        removal_bound=1,
        seed=(2, 1),
        contour=[(0, 1), (0, 2), (0, 3), (0, 4), (1, 1), (2, 1), (3, 1)],
        blocking=[0, 1],
    )


def fixed_wall():
    """The wall touches obstacle c by a corner and a gap in the map (#): all one blob, reported by
    the names on its contour.
    """
    task = task_of("""
        S.#.a
        ..@.b
        .c@.G""")
    contour = [(0, 1), (1, 0), (1, 1), (2, 0)]
    return task, solution_of(
        task, Status.UNSOLVABLE, seed=(1, 1), contour=contour, blocking=[0, 3], separating=[0]
    )


def boxed_start():
    task = task_of(
        """
        aaa..
        aaa.G""",
        S=(0, 0),
    )
    return task, solution_of(task, Status.START_BLOCKED)


def goal_in_rock():
    task = task_of(
        """
        S.@
        ...""",
        G=(0, 2),
    )
    fields = {
        "seed": (0, 1),
        "contour": [(0, 1), (1, 1), (1, 2)],
        "blocking": [0],
        "separating": [0],
    }
    return task, solution_of(task, Status.GOAL_BLOCKED, **fields)


def on_the_spot():
    task = task_of("S.@", G=(0, 0))
    return task, solution_of(task, Status.PATH_EXISTS, cells=[(0, 0)])


CASES = [open_path, two_walls, goal_inside, fixed_wall, boxed_start, goal_in_rock, on_the_spot]
