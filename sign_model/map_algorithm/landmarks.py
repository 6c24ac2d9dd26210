"""What each feature needs, seen from the start: tables made once per task, by which every situation
is rated.

This is an advantage of regression: all situations are measured against one start, so a rating is an
OR of table rows and a count.

    landmarks     bit q of row f: feature q must become true on every way from the start to f, if
                  deletes are ignored
    relaxed plan  bit a of row f: action a belongs to the relaxed plan that h_add selects for f (the
                  FF heuristic, tabulated)
"""

from typing import Protocol

import numpy as np

from sign_model.bits import all_rows, any_row, pack
from sign_model.clock import NO_LIMIT, Clock


class Scripts(Protocol):
    """Actions as matrices, such as those of a `RegressionSpace`: bool [A, F] each."""

    @property
    def conditions(self) -> np.ndarray:
        """What each action needs."""
        ...

    @property
    def adds(self) -> np.ndarray:
        """What each action brings about."""
        ...


def landmark_table(space: Scripts, start: np.ndarray, clock: Clock = NO_LIMIT) -> np.ndarray:
    """Returns uint64 [F, ceil(F / 64)]: the landmarks of each feature, including itself; 0 for
    features that hold at the start, bool [F]. OutOfTime once the limit of the clock has passed.

    The greatest fixpoint of

        L[f] = {f} | AND over achievers a of f of ( adds of a | OR over conditions p of a of L[p] )

    for every f that does not hold at the start. The adds of an achiever belong to it: without them
    the table would miss the features that always come along with f. Ends: rows only shrink.
    """
    # The matrices as lists of pairs, and the table with every landmark.
    num_actions, num_features = space.conditions.shape
    condition_of, conditions = np.nonzero(space.conditions)
    feature_of, achievers = np.nonzero(space.adds.T)
    own = pack(np.eye(num_features, dtype=bool))
    comes_along = pack(space.adds & ~start)
    table = np.where(
        start[:, None], np.uint64(0), pack(np.ones((num_features, num_features), bool))
    )
    while True:
        # What each action needs, then what all achievers of a feature need.
        clock.check()
        need = any_row(table, condition_of, conditions, num_actions) | comes_along
        shared = (
            all_rows(need, feature_of, achievers, num_features)
            & pack(np.ones((1, num_features), bool))
            | own
        )
        new = np.where(start[:, None], np.uint64(0), shared)
        if (new == table).all():
            return table
        table = new


def relaxed_plan_table(space: Scripts, start: np.ndarray, clock: Clock = NO_LIMIT) -> np.ndarray:
    """Returns uint64 [F, ceil(A / 64)]: the actions of the relaxed plan of each feature; 0 for
    features that hold at the start, bool [F]. OutOfTime once the limit of the clock has passed.

    The best achiever of a feature is the one of least h_add cost; ties go to the lowest action.
    """
    # The best achiever of each feature, and the conditions of that action.
    num_actions, num_features = space.conditions.shape
    best = best_achievers(space, start, clock)
    known = np.flatnonzero(best >= 0)
    own = np.zeros((num_features, num_actions), bool)
    own[known, best[known]] = True
    own_words = pack(own)
    chosen_needs = np.zeros((num_features, num_features), bool)
    chosen_needs[known] = space.conditions[best[known]]
    owner, member = np.nonzero(chosen_needs)

    # The least fixpoint: the achiever and the relaxed plans of its conditions. Ends: rows only
    # grow.
    table = own_words
    while True:
        clock.check()
        new = any_row(table, owner, member, num_features) | own_words
        if (new == table).all():
            return table
        table = new


def best_achievers(space: Scripts, start: np.ndarray, clock: Clock = NO_LIMIT) -> np.ndarray:
    """Returns int [F]: the action of least h_add cost that adds each feature; -1 for features that
    hold at the start, bool [F], or can never be reached. OutOfTime once the limit of the clock has
    passed.
    """
    num_actions, num_features = space.conditions.shape
    condition_of, conditions = np.nonzero(space.conditions)
    feature_of, achievers = np.nonzero(space.adds.T)
    best = np.full(num_features, -1)
    if not len(feature_of):
        return best

    # The h_add costs of features and actions. Ends: costs only fall, and there are finitely many.
    first = np.flatnonzero(np.diff(feature_of, prepend=-1))
    cost = np.where(start, 0.0, np.inf)
    while True:
        clock.check()
        action_cost = 1.0 + np.bincount(
            condition_of, weights=cost[conditions], minlength=num_actions
        )
        cheapest = np.full(num_features, np.inf)
        cheapest[feature_of[first]] = np.minimum.reduceat(action_cost[achievers], first)
        new = np.minimum(cost, cheapest)
        if (new == cost).all():
            break
        cost = new

    # The achievers whose cost is that of their feature; of several the lowest.
    is_best = (
        (action_cost[achievers] == cost[feature_of])
        & np.isfinite(cost[feature_of])
        & ~start[feature_of]
    )
    lowest = np.flatnonzero(is_best)[::-1]  # written backwards: the lowest action remains
    best[feature_of[lowest]] = achievers[lowest]
    return best
