"""Mode "shortest" against brute force; its bound; its limits; batches; what `check` notices."""

import jax
import numpy as np
import pytest

from experiments.campaigns.inputs.tolled_maps import KINDS, tolled_tasks
from srt_jax import Status, check, explain, make_task, shortest_path, solve, solve_many, stack
from srt_jax.reference.tolls import brute_force_total
from srt_jax.tolls import paid_sets

SAME = ("status", "cost", "total", "total_bound", "removal_cost", "destroyed", "plan")


@pytest.fixture(scope="module")
def cases():
    """Tasks of every kind with their tolls, the answers of one batch, and the optima."""
    drawn = [tolled_tasks([5, i], 8, kind, max_side=12) for i, kind in enumerate(KINDS)]
    tasks = [task for some, _ in drawn for task in some]
    tolls = np.concatenate([some for _, some in drawn])
    answers = jax.device_get(solve(stack(tasks), mode="shortest", toll=tolls))
    optima = []
    for task, toll in zip(tasks, tolls):
        ends = (tuple(end.tolist()) for end in (task.start, task.goal))
        optima.append(
            brute_force_total(task.labels, task.destroyable, task.removal_cost * toll, *ends)
        )
    return tasks, tolls, answers, optima


def one_of(record, index):
    return jax.tree.map(lambda array: array[index], record)


def test_totals_are_the_optima_and_proven(cases):
    tasks, _, answers, optima = cases
    assert {Status(s) for s in answers.status.tolist()} >= {
        Status.PATH_EXISTS,
        Status.SOLVED,
        Status.BROKE_THROUGH,
    }
    for index in range(len(tasks)):
        total, bound = float(answers.total[index]), float(answers.total_bound[index])
        assert total == bound, index
        assert total == pytest.approx(optima[index].total, abs=1e-3), index


def test_every_answer_is_replayed_and_a_wrong_total_is_noticed(cases):
    tasks, tolls, answers, _ = cases
    batch = stack(tasks)
    assert check(batch, answers, mode="shortest", toll=tolls) == []
    index = int(np.argmax(answers.status == Status.BROKE_THROUGH))
    task, answer, toll = one_of(batch, index), one_of(answers, index), float(tolls[index])
    total = np.float32(answer.total)
    for wrong, message in (
        ({"total": total + 1, "total_bound": total}, "total is"),
        ({"total_bound": total + 1}, "and total_bound"),
        ({"status": np.int32(Status.PATH_EXISTS)}, "nothing needs destroying"),
    ):
        problems = check(task, answer.replace(**wrong), mode="shortest", toll=toll)
        assert any(message in problem for problem in problems), (wrong, problems)
    # An answer for another toll, said to be proven for this one: a route for less refutes it.
    other = one_of(jax.device_get(solve(batch, mode="shortest", toll=1000.0)), index)
    paid = np.float32(other.cost + toll * other.removal_cost)
    problems = check(task, other.replace(total=paid, total_bound=paid), mode="shortest", toll=toll)
    assert any("gone a route of" in problem for problem in problems)


@pytest.mark.slow
def test_the_bound_of_one_search_holds_and_is_tight_on_rectangles(cases):
    tasks, tolls, _, optima = cases
    firsts = solve(stack(tasks), mode="shortest", toll=tolls, max_branches=1)
    for index, best in enumerate(optima):
        bound = float(firsts.total_bound[index])
        assert bound <= best.total + 1e-3
        if index < 8:  # the rectangles
            assert bound == pytest.approx(best.total, abs=1e-3)


@pytest.mark.slow
def test_a_task_alone_in_a_list_and_under_vmap_has_the_bits_of_the_batch(cases):
    tasks, tolls, answers, _ = cases
    many = solve_many(tasks, mode="shortest", toll=tolls.tolist())
    batch = stack(tasks)
    mapped = jax.jit(jax.vmap(lambda task, toll: solve(task, mode="shortest", toll=toll)))
    mapped = mapped(batch, tolls)
    for name in SAME:
        np.testing.assert_array_equal(getattr(mapped, name), getattr(answers, name), name)
        for index, answer in enumerate(many):
            one = np.asarray(getattr(answer, name))
            np.testing.assert_array_equal(one, getattr(answers, name)[index], name)


