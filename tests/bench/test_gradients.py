"""`srt-jax bench gradients` on a small map, and its table."""

import numpy as np
import pytest

import srt_jax
from srt_jax.bench import gradients


def test_scipys_graph_has_the_lengths_that_cost_to_come_gives():
    csgraph = pytest.importorskip("scipy.sparse.csgraph")
    free = np.random.default_rng(3).random((9, 9)) > 0.3
    free[0, 0] = True
    costs = gradients._costs_of("noise", 9)
    lengths = csgraph.dijkstra(gradients._graph(free, costs), directed=False, indices=0)
    ours = np.asarray(srt_jax.cost_to_come(free, np.array([0, 0], np.int32), costs))
    assert np.allclose(lengths.reshape(9, 9)[free], ours[free], rtol=1e-5)


def test_a_row_names_the_map_and_takes_positive_times():
    row = gradients._measure_map("open", "hills", 16, 1)
    assert (row["map"], row["costs"], row["size"]) == ("open", "hills", 16)
    assert row["forward_ms"] > 0


def test_the_table_shows_ratios_and_leaves_a_missing_peer_blank():
    facts = {"cpu": "a", "cores": 2, "load": None, "system": "b", "python": "3", "packages": {}}
    row = {"map": "open", "costs": "hills", "size": 16, "forward_ms": 2.0, "backward_ms": 1.0}
    rows = [row | {"scipy_ms": 4.0}, row | {"scipy_ms": None}]
    memory = {"snake": 10, "open map": 10}
    text = gradients.table({"machine": facts, "rows": rows, "temporary_bytes": memory})
    measured, without = text.splitlines()[2:4]
    assert measured.split()[-2:] == ["2.00", "0.50"]
    assert without.split()[-2:] == ["-", "0.50"]
