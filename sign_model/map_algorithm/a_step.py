"""Rates situations on the host: the A-step for one task, by the tables of `landmarks` (PY16
§3.1)."""

from collections.abc import Callable

import numpy as np

from sign_model.bits import WORD, UnionOfRows, pack, popcount, unpack
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

    # The features themselves are columns too, each needed by itself alone.
    held, unmet = (
        _column_weights(weights, kinds, goal_kinds) for weights in (sign.held, sign.unmet)
    )
    own = np.where(start, held, unmet)
    if own.any():
        parts.append((pack(np.eye(len(own), dtype=bool)), own))
    table, weights = _by_weight(parts, len(own))
    union = UnionOfRows(table)

    def rate(situations: np.ndarray) -> np.ndarray:
        clock.check()
        rating = np.zeros(len(situations), np.int32)
        if weights:
            needs = union.of(situations)
            for weight, begin, end in weights:
                rating += np.int32(weight) * popcount(needs[:, begin:end])
        return rating

    return rate


def _by_weight(
    parts: list[tuple[np.ndarray, np.ndarray]], num_rows: int
) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
    """Returns (a table of the columns that count, those of equal weight in words of their own;
    the weight of each such run of words, and where it begins and ends).

    Most columns of a relaxed plan's table are empty: no more actions than features are the best
    for one of them. So the new table has a few words where the old one may have a hundred.

    Args:
      parts: tables, uint64 [F, words], each with the weights of its columns, int [n].
      num_rows: F.
    """
    by_weight: dict[int, list[np.ndarray]] = {}
    for table, weights in parts:
        is_used = unpack(np.bitwise_or.reduce(table, axis=0), len(weights)) & (weights != 0)
        used = np.flatnonzero(is_used)
        bits = (table[:, used // WORD] >> (used % WORD).astype(np.uint64)) & np.uint64(1)
        for weight in sorted(set(weights[used].tolist())):
            by_weight.setdefault(weight, []).append(bits[:, weights[used] == weight])
    words, runs, end = [np.zeros((num_rows, 0), np.uint64)], [], 0
    for weight, columns in sorted(by_weight.items()):
        words.append(pack(np.concatenate(columns, axis=1).astype(bool)))
        begin, end = end, end + words[-1].shape[1]
        runs.append((weight, begin, end))
    return np.concatenate(words, axis=1), runs


def _column_weights(weights: Weights, names: list[str], goal_names: set[str]) -> np.ndarray:
    """Returns the weight of each column, int64 [n], from the name of its predicate or schema."""
    known = {name: weight_of(weights, name, goal_names) for name in set(names)}
    return np.array([known[name] for name in names], np.int64)
