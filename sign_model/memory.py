"""Experience: solved tasks become precedents, personal meanings that are tried before any search (PY16 §3.1, A-step).

A precedent keeps the task it solved, its plan, what the plan needs of the start and what it leaves behind. It is looked up by
inclusion, its objects being roles that others may play: its needs, renamed, lie in the new start, and the new goal lies in what
it gives. Whatever is recalled has been replayed on the new task first, so a precedent that does not unfold does no harm.

A recalled plan is `is_same` where start, goal and all static facts are those of the precedent but for the names: then it is as
good as the plan once found. Otherwise it is a plan, but a search may find a shorter one.
"""

import dataclasses
import functools
import json
import os
import pathlib
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from sign_model.renaming import Atom, colours, find_renaming, renamed
from sign_model.sign import Sign, causal, sequence
from sign_model.task import PlanningTask
from sign_model.translate import act_name, fact_name
from sign_model.validate import validate

_FORMAT = "sign_model memory, version 1"


@dataclasses.dataclass(frozen=True)
class Precedent:
    """One solved task.

    domain: names and arities of the predicates and schemas; a precedent is tried on tasks of the same domain only.
    objects: (name, types) of each object; constants: those that only play themselves.
    start, goal: all atoms; a negative goal begins with "not".
    plan: ground actions. needs: the atoms of the start on which it rests. gives: the atoms it leaves behind.
    """

    domain: str
    objects: tuple[tuple[str, tuple[str, ...]], ...]
    constants: tuple[str, ...]
    start: frozenset[Atom]
    goal: frozenset[Atom]
    plan: tuple[Atom, ...] = ()
    needs: frozenset[Atom] = frozenset()
    gives: frozenset[Atom] = frozenset()

    @functools.cached_property
    def colours(self) -> dict[str, str]:
        """Equal for objects that a renaming of the whole task could exchange."""
        fixed = {name: (*types, f"constant {name}") for name, types in self.objects if name in self.constants}
        return colours({**dict(self.objects), **fixed}, {"start": self.start, "goal": self.goal})

    @functools.cached_property
    def fingerprint(self) -> tuple:
        """Equal for tasks that are the same but for the names of their objects."""
        return (self.domain, len(self.start), len(self.goal), *sorted(self.colours.values()))


@dataclasses.dataclass(frozen=True)
class Recalled:
    """A plan that was replayed on the task. is_same: the precedent solved this very task, under other names perhaps."""

    actions: tuple[str, ...]
    is_same: bool


@dataclasses.dataclass(frozen=True)
class Memory:
    """The precedents of an agent, oldest first."""

    precedents: tuple[Precedent, ...] = ()

    def learned(self, task: PlanningTask, actions: Sequence[str]) -> "Memory":
        """Returns a memory that also holds this solved task, unless it holds the same one with a plan as short.

        Raises:
          ValueError: the plan does not solve the task.
        """
        wrong = validate(task, actions)
        if wrong:
            raise ValueError(f"only a plan that solves its task can be learned from: {wrong[0]}")
        known = self.recall(task)
        if known and known.is_same and len(known.actions) <= len(actions):
            return self
        plan = tuple(_parsed(action) for action in actions)
        needs, gives = _footprint(task, plan)
        return Memory((*self.precedents, dataclasses.replace(_situation_of(task), plan=plan, needs=needs, gives=gives)))

    def recall(self, task: PlanningTask, *, max_nodes: int = 2000) -> Recalled | None:
        """Returns a plan that some precedent gives for the task, replayed and valid; None where none unfolds.

        First the same task under any names, then inclusion; each time the shortest plan, among equals the oldest. Where the
        goal holds from the start there is nothing to do, which needs no precedent.

        Args:
          task: to be solved.
          max_nodes: bound on the match with each precedent.
        """
        if not validate(task, ()):
            return Recalled((), True)
        asked = _situation_of(task)
        ordered = sorted(
            (known for known in self.precedents if known.domain == asked.domain), key=lambda known: len(known.plan)
        )
        for is_same, match in ((True, _same), (False, _included)):
            for known in ordered:
                renaming = match(known, asked, max_nodes)
                if renaming is not None:
                    actions = tuple(fact_name(renamed(action, renaming)) for action in known.plan)
                    if not validate(task, actions):
                        return Recalled(actions, is_same)
        return None


