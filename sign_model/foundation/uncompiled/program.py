"""A traced function as a program of NumPy: its steps are written as Python, one line each.

A step that changes a part of an array changes it in place where nobody else can see that array,
which Python's count of references tells; else every turn of a loop would copy what it works on.
"""

import sys
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jax.extend.core import ClosedJaxpr, Literal

from sign_model.foundation.uncompiled.expressions import (
    NAMES,
    Place,
    UntranslatableError,
    expression,
    index_text,
)

# From 3.14 on references on Python's stack are not always counted.
_COUNTS_REFERENCES = sys.version_info < (3, 14)
_LARGEST_CONSTANT = 1 << 16  # entries of what is computed when the program is written

_CALLS = {
    "jit": "jaxpr",
    "pjit": "jaxpr",
    "closed_call": "call_jaxpr",
    "core_call": "call_jaxpr",
    "custom_jvp_call": "call_jaxpr",
    "custom_vmap_call": "call",
}
"""Calls of a traced function, each with the parameter that holds it: their steps stand in line."""

_MARKS = ("optimization_barrier", "xla_metadata_value", "copy", "copy_p")
"""Steps that speak to the compiler and change nothing."""


class OutOfTimeError(Exception):
    """A program was not through when its time was over."""


def translated(traced: ClosedJaxpr) -> Callable[[Sequence[Any], float], list[np.ndarray]]:
    """Returns a function of arrays and of the time (`time.perf_counter`) when it gives up, looked
    at in every turn of a while loop. It changes none of its arguments.

    Its results are those of the compiled function bit for bit, provided that no bit of that depends
    on the machine it is compiled for.

    Raises:
      UntranslatableError: a step has no form in NumPy. The function itself raises OutOfTimeError.
    """
    if traced.effects:
        raise UntranslatableError("effects")
    writer = _Writer()
    main = writer.write_function(traced)
    exec(compile("\n".join(writer.functions), "<uncompiled>", "exec"), writer.names)
    function = writer.names[main]

    def run(arrays: Sequence[Any], until: float) -> list[np.ndarray]:
        with np.errstate(all="ignore"):
            out = function([_read_only(array) for array in arrays], until)
        # none of them shares memory with an argument, a constant or another
        return [np.array(array) for array in out]

    return run


def _read_only(array: Any) -> Any:
    view = np.asarray(array).view()
    view.flags.writeable = False
    return view if view.ndim else view[()]


class _Step:
    """A step of a function whose calls stand in line: operands and results by name."""

    def __init__(self, eqn: Any, given: list[str], made: list[str]) -> None:
        self.eqn, self.given, self.made = eqn, given, made
        self.last_used: list[str] = []  # operands that nothing needs afterwards
        self.unused: list[str] = []  # results that nothing needs


