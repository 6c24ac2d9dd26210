"""How far a folder of units is: done, claimed and by whom, missing, how fast, how long still."""

import os
import pathlib
from typing import Any, NamedTuple

from srt_jax.scale.claims import FOLDER, Claims, Holder
from srt_jax.scale.job import Job

_RECENT = 32
"""Units by whose times the rate is told."""


class Standing(NamedTuple):
    """The state of a folder.

    units, done: numbers of units. tasks, tasks_done: of the tasks in them. claimed: who is at work
      on which unit. abandoned: units whose process is gone. rate: tasks a second of late, None
      where nobody is at work or too little is done. left: seconds, at that rate.
    """

    units: int
    done: int
    tasks: int
    tasks_done: int
    claimed: dict[str, Holder]
    abandoned: list[str]
    rate: float | None
    left: float | None

    @property
    def missing(self) -> int:
        """Units that are not done and that nobody is at work on."""
        return self.units - self.done - len(self.claimed)

    def as_json(self) -> dict[str, Any]:
        """Returns it as JSON types."""
        claimed = [
            {"unit": unit, "host": holder.host, "pid": holder.pid, "seconds": holder.seconds}
            for unit, holder in sorted(self.claimed.items())
        ]
        return self._asdict() | {"claimed": claimed, "missing": self.missing}


def standing(job: Job) -> Standing:
    """Returns how far a job is, by what is in its folder; changes nothing of it."""
    times = _times(job.folder)
    sizes = {job.name(unit): job.num_tasks(unit) for unit in range(len(job))}
    done = {name: times[name] for name in sizes if name in times}
    holders, abandoned = _holders(job.folder)
    holders = {name: who for name, who in holders.items() if name in sizes}
    claimed = {
        name: who for name, who in holders.items() if name not in abandoned and name not in done
    }
    tasks, tasks_done = sum(sizes.values()), sum(sizes[name] for name in done)
    # The rate of the units that were finished last.
    rate = left = None
    last = sorted((time, name) for name, time in done.items())[-_RECENT:]
    if claimed and len(last) > 1 and last[-1][0] > last[0][0]:
        rate = sum(sizes[name] for _, name in last[1:]) / (last[-1][0] - last[0][0])
        left = (tasks - tasks_done) / rate
    return Standing(
        units=len(job),
        done=len(done),
        tasks=tasks,
        tasks_done=tasks_done,
        claimed=claimed,
        abandoned=sorted(holders.keys() & abandoned - done.keys()),
        rate=rate,
        left=left,
    )


def _holders(folder: pathlib.Path) -> tuple[dict[str, Holder], set[str]]:
    """Returns who holds each claimed unit, and the units whose process is gone."""
    if not (folder / FOLDER).is_dir():  # nobody is there; the folder may not even be writable
        return {}, set()
    claims = Claims(folder)
    try:
        holders = claims.holders()
        return holders, {name for name, who in holders.items() if claims.is_dead(who)}
    finally:
        claims.close()


def _times(folder: pathlib.Path) -> dict[str, float]:
    """Returns when each file of a folder was written."""
    with os.scandir(folder) as entries:
        return {entry.name: entry.stat().st_mtime for entry in entries if entry.is_file()}
