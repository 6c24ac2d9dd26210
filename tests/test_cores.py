import threading

import jax
import numpy as np
import pytest
from maps import random_maps

import srt_jax
from srt_jax import bucketed, cores


@pytest.fixture
def in_small_parts(monkeypatch):
    """Batches of small maps are cut as large ones are."""
    for name in ("_LARGEST", "_LARGEST_LIGHT", "_SMALLEST_LIGHT"):
        monkeypatch.setattr(cores, name, 1 << 16)
    monkeypatch.setattr(cores, "num_cores", lambda: 3)
    monkeypatch.setattr(bucketed, "_FOR_QUADS", 0)


def test_a_batch_in_parts_gives_the_bits_of_each_map_alone(in_small_parts):
    free, starts, _ = random_maps(5, 37, 60, 50)
    goals = np.random.default_rng(2).integers(0, 50, (37, 2)).astype(np.int32)
    assert cores.part_size(64, 64 * 64) == 16
    for run in (
        lambda free, start, goal: srt_jax.reach(free, start),
        lambda free, start, goal: srt_jax.cost_to_come(free, start),
        lambda free, start, goal: srt_jax.contour(free, start, goal),
        lambda free, start, goal: srt_jax.seed_cell(free, goal),
        lambda free, start, goal: srt_jax.trace_path(srt_jax.cost_to_come(free, start), goal, max_cells=300).cells,
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
    monkeypatch.setattr(cores, "num_cores", lambda: 1)
    assert [cores.part_size(batch, 512 * 512) for batch in (1, 16, 64)] == [1, 16, 16]
    assert cores.part_size(4096, 64 * 64) == 1024
    monkeypatch.setattr(cores, "num_cores", lambda: 2)
    assert [cores.part_size(batch, 512 * 512) for batch in (1, 2, 16, 64)] == [1, 1, 8, 16]
    assert cores.part_size(16, 64 * 64) == 16
    assert cores.part_size(1, 4096 * 4096) == 1


def test_a_flood_is_cut_finer_than_a_field_of_costs_but_only_where_there_is_much_of_it(monkeypatch):
    for count in (1, 2):
        monkeypatch.setattr(cores, "num_cores", lambda count=count: count)
        assert [cores.part_size(batch, 512 * 512, is_light=True) for batch in (1, 16, 64, 256)] == [1, 16, 8, 8]
        assert cores.part_size(4096, 64 * 64, is_light=True) == 512


def test_the_environment_may_ask_for_fewer_cores(monkeypatch):
    monkeypatch.setenv("SRT_JAX_CORES", "1")
    assert cores.num_cores() == 1
    monkeypatch.setenv("SRT_JAX_CORES", "many")
    assert cores.num_cores() >= 1
