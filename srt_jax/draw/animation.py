"""Animated GIFs: the wave (reachability growing) and the loop (explore, blocked, seed, contour,
walk up, destroy, continue).
"""

import io
import itertools
import os
import pathlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from sign_model.foundation.legible import counted
from srt_jax.draw.notebook import picture_html
from srt_jax.draw.parts.canvas import Canvas, save_gif
from srt_jax.draw.parts.colours import Kind
from srt_jax.draw.parts.content import length_in
from srt_jax.draw.stages import Stage, stages_of
from srt_jax.geometry.frame import Frame
from srt_jax.types import Solution, Status, Task

ANIMATIONS = ("loop", "wave")
_WAVE_FRAMES, _LATER_WAVE_FRAMES, _WALK_FRAMES = 28, 12, 10
_QUICK, _HOLD, _LAST = 90, 1400, 3000
"""Milliseconds a frame is shown."""

_MOST_STAGES = 12


class Animation(NamedTuple):
    """An animation that a notebook shows.

    Attributes:
      gif: the bytes of the file.
    """

    gif: bytes

    def __repr__(self) -> str:
        return f"Animation({len(self.gif)} bytes of GIF)"

    def _repr_html_(self) -> str:
        return picture_html(self.gif, "gif", "the loop of plan, blockage and removal")


def animate(
    task: Task,
    solution: Solution,
    path: str | os.PathLike | None = None,
    *,
    what: str = "loop",
    title: str = "",
    frame: Frame | None = None,
) -> Animation | None:
    """Writes an animated GIF of one task, or returns it for a notebook.

    Args:
      path: None returns the animation.
      what: "wave": the reached region grows from the start until nothing is left, then seed and
        contour. "loop": the same, then the agent walks up to what is to be destroyed, destroys it,
        explores from there, and so on to the goal.
      frame: where the map lies: lengths are in metres, where it has any.

    Raises:
      ImportError: Pillow is missing. ValueError: a batch was given, another ending than .gif, or an
        unknown `what`.

    Examples:
      >>> import os
      >>> import tempfile
      >>> import numpy as np
      >>> import srt_jax
      >>> from srt_jax.draw import animate
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> task = srt_jax.make_task(free, (2, 0), (2, 6))
      >>> solution = srt_jax.solve(task)
      >>> path = os.path.join(tempfile.mkdtemp(), "loop.gif")
      >>> animate(task, solution, path)
      >>> os.path.exists(path)
      True
    """
    if path is not None and pathlib.Path(path).suffix.lower() != ".gif":
        raise ValueError(f"{path}: an animation is a GIF: end the name in .gif")
    if what not in ANIMATIONS:
        raise ValueError(f"an animation shows one of {', '.join(ANIMATIONS)}, got {what!r}")
    stages = stages_of(task, solution)
    canvas = Canvas(
        stages[0].kinds.shape, _kinds_of(stages), title, _cell(task.start), _cell(task.goal)
    )
    status = Status(int(solution.status))
    if what == "wave":
        shown = [
            *_explore(canvas, stages[0], _WAVE_FRAMES),
            _end(canvas, stages[0], _after_wave(stages[0], status)),
        ]
    else:
        shown = list(_loop(canvas, stages, solution, status, frame))
    if path is None:
        buffer = io.BytesIO()
        save_gif(buffer, shown)
        return Animation(buffer.getvalue())
    save_gif(path, shown)
    return None


def _loop(
    canvas: Canvas,
    stages: list[Stage],
    solution: Solution,
    status: Status,
    frame: Frame | None,
) -> Iterator[tuple[Any, int]]:
    for number, stage in enumerate(stages[:_MOST_STAGES]):
        yield from _explore(canvas, stage, _WAVE_FRAMES if number == 0 else _LATER_WAVE_FRAMES)
        if stage.seed:
            caption = (
                f"Blocked: the goal is not reached. Seed {stage.seed}, the reached cell nearest the"
                " goal"
            )
            yield canvas.frame(stage.kinds, stage.place, caption, seed=stage.seed), _HOLD
            touching = counted(int(stage.contour.sum()), "cell")
            caption = f"Contour: {touching} touch what separates the goal"
            yield canvas.frame(_with_contour(stage), stage.place, caption, seed=stage.seed), _HOLD
        if not status.is_solved:
            break
        yield from _walk(canvas, stage)
        yield from _destroy(canvas, stage)
        canvas.keep(stage.leg)
    last = stages[min(len(stages), _MOST_STAGES) - 1]
    caption = f"{status.name}: {status.meaning}"
    if status.is_solved and len(stages) <= _MOST_STAGES:
        caption = (
            f"At the goal: {length_in(solution.cost, frame)},"
            f" {counted(int(solution.num_destroyed), 'obstacle')} destroyed"
        )
    elif status.is_solved:
        caption = f"And so on: {counted(int(solution.num_destroyed), 'obstacle')} destroyed in all"
    if status.is_solved:
        yield canvas.frame(last.kinds, _end_of(last), caption), _LAST
    else:
        yield _end(canvas, last, caption)


