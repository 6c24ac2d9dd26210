"""When a call is answered by NumPy: where the caller asked for it, and as long as that takes less
than to compile.
"""

import contextlib
import contextvars
import time
from collections.abc import Iterator, Sequence
from typing import Any

import jax
import numpy as np

from sign_model.foundation.uncompiled.expressions import UntranslatableError
from sign_model.foundation.uncompiled.program import OutOfTimeError, translated

PATIENCE = 2.0
"""Seconds that the calls of one program may take on NumPy: half of what compiling takes."""

_patience = contextvars.ContextVar("seconds_uncompiled", default=0.0)


@contextlib.contextmanager
def uncompiled(seconds: float = PATIENCE) -> Iterator[None]:
    """Within it, calls outside jit are answered without compiling: the first answer of a shape is
    there in a third of the time, the next ones take as long again.

    For a few tasks of many shapes, each looked at once. A call that would take longer than
    `seconds`, together with the earlier calls of its program, is compiled after all, and so is what
    was answered in this way by an earlier process, since it is worth keeping then. The answers are
    the same bit for bit. A program that is compiled, or kept on disk, is taken as ever.

    Args:
      seconds: for the calls of one program in this process; 0 compiles at once, as outside.

    Examples:
      >>> import numpy as np
      >>> import srt_jax
      >>> free = np.ones((5, 7), bool)
      >>> free[:, 3] = False
      >>> with srt_jax.uncompiled():
      ...     solution = srt_jax.solve(srt_jax.make_task(free, (2, 0), (2, 6)))
      >>> solution.cost.item()
      6.0
    """
    token = _patience.set(seconds)
    try:
        yield
    finally:
        _patience.reset(token)


def patience() -> float:
    """Returns how many seconds the calls of a program may take on NumPy here."""
    return _patience.get()


class NumpyForm:
    """A traced function that answers by NumPy until it has taken too long."""

    def __init__(self, traced: jax.stages.Traced) -> None:
        self._traced, self._run, self._spent = traced, None, 0.0
        self._is_over = False

    def answer(self, arrays: Sequence[Any], seconds: float) -> list[np.ndarray] | None:
        """Returns the results, or None from when this is not possible or has taken `seconds`."""
        if self._is_over or self._spent >= seconds:
            return None
        began = time.perf_counter()
        try:
            if self._run is None:
                self._run = translated(self._traced.jaxpr)
            return self._run(arrays, began + seconds - self._spent)
        except (UntranslatableError, OutOfTimeError):
            self._is_over = True
            return None
        finally:
            self._spent += time.perf_counter() - began
