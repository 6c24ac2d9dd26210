"""How many landmarks of the goal are left on a path: a rating of situations with their past.

A landmark is left if it was never reached, or if it has gone since and is needed again: it belongs
to the goal, or all scripts that bring about a landmark never reached need it (Richter & Westphal
2010).
"""

import numpy as np

from sign_model.bits import any_row, pack, popcount, unpack
from sign_model.clock import NO_LIMIT, Clock
from sign_model.map_algorithm.landmarks import Scripts, landmark_table


class LandmarksLeft:
    """The landmarks of one task.

    Args:
      scripts: the actions of the task, over F features.
      start, goal: bool [F].
      clock: asked while the landmarks are found.
    """

    def __init__(
        self, scripts: Scripts, start: np.ndarray, goal: np.ndarray, clock: Clock = NO_LIMIT
    ) -> None:
        self.size, self.goal = len(start), pack(goal)
        table = landmark_table(scripts, start, clock)
        needed = np.bitwise_or.reduce(table[np.flatnonzero(goal)], axis=0, initial=np.uint64(0))
        self.numbers = np.flatnonzero(unpack(needed, self.size))

        # What all achievers of each landmark need.
        shared = np.zeros((len(self.numbers), self.size), bool)
        for row, feature in zip(shared, self.numbers):
            clock.check()
            achievers = np.flatnonzero(scripts.adds[:, feature])
            row[:] = len(achievers) > 0 and scripts.conditions[achievers].all(axis=0)
        self.shared = pack(shared)

    def left(self, states: np.ndarray, reached: np.ndarray) -> np.ndarray:
        """Returns how many are left, int [N].

        Args:
          states: bool [N, F].
          reached: uint64 [N, W], what has held on the path to each, itself included.
        """
        is_new = ~unpack(reached, self.size)[:, self.numbers]
        owner, member = np.nonzero(is_new)
        again = any_row(self.shared, owner, member, len(states)) | self.goal
        return is_new.sum(axis=1) + popcount(again & reached & ~pack(states))
