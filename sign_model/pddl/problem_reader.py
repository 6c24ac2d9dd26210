"""A PDDL problem: its objects, start, goal, and whether it counts costs."""

from sign_model.clock import Clock
from sign_model.pddl.beyond import TIMED
from sign_model.pddl.lifted import Atom, Domain, Problem, Types
from sign_model.pddl.sections import NUMBER, SectionReader, whole_number
from sign_model.pddl.syntax import Form, Word

_PARTS = (":domain", ":requirements", ":objects", ":init", ":goal", ":metric", ":length")
_CHECKED_EVERY = 1 << 12


class ProblemReader(SectionReader):
    def __init__(self, text: str, file: str, clock: Clock) -> None:
        super().__init__(text, file, clock, "problem", _PARTS)
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
            if len(part) != 2:
                self.fail("(:domain NAME) takes one name", part)
            if part[1] != self.domain.name:
                self.fail(
                    f"the problem is of domain '{part[1]}', the domain given is"
                    f" '{self.domain.name}': give the domain that it is of",
                    part,
                )
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
        """Whether the problem requests the least total cost; any other metric is refused."""
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
        if not (NUMBER.fullmatch(self.word(item)) or item in ("inf", "-inf", "nan", "infinity")):
            self.fail(
                f"'{item}' is no number: functions of objects go beyond STRIPS, use a predicate",
                item,
            )
