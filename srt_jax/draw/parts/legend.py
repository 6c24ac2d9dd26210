"""The legend: only what the picture shows, in one order everywhere."""

from typing import Any

import numpy as np

from srt_jax.draw.parts.colours import APPROACH, BADGE, GOAL, LEGS, SEED, START, Kind, leg_colour
from srt_jax.draw.parts.content import Scene

MARKS = {"start": ("o", START, 9), "goal": ("*", GOAL, 15), "seed": ("X", SEED, 10)}
"""Sign, colour and size in points; the larger are drawn first, so that two in one cell both show.
"""

_NAMED_LEGS = len(LEGS)


def kinds_shown(kinds: np.ndarray) -> list[Kind]:
    """Returns the kinds of cells that a picture holds, in the order of the legend."""
    return [Kind(int(value)) for value in np.unique(kinds)]


def handles(scenes: list[Scene]) -> list[Any]:
    """Returns what matplotlib's legend needs for one picture, or for several with one legend."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    there = kinds_shown(np.concatenate([np.unique(scene.kinds) for scene in scenes]))
    shown: list[Any] = [
        Patch(facecolor=kind.colour, edgecolor="0.55", linewidth=0.5, label=kind.called)
        for kind in there
    ]

    def mark(sign: str, colour: str, size: float, label: str) -> Line2D:
        return Line2D(
            [],
            [],
            marker=sign,
            color=colour,
            markersize=size,
            markeredgecolor="white",
            linestyle="none",
            label=label,
        )

    for name, (sign, colour, size) in MARKS.items():
        if name != "seed" or any(scene.seed for scene in scenes):
            shown.append(mark(sign, colour, min(size, 11), name))
    if any(scene.removals for scene in scenes):
        shown.append(mark("D", BADGE, 5.5, "destroys from here"))
    if any(scene.approach is not None and len(scene.approach) > 1 for scene in scenes):
        line = {"color": APPROACH, "linewidth": 2.2, "linestyle": (0, (2.2, 1.4))}
        shown.append(Line2D([], [], label="as near as one gets", **line))
    num_legs = max(len(scene.legs) for scene in scenes)
    for index in range(min(num_legs, _NAMED_LEGS)):
        name = "route" if num_legs == 1 else f"leg {index + 1}"
        if num_legs > _NAMED_LEGS:  # the colours come round again
            name += f", {index + 1 + _NAMED_LEGS}" + (
                ", ..." if num_legs > index + 1 + _NAMED_LEGS else ""
            )
            name = name if num_legs > index + _NAMED_LEGS else f"leg {index + 1}"
        shown.append(Line2D([], [], color=leg_colour(index), linewidth=2.2, label=name))
    return shown
