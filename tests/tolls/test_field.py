"""The field of tolls: equal to a heap's, the same bits in every form, and its derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from experiments.campaigns.inputs.tolled_maps import tolled_tasks
from srt_jax import cost_to_come, make_task, stack, toll_to_come
from srt_jax.reference.tolls import least_sums

STRAIGHT = 5741


@pytest.fixture(scope="module")
def batch():
    """Sixteen maps of all kinds in one batch of two layers, with a toll for each obstacle."""
    kinds = ("connected", "combs", "scattered", "scattered")
    tasks = [
        task
        for i, kind in enumerate(kinds)
        for task in tolled_tasks([7, i], 4, kind, max_side=12)[0]
    ]
    whole = stack(tasks)
    rng = np.random.default_rng(3)
    toll = rng.choice([0, 0.25, 1, 3.3, 20, np.inf], whole.removal_cost.shape).astype(np.float32)
    return whole, toll


def in_units(sums):
    return np.where(np.isfinite(sums), np.round(np.asarray(sums, float) * STRAIGHT), -1)


def test_sums_are_those_of_a_heap_on_every_cell(batch):
    task, toll = batch
    found = np.asarray(toll_to_come(task.labels, toll, task.start))
    assert np.isfinite(found).mean() > 0.3
    for index in range(len(found)):
        true = least_sums(task.labels[index], toll[index], tuple(task.start[index].tolist()))
        np.testing.assert_array_equal(in_units(found[index]), in_units(true), str(index))


def test_one_map_alone_jitted_or_under_vmap_has_the_bits_of_the_batch(batch):
    task, toll = batch
    found = np.asarray(toll_to_come(task.labels, toll, task.start))
    for index in (0, 9):
        alone = toll_to_come(task.labels[index], toll[index], task.start[index])
        np.testing.assert_array_equal(alone, found[index])
    args = (jnp.asarray(task.labels), jnp.asarray(toll), jnp.asarray(task.start))
    np.testing.assert_array_equal(jax.jit(jax.vmap(toll_to_come))(*args), found)


def test_all_cells_at_once_give_the_same_bits(batch, monkeypatch):
    task, toll = batch
    found = np.asarray(toll_to_come(task.labels, toll, task.start))
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")  # as on a GPU: no loop over cells
    plain = jax.jit(lambda *args: toll_to_come(*args))(task.labels, toll, task.start)
    np.testing.assert_array_equal(plain, found)


def test_where_nothing_may_be_entered_the_sums_are_lengths(batch):
    task, toll = batch
    free = (task.labels == -1).all(axis=1)
    forbidden = np.full_like(toll, np.inf)
    found = toll_to_come(task.labels, forbidden, task.start)
    np.testing.assert_array_equal(found, cost_to_come(free, task.start))


@pytest.fixture(scope="module")
def with_costs(batch):
    """The batch, tolls that are nowhere equal, costs of cells, and sums by a heap as a function of
    the change along a way: tolls, then costs.
    """
    task, _ = batch
    rng = np.random.default_rng(4)
    toll = rng.uniform(0.1, 6, task.removal_cost.shape).astype(np.float32)
    cell = rng.uniform(0.5, 3, task.labels.shape[:1] + task.labels.shape[2:]).astype(np.float32)
    ways = [rng.normal(size=array.shape) for array in (toll, cell)]

    def sums(index, step):
        changed = (array[index] + step * way[index] for array, way in zip((toll, cell), ways))
        start = tuple(task.start[index].tolist())
        return least_sums(task.labels[index], next(changed), start, cell_cost=next(changed))

    return task, toll, cell, ways, sums


def test_with_costs_of_cells_the_sums_are_those_of_a_heap(with_costs, monkeypatch):
    task, toll, cell, _, sums = with_costs
    found = np.asarray(toll_to_come(task.labels, toll, task.start, cell))
    for index in range(len(found)):
        np.testing.assert_allclose(found[index], sums(index, 0.0), rtol=1e-5)
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    plain = jax.jit(lambda *args: toll_to_come(*args))(task.labels, toll, task.start, cell)
    np.testing.assert_array_equal(plain, found)


def test_the_derivative_by_tolls_and_costs_is_that_of_differences(with_costs):
    task, toll, cell, ways, sums = with_costs
    along = jax.jit(
        lambda *args: jax.jvp(
            lambda toll, cell: toll_to_come(task.labels, toll, task.start, cell), args, ways
        )[1]
    )
    ways = tuple(jnp.asarray(way, jnp.float32) for way in ways)
    found, eps, num_compared = np.asarray(along(toll, cell)), 1e-6, 0
    for index in range(len(found)):
        fields = [sums(index, step) for step in (eps, 0.0, -eps)]
        reached = np.isfinite(fields[1])
        ahead, here, back = (field[reached] for field in fields)
        if np.abs(ahead + back - 2 * here).max(initial=0) > 1e-9:
            continue  # another way has become the least in between
        expected = (ahead - back) / (2 * eps)
        np.testing.assert_allclose(found[index][reached], expected, rtol=1e-3, atol=1e-3)
        assert not found[index][~reached].any()
        num_compared += 1
    assert num_compared > 10


def test_backwards_a_toll_counts_the_entries(batch):
    task, toll = batch
    labels = np.full_like(task.labels, -1)
    labels[:, 0, :, 2] = labels[:, 0, :, 6] = labels[:, 0, 0, 2:7] = 0  # a comb
    start = np.full_like(task.start, [9, 0])
    tolls = np.full_like(toll, 5)
    back = jax.jit(jax.grad(lambda tolls: toll_to_come(labels, tolls, start)[:, 9, 8].sum()))
    assert (np.asarray(back(tolls)) == np.eye(1, toll.shape[1]) * 2).all()  # both teeth


def test_a_wall_is_paid_once_and_a_comb_at_every_tooth():
    labels = np.full((1, 12, 9), -1, np.int32)
    labels[0, :, 2] = labels[0, :, 6] = labels[0, 0, 2:7] = 0  # teeth down from a bar
    sums = toll_to_come(labels, np.array([5], np.float32), np.array([9, 0], np.int32))
    assert sums[9].tolist() == [0, 1, 7, 8, 9, 10, 16, 17, 18]


def test_a_corner_that_is_cut_is_paid():
    task = make_task(np.array([[-1, 0], [-1, -1]]), (0, 0), (1, 1))
    dear, cheap = (
        float(toll_to_come(task.labels, np.array([toll], np.float32), task.start)[1, 1])
        for toll in (5, 0)
    )
    assert dear == 2 and cheap == pytest.approx(2**0.5)


@pytest.mark.parametrize(
    ("labels", "toll", "message"),
    [
        (np.zeros((1, 2, 2), np.int64), np.ones(1, np.float32), "labels must be int32"),
        (np.zeros((2, 2), np.int32), np.ones(1, np.float32), "labels must have shape"),
        (np.zeros((1, 2, 2), np.int32), np.ones(1), "toll must be float32"),
        (np.zeros((1, 2, 2), np.int32), -np.ones(1, np.float32), "not negative"),
        (np.zeros((1, 2, 2), np.int32), np.ones((3, 1), np.float32), "batch dimensions"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(labels, toll, message):
    with pytest.raises((TypeError, ValueError), match=message):
        toll_to_come(labels, toll, np.zeros(2, np.int32))
