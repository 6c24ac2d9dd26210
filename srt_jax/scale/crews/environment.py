"""The environment of workers, set before they import JAX: one core each."""

import contextlib
import os
import sys
from collections.abc import Iterator


def variables() -> dict[str, str]:
    """Returns what is added to the environment of a worker on this machine."""
    path = os.pathsep.join(place or os.getcwd() for place in sys.path)
    given = {"SRT_JAX_CORES": "1", "PYTHONPATH": path}
    # glibc would keep what is freed apart for each thread, half of a worker's memory in the end
    if "MALLOC_ARENA_MAX" not in os.environ:
        given["MALLOC_ARENA_MAX"] = "2"
    # several processes on one accelerator: none may take all of its memory
    if "XLA_PYTHON_CLIENT_PREALLOCATE" not in os.environ:
        given["XLA_PYTHON_CLIENT_PREALLOCATE"] = "false"
    # set by the command line where JAX was imported before it
    jax = sys.modules.get("jax")
    cache = getattr(getattr(jax, "config", None), "jax_compilation_cache_dir", None)
    if cache and "JAX_COMPILATION_CACHE_DIR" not in os.environ:
        given["JAX_COMPILATION_CACHE_DIR"] = str(cache)
    return given


@contextlib.contextmanager
def in_environment(given: dict[str, str]) -> Iterator[None]:
    """Sets variables of this process for the time being, for what is started meanwhile."""
    before = {name: os.environ.get(name) for name in given}
    os.environ.update(given)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
