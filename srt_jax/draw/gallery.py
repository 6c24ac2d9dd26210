"""The pictures of many tasks in a folder: names that make good file names, one by one, sheets of
them.
"""

import hashlib
import pathlib
import re
from collections.abc import Callable, Sequence
from typing import Any

from srt_jax.draw.animation import ANIMATIONS, animate
from srt_jax.draw.parts.polar_frame import PolarFrame
from srt_jax.draw.picture import draw
from srt_jax.draw.sheet import MOST_ON_SHEET, contact_sheet
from srt_jax.geometry.frame import Frame
from srt_jax.types import Approach, Solution, Task

Named = Sequence[tuple[str, Task, Solution]]
SHOWS = ("pictures", "sheet", *ANIMATIONS)


def file_names(names: Sequence[str]) -> list[str]:
    """Returns a file name without ending for each: the last part, safe signs only; the second of a
    kind gets "-2".

    A name of more than 120 bytes is cut, and ends in eight hexadecimal digits that the whole name
    determines.
    """
    found: list[str] = []
    taken: set[str] = set()
    next_number: dict[str, int] = {}
    for name in names:
        plain = re.sub(r"[^\w.+=-]+", "_", pathlib.PurePath(name).name).strip("._") or "task"
        plain = _cut(plain)
        unique = plain
        while unique in taken:
            next_number[plain] = next_number.get(plain, 1) + 1
            unique = f"{plain}-{next_number[plain]}"
        taken.add(unique)
        found.append(unique)
    return found


def _cut(name: str, most: int = 120) -> str:
    """Returns a name that file systems have room for, whatever is added to it."""
    as_bytes = name.encode("utf-8", "replace")
    if len(as_bytes) <= most:
        return name
    return (
        as_bytes[: most - 9].decode("utf-8", "ignore")
        + "-"
        + hashlib.sha256(as_bytes).hexdigest()[:8]
    )


def gallery(
    named: Named,
    folder: pathlib.Path,
    *,
    show: str = "pictures",
    ending: str = "png",
    polar: PolarFrame | None = None,
    frames: Sequence[Frame | None] | None = None,
    approaches: Sequence[Approach | None] | None = None,
    progress: Callable[[int], None] = lambda count: None,
) -> list[pathlib.Path]:
    """Draws each (name, task, solution) into a folder that is there, and returns the files in
    order.

    Args:
      show: "pictures", one each, and a contact sheet where there are several; "sheet", the sheets
        alone; "loop" or "wave", an animation each.
      ending: of pictures: "png", "svg" or "pdf".
      frames: where the map of each task lies, None where that is not known.
      approaches: one for each task, None of those that are solved; else they are found.
      progress: called with the number of tasks drawn.
    """
    files = []
    stems = file_names([name for name, _, _ in named])
    none: list[Any] = [None] * len(named)
    known = zip(stems, named, frames or none, approaches or none)
    for stem, (name, task, solution), frame, near in known:
        if show in ANIMATIONS:
            files.append(folder / f"{stem}-{show}.gif")
            animate(task, solution, files[-1], what=show, title=name, frame=frame)
        elif show == "pictures":
            files.append(folder / f"{stem}.{ending}")
            options: dict[str, Any] = {"polar": polar, "frame": frame, "approach": near}
            draw(task, solution, files[-1], title=name, **options)
        progress(1)
    return files + (
        _sheets(named, frames or none, folder, ending)
        if show == "sheet" or (show == "pictures" and len(named) > 1)
        else []
    )


def _sheets(
    named: Named, frames: Sequence[Frame | None], folder: pathlib.Path, ending: str
) -> list[pathlib.Path]:
    parts = [slice(first, first + MOST_ON_SHEET) for first in range(0, len(named), MOST_ON_SHEET)]
    pages = [(named[part], frames[part]) for part in parts]
    numbers = [""] if len(pages) == 1 else [f"-{number}" for number in range(1, len(pages) + 1)]
    files = [folder / f"contact-sheet{number}.{ending}" for number in numbers]
    for file, (page, known) in zip(files, pages):
        contact_sheet(page, file, frames=known)
    return files
