"""What features cost from many states at once if nothing were ever deleted, and the relaxed plans
that these costs select.

One column per state, so every operation is one pass over contiguous rows. The fixpoint is
incremental: a sweep evaluates only the actions of which a condition became cheaper in some state,
and those only from the sweep on in which all their conditions were reached in some state. Where
costs are small they are whole numbers of 16 bits, which quarters the memory that a sweep moves;
sums that reach their limit are recognised, and then nothing is called unreachable.
"""

from typing import NamedTuple

import numpy as np

from sign_model.clock import NO_LIMIT, Clock

_FAR = 1 << 14
"""Stands for infinity among costs of 16 bits: the sum of two stays below 2^16."""

_ACTIONS_AT_ONCE = 1 << 13
"""How many actions of all states are evaluated at once: bounds the memory."""


_FEW = 1 << 14
"""How many numbers reduceat combines faster than rounds of whole rows."""


class RelaxedPlans(NamedTuple):
    """The actions of the relaxed plans of many states, one entry for each: int [P] all.

    owner: the number of the state, not sorted.
    action: the number of the action.
    ready: what the conditions of the action cost together: those of less can go first.
    """

    owner: np.ndarray
    action: np.ndarray
    ready: np.ndarray


class RelaxedCosts:
    """The delete relaxation of one task.

    Args:
      conditions, adds: bool [A, F].
      costs: of the actions, whole numbers [A].
      is_sum: whether the conditions of an action cost their sum (h_add), else their maximum
        (h_max).
      clock: asked in every sweep; OutOfTime once its limit has passed.
    """

    def __init__(
        self,
        conditions: np.ndarray,
        adds: np.ndarray,
        costs: np.ndarray,
        *,
        is_sum: bool = True,
        clock: Clock = NO_LIMIT,
    ) -> None:
        self.clock, self.combine = clock, np.add if is_sum else np.maximum
        self.num_actions, self.num_features = conditions.shape

        # Whole numbers of 16 bits if even dear actions leave room for sums; else floats, in which
        # whole numbers up to 2^24 or 2^53 are exact.
        if costs.max(initial=0) <= 16 and is_sum:
            self.dtype, self.far = np.dtype(np.uint16), np.uint16(_FAR)
        else:
            self.dtype = np.dtype(np.float32 if costs.sum() < 1 << 24 else np.float64)
            self.far = self.dtype.type(np.inf)
        self.costs = costs.astype(self.dtype)

        # Both matrices as lists of numbers, by row and by column.
        clock.check()
        self.needs = Lists(conditions)
        self.gives = Lists(adds)
        clock.check()
        self.needed_by = self.needs.turned(self.num_features)
        self.given_by = self.gives.turned(self.num_features)
        self.most = int(self.needs.count.max(initial=0))
        self.without_needs = np.flatnonzero(self.needs.count == 0)

        # The k-th condition of the actions that have one, with as many conditions or more.
        self.padded = np.zeros((self.num_actions, max(1, self.most)), np.int64)
        rows = np.repeat(np.arange(self.num_actions), self.needs.count)
        self.padded[rows, np.arange(len(rows)) - self.needs.first[rows]] = self.needs.members

    def from_states(self, states: np.ndarray) -> np.ndarray:
        """Returns the cost of each feature from each state, [F, N]; `far` or more where it cannot
        be reached.

        Ends: costs only fall, and take finitely many values.

        Args:
          states: bool [N, F].
        """
        cost = np.where(states.T, self.dtype.type(0), self.far)
        changed = np.flatnonzero(states.any(axis=0))
        was_reached = np.zeros(self.num_features, bool)
        missing = self.needs.count.copy()
        waiting = self.without_needs
        while len(changed) or len(waiting):
            self.clock.check()

            # The actions that can go in some state, and of which a condition has changed.
            new = changed[~was_reached[changed]]
            was_reached[new] = True
            missing -= np.bincount(self.needed_by.of(new), minlength=self.num_actions)
            is_touched = np.zeros(self.num_actions, bool)
            is_touched[self.needed_by.of(changed)] = True
            is_touched &= missing == 0
            is_touched[waiting] = True
            waiting = waiting[:0]
            touched = np.flatnonzero(is_touched)

            # What they add becomes as cheap as they are.
            is_changed = np.zeros(self.num_features, bool)
            for i in range(0, len(touched), _ACTIONS_AT_ONCE):
                is_changed[self._lowered(cost, touched[i : i + _ACTIONS_AT_ONCE])] = True
            changed = np.flatnonzero(is_changed)
        return cost

    def _lowered(self, cost: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Lowers the costs, [F, N], of what the actions, int [n], add, and returns the features
        that became cheaper in some state.
        """
        value = self._values(cost, actions)
        of_action = np.repeat(np.arange(len(actions)), self.gives.count[actions])
        features = self.gives.of(actions)
        is_use = value.min(axis=1)[of_action] < cost.max(axis=1)[features]
        features, of_action = features[is_use], of_action[is_use]
        order = np.argsort(features, kind="stable")
        features, rows = _folded(np.minimum, value, features[order], of_action[order])
        known = cost[features]
        is_lower = (rows < known).any(axis=1)
        features = features[is_lower]
        cost[features] = np.minimum(rows[is_lower], known[is_lower])
        return features

    def _values(self, cost: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Returns what the conditions of each action and the action itself cost, [n, N]."""
        value = np.zeros((len(actions), cost.shape[1]), self.dtype)
        counts = self.needs.count[actions]
        for k in range(int(counts.max(initial=0))):
            if (counts > k).all():
                self.combine(value, cost[self.padded[actions, k]], out=value)
            else:
                rows = np.flatnonzero(counts > k)
                value[rows] = self.combine(value[rows], cost[self.padded[actions[rows], k]])
            if k:
                np.minimum(value, self.far, out=value)
        value += self.costs[actions, None]
        return np.minimum(value, self.far, out=value)

    def is_exact(self, cost: np.ndarray) -> bool:
        """Returns whether `far` in `cost` means unreachable: no sum has come near the limit."""
        if self.far != _FAR:
            return True
        highest = np.where(cost < self.far, cost, 0).max(initial=0)
        return int(highest) * max(1, self.most) + int(self.costs.max(initial=0)) < _FAR

    def relaxed_plans(self, states: np.ndarray, cost: np.ndarray, goal: np.ndarray) -> RelaxedPlans:
        """Returns the relaxed plans of states from which the goal can be reached: for each needed
        feature its cheapest achiever, ties to the lowest action.

        Ends: each feature of each state is needed once.

        Args:
          states: bool [N, F].
          cost: [F, N], from `from_states`.
          goal: the numbers of its features, int [G].
        """
        num_states = len(states)
        is_known = states.T.copy().ravel()  # by feature * num_states + state
        is_chosen = np.zeros(self.num_actions * num_states, bool)
        flat = cost.ravel()
        waiting = (goal[:, None] * num_states + np.arange(num_states)).ravel()
        parts = []
        while True:
            # The features needed now, each once.
            waiting = np.sort(waiting[~is_known[waiting]])
            waiting = waiting[_is_first(waiting)]
            if not len(waiting):
                break
            self.clock.check()
            is_known[waiting] = True
            feature, state = np.divmod(waiting, num_states)

            # Their achievers, the cheapest of each.
            count = self.given_by.count[feature]
            begin = np.concatenate([[0], np.cumsum(count)[:-1]])
            action = self.given_by.of(feature)
            of = np.repeat(np.arange(len(feature)), count)
            value = self._values_of_pairs(flat, action, state[of], num_states)
            best = np.minimum.reduceat(value + self.costs[action], begin)
            hits = np.flatnonzero(value + self.costs[action] == best[of])
            hits = hits[_is_first(of[hits])]
            action, state, value = action[hits], state[of[hits]], value[hits]

            # Of the actions, those not chosen before, each once; then what they need.
            key = action * num_states + state
            order = np.argsort(key, kind="stable")
            order = order[_is_first(key[order])]
            order = order[~is_chosen[key[order]]]
            action, state, value = action[order], state[order], value[order]
            is_chosen[key[order]] = True
            parts.append((state, action, value))
            waiting = self.needs.of(action) * num_states + np.repeat(
                state, self.needs.count[action]
            )
        if not parts:
            empty = np.zeros(0, np.int64)
            return RelaxedPlans(empty, empty, empty)
        return RelaxedPlans(*(np.concatenate(part) for part in zip(*parts)))

    def _values_of_pairs(
        self, flat: np.ndarray, action: np.ndarray, state: np.ndarray, num_states: int
    ) -> np.ndarray:
        """Returns what the conditions of each action cost in one state, [P]."""
        wide = np.int64 if self.dtype == np.uint16 else self.dtype
        value = np.zeros(len(action), wide)
        counts = self.needs.count[action]
        for k in range(int(counts.max(initial=0))):
            rows = np.flatnonzero(counts > k)
            now = flat[self.padded[action[rows], k] * num_states + state[rows]]
            value[rows] = self.combine(value[rows], now)
        return value


class Lists:
    """The columns of the ones in each row of a matrix, bool [N, M], one list after another."""

    def __init__(self, matrix: np.ndarray) -> None:
        self.rows, self.members = np.nonzero(matrix)
        self._index(len(matrix))

    def _index(self, size: int) -> None:
        self.count = np.bincount(self.rows, minlength=size)
        self.first = np.cumsum(self.count) - self.count

    def turned(self, size: int) -> "Lists":
        """Returns the rows of the ones in each column, of which there are `size`."""
        other = object.__new__(Lists)
        order = np.argsort(self.members, kind="stable")
        other.rows, other.members = self.members[order], self.rows[order]
        other._index(size)
        return other

    def of(self, rows: np.ndarray) -> np.ndarray:
        """Returns the lists of some rows, int [n], one after another."""
        count = self.count[rows]
        total = int(count.sum())
        ends = np.cumsum(count)
        return self.members[np.arange(total) + np.repeat(self.first[rows] - ends + count, count)]

    def part(self, rows: np.ndarray, columns: np.ndarray, size: int) -> np.ndarray:
        """Returns some rows and columns of the matrix, bool [n, m], of its `size` columns."""
        place = np.full(size, -1)
        place[columns] = np.arange(len(columns))
        bits = np.zeros((len(rows), len(columns)), bool)
        row, column = np.repeat(np.arange(len(rows)), self.count[rows]), place[self.of(rows)]
        bits[row[column >= 0], column[column >= 0]] = True
        return bits


def _is_first(keys: np.ndarray) -> np.ndarray:
    """Returns bool [P]: whether each of ascending keys, int [P], differs from the one before."""
    is_first = np.ones(len(keys), bool)
    np.not_equal(keys[1:], keys[:-1], out=is_first[1:])
    return is_first


def _folded(
    operation: np.ufunc, values: np.ndarray, keys: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns (the keys, each once; for each the operation over its rows of `values`).

    Rows are combined two by two, half of them in each round: for wide rows that is faster than
    reduceat, which works element by element.

    Args:
      operation: of two arrays.
      values: [n, N].
      keys: int [P], ascending.
      rows: int [P], of `values`.
    """
    if len(keys) * values.shape[1] <= _FEW:
        begin = np.flatnonzero(_is_first(keys))
        if not len(begin):
            return keys, values[rows]
        return keys[begin], operation.reduceat(values[rows], begin, axis=0)
    current: np.ndarray | None = None
    while True:
        is_first = _is_first(keys)
        if is_first.all():
            return keys, values[rows] if current is None else current
        # The place of each row among those of its key; even places take in their successor.
        begin = np.flatnonzero(is_first)
        place = np.arange(len(keys)) - np.repeat(begin, np.diff(np.append(begin, len(keys))))
        even = np.flatnonzero(place % 2 == 0)
        has_next = np.zeros(len(keys), bool)
        has_next[:-1] = (keys[1:] == keys[:-1]) & (place[:-1] % 2 == 0)
        pairs = np.flatnonzero(has_next[even])
        source = values[rows] if current is None else current
        current = source[even]
        current[pairs] = operation(current[pairs], source[even[pairs] + 1])
        keys = keys[even]
