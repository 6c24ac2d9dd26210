"""A robot of ROS on the command line: from a map in metres to what blocks, a picture and a path."""

import json

import numpy as np
import pytest
from scipy import ndimage

from srt_jax import Frame
from srt_jax.cli import run
from srt_jax.formats.notes import Notes
from srt_jax.formats.osm import read_osm
from srt_jax.formats.reading import Reading, read_source
from srt_jax.robots.ends import as_end, as_radius
from tests.helpers.office import CORNER, SIDE, write_office

pytest.importorskip("yaml")
pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")

SMALL = {"height": 112, "width": 120}
ENDS = ("--start", "-8.4m,-5.6m", "--goal", "-5.7m,-8m")
"""In the small office, whose upper left corner is (-10, -4)."""


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(capsys, *arguments):
    code = run([*arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_the_free_space_of_a_robot_is_a_distance_transform_s_cell_by_cell(here):
    free = write_office(here)
    assert free.shape == (384, 400)
    for labels in (None, "doors.png"):
        how = Reading(
            start=as_end("--start", "-8m,7m"),
            goal=as_end("--goal", "7.5m,-7m"),
            radius=as_radius("--radius", "0.22m"),
            labels=labels,
        )
        source = read_source("office.yaml", how, Notes())
        (named,) = source.tasks
        away = np.asarray(ndimage.distance_transform_edt(free, sampling=SIDE))
        assert np.array_equal((named.task.labels == -1).all(axis=0), away > 0.22 + 1e-9)
        assert len(named.task.labels) <= 2
        frame = Frame.over(CORNER, SIDE, height=384, width=400)
        assert source.frame == frame
        assert named.task.start.tolist() == frame.cell_of((-8, 7)).tolist()


def run_office(here, capsys, start, goal):
    """One command: what blocks, a picture, a path in metres."""
    code, out, _ = printed(
        capsys,
        *("solve", "office.yaml", "--radius", "0.22m", "--labels", "doors.png"),
        *("--start", start, "--goal", goal),
        *("--out", "answers", "--path", "route.json"),
    )
    words = " ".join(out.split())
    assert code == 0 and "Wrote route.json: the route." in out and "SOLVED" in out
    assert "(destroyable, " in words and " m long" in words and "degrees to the" in words
    assert (here / "answers" / "office.png").stat().st_size > 10_000
    (answer,) = json.loads((here / "answers" / "results.json").read_text())["tasks"]
    assert answer["destroyed"] and answer["cell_side"] == SIDE and answer["approach"] is None
    poses = json.loads((here / "route.json").read_text())["poses"]
    points = np.array([[pose["pose"]["position"][axis] for axis in "xy"] for pose in poses])
    for point, end in ((points[0], start), (points[-1], goal)):
        wanted = [float(part.removesuffix("m")) for part in end.split(",")]
        assert np.abs(point - wanted).max() <= SIDE / 2 + 1e-9
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    assert length == pytest.approx(answer["cost"] * SIDE, rel=1e-5)
    assert f"{length:.2f} m" in out
    return points


def test_one_command_gives_what_blocks_a_picture_and_a_path_in_metres(here, capsys):
    write_office(here, **SMALL)
    run_office(here, capsys, "-8.4m,-5.6m", "-5.7m,-8m")


@pytest.mark.slow
def test_a_whole_floor_of_384_by_400_cells(here, capsys):
    free = write_office(here)
    points = run_office(here, capsys, "-8m,7m", "7.5m,-7m")
    # the robot keeps clear of whatever stands: of all but the two doors
    frame = Frame.over(CORNER, SIDE, height=384, width=400)
    row, col = frame.cell_of(points).T
    doors = np.array(pytest.importorskip("PIL.Image").open("doors.png"))
    stands = ~free & (doors == 255).all(axis=2)
    away = np.asarray(ndimage.distance_transform_edt(~stands, sampling=SIDE))
    assert (away[row, col] > 0.22).all()


def test_a_turned_map_turns_its_metres(here, capsys):
    write_office(here, **SMALL, yaw=0.5)
    frame = Frame.over(CORNER, SIDE, **SMALL, yaw=0.5)
    x, y = frame.point_of((30, 40)).tolist()
    code, _, err = printed(
        capsys,
        *("convert", "office.yaml", "again.yaml", "--start", f"{x}m,{y}m", "--goal", "60,60"),
    )
    assert code == 0 and "turned by 0.5 radians" in err
    how = Reading(start=as_end("--start", f"{x}m,{y}m"), goal=(60, 60))
    for name in ("office.yaml", "again.yaml"):
        source = read_source(name, how, Notes())
        assert source.tasks[0].task.start.tolist() == [30, 40] and source.frame == frame


def test_without_a_route_the_way_as_near_as_one_gets_is_told_drawn_and_written(here, capsys):
    write_office(here, **SMALL)
    code, out, _ = printed(
        capsys,
        *("solve", "office.yaml", "--radius", "0.22m", "--labels", "doors.png", *ENDS),
        *("--destroyable", "none", "--path", "near.geojson", "--out", "answers"),
        *("--report", "page.html"),
    )
    assert code == 1 and "Wrote near.geojson: the way as near to the goal as one gets" in out
    assert "As near as one gets:" in out and " m short" in out
    (answer,) = json.loads((here / "answers" / "results.json").read_text())["tasks"]
    near = answer["approach"]
    assert near["cells"][-1] == answer["seed"] and near["gap"] > 0
    (line,) = json.loads((here / "near.geojson").read_text())["features"]
    assert line["properties"]["gap"] == pytest.approx(near["gap"] * SIDE, abs=1e-5)
    assert "as near as one gets" in (here / "page.html").read_text()


def test_a_start_in_which_the_robot_does_not_fit_begins_beside_it(here, capsys):
    write_office(here, **SMALL)
    code, out, err = printed(
        capsys,
        *("solve", "office.yaml", "--radius", "0.22m", "--start", "30,24", "--goal", "30,40"),
    )
    words = " ".join(out.split())
    assert code == 1 and "START_BLOCKED" in out
    assert "the start 30,24 lies within the radius of obstacle 0" in err
    assert (
        "From" not in out and "the free cell nearest the start, a path leads to the goal" in words
    )


def test_cells_of_a_picture_get_a_side_and_a_radius_in_cells_needs_none(here, capsys):
    write_office(here, **SMALL)
    (here / "office.pgm").rename(here / "plan.pgm")
    free = np.array(pytest.importorskip("PIL.Image").open("plan.pgm")) >= 128
    ends = ("--start", "30,40", "--goal", "80,86")
    away = np.asarray(ndimage.distance_transform_edt(free))
    for options, radius in (
        (("--radius", "3"), 3),
        (("--radius", "0.2m", "--cell-side", "0.1"), 2),
    ):
        code, _, _ = printed(capsys, "convert", "plan.pgm", "plan.npz", *ends, *options)
        assert code == 0
        (named,) = read_source("plan.npz", Reading(), Notes()).tasks
        assert np.array_equal((named.task.labels == -1).all(axis=0), away > radius)
    # a batch takes cells, too, and metres where the side of a cell is given
    metres = ("--radius", "0.1m", "--cell-side", "0.05")
    code, _, _ = printed(capsys, "convert", "plan.npz", "metres.npz", *metres)
    code, _, _ = printed(capsys, "convert", "plan.npz", "more.npz", "--radius", "2")
    assert (here / "metres.npz").read_bytes() == (here / "more.npz").read_bytes()
    (named,) = read_source("more.npz", Reading(), Notes()).tasks
    once = np.asarray(ndimage.distance_transform_edt(away > 2))
    assert code == 0 and np.array_equal((named.task.labels == -1).all(axis=0), once > 2)


def test_what_is_easily_overlooked_is_noted(here, capsys):
    """Metres written as cells, metres that a format loses, and walls that an answer destroys."""
    write_office(here, **SMALL)
    code, out, err = printed(
        capsys, "solve", "office.yaml", *ENDS, "--radius", "0.22", "--json", "--path", "a.json"
    )
    (answer,) = json.loads(out)["tasks"]
    told = [one["what"] for one in json.loads(out)["notes"]]
    hint = "--radius 0.22 cells reaches no further cell, so no obstacle grows: for metres write"
    assert code == 0 and any(f"{hint} 0.22m" in what for what in told)
    walls = [what for what in told if "perhaps its walls" in what]
    assert len(walls) == (0 in answer["destroyed"])  # obstacle 0 is what lies around the rooms
    code, _, err = printed(capsys, "convert", "office.yaml", "office.npz", *ENDS)
    assert code == 0 and "the side of a cell, 0.05 m, and the place of the map are not" in err
    code, out, err = printed(capsys, "solve", "office.npz", "--path", "b.json")
    assert code == 2 and out == "" and "a nav_msgs/Path is in metres" in err
    code, out, err = printed(
        capsys, "solve", "office.npz", "--path", "b.json", "--cell-side", "0.05"
    )
    place = [json.loads((here / f"{name}.json").read_text())["poses"][0] for name in "ab"]
    x, y = (place[0]["pose"]["position"][axis] - CORNER[i] for i, axis in enumerate("xy"))
    moved = place[1]["pose"]["position"]
    assert code == 0 and moved["x"] == pytest.approx(x) and moved["y"] == pytest.approx(y)


def test_degrees_on_a_city(here, tmp_path, capsys):
    pytest.importorskip("osmium")
    (tmp_path / "town.osm").write_text(
        '<osm version="0.6"><bounds minlat="60.16" minlon="24.93" maxlat="60.17" maxlon="24.95"/>'
        + "".join(
            f'<node id="{n}" lat="{lat}" lon="{lon}" version="1"/>'
            for n, (lat, lon) in enumerate(
                [(60.161, 24.94), (60.161, 24.942), (60.163, 24.942), (60.163, 24.94)], start=1
            )
        )
        + '<way id="9" version="1">'
        + "".join(f'<nd ref="{n}"/>' for n in (1, 2, 3, 4, 1))
        + '<tag k="building" v="yes"/></way></osm>'
    )
    place = read_osm("town.osm")
    assert place.projection is not None
    how = Reading(
        start=as_end("--start", "24.932E,60.162N"),
        goal=as_end("--goal", "60.168N,24.948E"),
        cell_side=2,
    )
    source = read_source("town.osm", how, Notes())
    assert source.frame is not None
    lon, lat = source.frame.place_of(source.tasks[0].task.start)
    assert (lon, lat) == pytest.approx((24.932, 60.162), abs=3e-5)
    # a place written as GeoJSON in metres still knows where it lies
    code, _, _ = printed(capsys, "convert", "town.osm", "town.geojson")
    again = read_source("town.geojson", how, Notes())
    assert code == 0 and again.tasks[0].task.start.tolist() == source.tasks[0].task.start.tolist()


BROKEN = {
    "a negative radius": (("--radius", "-0.2m"), "'-0.2m' is no radius"),
    "no number": (("--radius", "nan"), "'nan' is no radius"),
    "an unknown unit": (("--radius", "22cm"), "'22cm' is no radius"),
    "an unknown unit of a place": (("--start", "1ft,2ft", "--goal", "1,1"), "is no cell and no"),
    "a place outside": (("--start", "99m,0m", "--goal", "60,60"), "lies outside the map: x goes"),
    "a cell outside": (("--start", "999,0", "--goal", "60,60"), "lies outside the map"),
    "degrees without a projection": (
        ("--start", "24.9E,60.1N", "--goal", "60,60"),
        "does not say where it lies on the globe",
    ),
    "one end alone": (("--start", "-8m,-7m"), "one is missing"),
    "labels that are not there": (("--labels", "no.png"), "no.png"),
    "labels of another size": (("--labels", "small.png"), "a pixel for each cell"),
    "a path of another form": (("--path", "a.csv"), ".geojson, or as .json"),
    "a path in no folder": (("--path", "no/a.json"), "there is no folder"),
    "a radius that leaves nothing": (("--radius", "50"), "office.yaml"),
    "a start that is not free": (("--start", "0,0", "--goal", "60,60"), "is an unknown cell"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_input_is_one_line_and_exit_code_2(here, capsys, case):
    write_office(here, **SMALL)
    pytest.importorskip("PIL.Image").new("RGB", (3, 4), (255, 0, 0)).save("small.png")
    before = sorted(path.name for path in here.iterdir())
    options, sentence = BROKEN[case]
    code, out, err = printed(capsys, "solve", "office.yaml", *options)
    lines = [line for line in err.splitlines() if ": note: " not in line]
    assert code == 2 and out == "" and len(lines) == 1 and sentence in lines[0], err
    assert sorted(path.name for path in here.iterdir()) == before


def test_what_does_not_go_together_is_refused(here, capsys):
    write_office(here, **SMALL)
    (here / "m.map").write_text("type octile\nheight 2\nwidth 3\nmap\n...\n...\n")
    world = {
        "format": "srt-jax world",
        "version": 1,
        "bounds": [0, 0, 10, 10],
        "agent": {"position": [1.5, 1.5], "radius": 0.4},
        "goal": {"centre": [8.5, 8.5], "side": 1.0},
        "obstacles": [],
    }
    (here / "w.json").write_text(json.dumps(world))
    cells = ("--start", "0,0", "--goal", "1,2")
    for arguments, sentence in (
        (("m.map", "--start", "0m,0m", "--goal", "1m,1m"), "by --cell-side"),
        (("m.map", *cells, "--radius", "1m"), "give it in cells, such as --radius 3"),
        (("w.json", "--radius", "1"), "the robot of this file has a radius of 0.4 m"),
        (("w.json", "--labels", "doors.png"), "--labels names the obstacles of a map of cells"),
        (("m.map", "m.map", *cells, "--path", "a.json"), "holds the route of one task, and there"),
        (("m.map", *cells, "--cell-side", "nan"), "m.map"),
        (("m.map", *cells, "--cell-side", "-1"), "m.map"),
    ):
        code, out, err = printed(capsys, "solve", *arguments)
        assert code == 2 and out == "" and sentence in err, (arguments, err)
