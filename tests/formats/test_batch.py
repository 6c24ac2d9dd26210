"""Batches as .npz: read back equal, and refused whole where an array is wrong."""

import os

import chex
import numpy as np
import pytest

from srt_jax.formats.batch import read_batch, write_batch
from srt_jax.task import make_task, stack

LABELS = np.array([[[0, -1, 1]], [[-1, -1, 0]]])
BATCH = stack(
    [
        make_task(LABELS, (0, 0), (0, 1), removal_cost=[1, 2.5], destroyable=[1]),
        make_task(np.array([[True, False], [True, True]]), (0, 0), (1, 1)),
    ]
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "batch.npz"


def test_a_batch_is_read_back_equal(path):
    write_batch(path, BATCH, names=["first", "второй"], optimum=[2.5, np.nan])
    tasks, names, optimum = read_batch(path)
    chex.assert_trees_all_equal(tasks, BATCH)
    assert names == ("first", "второй") and optimum.dtype == np.float32
    np.testing.assert_array_equal(optimum, [2.5, np.nan])


def test_names_and_optimum_may_be_left_out(path):
    write_batch(path, BATCH)
    _, names, optimum = read_batch(path)
    assert names == ("0", "1") and np.isnan(optimum).all() and optimum.shape == (2,)


@pytest.mark.parametrize(
    ("message", "change"),
    [
        ("labels must be int32, got float32", {"labels": BATCH.labels.astype(np.float32)}),
        ("labels must be int32, got int64", {"labels": BATCH.labels.astype(np.int64)}),
        ("labels must have shape [B, L, H, W]", {"labels": BATCH.labels[0]}),
        ("start must have shape [B, 2]", {"start": BATCH.start[:1]}),
        ("removal_cost must have shape [B, M]", {"removal_cost": BATCH.removal_cost[:, :1]}),
        ("destroyable must be bool", {"destroyable": BATCH.destroyable.astype(np.int32)}),
        ("task 1: start must lie inside the map", {"start": np.array([[0, 0], [0, 2]], np.int32)}),
        ("task 0: goal must lie inside the map", {"goal": np.array([[-1, 0], [0, 0]], np.int32)}),
        (
            "task 0: size must lie between 1 x 1 and 2 x 3",
            {"size": np.array([[3, 3], [2, 2]], np.int32)},
        ),
        ("task 0: size must", {"size": np.array([[0, 3], [2, 2]], np.int32)}),
        (
            "task 0: labels must be -1 (free) or an id from 0 to 1",
            {"labels": np.where(BATCH.labels == 1, 2, BATCH.labels)},
        ),
        ("task 0: labels beyond the map's size", {"labels": np.maximum(BATCH.labels, -1)}),
        ("task 0: removal_cost must be positive", {"removal_cost": BATCH.removal_cost - 1}),
        (
            "task 0: removal_cost must be positive",
            {"removal_cost": BATCH.removal_cost * np.float32("nan")},
        ),
        ("optimum must have shape [B]", {"optimum": np.zeros(3, np.float32)}),
        ("task 1: optimum must not be negative", {"optimum": np.array([0, -1], np.float32)}),
        ("names must be str", {"names": np.array([1, 2])}),
        ("the array 'colour' is unknown", {"colour": np.zeros(2)}),
        ("the array 'goal' is missing", {"goal": None}),
        ("the batch is empty", {}),
    ],
)
def test_a_bad_array_is_refused_in_one_sentence(path, message, change):
    arrays = {name: np.asarray(value) for name, value in BATCH.items()} | change
    if not change:
        arrays = {name: value[:0] for name, value in arrays.items()}
    np.savez(path, **{name: value for name, value in arrays.items() if value is not None})
    with pytest.raises(ValueError) as caught:
        read_batch(path)
    assert (
        str(caught.value).startswith(str(path))
        and message in str(caught.value)
        and "\n" not in str(caught.value)
    )


def test_files_of_another_kind_cut_off_or_with_objects_are_refused(path):
    write_batch(path, BATCH)
    whole = path.read_bytes()
    damaged = [whole[: len(whole) // 2], whole[:150] + bytes(30) + whole[180:], b"", b"no archive"]
    for content in damaged:
        path.write_bytes(content)
        with pytest.raises(ValueError, match="it is cut off, damaged"):
            read_batch(path)
    np.savez(path, labels=np.array([{}, []], object))
    with pytest.raises(ValueError, match="plain arrays"):
        read_batch(path)
    with pytest.raises(ValueError, match="no such file"):
        read_batch(path.with_name("none"))


def test_names_of_numbers_that_are_no_characters_are_refused(path):
    write_batch(path, BATCH)
    names = np.full(3 * len(BATCH.start), 0x7FFFFFFF, np.uint32).view("<U3")
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **(arrays | {"names": names}))
    with pytest.raises(ValueError, match=r"'names\.npy' holds numbers that stand for no character"):
        read_batch(path)


def test_what_would_not_be_read_is_not_written(path):
    for bad, options in (
        (make_task(LABELS, (0, 0), (0, 1)), {}),
        (BATCH, {"names": ["one"]}),
        (BATCH, {"optimum": [1.0]}),
    ):
        with pytest.raises(ValueError):
            write_batch(path, bad, **options)
    assert not os.listdir(path.parent)
