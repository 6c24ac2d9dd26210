"""Data sets: labels against a slow twin, the same bytes whoever was interrupted, and the loader's
batches.
"""

import json

import numpy as np
import pytest

from srt_jax import Status, dataset, make_task
from srt_jax.cli import run
from srt_jax.dataset.labels import label_tasks
from srt_jax.instances.generate import generate
from srt_jax.reference.dijkstra import dijkstra
from srt_jax.reference.tolls import brute_force_total

PLAN = {"kind": "mixed", "count": 22, "size": (16, 20), "seed": 5, "shard_size": 8}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "mixed"
    dataset.write_dataset(out, **PLAN)
    return out


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_labels_are_what_dijkstra_says_on_the_map_without_the_least_removal():
    tasks = [task for _, task, _ in generate("mixed", count=14, size=(16, 20), seed=5)]
    labels = label_tasks(tasks)
    assert {Status.SOLVED, Status.PATH_EXISTS, Status.UNSOLVABLE} <= set(labels.status.tolist())
    for index, task in enumerate(tasks):
        height, width = task.size
        gone = labels.least_removal[index][: len(task.destroyable)]
        assert not (gone & ~task.destroyable).any()
        is_free = np.append(gone, [False, True])[task.labels].all(axis=0)
        mine = {
            name: getattr(labels, name)[index][:height, :width]
            for name in ("cost_to_go", "correction", "focal")
        }
        if not np.isfinite(labels.length[index]):
            assert (
                np.isinf(mine["cost_to_go"]).all()
                and not mine["correction"].any()
                and not mine["focal"].any()
            )
            continue
        to_go, come = dijkstra(is_free, tuple(task.goal)), dijkstra(is_free, tuple(task.start))
        np.testing.assert_allclose(mine["cost_to_go"], to_go, rtol=1e-5)
        assert to_go[tuple(task.start)] == pytest.approx(labels.length[index], rel=1e-5)
        assert labels.least_cost[index] == pytest.approx(task.removal_cost[gone].sum())
        apart = abs(np.indices(is_free.shape) - task.goal[:, None, None])
        octile = apart.max(axis=0) + (2**0.5 - 1) * apart.min(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            wanted = np.where(to_go == 0, 1, octile / to_go)
            focal = np.where(come + to_go == 0, 1, labels.length[index] / (come + to_go))
        np.testing.assert_allclose(mine["correction"], wanted, rtol=1e-5)
        np.testing.assert_allclose(mine["focal"], focal, rtol=1e-5)
        assert labels.first_blocker[index].any() == (labels.status[index] == Status.SOLVED)


@pytest.mark.slow  # two more programs of `solve`
def test_in_mode_shortest_they_say_whether_to_break(tmp_path):
    tasks = [task for _, task, _ in generate("mixed", count=14, size=(16, 20), seed=5)]
    labels, least = label_tasks(tasks, mode="shortest", toll=6.0), label_tasks(tasks)
    assert labels.breaks.any() and not labels.breaks.all()
    assert (labels.total == labels.total_bound).all()
    for index, task in enumerate(tasks):
        start, goal = (tuple(end.tolist()) for end in (task.start, task.goal))
        if task.destroyable.sum() <= 6:
            price = task.removal_cost * 6
            best = brute_force_total(task.labels, task.destroyable, price, start, goal)
            assert labels.total[index] == pytest.approx(best.total, abs=1e-2)
        gone = labels.least_removal[index][: len(task.destroyable)]
        assert labels.breaks[index] == gone.any()
        paid = labels.length[index] + 6 * task.removal_cost[gone].sum()
        assert labels.total[index] == pytest.approx(paid, rel=1e-5) or np.isinf(paid)
        to_go = labels.cost_to_go[index][start]
        assert to_go == pytest.approx(labels.length[index], rel=1e-5) or np.isinf(paid)
    assert least.breaks is None and (labels.length <= least.length + 1e-4).all()
    # on disk
    dataset.write_dataset(
        tmp_path, **PLAN | {"count": 14, "shard_size": 14}, mode="shortest", toll=6
    )
    plan = dataset.read_plan(tmp_path)
    assert (plan.mode, plan.toll) == ("shortest", 6.0)
    read = next(dataset.load(tmp_path, batch_size=14))
    for name in ("breaks", "total", "total_bound", "status", "least_cost"):
        np.testing.assert_array_equal(read[name], getattr(labels, name))


def test_the_first_blocker_is_the_obstacle_the_agent_meets_first():
    labels = np.full((5, 9), -1, np.int32)
    labels[:, 3], labels[:, 6] = 0, 1
    labelled = label_tasks([make_task(labels, (2, 0), (2, 8))])
    np.testing.assert_array_equal(labelled.first_blocker[0], labels == 0)
    assert (
        labelled.least_removal[0, :2].all()
        and labelled.least_cost[0] == 2
        and labelled.length[0] == 8
    )


def test_an_interrupted_data_set_is_finished_to_the_same_bytes(folder, tmp_path):
    seen = []

    def stop(count):
        seen.append(count)
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        dataset.write_dataset(tmp_path / "b", **PLAN, progress=stop)
    assert len(contents(tmp_path / "b")) == 3
    # as a killed run leaves them
    for draft in (".shard-000002.npz.77.part", ".shard-000002.arrayrecord.part"):
        (tmp_path / "b" / draft).write_bytes(b"half")
    with pytest.raises(ValueError, match=r"1 of 3 shards are missing.*shard-000002.npz"):
        dataset.load(tmp_path / "b")
    dataset.write_dataset(tmp_path / "b", **PLAN)
    assert contents(tmp_path / "b") == contents(folder)


def test_finished_shards_are_not_made_again(folder, monkeypatch):
    monkeypatch.setattr("srt_jax.dataset.specification.label_stacked", None)
    assert dataset.write_dataset(folder, **PLAN).num_shards() == 3


def test_in_order_the_loader_gives_every_task_once(folder):
    batches = list(dataset.load(folder, batch_size=5))
    assert [len(batch["index"]) for batch in batches] == [5, 5, 5, 5, 2]
    np.testing.assert_array_equal(
        np.concatenate([batch["index"] for batch in batches]), np.arange(22)
    )
    assert len({batch["labels"].shape[1:] for batch in batches}) == 1 and batches[0][
        "labels"
    ].shape[2:] == (20, 20)
    tasks = [task for _, task, _ in generate("mixed", count=22, size=(16, 20), seed=5)]
    labels = np.concatenate([batch["labels"] for batch in batches])
    for row, task in zip(labels, tasks):
        L, H, W = task.labels.shape
        np.testing.assert_array_equal(row[:L, :H, :W], task.labels)
        assert (row[0, H:] == -2).all() and (row[0, :, W:] == -2).all() and (row[L:] == -1).all()


def test_shuffling_goes_by_the_seed_and_differs_by_epoch(folder):
    def order(**options):
        return np.concatenate(
            [
                batch["index"]
                for batch in dataset.load(folder, batch_size=4, fields=("index",), **options)
            ]
        )

    twice = order(seed=1, epochs=2)
    np.testing.assert_array_equal(twice, order(seed=1, epochs=2))
    assert sorted(twice[:22].tolist()) == list(range(22)) and (twice[:22] != twice[22:]).any()
    assert (order(seed=2) != twice[:22]).any()
    assert len(order(seed=1, drop_remainder=True)) == 20
    parts = [order(seed=1, worker=(i, 3)) for i in range(3)]
    assert sorted(np.concatenate(parts).tolist()) == list(range(22))


def test_array_records_hold_the_same(folder, tmp_path):
    pytest.importorskip("array_record")
    dataset.write_dataset(tmp_path / "r", **PLAN, format="arrayrecord")
    for ours, theirs in zip(
        dataset.load(folder, seed=3), dataset.load(tmp_path / "r", seed=3), strict=True
    ):
        assert ours.keys() == theirs.keys()
        for name in ours:
            np.testing.assert_array_equal(ours[name], theirs[name])


def test_what_is_wrong_is_named(folder, tmp_path, capsys):
    with pytest.raises(ValueError, match="holds a data set of seed 5, not 6"):
        dataset.write_dataset(folder, **{**PLAN, "seed": 6})
    with pytest.raises(ValueError, match="no such file"):
        dataset.load(tmp_path)
    with pytest.raises(ValueError, match="no field is called 'heat'"):
        dataset.load(folder, fields=("heat",))
    with pytest.raises(ValueError, match="0 <= i < n <= 3 shards"):
        dataset.load(folder, worker=(0, 4))
    (tmp_path / "dataset.json").write_text("{")
    with pytest.raises(ValueError, match="is damaged"):
        dataset.load(tmp_path)
    assert run(["dataset", "towers", "--out", str(tmp_path / "x")]) == 2
    assert "unknown kind 'towers'" in capsys.readouterr().err and not (tmp_path / "x").exists()


def test_a_damaged_shard_is_named(folder, tmp_path):
    for name, content in contents(folder).items():
        (tmp_path / name).write_bytes(content[: 2000 if name.endswith("1.npz") else None])
    with pytest.raises(ValueError, match=r"shard-000001.npz: the shard is damaged"):
        dataset.load(tmp_path)


def test_the_command_writes_a_data_set(tmp_path, capsys):
    out = tmp_path / "rooms"
    assert (
        run(
            [
                "dataset",
                "mixed",
                "--count",
                "8",
                "--size",
                "16-20",
                "--seed",
                "5",
                "--out",
                str(out),
                "--json",
            ]
        )
        == 0
    )
    assert json.loads(capsys.readouterr().out) == {"folder": str(out), "tasks": 8, "shards": 1}
    assert next(dataset.load(out, batch_size=8))["cost_to_go"].shape == (8, 20, 20)
