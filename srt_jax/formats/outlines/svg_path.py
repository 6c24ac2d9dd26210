"""The outlines in the `d` of an SVG path, and what `transform` does to them; curves become short
lines.

Points are (x, y) as in the file, y downwards. Paths are read by svg.path, which knows all commands
of SVG 1.1; it passes over letters that are none, so these are refused here. Transforms are read
here: a library that takes an unknown one for the identity would move the obstacles.
"""

import math
import re
from typing import Any

import numpy as np

from srt_jax.formats.shared.whole_files import require_module

_PIECES = 16
"""Lines to a curve, or to a quarter of an arc's circle."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_PATH = re.compile(r"\s*(?:[Mm](?:[MmLlHhVvCcSsQqTtAaZzeE0-9+\-.,\s])*)?")
_BETWEEN = re.compile(r"[\s,]*")
_AFTER_END = re.compile(r"[Zz][\s,]*[-+.0-9]")
_TRANSFORM = re.compile(r"\s*,?\s*(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^)]*)\)")


def outlines(text: str) -> list[np.ndarray]:
    """Returns the outlines of a path in order, float64 [K, 2] each, not closed by a repeated point;
    [] for an empty path.

    Raises:
      ValueError: a command that is not known, or a number that is missing, none or too large.
    """
    svg = require_module("svg.path", extra="svg", what="reading SVG paths")
    place = _PATH.match(text).end()  # type: ignore[union-attr]
    if place < len(text):
        if not text[:place].strip():
            raise ValueError(f"a path begins with M or m, not {text.strip()[:12]!r}")
        raise ValueError(f"a path command was expected, got {text[place : place + 12]!r}")
    odd = _AFTER_END.search(text)
    if odd:
        raise ValueError(
            f"a path command was expected, got {text[odd.end() - 1 : odd.end() + 11]!r}"
        )
    try:
        segments = svg.parse_path(text)
    except (ValueError, IndexError, ZeroDivisionError, OverflowError) as error:
        raise ValueError(f"a path command lacks a number, or has one too many: {error}") from error
    drawn: list[list[complex]] = []
    begins = True
    for segment in segments:
        if isinstance(segment, svg.Move):
            drawn.append([segment.end])
        elif isinstance(segment, svg.Close):
            begins = True
            continue
        else:
            if begins:  # after the end of an outline the next begins where that one began
                drawn.append([segment.start])
            drawn[-1] += _points(svg, segment)
        begins = False
    lines = [np.array([(point.real, point.imag) for point in line]) for line in drawn]
    if not all(np.isfinite(line).all() for line in lines):
        raise ValueError("a number in it is too large")
    return lines


def transform_of(text: str) -> np.ndarray:
    """Returns the matrix [3, 3] of an SVG transform; the identity for ""."""
    result, place = np.eye(3), 0
    while text[place:].strip(" \t\r\n,"):
        match = _TRANSFORM.match(text, place)
        if match is None:
            raise ValueError(f"the transform {text[:40]!r} is not known")
        numbers = [float(number) for number in _NUMBER.findall(match[2])]
        if not _BETWEEN.fullmatch(_NUMBER.sub("", match[2])):  # units, or words: nothing is skipped
            raise ValueError(f"the transform {match[0].strip()[:40]!r} holds more than numbers")
        if not np.isfinite(numbers).all():
            raise ValueError(f"a number of the transform {match[0].strip()[:40]!r} is too large")
        result = result @ _matrix(match[1], numbers)
        place = match.end()
    return result


def filled(rings: list[np.ndarray], *, is_even_odd: bool) -> list[list[np.ndarray]]:
    """Returns the polygons that outlines fill, which do not cross: each an outer ring and its
    holes.

    By SVG's rules of filling: inside is what outlines wind round an odd number of times, or else
    any number but 0.
    """
    areas = [
        float(np.sum(ring[:, 0] * np.roll(ring[:, 1], -1) - ring[:, 1] * np.roll(ring[:, 0], -1)))
        for ring in rings
    ]
    parts: list[list[np.ndarray]] = []
    placed: list[tuple[np.ndarray, int]] = []
    for index in sorted(range(len(rings)), key=lambda index: -abs(areas[index])):
        ring, turn = rings[index], 1 if areas[index] > 0 else -1
        outside = sum(around_turn for around, around_turn in placed if _is_in(ring[0], around))
        was_full, is_full = (
            turns % 2 == 1 if is_even_odd else turns != 0 for turns in (outside, outside + turn)
        )
        placed.append((ring, turn))
        if is_full and not was_full:
            parts.append([ring])
        elif was_full and not is_full:
            next(part for part in reversed(parts) if _is_in(ring[0], part[0])).append(ring)
    return parts


def _is_in(point: np.ndarray, ring: np.ndarray) -> bool:
    """Whether a ray to the right of the point crosses the ring an odd number of times."""
    (x0, y0), (x1, y1) = ring.T, np.roll(ring, -1, axis=0).T
    rises = (y0 > point[1]) != (y1 > point[1])
    slope = np.divide(x1 - x0, y1 - y0, out=np.zeros_like(x0), where=rises)
    return bool((rises & (x0 + slope * (point[1] - y0) > point[0])).sum() % 2)


def _points(svg: Any, segment: Any) -> list[complex]:
    """Returns points on a line, curve or arc, without its first."""
    if isinstance(segment, svg.Line):
        return [segment.end]
    pieces = _PIECES
    if isinstance(segment, svg.Arc):
        if segment.start == segment.end or 0 in (segment.radius.real, segment.radius.imag):
            return [segment.end]
        pieces = max(1, math.ceil(abs(segment.delta) / 90 * _PIECES - 1e-6))
    return [*(segment.point(index / pieces) for index in range(1, pieces)), segment.end]


def _matrix(name: str, numbers: list[float]) -> np.ndarray:
    def of(a: float, b: float, c: float, d: float, e: float = 0.0, f: float = 0.0) -> np.ndarray:
        return np.array([[a, c, e], [b, d, f], [0, 0, 1]])

    count = len(numbers)
    if name == "matrix" and count == 6:
        return of(*numbers)
    if name == "translate" and count in (1, 2):
        return of(1, 0, 0, 1, *numbers)
    if name == "scale" and count in (1, 2):
        return of(numbers[0], 0, 0, numbers[-1])
    if name == "rotate" and count in (1, 3):
        cosine, sine = math.cos(math.radians(numbers[0])), math.sin(math.radians(numbers[0]))
        about = numbers[1:] or [0.0, 0.0]
        return (
            of(1, 0, 0, 1, *about)
            @ of(cosine, sine, -sine, cosine)
            @ of(1, 0, 0, 1, -about[0], -about[1])
        )
    if name in ("skewX", "skewY") and count == 1:
        slope = math.tan(math.radians(numbers[0]))
        return of(1, 0, slope, 1) if name == "skewX" else of(1, slope, 0, 1)
    raise ValueError(f"the transform {name} with {count} numbers is not known")
