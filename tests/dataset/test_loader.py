"""The loader's length is the number of its batches; tasks by number are those of the batches."""

import pickle

import numpy as np
import pytest

from srt_jax import dataset


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("data")
    dataset.write_dataset(out, kind="mixed", count=22, size=(16, 20), seed=5, shard_size=8)
    return out


@pytest.mark.parametrize("drop_remainder", [False, True])
@pytest.mark.parametrize("worker", [(0, 1), (0, 2), (1, 2), (2, 3)])
def test_the_length_is_the_number_of_batches(folder, worker, drop_remainder):
    for seed in (None, 0, 1):
        batches = dataset.load(
            folder,
            batch_size=5,
            seed=seed,
            epochs=3,
            worker=worker,
            drop_remainder=drop_remainder,
            fields=("index",),
        )
        assert len(batches) == len(list(batches))
    with pytest.raises(TypeError, match="give a number of epochs"):
        len(dataset.load(folder, epochs=None))


def test_tasks_by_number_are_those_of_the_batches(folder):
    tasks = pickle.loads(pickle.dumps(dataset.TaskSource(folder)))
    (batch,) = dataset.load(folder, batch_size=22)
    assert len(tasks) == 22
    for number in (0, 7, 8, 21, -1):
        for name, array in tasks[number].items():
            np.testing.assert_array_equal(array, batch[name][number])
    with pytest.raises(IndexError, match=r"0\.\.21, got 22"):
        tasks[22]
    with pytest.raises(ValueError, match="no field is called 'heat'"):
        dataset.TaskSource(folder, fields=("heat",))
