"""PDDL -> the lifted records of a planning task: typed STRIPS with constants, equality, negative
conditions and action costs.

    object -> its name, with its types            predicate -> name and the types of its roles
    action schema -> `Schema`: roles, conditions, effects as atoms over roles and constants
    start, goal -> sets of atoms (name, argument, ...)

What goes beyond STRIPS (`beyond` lists it) is refused by name. Every error is a `PddlError` of one
line: file, line, what is wrong, what to do. Where a domain declares no types, types that a problem
names all the same (some IPC blocks files do) are taken for `object`.

Costs are counted where the problem has (:metric minimize (total-cost)); no other metric is
understood. A cost is a whole number from 0 to 10^12, or a sum of functions of the action's
arguments that (:init ...) gives such numbers. A function that no action has as its cost is ignored,
whatever its numbers; a cost that (:init ...) does not give is no 0, but an error once an action
that can be carried out needs it (`grounding`).
"""

import pathlib
import re
from collections.abc import Iterator
from typing import NoReturn

from sign_model.clock import NO_LIMIT, Clock
from sign_model.pddl.beyond import FORMULAS, LOGIC, REQUIREMENTS, SECTIONS, TIMED
from sign_model.pddl.lifted import Atom, Domain, Problem, Schema, Types
from sign_model.pddl.syntax import Form, PddlError, Word, read_form, read_source

MAX_COST = 10**12
"""The greatest cost of one action. Sums of 9,000 such costs are exact in the float64 numbers of
the searches.
"""

_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?", re.ASCII)
_DOMAIN_PARTS = (":requirements", ":types", ":constants", ":predicates", ":functions", ":action")
_PROBLEM_PARTS = (":domain", ":requirements", ":objects", ":init", ":goal", ":metric", ":length")
_CHECKED_EVERY = 1 << 12


def parse(
    domain: str | pathlib.Path, problem: str | pathlib.Path, *, clock: Clock = NO_LIMIT
) -> tuple[Domain, Problem]:
    """Returns the domain and the problem read from two paths (or texts); PddlError names file, line
    and rule.

    OutOfTime is raised once the time of `clock` has passed.
    """
    domain_text, domain_file = read_source(domain)
    problem_text, problem_file = read_source(problem)
    if domain_file == problem_file == "<text>":
        domain_file, problem_file = "<domain>", "<problem>"
    domain_reader = _DomainReader(domain_text, domain_file, clock)
    problem_reader = _ProblemReader(problem_text, problem_file, clock)
    lifted = domain_reader.read(problem_reader.object_names())
    return lifted, problem_reader.read(lifted)


