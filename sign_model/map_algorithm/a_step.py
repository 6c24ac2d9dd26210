"""Rates situations on the host: the A-step for one task, by the tables of `landmarks` (PY16
§3.1)."""

from collections.abc import Callable

import numpy as np

from sign_model.bits import any_row, pack, popcount
from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.heuristics import HeuristicSign, Weights, weight_of
from sign_model.map_algorithm.landmarks import landmark_table, relaxed_plan_table
from sign_model.map_algorithm.regression import RegressionSpace

Rating = Callable[[np.ndarray], np.ndarray]
"""Situations, bool [N, F] -> ratings, int32 [N]; a low rating is near the start."""


def kind_of(atom: tuple[str, ...]) -> str:
    """Returns the predicate of a feature; a complement counts as a predicate of its own,
    "not-p".
    """
    return atom[0] if atom[0] != "not" else f"not-{atom[1]}"


def make_rating(
    sign: HeuristicSign,
    space: RegressionSpace,
    start: np.ndarray,
    goal: np.ndarray,
    schemas: list[str],
    clock: Clock = NO_LIMIT,
    tables: dict[str, np.ndarray] | None = None,
) -> Rating:
    """Returns the rating of situations of one task by a heuristic sign.

    Args:
      sign: the weights.
      space: the kept features and actions.
      start, goal: bool [F], over the kept features.
      schemas: the name of each kept action's schema.
      clock: asked while the tables are made, and before each rating.
      tables: those made before for the same space and start, by the name of the count; it takes in
        the new ones.
    """
    tables = {} if tables is None else tables
    # The tables that the sign reads, with a weight for each column.
    kinds = [kind_of(atom) for atom in space.features]
    goal_kinds = {kinds[i] for i in np.flatnonzero(goal)}
    parts = []
    if any(sign.landmarks.values()):
        if "landmarks" not in tables:
            tables["landmarks"] = landmark_table(space, start, clock)
        weights = _column_weights(sign.landmarks, kinds, goal_kinds)
        parts.append((tables["landmarks"], weights))
    if any(sign.plan.values()):
        if "plan" not in tables:
            tables["plan"] = relaxed_plan_table(space, start, clock)
        parts.append((tables["plan"], _column_weights(sign.plan, schemas, set())))

    # The weight of each feature itself; and for each table the columns of equal weight, as masks.
    held, unmet = (
        _column_weights(weights, kinds, goal_kinds) for weights in (sign.held, sign.unmet)
    )
    feature_weights = np.where(start, held, unmet)
    classes = [  # no np.unique: it loads numpy.ma, which takes longer than a small task
        (table, [(w, pack(columns == w)) for w in sorted(set(columns.tolist())) if w])
        for table, columns in parts
    ]

    def rate(situations: np.ndarray) -> np.ndarray:
        clock.check()
        rating = (situations @ feature_weights).astype(np.int32)
        owner, member = np.nonzero(situations)
        for table, masks in classes:
            needs = any_row(table, owner, member, len(situations))
            for weight, mask in masks:
                rating += np.int32(weight) * popcount(needs & mask)
        return rating

    return rate


def _column_weights(weights: Weights, names: list[str], goal_names: set[str]) -> np.ndarray:
    """Returns the weight of each column, int64 [n], from the name of its predicate or schema."""
    known = {name: weight_of(weights, name, goal_names) for name in set(names)}
    return np.array([known[name] for name in names], np.int64)
