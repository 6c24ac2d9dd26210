"""A small picture of one task as an SVG of a few kilobytes that needs nothing else: for web pages
that hold hundreds.
"""

import base64
import struct
import zlib

import numpy as np

from srt_jax.draw.parts.colours import (
    APPROACH,
    BADGE,
    GOAL,
    PALETTE,
    SEED,
    START,
    leg_colour,
    shrunk,
)
from srt_jax.draw.parts.content import Scene, scene_of
from srt_jax.robots.polyline import at_turns
from srt_jax.types import Approach, Solution, Task

_VIEW = 240.0
"""Units of the longer side of the picture; marks and lines are measured in them."""


def svg_tile(
    task: Task,
    solution: Solution | None = None,
    *,
    most_cells: int = 250,
    approach: Approach | None = None,
) -> str:
    """Returns an SVG document: cells as an embedded PNG, the route and the marks as lines.

    Args:
      solution: None shows the task alone.
      most_cells: a side; larger maps are shrunk (`colours.shrunk`).
      approach: of an unsolved task, where it is known; else it is found.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import svg_tile
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> svg_tile(task, solution).startswith("<svg")
      True
    """
    scene = scene_of(task, solution, approach=approach)
    height, width = scene.kinds.shape
    scale = _VIEW / max(height, width)
    across, down = width * scale, height * scale
    kinds = shrunk(scene.kinds, most_cells)
    n = -(-max(height, width) // most_cells)
    image = base64.b64encode(png_of(kinds)).decode()
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-4 -4 {across + 8:.4g} {down + 8:.4g}">',
        (
            f'<image width="{kinds.shape[1] * n * scale:.5g}"'
            f' height="{kinds.shape[0] * n * scale:.5g}" preserveAspectRatio="none"'
            f' style="image-rendering:pixelated" href="data:image/png;base64,{image}"/>'
        ),
        (
            f'<rect width="{across:.5g}" height="{down:.5g}" fill="none" stroke="#888"'
            ' stroke-width="0.6"/>'
        ),
        *_route(scene, scale),
        *_marks(scene, scale),
        "</svg>",
    ]
    return "".join(parts)


def png_of(kinds: np.ndarray) -> bytes:
    """Returns the cells as a PNG, one pixel each, colours by palette: uint8 [H, W] of `Kind` -> the
    file's bytes.
    """
    height, width = kinds.shape
    # each row begins with its filter, 0: none
    rows = np.concatenate([np.zeros((height, 1), np.uint8), kinds], axis=1)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", PALETTE.tobytes()),
        (b"IDAT", zlib.compress(rows.tobytes(), 9)),
        (b"IEND", b""),
    )
    framed = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(framed)


def _route(scene: Scene, scale: float) -> list[str]:
    lines = []

    def points_of(cells: np.ndarray) -> str:
        return " ".join(
            f"{(col + 0.5) * scale:.4g},{(row + 0.5) * scale:.4g}"
            for row, col in cells[at_turns(cells)].tolist()
        )

    if scene.approach is not None and len(scene.approach) > 1:
        points = points_of(scene.approach)
        for colour, width, dashes in (("#fff", 3.2, ""), (APPROACH, 1.8, "4 2.5")):
            lines.append(
                f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"'
                + (f' stroke-dasharray="{dashes}"/>' if dashes else "/>")
            )
    for index, leg in enumerate(scene.legs):
        points = points_of(leg)
        for colour, width in (("#fff", 3.2), (leg_colour(index), 1.8)):
            lines.append(
                f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"'
                ' stroke-linecap="round"/>'
            )
    return lines


def _marks(scene: Scene, scale: float) -> list[str]:
    def at(cell) -> tuple[float, float]:
        return (cell[1] + 0.5) * scale, (cell[0] + 0.5) * scale

    marks = []
    x, y = at(scene.goal)
    tips = " ".join(
        f"{x + r * np.sin(turn):.4g},{y - r * np.cos(turn):.4g}"
        for turn, r in ((np.pi / 5 * i, 7.5 if i % 2 == 0 else 3.2) for i in range(10))
    )
    marks.append(f'<polygon points="{tips}" fill="{GOAL}" stroke="#fff" stroke-width="0.8"/>')
    if scene.seed:
        x, y = at(scene.seed)
        cross = f"M{x - 3.4:.4g} {y - 3.4:.4g}l6.8 6.8m0 -6.8l-6.8 6.8"
        marks += [
            f'<path d="{cross}" stroke="{colour}" stroke-width="{wide}"/>'
            for colour, wide in (("#fff", 4), (SEED, 2.2))
        ]
    for removal in scene.removals:
        x, y = at(removal.standing)
        marks.append(
            f'<path d="M{x:.4g} {y - 4:.4g}l4 4l-4 4l-4 -4z" fill="{BADGE}" stroke="#fff"'
            ' stroke-width="0.8"/>'
        )
    x, y = at(scene.start)
    marks.append(
        f'<circle cx="{x:.4g}" cy="{y:.4g}" r="4.2" fill="{START}" stroke="#fff"'
        ' stroke-width="0.8"/>'
    )
    return marks
