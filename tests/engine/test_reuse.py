"""Which shape an eager call runs in; the answers are the same whichever it is."""

import jax
import numpy as np
import pytest

import srt_jax
from srt_jax import Task, solver
from srt_jax.engine import cores, reuse
from srt_jax.engine.reuse import Bucket, Shapes, only_own_shapes

OWN = Bucket(2, 1, 32, 32, 64, 768)


def choose(shapes, own=OWN, kept=()):
    return shapes.choose("least", own, lambda shape: shape in kept, lambda h, w: h * w * 3 // 4)


def ran(shapes, own, taken, times=1):
    for _ in range(times):
        with shapes.timed("least", own, taken):
            pass


def test_a_shape_that_nothing_at_hand_serves_gets_its_own_program():
    assert choose(Shapes()) == OWN
    shapes = Shapes()
    ran(shapes, OWN._replace(layers=1, height=16), OWN._replace(height=16))
    assert choose(shapes) == OWN


@pytest.mark.parametrize(
    "larger", [{"batch": 8}, {"layers": 4}, {"height": 64, "width": 64}, {"obstacles": 256}]
)
def test_a_larger_shape_at_hand_is_taken(larger):
    shapes, taken = Shapes(), OWN._replace(**larger)
    ran(shapes, taken, taken)
    assert choose(shapes) == taken


def test_one_that_is_much_larger_is_not_and_of_several_the_smallest_is():
    shapes = Shapes()
    for batch in (2048, 64, 16):
        ran(shapes, OWN._replace(batch=batch), OWN._replace(batch=batch))
    own = OWN._replace(batch=1)
    assert choose(shapes, own) == own._replace(batch=16)
    huge = Shapes()
    ran(huge, OWN._replace(batch=2048), OWN._replace(batch=2048))
    assert choose(huge, own) == own


def test_a_smaller_batch_runs_several_times():
    shapes, one = Shapes(), OWN._replace(batch=1)
    ran(shapes, one, one)
    assert choose(shapes) == one


def test_programs_on_disk_count_too_and_its_own_comes_first():
    wider = OWN._replace(batch=4)
    assert choose(Shapes(), kept=[wider]) == wider
    assert choose(Shapes(), kept=[wider, OWN]) == OWN


def test_a_shape_that_lost_much_time_gets_its_own_program(monkeypatch):
    shapes, taken = Shapes(), OWN._replace(batch=8)
    clock = iter(np.arange(0.0, 1000.0, 2.0))
    monkeypatch.setattr(reuse.time, "perf_counter", lambda: float(next(clock)))
    ran(shapes, taken, taken)
    used = []
    for _ in range(6):
        used.append(choose(shapes))
        ran(shapes, OWN, used[-1])
    # each call takes two seconds, of which padding is three quarters; more than four are lost
    assert used == [taken] * 3 + [OWN] * 3


def test_other_options_have_other_programs():
    shapes, taken = Shapes(), OWN._replace(batch=8)
    ran(shapes, taken, taken)
    other = shapes.choose("paper", OWN, lambda _: False, lambda h, w: h * w)
    assert other == OWN


def test_answers_do_not_depend_on_the_shape_they_are_computed_in():
    rng = np.random.default_rng(3)
    tasks = []
    for _ in range(5):
        free = rng.random((17, 21)) > 0.35
        free[0, 0] = free[-1, -1] = True
        tasks.append(srt_jax.make_task(free, (0, 0), (16, 20)))
    batch = srt_jax.stack(tasks)
    with only_own_shapes():
        expected = jax.tree.map(np.asarray, srt_jax.solve(batch))
    for number in range(len(tasks)):
        alone = srt_jax.solve(srt_jax.unstack(batch)[number])
        for name, value in alone.items():
            whole = getattr(expected, name)[number]
            assert (np.asarray(value) == whole[tuple(map(slice, np.shape(value)))]).all(), name


def test_parts_of_a_large_batch_run_in_a_shape_for_a_few_more_obstacles(monkeypatch):
    monkeypatch.setattr(cores, "num_cores", lambda: 2)
    monkeypatch.setattr(solver, "_shapes", Shapes())
    labels = np.full((40, 1, 128, 128), -1, np.int32)
    labels[:, 0, :, 64] = 0
    end = np.zeros((40, 2), np.int32)

    def tasks(obstacles):
        return Task(
            labels=labels,
            destroyable=np.ones((40, obstacles), bool),
            removal_cost=np.ones((40, obstacles), np.float32),
            start=end,
            goal=end + np.array([5, 100], np.int32),
            size=np.full((40, 2), 128, np.int32),
        )

    def shapes_after(*numbers):
        for number in numbers:
            assert (np.asarray(srt_jax.solve(tasks(number)).num_destroyed) == 1).all()
        return {shape for known in solver._shapes._at_hand.values() for shape in known}

    (wide,) = shapes_after(150)
    assert wide.obstacles == 256 and wide.batch < 40
    assert shapes_after(3, 100) == {wide}


def test_parts_may_waste_a_second_and_a_second_layer_wastes_little():
    streets = Bucket(8, 1, 512, 512, 128, 1024)
    layered = streets._replace(layers=2)
    for count in (264, 100_000):
        assert reuse._serves(layered, streets, reuse.most_of_parts(streets, count))
    larger = streets._replace(height=768, width=768)
    assert reuse._serves(larger, streets, reuse.most_of_parts(streets, 64))
    assert not reuse._serves(larger, streets, reuse.most_of_parts(streets, 10_000))
