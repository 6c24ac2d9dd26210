"""Worker processes of this machine, one core each; one that dies is replaced.

A worker is a new interpreter, never a fork, which does not survive a JAX that has started. It gets
the job and then numbers of units through a pipe, and answers through another. When its pipe is
closed, because this process ended it or has died itself, it removes its drafts and ends.
"""

import base64
import contextlib
import itertools
import json
import os
import pickle
import queue
import subprocess
import sys
import threading
from typing import Any

from srt_jax.scale.crews.crew import Crew, Failed
from srt_jax.scale.crews.environment import variables
from srt_jax.scale.job import Job, Outcome

_MOST_DEATHS = 5
"""Workers that may die at one unit before it is given up: it may be what ends them."""
_GRACE = 1.5
"""Seconds for a worker to end by itself, less than what a signal leaves this process to unwind."""


class Pool(Crew):
    """`count` workers."""

    def __init__(self, job: Job, count: int) -> None:
        super().__init__(job)
        self._answers: queue.Queue[tuple[_Worker, dict[str, Any] | None]] = queue.Queue()
        self._deaths: dict[int | None, int] = {}
        self._numbers = itertools.count()
        self._workers: list[_Worker] = []
        try:
            for _ in range(count):
                self._workers.append(_Worker(job, next(self._numbers), self._answers))
        except BaseException:
            self.close()
            raise

    @property
    def pids(self) -> list[int]:
        """The workers' process numbers."""
        return [worker.process.pid for worker in self._workers]

    def has_room(self) -> bool:
        return any(worker.unit is None for worker in self._workers)

    def submit(self, unit: int) -> None:
        idle = next(worker for worker in self._workers if worker.unit is None)
        self.num_busy += 1
        idle.give(unit)

    def next(self) -> Outcome | Failed:
        while True:
            worker, answer = self._answers.get()
            unit = worker.unit
            if answer is None:
                if worker in self._workers:
                    self._replace(worker)
                continue
            assert unit is not None
            worker.unit, worker.has_answered = None, True
            self.num_busy -= 1
            if "error" in answer:
                return Failed(unit, _error(answer["kind"], answer["error"]))
            return Outcome(**answer)

    def _replace(self, dead: "_Worker") -> None:
        """Puts a new worker in a dead one's place, at the same unit."""
        dead.hang_up()
        code, unit = dead.process.wait(), dead.unit
        # one that has worked and waits for more is only missed; one that had nothing to do yet died
        # while it started, and the next ones may as well
        if unit is not None or not dead.has_answered:
            self._deaths[unit] = self._deaths.get(unit, 0) + 1
        if self._deaths.get(unit, 0) >= _MOST_DEATHS:
            where = f"at {self.job.name(unit)}" if unit is not None else "before they did anything"
            raise RuntimeError(
                f"{_MOST_DEATHS} workers ended with code {code} {where}; where memory runs short,"
                " use fewer workers or smaller shards"
            )
        new = _Worker(self.job, next(self._numbers), self._answers)
        self._workers[self._workers.index(dead)] = new
        if unit is not None:
            new.give(unit)

    def close(self) -> None:
        workers, self._workers = self._workers, []
        for worker in workers:
            worker.hang_up()
        for worker in workers:
            worker.end()
        self.num_busy = 0


class _Worker:
    """One process. unit: what it is at work on. has_answered: whether it has made a unit."""

    def __init__(self, job: Job, number: int, answers: queue.Queue) -> None:
        self.unit: int | None = None
        self.has_answered = False
        self.process = subprocess.Popen(
            [sys.executable, "-m", "srt_jax.scale.crews.worker", str(number)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | variables(),
            text=True,
            encoding="utf-8",
            # Ctrl-C in a terminal is for the process that was called, which ends its workers
            start_new_session=True,
        )
        self._say(base64.b64encode(pickle.dumps(job)).decode())
        threading.Thread(target=self._listen, args=(answers,), daemon=True).start()

    def give(self, unit: int) -> None:
        self.unit = unit
        self._say(str(unit))

    def hang_up(self) -> None:
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.close()

    def end(self) -> None:
        try:
            self.process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _say(self, line: str) -> None:
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):  # dead: its own end of the other pipe tells
            self.process.stdin.write(line + "\n")
            self.process.stdin.flush()

    def _listen(self, answers: queue.Queue) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as lines:
            for line in lines:
                with contextlib.suppress(json.JSONDecodeError):  # a line cut off by a kill
                    answers.put((self, json.loads(line)))
        answers.put((self, None))


def _error(kind: str, text: str) -> Exception:
    """Returns the error that a worker met: bad input as such, all else as a fault of ours."""
    kinds: dict[str, type[Exception]] = {"ValueError": ValueError, "ImportError": ImportError}
    return kinds.get(kind, RuntimeError)(text)
