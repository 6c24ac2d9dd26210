"""Few tasks are answered without compiling, many are not; what is asked for again is compiled, and
says the same.
"""

import json

import pytest

import srt_jax
from sign_model.foundation.uncompiled.first_answers import patience, uncompiled
from srt_jax import cli, solver
from srt_jax.commands.shared.few_tasks import at_once
from srt_jax.engine.reuse import Shapes
from srt_jax.formats.batch import write_batch
from srt_jax.instances.generate import generate
from srt_jax.task import NamedTask


def tasks(count, size):
    made = generate("rooms", count=count, size=size, seed=3)
    return [NamedTask(name, task) for name, task, _ in made]


@pytest.mark.parametrize(
    ("count", "size", "is_at_once"),
    [(1, 64, True), (6, 32, True), (40, 24, False), (2, 400, False)],
)
def test_which_are_few(count, size, is_at_once):
    with uncompiled(0), at_once(tasks(count, size)):  # as where nobody asked for it
        assert (patience() > 0) == is_at_once


def test_a_command_compiles_nothing_until_it_is_asked_again(tmp_path, monkeypatch, capsys):
    place = tmp_path / "programs"
    monkeypatch.setenv("SRT_JAX_PROGRAMS", str(place))
    file = str(tmp_path / "tasks.npz")
    write_batch(file, srt_jax.stack([task for _, task in tasks(1, 24)]))
    said = []
    for _ in range(3):
        solver._solver.cache_clear()  # as in a new process
        monkeypatch.setattr(solver, "_shapes", Shapes())
        assert cli.run(["solve", file, "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        answer.pop("seconds", None)
        said.append((answer, sorted(path.suffix for path in place.iterdir())))
    answers, kept = zip(*said)
    assert answers[0] == answers[1] == answers[2]
    assert ".program" not in kept[0] and ".program" in kept[1] and kept[1] == kept[2]
    assert srt_jax.Status[answers[0]["tasks"][0]["status"]] == srt_jax.Status.SOLVED
