"""A PDDL domain: its types, constants, predicates, functions and action schemas."""

from collections.abc import Iterator

from sign_model.clock import Clock
from sign_model.pddl.beyond import FORMULAS, LOGIC
from sign_model.pddl.lifted import Atom, Domain, Schema, Types
from sign_model.pddl.sections import SectionReader, whole_number
from sign_model.pddl.syntax import Form, Word

_PARTS = (":requirements", ":types", ":constants", ":predicates", ":functions", ":action")


class DomainReader(SectionReader):
    def __init__(self, text: str, file: str, clock: Clock) -> None:
        super().__init__(text, file, clock, "domain", _PARTS)

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
