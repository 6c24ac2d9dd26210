"""Programs of NumPy: the bits of the compiled function for every step, nothing of the caller's
changed, and a refusal where the bits would depend on the machine.
"""

import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from sign_model.foundation.uncompiled.expressions import UntranslatableError
from sign_model.foundation.uncompiled.program import OutOfTimeError, translated

I32, U32, F32 = np.int32, np.uint32, np.float32
WHOLE = np.array([0, 1, -1, 2, 7, -7, 31, 32, 33, -33, 2**31 - 1, -(2**31), 12345, -6], I32)
BITS = WHOLE.view(U32)
REAL = np.array(
    [0, 1, -1, 0.5, 1.5, 2.5, -2.5, 3e9, -3e9, 1e-30, 3e38, np.inf, -np.inf, np.nan, 2**24], F32
)
ROUNDED = lax.RoundingMethod.TO_NEAREST_EVEN


def same_bits(fun, *args):
    """Holds the program of `fun` against the compiled one; returns what both give."""
    args = jax.tree.map(np.asarray, args)
    before = jax.tree.map(np.copy, args)
    traced = jax.jit(fun).trace(*args)
    found = translated(traced.jaxpr)(jax.tree.leaves(args), time.perf_counter() + 60)
    wanted = [np.asarray(leaf) for leaf in jax.tree.leaves(jax.jit(fun)(*args))]
    assert len(found) == len(wanted)
    for ours, theirs in zip(found, wanted):
        assert (ours.dtype, ours.shape) == (theirs.dtype, theirs.shape)
        is_nan = np.isnan(ours) if ours.dtype.kind == "f" else np.zeros(ours.shape, bool)
        np.testing.assert_array_equal(ours, theirs)
        assert ours[~is_nan].tobytes() == theirs[~is_nan].tobytes()
    jax.tree.map(np.testing.assert_array_equal, args, before)
    return found


def pairs(values):
    return np.repeat(values, len(values)), np.tile(values, len(values))


BINARY = {
    "whole": (WHOLE, "add sub mul div rem max min bitwise_and bitwise_or bitwise_xor"),
    "bits": (BITS, "add sub mul div rem max min bitwise_and bitwise_or bitwise_xor"),
    "real": (REAL, "add sub mul max min nextafter"),
    "bool": (np.array([False, True]), "bitwise_and bitwise_or bitwise_xor max min"),
}


@pytest.mark.parametrize("kind", BINARY)
@pytest.mark.parametrize("is_scalar", [False, True])
def test_two_operands(kind, is_scalar):
    values, names = BINARY[kind]
    compared = "lt le gt ge eq ne"

    def every(a, b):
        return [getattr(lax, name)(a, b) for name in f"{names} {compared}".split()]

    a, b = pairs(values)
    if kind == "real":  # the sign of a zero among equals is the compiler's choice
        keep = (a != 0) | (b != 0)
        a, b = a[keep], b[keep]
    if not is_scalar:
        same_bits(every, a, b)
        return
    for i in range(0, len(a), 3):
        same_bits(every, a[i], b[i])


@pytest.mark.parametrize("values", [WHOLE, BITS, REAL, np.array([True, False])])
def test_one_operand(values):
    def every(x):
        out = [lax.convert_element_type(x, dtype) for dtype in (I32, U32, F32, np.int8, bool)]
        if x.dtype != bool:
            out += [lax.integer_pow(x, 2), lax.clamp(x.dtype.type(1), x, x.dtype.type(9))]
        if x.dtype == F32:
            return [*out, lax.neg(x), lax.abs(x), lax.is_finite(x), lax.round(x, ROUNDED)]
        if x.dtype == bool:
            return [*out, lax.bitwise_not(x)]
        out += [lax.bitwise_not(x), lax.population_count(x), lax.clz(x), lax.neg(x)]
        return out + ([lax.sign(x), lax.abs(x)] if x.dtype == I32 else [])

    same_bits(every, values)
    for value in values:
        same_bits(every, value)


