"""The workers of Ray Core: of a cluster that is there, or of one on this machine.

Ray calls a unit again where its worker has died. Ray's usage statistics are switched off.
"""

import contextlib
import logging
import os
import signal
from typing import Any

from sign_model.ground.cores import num_cores
from srt_jax.formats.files import require_module
from srt_jax.scale.crews.crew import Crew, Failed
from srt_jax.scale.crews.environment import variables
from srt_jax.scale.job import Job, Outcome, attempt

_PER_WORKER = 2
_MOST_DEATHS = 5


class RayCluster(Crew):
    """`workers` processes of this machine, one for each core by default; or those at `address`."""

    def __init__(self, job: Job, workers: int | None, address: str | None) -> None:
        super().__init__(job)
        os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
        self._ray = require_module("ray", extra="ray", what="--engine ray")
        _start(self._ray, workers or num_cores(), address)
        self._attempt = self._ray.remote(num_cpus=1, max_retries=_MOST_DEATHS - 1)(attempt)
        self._most = _PER_WORKER * max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        self._units: dict[Any, int] = {}

    def has_room(self) -> bool:
        return self.num_busy < self._most

    def submit(self, unit: int) -> None:
        self._units[self._attempt.remote(self.job, unit)] = unit
        self.num_busy += 1

    def next(self) -> Outcome | Failed:
        (ready, *_), _ = self._ray.wait(list(self._units), num_returns=1)
        unit = self._units.pop(ready)
        self.num_busy -= 1
        try:
            return self._ray.get(ready)
        except (ValueError, ImportError) as error:
            cause = getattr(error, "cause", error)  # without Ray's own text around it
            return Failed(unit, cause)
        except self._ray.exceptions.WorkerCrashedError as error:
            raise RuntimeError(
                f"{_MOST_DEATHS} workers died at {self.job.name(unit)}; where memory runs short,"
                " use fewer workers or smaller shards"
            ) from error

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
            ray.init(num_cpus=workers, runtime_env={"env_vars": variables()}, **options)
        else:
            ray.init(address=address, **options | {"include_dashboard": None})
    except (ConnectionError, ValueError) as error:
        raise ValueError(
            f"--address {address}: no cluster of Ray answers there: start one by ray start --head"
        ) from error
    for number, handler in handlers.items():  # Ray sets its own, which end the process
        with contextlib.suppress(ValueError):  # not the main thread
            signal.signal(number, handler)
