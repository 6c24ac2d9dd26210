"""The outlines in the `d` of an SVG path, and what `transform` does to them; curves become short
lines.

Points are (x, y) as in the file, y downwards. Read are all commands of SVG 1.1 (M L H V C S Q T A
Z, absolute and relative) and all transforms.
"""

import math
import re
from collections.abc import Iterator

import numpy as np

_PIECES = 16
"""Lines to a curve, or to a quarter of an arc's circle."""
_ARGUMENTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_FLAG = re.compile("[01]")
_GAPS = " \t\r\n\f,"
_TRANSFORM = re.compile(r"\s*,?\s*(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^)]*)\)")


def outlines(text: str) -> list[np.ndarray]:
    """Returns the outlines of a path in order, float64 [K, 2] each, not closed by a repeated point;
    [] for an empty path.

    Raises:
      ValueError: a command that is not known, or a number that is missing or none.
    """
    drawn: list[list[complex]] = []
    here = begin = control = 0j
    last = ""
    for command, numbers in _commands(text):
        kind, is_relative = command.upper(), command.islower()
        base = here if is_relative else 0j
        points = [base + complex(x, y) for x, y in zip(numbers[::2], numbers[1::2])]
        if kind == "M":
            here = begin = points[0]
            drawn.append([here])
            last = kind
            continue
        if not drawn:
            raise ValueError(f"a path begins with M or m, not {command!r}")
        if kind == "Z":
            here = begin
        else:
            if last == "Z":
                drawn.append([begin])
            mirrored = 2 * here - control if last in _CURVES.get(kind, ()) else here
            line, control = _drawn(kind, here, base, numbers, points, mirrored)
            drawn[-1] += line
            here = line[-1]
        last = kind
    return [np.array([(point.real, point.imag) for point in line]) for line in drawn]


def transform_of(text: str) -> np.ndarray:
    """Returns the matrix [3, 3] of an SVG transform; the identity for ""."""
    result, place = np.eye(3), 0
    while text[place:].strip(" \t\r\n,"):
        match = _TRANSFORM.match(text, place)
        if match is None:
            raise ValueError(f"the transform {text[:40]!r} is not known")
        numbers = [float(number) for number in _NUMBER.findall(match[2])]
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


_CURVES = {"S": ("C", "S"), "T": ("Q", "T")}
"""After which commands a smooth curve goes on from their last control point."""


def _commands(text: str) -> Iterator[tuple[str, list[float]]]:
    """Yields each command with its numbers; numbers beyond a command's own repeat it (after M as
    L).
    """
    place, command = _skipped(text, 0), ""
    while place < len(text):
        if text[place].upper() in _ARGUMENTS:
            command, place = text[place], place + 1
        elif command in ("", "Z", "z"):
            raise ValueError(f"a path command was expected, got {text[place : place + 12]!r}")
        numbers = []
        for index in range(_ARGUMENTS[command.upper()]):
            place = _skipped(text, place)
            is_flag = command in "Aa" and index in (3, 4)
            match = (_FLAG if is_flag else _NUMBER).match(text, place)
            if match is None:
                raise ValueError(
                    f"the path command {command!r} lacks a number at {text[place : place + 12]!r}"
                )
            numbers.append(float(match[0]))
            place = match.end()
        yield command, numbers
        command = {"M": "L", "m": "l"}.get(command, command)
        place = _skipped(text, place)


def _skipped(text: str, place: int) -> int:
    """Returns the place after blanks and commas."""
    while place < len(text) and text[place] in _GAPS:
        place += 1
    return place


def _drawn(
    kind: str,
    here: complex,
    base: complex,
    numbers: list[float],
    points: list[complex],
    mirrored: complex,
):
    """Returns the points a command adds, and its last control point."""
    if kind == "H":
        return [complex(base.real + numbers[0], here.imag)], here
    if kind == "V":
        return [complex(here.real, base.imag + numbers[0])], here
    if kind == "L":
        return points, here
    if kind == "A":
        return _arc(here, numbers, base + complex(numbers[5], numbers[6])), here
    controls = [mirrored, *points] if kind in _CURVES else points
    return _curve([here, *controls]), controls[-2]


def _curve(controls: list[complex]) -> list[complex]:
    """Returns points on the Bezier curve of any degree, without its first."""
    share = np.arange(1, _PIECES + 1) / _PIECES
    degree = len(controls) - 1
    points = sum(
        math.comb(degree, k) * share**k * (1 - share) ** (degree - k) * control
        for k, control in enumerate(controls)
    )
    return [*np.asarray(points)[:-1].tolist(), controls[-1]]


def _arc(here: complex, numbers: list[float], end: complex) -> list[complex]:
    """Returns points on an elliptic arc, without its first (SVG 1.1, F.6: from endpoints to the
    centre).
    """
    rx, ry, turn, is_large, is_sweep = (
        abs(numbers[0]),
        abs(numbers[1]),
        math.radians(numbers[2]),
        numbers[3],
        numbers[4],
    )
    if here == end or rx == 0 or ry == 0:
        return [end]
    axis = complex(math.cos(turn), math.sin(turn))

    def to_circle(point: complex) -> complex:
        turned = point / axis
        return complex(turned.real / rx, turned.imag / ry)

    a, b = to_circle(here), to_circle(end)
    half = abs(b - a) / 2
    grown = max(1.0, half)  # radii too small for the way are enlarged until they fit
    away = math.sqrt(max(0.0, grown**2 - half**2))
    side = 1 if bool(is_large) != bool(is_sweep) else -1
    centre = (a + b) / 2 + side * away * (b - a) / abs(b - a) * 1j
    first = math.atan2((a - centre).imag, (a - centre).real)
    sweep = (math.atan2((b - centre).imag, (b - centre).real) - first) % (2 * math.pi)
    sweep = sweep if is_sweep else sweep - 2 * math.pi
    steps = max(1, math.ceil(abs(sweep) / (math.pi / 2) * _PIECES - 1e-6))
    points = [
        centre + grown * complex(math.cos(t), math.sin(t))
        for t in first + sweep * np.arange(1, steps) / steps
    ]
    return [*(complex(p.real * rx, p.imag * ry) * axis for p in points), end]


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