def test_shifts_beyond_the_width():
    def every(x, by):
        return (
            lax.shift_left(x, by),
            lax.shift_right_logical(x, by),
            lax.shift_right_arithmetic(x, by),
        )

    by = np.array([0, 1, 5, 31, 32, 33, 100], I32)
    a, b = np.repeat(WHOLE, len(by)), np.tile(by, len(WHOLE))
    same_bits(every, a, b)
    same_bits(every, a.view(U32), b.view(U32))
    for x, n in zip(a[::5], b[::5]):
        same_bits(every, x, n)


def test_shapes_and_folds():
    x = np.random.default_rng(0).integers(-9, 9, (4, 6, 5)).astype(I32)

    def every(x):
        flat = x.reshape(-1)
        return [
            x[1:3, ::2, 4],
            x.transpose(2, 0, 1),
            jnp.flip(x, 1),
            jnp.tile(x[0], (2, 3)),
            jnp.stack([x[0], x[1]], 1),
            jnp.concatenate([x, x[:2]], 0),
            lax.pad(x, I32(7), ((1, 2, 0), (-1, 3, 1), (0, -2, 2))),
            lax.pad(flat, I32(7), ((-3, -2, 1),)),
            x.sum((0, 2)),
            x.max(1),
            x.min(),
            (x > 0).any((1, 2)),
            (x > 0).all(0),
            jnp.argmax(x, 1),
            jnp.argmin(flat),
            lax.cumsum(x, 1),
            lax.cummax(x, 2, reverse=True),
            lax.broadcasted_iota(I32, (3, 4), 1),
            lax.bitcast_convert_type(x, U32),
            lax.bitcast_convert_type(x, np.uint8),
            lax.bitcast_convert_type(lax.bitcast_convert_type(x, np.uint8), F32),
            jnp.where(x > 0, x, -x),
            lax.select_n(x & 1, x, x + 1),
            jnp.broadcast_to(x[:, :1], (3, 4, 6, 5)),
            lax.sort((flat, lax.iota(I32, flat.size)), num_keys=1, is_stable=True),
            lax.sort((flat & 3, flat, -flat), num_keys=2, is_stable=True),
            jnp.split(flat, [3, 10]),
            lax.reduce_xor(x, (0,)),
        ]

    same_bits(every, x)


def test_a_fold_of_several_arrays():
    def lower(a, b):
        is_first = (a[0] < b[0]) | ((a[0] == b[0]) & (a[1] < b[1]))
        return tuple(jnp.where(is_first, one, two) for one, two in zip(a, b))

    def every(x):
        places = lax.broadcasted_iota(I32, x.shape, 1)
        return lax.reduce((x, places), (I32(99), I32(99)), lower, (1,))

    same_bits(every, np.random.default_rng(1).integers(0, 5, (3, 13)).astype(I32))


@pytest.mark.parametrize("mode", ["clip", "fill", "promise_in_bounds"])
def test_gathers_and_scatters(mode):
    rng = np.random.default_rng(2)
    x = rng.integers(0, 99, (7, 9)).astype(I32)
    least, beyond = (0, 7) if mode == "promise_in_bounds" else (-3, 12)
    rows, cols = rng.integers(least, beyond, (2, 5, 4)).astype(I32)

    def every(x, rows, cols):
        at = x.at[rows, cols]
        given = jnp.arange(20, dtype=I32).reshape(5, 4)
        # written to other cells each, but for sums and extremes
        alone = x.at[jnp.arange(5, dtype=I32) * 2, cols[:, 0]]
        return [
            at.get(mode=mode),
            x.at[rows].get(mode=mode),
            x.at[:, cols].get(mode=mode),
            jax.vmap(lambda line, k: line.at[k].get(mode=mode))(x[:5], rows),
            at.add(given, mode=mode),
            at.max(given, mode=mode),
            at.min(given, mode=mode),
            alone.set(given[:, 1], mode=mode),
            jax.vmap(lambda line, k: line.at[k[0]].set(I32(7), mode=mode))(x[:5], rows),
        ]

    same_bits(every, x, rows, cols)
    if mode == "fill":
        same_bits(lambda x, k: x.at[k].get(mode=mode), REAL, rows)
        same_bits(lambda x, k: x.at[k].get(mode=mode), BITS, rows)


