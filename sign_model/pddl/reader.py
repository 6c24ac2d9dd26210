"""PDDL -> the lifted records of a planning task: typed STRIPS with constants, equality, negative
conditions and action costs.

    object -> its name, with its types            predicate -> name and the types of its roles
    action schema -> `Schema`: roles, conditions, effects as atoms over roles and constants
    start, goal -> sets of atoms (name, argument, ...)

What goes beyond STRIPS (or, forall, exists, when, derived predicates, durations) is refused by
name. Every error is a `PddlError` of one line: file, line, what is wrong, what to do. Where a
domain declares no types, types that a problem names all the same (some IPC blocks files do) are
taken for `object`.
"""

import pathlib
from collections.abc import Iterator
from typing import NoReturn

from sign_model.pddl.lifted import Atom, Domain, Problem, Schema, Types
from sign_model.pddl.syntax import Form, PddlError, Word, read_form, read_source

_BEYOND_STRIPS = (
    "or",
    "imply",
    "forall",
    "exists",
    "when",
    "preference",
    "assign",
    "decrease",
    "scale-up",
    "scale-down",
)
_DOMAIN_PARTS = (":requirements", ":types", ":constants", ":predicates", ":functions", ":action")
_PROBLEM_PARTS = (":domain", ":requirements", ":objects", ":init", ":goal", ":metric")


def parse(domain: str | pathlib.Path, problem: str | pathlib.Path) -> tuple[Domain, Problem]:
    """Returns the domain and the problem read from two paths (or texts); PddlError names file,
    line and rule.
    """
    domain_text, domain_file = read_source(domain)
    problem_text, problem_file = read_source(problem)
    if domain_file == problem_file == "<text>":
        domain_file, problem_file = "<domain>", "<problem>"
    lifted = _DomainReader(domain_text, domain_file).read()
    return lifted, _ProblemReader(problem_text, problem_file, lifted).read()


class _Reader:
    """What reading a domain and reading a problem share. `file` goes into every message."""

    def __init__(self, text: str, file: str, kind: str, parts: tuple[str, ...]) -> None:
        self.file = file
        form = read_form(text, file)
        if form.head != "define":
            self.fail("the file must begin with (define", form)
        if (
            len(form) < 2
            or not isinstance(form[1], Form)
            or form[1].head != kind
            or len(form[1]) != 2
        ):
            self.fail(f"after (define must stand ({kind} NAME)", form)
        self.name = self.word(form[1][1])
        self.sections = [self.form(part) for part in form[2:]]
        for section in self.sections:
            if section.head not in parts:
                self.fail(
                    f"section '{section.head}' is not known here: a {kind} has {', '.join(parts)}",
                    section,
                )

    def fail(self, message: str, where: object) -> NoReturn:
        raise PddlError(message, file=self.file, line=getattr(where, "line", None))

    def form(self, item: Form | Word) -> Form:
        if not isinstance(item, Form):
            self.fail(f"'{item}' stands where a form in parentheses is needed", item)
        return item

    def word(self, item: Form | Word) -> Word:
        if not isinstance(item, Word):
            self.fail("a form in parentheses stands where a name is needed", item)
        return item

    def parts(self, name: str) -> Iterator[Form]:
        return (section for section in self.sections if section.head == name)

    def typed(self, items: list) -> Iterator[tuple[Word, Types]]:
        """`a b - t c` -> (a, (t,)), (b, (t,)), (c, ("object",)); `- (either t u)` gives both
        types.
        """
        waiting: list[Word] = []
        items = list(items)
        while items:
            item = items.pop(0)
            if item != "-":
                waiting.append(self.word(item))
                continue
            if not items or not waiting:
                self.fail("'-' must stand between names and their type", item)
            kind = items.pop(0)
            kinds = (
                tuple(map(self.word, kind[1:]))
                if isinstance(kind, Form) and kind.head == "either"
                else (self.word(kind),)
            )
            yield from ((name, kinds) for name in waiting)
            waiting = []
        yield from ((name, ("object",)) for name in waiting)

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
            roles = tuple(
                self.known_types(types, kinds, name) for name, kinds in self.typed(entry[1:])
            )
            yield self.word(entry[0]) if entry else self.word(entry), roles

    def conjuncts(self, formula: Form) -> Iterator[Form]:
        """The atoms and negated atoms of a conjunction; what is beyond STRIPS is refused."""
        if not formula:
            return
        if formula.head == "and":
            for part in formula[1:]:
                yield from self.conjuncts(self.form(part))
            return
        if formula.head in _BEYOND_STRIPS:
            self.fail(f"'{formula.head}' goes beyond STRIPS: use and, not, = over atoms", formula)
        yield formula

    def literal(self, part: Form) -> tuple[Form, bool]:
        """(atom, whether it is positive)."""
        if part.head != "not":
            return part, True
        if len(part) != 2 or self.form(part[1]).head in ("not", "and", *_BEYOND_STRIPS):
            self.fail("'not' takes exactly one atom", part)
        return part[1], False

    def atom(
        self, form: Form, domain: Domain, arguments: dict[str, Types], table: str = "predicates"
    ) -> Atom:
        """A checked atom: declared, of the right arity, its arguments known and of the right
        types.
        """
        name = form.head
        roles = getattr(domain, table).get(name)
        if roles is None:
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
            remedy = (
                "declare it in :parameters"
                if word.startswith("?")
                else "declare it in (:objects ...) or (:constants ...)"
            )
            self.fail(f"'{word}' is not known: {remedy}", word)
        return arguments[word]


