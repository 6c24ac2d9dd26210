import os

import jax
import numpy as np
import pytest

import srt_jax
from srt_jax.bench import envs, kernels, measured_maps, peers, scaling
from srt_jax.bench.machine import machine
from srt_jax.propagation.lengths import UNREACHED, cost_field


@pytest.mark.parametrize("kind", measured_maps.KINDS)
def test_every_kind_of_map_has_a_start_in_its_largest_part(kind, monkeypatch, tmp_path):
    monkeypatch.setenv("SRT_SHARED_DATA", str(tmp_path))
    free, starts = measured_maps.maps_of(kind, 64, 2)
    assert free.shape == (2, 64, 64) and free.dtype == bool and starts.shape == (2, 2)
    for reached, one in zip(np.asarray(srt_jax.reach(free, starts)), free):
        assert reached.sum() > 0.3 * one.sum()


def test_the_native_peers_answer_what_we_answer(monkeypatch, tmp_path):
    monkeypatch.setenv("SRT_SHARED_DATA", str(tmp_path))
    free, starts = measured_maps.maps_of("rooms", 64, 2)
    for name, run in peers.floods(free, starts).items():
        assert np.array_equal(run(), srt_jax.reach(free, starts)), name
    goals = np.stack([np.argwhere(one)[-1] for one in np.asarray(srt_jax.reach(free, starts))])
    for name, run in peers.routes(free, starts, goals.astype(np.int32)).items():
        lengths = srt_jax.shortest_path(free, starts, goals.astype(np.int32)).cost
        np.testing.assert_allclose(run(), lengths, rtol=1e-5, err_msg=name)
    for name, run in peers.cuts(free, starts, goals.astype(np.int32)).items():
        cells = srt_jax.critical_cells(free, starts, goals.astype(np.int32))
        assert np.array_equal(run(), cells) and cells.sum() > 2 * len(free), name
    owners, toll = kernels._tolled(free)
    for name, run in peers.tolled(owners, toll, starts).items():
        sums = np.asarray(srt_jax.toll_to_come(owners[:, None], toll, starts), float) * 5741
        assert np.array_equal(run(), np.round(sums)), name
    native = peers.bucket_dijkstra()
    if native is None:
        pytest.skip("there is no C++ compiler")
    assert peers.cuts(free, starts, goals) and peers.tolled(owners, toll, starts)
    assert np.array_equal(native(free, starts), jax.jit(cost_field)(free, starts).cost)
    assert UNREACHED == 2**31 - 1


def test_the_table_leads_with_the_ratio_and_names_missing_peers():
    row = {
        "kernel": "reach",
        "kind": "street",
        "size": 512,
        "batch": 4,
        "ms": 0.1,
        "quartiles": [0.1, 0.2],
    }
    rows = [{**row, "peers": {"cc3d": 0.4}, "ratio": 4.0}, {**row, "peers": {}, "ratio": None}]
    text = kernels.table({"machine": machine(), "fast_form": 5.0, "rows": rows})
    assert (
        "yes (5.0x the plain form)" in text
        and "cc3d 0.400 (4.0x)" in text
        and "none installed" in text
    )


@pytest.mark.slow
def test_scaling_is_measured_for_every_kernel(monkeypatch, tmp_path):
    monkeypatch.setenv("SRT_SHARED_DATA", str(tmp_path))
    monkeypatch.setattr(scaling, "SMALL", 16)
    monkeypatch.setattr(scaling, "BATCHES", (2, 4, 8))
    before = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
    rows = scaling._measure(quick=True)
    assert [row["kernel"] for row in rows] == [
        "reach",
        "cost_to_come",
        "seed_cell",
        "contour",
        "trace_path",
    ]
    for row in rows:
        assert (
            list(row["batch_ms"]) == list(row["small_ms"]) == ["2", "4", "8"]
            and row["flatness"] >= 1
        )
        assert min(*row["batch_ms"].values(), *row["small_ms"].values(), *row["cores_ms"]) > 0
    reach, cost = rows[:2]
    assert (reach["memory"]["result"], cost["memory"]["result"]) == (1.0, 4.0)
    assert before is None or os.sched_getaffinity(0) == before
    assert all(row["kernel"] in scaling.table(rows) for row in rows)


def test_the_table_of_environments_compares_best_runs_of_what_does_as_much_and_tells_their_spread():
    facts = {
        "cpu": "a",
        "cores": 2,
        "load": None,
        "system": "b",
        "python": "3",
        "packages": {},
        "device": "cpu",
    }
    spread = {"median": 9.0, "low": 8.0, "high": 10.0, "count": 5}
    rows = [
        {"name": name, "steps_per_second": rate, "spread": spread}
        for name, rate in (("ours", 10.0), ("navix Empty", 5.0))
    ]
    text = envs.table(
        {
            "machine": facts,
            "rows": [*rows, {"name": "jumanji Maze", "missing": "no module named jumanji"}],
        }
    )
    assert "2.00  9 (8-10)" in text and "no module named jumanji" in text
