"""The paper's words with their numbers, and how near one gets."""

import math

import numpy as np
import pytest

from srt_jax import approach, explain, explanation, make_task, solve, stack
from srt_jax.answers.measures import length_text, turn_text


@pytest.mark.parametrize(
    ("length", "unit", "text"),
    [
        (1.0, "cells", "1 cell"),
        (3.1999, "cells", "3.2 cells"),
        (120.0, "cells", "120 cells"),
        (0.05, "m", "0.05 m"),
        (26.949, "m", "26.95 m"),
        (1234.56, "m", "1234.6 m"),
    ],
)
def test_lengths_have_the_digits_that_matter(length, unit, text):
    assert length_text(length, unit) == text


@pytest.mark.parametrize(
    ("degrees", "text"),
    [
        (-40.2, "40 degrees to the right"),
        (1.0, "1 degree to the left"),
        (0.3, "straight ahead"),
        (179.8, "straight behind"),
        (-180.0, "straight behind"),
        (-179.0, "179 degrees to the right"),
    ],
)
def test_turns_name_a_side(degrees, text):
    assert turn_text(math.radians(degrees)) == text


def test_the_numbers_are_those_of_the_nearest_point():
    free = np.ones((40, 40), bool)
    free[10, :] = False
    task = make_task(free, (30, 20), (2, 38))
    solution = solve(task)
    goal = explanation(task, solution, cell_side=0.5)["goal"]
    assert goal["away"] == pytest.approx(math.hypot(28, 18) * 0.5)
    assert math.degrees(goal["turn"]) == pytest.approx(-math.degrees(math.atan2(18, 28)))
    text = explain(task, solution, cell_side=0.5)
    assert "close, ahead-right: 16.64 m, 33 degrees to the right" in text
    # the wall straight ahead: of its contour the cell (11, 20) is nearest
    assert "close, ahead: 9.50 m, straight ahead" in text
    # looking there, it is ahead
    assert "straight ahead" in explain(task, solution, heading=90 - 32.735)


def walled(start, goal):
    free = np.ones((9, 9), bool)
    free[:, 4] = False
    return make_task(free, start, goal, destroyable=False)


def test_what_is_not_solved_says_how_near_one_gets():
    task = walled((1, 1), (7, 7))
    solution = solve(task)
    text = explain(task, solution, cell_side=2.0)
    # from (7, 3) to (7, 7) it is 4 cells; the way there has 2 diagonal moves and 4 straight ones
    assert "the agent gets within 8.00 m of the goal, to (7, 3), where it is cut off" in text
    assert text.endswith(
        "As near as one gets: (7, 3), 8.00 m from the goal, by a route 13.66 m long."
    )
    assert explain(task, solution, cell_side=2.0, approach=approach(task)) == text
    near = explanation(task, solution)["approach"]
    assert near == {
        "begin": [1, 1],
        "end": [7, 3],
        "gap": 4.0,
        "length": pytest.approx(4 + 2 * 2**0.5),
        "num_cells": 7,
    }


def test_from_a_blocked_start_it_says_where_it_begins():
    task = walled((3, 4), (7, 7))
    assert explain(task, solve(task)).endswith(
        "As near as one gets: from (3, 3), the free cell nearest the start, to (7, 3), 4 cells from"
        " the goal, by a route 4 cells long."
    )
    near = walled((3, 4), (3, 0))
    assert explain(near, solve(near)).endswith(
        "from (3, 3), the free cell nearest the start, a path leads to the goal, 3 cells long."
    )
    none = make_task(np.zeros((2, 2), bool), (0, 0), (1, 1))
    assert explain(none, solve(none)).endswith("No cell of the map is free.")
    assert explanation(none, solve(none))["approach"] is None


def test_a_batch_takes_a_batch_of_approaches():
    tasks = stack([walled((1, 1), (7, 7)), walled((1, 1), (7, 2)), walled((2, 4), (7, 7))])
    solutions = solve(tasks)
    assert explain(tasks, solutions, approach=approach(tasks)) == explain(tasks, solutions)
    nears = [data["approach"] for data in explanation(tasks, solutions)]
    assert [near is None for near in nears] == [False, True, False]
