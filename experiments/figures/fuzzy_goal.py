"""Figure 1 of the paper, end to end: a goal named by a fuzzy direction and distance, down to the
route walked, and drawn.

The agent knows that the goal lies "afar, ahead-left 22.5..27.5 deg". Those signs are grounded in a
sector; the smallest square that holds it is the goal area, and a cell of the grid is as large (PY16
§2, §3.2). The symbolic level plans to relocate there; the path planner finds no path and reports
what blocks; the obstacles become signs where they are seen, and the plan becomes: approach,
destroy, pass. Each leg of the route is an instance of a relocation, with its permitted deviation H.
"""

import itertools
import math
from typing import Any, NamedTuple

import numpy as np

from experiments.figures.column_style import column_figure
from sign_model import plan
from sign_model.relocation.domain import Scene, scene_task
from sign_model.space.fuzzy import region_names, regions_touched, relocation_of, sector_of
from sign_model.space.fuzzy_table import DEFAULT_TABLE, Direction, Distance, FuzzyTable, Relocation
from sign_model.space.polar import (
    Sector,
    from_polar,
    path_deviation,
    sector_corners,
    sector_of_points,
    square_of_sector,
)
from srt_jax import Obstacle, Solution, Status, Task, World, check, rasterize, solve
from srt_jax.geometry.raster import Grid, grid_over, point_of

AGENT, HEADING = np.array([10.0, 13.0]), math.radians(7.5)
RADIUS = 2.0
GOAL = "afar, ahead-left 22.5..27.5 deg"
CELLS_AROUND = (8, 6, 3, 2)
"""Cells between the goal square and the bounds of the world: to the west, south, east and north."""


def fine_table() -> FuzzyTable:
    """Returns a table of 72 directions, each of the eight coarse ones in nine parts; four
    distances, two deviations and any.
    """
    directions = []
    for row in DEFAULT_TABLE.directions:
        for part in range(9):
            start, end = row.start + 5 * part, row.start + 5 * (part + 1)
            directions.append(Direction(f"{row.name} {start:g}..{end:g} deg", start, end))
    distances = (
        Distance("close", 0.0, 20.0),
        Distance("midway", 20.0, 55.0),
        Distance("afar", 55.0, 60.0),
        Distance("beyond", 60.0, 1000.0),
    )
    manners = (("in a straight line", 5.0), ("on a curve", 12.0), ("by a detour", math.inf))
    relocations = tuple(
        Relocation(f"moving {distance.name} {manner}", distance.name, deviation)
        for distance in distances
        for manner, deviation in manners
    )
    return FuzzyTable(tuple(directions), distances, relocations, soft_degrees=1.0, soft_metres=1.0)


class Story(NamedTuple):
    """What happened. first_plan, plan: the symbolic steps before and after the path planner's
    report.

    seen: the signs of the regions in which each blocking obstacle's contour is seen. legs: per
      relocation carried out its
    points float [N, 2], its sign, the deviation that permits, and how far it strayed.
    """

    table: FuzzyTable
    sector: Sector
    square: tuple[np.ndarray, float]
    world: World
    grid: Grid
    task: Task
    solution: Solution
    first_plan: tuple[str, ...]
    seen: dict[str, list[str]]
    plan: tuple[str, ...]
    legs: list[tuple[np.ndarray, str, float, float]]


def plan_and_walk() -> Story:
    """Returns the whole way down from the goal's sign to the route, and up again from what blocks
    to the plan.
    """
    table = fine_table()
    region = region_names(table).index(GOAL)
    sector = sector_of(np.array(region), table)
    centre, side = square_of_sector(sector, AGENT, np.float64(HEADING))
    # whole millimetres; the sector stays within
    centre, side = centre.round(3), math.ceil(500 * float(side)) / 500 + 0.002
    world = _world(centre, side)
    task, grid = rasterize(world), grid_over(world.bounds, world.goal_side)
    first_plan = plan(scene_task(Scene("here", "goal-area", ways=(("here", "goal-area"),)))).actions
    solution = solve(task)
    if check(task, solution) or Status(int(solution.status)) is not Status.SOLVED:
        raise AssertionError("the scene of Figure 1 should be solved by destroying")
    seen, names = _report(task, solution, grid, world, table)
    return Story(
        table=table,
        sector=sector,
        square=(centre, side),
        world=world,
        grid=grid,
        task=task,
        solution=solution,
        first_plan=first_plan,
        seen=seen,
        plan=plan(scene_task(_scene(names, world, seen))).actions,
        legs=_legs(solution, grid, table),
    )


