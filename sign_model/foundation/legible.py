"""What people and other programs are shown: names that files bring, numbers of things, numbers that
JSON can hold.
"""

import math
from typing import SupportsFloat


def legible(text: str, encoding: str | None = None) -> str:
    """Returns text that can be shown anywhere: one line, without control characters or what
    `encoding` cannot express.

    Control characters, which could move a terminal's cursor or change its colours, become \\x1b and
    the like; white space of any kind one space; halves of surrogate pairs and signs beyond the
    encoding (UTF-8 without one) "?".

    Example:
      legible("a\\x1b[31mred") == "a\\\\x1b[31mred"
    """
    line = text if text.isprintable() else "".join(map(_legible_sign, text))
    known = encoding or "utf-8"
    return line.encode(known, "replace").decode(known, "replace")


def _legible_sign(sign: str) -> str:
    if sign.isprintable():
        return sign
    if sign.isspace() and sign not in "\x1c\x1d\x1e\x1f\x85":
        return " "
    return "?" if 0xD800 <= ord(sign) <= 0xDFFF else sign.encode("unicode_escape").decode()


def counted(number: int, noun: str) -> str:
    """Returns a number of things, such as `1 cell` or `3 cells`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def finite_or_none(value: SupportsFloat) -> float | None:
    """Returns a number as JSON and tables hold it: None for one that is infinite or NaN."""
    number = float(value)
    return number if math.isfinite(number) else None
