"""Files by their endings: what each holds as tasks, what is chosen where nobody says, what is
written in another format.
"""

import dataclasses
import json
import re

import numpy as np
import pytest

from srt_jax.formats.batch import read_batch
from srt_jax.formats.geojson import read_geojson, write_geojson
from srt_jax.formats.movingai import read_map, write_map
from srt_jax.formats.notes import Note, Notes
from srt_jax.formats.pictures import write_image
from srt_jax.formats.reading import ENDINGS, Reading, read_source
from srt_jax.formats.ros_map import read_ros_map, write_ros_map
from srt_jax.formats.shared.opposite_cells import opposite_cells
from srt_jax.formats.task_files import read_tasks
from srt_jax.formats.world_json import read_world
from srt_jax.formats.writing import write_source
from srt_jax.formats.xml_map import read_xml_map, write_xml_map
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle
from srt_jax.types import FREE
from tests.helpers.pictures import drawn

MAP, PLACES = drawn("""
    ......@.
    .@@@..@.
    S@....@G
    .@..@.@.
    ...@..@.
""")
HOUSE = Obstacle.polygon([(20, 20), (50, 20), (50, 60), (20, 60)], destroyable=False)
FENCE = Obstacle.polygon([(70, 0), (71, 0), (71, 100), (70, 100)], removal_cost=2)
OUTSIDE = Obstacle.polygon([(900, 0), (910, 0), (910, 10)])
TOWN = Place((0, 0, 120, 100), (HOUSE, FENCE, OUTSIDE))


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_map("m.map", MAP)
    write_image("m.png", MAP)
    grid_map = read_source("m.map", Reading(chooses=True), Notes()).map
    assert grid_map is not None
    grid_map = dataclasses.replace(grid_map, start=PLACES["S"], goal=PLACES["G"])
    write_xml_map("m.xml", grid_map)
    write_ros_map("m.yaml", grid_map)
    write_geojson("town.geojson", TOWN)
    return tmp_path


def test_start_and_goal_are_at_the_two_ends_of_the_largest_region():
    free, places = drawn("""
        @@@@@@@@@
        @.@@..@@@
        S..@.@..@
        @.......G
        @@.@@@.@@
    """)
    assert opposite_cells(free) == (places["S"], places["G"])
    assert opposite_cells(free.T) == (places["S"][::-1], places["G"][::-1])
    assert opposite_cells(np.eye(3, dtype=bool)) == ((0, 0), (0, 0))
    assert opposite_cells(np.ones((4, 4), bool)) == ((1, 0), (1, 3))
    with pytest.raises(ValueError, match="no cell is free"):
        opposite_cells(np.zeros((2, 2), bool))


@pytest.mark.parametrize("name", ["m.map", "m.png", "m.xml", "m.yaml"])
def test_every_map_of_cells_gives_the_same_task(here, name):
    ends = {} if name == "m.xml" else {"start": PLACES["S"], "goal": PLACES["G"]}
    ((stem, task),) = read_tasks(name, **ends)
    assert stem == "m" and task.start.tolist() == [2, 0] and task.goal.tolist() == [2, 7]
    np.testing.assert_array_equal(task.labels[0] == FREE, MAP)
    assert task.destroyable.all() and len(task.destroyable) == 3


def test_a_place_is_laid_on_cells_and_its_ends_are_chosen_and_noted(here):
    notes = Notes()
    (named,) = read_tasks("town.geojson", reading=Reading(size=10), notes=notes)
    assert named.name == "town" and named.task.labels.shape == (1, 10, 10)
    assert named.task.destroyable.tolist() == [
        False,
        True,
        True,
    ] and named.task.removal_cost.tolist() == [1, 2, 1]
    noted = " | ".join(map(str, notes))
    assert (
        "10 x 10 cells of 10.000 m" in noted
        and "start 0,2 and goal 9,2 chosen" in noted
        and "wholly outside" in noted
    )
    (named,) = read_tasks(
        "town.geojson", reading=Reading(cell_side=10, start=(0, 0), goal=(9, 11), rule="centre")
    )
    assert named.task.labels.shape == (1, 10, 12) and named.task.goal.tolist() == [9, 11]
    assert 1 not in named.task.labels  # a fence that meets no centre
    ((_, task),) = read_tasks("town.geojson")
    assert task.labels.shape == (1, 500, 500)


