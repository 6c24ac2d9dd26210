"""What reading a domain and reading a problem share: their sections, typed names, atoms, literals
and costs, each checked where it stands.

Every error is a `PddlError` of one line: file, line, what is wrong, what to do.
"""

import re
from collections.abc import Iterator
from typing import NoReturn

from sign_model.clock import Clock
from sign_model.pddl.beyond import FORMULAS, REQUIREMENTS, SECTIONS
from sign_model.pddl.lifted import Atom, Domain, Types
from sign_model.pddl.syntax import Form, PddlError, Word, read_form

MAX_COST = 10**12
"""The greatest cost of one action. Sums of 9,000 such costs are exact in the float64 numbers of
the searches.
"""

NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?", re.ASCII)


class SectionReader:
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
            other = form[1].head if len(form) > 1 and isinstance(form[1], Form) else None
            is_swapped = other in ("domain", "problem") and other != kind
            hint = f": this is a {other}; give the domain first, then the problem"
            self.fail(f"after (define must come ({kind} NAME){hint if is_swapped else ''}", form)
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


def whole_number(reader: SectionReader, item: Form | Word) -> int:
    """Returns a cost as int; refuses what is negative, too large or no whole number."""
    text = reader.word(item)
    if not NUMBER.fullmatch(text):
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