def _explore(canvas: Canvas, stage: Stage, num_frames: int) -> Iterator[tuple[Any, int]]:
    """The reached region in steps of equal length, its front darker."""
    lengths = stage.length[np.isfinite(stage.length)]
    if not lengths.size:
        return
    bare = np.where(stage.kinds == Kind.REACHED, Kind.UNREACHED, stage.kinds).astype(np.uint8)
    borders = np.linspace(0, float(lengths.max()), num_frames + 1)
    for before, now in itertools.pairwise(borders.tolist()):
        kinds = bare.copy()
        kinds[stage.length <= before] = Kind.REACHED
        kinds[(stage.length > before) & (stage.length <= now)] = Kind.FRONT
        caption = f"Explore: {counted(int((stage.length <= now).sum()), 'cell')} reached"
        yield canvas.frame(kinds, stage.place, caption), _QUICK
    yield (
        canvas.frame(
            stage.kinds, stage.place, f"Explored: {counted(lengths.size, 'cell')} can be reached"
        ),
        _HOLD // 2,
    )


def _walk(canvas: Canvas, stage: Stage) -> Iterator[tuple[Any, int]]:
    if stage.leg is None:
        return
    where = f"up to obstacle {stage.removals[0].obstacle}" if stage.removals else "to the goal"
    ends = np.unique(np.linspace(1, len(stage.leg) - 1, _WALK_FRAMES).round().astype(int))
    for end in ends.tolist():
        row, col = stage.leg[end].tolist()
        yield (
            canvas.frame(stage.kinds, (row, col), f"Walk {where}", leg=stage.leg[: end + 1]),
            _QUICK,
        )
    yield canvas.frame(stage.kinds, _end_of(stage), f"Walk {where}", leg=stage.leg), _HOLD // 3


def _destroy(canvas: Canvas, stage: Stage) -> Iterator[tuple[Any, int]]:
    kinds = stage.kinds.copy()
    for removal in stage.removals:
        kinds[tuple(removal.cells.T)] = Kind.DESTROYED
        caption = (
            f"Destroy obstacle {removal.obstacle} (number {removal.number}) from {removal.standing}"
        )
        yield canvas.frame(kinds, _end_of(stage), caption, leg=stage.leg), _HOLD


def _after_wave(stage: Stage, status: Status) -> str:
    if stage.sees_goal:
        return "The goal is among the cells reached"
    return (
        f"Blocked: seed {stage.seed}, contour of {counted(int(stage.contour.sum()), 'cell')}"
        if stage.seed
        else status.meaning
    )


def _end(canvas: Canvas, stage: Stage, caption: str) -> tuple[Any, int]:
    return canvas.frame(_with_contour(stage), stage.place, caption, seed=stage.seed), _LAST


def _with_contour(stage: Stage) -> np.ndarray:
    return np.where(stage.contour, Kind.CONTOUR, stage.kinds).astype(np.uint8)


def _end_of(stage: Stage) -> tuple[int, int]:
    return _cell(stage.leg[-1]) if stage.leg is not None else stage.place


def _kinds_of(stages: list[Stage]) -> list[Kind]:
    """Returns the kinds of cells the legend names."""
    there = set(np.unique(np.concatenate([np.unique(stage.kinds) for stage in stages])).tolist())
    there |= {Kind.UNREACHED, Kind.REACHED, Kind.FRONT}
    there |= {Kind.CONTOUR} if any(stage.contour.any() for stage in stages) else set()
    there |= {Kind.DESTROYED} if any(stage.removals for stage in stages) else set()
    return [Kind(value) for value in sorted(there)]


def _cell(cell) -> tuple[int, int]:
    row, col = np.asarray(cell).tolist()
    return row, col
