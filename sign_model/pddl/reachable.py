"""Which ground actions can ever be carried out: the roles of the schemas filled by joins over what
can come to hold.

Facts come to hold one after the other, those of the start first; deletes are ignored. Each new fact
is matched with every condition that it can meet, and the action's other conditions are looked up in
indexes of the facts that hold so far, always the condition with the fewest candidates next. So no
binding that breaks a condition is ever completed, and the work grows with the partial bindings that
hold, not with the combinations of objects.

Objects are numbers here, facts are (predicate, object, ...) and a condition's variables are the
numbers of the action's roles; a constant c is written as -1 - c.
"""

import operator
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence

from sign_model.clock import Clock
from sign_model.pddl.lifted import Atom, Domain, Problem, Schema

Fact = tuple
"""(predicate, object number, ...)."""

Binding = tuple[int, ...]
"""The number of the object in each role."""

_OPEN = -1
_CHECKED_EVERY = 1 << 10


class TooManyActions(ValueError):
    """More ground actions than the limit. The message begins with what is too many; whoever
    catches it adds the file.
    """


class Template:
    """An atom of a schema: predicate, and for each place the number of a role, or -1 - the number
    of a constant.

    fill: gives the fact that the atom is under a binding.
    """

    __slots__ = ("fill", "places", "predicate")

    def __init__(self, atom: Atom, role_of: dict[str, int], number: dict[str, int]) -> None:
        self.predicate = atom[0]
        self.places = tuple(role_of[x] if x in role_of else -1 - number[x] for x in atom[1:])
        self.fill = _filler(self.predicate, self.places)


def _filler(predicate: str, places: tuple[int, ...]) -> Callable[[Binding], Fact]:
    """Filling is the innermost work of grounding: each kind of atom has its shortest way."""
    if not places:
        fact = (predicate,)
        return lambda binding: fact
    if min(places) < 0:
        return lambda binding: (
            predicate,
            *[binding[place] if place >= 0 else -1 - place for place in places],
        )
    if len(places) == 1:
        place = places[0]
        return lambda binding: (predicate, binding[place])
    pick = operator.itemgetter(*places)
    return lambda binding: (predicate, *pick(binding))


class Script:
    """A schema over numbers.

    conditions: the positive conditions. adds, deletes, negative: atoms; `negative` those that
      actions can change.
    fits: for each role the numbers of the objects of its types, as a set. equalities: (place, other
      place, whether equal).
    """

    def __init__(
        self,
        schema: Schema,
        domain: Domain,
        problem: Problem,
        number: dict[str, int],
        fluents: set[str],
    ) -> None:
        self.schema = schema
        role_of = {role: i for i, (role, _) in enumerate(schema.roles)}

        def templates(atoms: Iterable[Atom]) -> tuple[Template, ...]:
            return tuple(Template(atom, role_of, number) for atom in dict.fromkeys(atoms))

        self.conditions = templates(schema.conditions)
        self.negative = templates(atom for atom in schema.negative_conditions if atom[0] in fluents)
        self.forbidden = templates(
            atom for atom in schema.negative_conditions if atom[0] not in fluents
        )
        self.adds, self.deletes = templates(schema.adds), templates(schema.deletes)
        self.equalities = [
            (*[role_of[x] if x in role_of else -1 - number[x] for x in (one, other)], wanted)
            for one, other, wanted in schema.equalities
        ]
        self.fits: list[frozenset[int]] = []
        known: dict[tuple, frozenset[int]] = {}
        for _, kinds in schema.roles:
            if kinds not in known:
                is_kind = {
                    given: domain.is_a(given, kinds) for given in set(problem.objects.values())
                }
                known[kinds] = frozenset(
                    number[name] for name, given in problem.objects.items() if is_kind[given]
                )
            self.fits.append(known[kinds])