class _DomainReader(_Reader):
    def __init__(self, text: str, file: str) -> None:
        super().__init__(text, file, "domain", _DOMAIN_PARTS)

    def read(self) -> Domain:
        types = self._types()
        constants = {
            str(name): self.known_types(types, kinds, name)
            for part in self.parts(":constants")
            for name, kinds in self.typed(part[1:])
        }
        predicates = self._declared(":predicates", types)
        functions = self._declared(":functions", types, skip_types=True)
        domain = Domain(str(self.name), types, constants, predicates, functions, ())
        schemas: dict[str, Schema] = {}
        for part in self.parts(":action"):
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
            for name in types:
                self._refuse_cycle(name, types, part)
        return types

    def _refuse_cycle(self, name: str, types: dict[str, Types], where: Form) -> None:
        waiting, seen = list(types[name]), set()
        while waiting:
            kind = waiting.pop()
            if kind == name:
                self.fail(f"type '{name}' is its own ancestor: types must form a hierarchy", where)
            if kind not in seen:
                seen.add(kind)
                waiting += types.get(kind, ())

    def _declared(
        self, section: str, types: dict[str, Types], skip_types: bool = False
    ) -> dict[str, tuple[Types, ...]]:
        table: dict[str, tuple[Types, ...]] = {}
        for part in self.parts(section):
            if skip_types:  # `(total-cost) - number`: every function here is a number
                part[1:] = [item for item in part[1:] if isinstance(item, Form)]
            for name, roles in self.signatures(part, types):
                if name in table or name in ("=", "not", "and"):
                    self.fail(f"'{name}' is declared twice or is a word of PDDL", name)
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
                self.fail(f"action '{name}': '{key}' is not known or stands twice", key)
            fields[key] = self.form(value)
        if ":effect" not in fields:
            self.fail(f"action '{name}' has no :effect", form)
        roles = self._roles(name, fields.get(":parameters", Form(form.line)), domain)
        arguments = {**domain.constants, **dict(roles)}
        conditions, negative, equalities = [], [], []
        for part in self.conjuncts(fields.get(":precondition", Form(form.line))):
            atom, positive = self.literal(part)
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
                self.fail(f"action '{name}': parameter '{variable}' stands twice", variable)
            roles.append((str(variable), self.known_types(domain.types, kinds, variable)))
        return tuple(roles)

    def _equality(self, form: Form, arguments: dict[str, Types]) -> tuple[str, str]:
        if len(form) != 3:
            self.fail("'=' takes exactly two arguments", form)
        for word in map(self.word, form[1:]):
            self.argument(word, arguments)
        return str(form[1]), str(form[2])

    def _effects(self, form: Form, domain: Domain, arguments: dict[str, Types]) -> tuple:
        adds, deletes, costs = [], [], None
        for part in self.conjuncts(form):
            if part.head == "increase":
                if len(part) != 3 or getattr(part[1], "head", "") != "total-cost":
                    self.fail("only (increase (total-cost) ...) is understood", part)
                costs = (costs or []) + [self._cost(part[2], domain, arguments)]
                continue
            atom, positive = self.literal(part)
            (adds if positive else deletes).append(self.atom(atom, domain, arguments))
        return tuple(adds), tuple(deletes), None if costs is None else tuple(costs)

    def _cost(self, item: Form | Word, domain: Domain, arguments: dict[str, Types]) -> int | Atom:
        if isinstance(item, Form):
            return self.atom(item, domain, arguments, "functions")
        return whole_number(self, item)


class _ProblemReader(_Reader):
    def __init__(self, text: str, file: str, domain: Domain) -> None:
        super().__init__(text, file, "problem", _PROBLEM_PARTS)
        self.domain = domain

    def read(self) -> Problem:
        for part in self.parts(":domain"):
            if len(part) != 2 or part[1] != self.domain.name:
                self.fail(f"the problem is of another domain than '{self.domain.name}'", part)
        objects = self._objects()
        start, values = self._start(objects)
        goal, negative = [], []
        for part in self.conjuncts(self.form(self._only(":goal")[1])):
            atom, positive = self.literal(part)
            if atom.head == "=":
                self.fail("'=' has no place in a goal: objects are equal only to themselves", atom)
            (goal if positive else negative).append(self.atom(atom, self.domain, objects))
        counts_costs = any(True for _ in self.parts(":metric"))
        return Problem(
            str(self.name), objects, start, tuple(goal), tuple(negative), values, counts_costs
        )

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
                kinds = tuple(map(str, self.known_types(self.domain.types, kinds, name)))
                if objects.setdefault(str(name), kinds) != kinds:
                    self.fail(f"object '{name}' is declared twice with different types", name)
        return objects

    def _start(self, objects: dict[str, Types]) -> tuple[frozenset[Atom], dict[Atom, int]]:
        atoms, values = set(), {}
        for form in map(self.form, self._only(":init")[1:]):
            if form.head == "=":
                if len(form) != 3 or not isinstance(form[1], Form):
                    self.fail(
                        "'=' in :init gives a function its number: (= (distance a b) 3)", form
                    )
                values[self.atom(form[1], self.domain, objects, "functions")] = whole_number(
                    self, form[2]
                )
            elif form.head == "not":
                self.literal(form)  # what :init doesn't name doesn't hold: nothing to note
            else:
                atoms.add(self.atom(form, self.domain, objects))
        return frozenset(atoms), values


def whole_number(reader: _Reader, item: Form | Word) -> int:
    """Returns a cost as int; refuses what is negative or no whole number."""
    try:
        value = float(reader.word(item))
    except ValueError:
        value = -1.0
    if value < 0 or value != int(value):
        reader.fail(f"'{item}' is no cost: costs are whole numbers from 0 up", item)
    return int(value)