class _Writer:
    """Writes functions that take a list of arrays, which they empty, and the time to give up."""

    def __init__(self) -> None:
        self.functions: list[str] = []
        self.names: dict[str, Any] = NAMES | {
            "OutOfTimeError": OutOfTimeError,
            "getrefcount": sys.getrefcount,
            "now": time.perf_counter,
        }
        self._constants: set[str] = set()
        self._literals: dict[tuple, str] = {}
        self._count = 0
        self._place = Place(self._keep, self._known)

    def write_function(self, closed: Any) -> str:
        """Returns the name of a function with the steps of a closed jaxpr."""
        name = self._new_name("function")
        jaxpr, places = closed.jaxpr, self._constants_of(closed)
        for variable in jaxpr.invars:
            _require_known(variable.aval)
            places[variable] = self._new_name()
        lines = [f"{_targets([places[v] for v in jaxpr.invars])} = given; given.clear()"]
        steps: list[_Step] = []
        results = self._add_steps(jaxpr, places, steps)
        for step, follower in _with_followers(_needed(steps, results, self._constants)):
            self._write(step, follower, lines)
            done = self._variables(step.last_used + step.unused)
            if done:
                lines.append(f"del {', '.join(done)}")
        lines.append(f"return [{', '.join(results)}]")
        body = "\n    ".join(lines)
        self.functions.append(f"def {name}(given, until):\n    {body}\n")
        return name

    def _constants_of(self, closed: Any) -> dict[Any, str]:
        jaxpr = closed.jaxpr
        return {
            variable: self._keep(np.asarray(value))
            for variable, value in zip(jaxpr.constvars, closed.consts)
        }

    def _add_steps(self, jaxpr: Any, places: dict[Any, str], steps: list[_Step]) -> list[str]:
        """Adds the steps of a jaxpr, calls in line, and returns the names of its results."""

        def name_of(atom: Any) -> str:
            return self._literal(atom) if isinstance(atom, Literal) else places[atom]

        for eqn in jaxpr.eqns:
            given = [name_of(atom) for atom in eqn.invars]
            kind = eqn.primitive.name
            if kind in _CALLS:
                inner = eqn.params[_CALLS[kind]]
                inside = self._constants_of(inner) | dict(zip(inner.jaxpr.invars, given))
                made = self._add_steps(inner.jaxpr, inside, steps)
            elif kind in _MARKS:
                made = given
            else:
                made = [self._new_name() for _ in eqn.outvars]
                for variable in eqn.outvars:
                    _require_known(variable.aval)
                steps.append(_Step(eqn, given, made))
            places.update(zip(eqn.outvars, made))
        return [name_of(atom) for atom in jaxpr.outvars]

    def _write(self, step: _Step, follower: _Step | None, lines: list[str]) -> None:
        kind, params, given = step.eqn.primitive.name, step.eqn.params, step.given
        shape = step.eqn.invars[0].aval.shape if step.eqn.invars else ()
        if kind in _WITH_FUNCTIONS:
            lines.extend(_WITH_FUNCTIONS[kind](self, step))
        elif kind == "sort":
            if len(given) > params["num_keys"] and not params["is_stable"]:
                raise UntranslatableError("a sort whose ties may go anywhere")
            sort = f"op.sorted_together([{', '.join(given)}], {params['dimension']}"
            lines.append(f"{_targets(step.made)} = {sort}, {params['num_keys']})")
        elif kind == "split":
            ends = np.cumsum(params["sizes"])[:-1].tolist()
            lines.append(f"{_targets(step.made)} = np.split({given[0]}, {ends}, {params['axis']})")
        elif kind == "dynamic_slice" and follower is not None:
            index = index_text(given[1:], params["slice_sizes"], shape, drops=True)
            lines.append(f"{follower.made[0]} = {given[0]}[{index}]")
        elif kind == "dynamic_slice":
            index = index_text(given[1:], params["slice_sizes"], shape)
            lines.append(f"{step.made[0]} = {given[0]}[{index}]")
        elif kind == "dynamic_update_slice":
            array, part, *starts = given
            index = index_text(starts, step.eqn.invars[1].aval.shape, shape)
            is_own = _is_own(array) if array in step.last_used and array != part else "False"
            index = index.replace(":", "slice(None)")
            lines.append(f"{step.made[0]} = op.put({array}, {part}, ({index},), {is_own})")
        else:
            text = expression(step.eqn, given, self._place)
            size = int(np.prod(step.eqn.outvars[0].aval.shape, dtype=np.int64))
            if size <= _LARGEST_CONSTANT and self._constants.issuperset(given):
                self._keep(self._value_of(text), step.made[0])
            else:
                lines.append(f"{step.made[0]} = {text}")

    def _known(self, name: str) -> Any:
        return self.names[name] if name in self._constants else None

    def _variables(self, names: Sequence[str]) -> list[str]:
        return [name for name in names if name not in self._constants]

    def _value_of(self, text: str) -> Any:
        with np.errstate(all="ignore"):
            return eval(text, self.names)

    def _new_name(self, what: str = "v") -> str:
        self._count += 1
        return f"{what}{self._count}"

    def _literal(self, atom: Any) -> str:
        value = np.asarray(atom.val, atom.aval.dtype)
        key = (value.tobytes(), value.dtype, value.shape)
        if key not in self._literals:
            self._literals[key] = self._keep(value)
        return self._literals[key]

    def _keep(self, value: Any, name: str | None = None) -> str:
        """Returns a name for a value that no call changes."""
        if isinstance(value, np.ndarray):
            value = value[()] if value.ndim == 0 else _read_only(value)
        name = name or self._new_name("k")
        self.names[name] = value
        self._constants.add(name)
        return name


def _require_known(form: Any) -> None:
    dtype = getattr(form, "dtype", None)
    if not isinstance(dtype, np.dtype) or dtype.kind not in "biuf":
        raise UntranslatableError(f"no array of numbers: {form}")


def _targets(names: list[str]) -> str:
    return f"[{', '.join(names)}]"


def _each(names: Sequence[str]) -> str:
    return "".join(f"{name}, " for name in names)


def _is_own(name: str) -> str:
    """The test whether an array is referred to by this variable alone, and by the two calls that
    the test stands in.
    """
    if not _COUNTS_REFERENCES:
        return "False"
    return f"getrefcount({name}) == 3 and {name}.base is None and {name}.flags.writeable"


def _needed(steps: list[_Step], results: list[str], constants: set[str]) -> list[_Step]:
    """Returns the steps on which the results depend, each with what it is the last to use."""
    live, needed = set(results), []
    for step in reversed(steps):
        if live.isdisjoint(step.made):
            continue
        step.last_used = [
            name for name in dict.fromkeys(step.given) if name not in live | constants
        ]
        step.unused = [name for name in step.made if name not in live]
        live.update(step.given)
        needed.append(step)
    return needed[::-1]


