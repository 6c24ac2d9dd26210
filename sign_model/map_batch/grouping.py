"""Which tasks of a batch may be searched together: those for which the search is the same whether
they are or not.

The tasks of a group share their features and actions; their goals name the same predicates (which a
sign may weigh) and depend on the same features (all others are left out of the search). So an
answer does not depend on the tasks beside it. One thing is shared that is not compared here:
mutexes, which hold for all starts of a group. Starts from which different pairs of features can
become true together belong in separate batches.
"""

import hashlib
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from sign_model.bits import any_row, pack, stacked, unpack
from sign_model.map_algorithm.a_step import kind_of
from sign_model.pddl.planning_task import PlanningTask


def groups_of(tasks: Sequence[PlanningTask]) -> list[list[int]]:
    """Returns the numbers of the tasks, group by group and ascending within each; [] without
    tasks.
    """
    # Equal features, actions and matrices first: that comparison is cheap.
    alike: dict[bytes, list[int]] = defaultdict(list)
    known: dict[tuple[int, ...], bytes] = {}
    for number, task in enumerate(tasks):
        alike[_matrices(task, known)].append(number)

    # Then goals that lead to the same search.
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
    """Returns a digest of features, actions and matrices. `known` holds the digests of earlier
    tasks by the identity of those parts: the same objects are not read again.
    """
    matrices = (task.conditions, task.adds, task.deletes)
    key = (id(task.features), id(task.actions), *map(id, matrices))
    if key not in known:
        digest = hashlib.sha256(repr((task.features, task.actions)).encode())
        for matrix in matrices:
            digest.update(np.packbits(matrix).tobytes())
        known[key] = digest.digest()
    return known[key]


def _signatures(tasks: Sequence[PlanningTask]) -> list[bytes]:
    """Returns for each task what its search depends on beside the matrices, which they share: the
    predicates of its goal, and the features that some chain of actions towards it can need.
    """
    if len(tasks) == 1 or not tasks[0].num_features:
        return [b""] * len(tasks)
    goals = stacked([task.goal for task in tasks])
    kinds = np.array([kind_of(atom) for atom in tasks[0].features])
    named = pack(
        np.stack([goals[:, kinds == kind].any(axis=1) for kind in np.unique(kinds)], axis=1)
    )
    owner, member = np.nonzero(goals)
    relevant = any_row(_closure(tasks[0]), owner, member, len(tasks))
    return [row.tobytes() for row in np.concatenate([named, relevant], axis=1)]


def _closure(task: PlanningTask) -> np.ndarray:
    """Returns uint64 [F, F / 64]: the features that some chain of actions towards each feature can
    need, itself included. Ends: the rows only grow.
    """
    feature_of, achievers = np.nonzero(task.adds.T)
    size = task.num_features
    owner, member = np.nonzero(
        unpack(any_row(pack(task.conditions), feature_of, achievers, size), size)
    )
    table = pack(np.eye(size, dtype=bool))
    while True:
        larger = table | any_row(table, owner, member, size)
        if np.array_equal(larger, table):
            return table
        table = larger
