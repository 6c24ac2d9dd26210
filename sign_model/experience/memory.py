"""Experience: solved tasks become precedents, personal meanings that are tried before any search
(PY16 §3.1, A-step).

A memory answers three questions. Two ask for a plan. Every answer is replayed on the new task
first, so a precedent that does not fit does no harm:

- `recall`: was this task solved before, perhaps under other names? Start, goal and static facts
  must be equal up to the names; then the plan is as good as the one found before.
- `suggest`: does some precedent fit by inclusion? Its needs, renamed, must lie in the start, and
  the goal in what it brings about. This gives a plan where a search would exhaust its budget, and
  elsewhere an upper bound, because a search may find a shorter plan.

The third asks how to plan: `skill`, what small problems taught of the domain.
"""

import dataclasses
import json
import pathlib
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from sign_model.experience.practice import practise
from sign_model.experience.precedent import (
    Precedent,
    domain_name,
    precedent_of,
    require_one_domain,
    without_plan,
)
from sign_model.experience.renaming import Atom, find_renaming, rename
from sign_model.experience.skill import Skill, plain_skill, skill_of
from sign_model.foundation.files import atomic_write, read_text
from sign_model.foundation.legible import counted
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.signs.from_tasks import fact_name

_FORMAT = "sign_model memory, version 1"


Match = Callable[[Precedent, Precedent, int], dict[str, str] | None]
"""(precedent, task, max_nodes) -> renaming; None if the precedent does not fit."""


@dataclasses.dataclass(frozen=True)
class Memory:
    """The experience of an agent: solved tasks as precedents, oldest first, and what small problems
    taught it of their domains.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> memory = sign_model.Memory().learned(task, ["(push)", "(walk)"])
      >>> memory.recall(task)
      ('(push)', '(walk)')
    """

    precedents: tuple[Precedent, ...] = ()
    skills: tuple[Skill, ...] = ()

    def __repr__(self) -> str:
        """What it holds in a line."""
        domains = ", ".join(skill.domain.split()[0] for skill in self.skills)
        practised = f", practised in {domains}" if domains else ""
        return f"Memory({counted(len(self.precedents), 'precedent')}{practised})"

    def practised(
        self,
        tasks: Sequence[PlanningTask],
        *,
        max_expansions: int = 200_000,
        max_seconds: float | None = 30.0,
        log: Callable[[str], None] | None = None,
    ) -> "Memory":
        """Returns a memory that also holds what some small problems teach of their domain: which
        way of planning serves it, by which signs. `plan(memory=)` takes it up for every problem of
        the domain, whatever its objects.

        Args:
          tasks: of one domain, a few, from small to large.
          max_expansions, max_seconds: of each attempt at each of them.
          log: called with a line of text to report progress.

        Raises:
          ValueError: there are no tasks, or they are of several domains.

        Examples:
          >>> import sign_model
          >>> from sign_model.blocks import random_blocks_tasks
          >>> tasks = [random_blocks_tasks(n, 1, seed=n)[0] for n in (3, 4)]
          >>> memory = sign_model.Memory().practised(tasks)
          >>> sign_model.plan(random_blocks_tasks(7, 1, seed=0)[0], memory=memory).is_solved
          True
        """
        domain = require_one_domain(tasks)
        skill = practise(
            tasks, domain, max_expansions=max_expansions, max_seconds=max_seconds, log=log
        )
        others = tuple(known for known in self.skills if known.domain != domain)
        return dataclasses.replace(self, skills=(*others, skill))

    def skill(self, task: PlanningTask) -> Skill | None:
        """Returns what was learned of the task's domain, or None."""
        if task.domain is None or not self.skills:
            return None
        domain = domain_name(task.domain)
        return next((skill for skill in self.skills if skill.domain == domain), None)

    def learned(self, task: PlanningTask, actions: Sequence[str]) -> "Memory":
        """Returns a memory that also holds this solved task; the same memory if it holds the same
        task with a plan at most as long.

        Args:
          task: that was solved.
          actions: the plan, `(pick-up a)` each.

        Raises:
          ValueError: the plan does not solve the task.
        """
        wrong = validate(task, actions)
        if wrong:
            raise ValueError(f"only a plan that solves its task can be learned from: {wrong[0]}")
        known = self.recall(task)
        if known is not None and len(known) <= len(actions):
            return self
        precedents = (*self.precedents, precedent_of(task, actions))
        return dataclasses.replace(self, precedents=precedents)

    def recall(self, task: PlanningTask, *, max_nodes: int = 2000) -> tuple[str, ...] | None:
        """Returns the plan of a precedent that solved the same task, perhaps under other names;
        None if there is none.

        Of several plans the shortest is returned, then the oldest. If the goal holds at the start,
        the plan is empty and needs no precedent.

        Args:
          task: to be solved.
          max_nodes: bound on the match with each precedent.
        """
        return self._first_valid_plan(task, _same, max_nodes)

    def suggest(self, task: PlanningTask, *, max_nodes: int = 2000) -> tuple[str, ...] | None:
        """Returns the plan of a precedent that fits the task by inclusion; in all else like
        `recall`.
        """
        return self._first_valid_plan(task, _included, max_nodes)

    def _first_valid_plan(
        self, task: PlanningTask, match: Match, max_nodes: int
    ) -> tuple[str, ...] | None:
        """Returns the first renamed plan that solves the task, shorter plans first."""
        if not validate(task, ()):
            return ()
        requested = without_plan(task)
        of_domain = (known for known in self.precedents if known.domain == requested.domain)
        for known in sorted(of_domain, key=lambda known: len(known.plan)):
            renaming = match(known, requested, max_nodes)
            if renaming is not None:
                actions = tuple(fact_name(rename(action, renaming)) for action in known.plan)
                if not validate(task, actions):
                    return actions
        return None


