"""A job that takes no JAX, for tests of who makes what: each unit is a line of text."""

import os
import pathlib
import signal
import time

from srt_jax.formats.shared.whole_files import atomic_write
from srt_jax.scale.job import Job


class Lines(Job):
    """`count` units; making one takes `seconds`, and is noted in the file `log`."""

    def __init__(self, folder, count, *, seconds=0.0, log=None, bad=(), deadly=()):
        self.folder, self.count, self.seconds = pathlib.Path(folder), count, seconds
        self.log, self.bad, self.deadly = log, bad, deadly

    def __len__(self):
        return self.count

    def name(self, unit):
        return f"line-{unit:04d}.txt"

    def num_tasks(self, unit):
        return 10

    def make(self, unit):
        if unit in self.bad:
            raise ValueError(f"unit {unit} is bad")
        if unit in self.deadly:
            os.kill(os.getpid(), signal.SIGKILL)
        with atomic_write(self.folder / self.name(unit)) as file:
            file.write(f"unit {unit}\n")
            time.sleep(self.seconds)
        if self.log:
            with open(self.log, "a") as file:
                file.write(f"{unit} {os.getpid()}\n")
