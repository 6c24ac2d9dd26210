"""The agent's polar frame over the map: rings and spokes of the fuzzy table, and the sector that
holds the goal (PY16 §2).
"""

import dataclasses
import math

import numpy as np

from sign_model.space.fuzzy import region_names, region_of
from sign_model.space.fuzzy_table import DEFAULT_TABLE, FuzzyTable
from sign_model.space.polar import to_polar
from srt_jax.draw.parts.content import Cell, Scene
from srt_jax.geometry.frame import Frame

_LINE = "#3b3b8f"
_MARGIN = 13.0
"""Points between a name and the border of the map."""


@dataclasses.dataclass(frozen=True)
class PolarFrame:
    """How the frame lies on the map.

    Attributes:
      metres_per_cell: the side of a cell; None: that of the map where it is known (`draw(frame=)`),
        else 1.
      table: the fuzzy directions and distances.
      heading: where the agent looks, degrees counter-clockwise from the east; None: at the goal.

    Examples:
      >>> from srt_jax.draw import PolarFrame
      >>> frame = PolarFrame(metres_per_cell=5.0, heading=90.0)  # cells of 5 m, looking north
      >>> frame.heading
      90.0
    """

    metres_per_cell: float | None = None
    heading: float | None = None
    table: FuzzyTable = DEFAULT_TABLE

    def __post_init__(self) -> None:
        if self.metres_per_cell is not None and not 0 < self.metres_per_cell < math.inf:
            raise ValueError(
                f"metres_per_cell must be positive and finite, got {self.metres_per_cell}"
            )

    @property
    def side(self) -> float:
        """Metres a cell, 1 where nothing else is known."""
        return 1.0 if self.metres_per_cell is None else self.metres_per_cell

    def over(self, frame: Frame | None) -> "PolarFrame":
        """Returns it with the side of the map's cells, if its own is not said."""
        if self.metres_per_cell is not None or frame is None or not frame.has_metres:
            return self
        return dataclasses.replace(self, metres_per_cell=frame.side)

    def looking(self, scene: Scene) -> float:
        """Returns the heading in radians; 0, east, where the goal is the start."""
        if self.heading is not None:
            return math.radians(self.heading)
        (row, col), (goal_row, goal_col) = scene.start, scene.goal
        return math.atan2(row - goal_row, goal_col - col)

    def region_of(self, scene: Scene, cell: Cell) -> str:
        """Returns the fuzzy region, seen from the start, in which a cell lies."""
        points = np.array([(col, -row) for row, col in (scene.start, cell)], float) * self.side
        polar = to_polar(points[1], points[0], np.asarray(self.looking(scene)))
        return region_names(self.table)[int(region_of(polar, self.table))]


def caption(scene: Scene, frame: PolarFrame) -> str:
    """Returns where the goal lies, in words."""
    looking = (
        "at the goal" if frame.heading is None else f"{frame.heading:g} degrees leftwards of east"
    )
    return f"From the start, looking {looking}, the goal is: {frame.region_of(scene, scene.goal)}"


def draw_frame(axes, scene: Scene, frame: PolarFrame, scale: float) -> None:
    """Draws rings, spokes and the names of directions; `scale` is points per cell side."""
    from matplotlib.patches import Circle

    height, width = scene.kinds.shape
    row, col = scene.start
    far = math.hypot(height, width)
    heading = frame.looking(scene)
    for direction in frame.table.directions:
        turn = heading + math.radians(direction.start)
        ends = [col, col + far * math.cos(turn)], [row, row - far * math.sin(turn)]
        axes.plot(
            *ends,
            color=_LINE,
            linewidth=0.8,
            linestyle=(0, (5, 3)),
            alpha=0.8,
            zorder=4,
            scalex=False,
            scaley=False,
        )
    radii = [row.end / frame.side for row in frame.table.distances[:-1]]
    for radius in radii:
        style = {
            "fill": False,
            "edgecolor": _LINE,
            "linewidth": 0.9,
            "linestyle": (0, (5, 3)),
            "alpha": 0.8,
        }
        axes.add_patch(Circle((col, row), radius, zorder=4, **style))
    _draw_names(axes, scene, frame, scale, radii)


def _draw_names(axes, scene: Scene, frame: PolarFrame, scale: float, radii: list[float]) -> None:
    """Writes each direction's name where its middle ray leaves the map, each distance's on its
    ring; nothing over another.
    """
    # Places that are taken: the marks, and points along the route; (centre, half width, half
    # height) in points.
    marks = [
        scene.start,
        scene.goal,
        *([scene.seed] if scene.seed else []),
        *(removal.standing for removal in scene.removals),
    ]
    taken = [(np.array([col, row]) * scale, 8.0, 8.0) for row, col in marks]
    on_route = np.concatenate([leg[:, ::-1] for leg in scene.legs] or [np.zeros((0, 2))])
    taken += [(place * scale, 1.5, 1.5) for place in on_route[:: max(1, int(4 / scale))]]
    # Directions may be written along their middle ray or a little aside, distances beside any ray.
    heading = frame.looking(scene)
    middles = [math.radians((row.start + row.end) / 2) + heading for row in frame.table.directions]
    inner = [0.0, *radii]
    wanted = [(row.name, turn, None) for row, turn in zip(frame.table.directions, middles)]
    wanted += [
        (f"{row.name}: {row.start:g} to {row.end:g} m", None, first)
        for row, first in zip(frame.table.distances, inner)
    ]
    for text, turn, radius in wanted:
        half = np.array([2.1 * len(text) + 3, 5.5])
        aside = (
            [turn + math.radians(degrees) for degrees in (0, 7, -7, 14, -14)]
            if turn is not None
            else []
        )
        turns = aside or [middle + math.radians(11) for middle in middles]
        for place in _places(scene, scale, half, turns, radius):
            is_clear = all(
                (abs(place - other) > half + np.array([w, h])).any() for other, w, h in taken
            )
            if is_clear:
                x, y = place / scale
                _write_name(axes, x, y, text)
                taken.append((place, *half))
                break


def _write_name(axes, x: float, y: float, text: str) -> None:
    box = {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    axes.text(x, y, text, fontsize=7, color=_LINE, ha="center", va="center", zorder=6, bbox=box)


def _places(scene: Scene, scale: float, half: np.ndarray, turns: list[float], radius: float | None):
    """Yields places (right, down, in points) for a name: from the border inwards along a ray, or
    just outside a ring.
    """
    height, width = scene.kinds.shape
    origin = np.array([scene.start[1], scene.start[0]], float) * scale
    low, high = half + 2 - scale / 2, np.array([width - 0.5, height - 0.5]) * scale - half - 2
    for turn in turns:
        step = np.array([math.cos(turn), -math.sin(turn)])
        ends = [
            ((high if s > 0 else low)[axis] - origin[axis]) / s
            for axis, s in enumerate(step)
            if abs(s) > 1e-9
        ]
        room = min(ends, default=0.0)
        if radius is None:
            distances = np.arange(room, 24.0, -6.0)
        else:
            distances = np.arange(radius * scale + _MARGIN + 8, room, 6.0)[:12]
        yield from (origin + distance * step for distance in distances)
