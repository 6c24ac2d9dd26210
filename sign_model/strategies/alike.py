"""Objects alike: exchanging two of them changes neither what can be done nor what is wanted, so of
all situations that differ only by such an exchange one needs to be looked at.

Two balls that belong in the same room are alike, wherever they lie, and so are two hands, or two
trucks of equal room: the situation stands for where they are. Each class of objects is sorted by
what holds of its members. That is an exchange of objects whatever else it is, hence no plan is lost
by it; where objects of two classes are tied to each other it may find less than all exchanges.
"""

from collections.abc import Sequence

import numpy as np

from sign_model.bits import WORD, pack
from sign_model.pddl.lifted import Atom
from sign_model.pddl.planning_task import PlanningTask

_ROUNDS = 2
"""How often all classes are sorted: what holds of a hand depends on the order of the balls."""


class Alike:
    """The classes of objects alike in one task, for a search towards its goal.

    Args:
      task: with names; without them nothing is alike.

    Attributes:
      classes: the objects of each class, at least two.
    """

    def __init__(self, task: PlanningTask) -> None:
        number_of = {atom: i for i, atom in enumerate(task.features)}
        tables = {}
        for members in _classes(task, number_of):
            table = _table(members, task.features, number_of)
            if table is not None and table.shape[1]:
                tables[members] = table
        self.classes, self.tables = tuple(tables), tuple(tables.values())

    def __bool__(self) -> bool:
        return bool(self.classes)

    def canonical(self, states: np.ndarray) -> np.ndarray:
        """Returns the situations, bool [N, F], each with its objects alike in order."""
        states = states.copy()
        for _ in range(_ROUNDS if len(self.tables) > 1 else 1):
            for table in self.tables:
                states[:, table] = _sorted(states[:, table])
        return states


def _sorted(rows: np.ndarray) -> np.ndarray:
    """Returns bool [N, members, M] with the members of each situation in order."""
    size = rows.shape[2]
    if size <= WORD:
        places = np.arange(size, dtype=np.uint64)
        words = rows @ (np.uint64(1) << places)
        if (words[:, 1:] >= words[:, :-1]).all():
            return rows
        words.sort(axis=1)
        return (words[:, :, None] >> places & np.uint64(1)).astype(bool)
    words = pack(rows)
    order = np.argsort(words[:, :, -1], axis=1, kind="stable")
    for w in range(words.shape[2] - 2, -1, -1):
        column = np.take_along_axis(words[:, :, w], order, axis=1)
        order = np.take_along_axis(order, np.argsort(column, axis=1, kind="stable"), axis=1)
    return np.take_along_axis(rows, order[:, :, None], axis=1)


def _classes(task: PlanningTask, number_of: dict[Atom, int]) -> list[tuple[str, ...]]:
    """Returns the classes of two objects or more; objects are compared with the first of each."""
    if task.problem is None:
        return []
    actions = set(task.actions)
    features_of, actions_of = _by_object(task.features), _by_object(task.actions)
    goal = {atom for atom, is_goal in zip(task.features, task.goal) if is_goal}

    def is_alike(one: str, other: str) -> bool:
        swap = {one: other, other: one}
        for atom in {*features_of.get(one, ()), *features_of.get(other, ())}:
            image = (atom[0], *[swap.get(x, x) for x in atom[1:]])
            if image not in number_of or (atom in goal) != (image in goal):
                return False
        return all(
            (action[0], *[swap.get(x, x) for x in action[1:]]) in actions
            for action in {*actions_of.get(one, ()), *actions_of.get(other, ())}
        )

    # Only objects of one type, in as many features, goals and actions, can be alike.
    candidates: dict[tuple, list[list[str]]] = {}
    for name in sorted(task.problem.objects):
        mine = features_of.get(name, [])
        if not mine:
            continue
        kind = (
            task.problem.objects[name],
            len(mine),
            len(actions_of.get(name, ())),
            sum(atom in goal for atom in mine),
        )
        groups = candidates.setdefault(kind, [])
        for group in groups:
            if is_alike(group[0], name):
                group.append(name)
                break
        else:
            groups.append([name])
    return [tuple(group) for groups in candidates.values() for group in groups if len(group) > 1]


def _by_object(atoms: Sequence[Atom]) -> dict[str, list[Atom]]:
    """Returns the atoms in which each object occurs."""
    found: dict[str, list[Atom]] = {}
    for atom in atoms:
        for name in set(atom[1:]):
            found.setdefault(name, []).append(atom)
    return found


def _table(
    members: tuple[str, ...], features: Sequence[Atom], number_of: dict[Atom, int]
) -> np.ndarray | None:
    """Returns int [members, M]: what holds of each, in one order; None where a feature ties two of
    them together.
    """
    first, others = members[0], set(members[1:])
    columns = []
    for atom in features:
        count = sum(name == first for name in atom[1:])
        if count and (count > 1 or any(name in others for name in atom[1:])):
            return None
        if count:
            columns.append(
                [
                    number_of[(atom[0], *[name if x == first else x for x in atom[1:]])]
                    for name in members
                ]
            )
    return np.array(columns, np.int64).reshape(-1, len(members)).T
