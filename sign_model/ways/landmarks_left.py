"""How many landmarks of the goal are left on a path: a rating of situations with their past.

A landmark is left if it was never reached, or if it has gone since and is needed again: it belongs
to the goal, or all scripts that bring about a landmark never reached need it (Richter & Westphal
2010).

Objects alike give landmarks that no single feature is: whichever truck carries it, a parcel is
carried by some. So for each set of features that differ only by such an object "one of them holds"
is a feature of its own.
"""

from dataclasses import dataclass

import numpy as np

from sign_model.bits import any_row, pack, popcount, unpack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.landmarks import landmark_table


@dataclass(frozen=True)
class _Scripts:
    conditions: np.ndarray
    adds: np.ndarray


class LandmarksLeft:
    """The landmarks of one task, F features and one more for each of D sets of features.

    Args:
      conditions, adds: bool [A, F].
      start, goal: bool [F].
      tables: for each class of objects alike, the features of its members, int [members, M]: each
        column is a set.
      clock: asked while the landmarks are found.
    """

    def __init__(
        self,
        conditions: np.ndarray,
        adds: np.ndarray,
        start: np.ndarray,
        goal: np.ndarray,
        *,
        tables: tuple[np.ndarray, ...] = (),
        clock: Clock = NO_LIMIT,
    ) -> None:
        self.tables = tables
        self.size = len(start) + sum(table.shape[1] for table in tables)
        wide = _Scripts(self.seen_in(conditions), self.seen_in(adds))
        begin = self.seen_in(start[None])[0]
        table = landmark_table(wide, begin, clock)
        needed = np.bitwise_or.reduce(table[np.flatnonzero(goal)], axis=0, initial=np.uint64(0))
        self.numbers = np.flatnonzero(unpack(needed, self.size))
        wanted = np.zeros(self.size, bool)
        wanted[: len(goal)] = goal
        self.goal = pack(wanted)

        # What all achievers of each landmark need.
        shared = np.zeros((len(self.numbers), self.size), bool)
        for row, feature in zip(shared, self.numbers):
            clock.check()
            achievers = np.flatnonzero(wide.adds[:, feature])
            row[:] = len(achievers) > 0
            for i in range(0, len(achievers), 256):
                row &= wide.conditions[achievers[i : i + 256]].all(axis=0)
                if not row.any():
                    break
        self.shared = pack(shared)

    def seen_in(self, rows: np.ndarray) -> np.ndarray:
        """Returns sets of features, bool [N, F], with the sets of alike ones, bool [N, F + D]."""
        return np.concatenate(
            [rows, *[rows[:, table].any(axis=1) for table in self.tables]], axis=1
        )

    def left(self, states: np.ndarray, reached: np.ndarray) -> np.ndarray:
        """Returns how many are left, int [N].

        Args:
          states: bool [N, F].
          reached: uint64 [N, W], packed from `seen_in`: what has held on the path to each, itself
            included.
        """
        is_new = ~unpack(reached, self.size)[:, self.numbers]
        owner, member = np.nonzero(is_new)
        again = any_row(self.shared, owner, member, len(states)) | self.goal
        gone = reached & ~pack(self.seen_in(states))
        return is_new.sum(axis=1) + popcount(again & gone)