def save_memory(memory: Memory, path: str | pathlib.Path) -> None:
    """Writes the precedents as JSON: names and lists only, nothing executable.

    Examples:
      >>> import os, tempfile
      >>> import sign_model
      >>> path = os.path.join(tempfile.mkdtemp(), "memory.json")
      >>> sign_model.save_memory(sign_model.Memory(), path)
      >>> sign_model.load_memory(path).precedents
      ()
    """
    payload = {
        "format": _FORMAT,
        "precedents": [_to_plain(precedent) for precedent in memory.precedents],
        "skills": [plain_skill(skill) for skill in memory.skills],
    }
    text = json.dumps(payload, indent=1)
    with atomic_write(path) as file:
        file.write(text + "\n")


def load_memory(path: str | pathlib.Path) -> Memory:
    """Returns the precedents of a file that `save_memory` wrote.

    Raises:
      ValueError: the file is not JSON, not of this format, or a precedent lacks a part; names the
        file and the precedent.

    Examples:
      >>> import sign_model
      >>> domain = '''(define (domain door)
      ...   (:predicates (closed) (open) (through))
      ...   (:action push :precondition (closed) :effect (and (open) (not (closed))))
      ...   (:action walk :precondition (open) :effect (through)))'''
      >>> problem = "(define (problem out) (:domain door) (:init (closed)) (:goal (through)))"
      >>> task = sign_model.load(domain, problem)
      >>> import os, tempfile
      >>> path = os.path.join(tempfile.mkdtemp(), "memory.json")
      >>> sign_model.save_memory(sign_model.Memory().learned(task, ["(push)", "(walk)"]), path)
      >>> len(sign_model.load_memory(path).precedents)
      1
    """
    # The file is JSON, and says that it is a memory.
    try:
        payload = json.loads(read_text(path, what="memory"))
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(
            f"{path}: not a memory, because it is not JSON ({error}): give a file written by"
            " save_memory"
        ) from None
    if (
        not isinstance(payload, dict)
        or payload.get("format") != _FORMAT
        or not isinstance(payload.get("precedents"), list)
    ):
        raise ValueError(
            f"{path}: not a memory: its format must be {_FORMAT!r}; give a file written by"
            " save_memory"
        )
    skills = payload.get("skills", [])  # files of earlier versions have none
    if not isinstance(skills, list):
        raise ValueError(f"{path}: skills must be a list; write it with save_memory")
    return Memory(
        tuple(
            _from_plain(entry, f"{path}: precedent {i}")
            for i, entry in enumerate(payload["precedents"], 1)
        ),
        tuple(skill_of(entry, f"{path}: skill {i}") for i, entry in enumerate(skills, 1)),
    )


