"""What every plan costs at least: never above the optimum, and equal to it where blocks stand in
each other's way.
"""

import heapq
from dataclasses import replace

import numpy as np
import pytest

from sign_model import load, plan, validate
from sign_model.blocks import random_blocks_tasks
from sign_model.map_algorithm.least_length import least_cost
from sign_model.map_algorithm.regression import regression_space
from sign_model.pddl.planning_task import task_from_arrays
from sign_model.strategies.proven import proven_cheapest


def bound_of(task):
    space = regression_space(task)
    start, goal = (space.situations(rows) for rows in (task.start, task.goal))
    return least_cost(space, start, goal, task.costs[space.kept_actions])


def cheapest(task):
    """The cost of a cheapest plan by Dijkstra's algorithm over states; None where there is none."""
    queue, cost = [(0, task.start.tobytes())], {task.start.tobytes(): 0}
    while queue:
        spent, key = heapq.heappop(queue)
        state = np.frombuffer(key, bool)
        if spent > cost[key]:
            continue
        if not (task.goal & ~state).any():
            return spent
        for a in np.flatnonzero(~(task.conditions & ~state).any(axis=1)):
            after = ((state & ~task.deletes[a]) | task.adds[a]).tobytes()
            if spent + int(task.costs[a]) < cost.get(after, 1 << 60):
                cost[after] = spent + int(task.costs[a])
                heapq.heappush(queue, (cost[after], after))
    return None


def random_variables_task(seed):
    """A task of two to four variables, one feature for each value, so that many features never hold
    together.
    """
    rng = np.random.default_rng(seed)
    sizes = rng.integers(2, 5, rng.integers(2, 5))
    first = np.concatenate([[0], np.cumsum(sizes)])
    conditions = np.zeros((rng.integers(3, 22), first[-1]), bool)
    adds, deletes = np.zeros_like(conditions), np.zeros_like(conditions)
    for needs, gives, takes in zip(conditions, adds, deletes):
        for v in rng.choice(len(sizes), rng.integers(1, min(3, len(sizes)) + 1), replace=False):
            old, new = first[v] + rng.integers(0, sizes[v], 2)
            needs[old] = True
            gives[new] = takes[old] = old != new and rng.random() < 0.8
    start, goal = np.zeros(first[-1], bool), np.zeros(first[-1], bool)
    start[first[:-1] + rng.integers(0, sizes)] = True
    wanted = rng.choice(len(sizes), rng.integers(1, len(sizes) + 1), replace=False)
    goal[first[wanted] + rng.integers(0, sizes[wanted])] = True
    costs = rng.integers(0, 4, len(conditions)) if seed % 2 else None
    return task_from_arrays(conditions, adds, deletes, start, goal, costs)


def test_the_bound_is_never_above_the_optimum():
    met = longest = 0
    for seed in range(400):
        task = random_variables_task(seed)
        best = cheapest(task)
        if best is not None:
            bound = bound_of(task)
            assert bound <= best, seed
            met, longest = met + (0 < bound == best), max(longest, best)
    assert met > 30 and longest > 4


def test_blocks_with_partial_goals_and_a_block_in_the_hand():
    rng = np.random.default_rng(0)
    for task in random_blocks_tasks(3, 60, seed=3):
        state, goal = task.start, task.goal & (rng.random(task.num_features) < 0.7)
        for _ in range(rng.integers(0, 6)):
            action = rng.choice(np.flatnonzero(~(task.conditions & ~state).any(axis=1)))
            state = (state & ~task.deletes[action]) | task.adds[action]
        other = replace(task, start=state, goal=goal)
        best = cheapest(other)
        assert best is not None and bound_of(other) <= best


BLOCKS = """(define (domain blocks) (:predicates (on ?x ?y) (down ?x) (clear ?x) (empty) (held ?x))
  (:action lift :parameters (?x) :precondition (and (clear ?x) (down ?x) (empty))
    :effect (and (held ?x) (not (clear ?x)) (not (down ?x)) (not (empty))))
  (:action lay :parameters (?x) :precondition (held ?x)
    :effect (and (not (held ?x)) (clear ?x) (down ?x) (empty)))
  (:action take :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x) (empty))
    :effect (and (held ?x) (clear ?y) (not (clear ?x)) (not (on ?x ?y)) (not (empty))))
  (:action put :parameters (?x ?y) :precondition (and (held ?x) (clear ?y))
    :effect (and (on ?x ?y) (clear ?x) (empty) (not (held ?x)) (not (clear ?y)))))"""


@pytest.mark.parametrize(
    "start,goal,length",
    [
        # a and b stand on what must come first: a is put aside, so it moves twice
        ("(on a b) (on b c) (down c) (clear a)", "(on a c) (on c b)", 8),
        # each of two blocks stands on what the other one waits for: one moves twice
        ("(on a b) (on c d) (down b) (down d) (clear a) (clear c)", "(on a d) (on c b)", 6),
        ("(on a b) (down b) (clear a)", "(on b a)", 4),
    ],
)
def test_what_must_be_done_twice_is_counted_twice(start, goal, length):
    names = " ".join(name for name in "abcd" if f" {name}" in start)
    text = f"""(define (problem p) (:domain blocks) (:objects {names})
      (:init {start} (empty)) (:goal (and {goal})))"""
    task = load(BLOCKS, text)
    assert cheapest(task) == length == bound_of(task)


def test_blocks_are_proven_without_a_search(shared_data):
    folder = shared_data / "pddl" / "blocks"
    task = load(folder / "domain.pddl", folder / "probBLOCKS-12-0.pddl")
    result = plan(task, planner="astar", max_seconds=60)
    assert validate(task, result.actions) == [] and len(result.actions) == 34


def test_what_is_proven_at_once_is_the_optimum():
    proven = 0
    for seed in range(300):
        task = random_variables_task(seed)
        found = proven_cheapest(task, max_expansions=10_000)
        if found.plan is not None or found.is_proof:
            best = cheapest(task)
            proven += best is not None
            cost = None if found.plan is None else int(task.costs[found.plan].sum())
            assert cost == best, seed
    assert proven > 20
