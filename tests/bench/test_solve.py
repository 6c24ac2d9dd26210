"""What `bench solve` measures against gives right answers, and its tables tell what was found. No
time is judged here.
"""

import numpy as np
import pytest

from srt_jax.bench import learning, machine, peers, solve
from srt_jax.bench.native import compiled
from srt_jax.bench.paper_pipeline import paper_pipeline
from srt_jax.bench.pipelines import pipelines
from srt_jax.instances import maps
from srt_jax.instances.paper_blockers import block, pick_start_goal
from srt_jax.reference.astar import astar
from srt_jax.reference.jump_point_search import jps
from srt_jax.reference.wall_following import follow_wall
from tests.helpers.cut_off_maps import random_maps


@pytest.fixture(scope="module")
def native():
    found = paper_pipeline()
    if found is None:
        pytest.skip("no g++ on this machine")
    return found


def test_the_cpp_pipeline_is_the_reference_cell_by_cell(native):
    num_cut_off = 0
    for free, start, goal in random_maps(1500, seed=8):
        if not free[goal]:
            continue
        explored, jumped = astar(free, start, goal), jps(free, start, goal)
        cost, closed = native.astar(free, start, goal)
        assert (cost, native.jps(free, start, goal)[0]) == pytest.approx((explored.cost,) * 2)
        if explored.cost < np.inf:
            continue
        num_cut_off += 1
        assert (closed == explored.closed).all() and native.jps(free, start, goal)[
            1
        ] == jumped.num_expansions
        seed = native.seed(closed, goal)
        contour = np.zeros_like(free)
        for cell in follow_wall(free, seed, goal):
            contour[cell] = True
        assert (native.contour(free, seed, goal) == contour).all()
    assert num_cut_off > 100


def test_all_pipelines_find_the_same_seed_contour_and_length(native):
    case = ([], [], [])
    for number in range(3):
        labels = maps.city_buildings(60, 70, seed=number)
        start, goal = pick_start_goal(labels < 0, apart=40, seed=number)
        blocked, _ = block(labels, start, goal, "bagel-10")
        for place, item in zip(case, ((blocked < 0).all(axis=0), labels < 0, (start, goal))):
            place.append(item)
    works = pipelines(*case)
    ours = works["PY16 in C++"]()
    for name in ("SciPy", "OpenCV"):
        if works[name] is None:
            continue
        for (seed, contour, length), other in zip(ours, works[name]()):
            assert other[0] == seed and (other[1] == contour).all()
            assert name == "OpenCV" or other[2] == pytest.approx(length, rel=1e-6)
    if works["scikit-image"] is not None:
        for (_, _, length), (is_joined, shorter) in zip(ours, works["scikit-image"]()):
            assert not is_joined and shorter <= length + 1e-6  # it cuts corners


def test_maps_that_are_not_bool_or_not_contiguous_are_refused(native):
    for wrong in (np.ones((4, 4), np.uint8), np.ones((4, 8), bool)[:, ::2]):
        with pytest.raises(ValueError, match="contiguous bool"):
            native.jps(wrong, (0, 0), (3, 3))


@pytest.mark.slow
def test_solve_is_measured_beside_them_and_agrees():
    case = solve._case(
        "bagel-10", np.stack([maps.city(64, 64, seed=seed) for seed in (1, 2)]), "ring"
    )
    row = solve._one_core(case, 1)
    row["two_threads"] = row["one_core"]
    assert row["agrees"] is (True if paper_pipeline() else None)
    assert (
        set(row["peers"]) == {"PY16 in C++", "SciPy", "scikit-image", "OpenCV"}
        and row["one_core"]["count"] == 1
    )
    absent = row | {"peers": row["peers"] | {"SciPy": {"ms": None, "gives": ""}}, "size": 512}
    result = {
        "machine": machine.machine("scipy"),
        "authors_ms": solve.AUTHORS_MS,
        "rows": [absent],
    }
    text = solve.table(result)
    assert (
        "SciPy: not installed" in text
        and "the authors' C++ planner, 240 ms" in text
        and "(bar" not in text
    )


def test_a_missing_compiler_is_no_error(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    for cached in (compiled, paper_pipeline):
        cached.cache_clear()
    assert paper_pipeline() is None and peers.bucket_dijkstra() is None
    for cached in (compiled, paper_pipeline):
        cached.cache_clear()


def test_medians_come_with_quartiles_and_machines_with_versions():
    assert machine.spread([4.0, 1.0, 2.0, 3.0, 5.0]) == {
        "median": 3.0,
        "low": 2.0,
        "high": 4.0,
        "count": 5,
    }
    assert np.isnan(machine.spread([])["median"])
    facts = machine.machine("numpy", "no-such-package")
    assert facts["packages"][
        "no-such-package"
    ] is None and "no-such-package" not in machine.machine_line(facts)
    assert f"numpy {np.__version__}" in machine.machine_line(facts)


def test_the_table_of_learning_names_what_is_absent():
    rate = machine.spread([10.0, 20.0])
    rows = [{"what": "labels", "batch": 4, "size": 8, "per_second": {"batch": rate, "SciPy": None}}]
    signs = [
        {
            "sign": "learned",
            "tasks": 2,
            "blocks": 8,
            "solved": 1.0,
            "mean_length": 12.0,
            "seconds": 3.0,
        }
    ]
    text = learning.table({"machine": machine.machine(), "rows": rows, "signs": signs})
    assert "SciPy          not installed" in text and "learned in 3.0 s" in text
