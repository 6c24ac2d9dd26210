"""The tasks of a file one by one are those that are read at once, and share their map."""

import dataclasses

import numpy as np
import pytest

from srt_jax.answers.task_stream import count_tasks, tasks_between
from srt_jax.formats.batch import write_batch
from srt_jax.formats.movingai import ScenRow, write_map, write_scen
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.formats.task_files import read_tasks
from srt_jax.instances.generate import generate
from srt_jax.task import stack


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("files")
    free = np.ones((20, 20), bool)
    free[5:9, 5:9] = False
    write_map(folder / "a.map", free)
    rows = [ScenRow(0, "a.map", 20, 20, (1, n), (18, 19 - n), 1.0) for n in range(8)]
    write_scen(folder / "a.map.scen", rows)
    made = generate("rooms", count=5, size=20, seed=1)
    write_batch(folder / "b.npz", stack([task for _, task, _ in made]))
    return {name: str(folder / name) for name in ("a.map", "a.map.scen", "b.npz")}


@pytest.mark.parametrize("name", ["a.map.scen", "b.npz"])
@pytest.mark.parametrize("how", [Reading(), Reading(rows=(1, 5), limit=3), Reading(block="half")])
def test_all_parts_together_are_what_is_read_at_once(files, name, how):
    expected = read_tasks(files[name], reading=how, destroyable="all")
    count = count_tasks(files[name], how)
    got = [
        named
        for first in range(0, count, 2)
        for named, _ in tasks_between(
            files[name], how, "all", first, min(first + 2, count), Notes()
        )
    ]
    assert [one.name for one in got] == [one.name for one in expected]
    for one, other in zip(got, expected):
        for field in dataclasses.fields(type(one.task)):
            a, b = (getattr(each.task, field.name) for each in (one, other))
            np.testing.assert_array_equal(a, b)


def test_rows_on_one_map_share_its_labels(files):
    tasks = [
        one.task for one, _ in tasks_between(files["a.map.scen"], Reading(), None, 0, 8, Notes())
    ]
    assert len({id(task.labels) for task in tasks}) == 1


def test_a_map_is_one_task(files):
    how = Reading(start=(0, 0), goal=(19, 19))
    assert count_tasks(files["a.map"], how) == 1
    ((named, frame),) = tasks_between(files["a.map"], how, None, 0, 1, Notes())
    assert named.name == "a" and frame is not None


def test_what_is_no_batch_is_named(tmp_path):
    (tmp_path / "x.npz").write_bytes(b"nothing")
    with pytest.raises(ValueError, match=r"x\.npz: no batch of tasks"):
        count_tasks(str(tmp_path / "x.npz"), Reading())
    with pytest.raises(ValueError, match="no such file"):
        count_tasks(str(tmp_path / "y.scen"), Reading())
