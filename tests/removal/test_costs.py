"""Removal costs of any ratio: no wrong status, no bound above the optimum, nothing needless; and
what the limits mean.
"""

import json
import pathlib

import jax
import numpy as np
import pytest

from experiments.campaigns import checks
from experiments.campaigns import costs as cost_campaign
from experiments.campaigns.costs import LIMITS, batch_of, make_tasks, problems_of, solve_and_judge
from experiments.campaigns.judges.cost_oracle import judge
from srt_jax import Status, check, explain, explanation, make_task, solve, solve_many, uncompiled
from srt_jax.cli import run

ODD = pathlib.Path(__file__).resolve().parents[1] / "odd_inputs" / "costs"
FULL, ONE, PAPER = LIMITS[0], LIMITS[3], LIMITS[4]
COUNT = 64
"""As in `campaigns.checks`: the same programs."""

CHAINS = (
    [1e8, 1],
    [1, 1e8],
    [16777216, 1],
    [1e4, 1e-4],
    [1, 1e-8],
    [3e38, 3e38],
    [1.5e-45, 3e38],
    [0.1, 0.2],
    [1e-5, 1e9],
)


def chain(costs):
    """Obstacles one after the other: all must go."""
    return make_task(
        np.array([[-1, 0, -1, 1, -1]]), (0, 0), (0, 4), removal_cost=np.array(costs, np.float32)
    )


def dear_and_cheap():
    """Two ways, through 2 for 5e8 or through 0 and 1 for 1e8 + 1; what leads to the second is
    met first.
    """
    labels = np.array([[-1, 0, -1, 1, -1], [-1, 3, 3, 3, -1], [-1, -1, 2, -1, -1]])
    return make_task(labels, (0, 0), (0, 4), destroyable=[0, 1, 2], removal_cost=[1e8, 1, 5e8, 1])


def one_or_two():
    """Two ways: through 0, for 5, or through 1 and 2, for 2."""
    labels = np.array([[-1, 0, 0, 0, -1], [-1, 3, 3, 3, -1], [-1, 1, -1, 2, -1]])
    return make_task(labels, (0, 0), (0, 4), destroyable=[0, 1, 2], removal_cost=[5, 1, 1, 1])


def near_tie():
    """Two ways of two obstacles each, the second cheaper by less than a millionth."""
    labels = np.array([[-1, 0, -1, 1, -1], [-1, 4, 4, 4, -1], [-1, 2, -1, 3, -1]])
    least = np.nextafter(np.float32(1), np.float32(0))
    return make_task(labels, (0, 0), (0, 4), destroyable=range(4), removal_cost=[1, 1, 1, least, 1])


HARD = [*map(chain, CHAINS), dear_and_cheap(), one_or_two(), near_tie()]


@pytest.fixture(scope="module")
def batch():
    rest = make_tasks(0, COUNT - len(HARD), seed=7)
    return jax.tree.map(lambda a, b: np.concatenate([a, b]), batch_of(HARD), rest)


def one(tree, place):
    return jax.tree.map(lambda array: np.asarray(array)[place], tree)


@pytest.fixture(scope="module")
def full(batch):
    return solve_and_judge(batch, FULL)[1]


def test_every_status_bound_and_cost_is_right_in_every_way_of_solving(batch):
    for limits in (FULL, ONE, PAPER):
        _, solutions, truth = solve_and_judge(batch, limits)
        assert problems_of(batch, solutions, truth, limits) == []
        assert check(batch, solutions, mode=limits.mode) == []
    assert (truth.status[: len(HARD)] == Status.SOLVED).all()


def test_a_small_cost_beside_a_large_one_is_no_end(full):
    for place, costs in enumerate(CHAINS):
        assert full.status[place] == Status.SOLVED and full.destroyed[place, :3].tolist() == [
            0,
            1,
            -1,
        ]
        assert full.removal_cost[place] == full.removal_bound[place]
        assert float(full.removal_bound[place]) <= sum(map(float, np.array(costs, np.float32)))
    assert full.removal_cost[CHAINS.index([3e38, 3e38])] == np.finfo(np.float32).max


def test_the_cheaper_way_is_taken_and_bounds_the_cost(batch, full):
    place = len(CHAINS)
    assert full.destroyed[place, :3].tolist() == [0, 1, -1]
    greedy = one(solve_and_judge(batch, PAPER)[1], place)
    assert greedy.removal_bound <= 100000001
    too_high = greedy.replace(removal_bound=np.float32(5e8))
    assert any("removal_bound is 5" in problem for problem in check(one(batch, place), too_high))


def test_sets_that_differ_in_the_last_bit_are_distinguished(full):
    assert sorted(full.destroyed[len(HARD) - 1, :2].tolist()) == [2, 3]


def test_a_limit_below_the_least_removal_says_how_many_are_needed(batch, full):
    place = len(HARD) - 2
    assert full.num_destroyed[place] == 2 and full.removal_cost[place] == 2
    few = one(solve_and_judge(batch, ONE)[1], place)
    assert few.status == Status.BUDGET_SPENT and few.num_destroyed == 2 and few.removal_bound == 2
    assert few.destroyed.tolist() == [-1] and few.removal_cost == np.inf
    assert "needs 2 obstacles destroyed" in explain(HARD[place], few)
    assert explanation(HARD[place], few)["num_needed"] == 2