def test_a_blocker_gets_an_id_of_its_own(here):
    reading = Reading(size=20, block="half", start=(0, 0), goal=(19, 5))
    ((_, task),) = read_tasks("town.geojson", reading=reading, destroyable="none")
    assert (
        task.destroyable.tolist() == [False, False, False, True]
        and (task.labels == 3).any()
        and 2 not in task.labels
    )
    with pytest.raises(ValueError, match="--block unknown blockage 'wall'"):
        read_tasks("town.geojson", reading=dataclasses.replace(reading, block="wall"))


def test_geojson_may_end_in_json(here):
    (here / "town.json").write_text((here / "town.geojson").read_text())
    assert read_source("town.json", Reading(size=10), Notes()).place == TOWN


BAD = {
    "an ending nobody knows": ("m.txt", {}, "'.txt': use one of .map"),
    "both sizes": ("town.geojson", {"size": 3, "cell_side": 2.0}, "give one of them"),
    "half of the ends": ("town.geojson", {"start": (0, 0)}, "one is missing"),
    "ends for a file with ends": ("m.xml", {"start": (0, 0), "goal": (1, 0)}, "has its own"),
    "a start in a house": (
        "town.geojson",
        {"size": 10, "start": (6, 2), "goal": (0, 0)},
        "covered by obstacle 0",
    ),
    "a start on a wall": ("m.png", {"start": (0, 6), "goal": (0, 0)}, "is on a wall"),
    "a start outside": ("m.yaml", {"start": (0, 16), "goal": (0, 0)}, "outside the map"),
    "an unknown rule": ("town.geojson", {"rule": "corner"}, "rule 'corner' is unknown"),
    "unknown units": ("town.geojson", {"units": "feet"}, "units 'feet' are unknown"),
    "unknown pixels": ("m.png", {"free_pixels": "blue"}, "not 'blue'"),
    "an unknown way out": ("m.yaml", {"unknown": "maybe"}, "not as 'maybe'"),
    "a cell larger than the place": (
        "town.geojson",
        {"cell_side": 500.0},
        "no cell with side 500 m fits",
    ),
    "rules that are missing": ("town.geojson", {"tags": "none.json"}, "none.json: no such file"),
    "more cells than there is room for": ("town.geojson", {"size": 10**6}, "too large"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_read_so_is_refused(here, case):
    name, options, message = BAD[case]
    (here / "m.txt").write_text("a file of another kind")
    with pytest.raises(ValueError, match=message):
        read_tasks(name, reading=Reading(**options))


def test_a_map_too_far_out_is_refused_by_name(here):
    text = (here / "m.yaml").read_text()
    (here / "m.yaml").write_text(text.replace("origin: [0.0,", "origin: [1.0e+20,"))
    with pytest.raises(ValueError, match=r"m\.yaml: origin holds 1e\+20"):
        read_tasks("m.yaml", start=PLACES["S"], goal=PLACES["G"])


def test_a_map_without_a_free_cell_has_no_ends(here):
    write_image("black.png", np.zeros((3, 3), bool))
    with pytest.raises(ValueError, match=r"black\.png: no cell is free"):
        read_tasks("black.png")


# --- written again in another format


def converted(name, target, **options):
    notes = Notes()
    write_source(target, read_source(name, Reading(chooses=True, **options), Notes()), notes)
    return [str(note) for note in notes]


@pytest.mark.parametrize("name", ["m.map", "m.png", "m.xml", "m.yaml"])
def test_cells_stay_the_same_in_every_format_of_cells(here, name):
    for target in ("t.map", "t.png", "t.xml", "t.yaml", "t.npz"):
        converted(name, target)
    np.testing.assert_array_equal(read_map("t.map"), MAP)
    np.testing.assert_array_equal(read_xml_map("t.xml").free, MAP)
    np.testing.assert_array_equal(read_ros_map("t.yaml").free, MAP)
    np.testing.assert_array_equal(
        read_source("t.png", Reading(), Notes()).tasks[0].task.labels[0] == FREE, MAP
    )
    np.testing.assert_array_equal(read_batch("t.npz").tasks.labels[0, 0] == FREE, MAP)


def test_a_place_becomes_a_world_with_the_same_cells(here):
    notes = converted("town.geojson", "town.json", size=10, start=(0, 0), goal=(9, 5))
    assert "radius is set to 4.5 m" in " ".join(notes)
    world = read_world("town.json")
    assert (
        world.obstacles == TOWN.obstacles
        and world.bounds == (10, 0, 110, 100)
        and world.position == (15, 95)
    )
    ((_, again),) = read_tasks("town.json")
    ((_, task),) = read_tasks("town.geojson", reading=Reading(size=10, start=(0, 0), goal=(9, 5)))
    np.testing.assert_array_equal(again.labels, task.labels)
    assert (
        again.goal.tolist() == task.goal.tolist()
        and again.destroyable.tolist() == task.destroyable.tolist()
    )
    converted("town.json", "back.geojson")
    assert read_geojson("back.geojson").obstacles == TOWN.obstacles
    converted("town.json", "same.json")
    assert read_world("same.json") == world


def test_metres_survive_in_formats_that_have_them(here):
    notes = converted("town.geojson", "town.yaml", size=10)
    assert any("which obstacle covers them" in line for line in notes)
    read = read_ros_map("town.yaml")
    assert (read.cell_side, read.corner) == (10, (10, 0))
    converted("town.geojson", "town.xml", size=10)
    assert read_xml_map("town.xml").cell_side == 10


def test_what_a_format_cannot_hold_is_refused(here):
    converted("m.map", "two.npz")
    batch = read_batch("two.npz")
    np.testing.assert_array_equal(batch.tasks.start, [[2, 0]])
    for name, target, message in (
        ("m.map", "t.geojson", "only cells"),
        ("m.map", "t.docx", "cannot write the ending '.docx'"),
        ("m.map", "nowhere/t.map", "cannot be written"),
    ):
        with pytest.raises(ValueError, match=message):
            converted(name, target)
    assert not list(here.glob("t.*"))


def test_every_ending_is_in_the_documentation():
    import pathlib

    text = (pathlib.Path(__file__).parents[2] / "docs" / "formats.md").read_text()
    assert [ending for ending in ENDINGS if f"`{ending}`" not in text] == []


def test_notes_count_and_keep_the_first_example():
    notes = Notes()
    notes.add("rings closed", example="way 1")
    notes.add("rings closed", 2, example="way 2")
    notes.add("nothing", 0)
    notes.tell("a fact")
    notes.tell("a fact")
    assert list(notes) == [Note("rings closed", 3, "way 1"), Note("a fact")] and len(notes) == 2
    assert [str(note) for note in notes] == ["rings closed: 3, such as way 1", "a fact"]
    assert notes.records("f")[0] == {
        "file": "f",
        "what": "rings closed",
        "count": 3,
        "example": "way 1",
    }
    assert json.loads(json.dumps(notes.records("f")))[1]["count"] == 0


@pytest.mark.parametrize("cost", [1e39, 1e-60])
def test_a_cost_that_float32_cannot_hold_is_refused_with_its_file_and_number(here, cost):
    write_geojson(
        "dear.geojson", Place(TOWN.bounds, (dataclasses.replace(FENCE, removal_cost=cost),))
    )
    world = {
        "format": "srt-jax world",
        "version": 1,
        "bounds": [0, 0, 10, 10],
        "agent": {"position": [1, 5], "radius": 0.4},
        "goal": {"centre": [8.5, 5.5], "side": 1},
        "obstacles": [{"polygon": [[[4, 0], [5, 0], [5, 10]]], "removal_cost": cost}],
    }
    (here / "dear.json").write_text(json.dumps(world))
    for name in ("dear.geojson", "dear.json"):
        with pytest.raises(
            ValueError, match=re.escape(f"{name}: removal_cost of obstacle 0 is {cost}, ")
        ):
            read_tasks(name)


def test_a_grid_or_an_end_that_does_not_fit_is_refused_with_its_file(here):
    with pytest.raises(ValueError, match=r"^town\.geojson: a grid of .* is too large"):
        read_tasks("town.geojson", reading=Reading(size=10**9))
    with pytest.raises(ValueError, match=r"^town\.geojson: no cell with side 500 m fits"):
        read_tasks("town.geojson", reading=Reading(cell_side=500))
    with pytest.raises(ValueError, match=r"^town\.geojson: goal \(5, 900\) lies outside the map"):
        read_tasks("town.geojson", reading=Reading(start=(0, 0), goal=(5, 900), cell_side=1))
