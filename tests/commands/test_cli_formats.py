"""`srt-jax solve` and `srt-jax convert` on files of the outside world: the notes, and bad input
in one line.
"""

import gzip
import json
import pathlib

import numpy as np
import pytest

from srt_jax.answers.results_file import read_results
from srt_jax.cli import run
from srt_jax.formats.geojson import write_geojson
from srt_jax.formats.gridmap import GridMap
from srt_jax.formats.ros_map import write_ros_map
from srt_jax.formats.xml_map import write_xml_map
from srt_jax.geometry.place import Place
from srt_jax.geometry.world import Obstacle

pytest.importorskip("yaml")
pytest.importorskip("PIL.Image")

WALL = Obstacle.polygon([(400, 0), (420, 0), (420, 1000), (400, 1000)], name="wall", removal_cost=2)
HOUSE = Obstacle.polygon([(600, 200), (800, 200), (800, 500), (600, 500)], destroyable=False)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    free = np.ones((6, 9), bool)
    free[:, 4] = False
    unknown = np.zeros_like(free)
    unknown[5, 4] = True
    write_ros_map("m.yaml", GridMap(free, unknown, 0.5))
    write_xml_map("m.xml", GridMap(free, np.zeros_like(free), start=(0, 0), goal=(5, 8)))
    write_geojson("town.geojson", Place((0, 0, 1000, 1000), (WALL, HOUSE)))
    return tmp_path


def printed(capsys, *arguments):
    code = run([*arguments])
    out, err = capsys.readouterr()
    return code, out, err


def test_notes_go_to_standard_error_or_into_the_json(here, capsys):
    code, out, err = printed(
        capsys, "solve", "m.yaml", "--start", "0,0", "--goal", "5,8", "--unknown", "free"
    )
    assert code == 0 and "PATH_EXISTS" in out
    assert err == "srt-jax: note: m.yaml: unknown cells, taken as free: 1\n"
    code, out, err = printed(capsys, "solve", "m.yaml", "--json")
    answer = json.loads(out)
    assert (code, err, answer["tasks"][0]["status"]) == (0, "", "PATH_EXISTS")
    assert answer["notes"][0] == {
        "file": "m.yaml",
        "what": "unknown cells, taken as blocked",
        "count": 1,
        "example": "",
    }
    assert "chosen" in answer["notes"][1]["what"]


def test_a_town_is_solved_with_its_ends_and_cells_as_asked(here, capsys):
    code, out, _ = printed(
        capsys,
        "solve",
        "town.geojson",
        "--size",
        "20",
        "--start",
        "0,0",
        "--goal",
        "19,19",
        "--json",
    )
    (task,) = json.loads(out)["tasks"]
    assert (code, task["status"], task["destroyed"], task["removal_cost"]) == (0, "SOLVED", [0], 2)


@pytest.mark.parametrize("name", ["m.xml", "town.geojson"])
def test_answers_are_kept_where_asked(here, capsys, name):
    code, _, err = printed(capsys, "solve", name, "--size", "20", "--results", "answers.json")
    assert code == 0 and ("and goal" in err) == (name == "town.geojson")
    assert [record["name"] for record in read_results("answers.json")] == [pathlib.Path(name).stem]


def test_converting_says_what_is_left_out(here, capsys):
    code, out, err = printed(capsys, "convert", "m.yaml", "own.map")
    assert (code, out) == (
        0,
        "Wrote own.map: 1 task from m.yaml.\n",
    ) and "start and goal are not written" in err
    code, out, err = printed(
        capsys, "convert", "town.geojson", "town.npz", "--size", "20", "--block", "half", "--json"
    )
    assert (code, err) == (0, "") and json.loads(out)["tasks"] == 1
    assert (
        printed(
            capsys,
            "convert",
            "town.geojson",
            "fixed.json",
            "--size",
            "20",
            "--destroyable",
            "none",
        )[0]
        == 0
    )
    assert [
        item["destroyable"]
        for item in json.loads(pathlib.Path("fixed.json").read_text())["obstacles"]
    ] == [False, False]
    code, _, err = printed(capsys, "convert", "town.geojson", "x.geojson", "--block", "half")
    assert code == 2 and "only cells" in err


BAD = {
    "city.osm.gz": (gzip.compress(b"<osm version='0.6'></osm>" * 99)[:40], "cut off"),
    "city.osm.pbf": (b"no extract", "no whole OpenStreetMap extract"),
    "city.osm": (b"<osm version='0.6'></osm>", "nothing in it is an obstacle"),
    "map.yaml": (b"image: m.pgm\nresolutoin: 1\n", "resolutoin is not known"),
    "map.png": (b"\x89PNG\r\n\x1a\n", "no whole picture"),
    "map.xml": (b"<root><map><width>2</width><height>2</height></map></root>", "no <grid>"),
    "scene.svg": (b"<svg viewBox='0 0 1 1'/>", "no NAMO scene"),
    "town.geojson": (b'{"type": "Polygon", "coordinates": [[[NaN, 0]]]}', "NaN is no coordinate"),
}


@pytest.mark.parametrize("name", BAD)
@pytest.mark.parametrize("command", ["solve", "convert"])
def test_bad_files_are_one_line_with_exit_code_two(here, capsys, command, name):
    content, message = BAD[name]
    if "osm" in name:
        pytest.importorskip("osmium")
    (here / name).write_bytes(content)
    code, out, err = printed(capsys, command, name, *(["out.npz"] if command == "convert" else []))
    assert (
        (code, out) == (2, "")
        and err.count("\n") == 1
        and message in err
        and err.startswith(f"srt-jax: error: {name}")
    )
    assert not (here / "out.npz").exists()


@pytest.mark.parametrize(
    ("name", "message"), [("x.csv", "'.csv'"), ("nowhere/x.json", "no folder nowhere")]
)
def test_answers_that_could_not_be_kept_are_refused_before_solving(here, capsys, name, message):
    code, out, err = printed(capsys, "solve", "nofile.map", "--results", name)
    assert (code, out) == (2, "") and message in err


def test_help_of_convert_has_an_example(capsys):
    code, out, _ = printed(capsys, "convert", "--help")
    assert code == 0 and "Example" in out and "--size" in out


def test_a_folder_is_told_apart_from_a_format_that_is_not_known(here, capsys):
    assert run(["solve", str(here)]) == 2
    assert "is a folder: name the files in it" in capsys.readouterr().err
