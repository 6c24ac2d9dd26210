"""Blockers cut start and goal off, and nothing but the blocker has to go; base maps are what they
say.
"""

import numpy as np
import pytest
from scipy import ndimage

from srt_jax import components
from srt_jax.instances import maps
from srt_jax.instances.paper_blockers import BLOCKAGES, block, pick_start_goal
from srt_jax.reference.astar import astar
from srt_jax.reference.brute_force import brute_force_removal
from tests.helpers.pictures import drawn

CORNERS_TOO = np.ones((3, 3), bool)


def shown(labels, start, goal):
    """The picture of a labelled map, the highest id as '@'."""
    signs = np.where(
        (labels == labels.max()).any(axis=0), "@", np.where((labels >= 0).any(axis=0), "o", ".")
    )
    signs[start], signs[goal] = "S", "G"
    return "\n".join("".join(row) for row in signs)


def lines(picture):
    return "\n".join(line.strip() for line in picture.strip().splitlines())


EMPTY = np.full((6, 8), -1, np.int32)


@pytest.mark.parametrize(
    ("kind", "start", "goal", "picture"),
    [
        ("half", (2, 1), (3, 6), """
            ....@...
            ....@...
            .S..@...
            ....@.G.
            ....@...
            ....@..."""),
        ("half", (5, 7), (0, 6), """
            ......G.
            ........
            @@@@@@@@
            ........
            ........
            .......S"""),
        ("quarter", (0, 0), (5, 7), """
            S.......
            ........
            ........
            ....@@@@
            ....@...
            ....@..G"""),
        ("quarter", (5, 0), (2, 4), """
            ...@....
            ...@....
            ...@G...
            ...@@@@@
            ........
            S......."""),
        ("bagel-3", (0, 0), (3, 4), """
            S.......
            ........
            ...@@@..
            ...@G@..
            ...@@@..
            ........"""),
        ("bagel-6", (0, 0), (5, 5), """
            S.......
            ........
            ..@@@@@@
            ..@....@
            ..@....@
            ..@..G.@"""),
    ],
)  # fmt: skip
def test_blockers_on_the_empty_map(kind, start, goal, picture):
    labels, blocker = block(EMPTY, start, goal, kind)
    assert shown(labels, start, goal) == lines(picture)
    assert blocker == 0 and labels.shape == (1, 6, 8)


@pytest.mark.parametrize(
    ("kind", "start", "goal", "share"),
    [
        ("half", (250, 20), (250, 450), 125_000),
        ("half", (480, 100), (20, 100), 125_000),
        ("quarter", (20, 20), (450, 450), 187_500),
        ("quarter", (20, 20), (450, 40), 187_500),
        ("bagel-100", (250, 20), (250, 430), 240_000),
        ("bagel-50", (250, 20), (250, 430), 247_500),
        ("bagel-10", (250, 20), (250, 430), 249_900),
    ],
)
def test_the_shares_explored_are_those_of_the_paper(kind, start, goal, share):
    labels, blocker = block(np.full((500, 500), -1, np.int32), start, goal, kind)
    pieces, _ = ndimage.label((labels != blocker).all(axis=0))
    assert (pieces == pieces[start]).sum() == share


def test_a_blocker_across_obstacles_lies_over_them():
    labels = np.array(
        [[-1, 0, -1, -1], [-1, 0, 1, -1], [-1, -1, 1, -1], [-1, -1, -1, -1]], np.int32
    )
    blocked, blocker = block(labels, (0, 0), (3, 3), "half")
    assert blocker == 2 and blocked.shape == (2, 4, 4)
    assert (blocked[0] == labels).all() and (blocked[1] == 2).sum() == 4
    again, other = block(blocked, (0, 0), (3, 3), "half")
    assert other == 3 and again.shape == (3, 4, 4)


def random_tasks(count):
    """Labelled random maps of up to 8 objects with a connected start and goal, and a kind of
    blocker.
    """
    rng = np.random.default_rng(0)
    while count:
        height, width = rng.integers(8, 20, 2)
        free = rng.random((height, width)) > 0.25
        labels = np.where(free, -1, rng.integers(0, 8, (height, width))).astype(np.int32)
        try:
            start, goal = pick_start_goal(free, apart=int(0.6 * max(height, width)), seed=count)
        except ValueError:
            continue
        count -= 1
        yield labels, start, goal, ("half", "quarter", "bagel-3", "bagel-4", "bagel-7")[count % 5]


def test_the_blocker_is_the_least_removal_whatever_it_costs():
    for labels, start, goal, kind in random_tasks(60):
        blocked, blocker = block(labels, start, goal, kind)
        assert (blocked[0] == labels).all() or (labels == -1).all()
        costs = np.ones(9)
        costs[8] = 100
        everything = brute_force_removal(blocked, np.ones(9, bool), costs, start, goal)
        assert (everything.cost, everything.obstacles) == (100, (blocker,))
        assert not brute_force_removal(
            blocked, np.arange(9) != blocker, costs, start, goal
        ).is_solvable


def test_the_blocker_is_connected():
    for labels, start, goal, kind in random_tasks(60):
        blocked, blocker = block(labels, start, goal, kind)
        own = (blocked == blocker).any(axis=0)
        # a ring cut off at both sides comes in two parts
        assert ndimage.label(own)[1] == 1 or kind.startswith("bagel")
        pieces, _ = ndimage.label((blocked >= 0).any(axis=0), structure=CORNERS_TOO)
        assert astar((blocked == -1).all(axis=0), start, goal).cost == np.inf
        assert pieces[own].all()