class _Reader:
    """What reading a domain and reading a problem share. `file` goes into every message."""

    def __init__(
        self, text: str, file: str, clock: Clock, kind: str, parts: tuple[str, ...]
    ) -> None:
        self.file, self.clock = file, clock
        # names of objects that belong to the problem, not to the domain
        self.foreign: frozenset[str] = frozenset()
        form = read_form(text, file, clock)
        if form.head != "define":
            self.fail("the file must begin with (define", form)
        if (
            len(form) < 2
            or not isinstance(form[1], Form)
            or form[1].head != kind
            or len(form[1]) != 2
        ):
            self.fail(f"after (define must come ({kind} NAME)", form)
        self.name = self.word(form[1][1])
        self.sections = [self.form(part) for part in form[2:]]
        for section in self.sections:
            if section.head in SECTIONS:
                self.refuse(section.head, SECTIONS[section.head], section)
            if section.head not in parts:
                self.fail(
                    f"section '{section.head}' is not known here: a {kind} has {', '.join(parts)}",
                    section,
                )
        for flag in [flag for section in self.parts(":requirements") for flag in section[1:]]:
            if self.word(flag) not in REQUIREMENTS:
                self.fail(
                    f"requirement '{flag}' is not known to PDDL: mend its spelling, or leave"
                    " it out",
                    flag,
                )

    def fail(self, message: str, where: object) -> NoReturn:
        raise PddlError(message, file=self.file, line=getattr(where, "line", None))

    def refuse(self, word: str, feature: tuple[str, str], where: object) -> NoReturn:
        self.fail(f"'{word}' goes beyond STRIPS ({feature[0]}): {feature[1]}", where)

    def form(self, item: Form | Word) -> Form:
        if not isinstance(item, Form):
            self.fail(f"'{item}' is where a form in parentheses is needed", item)
        return item

    def word(self, item: Form | Word) -> Word:
        if not isinstance(item, Word):
            self.fail("a form in parentheses is where a name is needed", item)
        return item

    def parts(self, name: str) -> Iterator[Form]:
        return (section for section in self.sections if section.head == name)

    def typed(self, items: list) -> Iterator[tuple[Word, Types]]:
        """`a b - t c` -> (a, (t,)), (b, (t,)), (c, ("object",)); `- (either t u)` gives both
        types.
        """
        waiting: list[Word] = []
        rest = iter(items)
        for item in rest:
            if item != "-":
                waiting.append(self.word(item))
                continue
            kind = next(rest, None)
            if kind is None or not waiting:
                self.fail("'-' must come between names and their type", item)
            kinds = self.either(kind)
            yield from ((name, kinds) for name in waiting)
            waiting = []
        yield from ((name, ("object",)) for name in waiting)

    def either(self, kind: Form | Word) -> Types:
        """The types of `t`, or of (either t u)."""
        if not isinstance(kind, Form):
            return (self.word(kind),)
        if kind.head != "either" or len(kind) < 2:
            self.fail("a type is a name, or (either NAME NAME)", kind)
        return tuple(self.word(name) for name in kind[1:])

    def name_of_object(self, name: Word) -> str:
        if name.startswith("?"):
            self.fail(f"'{name}' is no name of an object: only variables begin with '?'", name)
        return str(name)

    def known_types(self, types: dict[str, Types], kinds: Types, where: Word) -> Types:
        if not types:
            return ("object",)
        for kind in kinds:
            if kind not in types and kind != "object":
                self.fail(f"type '{kind}' is not declared in (:types ...)", where)
        return kinds

    def signatures(
        self, section: Form, types: dict[str, Types]
    ) -> Iterator[tuple[Word, tuple[Types, ...]]]:
        for entry in (self.form(item) for item in section[1:]):
            if not entry:
                self.fail(f"() is in ({section.head} ...) where a name is needed", entry)
            roles = tuple(
                self.known_types(types, kinds, name) for name, kinds in self.typed(entry[1:])
            )
            yield self.word(entry[0]), roles

    def conjuncts(self, formula: Form, domain: Domain) -> Iterator[Form]:
        """The atoms and negated atoms of a conjunction, nested to any depth; what is beyond
        STRIPS is refused.
        """
        waiting = [formula]
        while waiting:
            part = waiting.pop()
            if part.head == "and":
                waiting.extend(self.form(one) for one in reversed(part[1:]))
            elif part:
                self.refuse_beyond(part, domain)
                yield part

    def refuse_beyond(self, part: Form, domain: Domain) -> None:
        """Refuses a formula beyond STRIPS by name. A predicate may be called like one, `within`
        for instance.
        """
        if part.head in FORMULAS and part.head not in domain.predicates:
            self.refuse(part.head, FORMULAS[part.head], part)

    def literal(self, part: Form, domain: Domain) -> tuple[Form, bool]:
        """(atom, whether it is positive)."""
        if part.head != "not":
            return part, True
        if len(part) != 2:
            self.fail("'not' takes exactly one atom", part)
        atom = self.form(part[1])
        if atom.head in ("not", "and"):
            self.fail(
                f"'not' over '{atom.head}' goes beyond STRIPS: put 'not' before single atoms only",
                part,
            )
        self.refuse_beyond(atom, domain)
        return atom, False

    def atom(
        self, form: Form, domain: Domain, arguments: dict[str, Types], table: str = "predicates"
    ) -> Atom:
        """A checked atom: declared, of the right arity, its arguments known and of the right
        types.
        """
        name = form.head
        roles = getattr(domain, table).get(name)
        if roles is None:
            if not name:
                self.fail(f"a form is where a name of (:{table} ...) is needed", form)
            self.fail(f"'{name}' is not declared in (:{table} ...)", form)
        if len(form) - 1 != len(roles):
            self.fail(f"'{name}' has {len(form) - 1} argument(s), declared with {len(roles)}", form)
        for argument, wanted in zip(map(self.word, form[1:]), roles):
            given = self.argument(argument, arguments)
            if not domain.is_a(given, wanted):
                self.fail(
                    f"'{argument}' is a {'/'.join(given)}, '{name}' needs a {'/'.join(wanted)}",
                    argument,
                )
        return tuple(str(word) for word in form)

    def argument(self, word: Word, arguments: dict[str, Types]) -> Types:
        if word not in arguments:
            if word in self.foreign:
                self.fail(
                    f"'{word}' is an object of the problem: declare it in the domain's (:constants"
                    " ...)",
                    word,
                )
            remedy = (
                "declare it in :parameters"
                if word.startswith("?")
                else "declare it in (:objects ...) or (:constants ...)"
            )
            self.fail(f"'{word}' is not known: {remedy}", word)
        return arguments[word]


