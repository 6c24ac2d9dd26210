"""Pictures as arrays of shades, through Pillow; and plain pictures as maps."""

import io
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np

from srt_jax.formats.gridmap import MOST_CELLS, GridMap, TooLargeError, decided, require_size
from srt_jax.formats.notes import Notes
from srt_jax.formats.shared.whole_files import (
    PathLike,
    atomic_write,
    plain_reason,
    read_bytes,
    require_module,
)

Pixels = TypeVar("Pixels")
ENDINGS = (".png", ".pgm", ".pbm", ".ppm", ".bmp", ".gif", ".jpg", ".jpeg", ".tif", ".tiff")
POLARITIES = ("light", "dark")
_BETWEEN = 32
"""Shades from black or white within which a pixel is plainly one of them."""
_ORIENTATION = 0x0112
"""The EXIF tag that says how a picture is to be turned."""


class Shades(NamedTuple):
    """shade: float64 [H, W], 0 black to 255 white, the mean of the colours. is_clear: bool [H, W],
    not fully opaque.
    """

    shade: np.ndarray
    is_clear: np.ndarray


def read_shades(
    path: PathLike, kind: str, *, takes_masks: bool = False, notes: Notes | None = None
) -> Shades:
    """Returns the pixels of a picture in any form Pillow reads, row 0 on top.

    A picture that says how it is to be turned (EXIF) is turned so. Floats go from 0 to 1, or to
    255.

    Args:
      takes_masks: a picture of 0 and 1 alone is a mask: 1 is white. Else it is all but black.
      notes: receives whether the picture was turned, is a mask, or holds further pictures.

    Raises:
      ValueError: the file is missing, cut off, or no picture.
    """
    shades = read_pixels(path, kind, _shades, notes=notes)
    notes = Notes() if notes is None else notes
    return shades._replace(shade=_of_mask(shades.shade, notes)) if takes_masks else shades


def read_pixels(
    path: PathLike, kind: str, take: Callable[[Any, Notes], Pixels], *, notes: Notes | None = None
) -> Pixels:
    """Returns what `take` makes of a picture (Pillow's, turned as it says itself); errors as for
    `read_shades`.
    """
    image_module = require_module("PIL.Image", extra="image", what="reading pictures")
    turn = require_module("PIL.ImageOps", extra="image", what="reading pictures").exif_transpose
    content = read_bytes(path, kind)
    notes = Notes() if notes is None else notes
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of damaged pictures
            # the limit here is `require_size`
            warnings.simplefilter("ignore", image_module.DecompressionBombWarning)
            with image_module.open(io.BytesIO(content)) as picture:
                # only its head has been read
                require_size(str(path), picture.height, picture.width)
                num_pictures = getattr(picture, "n_frames", 1)
                orientation = picture.getexif().get(_ORIENTATION, 1)
                picture.load()
                turned = turn(picture)
                if orientation in range(2, 9):
                    notes.tell("the picture is turned as it says itself (EXIF orientation)")
                if num_pictures > 1:
                    notes.tell(f"the file holds {num_pictures} pictures: the first is read")
                return take(turned, notes)
    except (TooLargeError, MemoryError):
        raise
    # Pillow's own limit, which its user may have lowered
    except image_module.DecompressionBombError as error:
        message = f"no whole picture is read of more than {MOST_CELLS} pixels: scale it down"
        raise TooLargeError(f"{path}: {message} ({plain_reason(error)})") from error
    except Exception as error:  # Pillow's readers raise whatever their form's code runs into
        raise ValueError(
            f"{path}: no whole picture: it is cut off, damaged, or of another kind"
            f" ({plain_reason(error)})"
        ) from error


