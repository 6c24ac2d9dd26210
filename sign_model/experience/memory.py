"""Experience: solved tasks become precedents, personal meanings that are tried before any search
(PY16 §3.1, A-step).

Two questions are asked of a memory, and whatever it answers has been replayed on the new task
first, so a precedent that does not unfold does no harm:

- `recall`: was this task solved before, under whatever names? Start, goal and static facts must be
  the same but for the names; then the plan is as good as the one once found.
- `suggest`: does some precedent fit by inclusion? Its needs, renamed, must lie in the start, and
  the goal in what it gives. This is a plan where a search spends its budget, and a bound where it
  does not, for a search may find a shorter one.
"""

import dataclasses
import json
import os
import pathlib
from collections import Counter
from collections.abc import Callable, Sequence

from sign_model.experience.precedent import Precedent, precedent_of, unsolved
from sign_model.experience.renaming import Atom, find_renaming, renamed
from sign_model.pddl.planning_task import PlanningTask
from sign_model.pddl.validate import validate
from sign_model.signs.from_tasks import fact_name

_FORMAT = "sign_model memory, version 1"


Match = Callable[[Precedent, Precedent, int], dict[str, str] | None]
"""(precedent, task, most nodes) -> renaming, None where the precedent does not fit."""


@dataclasses.dataclass(frozen=True)
class Memory:
    """The precedents of an agent, oldest first.

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

    def learned(self, task: PlanningTask, actions: Sequence[str]) -> "Memory":
        """Returns a memory that also holds this solved task, unless it holds the same one with a
        plan as short.

        Raises:
          ValueError: the plan does not solve the task.
        """
        wrong = validate(task, actions)
        if wrong:
            raise ValueError(f"only a plan that solves its task can be learned from: {wrong[0]}")
        known = self.recall(task)
        if known is not None and len(known) <= len(actions):
            return self
        return Memory((*self.precedents, precedent_of(task, actions)))

    def recall(self, task: PlanningTask, *, max_nodes: int = 2000) -> tuple[str, ...] | None:
        """Returns the plan of a precedent that solved this very task, under other names perhaps;
        None where there is none.

        Of several the shortest, then the oldest. Where the goal holds from the start the plan is
        empty, without any precedent.

        Args:
          task: to be solved.
          max_nodes: bound on the match with each precedent.
        """
        return self._unfolded(task, _same, max_nodes)

    def suggest(self, task: PlanningTask, *, max_nodes: int = 2000) -> tuple[str, ...] | None:
        """Returns a plan of a precedent that fits the task by inclusion; as `recall` for the
        rest.
        """
        return self._unfolded(task, _included, max_nodes)

    def _unfolded(self, task: PlanningTask, match: Match, max_nodes: int) -> tuple[str, ...] | None:
        if not validate(task, ()):
            return ()
        asked = unsolved(task)
        fitting = (known for known in self.precedents if known.domain == asked.domain)
        for known in sorted(fitting, key=lambda known: len(known.plan)):
            renaming = match(known, asked, max_nodes)
            if renaming is not None:
                actions = tuple(fact_name(renamed(action, renaming)) for action in known.plan)
                if not validate(task, actions):
                    return actions
        return None


def save_memory(memory: Memory, path: str | pathlib.Path) -> None:
    """Writes the precedents as JSON: names and lists only, nothing that could run.

    Examples:
      >>> import os, tempfile
      >>> import sign_model
      >>> path = os.path.join(tempfile.mkdtemp(), "memory.json")
      >>> sign_model.save_memory(sign_model.Memory(), path)
      >>> sign_model.load_memory(path).precedents
      ()
    """
    told = {
        "format": _FORMAT,
        "precedents": [_to_plain(precedent) for precedent in memory.precedents],
    }
    target = pathlib.Path(path)
    temporary = target.with_name(f"{target.name}.{os.getpid()}.tmp")
    temporary.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    os.replace(temporary, target)


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
    try:
        told = json.loads(pathlib.Path(path).read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(
            f"{path}: not a memory, for it is not JSON ({error}): give a file written by"
            " save_memory"
        ) from None
    if (
        not isinstance(told, dict)
        or told.get("format") != _FORMAT
        or not isinstance(told.get("precedents"), list)
    ):
        raise ValueError(
            f"{path}: not a memory: its format must be {_FORMAT!r}; give a file written by"
            " save_memory"
        )
    return Memory(
        tuple(
            _from_plain(entry, f"{path}: precedent {i}")
            for i, entry in enumerate(told["precedents"], 1)
        )
    )


def _to_plain(precedent: Precedent) -> dict:
    plain = {field.name: getattr(precedent, field.name) for field in dataclasses.fields(precedent)}
    return {
        name: sorted(value) if isinstance(value, frozenset) else value
        for name, value in plain.items()
    }


def _from_plain(entry: object, where: str) -> Precedent:
    names = [field.name for field in dataclasses.fields(Precedent)]
    if not isinstance(entry, dict) or sorted(entry) != sorted(names):
        raise ValueError(
            f"{where}: must have exactly the parts {', '.join(names)}; write it with save_memory"
        )
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
    return Precedent(
        domain=entry["domain"],
        objects=tuple((name, tuple(types)) for name, types in objects),
        constants=tuple(entry["constants"]),
        plan=tuple(map(tuple, entry["plan"])),
        **{
            part: frozenset(map(tuple, entry[part])) for part in ("start", "goal", "needs", "gives")
        },
    )


def _is_names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _same(known: Precedent, asked: Precedent, max_nodes: int) -> dict[str, str] | None:
    """Returns a renaming that takes the whole precedent to the task asked for; the identity where
    it is the very same.
    """
    if known.start == asked.start and known.goal == asked.goal and known.objects == asked.objects:
        return {}
    if known.fingerprint != asked.fingerprint:
        return None

    def may_play(role: str, name: str) -> bool:
        return known.colours.get(role, role) == asked.colours.get(name, name)

    # As many atoms on both sides and one to one: every need met means the sets are equal.
    return find_renaming(
        known.start, asked.start, asked.goal, known.goal, may_play=may_play, max_nodes=max_nodes
    )


def _included(known: Precedent, asked: Precedent, max_nodes: int) -> dict[str, str] | None:
    """Returns a renaming that takes the needs into the start, and some of what is given to the goal
    still open.
    """
    open_goal = {atom for atom in asked.goal - asked.start if atom[0] != "not"}
    if _exceeds(known.needs, asked.start) or _exceeds(open_goal, known.gives):
        return None
    types, other_types = dict(known.objects), dict(asked.objects)

    def may_play(role: str, name: str) -> bool:
        is_fixed = role in known.constants or name in asked.constants
        return role == name if is_fixed else types.get(role) == other_types.get(name)

    return find_renaming(
        known.needs, asked.start, open_goal, known.gives, may_play=may_play, max_nodes=max_nodes
    )


def _exceeds(some: frozenset[Atom] | set[Atom], others: frozenset[Atom]) -> bool:
    """Returns whether some predicate occurs more often among `some` than among `others`: then no
    renaming fits.
    """
    return bool(Counter(atom[0] for atom in some) - Counter(atom[0] for atom in others))
