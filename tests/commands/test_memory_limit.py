"""Memory of long runs: few arenas of glibc, here and in workers, unless the user says."""

from types import SimpleNamespace

import pytest

from srt_jax.commands.shared import memory_limit
from srt_jax.scale.crews.environment import variables


@pytest.mark.parametrize("has_glibc", [True, False])
def test_glibc_is_asked_for_two_arenas_and_others_for_nothing(monkeypatch, has_glibc):
    asked = []
    library = SimpleNamespace(mallopt=lambda *values: asked.append(values))
    library = library if has_glibc else SimpleNamespace()
    monkeypatch.setattr("ctypes.CDLL", lambda name: library)
    memory_limit.keep_together()
    assert asked == [(-8, 2)] * has_glibc


def test_workers_get_the_same_unless_the_user_chose(monkeypatch):
    monkeypatch.delenv("MALLOC_ARENA_MAX", raising=False)
    assert variables()["MALLOC_ARENA_MAX"] == "2"
    monkeypatch.setenv("MALLOC_ARENA_MAX", "8")
    assert "MALLOC_ARENA_MAX" not in variables()
