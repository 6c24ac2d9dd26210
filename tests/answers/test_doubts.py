"""Answers to questions that were perhaps not meant so."""

import numpy as np

from srt_jax import Frame, make_task, solve
from srt_jax.answers.doubts import doubts_of
from srt_jax.task import NamedTask


def test_walls_that_are_destroyed_are_noted_where_the_map_names_no_obstacle():
    labels = np.full((9, 9), -1, np.int32)
    labels[:, 4] = labels[0] = 0  # a wall up to the edge
    box = labels.copy()
    box[4, 4] = 1  # in its door
    frame = Frame.of_cells(9, 9)
    wall = NamedTask("wall", make_task(labels, (4, 0), (4, 8)))
    door = NamedTask("door", make_task(box, (4, 0), (4, 8), destroyable=[1]))
    answers = [solve(wall.task), solve(door.task)]
    gone = [answer.destroyed[: int(answer.num_destroyed)].tolist() for answer in answers]
    assert gone == [[0], [1]]
    (note,) = doubts_of([wall, door], gone, [frame, frame])
    assert (note.count, note.example) == (1, "wall, obstacle 0") and "--labels" in note.what
    assert not len(doubts_of([wall], gone[:1], [None]))
