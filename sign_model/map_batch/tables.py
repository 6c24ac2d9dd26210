"""A regression space packed for the batched search: words of 32 bits, padded to one of few shapes
(a bucket), with the batch as the last axis.

    explains, breaks    uint32 [F, A / 32]  OR-ed over the features of a situation (M-step)
    keeps, needs        uint32 [W, A]       gathered by action number (P-step)
    landmarks           uint32 [F, S, B]    bit j of row f: the feature of column j is needed on
                                            every way from the start to f (A-step)

The tables are arguments of the jitted search, not constants: one compilation serves every domain of
the same bucket. Landmarks depend on the start; `start_tables` makes them inside the search.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sign_model.foundation.records import Array
from sign_model.foundation.sizes import next_power_of_two
from sign_model.foundation.words import WORD, num_words, pack_rows
from sign_model.map_algorithm.a_step import kind_of
from sign_model.map_algorithm.heuristics import HeuristicSign, Weights, weight_of
from sign_model.map_algorithm.regression import RegressionSpace

MAX_WEIGHT = 15
"""The largest weight: weights are read as 4 binary digits, so a weighted count is a few popcounts.
"""


class Tables(NamedTuple):
    """A domain in a bucket: F = 32 W features, A actions, S words of landmark columns, at most P
    conditions per action. Feature F means "none".

    Padding actions add nothing, hence are never relevant.
    """

    explains: Array  # uint32 [F, A / 32], bit a of row f: action a adds f
    breaks: Array  # uint32 [F, A / 32], bit a of row f: a situation with f cannot follow action a
    keeps: Array  # uint32 [W, A], what of a situation the action does not explain
    needs: Array  # uint32 [W, A], the conditions of the action
    deletes: Array  # uint32 [W, A], what the action takes away when a plan is replayed
    need_lists: Array  # int32 [A, P], the conditions of the action as numbers, F after the last
    # int32 [n, 4] each: fours of actions, then fours of those fours, and so on
    achievers: tuple[Array, ...]
    # int32 [F + 1], the four that covers all achievers of a feature, numbered through all levels
    achieved_at: Array
    column_features: Array  # int32 [32 S], the feature of each landmark column
    column_own: Array  # uint32 [F + 1, S], bit j of row f: column j stands for f itself
    column_adds: Array  # uint32 [A, S], bit j of row a: action a adds the feature of column j


class SignWeights(NamedTuple):
    """A heuristic sign's weights, by column, feature and action of one `Tables`; 0 on padding."""

    landmarks: Array  # int32 [32 S]
    held: Array  # int32 [F]
    unmet: Array  # int32 [F]
    plan: Array  # int32 [A]


def landmark_columns(
    space: RegressionSpace, signs: tuple[HeuristicSign, ...], goal_kinds: set[str]
) -> np.ndarray:
    """Returns the numbers of the features that some sign counts as landmarks, int [n]: the others
    need no column.
    """
    relevant_kinds = {
        kind
        for kind in map(kind_of, space.features)
        for s in signs
        if weight_of(s.landmarks, kind, goal_kinds)
    }
    return np.flatnonzero([kind_of(atom) in relevant_kinds for atom in space.features])


