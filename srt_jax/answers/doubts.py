"""What may be wrong with a question though its answer is right: worth a note."""

from collections.abc import Sequence

import numpy as np

from srt_jax.formats.notes import Notes
from srt_jax.geometry.frame import Frame
from srt_jax.task import NamedTask

_WALLS = (
    "answers that destroy most of what is blocked, from the edge of the map on, perhaps its walls:"
    " say by --destroyable or --labels what can go"
)


def doubts_of(
    tasks: Sequence[NamedTask],
    destroyed: Sequence[Sequence[int]],
    frames: Sequence[Frame | None],
) -> Notes:
    """Returns notes on the answers to tasks of which nobody said what can be destroyed: on a map,
    all that is blocked can, its walls included.

    Args:
      destroyed: of each task, the obstacles that its answer destroys.
      frames: where the map of each task lies, None where it was no map, and its obstacles have
        names of their own.
    """
    found = Notes()
    for (name, task), gone, frame in zip(tasks, destroyed, frames):
        if frame is None:
            continue
        labels = np.asarray(task.labels)
        at_edge = np.concatenate([labels[:, (0, -1)].ravel(), labels[:, :, (0, -1)].ravel()])
        for obstacle in gone:
            is_most = 2 * (labels == obstacle).sum() > (labels >= 0).sum()
            if is_most and (at_edge == obstacle).any():
                found.add(_WALLS, example=f"{name}, obstacle {obstacle}")
    return found
