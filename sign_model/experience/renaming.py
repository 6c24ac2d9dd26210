"""Which object of a task plays which role of a precedent: a bounded backtracking match, and colours
that prune it.

A renaming is one to one. It is found atom by atom: an atom of the precedent must have its image in
the task's start, an atom of the task's goal must be the image of something the precedent brought
about. The atom with the fewest objects still open is settled next, so most are mere tests. The
order is fixed, hence so is the answer.
"""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping

Atom = tuple[str, ...]


def colours(
    objects: Mapping[str, Iterable[str]], facts: Mapping[str, Iterable[Atom]]
) -> dict[str, str]:
    """Returns a colour for each object, equal for objects that a renaming could exchange; {} where
    there is no object.

    Objects start with the colour of their types and are told apart, round by round, by the atoms in
    which they stand and the colours beside them (colour refinement). Equal colours are necessary
    for a renaming, not sufficient.

    Args:
      objects: {name: types}.
      facts: {tag: atoms}, such as the atoms of start and goal.
    """
    colour = {name: _digest(sorted(types)) for name, types in objects.items()}
    for _ in range(len(colour)):
        seen: dict[str, list] = {name: [] for name in colour}
        for tag, atoms in facts.items():
            for predicate, *places in atoms:
                beside = [colour.get(x, x) for x in places]
                for place, name in enumerate(places):
                    if name in seen:
                        seen[name].append((tag, predicate, place, beside))
        finer = {name: _digest((colour[name], sorted(seen[name]))) for name in colour}
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
    """Returns {role: object} with every need in `start` and every goal among what is given; None
    where none was found.

    Args:
      needs, gives: atoms over the roles of a precedent.
      start, goal: atoms over the objects of a task.
      may_play: whether a role may be played by an object.
      max_nodes: how many atoms may be tried before giving up.
    """
    demands = [(False, atom) for atom in sorted(goal)] + [(True, atom) for atom in sorted(needs)]
    return _Match(_Facts(start), _Facts(gives), may_play).search(demands, max_nodes)


def renamed(atom: Atom, renaming: Mapping[str, str]) -> Atom:
    """Returns the atom (or ground action) with its objects renamed; its first word stays."""
    return (atom[0], *(renaming.get(name, name) for name in atom[1:]))


class _Facts:
    """Atoms by predicate, arity and what stands in which place."""

    def __init__(self, atoms: Iterable[Atom]) -> None:
        self.by: dict[tuple, list[Atom]] = defaultdict(list)
        for atom in sorted(atoms):
            kind = (atom[0], len(atom))
            self.by[kind].append(atom)
            for place, name in enumerate(atom[1:]):
                self.by[*kind, place, name].append(atom)

    def fitting(self, atom: Atom, known: Mapping[str, str]) -> list[Atom]:
        """Returns the shortest list known to hold every atom that `atom` could be renamed to."""
        kind = (atom[0], len(atom))
        keys = [
            kind,
            *((*kind, place, known[name]) for place, name in enumerate(atom[1:]) if name in known),
        ]
        return min((self.by.get(key, []) for key in keys), key=len)


class _Match:
    def __init__(self, start: _Facts, gives: _Facts, may_play: Callable[[str, str], bool]) -> None:
        self.start, self.gives, self.may_play = start, gives, may_play
        self.object_of: dict[str, str] = {}
        self.role_of: dict[str, str] = {}

    def search(self, demands: list[tuple[bool, Atom]], max_nodes: int) -> dict[str, str] | None:
        open_demands = list(demands)
        tried: list[
            tuple[tuple[bool, Atom], int, Iterator[list[tuple[str, str]]], list[tuple[str, str]]]
        ] = []
        nodes = 0
        while open_demands:
            at = min(range(len(open_demands)), key=lambda i: self.num_open(open_demands[i]))
            demand = open_demands.pop(at)
            tried.append((demand, at, self.ways(demand), []))
            while (new := next(tried[-1][2], None)) is None:
                demand, at, _, _ = tried.pop()
                open_demands.insert(at, demand)
                if not tried:
                    return None
                self.unbind(tried[-1][3])
            nodes += 1
            if nodes > max_nodes:
                return None
            self.bind(new)
            tried[-1][3][:] = new
        return dict(self.object_of)

    def num_open(self, demand: tuple[bool, Atom]) -> int:
        is_need, atom = demand
        known = self.object_of if is_need else self.role_of
        return sum(name not in known for name in atom[1:])

    def ways(self, demand: tuple[bool, Atom]) -> Iterator[list[tuple[str, str]]]:
        """Yields the bindings (role, object), new ones only, of each way to meet the demand."""
        is_need, atom = demand
        facts, known = (self.start, self.object_of) if is_need else (self.gives, self.role_of)
        for other in list(facts.fitting(atom, known)):
            new = (
                self.unified(atom[1:], other[1:]) if is_need else self.unified(other[1:], atom[1:])
            )
            if new is not None:
                yield new

    def unified(self, roles: Atom, objects: Atom) -> list[tuple[str, str]] | None:
        """Returns the new bindings under which the roles become the objects; None where they
        cannot.
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

    def bind(self, bindings: list[tuple[str, str]]) -> None:
        for role, name in bindings:
            self.object_of[role] = name
            self.role_of[name] = role

    def unbind(self, bindings: list[tuple[str, str]]) -> None:
        for role, name in bindings:
            del self.object_of[role], self.role_of[name]
        bindings.clear()


def _digest(value: object) -> str:
    return hashlib.blake2b(repr(value).encode(), digest_size=8).hexdigest()
