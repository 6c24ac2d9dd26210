"""The lifted records of a planning task: what PDDL says before roles are filled."""

from dataclasses import dataclass, field

Atom = tuple[str, ...]
Types = tuple[str, ...]


@dataclass(frozen=True)
class Schema:
    """An action with its roles still empty: the script that is the action's significance.

    roles: (variable, types) in order. conditions, negative_conditions, adds, deletes: atoms over
      variables and constants.
    equalities: (one, other, whether they must be equal). costs: the summands of the action's cost,
      numbers or function atoms;
    None where the schema says nothing of a cost.
    """

    name: str
    roles: tuple[tuple[str, Types], ...]
    conditions: tuple[Atom, ...] = ()
    negative_conditions: tuple[Atom, ...] = ()
    equalities: tuple[tuple[str, str, bool], ...] = ()
    adds: tuple[Atom, ...] = ()
    deletes: tuple[Atom, ...] = ()
    costs: tuple[int | Atom, ...] | None = None


@dataclass(frozen=True)
class Domain:
    """What holds for every problem: types {type: parents}, constants {name: types}, predicates
    {name: types of its roles}.
    """

    name: str
    types: dict[str, Types]
    constants: dict[str, Types]
    predicates: dict[str, tuple[Types, ...]]
    functions: dict[str, tuple[Types, ...]]
    schemas: tuple[Schema, ...]

    def is_a(self, given: Types, wanted: Types) -> bool:
        """Whether an object of the types `given` may fill a role of the types `wanted`."""
        if given == wanted or "object" in wanted:
            return bool(given)
        seen, waiting = set(), list(given)
        while waiting:
            kind = waiting.pop()
            if kind in wanted:
                return True
            if kind not in seen:
                seen.add(kind)
                waiting += self.types.get(kind, ())
        return False


@dataclass(frozen=True)
class Problem:
    """One task of a domain: objects {name: types} (constants included), start and goal atoms,
    values of the cost functions.

    file, start_line: where its start is written, for messages.
    """

    name: str
    objects: dict[str, Types]
    start: frozenset[Atom]
    goal: tuple[Atom, ...]
    negative_goal: tuple[Atom, ...] = ()
    values: dict[Atom, int] = field(default_factory=dict)
    counts_costs: bool = False
    file: str = field(default="<problem>", compare=False)
    start_line: int | None = field(default=None, compare=False)