def _to_plain(precedent: Precedent) -> dict[str, object]:
    """Returns a precedent as plain data: a member for each field, sets as sorted lists."""
    plain = {field.name: getattr(precedent, field.name) for field in dataclasses.fields(precedent)}
    return {
        name: sorted(value) if isinstance(value, frozenset) else value
        for name, value in plain.items()
    }


def _from_plain(entry: object, where: str) -> Precedent:
    """Returns the inverse of `_to_plain`.

    Args:
      entry: any JSON value.
      where: the file and the precedent, for error messages.

    Raises:
      ValueError: a member is missing, unknown or of a wrong type.
    """
    parts = _checked_parts(entry, where)
    return Precedent(
        domain=parts["domain"],
        objects=tuple((name, tuple(types)) for name, types in parts["objects"]),
        constants=tuple(parts["constants"]),
        plan=tuple(map(tuple, parts["plan"])),
        **{
            part: frozenset(map(tuple, parts[part])) for part in ("start", "goal", "needs", "gives")
        },
    )


def _checked_parts(entry: object, where: str) -> dict[str, Any]:
    """Returns the members of a precedent of the file; ValueError if one is missing, unknown or of a
    wrong type.
    """
    names = [field.name for field in dataclasses.fields(Precedent)]
    if not isinstance(entry, dict) or sorted(entry) != sorted(names):
        raise ValueError(
            f"{where}: must have exactly the parts {', '.join(names)}; write it with save_memory"
        )

    # Each member has its type.
    objects = entry["objects"]
    if (
        not isinstance(entry["domain"], str)
        or not _is_names(entry["constants"])
        or not isinstance(objects, list)
    ):
        raise ValueError(
            f"{where}: domain must be text, constants and objects lists; write it with save_memory"
        )
    if not all(
        isinstance(pair, list)
        and len(pair) == 2
        and isinstance(pair[0], str)
        and _is_names(pair[1])
        for pair in objects
    ):
        raise ValueError(
            f"{where}: objects must be pairs of a name and a list of types; write it with"
            " save_memory"
        )
    for part in ("start", "goal", "plan", "needs", "gives"):
        if not isinstance(entry[part], list) or not all(
            _is_names(atom) and atom for atom in entry[part]
        ):
            raise ValueError(
                f"{where}: {part} must be a list of lists of names; write it with save_memory"
            )
    return entry


def _is_names(value: object) -> bool:
    """Returns whether a JSON value is a list of texts."""
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _same(known: Precedent, requested: Precedent, max_nodes: int) -> dict[str, str] | None:
    """Returns a renaming that maps the whole precedent to the requested task; {} (the identity) if
    they are equal, None if there is no such renaming.
    """
    if (
        known.start == requested.start
        and known.goal == requested.goal
        and known.objects == requested.objects
    ):
        return {}
    if known.fingerprint != requested.fingerprint:
        return None

    def may_play(role: str, name: str) -> bool:
        return known.colours.get(role, role) == requested.colours.get(name, name)

    # Both sides have equally many atoms and the renaming is one to one: if every atom has its
    # image, the sets are equal.
    return find_renaming(
        known.start,
        requested.start,
        requested.goal,
        known.goal,
        may_play=may_play,
        max_nodes=max_nodes,
    )


def _included(known: Precedent, requested: Precedent, max_nodes: int) -> dict[str, str] | None:
    """Returns a renaming that maps the needs of the precedent into the start of the requested task,
    and some of what it brings about to the goals that do not hold at the start; None if there is
    none.
    """
    open_goal = {atom for atom in requested.goal - requested.start if atom[0] != "not"}
    if _exceeds(known.needs, requested.start) or _exceeds(open_goal, known.gives):
        return None
    types, other_types = dict(known.objects), dict(requested.objects)

    def may_play(role: str, name: str) -> bool:
        is_fixed = role in known.constants or name in requested.constants
        return role == name if is_fixed else types.get(role) == other_types.get(name)

    return find_renaming(
        known.needs, requested.start, open_goal, known.gives, may_play=may_play, max_nodes=max_nodes
    )


def _exceeds(some: frozenset[Atom] | set[Atom], others: frozenset[Atom]) -> bool:
    """Returns whether some predicate occurs more often among `some` than among `others`: then no
    renaming maps the first into the second.
    """
    return bool(Counter(atom[0] for atom in some) - Counter(atom[0] for atom in others))
