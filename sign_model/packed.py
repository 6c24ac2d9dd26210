"""A regression space packed for the batched search: words of 32 bits, padded to a bucket of shapes, the batch last.

    adds, bad           uint32 [A, W]     tested against every situation (M-step)
    keeps, needs        uint32 [W, A]     gathered by action number (P-step)
    landmarks           uint32 [F, S, B]  bit j of row f: column j is needed on every way from the start to f (A-step)

The tables are arguments of the jitted search, not constants: one compilation serves every domain of the same bucket.
"""

from collections import defaultdict
from typing import NamedTuple

import jax
import numpy as np

from sign_model.heuristics import HeuristicSign, weight_of
from sign_model.rating import kind_of
from sign_model.regression import RegressionSpace

Array = jax.Array | np.ndarray

WORD = 32
MAX_WEIGHT = 15
"""Weights are read as 4 binary digits: a weighted count is then a few popcounts."""


class Tables(NamedTuple):
    """A domain in a bucket: F = 32 W features, A actions, S words of landmark columns. Feature F means "none".

    Padding actions add nothing, hence are never relevant. P: the most conditions of an action.
    """

    adds: Array  # uint32 [A, W]
    bad: Array  # uint32 [A, W]
    keeps: Array  # uint32 [W, A], what of a situation the action leaves to be explained
    needs: Array  # uint32 [W, A]
    need_lists: Array  # int32 [A, P]
    achievers: tuple[tuple[Array, Array], ...]  # (features int32 [n], actions int32 [n, 1 | 2 | 4 ...])
    column_features: Array  # int32 [32 S]
    column_own: Array  # uint32 [F + 1, S]
    column_adds: Array  # uint32 [A, S]


class SignWeights(NamedTuple):
    """A heuristic sign's weights, by column, feature and action of one `Tables`; 0 on padding."""

    landmarks: Array  # int32 [32 S]
    held: Array  # int32 [F]
    unmet: Array  # int32 [F]
    plan: Array  # int32 [A]


def pack_words(bits: np.ndarray, num_words: int) -> np.ndarray:
    """Returns bool [..., n] as uint32 [..., num_words], bit i % 32 of word i // 32."""
    padded = np.zeros((*bits.shape[:-1], num_words * WORD), np.uint8)
    padded[..., : bits.shape[-1]] = bits
    return np.packbits(padded, axis=-1, bitorder="little").view("<u4").astype(np.uint32)


def words_for(count: int) -> int:
    """Returns how many words hold `count` bits, at least one."""
    return max(1, -(-count // WORD))


def landmark_columns(space: RegressionSpace, signs: tuple[HeuristicSign, ...], goal_kinds: set[str]) -> np.ndarray:
    """Returns the numbers of the features that some sign counts as landmarks: the others need no column."""
    counted = {kind for kind in map(kind_of, space.features) for s in signs if weight_of(s.landmarks, kind, goal_kinds)}
    return np.flatnonzero([kind_of(atom) in counted for atom in space.features])


def make_tables(space: RegressionSpace, columns: np.ndarray) -> Tables:
    """Returns the tables of a space whose landmark columns are the features `columns`."""
    num_actions, num_features = space.conditions.shape
    num_words, num_columns = words_for(num_features), words_for(len(columns))
    padded_actions, none = words_for(num_actions) * WORD, words_for(num_features) * WORD

    def padded(rows: np.ndarray, fill: int = 0) -> np.ndarray:
        return np.concatenate([rows, np.full((padded_actions - num_actions, *rows.shape[1:]), fill, rows.dtype)])

    need_lists = np.full((padded_actions, max(1, int(space.conditions.sum(axis=1).max(initial=0)))), none, np.int32)
    for action, row in enumerate(space.conditions):
        held = np.flatnonzero(row)
        need_lists[action, : len(held)] = held
    own = np.zeros((none + 1, len(columns)), bool)
    own[columns, np.arange(len(columns))] = True
    column_features = np.full(num_columns * WORD, none, np.int32)
    column_features[: len(columns)] = columns
    adds = pack_words(space.adds, num_words)
    return Tables(
        adds=padded(adds),
        bad=padded(pack_words(space.bad, num_words)),
        keeps=np.ascontiguousarray(~padded(adds).T),
        needs=np.ascontiguousarray(padded(pack_words(space.conditions, num_words)).T),
        need_lists=need_lists,
        achievers=_achievers(space.adds, none + 1),
        column_features=column_features,
        column_own=pack_words(own, num_columns),
        column_adds=padded(pack_words(space.adds[:, columns], num_columns)),
    )


def _achievers(adds: np.ndarray, dropped: int) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """The achievers of each feature, features of 1, 2, 3-4, 5-8 ... achievers together: no long loop, little padding."""
    buckets: dict[int, list[tuple[int, np.ndarray]]] = defaultdict(list)
    for feature in range(adds.shape[1]):
        actions = np.flatnonzero(adds[:, feature])
        if len(actions):
            width = 1 << (len(actions) - 1).bit_length()
            buckets[width].append((feature, np.pad(actions, (0, width - len(actions)), mode="edge")))
    out = []
    for width, rows in sorted(buckets.items()):
        size = -(-len(rows) // 8) * 8  # padded rows point past the end: the scatter drops them
        features, actions = np.full(size, dropped, np.int32), np.zeros((size, width), np.int32)
        features[: len(rows)] = [feature for feature, _ in rows]
        actions[: len(rows)] = [achievers for _, achievers in rows]
        out.append((features, actions))
    return tuple(out)


def make_weights(
    sign: HeuristicSign, space: RegressionSpace, columns: np.ndarray, schemas: list[str], goal_kinds: set[str]
) -> SignWeights:
    """Returns the weights of a sign as the kernel reads them; ValueError for one above `MAX_WEIGHT`."""
    kinds = [kind_of(atom) for atom in space.features]
    for weights in (sign.landmarks, sign.plan, sign.held, sign.unmet):
        for name, weight in weights.items():
            if not 0 <= weight <= MAX_WEIGHT:
                raise ValueError(f"weight {weight} of '{name}' in sign '{sign.name}' must lie between 0 and {MAX_WEIGHT}")

    def spread(weights, names, size):
        out = np.zeros(size, np.int32)
        out[: len(names)] = [weight_of(weights, name, goal_kinds) for name in names]
        return out

    size = words_for(len(kinds)) * WORD
    return SignWeights(
        landmarks=spread(sign.landmarks, [kinds[c] for c in columns], words_for(len(columns)) * WORD),
        held=spread(sign.held, kinds, size),
        unmet=spread(sign.unmet, kinds, size),
        plan=spread(sign.plan, schemas, words_for(len(schemas)) * WORD),
    )
