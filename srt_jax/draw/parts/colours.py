"""The kinds of cells, their colours, and the colours of a route's legs.

From Okabe and Ito's palette, whose colours differ in lightness too, so that they can be
distinguished by colour-blind people and, most of them, in grey; `tests/draw/test_draw.py` simulates
the common kinds of colour blindness and measures it.
"""

import enum

import numpy as np


class Kind(enum.IntEnum):
    """What a cell is. Where a map is shrunk the highest kind on a patch shows, so that thin things
    stay; see `shrunk`.
    """

    UNREACHED = 0, "free, not reached", "#ffffff"
    REACHED = 1, "reached at first", "#c2dff2"
    FRONT = 2, "reached just now", "#56b4e9"
    INDESTRUCTIBLE = 3, "indestructible obstacle", "#5f5f66"
    DESTROYABLE = 4, "destroyable obstacle", "#e69f00"
    DESTROYED = 5, "destroyed", "#cc79a7"
    CONTOUR = 6, "contour", "#c03a00"

    called: str
    colour: str

    def __new__(cls, value: int, called: str, colour: str) -> "Kind":
        member = int.__new__(cls, value)
        member._value_ = value
        member.called, member.colour = called, colour
        return member


LEGS = ("#0072b2", "#000000", "#009e73", "#7a4a00")
"""Colours of the legs of a route, in turn; neighbours differ in lightness."""

APPROACH = LEGS[0]
"""Colour of the way as near as one gets, a dashed line."""

START, GOAL, SEED, BADGE = "#009e73", "#d55e00", "#000000", "#5b1a4a"


def rgb(colour: str) -> tuple[int, int, int]:
    """Returns red, green and blue, 0 to 255, of "#rrggbb"."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


PALETTE = np.array([rgb(kind.colour) for kind in Kind], np.uint8)
"""uint8 [kinds, 3]: the colour of every kind."""


def leg_colour(index: int) -> str:
    """Returns the colour of a leg, counted from 0."""
    return LEGS[index % len(LEGS)]


def shrunk(kinds: np.ndarray, most: int) -> np.ndarray:
    """Returns the picture in patches of cells, so that no side has more than `most`; as it is where
    it has no more.

    A patch shows the commonest of unreached, reached, front and indestructible; but what is
    destroyable, destroyed or on the contour, if only one cell of it, is never lost, nor is a
    wall that is thinner than a patch.

    Args:
      kinds: uint8 [H, W], of `Kind`.

    Returns:
      uint8 [ceil(H / n), ceil(W / n)] for patches of n x n cells.
    """
    height, width = kinds.shape
    n = -(-max(height, width) // most)
    if n == 1:
        return kinds
    rows, cols = -(-height // n), -(-width // n)
    padded = np.pad(kinds, ((0, rows * n - height), (0, cols * n - width)), mode="edge")
    patches = padded.reshape(rows, n, cols, n).transpose(0, 2, 1, 3).reshape(rows, cols, n * n)
    counts = np.stack([(patches == kind).sum(axis=2) for kind in Kind], axis=2)
    counts[..., Kind.INDESTRUCTIBLE] *= n  # a line through a patch of n x n has n cells
    common = counts[..., : Kind.INDESTRUCTIBLE + 1].argmax(axis=2)
    top = patches.max(axis=2)
    return np.where(top > Kind.INDESTRUCTIBLE, top, common).astype(np.uint8)