def _with_followers(steps: list[_Step]) -> list[tuple[_Step, _Step | None]]:
    """Returns the steps, and with a slice the next step where that only drops its axes of one
    entry: the two are one line.
    """
    pairs: list[tuple[_Step, _Step | None]] = []
    for step in steps:
        before = pairs[-1][0] if pairs else None
        if before is not None and pairs[-1][1] is None and _drops_axes(before, step):
            pairs[-1] = (before, step)
        else:
            pairs.append((step, None))
    return pairs


def _drops_axes(before: _Step, step: _Step) -> bool:
    if before.eqn.primitive.name != "dynamic_slice" or step.eqn.primitive.name not in (
        "squeeze",
        "reshape",
    ):
        return False
    sizes = before.eqn.params["slice_sizes"]
    left = tuple(size for size in sizes if size != 1)
    is_only_use = step.given == before.made == step.last_used
    return is_only_use and tuple(step.eqn.outvars[0].aval.shape) == left


def _handed_over(writer: "_Writer", step: _Step, carry: list[str], kept: Sequence[str]) -> list:
    """Lines that put what a loop begins with into a list, and forget what nothing else needs, so
    that the loop may change it in place; the first entry is the name of the list.
    """
    name = writer._new_name()
    given_up = [
        one for one in writer._variables(step.last_used) if one in carry and one not in kept
    ]
    step.last_used = [one for one in step.last_used if one not in given_up]
    forget = [f"del {', '.join(given_up)}"] if given_up else []
    return [name, f"{name} = [{', '.join(carry)}]", *forget]


def _while(writer: _Writer, step: _Step) -> list[str]:
    params, given = step.eqn.params, step.given
    test, body = (writer.write_function(params[f"{part}_jaxpr"]) for part in ("cond", "body"))
    ends = params["cond_nconsts"], params["cond_nconsts"] + params["body_nconsts"]
    of_test, of_body, carry = given[: ends[0]], given[ends[0] : ends[1]], given[ends[1] :]
    state, *lines = _handed_over(writer, step, carry, [*of_test, *of_body])
    return [
        *lines,
        f"while {test}([{_each(of_test)}*{state}], until)[0]:",
        "    if now() > until: raise OutOfTimeError",
        f"    {state} = {body}([{_each(of_body)}*op.taken({state})], until)",
        f"{_targets(step.made)} = {state}; del {state}",
    ]


def _scan(writer: _Writer, step: _Step) -> list[str]:
    params, given = step.eqn.params, step.given
    body = writer.write_function(params["jaxpr"])
    ends = params["num_consts"], params["num_consts"] + params["num_carry"]
    fixed, carry, rows = given[: ends[0]], given[ends[0] : ends[1]], given[ends[1] :]
    state, *lines = _handed_over(writer, step, carry, [*fixed, *rows])
    stacks = step.eqn.outvars[params["num_carry"] :]
    forms = [(tuple(one.aval.shape), np.dtype(one.aval.dtype)) for one in stacks]
    settings = f"{params['length']}, {params['reverse']}, {writer._keep(forms)}, until"
    of_step = f"[{', '.join(fixed)}], {state}, [{', '.join(rows)}]"
    return [
        *lines,
        f"{_targets(step.made)} = op.scanned({body}, {of_step}, {settings}); del {state}",
    ]


def _cond(writer: _Writer, step: _Step) -> list[str]:
    which, *given = step.given
    branches = ", ".join(writer.write_function(branch) for branch in step.eqn.params["branches"])
    state, *lines = _handed_over(writer, step, given, [which])
    last = len(step.eqn.params["branches"]) - 1
    chosen = f"({branches},)[op.index_in({which}, {last})]"
    return [*lines, f"{_targets(step.made)} = {chosen}({state}, until); del {state}"]


def _reduce(writer: _Writer, step: _Step) -> list[str]:
    params, half = step.eqn.params, len(step.given) // 2
    inner = params["jaxpr"]
    closed = inner if isinstance(inner, ClosedJaxpr) else ClosedJaxpr(inner, params["consts"])
    before, writer._place = writer._place, writer._place._replace(has_arrays=True)
    function = writer.write_function(closed)
    writer._place = before
    arrays, firsts = ", ".join(step.given[:half]), ", ".join(step.given[half:])
    fold = f"op.reduced([{arrays}], [{firsts}], {tuple(params['dimensions'])}"
    return [f"{_targets(step.made)} = {fold}, lambda some: {function}(some, until))"]


_WITH_FUNCTIONS = {"while": _while, "scan": _scan, "cond": _cond, "reduce": _reduce}