@pytest.mark.slow
def test_all_cells_at_once_give_the_same_answers(cases, monkeypatch):
    tasks, tolls, answers, _ = cases
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    plain = jax.jit(lambda task, toll: solve(task, mode="shortest", toll=toll))(stack(tasks), tolls)
    for name in SAME:
        np.testing.assert_array_equal(getattr(plain, name), getattr(answers, name), name)


@pytest.mark.slow
def test_without_memory_branch_and_bound_finds_the_same_totals(cases, monkeypatch):
    tasks, tolls, answers, _ = cases
    monkeypatch.setattr(paid_sets, "REMEMBERED", 1)
    # The straight way through three bent walls pays for all three, though they share a bit.
    labels = np.full((1, 12, 12), -1)
    for i, col in enumerate((2, 5, 8)):
        labels[0, 1:11, col] = labels[0, 1, col : col + 2] = i
    walls = make_task(labels, (6, 0), (6, 11))

    def totals(task, toll):  # a number of branches that no other test compiles for
        return solve(task, mode="shortest", toll=toll, max_branches=255)

    number, more = len(tasks), np.array([0.5, 1.5, 20], np.float32)
    found = jax.jit(totals)(stack([*tasks, *[walls] * 3]), np.append(tolls, more))
    np.testing.assert_array_equal(found.total[:number], answers.total)
    np.testing.assert_array_equal(found.total_bound[:number], answers.total_bound)
    for name in ("total", "total_bound"):
        lengths = np.asarray(getattr(found, name))[number:]
        np.testing.assert_allclose(lengths, [12.5, 15.5, 19.2426], atol=1e-3)


def test_without_tolls_the_way_is_the_shortest_and_with_high_ones_the_removal_the_least(cases):
    tasks, *_ = cases
    batch = stack(tasks)
    free = solve(batch, mode="shortest", toll=0.0)
    high, least = solve(batch, mode="shortest", toll=1000.0), solve(batch)
    np.testing.assert_array_equal(high.removal_cost, least.removal_cost)
    np.testing.assert_array_equal(free.removal_bound <= least.removal_cost, True)
    for index, task in enumerate(tasks):
        openable = np.append(task.destroyable, [False, True])[task.labels].all(axis=0)
        is_free = (task.labels == -1).all(axis=0)[tuple(task.start)]
        length = float(shortest_path(openable, task.start, task.goal).cost) if is_free else np.inf
        assert float(free.cost[index]) == length, index


def test_a_far_gap_is_passed_by_where_a_wall_is_cheap_and_the_words_say_so(cases):
    labels = np.full((2, 12, 12), -1)
    labels[0, :11, 6] = 0
    task = make_task(labels, (0, 4), (0, 8))
    number = len(cases[0])  # the program of the other tests
    tolls = np.where(np.arange(number) % 2, 30, 3).astype(np.float32)
    answers = jax.device_get(solve(stack([task] * number), mode="shortest", toll=tolls))
    cheap, dear = one_of(answers, 0), one_of(answers, 1)
    assert Status(int(cheap.status)) is Status.BROKE_THROUGH and float(cheap.total) == 7
    assert "breaking obstacle 0 saves" in explain(task, cheap)
    assert Status(int(dear.status)) is Status.PATH_EXISTS
    assert "Going round is cheaper" in explain(task, dear)


def test_batches_of_other_sizes_hold_the_same_answers(cases):
    tasks, tolls, answers, _ = cases
    few = jax.device_get(solve(stack(tasks[:3]), mode="shortest", toll=tolls[:3]))
    for name in SAME:
        same = np.asarray(getattr(answers, name))[:3]
        cut = tuple(slice(0, side) for side in getattr(few, name).shape)
        np.testing.assert_array_equal(getattr(few, name), same[cut], name)


def test_a_toll_that_makes_no_sense_is_refused():
    task = make_task(np.ones((12, 12), bool), (0, 4), (0, 8))
    for toll in (-1.0, np.inf, np.nan):
        with pytest.raises(ValueError, match="toll is"):
            solve(task, mode="shortest", toll=toll)
    with pytest.raises(ValueError, match="toll is inf"):  # in float32, without a warning
        solve(task, mode="shortest", toll=1e300)
    with pytest.raises(ValueError, match="toll is inf"):
        solve_many([task], mode="shortest", toll=1e300)
    with pytest.raises(ValueError, match="toll must be a number"):
        solve(task, mode="shortest", toll=np.ones(3, np.float32))
    with pytest.raises(ValueError, match="toll must be a number"):
        solve_many([task], mode="shortest", toll=[1.0, 2.0])