def bucket(count: int) -> int:
    """Returns the least of the sizes 1 to 8, 10, 12, 14, 16, 20, 24, ... that holds `count`: few
    shapes to compile, and at most a quarter of padding.
    """
    step = max(1, 1 << ((count - 1).bit_length() - 3)) if count > 8 else 1
    return max(1, -(-count // step) * step)


def words_for(count: int) -> int:
    """Returns how many words the bucket of `count` bits has, at least one."""
    return bucket(num_words(count))


def make_tables(space: RegressionSpace, columns: np.ndarray) -> Tables:
    """Returns the tables of a space, padded to its bucket.

    Args:
      space: the regression space of a domain.
      columns: int [n], the features that get a landmark column, of `landmark_columns`.
    """
    num_actions, num_features = space.conditions.shape
    own_words, num_columns = words_for(num_features), words_for(len(columns))
    padded_actions, none = words_for(num_actions) * WORD, own_words * WORD

    def padded(rows: np.ndarray) -> np.ndarray:
        return np.concatenate(
            [rows, np.zeros((padded_actions - num_actions, *rows.shape[1:]), rows.dtype)]
        )

    # What the landmark columns stand for.
    own = np.zeros((none + 1, len(columns)), bool)
    own[columns, np.arange(len(columns))] = True
    column_features = np.full(num_columns * WORD, none, np.int32)
    column_features[: len(columns)] = columns

    def by_feature(matrix: np.ndarray) -> np.ndarray:
        rows = pack_rows(np.ascontiguousarray(matrix.T), padded_actions // WORD)
        return np.concatenate([rows, np.zeros((none - num_features, rows.shape[1]), np.uint32)])

    return Tables(
        explains=by_feature(space.adds),
        breaks=by_feature(space.bad),
        keeps=np.ascontiguousarray(~padded(pack_rows(space.adds, own_words)).T),
        needs=np.ascontiguousarray(padded(pack_rows(space.conditions, own_words)).T),
        deletes=np.ascontiguousarray(padded(pack_rows(space.deletes, own_words)).T),
        need_lists=_need_lists(space.conditions, padded_actions, none),
        **_achievers(space.adds, none),
        column_features=column_features,
        column_own=pack_rows(own, num_columns),
        column_adds=padded(pack_rows(space.adds[:, columns], num_columns)),
    )


def _need_lists(conditions: np.ndarray, num_rows: int, none: int) -> np.ndarray:
    """Returns the conditions of each action, bool [A, F], as a list, int32 [num_rows, P], padded
    with `none`.
    """
    most = next_power_of_two(int(conditions.sum(axis=1).max(initial=1)), 4)
    need_lists = np.full((num_rows, most), none, np.int32)
    for action, row in enumerate(conditions):
        members = np.flatnonzero(row)
        need_lists[action, : len(members)] = members
    return need_lists


def _achievers(adds: np.ndarray, none: int) -> dict[str, Any]:
    """Returns the fields `achievers` and `achieved_at` of `Tables`: the achievers of each feature,
    of adds bool [A, F], as a tree of fours (the last one repeated). It has few levels and little
    padding.
    """
    # The members of each feature that are still to be combined: actions, then fours of the level
    # before. Ends: each level divides their number by four.
    unfinished = {
        feature: np.flatnonzero(adds[:, feature])
        for feature in np.flatnonzero(adds.any(axis=0)).tolist()
    }
    levels, found_at, num_before = [], {}, 0
    while unfinished or len(levels) < 2:  # two at least: few shapes to compile
        fours, next_level = [], {}
        for feature, members in unfinished.items():
            rows = np.pad(members, (0, -len(members) % 4), mode="edge").reshape(-1, 4)
            if len(rows) == 1:
                found_at[feature] = num_before + len(fours)
            else:
                next_level[feature] = np.arange(len(fours), len(fours) + len(rows))
            fours += list(rows)
        level = np.zeros((next_power_of_two(len(fours), 8 if levels else 32), 4), np.int32)
        level[: len(fours)] = np.array(fours, np.int32).reshape(-1, 4)
        levels.append(level)
        num_before += len(level)
        unfinished = next_level
    # A feature without achiever points one past the last four.
    achieved_at = np.full(none + 1, num_before, np.int32)
    for feature, place in found_at.items():
        achieved_at[feature] = place
    return {"achievers": tuple(levels), "achieved_at": achieved_at}


def make_weights(
    sign: HeuristicSign,
    space: RegressionSpace,
    columns: np.ndarray,
    schemas: list[str],
    goal_kinds: set[str],
) -> SignWeights:
    """Returns the weights of a sign as the jitted search reads them.

    Args:
      sign: whose weights.
      space: whose features and actions they are spread over.
      columns: int [n], the features with a landmark column.
      schemas: the schema of each action of the space.
      goal_kinds: the predicates to which "@goal" applies.

    Raises:
      ValueError: a weight is negative or above `MAX_WEIGHT`.
    """
    # Every weight has the range of `MAX_WEIGHT`.
    kinds = [kind_of(atom) for atom in space.features]
    for weights in (sign.landmarks, sign.plan, sign.held, sign.unmet):
        for name, weight in weights.items():
            if not 0 <= weight <= MAX_WEIGHT:
                raise ValueError(
                    f"weight {weight} of '{name}' in sign '{sign.name}' must lie between 0 and"
                    f" {MAX_WEIGHT}: change it in the sign"
                )

    # The weights by column, feature and action, 0 on padding.
    def spread(weights: Weights, names: Sequence[str], size: int) -> np.ndarray:
        out = np.zeros(size, np.int32)
        out[: len(names)] = [weight_of(weights, name, goal_kinds) for name in names]
        return out

    size = words_for(len(kinds)) * WORD
    return SignWeights(
        landmarks=spread(
            sign.landmarks, [kinds[c] for c in columns], words_for(len(columns)) * WORD
        ),
        held=spread(sign.held, kinds, size),
        unmet=spread(sign.unmet, kinds, size),
        plan=spread(sign.plan, schemas, words_for(len(schemas)) * WORD),
    )
