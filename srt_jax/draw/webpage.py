"""A run as one web page that needs nothing else: summary, filters, each task's picture and
explanation.

Pictures are small SVGs (`draw.svg_tile`), kept in the page; it asks no network, and says so to the
browser (by a content security policy).
"""

import base64
import importlib.resources
import json
import os
from collections.abc import Callable, Sequence
from typing import Any

from srt_jax.draw.parts.colours import APPROACH, BADGE, GOAL, LEGS, SEED, START, Kind
from srt_jax.draw.parts.tile import svg_tile
from srt_jax.formats.shared.whole_files import atomic_write
from srt_jax.task import NamedTask
from srt_jax.types import Approach, Solution, Status

MOST_PICTURES = 1000
"""Tasks that get a picture, by default; a picture takes 1 to 10 kB."""

_SHOWN = (
    "name",
    "status",
    "cost",
    "destroyed",
    "removal_cost",
    "removal_bound",
    "seed",
    "blocking",
    "explanation",
)


def write_page(
    path: str | os.PathLike,
    tasks: Sequence[NamedTask],
    solutions: Sequence[Solution],
    records: Sequence[dict[str, Any]],
    *,
    seconds: float | None = None,
    title: str = "srt-jax: a run",
    most_pictures: int = MOST_PICTURES,
    approaches: Sequence[Approach | None] | None = None,
    progress: Callable[[int], None] = lambda count: None,
) -> None:
    """Writes the page, whole or not at all.

    Args:
      tasks, solutions, records: one each, in order; records from `results_file.as_record`.
      seconds: how long solving took.
      most_pictures: the first so many tasks get a picture, and a notice says so where there are
        more.
      approaches: one for each task, None of those that are solved; else they are found.
      progress: called with the number of tasks written.

    Raises:
      ValueError: the file cannot be written.
    """
    rows = []
    known = approaches or [None] * len(tasks)
    for place, ((_, task), solution, record, near) in enumerate(
        zip(tasks, solutions, records, known, strict=True)
    ):
        row = {key: record[key] for key in _SHOWN} | {
            # destroyable obstacles first, as in the table of the command line
            "blocking": sorted(record["blocking"], key=lambda i: not task.destroyable[i]),
            "contour": len(record["contour"]),
            "size": task.size.tolist(),
            "side": record["cell_side"],
        }
        if place < most_pictures:
            picture = svg_tile(task, solution, approach=near)
            row["picture"] = base64.b64encode(picture.encode()).decode()
        rows.append(row)
        progress(1)
    notice = ""
    if len(rows) > most_pictures:
        notice = (
            f"Pictures are of the first {most_pictures} of {len(rows)} tasks, to keep this page"
            " light."
        )
    data = {
        "title": title,
        "seconds": seconds,
        "notice": notice,
        "meanings": {status.name: status.meaning for status in Status},
        "legend": _legend(),
        "tasks": rows,
    }
    template = (
        importlib.resources.files("srt_jax.data").joinpath("page.html").read_text(encoding="utf-8")
    )
    # so that no name can end the script that holds it
    document = json.dumps(data).replace("<", "\\u003c")
    with atomic_write(path) as file:
        file.write(template.replace("__DATA__", document, 1))


def _legend() -> list[list[str]]:
    """Returns (form, colour, text) of what pictures show."""
    cells = [["cell", kind.colour, kind.called] for kind in Kind if kind is not Kind.FRONT]
    marks = [
        ["●", START, "start"],
        ["★", GOAL, "goal"],
        ["✕", SEED, "seed"],
        ["◆", BADGE, "destroys from here"],
        ["dashes", APPROACH, "as near as one gets"],
    ]
    return [
        *cells,
        *marks,
        *(
            ["line", colour, f"leg {index + 1}, {index + 1 + len(LEGS)}, ..."]
            for index, colour in enumerate(LEGS)
        ),
    ]
