"""What all crews have in common: units go in by number, outcomes come out."""

import abc
from types import TracebackType
from typing import Any, NamedTuple

from srt_jax.scale.job import Job, Outcome, attempt


class Failed(NamedTuple):
    """A unit that could not be made, and why."""

    unit: int
    error: Exception


class Crew(abc.ABC):
    """Makes units of one job; a context, at whose end nothing of it is left running."""

    num_busy = 0
    """Units that went in and have not come out."""

    def __init__(self, job: Job) -> None:
        self.job = job

    def __enter__(self) -> "Crew":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()

    @abc.abstractmethod
    def has_room(self) -> bool:
        """Returns whether another unit may go in."""

    @abc.abstractmethod
    def submit(self, unit: int) -> None:
        """Takes a unit."""

    @abc.abstractmethod
    def next(self) -> Outcome | Failed:
        """Returns the next outcome; waits for it."""

    @abc.abstractmethod
    def close(self) -> None:
        """Ends what is being made."""


class Cluster(Crew):
    """The workers of an engine; one of this machine may have to be started anew.

    _units: what was handed out, {the engine's name of it: unit}.
    """

    def __init__(self, job: Job) -> None:
        super().__init__(job)
        self._units: dict[Any, int] = {}
        self._restarts = 0
        """Since the last outcome."""

    @abc.abstractmethod
    def _connect(self) -> None:
        """Connects to the engine's scheduler, or starts one."""

    def _start_anew(self, most: int, dead: str) -> None:
        """Ends the cluster, starts another and hands the units out again; RuntimeError(dead) where
        that was done `most` times without an outcome.
        """
        if self._restarts == most:
            raise RuntimeError(dead)
        self._restarts += 1
        units = list(self._units.values())
        self.close()
        self._connect()
        for unit in units:
            self.submit(unit)


class Here(Crew):
    """This process."""

    _unit = -1

    def has_room(self) -> bool:
        return not self.num_busy

    def submit(self, unit: int) -> None:
        self._unit, self.num_busy = unit, 1

    def next(self) -> Outcome | Failed:
        self.num_busy = 0
        try:
            return attempt(self.job, self._unit)
        except (ValueError, ImportError) as error:
            return Failed(self._unit, error)

    def close(self) -> None:
        pass
