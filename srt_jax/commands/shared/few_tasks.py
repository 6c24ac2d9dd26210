"""Few tasks are answered without compiling: the command would be over before that pays."""

import contextlib
from collections.abc import Sequence

from sign_model.foundation.uncompiled.first_answers import PATIENCE, uncompiled
from srt_jax.task import NamedTask

SECONDS_A_TASK, SECONDS_A_CELL = 0.1, 6e-6
"""What a task of the modes "least" and "paper" takes without compiling, roughly: 0.1 s at 64 x 64,
1.6 s at 512 x 512.
"""


def at_once(tasks: Sequence[NamedTask]) -> contextlib.AbstractContextManager:
    """Returns a context within which tasks so few and small are answered without compiling. What
    the next command of this kind needs is compiled, and kept, by that command.
    """
    cells = sum(task.task.labels[..., 0, :, :].size for task in tasks)
    expected = SECONDS_A_TASK * len(tasks) + SECONDS_A_CELL * cells
    return uncompiled() if expected < PATIENCE else contextlib.nullcontext()
