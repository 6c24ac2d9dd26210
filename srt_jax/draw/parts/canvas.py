"""Frames of an animation: the map in whole pixels, a line of text, and a legend below, in one fixed
palette.
"""

import os
import textwrap
from typing import IO, Any

import numpy as np

from sign_model.foundation.files import opened_for
from sign_model.foundation.legible import legible
from srt_jax.draw.parts.colours import (
    BADGE,
    GOAL,
    PALETTE,
    SEED,
    START,
    Kind,
    leg_colour,
    rgb,
    shrunk,
)
from srt_jax.formats.shared.whole_files import require_module

_MAP = 480
"""Pixels of the map's longer side, about."""

_LINE, _COLUMNS, _TEXT = 16, 3, 12
_SHADES = 5
"""Steps from each colour of marks and text to white, for their soft edges."""


class Canvas:
    """Draws frames for one map; what `keep` was given stays on all later ones."""

    def __init__(
        self,
        size: tuple[int, int],
        kinds: list[Kind],
        title: str,
        start: tuple[int, int],
        goal: tuple[int, int],
    ):
        require_module("PIL", extra="draw", what="an animation")
        from PIL import Image, ImageDraw, ImageFont

        self._image, self._draw = Image, ImageDraw
        self._font = ImageFont.load_default(_TEXT)
        self._n = -(-max(size) // (2 * _MAP))
        shape = [-(-side // self._n) for side in size]
        self._scale = max(1, _MAP // max(shape))
        self._height, self._width = (side * self._scale for side in shape)
        self._kinds, self._start, self._goal = kinds, start, goal
        self._title = textwrap.wrap(legible(title), 70)[:2]
        self._across = max(self._width + 20, _MAP)
        self._left = (self._across - self._width) // 2
        self._top = 12 + _LINE * (len(self._title) + 2)
        self._kept: list[np.ndarray] = []
        self._palette = self._fixed_palette()

    def keep(self, leg: np.ndarray | None) -> None:
        """Leaves a leg of the route on the later frames."""
        if leg is not None:
            self._kept.append(leg)

    def frame(
        self, kinds: np.ndarray, place: tuple[int, int], caption: str, *, leg=None, seed=None
    ) -> Any:
        """Returns one frame: cells, kept legs and this one, start, goal, seed, and the agent at
        its place.
        """
        rows = -(-(len(self._kinds) + 4) // _COLUMNS)
        image = self._image.new(
            "RGB", (self._across, self._top + self._height + 14 + _LINE * rows), "white"
        )
        pen = self._draw.Draw(image)
        for line, text in enumerate([*self._title, *textwrap.wrap(caption, 74)[:2]]):
            pen.text((10, 6 + _LINE * line), text, fill="black", font=self._font)
        small = shrunk(kinds, -(-max(kinds.shape) // self._n))
        cells = PALETTE[small.repeat(self._scale, axis=0).repeat(self._scale, axis=1)]
        image.paste(self._image.fromarray(cells), (self._left, self._top))
        border = (self._left - 1, self._top - 1, self._left + self._width, self._top + self._height)
        pen.rectangle(border, outline="#888888")
        legs = [*self._kept, *([leg] if leg is not None and len(leg) > 1 else [])]
        for width, is_casing in ((6, True), (3, False)):
            for index, one in enumerate(legs):
                points = [self._at(cell) for cell in one]
                pen.line(
                    points,
                    fill="white" if is_casing else leg_colour(index),
                    width=width,
                    joint="curve",
                )
        self._marks(pen, place, seed)
        self._legend(pen)
        return image.quantize(palette=self._palette, dither=self._image.Dither.NONE)

    def _marks(self, pen, place, seed) -> None:
        _star(pen, self._at(self._goal), 9)
        _dot(pen, self._at(self._start), 5, START)
        if seed:
            _cross(pen, self._at(seed), 5)
        _diamond(pen, self._at(place), 6)

    def _legend(self, pen) -> None:
        top = self._top + self._height + 8
        marks = (
            (_dot, START, "start"),
            (_star, GOAL, "goal"),
            (_cross, SEED, "seed"),
            (_diamond, BADGE, "agent"),
        )
        wide = (self._across - 20) // _COLUMNS
        for place in range(len(self._kinds) + len(marks)):
            x, y = 10 + place % _COLUMNS * wide, top + place // _COLUMNS * _LINE
            if place < len(self._kinds):
                kind = self._kinds[place]
                pen.rectangle((x, y + 2, x + 14, y + 12), fill=kind.colour, outline="#888888")
                text = "reached" if kind is Kind.REACHED else kind.called
            else:
                sign, colour, text = marks[place - len(self._kinds)]
                sign(pen, (x + 7, y + 7), 8 if sign is _star else 5, colour)
            pen.text((x + 20, y), text, fill="black", font=self._font)

    def _at(self, cell) -> tuple[float, float]:
        row, col = np.asarray(cell).tolist()
        return (
            self._left + (col + 0.5) / self._n * self._scale,
            self._top + (row + 0.5) / self._n * self._scale,
        )

    def _fixed_palette(self) -> Any:
        """One palette for all frames: every colour, and those that soften the edges of text and
        marks.
        """
        colours = [tuple(colour) for colour in PALETTE.tolist()]
        for strong in (
            "#000000",
            START,
            GOAL,
            BADGE,
            *(leg_colour(index) for index in range(4)),
            "#888888",
        ):
            ink = np.array(rgb(strong))
            for shade in np.linspace(0, 1, _SHADES)[:-1]:
                colours.append(tuple((ink + (255 - ink) * shade).astype(int).tolist()))
        unique = list(dict.fromkeys(colours))
        palette = self._image.new("P", (1, 1))
        palette.putpalette([value for colour in unique for value in colour])
        return palette


def save_gif(path: str | os.PathLike | IO[bytes], shown: list[tuple[Any, int]]) -> None:
    """Writes frames with their milliseconds as a GIF that goes round for ever; under a name, whole
    or not at all, or into an open file.
    """
    images, durations = zip(*shown)
    with opened_for(path) as file:
        options = {
            "save_all": True,
            "append_images": images[1:],
            "duration": list(durations),
            "loop": 0,
            "optimize": False,
        }
        images[0].save(file, format="GIF", **options)


def _dot(pen, at, r, colour=START) -> None:
    x, y = at
    pen.ellipse((x - r, y - r, x + r, y + r), fill=colour, outline="white")


def _star(pen, at, r, colour=GOAL) -> None:
    x, y = at
    turns = np.arange(10) * np.pi / 5
    radii = np.where(np.arange(10) % 2 == 0, r, 0.42 * r)
    pen.polygon(
        [(x + d * np.sin(turn), y - d * np.cos(turn)) for turn, d in zip(turns, radii)],
        fill=colour,
        outline="white",
    )


def _cross(pen, at, r, colour=SEED) -> None:
    x, y = at
    for width, ink, d in ((6, "white", r + 1), (3, colour, r)):
        pen.line((x - d, y - d, x + d, y + d), fill=ink, width=width)
        pen.line((x - d, y + d, x + d, y - d), fill=ink, width=width)


def _diamond(pen, at, r, colour=BADGE) -> None:
    x, y = at
    pen.polygon([(x, y - r), (x + r, y), (x, y + r), (x - r, y)], fill=colour, outline="white")