def _world(centre: np.ndarray, side: float) -> World:
    """The goal square's lattice all over; a fence from edge to edge, which can be destroyed, and
    buildings, which cannot.
    """
    west, south, east, north = CELLS_AROUND
    low, high = centre - side / 2, centre + side / 2
    bounds = (
        low[0] - west * side,
        low[1] - south * side,
        high[0] + east * side,
        high[1] + north * side,
    )
    fence = Obstacle.polygon([(33, -9), (35, -9), (43, 69), (41, 69)], name="fence")
    houses = {
        "north-house": [(13, 32), (25, 36), (22, 47), (10, 43)],
        "tower": [(46, 20), (57, 20), (57, 39), (46, 39)],
        "south-house": [(62, 5), (76, 8), (74, 20), (60, 17)],
    }
    fixed = [
        Obstacle.polygon(points, name=name, destroyable=False) for name, points in houses.items()
    ]
    x, y = centre.tolist()
    half = side / 2
    corners = (
        (x - half, y - half),
        (x + half, y - half),
        (x + half, y + half),
        (x - half, y + half),
    )
    return World(bounds, (fence, *fixed), (float(AGENT[0]), float(AGENT[1])), RADIUS, corners)


def _report(
    task: Task, solution: Solution, grid: Grid, world: World, table: FuzzyTable
) -> tuple[dict[str, list[str]], list[str]]:
    """What the path planner says of what blocks, as signs: the regions where each obstacle on the
    contour is seen.
    """
    cells = np.argwhere(np.asarray(solution.contour)).astype(np.int32)
    blocking = np.asarray(solution.blocking)
    seen = {}
    for number in blocking[blocking >= 0].tolist():
        covered = (np.asarray(task.labels) == number).any(axis=0)
        beside = [
            cell
            for cell in cells
            if covered[max(0, cell[0] - 1) : cell[0] + 2, max(0, cell[1] - 1) : cell[1] + 2].any()
        ]
        points = point_of(grid, np.array(beside))
        sector = sector_of_points(points, np.ones(len(points), bool), AGENT, np.float64(HEADING))
        touched = regions_touched(sector, table)
        names = [
            name for name, is_touched in zip(region_names(table), touched.tolist()) if is_touched
        ]
        seen[world.obstacles[number].name] = names
    return seen, list(seen)


def _scene(names: list[str], world: World, seen: dict[str, list[str]]) -> Scene:
    """The situation after the report: each obstacle on the contour closes the way; "I" can destroy
    wood, not stone.
    """
    kinds = {
        obstacle.name: "wood" if obstacle.destroyable else "stone" for obstacle in world.obstacles
    }
    blocked = tuple(("here", "goal-area", name) for name in names)
    return Scene("here", "goal-area", blocked=blocked, kinds=kinds, abilities=("wood",))


def _legs(
    solution: Solution, grid: Grid, table: FuzzyTable
) -> list[tuple[np.ndarray, str, float, float]]:
    """The route cut where something is destroyed; each leg with the narrowest relocation of which
    it is an instance.
    """
    cells = np.asarray(solution.cells)[: int(solution.num_cells)]
    cuts = [
        0,
        *np.asarray(solution.destroyed_at)[: int(solution.num_destroyed)].tolist(),
        len(cells) - 1,
    ]
    legs = []
    for first, last in itertools.pairwise(cuts):
        points = point_of(grid, cells[first : last + 1])
        # to the middle of the agent's cell first
        points = points if first else np.concatenate([AGENT[None], points])
        count = np.array(len(points))
        relocation = table.relocations[int(relocation_of(points, count, table))]
        legs.append(
            (points, relocation.name, relocation.deviation, float(path_deviation(points, count)))
        )
    return legs


def draw(story: Story) -> Any:
    """Returns the figure: agent, sector, square, grid, obstacles, corridors H1 and H2 round the
    links, traces L1 and L2.
    """
    figure, axes = column_figure(height=3.0)
    _draw_world(axes, story)
    for number, (points, _, deviation, _) in enumerate(story.legs):
        _corridor(
            axes, points, deviation, ("#0072b2", "#009e73", "#e69f00")[number % 3], number + 1
        )
    contour = point_of(story.grid, np.argwhere(np.asarray(story.solution.contour)).astype(np.int32))
    axes.plot(*contour.T, "s", color="#d55e00", markersize=2.6, label="contour", zorder=3)
    _draw_goal(axes, story)
    _draw_agent(axes)
    x_min, y_min, x_max, y_max = story.world.bounds
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(y_min, y_max)
    axes.set_aspect("equal")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False
    )
    return figure