@pytest.mark.parametrize("start", [(-5, 2), (0, 0), (3, 99), (2, 1)])
def test_slices_are_moved_to_lie_within(start):
    x = np.arange(42, dtype=I32).reshape(6, 7)

    def every(x, row, col):
        part = lax.dynamic_slice(x, (row, col), (2, 3), allow_negative_indices=False)
        return [
            part,
            lax.dynamic_index_in_dim(x, row, 0, keepdims=False),
            lax.dynamic_slice(x, (row, col), (1, 1), allow_negative_indices=False).reshape(()),
            lax.dynamic_update_slice(x, -part, (row, col), allow_negative_indices=False),
            x[row, col],
        ]

    same_bits(every, x, I32(start[0]), I32(start[1]))


def test_loops_work_in_place_and_spare_what_others_see():
    def every(x, count):
        def body(state):
            i, work, seen = state
            old = work  # still needed after the change
            work = lax.dynamic_update_slice(work, (work[i] + I32(1))[None], (i,))
            seen = seen + old[i] + work[i]
            return i + 1, work, seen

        def outer(carry, row):
            out = lax.while_loop(lambda state: state[0] < count, body, (I32(0), carry, row))
            return out[1], (out[2], carry[2])  # the carry before the loop changed it

        last, rows = lax.scan(outer, x, jnp.arange(4, dtype=I32))
        back, _ = lax.scan(outer, x, jnp.arange(4, dtype=I32), reverse=True)
        picked = lax.switch(
            count % 3, [lambda a: (a, a), lambda a: (a.at[0].set(9), a), lambda a: (a[::-1], a)], x
        )
        return last, rows, back, picked, x

    for count in (0, 3, 6):
        same_bits(every, np.arange(6, dtype=I32), I32(count))


def test_results_share_no_memory():
    given = np.arange(5, dtype=I32)
    table = np.arange(9, dtype=I32)
    traced = jax.jit(lambda x: (x, x, x[1:], jnp.asarray(table))).trace(given)
    run = translated(traced.jaxpr)
    for out in (first := run([given], time.perf_counter() + 60)):
        out += 1
    assert first[0].tolist() == [1, 2, 3, 4, 5] and given.tolist() == [0, 1, 2, 3, 4]
    again = run([given], time.perf_counter() + 60)
    assert [out.tolist() for out in again[1:]] == [[0, 1, 2, 3, 4], [1, 2, 3, 4], list(range(9))]


@pytest.mark.parametrize(
    "fun",
    [
        jnp.sum,  # in which order?
        jnp.exp,
        jnp.sort,
        lambda x: x @ x,
        lambda x: lax.cumsum(x),
        lambda x: x.at[jnp.array([1, 1])].add(x[:2]),
        lambda x: jax.random.bits(jax.random.key(0)) + x[0].astype(U32),
        lambda x: jax.debug.print("{}", x) or x,
    ],
)
def test_what_depends_on_the_machine_is_refused(fun):
    if fun is jnp.sort:  # ties of keys that carry something along
        fun = lambda x: lax.sort((x, -x), num_keys=1, is_stable=False)  # noqa: E731
    with pytest.raises(UntranslatableError):
        translated(jax.jit(fun).trace(np.arange(4, dtype=F32)).jaxpr)


def test_a_loop_without_end_gives_up():
    forever = jax.jit(lambda x: lax.while_loop(lambda i: i >= 0, lambda i: (i + 1) & 1, x))
    run = translated(forever.trace(I32(0)).jaxpr)
    began = time.perf_counter()
    with pytest.raises(OutOfTimeError):
        run([I32(0)], began + 0.05)


def test_numbers_of_64_bits():
    with jax.enable_x64(True):
        x = np.array([0, 1, -1, 2**40, -(2**63), 2**63 - 1])
        same_bits(lambda a: (a + 1, a * 3, a >> 3, lax.population_count(a), a // 7), x)
        y = np.array([0.1, 1e300, -2.5, np.inf])
        same_bits(lambda a: (a + 1, a * a, a.astype(np.int64), a.astype(F32)), y)