class _Facts:
    """The facts that hold so far, and indexes of them by the objects at some of their places."""

    def __init__(self) -> None:
        self.known: dict[str, set[Fact]] = defaultdict(set)
        self.indexes: dict[str, dict[tuple[int, ...], dict[Binding, list[Fact]]]] = defaultdict(
            dict
        )

    def add(self, fact: Fact) -> None:
        self.known[fact[0]].add(fact)
        for places, index in self.indexes[fact[0]].items():
            index.setdefault(tuple([fact[place + 1] for place in places]), []).append(fact)

    def candidates(
        self, predicate: str, places: tuple[int, ...], objects: Binding
    ) -> Sequence[Fact]:
        """The facts of a predicate that have these objects at these places."""
        index = self.indexes[predicate].get(places)
        if index is None:
            index = self.indexes[predicate][places] = {}
            for fact in self.known[predicate]:
                index.setdefault(tuple([fact[place + 1] for place in places]), []).append(fact)
        return index.get(objects, ())


class Reachability:
    """The fixpoint: which bindings of each script can ever be carried out, and which facts can ever
    hold.

    bindings: for each script the bindings found. facts: all facts of changeable predicates that can
      hold.
    """

    def __init__(
        self,
        scripts: Sequence[Script],
        start: Iterable[Fact],
        fluents: set[str],
        most: int,
        clock: Clock,
    ) -> None:
        self.scripts, self.most, self.clock = scripts, most, clock
        self.bindings: list[dict[Binding, None]] = [{} for _ in scripts]
        self.facts: set[Fact] = set()
        self._held = _Facts()
        self._steps = 0
        self._num_actions = 0
        self._waiting: list[Fact] = []
        self._gone: set[Fact] = set()  # what some action can take away
        self._until_gone: dict[Fact, list[tuple[int, Binding]]] = defaultdict(list)
        self._missing: dict[tuple[int, Binding], int] = {}
        triggers: dict[str, list[tuple[int, int]]] = defaultdict(list)
        for i, script in enumerate(scripts):
            for c, condition in enumerate(script.conditions):
                if condition.predicate in fluents:
                    triggers[condition.predicate].append((i, c))
        for number, fact in enumerate(start):
            if not number % _CHECKED_EVERY:
                clock.check()
            if fact[0] in fluents:
                self._reach(fact)
            else:
                self._held.add(fact)
        self._start = frozenset(self.facts)
        for i, script in enumerate(scripts):
            if not any(condition.predicate in fluents for condition in script.conditions):
                self._take(
                    i, self._join(script, [_OPEN] * len(script.fits), range(len(script.conditions)))
                )
        self._exhaust(triggers)

    def _exhaust(self, triggers: dict[str, list[tuple[int, int]]]) -> None:
        """Takes the waiting facts one by one, and every action of which one is the last condition.

        Ends: a fact enters once, and there are finitely many.

        Args:
          triggers: by predicate, the scripts and their conditions that a fact of it can meet.
        """
        while self._waiting:
            fact = self._waiting.pop()
            self._held.add(fact)
            for i, c in triggers[fact[0]]:
                script = self.scripts[i]
                if (
                    values := _matched(
                        script, script.conditions[c], fact, [_OPEN] * len(script.fits)
                    )
                ) is not None:
                    others = [o for o in range(len(script.conditions)) if o != c]
                    self._take(i, self._join(script, values, others))

    def _reach(self, fact: Fact) -> None:
        if fact not in self.facts:
            self.facts.add(fact)
            self._waiting.append(fact)

    def _tick(self) -> None:
        self._steps += 1
        if not self._steps % _CHECKED_EVERY:
            self.clock.check()

    def _take(self, number: int, found: Iterator[Binding]) -> None:
        """Notes new bindings; each acts at once, or when what must not hold can have been taken
        away.
        """
        script = self.scripts[number]
        for binding in found:
            if binding in self.bindings[number] or (number, binding) in self._missing:
                continue
            self._count(script)
            holding = {
                fact for fact in (t.fill(binding) for t in script.negative) if fact in self._start
            } - self._gone
            if holding:
                self._missing[number, binding] = len(holding)
                for fact in holding:
                    self._until_gone[fact].append((number, binding))
            else:
                self._act(number, binding)

    def _count(self, script: Script) -> None:
        self._num_actions += 1
        if self._num_actions > self.most:
            raise TooManyActions(
                f"more than {self.most:,} ground actions, most of them of"
                f" '{self._largest(script)}': name fewer objects, or give the actions conditions on"
                " what never changes, so that fewer objects fit their parameters"
            )

    def _largest(self, script: Script) -> str:
        counts = [len(bindings) for bindings in self.bindings]
        return (
            self.scripts[counts.index(max(counts))].schema.name
            if any(counts)
            else script.schema.name
        )

    def _act(self, number: int, binding: Binding) -> None:
        """Carries out an action, and all that then can go because it took something away."""
        ready = [(number, binding)]
        while ready:
            number, binding = ready.pop()
            self.bindings[number][binding] = None
            adds = [template.fill(binding) for template in self.scripts[number].adds]
            for fact in adds:
                self._reach(fact)
            for template in self.scripts[number].deletes:
                fact = template.fill(binding)
                if fact in self._gone or fact in adds:
                    continue
                self._gone.add(fact)
                for waiting in self._until_gone.pop(fact, ()):
                    self._missing[waiting] -= 1
                    if not self._missing[waiting]:
                        del self._missing[waiting]
                        ready.append(waiting)

    def _join(
        self, script: Script, values: list[int], conditions: Iterable[int]
    ) -> Iterator[Binding]:
        """All bindings that extend `values` and meet the conditions in the facts that hold so
        far.
        """
        stack: list[tuple[list[int], list[int]]] = [(values, list(conditions))]
        while stack:
            self._tick()
            values, rest = stack.pop()
            best: Sequence[Fact] | None = None
            chosen, open_ = -1, []
            for c in rest:
                condition = script.conditions[c]
                bound = [
                    (i, values[p] if p >= 0 else -1 - p) for i, p in enumerate(condition.places)
                ]
                bound = [(i, x) for i, x in bound if x != _OPEN]
                objects = tuple([x for _, x in bound])
                if len(bound) == len(condition.places):
                    if (condition.predicate, *objects) not in self._held.known[condition.predicate]:
                        break
                    continue
                found = self._held.candidates(
                    condition.predicate, tuple([i for i, _ in bound]), objects
                )
                if not found:
                    break
                open_.append(c)
                if best is None or len(found) < len(best):
                    best, chosen = found, c
            else:
                if best is None:
                    yield from self._completed(script, values)
                    continue
                rest = [c for c in open_ if c != chosen]
                for fact in best:
                    more = _matched(script, script.conditions[chosen], fact, list(values))
                    if more is not None:
                        stack.append((more, rest))

    def _completed(self, script: Script, values: list[int]) -> Iterator[Binding]:
        """Fills the roles that no condition names with every object of their types."""
        # those of constants alone are tested nowhere else
        stack = [values] if _keeps_equalities(script, values) else []
        while stack:
            self._tick()
            values = stack.pop()
            role = next((i for i, value in enumerate(values) if value == _OPEN), None)
            if role is None:
                binding = tuple(values)
                if not any(
                    t.fill(binding) in self._held.known[t.predicate] for t in script.forbidden
                ):
                    yield binding
                continue
            choices: Iterable[int] = script.fits[role]
            forced = _forced(script, values, role)
            if forced is not None:
                choices = {forced} & script.fits[role]
            for choice in choices:
                more = list(values)
                more[role] = choice
                if _keeps_equalities(script, more):
                    stack.append(more)


def _forced(script: Script, values: list[int], role: int) -> int | None:
    """The object that an equality demands in an open role; None where none does."""
    for one, other, wanted in script.equalities:
        for side, opposite in ((one, other), (other, one)):
            if wanted and side == role:
                value = values[opposite] if opposite >= 0 else -1 - opposite
                if value != _OPEN:
                    return value
    return None


def _matched(
    script: Script, condition: Template, fact: Fact, values: list[int]
) -> list[int] | None:
    """`values` with the roles of a condition filled from a fact; None where types, repetitions
    or equalities forbid it.
    """
    for place, found in zip(condition.places, fact[1:]):
        if place < 0:
            if -1 - place != found:
                return None
        elif values[place] == _OPEN:
            if found not in script.fits[place]:
                return None
            values[place] = found
        elif values[place] != found:
            return None
    return values if _keeps_equalities(script, values) else None


def _keeps_equalities(script: Script, values: list[int]) -> bool:
    for one, other, wanted in script.equalities:
        left, right = (values[x] if x >= 0 else -1 - x for x in (one, other))
        if left != _OPEN and right != _OPEN and (left == right) != wanted:
            return False
    return True
