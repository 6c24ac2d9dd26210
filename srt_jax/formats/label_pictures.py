"""Obstacles of a map of cells from a second picture of the same size: doors that do not melt into
their walls.

In a picture with colours each colour is one obstacle; grey pixels, black and white among them, and
pixels that are not opaque name nothing. In a picture of greys alone, which holds numbers, each
number is one obstacle, and 0 names nothing. Obstacles are numbered by ascending colour (#rrggbb) or
number.
"""

import pathlib
from typing import Any, NamedTuple

import numpy as np

from srt_jax.components import label
from srt_jax.formats.notes import Notes
from srt_jax.formats.pictures import read_pixels
from srt_jax.formats.shared.whole_files import PathLike

_MOST_LABELS = 1 << 14
"""Colours or numbers; a picture with more holds shades, not labels."""
_MOST_NAMED = 12
"""Labels that a note names."""


class Labelled(NamedTuple):
    """Obstacles by name.

    labels: int32 [H, W], the number of the obstacle on each cell, -1 where none is.
    names: of each obstacle, a colour "#ff0000" or a number; "" of those that the picture does not
      name.
    """

    labels: np.ndarray
    names: tuple[str, ...]


def read_labels(path: PathLike, *, notes: Notes | None = None) -> Labelled:
    """Returns the obstacles that a picture names; needs pillow.

    Args:
      notes: receives which colour or number is which obstacle, and those that lie in pieces.

    Raises:
      ValueError: the file is missing, cut off, no picture, or one that holds no labels; or too
        many.
    """
    notes = Notes() if notes is None else notes
    if pathlib.Path(path).suffix.lower() in (".jpg", ".jpeg"):
        raise ValueError(
            f"{path}: a JPEG blurs the colours that name obstacles: save the picture as .png"
        )
    numbers, is_coloured = read_pixels(path, "picture of labels", _numbers, notes=notes)
    found, place = np.unique(numbers, return_inverse=True)
    is_named = found >= 0
    if not is_named.any():
        raise ValueError(
            f"{path}: it names no obstacle: paint each in a colour of its own, or give numbers"
            " above 0"
        )
    if is_named.sum() > _MOST_LABELS:
        raise ValueError(
            f"{path}: it holds {int(is_named.sum())} colours or numbers, more than {_MOST_LABELS}:"
            " paint without smoothing, and save it without losses"
        )
    order = np.where(is_named, np.cumsum(is_named) - 1, -1).astype(np.int32)
    labels = order[place.reshape(numbers.shape)]
    names = [f"#{n:06x}" if is_coloured else str(n) for n in found[is_named].tolist()]
    _note(labels, names, notes)
    return Labelled(labels, tuple(names))


def with_labels(
    path: PathLike, free: np.ndarray, map_name: str, notes: Notes
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the labels of a map, int32 [H, W], and which obstacles can be destroyed, bool [M].

    A cell that the picture names belongs to that obstacle alone, whether it is free on the map or
    not: a door drawn shut, or standing open. The rest of what blocks is walls: their 8-connected
    pieces come after the named obstacles, and cannot be destroyed.

    Args:
      free: bool [H, W], of the map.

    Raises:
      ValueError: the picture has another size than the map, or leaves nothing free; or as for
        `read_labels`.
    """
    named = read_labels(path, notes=notes)
    if named.labels.shape != free.shape:
        (height, width), (tall, wide) = free.shape, named.labels.shape
        raise ValueError(
            f"{path}: it is {wide} pixels wide and {tall} high, but the map {map_name} {width} wide"
            f" and {height} high: give a picture of the map's own size, a pixel for each cell"
        )
    if free.any() and not (free & (named.labels < 0)).any():
        raise ValueError(
            f"{path}: it names an obstacle on every free cell of {map_name}: a picture of greys"
            " alone holds numbers, and 0 names nothing; paint the obstacles of a copy of the map in"
            " colours"
        )
    walls = label(~free & (named.labels < 0))
    labels = np.where(walls >= 0, walls + len(named.names), named.labels).astype(np.int32)
    num_walls = int(walls.max(initial=-1)) + 1
    if num_walls:
        notes.tell(
            f"what the labels do not name is {num_walls} wall{'s' if num_walls > 1 else ''}, from"
            f" obstacle {len(named.names)} on, which cannot be destroyed"
        )
    return labels, np.arange(len(named.names) + num_walls) < len(named.names)


def _numbers(picture: Any, notes: Notes) -> tuple[np.ndarray, bool]:
    """Returns a number for each pixel, int64, -1 where it names nothing; and whether it is a
    colour.
    """
    is_deep = picture.mode == "F" or picture.mode.startswith("I")
    if is_deep or (picture.mode in ("1", "L") and "transparency" not in picture.info):
        values = np.asarray(picture if is_deep else picture.convert("L"))
        if is_deep and not np.array_equal(values, np.rint(values)):
            raise ValueError("its pixels are no whole numbers: labels are")
        numbers = values.astype(np.int64)
        return np.where(numbers > 0, numbers, -1), False
    colours = np.asarray(picture.convert("RGBA")).astype(np.int64)
    red, green, blue, opacity = np.moveaxis(colours, -1, 0)
    is_opaque = opacity == 255
    is_grey = (red == green) & (green == blue)
    if (is_grey | ~is_opaque).all():
        return np.where(is_opaque & (red > 0), red, -1), False
    return np.where(is_opaque & ~is_grey, red << 16 | green << 8 | blue, -1), True


def _note(labels: np.ndarray, names: list[str], notes: Notes) -> None:
    counts = np.bincount(labels[labels >= 0], minlength=len(names)).tolist()
    told = [
        f"{name} is obstacle {i} ({counts[i]} cell{'s' if counts[i] > 1 else ''})"
        for i, name in enumerate(names)
    ]
    more = f", and {len(told) - _MOST_NAMED} more" if told[_MOST_NAMED:] else ""
    notes.tell(f"of the labels {', '.join(told[:_MOST_NAMED])}{more}")
    # pieces are counted where obstacles do not touch one another, which is nearly always
    pieces = label(labels >= 0)
    _, owner = np.unique(
        np.stack([pieces[labels >= 0], labels[labels >= 0]], axis=1), axis=0, return_index=True
    )
    several = np.bincount(labels[labels >= 0][owner], minlength=len(names)) > 1
    if several.any():
        first = int(several.argmax())
        notes.add(
            "labels in several pieces, one obstacle each all the same: paint the pieces in colours"
            " of their own to part them",
            int(several.sum()),
            example=names[first],
        )