def _draw_world(axes: Any, story: Story) -> None:
    """The grid, and the obstacles upon it."""
    from matplotlib.patches import Polygon

    x_min, y_min, x_max, y_max = story.world.bounds
    look = {"color": "0.88", "linewidth": 0.4, "zorder": 0}
    axes.vlines(np.arange(story.grid.width + 1) * story.grid.side + x_min, y_min, y_max, **look)
    axes.hlines(y_max - np.arange(story.grid.height + 1) * story.grid.side, x_min, x_max, **look)
    for number, obstacle in enumerate(story.world.obstacles):
        name = (
            "destroyed"
            if number in np.asarray(story.solution.destroyed)
            else "indestructible"
            if number == 1
            else None
        )
        colour = "#cc79a7" if name == "destroyed" else "0.55"
        axes.add_patch(
            Polygon(
                np.array(obstacle.parts[0][0]),
                facecolor=colour,
                edgecolor="none",
                label=name,
                zorder=2,
            )
        )


def _draw_goal(axes: Any, story: Story) -> None:
    """The sector of the goal's sign, its rays from the agent, and the square that holds it."""
    from matplotlib.patches import Polygon, Rectangle

    sector = Polygon(
        _outline(story.sector),
        facecolor="#f0e442",
        edgecolor="0.2",
        linewidth=0.7,
        label="goal's sector",
        zorder=3,
    )
    axes.add_patch(sector)
    (x, y), side = story.square
    options: Any = {
        "fill": False,
        "edgecolor": "0.1",
        "linewidth": 0.9,
        "label": "goal's square",
        "zorder": 4,
    }
    axes.add_patch(Rectangle((x - side / 2, y - side / 2), side, side, **options))
    for corner in from_polar(sector_corners(story.sector), AGENT, np.float64(HEADING))[:2]:
        axes.plot(*zip(AGENT, corner), color="0.45", linewidth=0.5, linestyle=(0, (4, 3)), zorder=1)
    axes.text(x + 0.7 * side, y, "goal", va="center")


def _draw_agent(axes: Any) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(
        Circle(tuple(AGENT), RADIUS, facecolor="white", edgecolor="black", linewidth=0.8, zorder=5)
    )
    ahead = AGENT + 7 * np.array([math.cos(HEADING), math.sin(HEADING)])
    look = {"arrowstyle": "-|>", "linewidth": 0.8, "shrinkA": 0, "color": "black"}
    axes.annotate("", ahead, AGENT, arrowprops=look, zorder=6)
    axes.text(AGENT[0] - 1, AGENT[1] - 7.6, "agent", ha="center")


def _corridor(axes: Any, points: np.ndarray, deviation: float, colour: str, number: int) -> None:
    """A leg's trace, its straight link, and the points that stray from the link no more than is
    permitted.
    """
    start, end = points[0], points[-1]
    axes.plot(*points.T, color=colour, linewidth=1.6, label=f"$L_{number}$", zorder=4)
    axes.plot(*zip(start, end), color=colour, linewidth=0.7, linestyle=":", zorder=4)
    if not math.isfinite(deviation):
        return
    along = math.atan2(*(end - start)[::-1])
    turns = np.linspace(math.pi / 2, 3 * math.pi / 2, 24)
    around = [
        start + deviation * np.array([math.cos(along + turn), math.sin(along + turn)])
        for turn in turns
    ]
    around += [
        end - deviation * np.array([math.cos(along + turn), math.sin(along + turn)])
        for turn in turns
    ]
    axes.fill(
        *np.array(around).T,
        color=colour,
        alpha=0.15,
        linewidth=0,
        label=f"$H_{number}$ = {deviation:g} m",
        zorder=1,
    )
    _measure(axes, start + 0.35 * (end - start), along, deviation, colour, number)


def _measure(
    axes: Any, foot: np.ndarray, along: float, deviation: float, colour: str, number: int
) -> None:
    """How far H reaches from the link, as a measured length with its name at the end."""
    across = np.array([-math.sin(along), math.cos(along)])
    tip = foot + deviation * across
    axes.annotate(
        "",
        tip,
        foot,
        arrowprops={
            "arrowstyle": "<->",
            "color": colour,
            "linewidth": 0.7,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    axes.text(*(tip + 2.6 * across), f"$H_{number}$", color=colour, ha="center", va="center")


def _outline(sector: Sector) -> np.ndarray:
    turns = float(sector.start) + np.linspace(0, float(sector.width), 16)
    near = np.stack([np.full(16, float(sector.near)), turns], axis=-1)
    far = np.stack([np.full(16, float(sector.far)), turns[::-1]], axis=-1)
    return from_polar(np.concatenate([near, far]), AGENT, np.float64(HEADING))