@pytest.mark.parametrize(
    ("kind", "start", "goal", "message"),
    [
        ("thirds", (0, 0), (5, 7), "unknown blockage 'thirds': choose half, quarter, or bagel-K"),
        ("bagel-", (0, 0), (5, 7), "unknown blockage"),
        ("bagel-2", (0, 0), (5, 7), "K must be at least 3"),
        (
            "bagel-10",
            (2, 2),
            (3, 4),
            r"start \(2, 2\) lies inside the blocker around goal \(3, 4\)",
        ),
        ("quarter", (5, 7), (4, 6), "lies inside the blocker"),
        ("half", (3, 3), (4, 4), r"no line fits between start \(3, 3\) and goal \(4, 4\)"),
        ("half", (3, 3), (4, 8), r"goal \(4, 8\) lies outside the map of 6 x 8 cells"),
        ("half", (-1, 3), (4, 4), r"start \(-1, 3\) lies outside"),
    ],
)
def test_what_cannot_be_done_is_reported(kind, start, goal, message):
    with pytest.raises(ValueError, match=message):
        block(EMPTY, start, goal, kind)


def test_a_map_too_small_for_a_quarter_is_reported():
    with pytest.raises(ValueError, match="3 x 8 cells is too small: 4 x 4 is the least"):
        block(EMPTY[:3], (0, 0), (2, 7), "quarter")


@pytest.mark.parametrize("seed", range(20))
def test_start_and_goal_lie_apart_on_opposite_sides_of_one_region(seed):
    free = maps.noise(40, 60, density=0.3, seed=seed)
    start, goal = pick_start_goal(free, apart=30, seed=seed)
    assert max(abs(a - b) for a, b in zip(start, goal, strict=True)) >= 30
    pieces, _ = ndimage.label(free)
    largest = np.argmax(np.bincount(pieces[free]))
    assert pieces[start] == pieces[goal] == largest


def test_start_and_goal_of_a_small_pocket_are_not_taken():
    free, _ = drawn("""
        ..@....
        ..@....""")
    for seed in range(20):
        start, goal = pick_start_goal(free, apart=2, seed=seed)
        assert min(start[1], goal[1]) >= 3 and abs(start[1] - goal[1]) >= 2


@pytest.mark.parametrize("free", [np.ones((5, 9), bool), np.zeros((5, 9), bool)])
def test_a_region_too_narrow_is_reported(free):
    with pytest.raises(
        ValueError, match="no two cells lie 9 rows or columns apart: the largest free region spans"
    ):
        pick_start_goal(free, apart=9, seed=0)


@pytest.mark.parametrize("seed", range(6))
def test_a_city_is_a_third_blocked_and_its_streets_are_connected(seed):
    labels = maps.city_buildings(300, 420, seed=seed)
    free = maps.city(300, 420, seed=seed)
    assert ((labels < 0) == free).all()
    assert 0.25 < (~free).mean() < 0.42
    assert components.largest_region(free).sum() > 0.95 * free.sum()
    assert set(np.unique(labels)) == {-1, *range(labels.max() + 1)}
    assert all(
        ndimage.label(labels == i, structure=CORNERS_TOO)[1] == 1
        for i in range(0, labels.max() + 1, 5)
    )


@pytest.mark.parametrize("corridor", [1, 2, 5])
@pytest.mark.parametrize("size", [(1, 1), (12, 31), (40, 17)])
def test_a_maze_has_one_way_between_any_two_places(corridor, size):
    free = maps.maze(*size, corridor=corridor, seed=3)
    pitch = corridor + 1
    rows, cols = ((length + 1) // pitch for length in size)
    assert ndimage.label(free)[1] == min(1, rows * cols)
    num_openings = (free.sum() - rows * cols * corridor**2) / corridor
    assert num_openings == max(0, rows * cols - 1)  # a tree


def test_a_snake_is_one_corridor():
    free = maps.snake(9, 7)
    assert lines("\n".join("".join(".@"[not cell] for cell in row) for row in free)).split()[
        :4
    ] == [
        ".......",
        "@@@@@@.",
        ".......",
        ".@@@@@@",
    ]
    assert astar(free, (0, 0), (8, 6)).cost > 30


def test_rooms_have_doors_of_one_cell():
    free = maps.rooms(47, 47, side=15, seed=1)
    inner = free.copy()
    inner[15::16] = inner[:, 15::16] = False
    assert ndimage.label(inner)[1] == 9
    assert 6 <= (free & ~inner).sum() <= 12


def test_regions_are_those_of_scipy():
    rng = np.random.default_rng(4)
    for _ in range(200):
        mask = rng.random(rng.integers(1, 30, 2)) < rng.random()
        numbers, (pieces, count) = components.regions(mask), ndimage.label(mask)
        assert ((numbers >= 0) == mask).all()
        assert (
            len(set(zip(numbers[mask].tolist(), pieces[mask].tolist(), strict=True)))
            == count
            == len(set(numbers[mask].tolist()))
        )


def test_maps_are_settled_by_their_seed():
    for make in (
        maps.city_buildings,
        maps.maze,
        maps.rooms,
        lambda *size, seed: maps.noise(*size, density=0.3, seed=seed),
    ):
        assert (make(50, 70, seed=5) == make(50, 70, seed=5)).all()
        assert (make(50, 70, seed=5) != make(50, 70, seed=6)).any()


def test_the_five_are_the_papers():
    assert BLOCKAGES == ("half", "quarter", "bagel-100", "bagel-50", "bagel-10")