def read_image(
    path: PathLike,
    *,
    free: str = "light",
    threshold: float = 128.0,
    notes: Notes | None = None,
) -> GridMap:
    """Returns the map in a picture, a cell per pixel of side 1: the light pixels are free, or the
    dark ones.

    A pixel is light where the mean of its colours is at least `threshold`; what is not opaque is
    seen on white.

    Args:
      free: one of POLARITIES.
      threshold: above 0, at most 255.
      notes: receives how many pixels are neither plainly light nor plainly dark, and how many not
        opaque.
    """
    if free not in POLARITIES:
        raise ValueError(
            f"the free pixels can be the {' or the '.join(POLARITIES)} ones, not {free!r}"
        )
    if not 0 < threshold <= 255:
        raise ValueError(
            f"the threshold must lie above 0 (black) and at most at 255 (white), got {threshold:g}"
        )
    notes = Notes() if notes is None else notes
    shade, is_clear = read_shades(path, "picture of a map", takes_masks=True, notes=notes)
    notes.add("pixels that are not opaque, seen on white", int(is_clear.sum()))
    notes.add(
        f"pixels in between, parted at {threshold:g}",
        int(((shade > _BETWEEN) & (shade < 255 - _BETWEEN)).sum()),
    )
    is_free = (shade >= threshold) == (free == "light")
    return decided(~is_free, is_free, unknown_as="blocked", notes=notes)


def write_image(path: PathLike, free: np.ndarray) -> None:
    """Writes bool [H, W] as a black and white picture, free white; the ending of the name decides
    its form.
    """
    image_module = require_module("PIL.Image", extra="image", what="writing pictures")
    ending = "." + str(path).rsplit(".", 1)[-1].lower()
    form = {"jpg": "jpeg", "tif": "tiff", "pgm": "ppm", "pbm": "ppm"}.get(ending[1:], ending[1:])
    if ending not in ENDINGS or form == "jpeg":
        raise ValueError(
            f"{path}: a map is written as a picture without losses: end the name in .png, .pgm,"
            " .bmp or .tif"
        )
    with atomic_write(path, "wb") as file:
        image_module.fromarray(np.where(free, np.uint8(255), np.uint8(0))).save(file, format=form)


def _shades(picture: Any, notes: Notes) -> Shades:
    """Returns a picture's shades; the colours of what is not opaque are mixed with white."""
    if picture.mode == "F" or picture.mode.startswith("I"):
        return _of_deep(picture, notes)
    if picture.mode in ("1", "L") and "transparency" not in picture.info:
        shade = np.asarray(picture.convert("L"), np.float64)
        return Shades(shade, np.zeros(shade.shape, bool))
    colours = np.asarray(picture.convert("RGBA"))
    shade, is_clear = np.empty(colours.shape[:2]), colours[..., 3] < 255
    # row by row: floats of a whole picture take eight times its memory
    for row, line in enumerate(colours):
        opacity = line[:, 3] / 255.0
        shade[row] = line[:, :3].mean(axis=1) * opacity + 255.0 * (1.0 - opacity)
    return Shades(shade, is_clear)


def _of_deep(picture: Any, notes: Notes) -> Shades:
    """Returns the shades of whole numbers of more than 8 bits, or of floats."""
    deep = np.asarray(picture, np.float64)
    if not np.isfinite(deep).all():
        notes.add("pixels that are no number, taken as black", int((~np.isfinite(deep)).sum()))
        deep = np.where(np.isfinite(deep), deep, 0.0)
    low, high = float(deep.min(initial=0)), float(deep.max(initial=0))
    if low < 0:
        raise ValueError(
            f"its pixels go from {low:g} to {high:g}: give shades from 0 to 1, 255 or 65535"
        )
    if picture.mode == "F" and high <= 1:
        notes.tell("pixels are floats from 0, black, to 1, white")
        return Shades(deep * 255.0, np.zeros(deep.shape, bool))
    if high > 65535:
        raise ValueError(f"its pixels go up to {high:g}: give shades from 0 to 1, 255 or 65535")
    is_wide = high > 255 or (picture.mode.startswith("I;16") and high > 1)
    largest = 65535.0 if is_wide else 255.0
    return Shades(deep / largest * 255.0, np.zeros(deep.shape, bool))


def _of_mask(shade: np.ndarray, notes: Notes) -> np.ndarray:
    """Returns the shades; those of a mask of 0 and 1, which as shades would all be black, as 0
    and 255.
    """
    if shade.max(initial=0) != 1 or not np.isin(shade, (0, 1)).all():
        return shade
    notes.tell("the picture holds 0 and 1 alone: taken as a mask, 1 is white")
    return shade * 255.0
