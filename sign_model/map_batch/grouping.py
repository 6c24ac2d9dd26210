"""Which tasks of a batch may ride together: those for which the search is the same whether they do
or not.

They share their features and actions; their goals name the same kinds of features (which a sign may
weigh) and depend on the same ones (all others are left out of the search). So an answer does not
depend on the tasks beside it. One thing is shared that is not looked at here: mutexes, which hold
for all starts of a group. Starts from which different pairs of features can ever come together
belong into batches of their own.
"""

import hashlib
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from sign_model.bits import any_row, pack, unpack
from sign_model.map_algorithm.rating import kind_of
from sign_model.pddl.planning_task import PlanningTask


def groups_of(tasks: Sequence[PlanningTask]) -> list[list[int]]:
    """Returns the numbers of the tasks group by group, each ascending; [] of no task."""
    alike: dict[bytes, list[int]] = defaultdict(list)
    known: dict[tuple[int, ...], bytes] = {}
    for number, task in enumerate(tasks):
        alike[_matrices(task, known)].append(number)
    groups = []
    for numbers in alike.values():
        parts: dict[bytes, list[int]] = defaultdict(list)
        for number, signature in zip(numbers, _signatures([tasks[i] for i in numbers])):
            parts[signature].append(number)
        groups += parts.values()
    return groups


def share_matrices(tasks: Sequence[PlanningTask]) -> bool:
    """Returns whether all tasks have the same features, actions and matrices."""
    known: dict[tuple[int, ...], bytes] = {}
    return len({_matrices(task, known) for task in tasks}) == 1


def _matrices(task: PlanningTask, known: dict[tuple[int, ...], bytes]) -> bytes:
    """A digest of features, actions and matrices; parts seen before (the same objects) are not read
    again.
    """
    parts = (task.features, task.actions, task.conditions, task.adds, task.deletes)
    key = tuple(map(id, parts))
    if key not in known:
        digest = hashlib.sha256(repr((task.features, task.actions)).encode())
        for matrix in parts[2:]:
            digest.update(np.packbits(matrix).tobytes())
        known[key] = digest.digest()
    return known[key]


def _signatures(tasks: Sequence[PlanningTask]) -> list[bytes]:
    """What the search for each goal depends on, of tasks with the same matrices."""
    if len(tasks) == 1 or not tasks[0].num_features:
        return [b""] * len(tasks)
    goals = np.stack([task.goal for task in tasks])
    kinds = np.array([kind_of(atom) for atom in tasks[0].features])
    named = pack(
        np.stack([goals[:, kinds == kind].any(axis=1) for kind in np.unique(kinds)], axis=1)
    )
    owner, member = np.nonzero(goals)
    relevant = any_row(_closure(tasks[0]), owner, member, len(tasks))
    return [row.tobytes() for row in np.concatenate([named, relevant], axis=1)]


def _closure(task: PlanningTask) -> np.ndarray:
    """uint64 [F, F / 64]: what some chain of actions towards each feature can need, itself
    included. Ends: it only grows.
    """
    feature_of, achievers = np.nonzero(task.adds.T)
    size = task.num_features
    owner, member = np.nonzero(
        unpack(any_row(pack(task.conditions), feature_of, achievers, size), size)
    )
    table = pack(np.eye(size, dtype=bool))
    while True:
        grown = table | any_row(table, owner, member, size)
        if np.array_equal(grown, table):
            return table
        table = grown
