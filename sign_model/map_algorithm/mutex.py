"""Which features can never hold together: by reachability of pairs (h2), or by mutex groups if
there are too many pairs.

Regression depends on mutexes: most situations that look relevant from the goal can never be reached
from the start.
"""

from collections.abc import Sequence

import numpy as np

from sign_model.bits import any_row, pack, unpack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.lifted import Atom

MAX_PAIR_FEATURES = 3000
"""With more features than this, mutex groups replace the pair fixpoint (F^2 bits, many sweeps)."""

MAX_PAIR_WORDS = 1 << 19
"""With more words in a sweep than this, likewise: (A + F) F / 64."""


def mutexes(
    features: Sequence[Atom],
    conditions: np.ndarray,
    adds: np.ndarray,
    deletes: np.ndarray,
    starts: np.ndarray,
    clock: Clock = NO_LIMIT,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (mutex bool [F, F], usable bool [A]), valid for every situation reachable from any of
    the starts.

    A feature that is mutex with itself can never be reached; an action that is not usable can never
    be executed.

    Args:
      features: F atoms, used to guess groups.
      conditions, adds, deletes: bool [A, F].
      starts: bool [N, F].
      clock: asked in every sweep.
    """
    words = sum(conditions.shape) * len(features) // 64
    if len(features) <= MAX_PAIR_FEATURES and words <= MAX_PAIR_WORDS:
        return _by_pairs(conditions, adds, deletes, starts, clock)
    mutex = np.zeros((len(features), len(features)), bool)
    for group in mutex_groups(features, conditions, adds, deletes, starts, clock=clock):
        mutex |= np.outer(group, group)
    np.fill_diagonal(mutex, False)
    return mutex, ~np.any(clashes(conditions, mutex) & conditions, axis=1)


def clashes(conditions: np.ndarray, mutex: np.ndarray) -> np.ndarray:
    """Returns bool [A, F]: the features that exclude a condition of each action, from conditions
    [A, F] and mutex [F, F].
    """
    action_of, condition = np.nonzero(conditions)
    return unpack(any_row(pack(mutex), action_of, condition, len(conditions)), mutex.shape[0])


def _by_pairs(
    conditions: np.ndarray, adds: np.ndarray, deletes: np.ndarray, starts: np.ndarray, clock: Clock
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the same by the h2 fixpoint: pairs[p, q] grows from the pairs of the starts until no
    action adds a pair.

    A sweep is an OR of packed rows over the few conditions of each action, then over the few
    achievers of each feature: its cost grows with (A + F) F / 64, not with A F^2. Ends: pairs only
    grow.
    """
    # The matrices as lists of pairs and as words, and the pairs that hold in some start.
    size = adds.shape[1]
    if not size:
        return np.zeros((0, 0), bool), np.ones(len(adds), bool)
    feature_of, achievers = np.nonzero(adds.T)
    keeps, gives = ~pack(deletes), pack(adds)
    in_starts = pack(starts.T)
    # Not a matrix product: BLAS would start threads that compete for busy cores.
    pairs = np.stack([(row & in_starts).any(axis=1) for row in in_starts])
    while True:
        # An action is usable if its conditions can hold together. Feature q can hold after it if q
        # can hold beside the conditions and survives, or if the action adds q.
        clock.check()
        clash = clashes(conditions, ~pairs)
        usable = ~np.any(clash & conditions, axis=1)
        beside = (~pack(clash) & keeps) | gives
        beside[~usable] = 0
        # Such a q can then hold together with every feature that the action adds.
        new = unpack(any_row(beside, feature_of, achievers, size), size)
        larger = pairs | new | new.T
        if np.array_equal(larger, pairs):
            return ~pairs, usable
        pairs = larger


def mutex_groups(
    features: Sequence[Atom],
    conditions: np.ndarray,
    adds: np.ndarray,
    deletes: np.ndarray,
    starts: np.ndarray,
    max_parts: int = 4,
    clock: Clock = NO_LIMIT,
) -> list[np.ndarray]:
    """Returns groups, bool [F] each, of which at most one feature holds at any time; [] if no guess
    proves right.

    A guess is a set of parts (predicate, position): the features of the predicate whose argument at
    the position is the object of the group (position -1: all features of the predicate). It is
    right if every start has at most one feature of the group, and no executable action (one with at
    most one condition in the group) adds more features of the group than it deletes among its
    conditions. A wrong guess is extended by what the offending action deletes.

    Args:
      features, conditions, adds, deletes, starts: as in `mutexes`.
      max_parts: the most parts of a guess.
    """
    # The first guesses: every predicate with every position.
    kinds = sorted({_kind(atom) for atom in features})
    waiting = [
        frozenset([(kind, position)]) for kind in kinds for position in (-1, *range(1, kind[1]))
    ]
    taken = conditions & deletes
    needs = conditions.astype(np.float32)
    gain = adds.astype(np.float32) - taken.astype(np.float32)
    known, groups = set(waiting), []
    # Ends: no guess is tried twice, and the number of parts is bounded.
    while waiting:
        # The groups of this guess that hold at most once in every start.
        clock.check()
        parts = waiting.pop(0)
        members = np.array(_members(parts, features))
        members = members[
            (starts.astype(np.float32) @ members.T.astype(np.float32)).max(axis=0, initial=0) <= 1
        ]

        # By how many features of the group each action would increase it, [A, groups]. Two
        # conditions of one group never hold together, so such an action is never executable.
        as_columns = members.T.astype(np.float32)
        can_go = needs @ as_columns <= 1
        surplus = np.where(can_go, gain @ as_columns, np.float32(0))
        worst = surplus.max(axis=0, initial=0)
        groups += list(members[worst <= 0])

        # Extend a wrong guess.
        if (worst > 0).any() and len(parts) < max_parts:
            broken = int((worst > 0).argmax())
            for more in _extensions(
                parts, members[broken], taken[surplus[:, broken].argmax()], features
            ):
                if more not in known:
                    known.add(more)
                    waiting.append(more)
    return _maximal(groups)


def _kind(atom: Atom) -> tuple[str, int]:
    """Returns the predicate and the length of an atom; a complement counts as a predicate."""
    return (atom[0] if atom[0] != "not" else "not-" + atom[1], len(atom))


def _members(parts: frozenset, features: Sequence[Atom]) -> list[np.ndarray]:
    """Returns the groups of a guess, bool [F] each: one for each object at the positions of the
    parts, or a single one if all positions are -1.
    """
    positions = dict(parts)
    groups: dict[str, list[int]] = {}
    everywhere: list[int] = []
    for i, atom in enumerate(features):
        position = positions.get(_kind(atom))
        if position == -1:
            everywhere.append(i)
        elif position is not None:
            groups.setdefault(atom[position] if position else "", []).append(i)
    return [
        _vector(members + everywhere, len(features))
        for members in (groups.values() if groups else [[]])
    ]


def _vector(members: list[int], size: int) -> np.ndarray:
    """Returns a set of numbers as bool [size]."""
    out = np.zeros(size, bool)
    out[members] = True
    return out


def _extensions(
    parts: frozenset, group: np.ndarray, taken: np.ndarray, features: Sequence[Atom]
) -> list[frozenset]:
    """Returns the guess extended, in every way, by one part that contains a feature which the
    offending action needs and deletes.

    Args:
      parts: the guess.
      group: bool [F], the group that the action increases.
      taken: bool [F], the conditions that the action deletes.
      features: F atoms.
    """
    known = dict(parts)
    objects = {
        features[i][known[_kind(features[i])]]
        for i in np.flatnonzero(group).tolist()
        if known[_kind(features[i])] > 0
    }
    out = []
    for i in np.flatnonzero(taken & ~group).tolist():
        kind = _kind(features[i])
        if kind in known:
            continue
        positions = [p for p in range(1, kind[1]) if features[i][p] in objects] if objects else []
        out += [parts | {(kind, position)} for position in [*positions, -1]]
    return out


def _maximal(groups: list[np.ndarray]) -> list[np.ndarray]:
    """Returns the groups of two features or more that are included in no other, largest first."""
    kept: list[np.ndarray] = []
    for group in sorted(groups, key=lambda g: -int(g.sum())):
        if group.sum() > 1 and not any((group & ~other).sum() == 0 for other in kept):
            kept.append(group)
    return kept
