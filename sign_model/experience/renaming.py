"""Which object of a task plays which role of a precedent: a bounded backtracking search, and
colours that prune it.

A renaming maps roles to objects one to one. It is found atom by atom: every atom that the precedent
needs must have its image in the start of the task, and every atom of the goal of the task must be
the image of something that the precedent brought about. The atom with the fewest names still
unbound is matched next, so most atoms are mere tests. The order is fixed, hence the answer is
deterministic.
"""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import NamedTuple

Atom = tuple[str, ...]
"""A predicate and its arguments."""

Bindings = list[tuple[str, str]]
"""Pairs (role, object)."""


def colours(
    objects: Mapping[str, Iterable[str]], facts: Mapping[str, Iterable[Atom]]
) -> dict[str, str]:
    """Returns a colour for each object, equal for objects that a renaming could exchange; {}
    without objects.

    Colour refinement: objects start with the colour of their types and are distinguished, round by
    round, by the atoms in which they occur and by the colours of the other arguments. Equal colours
    are necessary for a renaming, not sufficient.

    Args:
      objects: {name: types}.
      facts: {tag: atoms}, such as the atoms of start and goal.
    """
    colour = {name: _digest(sorted(types)) for name, types in objects.items()}
    # Ends: every round but the last splits a class of equal colours.
    for _ in range(len(colour)):
        # Where each object occurs, and beside which colours.
        occurrences: dict[str, list] = {name: [] for name in colour}
        for tag, atoms in facts.items():
            for predicate, *places in atoms:
                beside = [colour.get(x, x) for x in places]
                for place, name in enumerate(places):
                    if name in occurrences:
                        occurrences[name].append((tag, predicate, place, beside))
        # No class was split: these colours are final.
        finer = {name: _digest((colour[name], sorted(occurrences[name]))) for name in colour}
        if len(set(finer.values())) == len(set(colour.values())):
            return finer
        colour = finer
    return colour


def find_renaming(
    needs: Iterable[Atom],
    start: Iterable[Atom],
    goal: Iterable[Atom],
    gives: Iterable[Atom],
    *,
    may_play: Callable[[str, str], bool],
    max_nodes: int,
) -> dict[str, str] | None:
    """Returns {role: object} such that every renamed need lies in `start` and every atom of the
    goal among the renamed `gives`; None if none was found.

    Args:
      needs, gives: atoms over the roles of a precedent: what it needs and what it brings about.
      start, goal: atoms over the objects of a task.
      may_play: whether a role may be played by an object.
      max_nodes: how many atoms may be matched before giving up.
    """
    demands = [_Demand(False, atom) for atom in sorted(goal)]
    demands += [_Demand(True, atom) for atom in sorted(needs)]
    return _Match(_Facts(start), _Facts(gives), may_play).search(demands, max_nodes)


def rename(atom: Atom, renaming: Mapping[str, str]) -> Atom:
    """Returns the atom (or ground action) with its objects renamed; its first word stays."""
    return (atom[0], *(renaming.get(name, name) for name in atom[1:]))


class _Demand(NamedTuple):
    """An atom to be matched: a need of the precedent (over roles), or a goal of the task (over
    objects).
    """

    is_need: bool
    atom: Atom


class _Choice(NamedTuple):
    """A demand that is matched at present."""

    demand: _Demand
    place: int  # where it was in the list of open demands
    ways: Iterator[Bindings]  # those not tried yet
    bindings: Bindings  # made for it


class _Facts:
    """Atoms indexed by predicate and arity, and by each argument and its place."""

    def __init__(self, atoms: Iterable[Atom]) -> None:
        self.by: dict[tuple, list[Atom]] = defaultdict(list)
        for atom in sorted(atoms):
            kind = (atom[0], len(atom))
            self.by[kind].append(atom)
            for place, name in enumerate(atom[1:]):
                self.by[*kind, place, name].append(atom)

    def candidates(self, atom: Atom, known: Mapping[str, str]) -> list[Atom]:
        """Returns the shortest list of the index that holds every atom that `atom` could be renamed
        to, when the names in `known` are bound.
        """
        kind = (atom[0], len(atom))
        keys = [
            kind,
            *((*kind, place, known[name]) for place, name in enumerate(atom[1:]) if name in known),
        ]
        return min((self.by.get(key, []) for key in keys), key=len)


class _Match:
    """A backtracking search for a one-to-one renaming: the bindings made so far, both ways."""

    def __init__(self, start: _Facts, gives: _Facts, may_play: Callable[[str, str], bool]) -> None:
        self.start, self.gives, self.may_play = start, gives, may_play
        self.object_of: dict[str, str] = {}
        self.role_of: dict[str, str] = {}

    def search(self, demands: list[_Demand], max_nodes: int) -> dict[str, str] | None:
        """Returns the first renaming that meets all demands; None if there is none, or `max_nodes`
        atoms were matched.
        """
        open_demands = list(demands)
        choices: list[_Choice] = []
        nodes = 0
        # Ends: the ways of each demand are finite, and the number of nodes is bounded.
        while open_demands:
            # Match the demand with the fewest unbound names next, the first of several.
            place = min(range(len(open_demands)), key=lambda i: self.num_open(open_demands[i]))
            demand = open_demands.pop(place)
            choices.append(_Choice(demand, place, self.ways(demand), []))

            # Backtrack while the last choice has no way left.
            while (new := next(choices[-1].ways, None)) is None:
                failed = choices.pop()
                open_demands.insert(failed.place, failed.demand)
                if not choices:
                    return None
                self.unbind(choices[-1].bindings)

            # Take the next way of the last choice.
            nodes += 1
            if nodes > max_nodes:
                return None
            self.bind(new)
            choices[-1].bindings[:] = new
        return dict(self.object_of)

    def num_open(self, demand: _Demand) -> int:
        """Returns how many names of a demand are not bound yet."""
        known = self.object_of if demand.is_need else self.role_of
        return sum(name not in known for name in demand.atom[1:])

    def ways(self, demand: _Demand) -> Iterator[Bindings]:
        """Yields the new bindings of each way to meet the demand."""
        is_need, atom = demand
        facts, known = (self.start, self.object_of) if is_need else (self.gives, self.role_of)
        for other in list(facts.candidates(atom, known)):
            new = self.unify(atom[1:], other[1:]) if is_need else self.unify(other[1:], atom[1:])
            if new is not None:
                yield new

    def unify(self, roles: Atom, objects: Atom) -> Bindings | None:
        """Returns the new bindings that map the roles to the objects, place by place; None if the
        bindings made so far, the types or the one-to-one rule forbid it.
        """
        new: dict[str, str] = {}
        for role, name in zip(roles, objects):
            bound = self.object_of.get(role, new.get(role))
            if (
                bound is None
                and name not in self.role_of
                and name not in new.values()
                and self.may_play(role, name)
            ):
                new[role] = name
            elif bound != name:
                return None
        return list(new.items())

    def bind(self, bindings: Bindings) -> None:
        """Adds bindings."""
        for role, name in bindings:
            self.object_of[role] = name
            self.role_of[name] = role

    def unbind(self, bindings: Bindings) -> None:
        """Removes bindings, and empties their list."""
        for role, name in bindings:
            del self.object_of[role], self.role_of[name]
        bindings.clear()


def _digest(value: object) -> str:
    """Returns a short digest of a value: a colour."""
    return hashlib.blake2b(repr(value).encode(), digest_size=8).hexdigest()
