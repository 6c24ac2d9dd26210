"""MAP's plans along a chain of obstacles: those made beforehand are those made inside the call."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from srt_jax.symbols.planning import chain_in_jit, plan_along_chain
from srt_jax.types import Act


@pytest.mark.parametrize("num_slots", [1, 3])
def test_plans_from_the_table_are_those_made_inside_the_call(num_slots):
    lengths = jnp.array([0, 1, 2, 3, 4, 9, 0, 2], jnp.int32)
    is_here = jnp.arange(8) >= 6
    forms = [
        jax.jit(lambda *args, plan=plan: plan(*args, num_slots=num_slots))(lengths, is_here)
        for plan in (plan_along_chain, chain_in_jit)
    ]
    for tabled, planned in zip(*forms):
        assert tabled.dtype == planned.dtype
        assert np.array_equal(tabled, planned)


def test_a_chain_is_passed_obstacle_by_obstacle():
    acts = plan_along_chain(jnp.array([2, 0]), jnp.array([False, False]), num_slots=2)
    steps = [Act.APPROACH, Act.DESTROY, Act.PASS]
    assert acts.act.tolist() == [[*steps, *steps, -1], [Act.RELOCATE, *[-1] * 6]]
    assert acts.slot.tolist() == [[0, 0, 0, 1, 1, 1, -1], [-1] * 7]
