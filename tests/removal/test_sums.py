"""Sums of costs are exact, whatever the costs: against Python's whole numbers, which have no
end.
"""

from fractions import Fraction

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax.removal import sums
from tests.helpers.jitted import Jitted

jitted = Jitted(sums)
LEAST, GREATEST = np.float32(1.5e-45), np.finfo(np.float32).max


def whole(cost) -> int:
    """A float32 in units of the least positive one."""
    return int(Fraction(float(cost)) * 2**149)


def number(words, costs) -> int:
    """What the words of one number mean, in the same unit."""
    return sum(int(word) << 32 * place for place, word in enumerate(np.asarray(words))) << int(
        costs.lowest
    )


def draw_costs(rng, count, low, high):
    costs = (10.0 ** rng.uniform(low, high, count)).astype(np.float32)
    return np.clip(costs, LEAST, GREATEST)


KINDS = {
    "ten orders of magnitude": (-5, 5),
    "all of float32": (-44.8, 38.5),
    "one order": (0, 1),
    "subnormal": (-44.8, -38),
}


@pytest.mark.parametrize("kind", KINDS)
def test_sums_are_exact_and_rounded_down(kind):
    rng = np.random.default_rng(1)

    @jax.jit
    def run(cost, which):
        costs = sums.costs_of(cost, which)
        total = sums.total(costs, which)
        more = sums.with_cost(total, costs, jnp.argmax(which).astype(jnp.int32))
        return (
            costs,
            total,
            more,
            sums.to_float32(jnp.stack([total, sums.never(), sums.zero()], axis=1), costs),
        )

    for _ in range(60):
        cost, which = draw_costs(rng, 37, *KINDS[kind]), rng.random(37) < 0.5
        which[0] |= not which.any()
        costs, total, more, (down, never, nothing) = run(cost, which)
        true = sum(map(whole, cost[which]))
        assert number(total, costs) == true
        assert number(more, costs) == true + whole(cost[int(which.argmax())])
        above = np.nextafter(down, np.float32(np.inf))
        assert whole(down) <= true and (np.isinf(above) or true < whole(above))
        assert np.isinf(never) and nothing == 0


def test_the_greatest_sum_fits_and_is_no_infinity():
    cost = np.array([GREATEST] * 3 + [LEAST], np.float32)
    costs = jitted.costs_of(jnp.asarray(cost), jnp.ones(4, bool))
    total = jitted.total(costs, jnp.ones(4, bool))
    assert number(total, costs) == sum(map(whole, cost)) and int(costs.num_words) == sums.WORDS - 1
    assert jitted.to_float32(total[:, None], costs)[0] == GREATEST


def test_small_whole_costs_take_one_word():
    costs = jitted.costs_of(
        jnp.asarray([1, 2.5, 100, 1e30], jnp.float32), jnp.asarray([True, True, True, False])
    )
    assert int(costs.num_words) == 1


def test_the_least_and_which_are_it():
    cost = jnp.asarray([3, 1e8, 1, 1, 1e-8], jnp.float32)
    costs = jitted.costs_of(cost, jnp.ones(5, bool))
    all_of = jitted.with_costs(
        jnp.zeros((sums.WORDS, 5), jnp.uint32), jnp.ones(5, bool), sums.zero(), costs
    )
    low, which = jitted.least(all_of, jnp.asarray([True, True, True, True, False]), costs.num_words)
    assert number(low, costs) == whole(1) and which.tolist() == [False, False, True, True, False]
    low, which = jitted.least(all_of, jnp.zeros(5, bool), costs.num_words)
    assert (low == sums.never()).all() and not which.any()


def test_less_is_less_in_the_smallest_place():
    cost = jnp.asarray([1e8, 1e-8], jnp.float32)
    costs = jitted.costs_of(cost, jnp.ones(2, bool))
    large, both = (
        jitted.total(costs, jnp.asarray(which)) for which in ([True, False], [True, True])
    )
    assert (
        jitted.is_less(large, both)
        and not jitted.is_less(both, large)
        and not jitted.is_less(both, both)
    )
    assert jitted.is_less(both, sums.never()) and not jitted.is_less(sums.never(), sums.never())


def test_a_chain_is_within_its_own_sum_and_not_within_less():
    cost = jnp.asarray([1e8, 0.1, 0.2], jnp.float32)
    yes = jnp.ones(3, bool)
    costs = jitted.costs_of(cost, yes)
    numbers = jnp.zeros((sums.WORDS, 3), jnp.uint32)
    forth = jitted.with_costs(
        numbers, yes, jitted.with_cost(sums.zero(), costs, jnp.int32(0)), costs
    )
    back = jitted.with_costs(numbers, yes, sums.zero(), costs)
    # Of each: met for 1e8 from one side and for nothing from the other.
    limits = [
        jitted.total(costs, jnp.asarray(which))
        for which in ([True, True, False], [True, False, True])
    ]
    assert jitted.are_within(forth, back, costs, limits[0], sums.zero()).tolist() == [
        False,
        True,
        False,
    ]
    assert jitted.are_within(forth, back, costs, limits[1], sums.zero()).tolist() == [
        False,
        True,
        True,
    ]


def test_what_make_task_refuses_counts_as_the_nearest_cost():
    cost = jnp.asarray([0, -1, np.inf], jnp.float32)
    costs = jitted.costs_of(cost, jnp.ones(3, bool))
    assert number(jitted.total(costs, jnp.ones(3, bool)), costs) == whole(GREATEST)


def test_many_costs_are_added_without_overflow():
    for count in (2049, 70000):
        cost = np.full(count, 16777215.0, np.float32)
        cost[0] = 2.0**-20
        which = jnp.ones(count, bool)
        costs = jitted.costs_of(jnp.asarray(cost), which)
        assert number(jitted.total(costs, which), costs) == sum(map(whole, cost))


def test_totals_of_a_batch():
    cost, which = (
        jnp.asarray([[1e8, 1], [0.1, 0.2]], jnp.float32),
        jnp.asarray([[True, True], [True, True]]),
    )
    rounded = jax.jit(sums.totals)(cost, which)
    assert rounded.tolist() == [1e8, np.nextafter(np.float32(0.3), np.float32(0))]


def test_without_the_marks_the_sums_have_the_same_bits(monkeypatch):
    rng = np.random.default_rng(2)
    cost = np.stack([draw_costs(rng, 24, *ends) for ends in KINDS.values()])
    which = rng.random(cost.shape) < 0.5
    expected = np.asarray(jax.jit(sums.totals)(cost, which))
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    plain = np.asarray(jax.jit(lambda *args: sums.totals(*args))(cost, which))
    assert plain.tobytes() == expected.tobytes()


def test_the_dearest_is_found_among_costs_of_all_sizes_and_one_step_apart():
    cost = np.array([1e-45, 3, np.nextafter(np.float32(3), np.float32(4)), 1e-39, 3e38, 3e38, 2])
    cost, every = jnp.asarray(cost, jnp.float32), jnp.ones(7, bool)
    costs = jitted.costs_of(cost, every)
    left = np.ones(7, bool)
    order = []
    while left.any():
        order.append(int(jitted.dearest(costs, jnp.asarray(left))))
        left[order[-1]] = False
    assert order == [4, 5, 2, 1, 6, 3, 0]
    assert int(jitted.dearest(costs, jnp.zeros(7, bool))) == 0
