"""A job made by a crew: what is missing is handed out, what others claim is waited for."""

import collections
import time
from collections.abc import Callable
from typing import NamedTuple

from srt_jax.scale.crews import choose
from srt_jax.scale.crews.crew import Crew, Failed
from srt_jax.scale.job import Job, Outcome, leave
from srt_jax.scale.parts import Part

_MOST_FAILURES = 3
"""Units that may fail before any was made: then the fault is not that of single units."""
_PAUSES = (0.2, 0.5, 1.0, 2.0, 5.0)
"""Seconds to wait for units that others have claimed, longer each time."""


class Made(NamedTuple):
    """What a run did: the outcomes of the units that it made, and how many were there before or
    were made by others meanwhile.
    """

    outcomes: list[Outcome]
    num_there: int


def run(
    job: Job,
    *,
    workers: int | None = None,
    part: Part | None = None,
    engine: str | None = None,
    address: str | None = None,
    progress: Callable[[int], None] | None = None,
) -> Made:
    """Makes the units of a job that are missing, and returns when all of them are there.

    Any number of runs may work in one folder at a time, on one machine or several.

    Args:
      workers: processes, one core each; None works in this process.
      part: of the units; all by default.
      engine: None, "dask" or "ray". address: of its scheduler; None starts one on this machine.
      progress: called with the tasks of each unit that is there, however it came.

    Raises:
      ValueError: a unit cannot be made, or a number out of range. ImportError: the engine is not
        installed. RuntimeError: a unit ended several workers in turn.
    """
    units = (part or Part()).units(len(job))
    missing = job.missing(units)
    is_missing = set(missing)
    for unit in units:
        if unit not in is_missing and progress:
            progress(job.num_tasks(unit))
    if not missing:
        return Made([], len(units))
    crew = choose(job, len(missing), workers=workers, engine=engine, address=address)
    is_all_done = False
    try:
        with crew:
            outcomes = _drive(job, crew, missing, progress)
        is_all_done = not job.missing(range(len(job)))
    finally:
        leave(job, is_all_done=is_all_done)
    return Made(outcomes, len(units) - len(outcomes))


def _drive(
    job: Job, crew: Crew, missing: list[int], progress: Callable[[int], None] | None
) -> list[Outcome]:
    waiting, claimed = collections.deque(missing), collections.deque[int]()
    made: list[Outcome] = []
    failures: list[Failed] = []
    pauses = 0
    while waiting or claimed or crew.num_busy:
        while waiting and crew.has_room():
            crew.submit(waiting.popleft())
        if not crew.num_busy:  # others have the rest: see whether they finish, or die
            time.sleep(_PAUSES[min(pauses, len(_PAUSES) - 1)])
            pauses += 1
            waiting, claimed = claimed, collections.deque()
            continue
        outcome = crew.next()
        if isinstance(outcome, Failed):
            failures.append(outcome)
            if not made and len(failures) >= _MOST_FAILURES:
                break
        elif outcome.what == "claimed":
            claimed.append(outcome.unit)
        else:
            pauses = 0
            if outcome.what == "made":
                made.append(outcome)
            if progress:
                progress(job.num_tasks(outcome.unit))
    if failures:
        _raise(failures)
    return made


def _raise(failures: list[Failed]) -> None:
    """Raises the error of the first unit that failed."""
    first, number = failures[0], len(failures)
    more = f" ({number - 1} more unit{'s' * (number > 2)} failed)" if number > 1 else ""
    if isinstance(first.error, ValueError | ImportError):
        raise type(first.error)(f"{first.error}{more}") from first.error
    raise first.error
