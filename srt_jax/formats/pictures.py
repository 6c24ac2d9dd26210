"""Pictures as arrays of shades, through Pillow; and plain pictures as maps."""

import io
import warnings
from typing import Any, NamedTuple

import numpy as np

from srt_jax.formats.files import PathLike, needed, read_bytes, written
from srt_jax.formats.gridmap import GridMap, decided
from srt_jax.formats.notes import Notes

ENDINGS = (".png", ".pgm", ".pbm", ".ppm", ".bmp", ".gif", ".jpg", ".jpeg", ".tif", ".tiff")
POLARITIES = ("light", "dark")
_BETWEEN = 32
"""Shades from black or white within which a pixel is plainly one of them."""


class Shades(NamedTuple):
    """shade: float64 [H, W], 0 black to 255 white, the mean of the colours. is_clear: bool [H,
    W], not fully opaque.
    """

    shade: np.ndarray
    is_clear: np.ndarray


def read_shades(path: PathLike, kind: str) -> Shades:
    """Returns the pixels of a picture in any form Pillow reads, row 0 on top.

    Raises:
      ValueError: the file is missing, cut off, or no picture.
    """
    image_module = needed("PIL.Image", extra="image", what="reading pictures")
    content = read_bytes(path, kind)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of pictures too large, or damaged
            with image_module.open(io.BytesIO(content)) as picture:
                picture.load()
                return _shades(picture)
    except Exception as error:  # Pillow's readers raise whatever their form's code runs into
        raise ValueError(
            f"{path}: no whole picture: it is cut off, damaged, too large, or of another kind"
            f" ({error})"
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
    shade, is_clear = read_shades(path, "picture of a map")
    notes.add("pixels that are not opaque, seen on white", int(is_clear.sum()))
    notes.add(
        f"pixels in between, parted at {threshold:g}",
        int(((shade > _BETWEEN) & (shade < 255 - _BETWEEN)).sum()),
    )
    is_free = (shade >= threshold) == (free == "light")
    return decided(~is_free, is_free, unknown_as="blocked", notes=notes)


def write_image(path: PathLike, free: np.ndarray) -> None:
    """Writes bool [H, W] as a black and white picture, free white; the ending of the name
    decides its form.
    """
    image_module = needed("PIL.Image", extra="image", what="writing pictures")
    ending = "." + str(path).rsplit(".", 1)[-1].lower()
    form = {"jpg": "jpeg", "tif": "tiff", "pgm": "ppm", "pbm": "ppm"}.get(ending[1:], ending[1:])
    if ending not in ENDINGS or form == "jpeg":
        raise ValueError(
            f"{path}: a map is written as a picture without losses: end the name in .png, .pgm,"
            " .bmp or .tif"
        )
    with written(path, "wb") as file:
        image_module.fromarray(np.where(free, np.uint8(255), np.uint8(0))).save(file, format=form)


def _shades(picture: Any) -> Shades:
    """Returns a picture's shades; the colours of what is not opaque are mixed with white."""
    if picture.mode.startswith("I") or picture.mode == "F":
        deep = np.asarray(picture, np.float64)
        largest = 65535.0 if deep.max(initial=0) > 255 or picture.mode.startswith("I;16") else 255.0
        return Shades(deep / largest * 255.0, np.zeros(deep.shape, bool))
    if picture.mode in ("1", "L"):
        shade = np.asarray(picture.convert("L"), np.float64)
        return Shades(shade, np.zeros(shade.shape, bool))
    colours = np.asarray(picture.convert("RGBA"), np.float64)
    opacity = colours[..., 3] / 255.0
    return Shades(colours[..., :3].mean(axis=2) * opacity + 255.0 * (1.0 - opacity), opacity < 1.0)
