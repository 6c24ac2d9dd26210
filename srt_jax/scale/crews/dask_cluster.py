"""The workers of Dask distributed: of a cluster that is there, or of one on this machine.

A worker that dies is restarted by its nanny, and the scheduler gives its unit to another; a unit
that ends `distributed.scheduler.allowed-failures` workers (3 by default) is given up.
"""

import contextlib
import logging
import queue
import time
from typing import Any

from sign_model.foundation.core_count import num_cores
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.scale.crews.crew import Cluster, Failed
from srt_jax.scale.crews.environment import variables
from srt_jax.scale.job import Job, Outcome, attempt

_PER_WORKER = 2
"""Units handed out for each worker: one in hand, one to come."""
_STARTS = 8
_PATIENCE, _GRACE = 30, 2
"""Seconds for the scheduler to answer, and for all to end."""
_DEAD = "the workers of Dask die before they do anything; where memory runs short, use fewer"
_LOOK, _DESERTED = 1, 5
"""Seconds between two looks whether there are workers, and without any before all is started
anew.
"""


_SETTINGS = {
    # a worker's profile is looked at on the page that there is not
    "distributed.worker.profile.enabled": False,
    # looks at the clock fifty times a second in each process, and other watches over small tasks
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
    "distributed.scheduler.work-stealing": False,
}
"""Of a cluster of this machine: units last for seconds and need no closer watch, which would cost
a twentieth of the processor.
"""


class DaskCluster(Cluster):
    """`workers` processes of this machine, one for each core by default; or those at `address`."""

    def __init__(self, job: Job, workers: int | None, address: str | None) -> None:
        super().__init__(job)
        distributed = require_module("distributed", extra="dask", what="--engine dask")
        self._dask, self._address = distributed, address
        self._workers = workers or num_cores()
        self._connect()

    def _connect(self) -> None:
        self._finished: queue.Queue[Any] = queue.Queue()
        self._deserted_since: float | None = None
        self._cluster = None if self._address else _local(self._dask, self._workers)
        try:
            self._client = self._dask.Client(self._address or self._cluster, timeout=_PATIENCE)
        except OSError as error:
            raise ValueError(
                f"--address {self._address}: no scheduler of Dask answers there: start one by"
                " dask scheduler"
            ) from error

    def has_room(self) -> bool:
        if not self.num_busy:
            return True
        return self.num_busy < _PER_WORKER * max(1, sum(self._client.nthreads().values()))

    def submit(self, unit: int) -> None:
        future = self._client.submit(attempt, self.job, unit, pure=False)
        self._units[future] = unit
        self.num_busy += 1
        future.add_done_callback(self._finished.put)

    def next(self) -> Outcome | Failed:
        while True:
            try:
                future = self._finished.get(timeout=_LOOK)
                break
            except queue.Empty:
                self._replace_deserted()
        unit = self._units.pop(future)
        self.num_busy -= 1
        try:
            outcome = future.result()
            self._restarts = 0
            return outcome
        except (ValueError, ImportError) as error:
            return Failed(unit, error)
        except self._dask.KilledWorker as error:
            raise RuntimeError(
                f"several workers died at {self.job.name(unit)} in turn; where memory runs short,"
                " use fewer workers or smaller shards"
            ) from error

    def _replace_deserted(self) -> None:
        """Starts a cluster of this machine anew that has had no worker for some time: a nanny gives
        up when its worker dies while it starts.
        """
        if self._cluster is None or self._client.nthreads():
            self._deserted_since = None
            return
        now = time.monotonic()
        self._deserted_since = self._deserted_since or now
        if now - self._deserted_since < _DESERTED:
            return
        self._start_anew(_STARTS, _DEAD)

    def close(self) -> None:
        self._units = {}
        with contextlib.suppress(Exception):
            self._client.close(timeout=_GRACE)
        if self._cluster is not None:
            with contextlib.suppress(Exception):
                self._cluster.close(timeout=_GRACE)
        self.num_busy = 0


def _local(distributed: Any, workers: int) -> Any:
    """Returns a cluster of this machine, which serves nobody else and shows no web page."""
    dask = require_module("dask", extra="dask", what="--engine dask")
    key = "distributed.nanny.pre-spawn-environ"
    options = {
        "n_workers": workers,
        "threads_per_worker": 1,
        "processes": True,
        "host": "127.0.0.1",
        "dashboard_address": "127.0.0.1:0",  # without bokeh there is no page
        "memory_limit": 0,  # a unit's memory is bounded by its size, and a limit would kill it
        "silence_logs": logging.CRITICAL,
    }
    given = dask.config.get(key) | variables()
    # by Dask's default malloc gives memory back at once, which each task asks for again: four times
    # the page faults
    given.pop("MALLOC_TRIM_THRESHOLD_", None)
    with dask.config.set({key: given, **_SETTINGS}):
        for number in range(_STARTS):
            try:
                return distributed.LocalCluster(**options)
            except RuntimeError as error:  # a worker died while it started
                if number == _STARTS - 1:
                    raise RuntimeError(_DEAD) from error
    raise AssertionError("one of them returned or raised")