class _DomainReader(_Reader):
    def __init__(self, text: str, file: str, clock: Clock) -> None:
        super().__init__(text, file, clock, "domain", _DOMAIN_PARTS)

    def read(self, objects_of_problem: frozenset[str]) -> Domain:
        self.foreign = objects_of_problem
        types = self._types()
        constants: dict[str, Types] = {}
        for part in self.parts(":constants"):
            for name, kinds in self.typed(part[1:]):
                constants[self.name_of_object(name)] = self.known_types(types, kinds, name)
        predicates = self._declared(":predicates", types)
        functions = self._declared(":functions", types, skip_types=True)
        domain = Domain(str(self.name), types, constants, predicates, functions, ())
        schemas: dict[str, Schema] = {}
        for part in self.parts(":action"):
            self.clock.check()
            schema = self._schema(part, domain)
            if schema.name in schemas:
                self.fail(f"action '{schema.name}' is defined twice", part)
            schemas[schema.name] = schema
        return Domain(domain.name, types, constants, predicates, functions, tuple(schemas.values()))

    def _types(self) -> dict[str, Types]:
        types: dict[str, Types] = {}
        for part in self.parts(":types"):
            for name, parents in self.typed(part[1:]):
                if name != "object":
                    types[str(name)] = tuple(
                        dict.fromkeys(types.get(name, ()) + tuple(map(str, parents)))
                    )
            for kind in [parent for parents in types.values() for parent in parents]:
                types.setdefault(kind, ("object",)) if kind != "object" else None
            self._refuse_cycle(types, part)
        return types

    def _refuse_cycle(self, types: dict[str, Types], where: Form) -> None:
        """Takes away, again and again, the types all of whose parents are gone; a circle stays."""
        missing = {
            name: sum(parent in types for parent in parents) for name, parents in types.items()
        }
        children: dict[str, list[str]] = {}
        for name, parents in types.items():
            for parent in parents:
                children.setdefault(parent, []).append(name)
        ready = [name for name, count in missing.items() if not count]
        while ready:
            gone = ready.pop()
            del missing[gone]
            for child in children.get(gone, ()):
                missing[child] -= 1
                if not missing[child]:
                    ready.append(child)
        for name in missing:
            if self._is_own_ancestor(name, types):
                self.fail(f"type '{name}' is its own ancestor: types must form a hierarchy", where)

    def _is_own_ancestor(self, name: str, types: dict[str, Types]) -> bool:
        waiting, seen = list(types[name]), set()
        while waiting:
            kind = waiting.pop()
            if kind == name:
                return True
            if kind not in seen:
                seen.add(kind)
                waiting += types.get(kind, ())
        return False

    def _declared(
        self, section: str, types: dict[str, Types], skip_types: bool = False
    ) -> dict[str, tuple[Types, ...]]:
        table: dict[str, tuple[Types, ...]] = {}
        for part in self.parts(section):
            if skip_types:  # `(total-cost) - number`: every function here is a number
                part[1:] = [item for item in part[1:] if isinstance(item, Form)]
            for name, roles in self.signatures(part, types):
                if name in table:
                    self.fail(f"'{name}' is declared twice: give one of them another name", name)
                if name in LOGIC:
                    self.fail(f"'{name}' is a word of PDDL: give the predicate another name", name)
                table[str(name)] = roles
        return table

    def _schema(self, form: Form, domain: Domain) -> Schema:
        if len(form) < 2:
            self.fail("(:action needs a name", form)
        name, fields = self.word(form[1]), {}
        if len(form) % 2:
            self.fail(
                f"action '{name}': each of :parameters, :precondition, :effect takes one form", form
            )
        for key, value in zip(form[2::2], form[3::2]):
            if key not in (":parameters", ":precondition", ":effect") or key in fields:
                self.fail(f"action '{name}': '{key}' is not known or is given twice", key)
            fields[key] = self.form(value)
        if ":effect" not in fields:
            self.fail(f"action '{name}' has no :effect", form)
        roles = self._roles(name, fields.get(":parameters", Form(form.line)), domain)
        arguments = {**domain.constants, **dict(roles)}
        conditions, negative, equalities = [], [], []
        for part in self.conjuncts(fields.get(":precondition", Form(form.line)), domain):
            atom, positive = self.literal(part, domain)
            if atom.head == "=":
                equalities.append((*self._equality(atom, arguments), positive))
            else:
                (conditions if positive else negative).append(self.atom(atom, domain, arguments))
        adds, deletes, costs = self._effects(fields[":effect"], domain, arguments)
        return Schema(
            str(name),
            roles,
            tuple(conditions),
            tuple(negative),
            tuple(equalities),
            adds,
            deletes,
            costs,
        )

    def _roles(self, name: Word, form: Form, domain: Domain) -> tuple[tuple[str, Types], ...]:
        roles = []
        for variable, kinds in self.typed(form):
            if not variable.startswith("?"):
                self.fail(f"action '{name}': parameter '{variable}' must begin with '?'", variable)
            if variable in dict(roles):
                self.fail(f"action '{name}': parameter '{variable}' is given twice", variable)
            roles.append((str(variable), self.known_types(domain.types, kinds, variable)))
        return tuple(roles)

    def _equality(self, form: Form, arguments: dict[str, Types]) -> tuple[str, str]:
        if len(form) != 3:
            self.fail("'=' takes exactly two arguments", form)
        for side in form[1:]:
            if isinstance(side, Form):
                self.refuse("=", FORMULAS[">="], side)
            self.argument(side, arguments)
        return str(form[1]), str(form[2])

    def _effects(self, form: Form, domain: Domain, arguments: dict[str, Types]) -> tuple:
        adds, deletes, costs = [], [], None
        for part in self.conjuncts(form, domain):
            if part.head == "increase" and "increase" not in domain.predicates:
                if (
                    len(part) != 3
                    or getattr(part[1], "head", "") != "total-cost"
                    or len(part[1]) != 1
                ):
                    self.fail(
                        "only (increase (total-cost) ...) is understood: other numeric effects go"
                        " beyond STRIPS",
                        part,
                    )
                costs = [*(costs or []), *self._costs(part[2], domain, arguments)]
                continue
            atom, positive = self.literal(part, domain)
            if atom.head == "=":
                self.fail(
                    "'=' has no place in an effect: objects are equal only to themselves", atom
                )
            (adds if positive else deletes).append(self.atom(atom, domain, arguments))
        return tuple(adds), tuple(deletes), None if costs is None else tuple(costs)

    def _costs(
        self, item: Form | Word, domain: Domain, arguments: dict[str, Types]
    ) -> Iterator[int | Atom]:
        """The summands of a cost: numbers, functions, and sums of them."""
        waiting = [item]
        while waiting:
            one = waiting.pop()
            if not isinstance(one, Form):
                yield whole_number(self, one)
            elif one.head == "+" and len(one) > 1:
                waiting.extend(reversed(one[1:]))
            elif one.head in ("+", "-", "*", "/"):
                self.fail(
                    f"'{one.head}' is not understood in a cost: a cost is a number, a function, or"
                    " a sum by '+'",
                    one,
                )
            elif one.head == "total-cost":
                self.fail(
                    "(total-cost) cannot be its own summand: a cost is a number, a function, or a"
                    " sum by '+'",
                    one,
                )
            else:
                yield self.atom(one, domain, arguments, "functions")


