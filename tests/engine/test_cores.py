import threading

import jax
import numpy as np
import pytest

import srt_jax
from sign_model.map_batch import ladder
from srt_jax.engine import cores, eager
from tests.helpers.maps import random_maps


@pytest.fixture
def in_small_parts(monkeypatch):
    """Batches of small maps are cut as large ones are."""
    for name in ("FIELD", "LIGHT"):
        monkeypatch.setattr(cores, name, cores.Work(1 << 16, 1 << 15))
    monkeypatch.setattr(cores, "num_cores", lambda: 3)
    monkeypatch.setattr(eager, "_FOR_QUADS", 0)


def test_a_batch_in_parts_gives_the_bits_of_each_map_alone(in_small_parts):
    free, starts, _ = random_maps(5, 37, 60, 50)
    goals = np.random.default_rng(2).integers(0, 50, (37, 2)).astype(np.int32)
    assert (
        cores.part_size(64, 64 * 64, cores.FIELD) == cores.part_size(64, 64 * 64, cores.LIGHT) == 16
    )
    for run in (
        lambda free, start, goal: srt_jax.reach(free, start),
        lambda free, start, goal: srt_jax.cost_to_come(free, start),
        lambda free, start, goal: srt_jax.contour(free, start, goal),
        lambda free, start, goal: srt_jax.seed_cell(free, goal),
        lambda free, start, goal: (
            srt_jax.trace_path(srt_jax.cost_to_come(free, start), goal, max_cells=300).cells
        ),
    ):
        expected = np.asarray(jax.jit(run)(free, starts, goals))
        assert np.array_equal(run(free, starts, goals), expected)
        assert np.array_equal(run(*jax.device_put((free, starts, goals))), expected)


def test_the_result_is_an_array_of_jax_that_the_caller_cannot_change(in_small_parts):
    free, starts, _ = random_maps(5, 37, 64, 64)
    reached = srt_jax.reach(free, starts)
    assert isinstance(reached, jax.Array) and reached.shape == (37, 64, 64)
    before = np.array(reached)
    free[:] = False
    assert np.array_equal(reached, before)
    with pytest.raises(ValueError, match="read-only"):
        np.asarray(reached)[0] = True


def test_parts_are_in_work_at_the_same_time_and_each_is_done_once(monkeypatch):
    monkeypatch.setattr(cores, "num_cores", lambda: 2)
    both, done = threading.Barrier(2), []

    def run(part):
        if part.start < 4:
            both.wait(30)  # ends only if another thread comes here too
        done.append(part.start)
        return [np.arange(part.start, part.stop)]

    out = [np.full(11, -1)]
    cores.run_parts(run, 11, 2, out)
    assert sorted(done) == [0, 2, 4, 6, 8, 10] and np.array_equal(out[0], np.arange(11))


def test_an_error_in_one_part_reaches_the_caller(monkeypatch):
    monkeypatch.setattr(cores, "num_cores", lambda: 2)

    def run(part):
        raise ValueError(f"part {part.start}")

    with pytest.raises(ValueError, match="part"):
        cores.run_parts(run, 8, 1, [np.zeros(8)])


def test_a_batch_is_cut_for_the_cores_and_for_memory_but_one_map_never(monkeypatch):
    def sizes(work, cells=512 * 512):
        return [cores.part_size(batch, cells, work) for batch in (1, 2, 16, 64, 256)]

    monkeypatch.setattr(cores, "num_cores", lambda: 1)
    assert sizes(cores.SOLVE) == [1, 2, 16, 32, 32]
    assert sizes(cores.FIELD) == [1, 2, 16, 4, 4]
    assert sizes(cores.LIGHT) == [1, 2, 16, 8, 8]
    monkeypatch.setattr(cores, "num_cores", lambda: 2)
    assert sizes(cores.SOLVE) == [1, 1, 8, 16, 32]
    assert sizes(cores.FIELD) == [1, 1, 4, 4, 4]
    assert sizes(cores.LIGHT) == [1, 2, 16, 8, 8]
    assert [
        cores.part_size(4096, 64 * 64, work) for work in (cores.SOLVE, cores.FIELD, cores.LIGHT)
    ] == [512, 256, 512]
    assert cores.part_size(16, 64 * 64, cores.FIELD) == 16
    assert cores.part_size(1, 4096 * 4096, cores.FIELD) == 1


def test_the_environment_may_limit_the_number_of_cores(monkeypatch):
    monkeypatch.setenv("SRT_JAX_CORES", "1")
    assert cores.num_cores() == ladder.num_cores() == 1
    monkeypatch.setenv("SRT_JAX_CORES", "many")
    assert cores.num_cores() >= 1