def test_what_is_needless_is_noticed_where_the_mode_is_known(batch, full):
    task = make_task(np.array([[-1, 0, -1], [-1, 1, -1]]), (0, 0), (0, 2))
    right = solve(task)
    assert check(task, right, mode="least") == []
    greedy = right.replace(
        destroyed=np.array([1, 0, *[-1] * 6], np.int32),
        destroyed_at=np.array([0, 0, *[-1] * 6], np.int32),
        num_destroyed=np.int32(2),
        removal_cost=np.float32(2),
        plan=np.array([(2, 1), (3, 1), (1, 1), (2, 0), (3, 0), (1, 0), *[(-1, -1)] * 19], np.int32),
        plan_at=np.array([0, 0, 0, 0, 0, int(right.num_cells) - 1, *[-1] * 19], np.int32),
    )
    assert [p for p in check(task, greedy, mode="least") if "need not be" in p]
    assert not [p for p in check(task, greedy) if "need not be" in p]


def test_costs_that_make_task_refuses_are_no_wrong_answer(batch):
    costs = batch.removal_cost.copy()
    costs[0, :2] = 0  # both obstacles of the chain
    solutions = solve_and_judge(batch.replace(removal_cost=costs), FULL)[1]
    assert solutions.status[0] == Status.SOLVED and solutions.num_destroyed[0] == 2
    assert solutions.removal_cost[0] == solutions.removal_bound[0] == 0
    assert check(one(batch.replace(removal_cost=costs), 0), one(solutions, 0), mode="least") == []


def test_room_for_more_than_there_is_changes_nothing(batch, full):
    more = jax.tree.map(np.asarray, solve(batch, max_destroyed=1000))
    assert (
        more.destroyed.shape[1] == more.destroyed_at.shape[1] == 1000
        and more.plan.shape[1] == more.plan_at.shape[1] == 3001
    )
    cut = more.replace(destroyed=more.destroyed[:, :10], destroyed_at=more.destroyed_at[:, :10])
    cut = cut.replace(plan=more.plan[:, :31], plan_at=more.plan_at[:, :31])
    assert all(
        a.tobytes() == b.tobytes()
        for a, b in zip(jax.tree.leaves(cut), jax.tree.leaves(full), strict=True)
    )
    assert (more.destroyed[:, 10:] == -1).all() and (more.plan[:, 31:] == -1).all()


def test_many_more_than_commonly_needed_are_found(monkeypatch):
    monkeypatch.setattr("srt_jax.many_tasks._COMMON_NUMBER", 1)
    with uncompiled():  # twice, each with a program of its own
        (solution,) = solve_many([chain([1, 2])], max_destroyed=1000)
    assert (
        solution.status == Status.SOLVED
        and solution.destroyed[:3].tolist() == [0, 1, -1]
        and len(solution.destroyed) == 1000
    )


def test_what_can_be_destroyed_is_named_first():
    task = make_task(np.array([[-1, 0, -1], [-1, 1, -1]]), (0, 0), (0, 2), destroyable=[1])
    solution = solve(task)
    assert solution.blocking.tolist() == [0, 1]
    assert [known["id"] for known in explanation(task, solution)["blockage"]["obstacles"]] == [1, 0]
    answer = explain(task, solution)
    assert answer.index("1 (destroyable") < answer.index("0 (indestructible")


def test_the_command_line_solves_them(capsys):
    for name, options in (
        ("break_dear_then_cheap.npz", ()),
        ("break_bound_too_high.npz", ("--mode", "paper")),
    ):
        assert run(["solve", str(ODD / name), *options, "--json"]) == 0
        (answer,) = json.loads(capsys.readouterr().out)["tasks"]
        assert answer["status"] == "SOLVED" and answer["removal_bound"] <= 100000001
    ends = ("--start", "0,0", "--goal", "0,4")
    assert run(["solve", str(ODD / "base.map"), *ends, "--max-destroyed", "1000000", "--json"]) == 0


def test_the_oracle_notices_a_set_that_is_not_the_least():
    batch = batch_of([one_or_two()])
    chosen = np.zeros((1, batch.destroyable.shape[1]), bool)
    for ids, facts in (
        ([0], (True, False, True)),
        ([1, 2], (True, True, True)),
        ([0, 1], (True, False, False)),
        ([1], (False,)),
    ):
        chosen[:] = False
        chosen[0, ids] = True
        truth = judge(batch, chosen)
        assert (
            truth.least == 2
            and (truth.opens[0], truth.is_least[0], truth.is_thin[0])[: len(facts)] == facts
        )


def test_the_campaigns_pass_in_small_and_tell_what_is_wrong(monkeypatch, capsys):
    monkeypatch.setattr(cost_campaign, "LIMITS", (FULL,))
    assert cost_campaign.main(["--count", "64", "--at-once", "64"]) == 0
    assert "64 tasks, 0 wrong" in capsys.readouterr().out
    assert checks.main(["--count", "300"]) == 0
    assert "300 wrong answers" in capsys.readouterr().out
    monkeypatch.setattr(
        cost_campaign,
        "solve",
        lambda task, **options: solve(task, **options).replace(
            removal_bound=np.zeros(64, np.float32) + 1
        ),
    )
    assert cost_campaign.main(["--count", "64", "--at-once", "64"]) == 1
    assert "--seed 0 --only" in capsys.readouterr().err