def precedent_sign(precedent: Precedent, name: str) -> Sign:
    """Returns the precedent as a sign: its image the sequence of acts, its personal meaning what the plan needs and gives."""
    plan = sequence(*(act_name(action) for action in precedent.plan))
    return Sign(name, image=(plan,), meaning=(causal(map(fact_name, precedent.needs), map(fact_name, precedent.gives)),))


def save_memory(memory: Memory, path: str | pathlib.Path) -> None:
    """Writes the precedents as JSON: names and lists only, nothing that could run."""
    told = {"format": _FORMAT, "precedents": [_to_plain(precedent) for precedent in memory.precedents]}
    target = pathlib.Path(path)
    temporary = target.with_name(f"{target.name}.{os.getpid()}.tmp")
    temporary.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    os.replace(temporary, target)


def load_memory(path: str | pathlib.Path) -> Memory:
    """Returns the precedents of a file that `save_memory` wrote.

    Raises:
      ValueError: the file is not JSON, not of this format, or a precedent lacks a part; names the file and the precedent.
    """
    try:
        told = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a memory, for it is not JSON ({error}): give a file written by save_memory") from None
    if not isinstance(told, dict) or told.get("format") != _FORMAT or not isinstance(told.get("precedents"), list):
        raise ValueError(f"{path}: not a memory: its format must be {_FORMAT!r}; give a file written by save_memory")
    return Memory(tuple(_from_plain(entry, f"{path}: precedent {i}") for i, entry in enumerate(told["precedents"], 1)))


def _to_plain(precedent: Precedent) -> dict:
    plain = {field.name: getattr(precedent, field.name) for field in dataclasses.fields(precedent)}
    return {name: sorted(value) if isinstance(value, frozenset) else value for name, value in plain.items()}


def _from_plain(entry: object, where: str) -> Precedent:
    names = [field.name for field in dataclasses.fields(Precedent)]
    if not isinstance(entry, dict) or sorted(entry) != sorted(names):
        raise ValueError(f"{where}: must have exactly the parts {', '.join(names)}; write it with save_memory")
    objects = entry["objects"]
    if not isinstance(entry["domain"], str) or not _is_names(entry["constants"]) or not isinstance(objects, list):
        raise ValueError(f"{where}: domain must be text, constants and objects lists; write it with save_memory")
    if not all(
        isinstance(pair, list) and len(pair) == 2 and isinstance(pair[0], str) and _is_names(pair[1]) for pair in objects
    ):
        raise ValueError(f"{where}: objects must be pairs of a name and a list of types; write it with save_memory")
    for part in ("start", "goal", "plan", "needs", "gives"):
        if not isinstance(entry[part], list) or not all(_is_names(atom) and atom for atom in entry[part]):
            raise ValueError(f"{where}: {part} must be a list of lists of names; write it with save_memory")
    return Precedent(
        domain=entry["domain"],
        objects=tuple((name, tuple(types)) for name, types in objects),
        constants=tuple(entry["constants"]),
        plan=tuple(map(tuple, entry["plan"])),
        **{part: frozenset(map(tuple, entry[part])) for part in ("start", "goal", "needs", "gives")},
    )


def _is_names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _parsed(action: str) -> Atom:
    return tuple(action.strip().strip("()").lower().split())