class _ProblemReader(_Reader):
    def __init__(self, text: str, file: str, clock: Clock) -> None:
        super().__init__(text, file, clock, "problem", _PROBLEM_PARTS)
        self.domain: Domain

    def object_names(self) -> frozenset[str]:
        """The names in (:objects ...), read leniently: the domain's messages can
        speak of them.
        """
        return frozenset(
            str(item)
            for part in self.parts(":objects")
            for item in part[1:]
            if isinstance(item, Word)
        )

    def read(self, domain: Domain) -> Problem:
        self.domain = domain
        for part in self.parts(":domain"):
            if len(part) != 2 or part[1] != self.domain.name:
                self.fail(f"the problem is of another domain than '{self.domain.name}'", part)
        objects = self._objects()
        counts_costs = self._counts_costs()
        start, values = self._start(objects, counts_costs)
        goal, negative = [], []
        for part in self.conjuncts(self.form(self._only(":goal")[1]), domain):
            atom, positive = self.literal(part, domain)
            if atom.head == "=":
                self.fail("'=' has no place in a goal: objects are equal only to themselves", atom)
            (goal if positive else negative).append(self.atom(atom, self.domain, objects))
        return Problem(
            str(self.name),
            objects,
            start,
            tuple(goal),
            tuple(negative),
            values,
            counts_costs,
            file=self.file,
            start_line=self._only(":init").line,
        )

    def _counts_costs(self) -> bool:
        """Whether the problem asks for the least total cost; any other metric is refused."""
        metrics = list(self.parts(":metric"))
        for metric in metrics[1:]:
            self.fail("a problem has at most one (:metric ...)", metric)
        for metric in metrics:
            wanted = metric[2] if len(metric) == 3 else None
            if (
                len(metric) == 3
                and metric[1] == "minimize"
                and isinstance(wanted, Form)
                and wanted == ["total-cost"]
            ):
                continue
            head = wanted.head if isinstance(wanted, Form) else wanted
            message = "only (:metric minimize (total-cost)) is understood"
            if (
                metric[1:2] == ["minimize"]
                and head
                and head not in ("total-cost", "total-time", "+", "-", "*", "/")
            ):
                unknown = (
                    ""
                    if head in self.domain.functions
                    else f"'{head}' is not declared in (:functions ...), and "
                )
                self.fail(f"{unknown}{message}: leave the metric out to count steps", metric)
            self.fail(f"{message}: leave the metric out to count steps", metric)
        return bool(metrics)

    def _only(self, name: str) -> Form:
        found = list(self.parts(name))
        if len(found) != 1 or (name == ":goal" and len(found[0]) != 2):
            self.fail(
                f"a problem has exactly one ({name} ...)", found[-1] if found else Word("", 1)
            )
        return found[0]

    def _objects(self) -> dict[str, Types]:
        objects = dict(self.domain.constants)
        for part in self.parts(":objects"):
            for name, kinds in self.typed(part[1:]):
                self.name_of_object(name)
                kinds = tuple(map(str, self.known_types(self.domain.types, kinds, name)))
                if objects.setdefault(str(name), kinds) != kinds:
                    self.fail(f"object '{name}' is declared twice with different types", name)
        return objects

    def _start(
        self, objects: dict[str, Types], counts_costs: bool
    ) -> tuple[frozenset[Atom], dict[Atom, int]]:
        atoms, values = set(), {}
        costs = {
            cost[0]
            for schema in self.domain.schemas
            for cost in schema.costs or ()
            if not isinstance(cost, int)
        }
        for number, form in enumerate(map(self.form, self._only(":init")[1:])):
            if not number % _CHECKED_EVERY:
                self.clock.check()
            if form.head == "=":
                if len(form) != 3 or not isinstance(form[1], Form):
                    self.fail(
                        "'=' in :init gives a function its number: (= (distance a b) 3)", form
                    )
                function = self.atom(form[1], self.domain, objects, "functions")
                counts = counts_costs and function[0] in costs
                value = whole_number(self, form[2]) if counts else self._any_number(form[2])
                if counts and values.setdefault(function, value) != value:
                    self.fail(f"({' '.join(function)}) is given two numbers: leave one out", form)
            elif form.head == "not":
                atom, _ = self.literal(form, self.domain)
                # what :init doesn't name doesn't hold: nothing to note
                self.atom(atom, self.domain, objects)
            elif form.head == "at" and len(form) == 3 and isinstance(form[2], Form):
                self.refuse("at", TIMED, form)
            else:
                self.refuse_beyond(form, self.domain)
                if form.head == "and":
                    self.fail(
                        "'and' has no place in :init: write its atoms one after the other", form
                    )
                atoms.add(self.atom(form, self.domain, objects))
        return frozenset(atoms), values

    def _any_number(self, item: Form | Word) -> None:
        """Refuses what is no number at all; one that no cost needs may be of any kind."""
        if not (_NUMBER.fullmatch(self.word(item)) or item in ("inf", "-inf", "nan", "infinity")):
            self.fail(
                f"'{item}' is no number: functions of objects go beyond STRIPS, use a predicate",
                item,
            )


def whole_number(reader: _Reader, item: Form | Word) -> int:
    """Returns a cost as int; refuses what is negative, too large or no whole number."""
    text = reader.word(item)
    if not _NUMBER.fullmatch(text):
        reader.fail(f"'{text}' is no cost: costs are whole numbers from 0 up", item)
    value = float(text)
    if value > MAX_COST:
        reader.fail(
            f"'{text}' is too large: the greatest cost is {MAX_COST:,}; divide all costs by the"
            " same number",
            item,
        )
    if value < 0:
        reader.fail(f"'{text}' is below 0: costs are whole numbers from 0 up", item)
    if value != int(value):
        reader.fail(
            f"'{text}' is a fraction: costs are whole numbers from 0 up; multiply all by the same"
            " number",
            item,
        )
    return int(value)
