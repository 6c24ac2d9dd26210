"""A removal proof bounds every plan that moves obstacles: what is never moved might as well never
be destroyed.
"""

import heapq

import numpy as np
import pytest

from srt_jax import Status, make_task, solve

STRAIGHT = ((0, 1), (1, 0), (0, -1), (-1, 0))
DIAGONAL = ((1, 1), (1, -1), (-1, 1), (-1, -1))


def fewest_moved(walls, boxes, start, goal):
    """The least number of boxes that any plan of walking and pushing moves; None without a plan.

    A state is where the robot and the boxes are, and which have been moved: searched exhaustively.
    """

    def is_free(cell, where):
        inside = 0 <= cell[0] < walls.shape[0] and 0 <= cell[1] < walls.shape[1]
        return inside and not walls[cell] and cell not in where

    begin = (start, tuple(boxes), frozenset())
    best, queue, count = {begin: 0}, [(0, 0, begin)], 0
    while queue:
        moved, _, state = heapq.heappop(queue)
        robot, where, touched = state
        if robot == goal:
            return moved
        following = []
        for step in STRAIGHT + DIAGONAL:
            ahead = robot[0] + step[0], robot[1] + step[1]
            sides = ((robot[0], ahead[1]), (ahead[0], robot[1])) if step in DIAGONAL else ()
            if is_free(ahead, where) and all(is_free(side, where) for side in sides):
                following.append((ahead, where, touched))
            elif step in STRAIGHT and ahead in where:
                beyond = ahead[0] + step[0], ahead[1] + step[1]
                if is_free(beyond, where):
                    number = where.index(ahead)
                    pushed = (*where[:number], beyond, *where[number + 1 :])
                    following.append((ahead, pushed, touched | {number}))
        for new in following:
            cost = len(new[2])
            if cost < best.get(new, 1 << 30):
                best[new] = cost
                count += 1
                heapq.heappush(queue, (cost, count, new))
    return None


def scene(seed):
    """Walls, two or three boxes, start and goal on a map of 4 x 5, mostly cut in two."""
    rng = np.random.default_rng(seed)
    walls = rng.random((4, 5)) < 0.15
    walls[:, 2] |= rng.random(4) < 0.6
    free = [tuple(cell) for cell in np.argwhere(~walls).tolist()]
    middle = [cell for cell in free if cell[1] == 2] or free
    boxes = [middle[int(rng.integers(len(middle)))]]
    rest = [cell for cell in free if cell not in boxes]
    for i in rng.permutation(len(rest))[: 1 + seed % 2].tolist():
        boxes.append(rest[i])
    rest = [cell for cell in rest if cell not in boxes]
    return walls, boxes, min(rest, key=lambda c: c[1]), max(rest, key=lambda c: c[1])


@pytest.mark.parametrize("part", range(4))
def test_no_plan_that_pushes_boxes_moves_fewer_than_the_bound(part):
    tight = unsolvable = 0
    for seed in range(10 * part, 10 * part + 10):
        walls, boxes, start, goal = scene(seed)
        labels = np.full(walls.shape, -1, np.int32)
        for number, cell in enumerate(boxes):
            labels[cell] = number
        labels[walls] = len(boxes)
        flags = np.arange(len(boxes) + 1) < len(boxes)
        solution = solve(make_task(labels, start, goal, destroyable=flags))
        moved = fewest_moved(walls, boxes, start, goal)
        if Status(int(solution.status)) is Status.UNSOLVABLE:
            assert moved is None
            unsolvable += 1
        elif moved is not None:
            assert moved >= float(solution.removal_bound)
            tight += moved == float(solution.removal_bound) > 0
    assert tight + unsolvable > 0