def _situation_of(task: PlanningTask) -> Precedent:
    """Returns the task as a precedent without a plan."""
    if task.domain is None or task.problem is None:
        # Nameless features carry no object that could be renamed, so the rules themselves must agree.
        rules = np.concatenate([part.ravel() for part in (task.conditions, task.adds, task.deletes)])
        return Precedent(
            domain=f"{task.features} {task.actions} {np.packbits(rules).tobytes().hex()}",
            objects=(),
            constants=(),
            start=frozenset(atom for atom, holds in zip(task.features, task.start) if holds),
            goal=frozenset(atom for atom, holds in zip(task.features, task.goal) if holds),
        )
    domain, problem = task.domain, task.problem
    parts = [f"{name}/{len(roles)}" for name, roles in domain.predicates.items()]
    parts += [f"{schema.name}({len(schema.roles)})" for schema in domain.schemas]
    return Precedent(
        domain=" ".join([domain.name, *parts]),
        objects=tuple(problem.objects.items()),
        constants=tuple(domain.constants),
        start=problem.start,
        goal=frozenset(problem.goal) | {("not", *atom) for atom in problem.negative_goal},
    )


def _footprint(task: PlanningTask, plan: tuple[Atom, ...]) -> tuple[frozenset[Atom], frozenset[Atom]]:
    """Returns what a valid plan needs of the start, and what it has brought about at its end."""
    needs: set[Atom] = set()
    gives: set[Atom] = set()
    for conditions, adds, deletes in _rules(task, plan):
        needs |= conditions - gives
        gives = (gives - deletes) | adds
    return frozenset(needs), frozenset(gives)


def _rules(task: PlanningTask, plan: tuple[Atom, ...]) -> Iterator[tuple[set[Atom], set[Atom], set[Atom]]]:
    if task.domain is None:
        number_of = {action: number for number, action in enumerate(task.actions)}
        for action in plan:
            rule = (part[number_of[action]] for part in (task.conditions, task.adds, task.deletes))
            conditions, adds, deletes = ({task.features[feature] for feature in np.flatnonzero(bits)} for bits in rule)
            yield conditions, adds, deletes
        return
    schemas = {schema.name: schema for schema in task.domain.schemas}
    for name, *arguments in plan:
        schema = schemas[name]
        filled = dict(zip((role for role, _ in schema.roles), arguments))
        conditions, adds, deletes = (
            {renamed(atom, filled) for atom in atoms} for atoms in (schema.conditions, schema.adds, schema.deletes)
        )
        yield conditions, adds, deletes


def _same(known: Precedent, asked: Precedent, max_nodes: int) -> dict[str, str] | None:
    """Returns a renaming that takes the whole precedent to the task asked for; the identity where it is the very same."""
    if known.start == asked.start and known.goal == asked.goal and known.objects == asked.objects:
        return {}
    if known.fingerprint != asked.fingerprint:
        return None

    def may_play(role: str, name: str) -> bool:
        return known.colours.get(role, role) == asked.colours.get(name, name)

    # As many atoms on both sides and one to one: every need met means the sets are equal.
    return find_renaming(known.start, asked.start, asked.goal, known.goal, may_play=may_play, max_nodes=max_nodes)


def _included(known: Precedent, asked: Precedent, max_nodes: int) -> dict[str, str] | None:
    """Returns a renaming that takes the needs into the start, and some of what is given to the goal still open."""
    open_goal = {atom for atom in asked.goal - asked.start if atom[0] != "not"}
    if _exceeds(known.needs, asked.start) or _exceeds(open_goal, known.gives):
        return None
    types, other_types = dict(known.objects), dict(asked.objects)

    def may_play(role: str, name: str) -> bool:
        is_fixed = role in known.constants or name in asked.constants
        return role == name if is_fixed else types.get(role) == other_types.get(name)

    return find_renaming(known.needs, asked.start, open_goal, known.gives, may_play=may_play, max_nodes=max_nodes)


def _exceeds(some: frozenset[Atom] | set[Atom], others: frozenset[Atom]) -> bool:
    """Returns whether some predicate occurs more often among `some` than among `others`: then no renaming fits."""
    return bool(Counter(atom[0] for atom in some) - Counter(atom[0] for atom in others))
