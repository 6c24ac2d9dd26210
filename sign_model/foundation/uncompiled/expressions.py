"""The NumPy expression of one step of a traced function."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jax.lax import GatherScatterMode, RoundingMethod

from sign_model.foundation.uncompiled import operations


class UntranslatableError(Exception):
    """A traced function has a step without an expression here, or one whose bits depend on the
    machine.
    """


_OPERATORS = {
    "and": "{} & {}",
    "or": "{} | {}",
    "xor": "{} ^ {}",
    "not": "~{}",
    "neg": "-{}",
    "add": "{} + {}",
    "sub": "{} - {}",
    "mul": "{} * {}",
    "lt": "{} < {}",
    "le": "{} <= {}",
    "gt": "{} > {}",
    "ge": "{} >= {}",
    "eq": "{} == {}",
    "ne": "{} != {}",
    "shift_left": "{} << {}",
    "min": "np.minimum({}, {})",
    "max": "np.maximum({}, {})",
    "clamp": "np.minimum(np.maximum({1}, {0}), {2})",
    "abs": "np.abs({})",
    "sign": "np.sign({})",
    "floor": "np.floor({})",
    "ceil": "np.ceil({})",
    "is_finite": "np.isfinite({})",
    "nextafter": "np.nextafter({}, {})",
    "square": "{0} * {0}",
}
"""Steps entry by entry. Of float32 only what is exact or rounded once: NumPy, like the compiler,
then has no choice.
"""

_FOLDS = {
    "reduce_max": "np.maximum",
    "reduce_min": "np.minimum",
    "reduce_or": "np.bitwise_or",
    "reduce_and": "np.bitwise_and",
    "reduce_xor": "np.bitwise_xor",
    "reduce_sum": "np.add",
    "cummax": "np.maximum",
    "cummin": "np.minimum",
    "cumsum": "np.add",
}

NAMES: dict[str, Any] = {"np": np, "op": operations}
"""What expressions refer to, besides their operands and constants."""


class Place(NamedTuple):
    """Where an expression will stand.

    keep: takes a value and returns a name for it. known: takes a name and returns its value where
    that is a constant, else None. has_arrays: whether what the traced function takes for scalars
    are arrays of many, as where entries of an array are folded.
    """

    keep: Callable[[Any], str]
    known: Callable[[str], Any]
    has_arrays: bool = False


def expression(eqn: Any, names: Sequence[str], place: Place) -> str:
    """Returns the expression of a step's only result, a scalar of NumPy where it has no axes.

    Args:
      eqn: of a jaxpr; its primitive has one result and no function among its parameters.
      names: of its operands.
      place: where it will stand.

    Raises:
      UntranslatableError: there is none.
    """
    kind, params, out = eqn.primitive.name, eqn.params, eqn.outvars[0].aval
    first = eqn.invars[0].aval if eqn.invars else out
    step = _Step(names, params, first, np.dtype(out.dtype), tuple(out.shape), place)
    if kind in _OPERATORS:
        return _OPERATORS[kind].format(*names)
    if kind in _FOLDS:
        return _fold(kind, step)
    if kind in _SCATTERS:
        return _scatter(kind, step)
    if kind in ("div", "rem"):
        return _divide(kind, step)
    if kind not in _OF_KIND:
        raise UntranslatableError(f"no NumPy form of {kind}")
    return _OF_KIND[kind](step)


class _Step(NamedTuple):
    """A step of a traced function: the names of its operands, its parameters, the form of its first
    operand, dtype and shape of its result.
    """

    names: Sequence[str]
    params: Any
    first: Any
    dtype: np.dtype
    shape: tuple[int, ...]
    place: Place

    @property
    def name(self) -> str:
        return self.names[0]

    @property
    def source(self) -> np.dtype:
        return np.dtype(self.first.dtype)

    @property
    def is_scalar(self) -> bool:
        """Whether the first operand is one number."""
        return self.first.ndim == 0 and not self.place.has_arrays

    def keep(self, value: Any) -> str:
        return self.place.keep(value)

    def as_result(self, text: str) -> str:
        """The expression of an array as that of the result: a scalar where it has no axes."""
        return text if self.shape else f"{text}[()]"


def index_text(
    starts: Sequence[str], sizes: Sequence[int], shape: Sequence[int], *, drops: bool = False
) -> str:
    """Returns an index, as text: slices that begin at `starts`, moved to lie within an array of
    `shape`; `drops`: the axes of which they take a single entry are dropped.
    """

    def along(start: str, size: int, side: int) -> str:
        if drops and size == 1:
            return f"op.index_in({start}, {side - 1})"
        return ":" if size == side else f"op.slice_in({start}, {side - size}, {size})"

    return ", ".join(map(along, starts, sizes, shape))


def _fold(kind: str, step: _Step) -> str:
    if step.dtype.kind == "f" and kind.endswith("sum"):
        raise UntranslatableError("the order of a sum of floats decides its bits")
    function, name, params = _FOLDS[kind], step.name, step.params
    of_dtype = f", dtype={step.keep(step.dtype)}" if kind.endswith("sum") else ""
    if kind.startswith("reduce"):
        return f"{function}.reduce({name}, axis={tuple(params['axes'])}{of_dtype})"
    axis = params["axis"]
    if params["reverse"]:
        turned = f"np.flip({name}, {axis})"
        return f"np.flip({function}.accumulate({turned}, {axis}{of_dtype}), {axis})"
    return f"{function}.accumulate({name}, {axis}{of_dtype})"


def _divide(kind: str, step: _Step) -> str:
    divisor = step.place.known(step.names[1])
    is_safe = divisor is not None and step.dtype.kind in "iu" and bool(np.all(divisor != 0))
    form = {
        ("div", True): "op.quotient_by({}, {})",
        ("div", False): "op.quotient({}, {})",
        ("rem", True): "np.fmod({}, {})",
        ("rem", False): "op.remainder({}, {})",
    }[kind, is_safe]
    return form.format(*step.names)


def _select(step: _Step) -> str:
    if step.source.kind != "b":
        return step.as_result(f"np.choose({step.name}, [{', '.join(step.names[1:])}])")
    which, if_false, if_true = step.names
    if step.is_scalar:
        return f"{if_true} if {which} else {if_false}"
    return f"np.where({which}, {if_true}, {if_false})"


def _convert(step: _Step) -> str:
    if step.source == step.dtype:
        return step.name
    if step.source.kind == "f" and step.dtype.kind in "iu":
        return f"op.to_integers({step.name}, {step.keep(step.dtype)})"
    if step.source.kind == "b" and step.is_scalar:
        one, none = step.keep(step.dtype.type(1)), step.keep(step.dtype.type(0))
        return f"{one} if {step.name} else {none}"
    return f"{step.name}.astype({step.keep(step.dtype)})"


def _broadcast(step: _Step) -> str:
    if step.shape == tuple(step.first.shape):
        return step.name
    if step.is_scalar:
        return f"op.filled({step.shape}, {step.name}, {step.keep(step.dtype)})"
    sides = [1] * len(step.shape)
    for axis, side in zip(step.params["broadcast_dimensions"], step.first.shape):
        sides[axis] = side
    return f"op.broadcast({step.name}, {tuple(sides)}, {step.shape})"


def _squeeze(step: _Step) -> str:
    return step.as_result(f"{step.name}.reshape({step.shape})")


def _reshape(step: _Step) -> str:
    if step.params["dimensions"] is not None:
        raise UntranslatableError("a reshape that also transposes")
    return _squeeze(step)


def _slice(step: _Step) -> str:
    begins, ends = step.params["start_indices"], step.params["limit_indices"]
    steps = step.params["strides"] or (1,) * len(begins)
    index = ", ".join(f"{a}:{b}:{by}" for a, b, by in zip(begins, ends, steps))
    return f"{step.name}[{index}]"


def _shift_right(kind: str) -> Callable[[_Step], str]:
    def text(step: _Step) -> str:
        if step.dtype.kind == kind:
            return " >> ".join(step.names)
        return f"op.shifted_as({', '.join(step.names)}, '{kind}')"

    return text


def _iota(step: _Step) -> str:
    axis, sides = step.params["dimension"], [1] * len(step.shape)
    sides[axis] = step.shape[axis]
    line = np.arange(step.shape[axis]).astype(step.dtype).reshape(sides)
    return step.keep(np.broadcast_to(line, step.shape))


def _bitcast(step: _Step) -> str:
    before, after = step.source.itemsize, step.dtype.itemsize
    dtype = step.keep(step.dtype)
    if before == after:
        return f"{step.name}.view({dtype})"
    # NumPy joins or splits along the last axis, which must be there and lie in one piece
    sides = (*step.first.shape, 1) if before > after else tuple(step.first.shape)
    whole = f"np.ascontiguousarray({step.name}).reshape({sides})"
    return step.as_result(f"{whole}.view({dtype}).reshape({step.shape})")


def _gather(step: _Step) -> str:
    fill, params = "None", step.params
    if params["mode"] == GatherScatterMode.FILL_OR_DROP:
        value = params["fill_value"]
        fill = step.keep(step.dtype.type(_nothing(step.dtype) if value is None else value))
    numbers, sizes = step.keep(params["dimension_numbers"]), tuple(params["slice_sizes"])
    return step.as_result(f"op.gathered({', '.join(step.names)}, {numbers}, {sizes}, {fill})")


def _nothing(dtype: np.dtype) -> Any:
    """What JAX puts where a gathered entry does not exist."""
    if dtype.kind in "iu":
        return np.iinfo(dtype).min if dtype.kind == "i" else np.iinfo(dtype).max
    return np.nan if dtype.kind == "f" else True


_SCATTERS = {
    "scatter": "None",
    "scatter-add": "np.add",
    "scatter-min": "np.minimum",
    "scatter-max": "np.maximum",
}


def _scatter(kind: str, step: _Step) -> str:
    if step.dtype.kind == "f" and kind == "scatter-add":
        raise UntranslatableError("the order of a sum of floats decides its bits")
    is_moved = step.params["mode"] == GatherScatterMode.CLIP
    numbers = step.keep(step.params["dimension_numbers"])
    return f"op.scattered({', '.join(step.names)}, {numbers}, {is_moved}, {_SCATTERS[kind]})"


def _round(step: _Step) -> str:
    if step.params["rounding_method"] != RoundingMethod.TO_NEAREST_EVEN:
        raise UntranslatableError("halves rounded away from zero")
    return f"np.rint({step.name})"


def _extreme(function: str) -> Callable[[_Step], str]:
    def text(step: _Step) -> str:
        (axis,) = step.params["axes"]
        return f"np.{function}({step.name}, axis={axis}).astype({step.keep(step.dtype)})"

    return text


def _count_bits(step: _Step) -> str:
    if not hasattr(np, "bitwise_count"):
        raise UntranslatableError("NumPy counts bits from version 2 on")
    unsigned = step.keep(np.dtype(f"u{step.dtype.itemsize}"))  # else that of the absolute value
    return f"np.bitwise_count({step.name}.view({unsigned})).astype({step.keep(step.dtype)})"


def _power(step: _Step) -> str:
    if step.params["y"] != 2:
        raise UntranslatableError("a power above 2")
    return f"{step.name} * {step.name}"


def _joined(step: _Step) -> str:
    return f"[{', '.join(step.names)}]"


_OF_KIND: dict[str, Callable[[_Step], str]] = {
    "select_n": _select,
    "convert_element_type": _convert,
    "broadcast_in_dim": _broadcast,
    "reshape": _reshape,
    "squeeze": _squeeze,
    "slice": _slice,
    "shift_right_logical": _shift_right("u"),
    "shift_right_arithmetic": _shift_right("i"),
    "iota": _iota,
    "bitcast_convert_type": _bitcast,
    "gather": _gather,
    "round": _round,
    "argmax": _extreme("argmax"),
    "argmin": _extreme("argmin"),
    "population_count": _count_bits,
    "integer_pow": _power,
    "clz": lambda step: f"op.leading_zeros({step.name})",
    "transpose": lambda step: f"np.transpose({step.name}, {tuple(step.params['permutation'])})",
    "rev": lambda step: f"np.flip({step.name}, {tuple(step.params['dimensions'])})",
    "tile": lambda step: f"np.tile({step.name}, {tuple(step.params['reps'])})",
    "concatenate": lambda step: f"np.concatenate({_joined(step)}, {step.params['dimension']})",
    "stack": lambda step: f"np.stack({_joined(step)}, {step.params['axis']})",
    "pad": lambda step: f"op.padded({_joined(step)[1:-1]}, {tuple(step.params['padding_config'])})",
}
