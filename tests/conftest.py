"""Strict switches for the whole suite, and where the outside data lies."""

import os
import pathlib

import jax
import pytest

jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

# What one test file compiles, another need not: the suite's time is mostly compiling.
jax.config.update(
    "jax_compilation_cache_dir",
    str(pathlib.Path(__file__).resolve().parents[1] / ".pytest_cache" / "xla"),
)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 1.0)

SHARED_DATA = pathlib.Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> pathlib.Path:
    """The folder of outside ground truth; the test is skipped where it is absent."""
    folder = pathlib.Path(os.environ.get("SRT_SHARED_DATA", SHARED_DATA))
    if not folder.is_dir():
        pytest.skip("the outside ground truth (shared/data) is not on this machine")
    return folder
