import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from sign_model.foundation import marks
from srt_jax.engine import batching, in_place

needs_marks = pytest.mark.skipif(
    not marks.is_marking(), reason="this JAX is older than 0.8: no call can be marked"
)


def _running_sums(x):
    return marks.compiled_whole(
        lambda x: lax.map(lambda row: lax.scan(lambda c, v: (c + v, c + v), 0, row)[1], x)
    )(x)


def test_a_marked_loop_gives_what_the_plain_one_gives(monkeypatch):
    x = np.arange(60, dtype=np.int32).reshape(4, 15)
    assert np.array_equal(jax.jit(_running_sums)(x), np.cumsum(x, 1))
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    assert not marks.is_marking()
    assert np.array_equal(jax.jit(lambda x: _running_sums(x))(x), np.cumsum(x, 1))


@needs_marks
def test_the_mark_is_on_the_call_and_on_nothing_else(monkeypatch):
    x = jnp.zeros((2, 3), jnp.int32)
    assert jax.jit(_running_sums).lower(x).as_text().count("xla_cpu_small_call") == 1
    monkeypatch.setenv("SRT_JAX_PLAIN", "1")
    assert "xla_cpu_small_call" not in jax.jit(lambda x: _running_sums(x)).lower(x).as_text()
    assert "xla_cpu_small_call" not in jax.jit(lambda x: jnp.cumsum(x, 1)).lower(x).as_text()


def test_vmap_of_a_batch_kernel_becomes_a_larger_batch():
    seen = []

    @batching.batch_kernel
    def double(x, y):
        seen.append(x.shape)
        return {"sum": x + y, "twice": 2 * x}

    x, y = np.arange(24).reshape(2, 3, 4), np.ones((3, 4), int)
    out = jax.vmap(double, in_axes=(0, None))(x, y)
    assert seen[-1] == (6, 4)
    assert np.array_equal(out["sum"], x + y[None]) and np.array_equal(out["twice"], 2 * x)


@pytest.mark.parametrize("marked", [True, False])
def test_a_queue_runs_in_place_and_right(marked):
    def collatz(start):
        def step(state):
            head, visited = state
            value = in_place.read_apart(visited, head)
            return jnp.where(head % 2 == 0, head // 2, 3 * head + 1), in_place.write(
                visited, value + 1, head
            )

        return lax.while_loop(
            lambda state: state[0] != 1, step, (start[0], jnp.zeros(128, jnp.uint32))
        )[1][None]

    run = marks.compiled_whole(collatz) if marked else collatz
    visited = np.asarray(jax.jit(run)(jnp.array([6], jnp.uint32)))[0]
    assert np.flatnonzero(visited).tolist() == [2, 3, 4, 5, 6, 8, 10, 16] and visited.max() == 1


def test_nothing_global_is_changed_by_importing_the_package():
    import os
    import subprocess
    import sys

    script = (
        "import os; before = dict(os.environ); import jax; values = dict(jax.config.values); import"
        " srt_jax;assert dict(os.environ) == before and dict(jax.config.values) == values"
    )
    subprocess.run(
        [sys.executable, "-c", script],
        check=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )


def _refused_where_marked(x):
    """A scatter, which the compiler refuses in a marked call."""
    return marks.compiled_whole(lambda x: x.at[x].add(1))(x)


@needs_marks
def test_where_the_compiler_refuses_the_marks_the_call_succeeds_without_them_and_no_other():
    run = marks.jitted(_refused_where_marked)
    x = jnp.array([0, 2, 2], jnp.int32)
    assert marks.is_marking()
    with pytest.warns(UserWarning, match="refuses the fast form") as warned:
        out = run(x)
    assert out.tolist() == [1, 2, 4] and marks.is_marking()
    assert (
        len(warned) == 1
        and len(str(warned[0].message).splitlines()) == 1
        and len(str(warned[0].message)) < 300
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run(x).tolist() == [1, 2, 4]  # compiled without marks at once
    with pytest.warns(UserWarning, match="refuses the fast form"):
        assert run(x[:2]).tolist() == [1, 2]  # another program is tried with them
    assert (
        "xla_cpu_small_call" in jax.jit(_running_sums).lower(jnp.zeros((2, 3), jnp.int32)).as_text()
    )


@needs_marks
def test_an_error_with_and_without_marks_is_raised_and_the_marks_stay_on():

    def fails(x):
        return jax.pure_callback(lambda x: 1 / 0, x, x)

    with pytest.raises(jax.errors.JaxRuntimeError):
        jax.block_until_ready(marks.jitted(fails)(jnp.zeros(3)))
    assert marks.is_marking()


def test_no_two_kernels_have_one_name_and_none_is_made_inside_a_function():
    from srt_jax.engine.eager import name_of
    from srt_jax.paths.reach import reach_maps
    from srt_jax.paths.seed import seed_cells
    from srt_jax.propagation.lengths import length_maps

    kernels = (length_maps, reach_maps, seed_cells)
    assert len({name_of(kernel) for kernel in kernels}) == len(kernels)
    with pytest.raises(ValueError, match="function of a module"):
        name_of(lambda maps: maps)


@pytest.mark.parametrize("count", [1, 3])
def test_what_is_kept_goes_from_one_entry_to_the_next(count):
    def one(kept, number):
        kept = kept.at[0].add(number)
        return {"sum": kept[0], "twice": jnp.stack([number, number])}, kept

    numbers = np.arange(2, 2 + count, dtype=np.int32)
    out = jax.jit(lambda x: batching.each_keeping(one, jnp.zeros(4, jnp.int32), x))(numbers)
    np.testing.assert_array_equal(out["sum"], np.cumsum(numbers))
    np.testing.assert_array_equal(out["twice"], np.stack([numbers, numbers], axis=1))
