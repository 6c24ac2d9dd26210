"""Strict switches for the whole suite, and where the outside data lies."""

import contextlib
import os
import pathlib
from collections.abc import Iterator, Sequence

import jax
import pytest

from sign_model.foundation import kept_programs
from sign_model.foundation.uncompiled.first_answers import uncompiled

jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

# What one test file compiles, another need not, nor a program that a test starts: the suite's time
# is mostly compiling.
KEPT = pathlib.Path(__file__).resolve().parents[1] / ".pytest_cache" / "xla"
SHORTEST_KEPT = 0.5  # seconds of compiling
jax.config.update("jax_compilation_cache_dir", str(KEPT))
jax.config.update("jax_persistent_cache_min_compile_time_secs", SHORTEST_KEPT)
os.environ["JAX_COMPILATION_CACHE_DIR"] = str(KEPT)
os.environ["SRT_JAX_PROGRAMS"] = str(KEPT.with_name("programs"))
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = str(SHORTEST_KEPT)

QUICK = (
    "docs/test_site.py",
    "engine/test_packing.py",
    "formats",
    "geometry",
    "instances",
    "sign_model/pddl",
    "sign_model/space",
    "sign_model/test_description.py",
    "sign_model/test_face.py",
    "test_architecture.py",
    "test_components.py",
    "test_moves.py",
    "test_task.py",
)
"""Folders and files of the tests that `-m quick` selects: little to compile, no long search."""

UNCOMPILED = (
    "answers",
    "commands",
    "docs",
    "draw",
    "robots",
)
"""Folders and files of the tests that need answers and do not judge the code that gives them: most
of their answers NumPy gives sooner than they could be compiled.
"""

OPTIMISED = (
    "removal",
    "sign_model/foundation",
    "test_solver.py",
    "test_solver_batches.py",
    "test_transformations.py",
    "tolls",
)
"""Folders and files of the tests that judge the solver: there its program for small maps is
compiled again, optimised, as soon as for a user. Both programs give the same bits, and the second
takes three times as long to compile as the first: other tests wait for it until it would pay.
"""
SECONDS_BEFORE_OPTIMISING = 5.0

SHARED_DATA = pathlib.Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> pathlib.Path:
    """The folder of outside ground truth; the test is skipped where it is absent."""
    folder = pathlib.Path(os.environ.get("SRT_SHARED_DATA", SHARED_DATA))
    if not folder.is_dir():
        pytest.skip("the outside ground truth (shared/data) is not on this machine")
    return folder


def is_in(path: pathlib.Path, places: Sequence[str]) -> bool:
    """Returns whether a test's file is, or is in, one of some files and folders of the tests."""
    folder = pathlib.Path(__file__).resolve().parent
    return any(folder / place in (path, *path.parents) for place in places)


@pytest.fixture(autouse=True)
def compiled_or_not(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """Has calls of the tests in UNCOMPILED answered without compiling where that is short, and
    programs optimised early in those in OPTIMISED alone.
    """
    if not is_in(request.path, OPTIMISED):
        monkeypatch.setattr(kept_programs, "PATIENCE", SECONDS_BEFORE_OPTIMISING)
    is_uncompiled = is_in(request.path, UNCOMPILED)
    with uncompiled(1.0) if is_uncompiled else contextlib.nullcontext():
        yield


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Marks the tests of QUICK, but for those that are slow."""
    for item in items:
        if is_in(item.path, QUICK) and not item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.quick)
