"""Numbers beside the paper's words: how far, and how many degrees to which side."""

import math

from sign_model.foundation.legible import counted


def length_text(length: float, unit: str) -> str:
    """Returns a length in words: `12.5 m`, `3 cells`, `1 cell`.

    Args:
      unit: "m" or "cells".
    """
    if unit == "m":
        return f"{length:.2f} m" if length < 100 else f"{length:.1f} m"
    number = f"{length:.1f}".removesuffix(".0")
    return f"{number} {'cell' if number == '1' else 'cells'}"


def turn_text(turn: float) -> str:
    """Returns a direction in words: `40 degrees to the right`.

    Args:
      turn: radians leftwards from where the agent looks, -pi to pi.
    """
    degrees = round(math.degrees(turn))
    if degrees == 0:
        return "straight ahead"
    if abs(degrees) == 180:
        return "straight behind"
    return f"{counted(abs(degrees), 'degree')} to the {'left' if degrees > 0 else 'right'}"


_HEADINGS = {0.0: "east", 90.0: "north", 180.0: "west", 270.0: "south"}


def heading_text(heading: float) -> str:
    """Returns where the agent looks in words: `north`, up the map, for 90 degrees leftwards from
    the right of the map.
    """
    turned = heading % 360
    return _HEADINGS.get(turned, f"{turned:g} degrees leftwards from east")


def seen_text(seen: dict, unit: str) -> str:
    """Returns how something is seen, the paper's words and their numbers: `close, rightward: 12 m,
    40 degrees to the right`.

    Args:
      seen: of `facts.explanation`, with seen_as, away and turn.
    """
    words = ", ".join(seen["seen_as"])
    if seen["away"] == 0:
        return f"{words}: where the agent stands"
    return f"{words}: {length_text(seen['away'], unit)}, {turn_text(seen['turn'])}"
