"""Where the numbers of destroyed obstacles go: in the obstacle where there is room, else beside it
with a line to it.
"""

import numpy as np

from srt_jax.draw.parts.colours import BADGE
from srt_jax.draw.parts.content import Scene

_APART = 17.0
"""Points between the middles of a badge and of whatever else is marked."""

_RINGS = (20.0, 28.0, 38.0, 52.0, 70.0)
_CANDIDATES = 400
"""Cells of an obstacle that are tried; of larger ones an even sample."""


def place_badges(
    scene: Scene, places: np.ndarray, scale: float, size: tuple[float, float]
) -> list[np.ndarray]:
    """Returns the middle of each removal's badge, in points, (right, down) from the map's upper
    left corner.

    The place in the obstacle nearest its middle that keeps clear of the `places` (float [n, 2],
    points) of other marks and of the badges before; else a place around; else the middle, come what
    may.

    Args:
      scale: points per cell side. size: of the map, (width, height) in points.
    """
    taken = places
    found = []
    for removal in scene.removals:
        cells = removal.cells[:: max(1, len(removal.cells) // _CANDIDATES)]
        inside = (cells[:, ::-1] + 0.5) * scale if len(cells) else np.zeros((1, 2))
        middle = inside[((inside - inside.mean(axis=0)) ** 2).sum(axis=1).argmin()]
        inside = inside[((inside - middle) ** 2).sum(axis=1).argsort()]
        turns = np.arange(16) * (2 * np.pi / 16) + 0.2
        around = np.concatenate(
            [middle + ring * np.stack([np.cos(turns), np.sin(turns)], 1) for ring in _RINGS]
        )
        around = around[
            ((around > _APART / 2) & (around < np.array(size) - _APART / 2)).all(axis=1)
        ]
        tried = np.concatenate([inside, around])
        clear = ((tried[:, None] - taken[None]) ** 2).sum(axis=2).min(
            axis=1, initial=np.inf
        ) >= _APART**2
        chosen = tried[clear.argmax()] if clear.any() else middle
        found.append(chosen)
        taken = np.concatenate([taken, chosen[None]])
    return found


def draw_badges(axes, scene: Scene, scale: float) -> None:
    """Draws the numbers on axes whose data are columns and rows, `scale` points to a cell side."""
    height, width = scene.kinds.shape
    cells = [
        scene.start,
        scene.goal,
        *([scene.seed] if scene.seed else []),
        *(removal.standing for removal in scene.removals),
    ]
    places = (np.array(cells, float)[:, ::-1] + 0.5) * scale
    for removal, place in zip(
        scene.removals, place_badges(scene, places, scale, (width * scale, height * scale))
    ):
        x, y = place / scale - 0.5
        centres = removal.cells[:, ::-1]
        nearest = (
            centres[((centres - (x, y)) ** 2).sum(axis=1).argmin()] if len(centres) else (x, y)
        )
        if np.hypot(*(np.array([x, y]) - nearest)) * scale > _APART / 2:
            axes.plot(
                [x, nearest[0]], [y, nearest[1]], color=BADGE, linewidth=0.9, zorder=6, label="_"
            )
        _draw_badge(axes, x, y, str(removal.number))


def _draw_badge(axes, x: float, y: float, text: str) -> None:
    axes.plot(
        x,
        y,
        "o",
        markersize=12,
        color=BADGE,
        markeredgecolor="white",
        markeredgewidth=0.9,
        zorder=7,
        label="_",
    )
    axes.text(
        x,
        y,
        text,
        color="white",
        fontsize=7.5 if len(text) == 1 else 6,
        ha="center",
        va="center_baseline",
        weight="bold",
        zorder=8,
    )
