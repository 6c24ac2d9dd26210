"""Answers of NumPy (`srt_jax.uncompiled`): the bits of the compiled kernels, in every mode, and
nothing compiled. What adds floats, as fields by costs of cells do, is compiled as ever.
"""

import jax
import numpy as np
import pytest

import srt_jax
from sign_model.foundation import kept_programs
from sign_model.foundation.uncompiled import first_answers
from srt_jax import solver
from srt_jax.engine import eager
from srt_jax.engine.reuse import Shapes
from srt_jax.instances.generate import generate
from srt_jax.tolls import field

PATIENT = 60.0


@pytest.fixture(autouse=True)
def nothing_kept(monkeypatch):
    """As in a new process without programs on disk."""
    monkeypatch.setenv("SRT_JAX_PROGRAMS", "off")
    monkeypatch.setattr(solver, "_shapes", Shapes())
    forget()
    yield
    forget()


def forget():
    solver._solver.cache_clear()
    eager._jitted.cache_clear()
    field._program.cache_clear()


def the_map(seed, share=0.3, shape=(23, 30)):
    free = np.random.default_rng(seed).random(shape) > share
    free[0, 0] = free[-1, -1] = True
    return free


def same_bits(call, monkeypatch):
    """Returns what `call` gives, without compiling, after holding it against the compiled form."""
    refused = []
    translated = first_answers.translated

    def watched(traced):
        try:
            return translated(traced)
        except Exception as error:
            refused.append(error)
            raise

    monkeypatch.setattr(first_answers, "translated", watched)
    with monkeypatch.context() as only_numpy, srt_jax.uncompiled(PATIENT):
        only_numpy.setattr(kept_programs.KeptProgram, "_load", lambda *_, **__: refused[0])
        ours = call()
    assert not refused
    theirs = call()
    for one, other in zip(jax.tree.leaves(ours), jax.tree.leaves(theirs), strict=True):
        one, other = np.asarray(one), np.asarray(other)
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        assert one.tobytes() == other.tobytes()
    return ours


FIELDS = {
    "reach": lambda free: srt_jax.reach(free, (0, 0)),
    "cost_to_come": lambda free: srt_jax.cost_to_come(free, (0, 0)),
    "path_cost": lambda free: srt_jax.path_cost(free, (0, 0), (22, 29)),
    "shortest_path": lambda free: srt_jax.shortest_path(free, (0, 0), (22, 29)),
    "seed_cell": lambda free: srt_jax.seed_cell(free, (22, 29)),
    "contour": lambda free: srt_jax.contour(free, (0, 0), (22, 29)),
    "trace_path": lambda free: srt_jax.trace_path(
        np.asarray(srt_jax.cost_to_come(free, (0, 0))), (22, 29), max_cells=200
    ),
    "critical_cells": lambda free: srt_jax.critical_cells(free, (0, 0), (22, 29)),
    "toll_to_come": lambda free: srt_jax.toll_to_come(
        np.where(free, -1, 0).astype(np.int32)[None], np.ones(1, np.float32), (0, 0)
    ),
}


@pytest.mark.parametrize("name", FIELDS)
def test_fields_and_paths(name, monkeypatch):
    free = the_map(3)
    same_bits(lambda: FIELDS[name](free), monkeypatch)


def of_costs_of_every_size():
    """A task with removal costs that float32 cannot add, and such as a processor may take for zero;
    four obstacles must go.
    """
    labels = np.full((2, 12, 16), -1, np.int32)
    for obstacle, col in enumerate((3, 6, 9, 12)):
        labels[0, :, col] = obstacle
    labels[1, 4:, 6] = 4
    costs = np.array([3e38, 1e-4, 1e-40, 16777216, 1], np.float32)
    return srt_jax.make_task(labels, (0, 0), (11, 15), removal_cost=costs)


@pytest.mark.parametrize(
    "mode",
    ["least", "shortest", "paper", pytest.param("literal", marks=pytest.mark.slow)],
)
def test_answers_in_every_mode(mode, monkeypatch):
    made = generate("mixed", count=6, size=24, seed=7)
    tasks = srt_jax.stack([*(task for _, task, _ in made), of_costs_of_every_size()])
    found = same_bits(lambda: srt_jax.solve(tasks, mode=mode, toll=5.0), monkeypatch)
    assert (np.asarray(found.num_destroyed[:-1]) > 0).any()
    assert mode == "shortest" or int(found.num_destroyed[-1]) == 4
