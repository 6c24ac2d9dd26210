"""Who makes the units of a job: this process, worker processes, or the workers of an engine that is
there already.
"""

from srt_jax.scale.crews.crew import Crew, Here
from srt_jax.scale.job import Job

ENGINES = ("dask", "ray")


def choose(
    job: Job, num_units: int, *, workers: int | None, engine: str | None, address: str | None
) -> Crew:
    """Returns the crew for `num_units` units: no more workers than that.

    Raises:
      ValueError: no such engine, or what does not go together. ImportError: it is not installed.
    """
    if workers is not None and workers < 1:
        raise ValueError(f"workers must be at least 1, got {workers}")
    if engine is None and address is not None:
        raise ValueError(f"--address {address} is of an engine: name it by --engine dask or ray")
    if engine is None:
        if workers is None:
            return Here(job)
        from srt_jax.scale.crews.pool import Pool

        return Pool(job, min(workers, num_units))
    if engine not in ENGINES:
        raise ValueError(f"--engine must be one of {', '.join(ENGINES)}, got {engine!r}")
    if address is not None and workers is not None:
        raise ValueError(
            "--workers and --address do not go together: a cluster has the workers that it has"
        )
    if engine == "dask":
        from srt_jax.scale.crews.dask_cluster import DaskCluster

        return DaskCluster(job, workers, address)
    from srt_jax.scale.crews.ray_cluster import RayCluster

    return RayCluster(job, workers, address)
