"""Generated instances: the stated optimum is the optimum, every kind comes, and a seed settles
all.
"""

import collections
import zlib

import numpy as np
import pytest

from srt_jax.instances.generate import KINDS, MIN_SIZE, generate
from srt_jax.reference.brute_force import brute_force_removal
from srt_jax.reference.dijkstra import dijkstra

MIXED = {
    *(
        "half",
        "quarter",
        "bagel",
        "rooms",
        "fences",
        "rings",
        "open",
        "boxed-start",
        "double-wall",
        "unsolvable",
    ),
    *("covered-goal", "patched", "noise-in-parts", "covered-start"),
}


def kind_of(name: str) -> str:
    return name.rsplit("-", 1)[0]


def digest(instances) -> int:
    """One number for all arrays and optima."""
    total = 0
    for name, task, optimum in instances:
        for array in (*task.values(), np.float64(optimum)):
            total = zlib.crc32(np.ascontiguousarray(array).tobytes(), total)
        total = zlib.crc32(name.encode(), total)
    return total


def parts(task):
    return (
        task.labels,
        task.destroyable,
        task.removal_cost,
        tuple(task.start.tolist()),
        tuple(task.goal.tolist()),
    )


@pytest.mark.parametrize(
    "kind", ["half", "quarter", "bagel-5", "rooms", "fences", "rings", "mixed"]
)
def test_the_stated_optimum_is_that_of_brute_force(kind):
    compared = collections.Counter()
    for name, task, optimum in generate(kind, count=84, size=(MIN_SIZE, 22), seed=1):
        if np.isnan(optimum) or task.destroyable.sum() > 9:
            continue
        assert brute_force_removal(*parts(task)).cost == optimum, name
        compared[kind_of(name)] += 1
    assert sum(compared.values()) >= 40
    assert kind != "mixed" or set(compared) >= MIXED - {"patched", "noise-in-parts"}


def test_mixed_instances_are_what_their_names_say():
    instances = generate("mixed", count=56, size=(40, 120), seed=2)
    assert {kind_of(name) for name, _, _ in instances} == MIXED
    for name, task, optimum in instances:
        labels, flags, _, start, goal = parts(task)
        free = (labels == -1).all(axis=0)
        is_open = np.isfinite(dijkstra(free, start)[goal])
        opened = ((labels == -1) | np.append(flags, False)[labels]).all(axis=0)
        is_solvable = bool(free[start]) and np.isfinite(dijkstra(opened, start)[goal])
        kind = kind_of(name)
        assert np.isnan(optimum) or is_open == (optimum == 0), name
        assert np.isnan(optimum) or is_solvable == np.isfinite(optimum), name
        assert free[start] == (kind != "covered-start"), name
        assert free[goal] == (kind != "covered-goal"), name


def test_hard_cases_come_up():
    instances = generate("mixed", count=280, size=(20, 60), seed=3)
    # overlaps
    assert any(
        len(task.labels) == 2 and (task.labels >= 0).all(axis=0).any() for _, task, _ in instances
    )
    for kind in ("rooms", "fences", "rings", "boxed-start", "double-wall", "covered-goal"):
        optima = [optimum for name, _, optimum in instances if kind_of(name) == kind]
        assert len(set(optima)) > 3 and (np.isinf(optima).any() or kind == "double-wall"), kind


@pytest.mark.parametrize("kind", ["half", "quarter", "bagel-10", "mixed"])
def test_sizes_lie_in_their_range(kind):
    sizes = np.array([task.size for _, task, _ in generate(kind, count=30, size=(30, 50), seed=4)])
    assert sizes.min() >= 30 and sizes.max() <= 50 and len(set(map(tuple, sizes.tolist()))) > 20
    assert all(
        task.labels.shape[1:] == (32, 32) for _, task, _ in generate(kind, count=3, size=32, seed=4)
    )


def test_an_instance_depends_on_its_place_and_seed_alone():
    few, many = (generate("mixed", count=count, size=(16, 40), seed=5) for count in (14, 28))
    assert digest(few) == digest(many[:14]) != digest(many[14:])
    assert digest(few) != digest(generate("mixed", count=14, size=(16, 40), seed=6))


def test_instances_are_the_same_on_every_machine():
    assert digest(generate("mixed", count=28, size=(16, 90), seed=7)) == 1542735145


def test_tasks_are_well_formed():
    for name, task, _ in generate("mixed", count=28, size=(16, 40), seed=8):
        assert [array.dtype for array in task.values()] == [
            "int32",
            "bool",
            "float32",
            "int32",
            "int32",
            "int32",
        ], name
        assert (task.removal_cost > 0).all() and -1 <= task.labels.min() <= task.labels.max() < len(
            task.destroyable
        )


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        (
            "thirds",
            {},
            (
                "unknown kind 'thirds': choose one of half, quarter, bagel-K, rooms, fences, rings,"
                " mixed"
            ),
        ),
        ("bagel-x", {}, "unknown kind"),
        ("bagel-1", {}, "K must be at least 3"),
        ("bagel-100", {"size": 64}, "bagel-100: .* size must be 85 or more"),
        ("mixed", {"size": 15}, "size must be 16 or more"),
        ("mixed", {"size": (40, 30)}, "the least before the greatest"),
        ("mixed", {"count": 0}, "count must be at least 1"),
        ("mixed", {"seed": -1}, "seed at least 0"),
    ],
)
def test_what_cannot_be_made_is_reported(kind, options, message):
    with pytest.raises(ValueError, match=message):
        generate(kind, **({"count": 1, "size": 64, "seed": 0} | options))


def test_a_ring_just_fits():
    assert generate("bagel-100", count=3, size=85, seed=0)[0][2] > 0


def test_kinds_are_those_of_the_command_line():
    assert KINDS == ("half", "quarter", "bagel-K", "rooms", "fences", "rings", "mixed")
