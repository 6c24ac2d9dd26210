"""Programs kept on disk: found again without tracing, safe with broken files, only in a folder of
one's own; compiled without optimisation at first where the arguments are small.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sign_model.foundation import background, kept_programs
from sign_model.foundation.kept_programs import KeptProgram
from sign_model.foundation.uncompiled.first_answers import uncompiled


class Answer(NamedTuple):
    total: jax.Array
    parts: dict[str, jax.Array]


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("SRT_JAX_PROGRAMS", str(tmp_path / "programs"))
    return tmp_path / "programs"


def program(traced, in_tiers=None):
    """A program made again, as in a new process; `traced` grows whenever its function is traced."""

    def fun(numbers, factor):
        traced.append(numbers.shape)
        return Answer(numbers.sum() * factor, {"doubled": numbers * 2, "negative": -numbers})

    return KeptProgram(fun, ("a sum", 3), {}, in_tiers)


def answer_of(traced, numbers):
    return program(traced)(numbers, numbers.dtype.type(2))


def test_a_program_made_again_is_found_and_not_traced(place):
    traced = []
    numbers = np.arange(5, dtype=np.float32)
    first, second = answer_of(traced, numbers), answer_of(traced, numbers)
    assert len(traced) == 1 and isinstance(second, Answer)
    assert float(second.total) == 20
    jax.tree.map(np.testing.assert_array_equal, first, second)
    assert place.stat().st_mode & 0o777 == 0o700


def test_another_shape_dtype_or_setting_is_another_program(place):
    traced = []
    answer_of(traced, np.arange(5, dtype=np.float32))
    answer_of(traced, np.arange(6, dtype=np.float32))
    answer_of(traced, np.arange(5, dtype=np.float16))
    with jax.debug_nans(True):
        answer_of(traced, np.arange(5, dtype=np.float32))
    assert len(traced) == 4 == len(list(place.glob("*.program")))


@pytest.mark.parametrize("content", [b"", b"\x80no program", None])
def test_a_broken_file_is_compiled_again(place, content):
    traced = []
    numbers = np.arange(5, dtype=np.float32)
    answer_of(traced, numbers)
    (file,) = place.glob("*.program")
    file.write_bytes(file.read_bytes()[:1000] if content is None else content)
    assert float(answer_of(traced, numbers).total) == 20 and len(traced) == 2
    assert float(answer_of(traced, numbers).total) == 20 and len(traced) == 2  # whole again


def test_nothing_is_kept_where_that_is_unsafe_unwanted_or_impossible(place, tmp_path, monkeypatch):
    place.mkdir(mode=0o700)
    place.chmod(0o777)
    traced = []
    answer_of(traced, np.arange(5, dtype=np.float32))
    assert not list(place.iterdir())
    monkeypatch.setenv("SRT_JAX_PROGRAMS", "off")
    answer_of(traced, np.arange(5, dtype=np.float32))
    assert kept_programs.folder() is None and len(traced) == 2
    monkeypatch.setenv("SRT_JAX_PROGRAMS", str(tmp_path / "a file" / "folder"))
    (tmp_path / "a file").write_text("")
    answer_of(traced, np.arange(5, dtype=np.float32))
    assert len(traced) == 3


def test_the_programs_not_used_for_longest_go_first(place, monkeypatch):
    traced = []
    answer_of(traced, np.arange(5, dtype=np.float32))
    (old,) = place.glob("*.program")
    monkeypatch.setattr(kept_programs, "MOST_BYTES", old.stat().st_size * 3 // 2)
    answer_of(traced, np.arange(6, dtype=np.float32))
    (left,) = place.glob("*.program")
    assert left != old


def is_small(numbers, _factor):
    return numbers.size < 9


def tiers_of(run):
    return [entry.is_first_tier for entry in run._loaded.values()]


def test_a_small_call_is_compiled_quickly_and_optimised_once_it_pays(place, monkeypatch):
    traced, two = [], np.float32(2)
    small, large = np.arange(5, dtype=np.float32), np.arange(9, dtype=np.float32)
    run = program(traced, is_small)
    first = run(small, two)
    assert tiers_of(run) == [True] and len(list(place.glob("*.program"))) == 1
    run(large, two)
    assert tiers_of(run) == [True, False] and len(traced) == 2
    # another process finds the first tier
    other = program(traced, is_small)
    assert other.is_kept(small, two)
    other(small, two)
    assert tiers_of(other) == [True] and len(traced) == 2
    # optimised from what was traced before, or, where that was elsewhere, traced again
    monkeypatch.setattr(kept_programs, "PATIENCE", 0.0)
    run._seconds.clear()
    run(small, two)
    background.finish()
    assert tiers_of(run) == [False, False] and len(traced) == 2
    jax.tree.map(np.testing.assert_array_equal, first, run(small, two))
    place_of_optimised = sorted(place.glob("*.program"), key=lambda path: path.stat().st_mtime)[-1]
    place_of_optimised.unlink()
    other._seconds.clear()
    other(small, two)
    background.finish()
    assert tiers_of(other) == [False] and len(traced) == 3
    # and kept: a new process starts with it
    newest = program(traced, is_small)
    newest(small, two)
    assert tiers_of(newest) == [False] and len(traced) == 3


def test_a_program_that_cannot_be_optimised_stays_what_it_is(monkeypatch):
    run, two, numbers = program([], is_small), np.float32(2), np.arange(5, dtype=np.float32)
    monkeypatch.setattr(kept_programs, "PATIENCE", 0.0)

    def load(*args, is_final=False, **options):
        return 1 / 0 if is_final else KeptProgram._load(run, *args, **options)

    monkeypatch.setattr(run, "_load", load)
    first = run(numbers, two)
    background.finish()
    assert tiers_of(run) == [True]
    jax.tree.map(np.testing.assert_array_equal, first, run(numbers, two))


@pytest.mark.parametrize(
    "mode",
    [
        "least",
        pytest.param("shortest", marks=pytest.mark.slow),
        pytest.param("paper", marks=pytest.mark.slow),
        pytest.param("literal", marks=pytest.mark.slow),
    ],
)
def test_answers_are_the_same_before_and_after_optimisation(mode, monkeypatch):
    import srt_jax
    from srt_jax import solver
    from srt_jax.instances.generate import generate

    made = generate("mixed", count=6, size=24, seed=5)
    tasks = srt_jax.stack([task for _, task, _ in made])
    solver._solver.cache_clear()
    # the first call is over before the second program is there
    monkeypatch.setattr(kept_programs, "PATIENCE", 0.0)
    before = srt_jax.solve(tasks, mode=mode)
    background.finish()
    after = srt_jax.solve(tasks, mode=mode)
    jax.tree.map(np.testing.assert_array_equal, before, after)
    assert (np.asarray(after.num_cells) > 0).any()


def test_the_solver_answers_the_same_from_a_kept_program():
    import srt_jax
    from srt_jax import solver

    free = np.ones((9, 11), bool)
    free[:, 5] = False
    task = srt_jax.make_task(free, (2, 0), (2, 10))
    first = srt_jax.solve(task)
    solver._solver.cache_clear()  # as in a new process
    second = srt_jax.solve(task)
    jax.tree.map(np.testing.assert_array_equal, first, second)
    assert jnp.isfinite(first.cost)


def test_numpy_answers_first_where_nobody_wants_to_wait(place):
    traced, two, numbers = [], np.int32(2), np.arange(5, dtype=np.int32)
    run = program(traced)
    with uncompiled():
        first = run(numbers, two)
        assert not run._loaded and not list(place.glob("*.program"))
        jax.tree.map(np.testing.assert_array_equal, first, run(numbers, two))
    assert isinstance(first, Answer) and first.total == 20 and first.total.dtype == np.int32
    # outside it is compiled, from what was traced
    jax.tree.map(np.testing.assert_array_equal, first, run(numbers, two))
    assert len(traced) == 1 == len(run._loaded) and len(list(place.glob("*.program"))) == 1
    # what is compiled is taken, in this process and in others
    with uncompiled():
        run(numbers, two)
        other = program(traced)
        other(numbers, two)
    assert len(traced) == 1 == len(other._loaded)


def test_what_numpy_answered_in_another_process_is_worth_compiling(place):
    traced, two, numbers = [], np.int32(2), np.arange(5, dtype=np.int32)
    with uncompiled():
        program(traced)(numbers, two)
        second = program(traced)
        second(numbers, two)
    assert len(traced) == 2 and len(second._loaded) == 1
    (kept,) = place.iterdir()  # the mark is gone
    assert kept.suffix == ".program"


@pytest.mark.parametrize("seconds", [0.0, 1e-9])
def test_patience_is_limited_to_calls_that_take_less(seconds):
    traced, two, numbers = [], np.int32(2), np.arange(5, dtype=np.int32)
    run = program(traced)
    with uncompiled(seconds):
        run(numbers, two)
        run(numbers, two)
    assert len(run._loaded) == 1 == len(traced)


def test_what_numpy_cannot_answer_is_compiled():
    traced, two, numbers = [], np.float32(2), np.arange(5, dtype=np.float32)
    run = program(traced)  # the order of its sum would decide
    with uncompiled():
        assert float(run(numbers, two).total) == 20
    assert len(run._loaded) == 1 == len(traced)
