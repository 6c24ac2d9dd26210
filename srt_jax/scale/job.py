"""A job: a folder and the units that are to be there; and the one way to make a unit."""

import abc
import contextlib
import os
import pathlib
import time
from typing import Any, NamedTuple

from srt_jax.scale.claims import claims_of, close_claims


class Job(abc.ABC):
    """The units of a folder, numbered from 0.

    It travels to other processes by pickle, so it holds names and numbers, no array.
    """

    folder: pathlib.Path

    @abc.abstractmethod
    def __len__(self) -> int:
        """Returns the number of units."""

    @abc.abstractmethod
    def name(self, unit: int) -> str:
        """Returns the name of a unit's file in the folder."""

    @abc.abstractmethod
    def num_tasks(self, unit: int) -> int:
        """Returns how many tasks a unit holds, for progress and rates."""

    @abc.abstractmethod
    def make(self, unit: int) -> None:
        """Writes a unit's file, whole or not at all; the same bytes whoever makes it."""

    def is_done(self, unit: int) -> bool:
        """Returns whether the unit's file is there."""
        return (self.folder / self.name(unit)).exists()

    def missing(self, units: range) -> list[int]:
        """Returns which of `units` are not done, by one look into the folder."""
        there = set(os.listdir(self.folder))
        return [unit for unit in units if self.name(unit) not in there]


class Outcome(NamedTuple):
    """What came of an attempt: "made", "there" (before, or made by another), or "claimed" by
    another that lives. seconds: that making took. cpu: seconds of the processor, which others at
    work do not lengthen. peak: bytes, the most memory the process had.
    """

    unit: int
    what: str
    seconds: float = 0.0
    cpu: float = 0.0
    peak: int = 0


def attempt(job: Job, unit: int) -> Outcome:
    """Makes a unit unless it is done or claimed; safe to call in any number of processes."""
    if job.is_done(unit):
        return Outcome(unit, "there")
    claims, name = claims_of(job.folder), job.name(unit)
    if not claims.take(name):
        return Outcome(unit, "claimed")
    begin, cpu = time.perf_counter(), time.process_time()
    try:
        # finished between the first look and the claim
        if job.is_done(unit):
            return Outcome(unit, "there")
        _remove_drafts(job.folder, name)
        job.make(unit)
    finally:
        claims.release(name)
    seconds = time.perf_counter() - begin
    return Outcome(unit, "made", seconds, time.process_time() - cpu, _peak())


def leave(job: Job, *, is_all_done: bool) -> None:
    """Ends this process's part in a job's folder, and tidies up after workers that were killed."""
    claims = claims_of(job.folder)
    for name, holder in claims.holders().items():
        if claims.is_dead(holder) and claims.take(name):
            _remove_drafts(job.folder, name)
            claims.release(name)
    close_claims(job.folder, is_all_done=is_all_done)


def _remove_drafts(folder: pathlib.Path, name: str) -> None:
    """Removes what a killed process left of a unit; only for who holds its claim."""
    for draft in folder.glob(f".{pathlib.Path(name).stem}.*part"):
        with contextlib.suppress(OSError):
            draft.unlink()


def _peak() -> int:
    try:
        import resource
    except ImportError:  # Windows
        return 0
    peak: Any = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak) * (1 if os.uname().sysname == "Darwin" else 1024)
