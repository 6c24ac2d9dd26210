"""The workers of Ray Core: of a cluster that is there, or of one on this machine.

Ray calls a unit again where its worker has died. Ray's usage statistics are switched off.
"""

import contextlib
import logging
import os
import signal
import time
from typing import Any

from sign_model.foundation.core_count import num_cores
from srt_jax.formats.shared.whole_files import require_module
from srt_jax.scale.claims import claims_of
from srt_jax.scale.crews.crew import Cluster, Failed
from srt_jax.scale.crews.environment import in_environment, variables
from srt_jax.scale.job import Job, Outcome, attempt

_PER_WORKER = 2
_MOST_DEATHS = 5
_LOOK, _IDLE = 1, 120
"""Seconds between two looks whether somebody is at work, and without before Ray is started anew;
the start of a worker takes some ten.
"""
_RESTARTS = 5
_SYSTEM = {
    # else ray.init waits for as many workers as there are cores, and for ever where one of them
    # dies before it has registered (ray#40131)
    "prestart_worker_first_driver": False,
    # so long Ray waits for a worker that died before that; then it starts another
    "worker_register_timeout_seconds": 30,
}
"""Settings of a Ray of this machine."""


class RayCluster(Cluster):
    """`workers` processes of this machine, one for each core by default; or those at `address`."""

    def __init__(self, job: Job, workers: int | None, address: str | None) -> None:
        super().__init__(job)
        os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
        self._ray = require_module("ray", extra="ray", what="--engine ray")
        self._workers, self._address = workers or num_cores(), address
        self._connect()

    def _connect(self) -> None:
        _start(self._ray, self._workers, self._address)
        self._attempt = self._ray.remote(num_cpus=1, max_retries=_MOST_DEATHS - 1)(attempt)
        self._most = _PER_WORKER * max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        self._idle_since = time.monotonic()

    def has_room(self) -> bool:
        return self.num_busy < self._most

    def submit(self, unit: int) -> None:
        self._units[self._attempt.remote(self.job, unit)] = unit
        self.num_busy += 1

    def next(self) -> Outcome | Failed:
        while True:
            found, _ = self._ray.wait(list(self._units), num_returns=1, timeout=_LOOK)
            if found:
                break
            self._replace_idle()
        (ready,) = found
        unit = self._units.pop(ready)
        self.num_busy -= 1
        self._idle_since = time.monotonic()
        try:
            outcome = self._ray.get(ready)
            self._restarts = 0
            return outcome
        except (ValueError, ImportError) as error:
            cause = getattr(error, "cause", error)  # without Ray's own text around it
            return Failed(unit, cause)
        except self._ray.exceptions.WorkerCrashedError as error:
            raise RuntimeError(
                f"{_MOST_DEATHS} workers died at {self.job.name(unit)}; where memory runs short,"
                " use fewer workers or smaller shards"
            ) from error

    def _replace_idle(self) -> None:
        """Starts Ray of this machine anew where nobody has been at work for some time: if workers
        die before they register, it can happen that no others are started.
        """
        claims = claims_of(self.job.folder)
        is_at_work = any(not claims.is_dead(who) for who in claims.holders().values())
        if is_at_work or self._address is not None:
            self._idle_since = time.monotonic()
        if time.monotonic() - self._idle_since < _IDLE:
            return
        self._start_anew(
            _RESTARTS,
            "the workers of Ray die before they do anything; where memory runs short, use fewer",
        )

    def close(self) -> None:
        self._units = {}
        with contextlib.suppress(Exception):
            self._ray.shutdown()
        self.num_busy = 0


def _start(ray: Any, workers: int, address: str | None) -> None:
    """Connects to a cluster, or starts one of this machine."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    options: dict[str, Any] = {
        "include_dashboard": False,
        "log_to_driver": False,
        "logging_level": logging.ERROR,
    }
    try:
        if address is None:
            # as a runtime environment each worker would wait for the agent that prepares it
            # "local": by default Ray looks for a cluster that `ray start` has started here
            with in_environment(variables()):
                ray.init("local", num_cpus=workers, _system_config=_SYSTEM, **options)
        else:
            ray.init(address=address, **options | {"include_dashboard": None})
    except (ConnectionError, ValueError) as error:
        if address is None:
            raise
        raise ValueError(
            f"--address {address}: no cluster of Ray answers there: start one by ray start --head"
        ) from error
    for number, handler in handlers.items():  # Ray sets its own, which end the process
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(number, handler)
