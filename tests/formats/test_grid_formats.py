"""ROS maps, pictures and the authors' XML maps: polarity and axes in one place, read back equal,
broken files refused.
"""

import json
import sys

import numpy as np
import pytest

from srt_jax.formats.gridmap import GridMap, free_map
from srt_jax.formats.movingai import read_map, write_map
from srt_jax.formats.notes import Notes
from srt_jax.formats.pictures import read_image, write_image
from srt_jax.formats.ros_map import read_ros_map, write_ros_map
from srt_jax.formats.xml_map import read_xml_map, write_xml_map
from tests.helpers.odd import refusals
from tests.helpers.pictures import drawn

Image = pytest.importorskip("PIL.Image")
pytest.importorskip("yaml")

YAML = """image: m.pgm
resolution: 0.05
origin: [-1.5, 2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
SHADES = [[254, 0, 205], [254, 254, 100]]
XML = """<?xml version="1.0" encoding="UTF-8" ?>
<root>
    <map>
        <width>4</width><height>3</height><cellsize>2.5</cellsize>
        <startx>0</startx><starty>2</starty><finishx>3</finishx><finishy>0</finishy>
        <grid>
            <row>0 0 1 0</row>
            <row>0 0 1 0 </row>
            <row>0 0 0 0</row>
        </grid>
    </map>
    <algorithm><searchtype>astar</searchtype><allowdiagonal>true</allowdiagonal><cutcorners>false</cutcorners></algorithm>
</root>
"""


def pgm(shades, depth=255):
    shades = np.array(shades, np.uint8 if depth == 255 else ">u2")
    return (
        f"P5\n# made by hand\n{shades.shape[1]} {shades.shape[0]}\n{depth}\n".encode()
        + shades.tobytes()
    )


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.pgm").write_bytes(pgm(SHADES))
    (tmp_path / "m.yaml").write_text(YAML)
    return tmp_path


def assert_equal(one: GridMap, other: GridMap):
    np.testing.assert_array_equal(one.free, other.free)
    np.testing.assert_array_equal(one.unknown, other.unknown)
    fields = [(m.cell_side, m.corner, m.start, m.goal) for m in (one, other)]
    assert fields[0] == fields[1]


def random_map(seed: int, *, with_unknown: bool) -> GridMap:
    rng = np.random.default_rng(seed)
    height, width = rng.integers(1, 20, 2)
    unknown = (rng.random((height, width)) < 0.3) & with_unknown
    free = (rng.random((height, width)) < 0.5) & ~unknown
    ends = [tuple(int(rng.integers(side)) for side in free.shape) for _ in range(2)]
    return GridMap(
        free,
        unknown,
        float(rng.choice([0.05, 1.0, 2.5])),
        (float(rng.normal()), -3.0),
        ends[0],
        ends[1],
    )


# --- ROS


def test_a_ros_map_has_its_first_row_on_top_and_its_corner_below(here):
    notes = Notes()
    read = read_ros_map("m.yaml", notes=notes)
    assert read.free.tolist() == [[True, False, False], [True, True, False]]
    assert read.unknown.tolist() == [[False, False, True], [False, False, True]]
    assert (read.cell_side, read.corner) == (0.05, (-1.5, 2.0))
    assert read.grid.origin == (-1.5, 2.1) and notes.count("unknown cells, taken as blocked") == 2
    assert read_ros_map("m.yaml", unknown_as="free").free.tolist() == [
        [True, False, True],
        [True, True, True],
    ]


@pytest.mark.parametrize("unknown_as", ["blocked", "free"])
def test_a_ros_map_is_read_back_equal(here, unknown_as):
    for seed in range(10):
        made = random_map(seed, with_unknown=True)
        made = GridMap(
            made.free | (made.unknown & (unknown_as == "free")),
            made.unknown,
            made.cell_side,
            made.corner,
        )
        write_ros_map("own.yaml", made)
        assert_equal(read_ros_map("own.yaml", unknown_as=unknown_as), made)


def test_it_writes_what_map_server_itself_writes(here):
    """Its saver writes a P5 with one comment, the shades 254, 0 and 205, and these members
    (map_server's documentation).
    """
    write_ros_map(
        "own.yaml",
        GridMap(
            np.array([[True, False, False]]), np.array([[False, False, True]]), 0.05, (-10.0, -10.0)
        ),
    )
    head, shades = (here / "own.pgm").read_bytes().split(b"\n255\n")
    assert (
        head.startswith(b"P5\n# CREATOR: ")
        and head.endswith(b" 0.050 m/pix\n3 1")
        and shades == bytes([254, 0, 205])
    )
    expected = [
        "image: own.pgm",
        "resolution: 0.05",
        "origin: [-10.0, -10.0, 0.0]",
        "negate: 0",
        "occupied_thresh: 0.65",
    ]
    assert (here / "own.yaml").read_text().splitlines() == [*expected, "free_thresh: 0.196"]


def test_the_modes_and_the_sign_of_a_ros_map(here):
    (here / "m.yaml").write_text(YAML.replace("negate: 0", "negate: 1"))
    assert read_ros_map("m.yaml").free.tolist() == [[False, True, False], [False, False, False]]
    (here / "m.yaml").write_text(YAML + "mode: scale\n")
    assert read_ros_map("m.yaml").unknown.sum() == 2
    (here / "m.yaml").write_text(YAML + "mode: raw\n")
    (here / "m.pgm").write_bytes(pgm([[0, 100, 50], [19, 66, 255]]))
    raw = read_ros_map("m.yaml")
    assert raw.free.tolist() == [[True, False, False], [True, False, False]]
    assert raw.unknown.tolist() == [[False, False, True], [False, False, True]]


def test_what_is_not_opaque_is_unknown_to_ros_and_colours_are_averaged(here):
    pixels = np.array(
        [[[255, 255, 255, 255], [255, 255, 255, 0], [0, 0, 0, 255], [255, 255, 0, 255]]], np.uint8
    )
    Image.fromarray(pixels).save("m.png")
    (here / "m.yaml").write_text(YAML.replace("m.pgm", "m.png"))
    read = read_ros_map("m.yaml")
    assert read.free.tolist() == [[True, False, False, False]] and read.unknown.tolist() == [
        [False, True, False, True]
    ]


def test_turns_and_members_that_are_not_known_are_noted(here):
    (here / "m.yaml").write_text(YAML.replace("0.0]", "0.7]") + "colour: blue\n")
    notes = Notes()
    read_ros_map("m.yaml", notes=notes)
    noted = " | ".join(map(str, notes))
    assert (
        "turned by 0.7 radians about its lower left corner" in noted and "such as colour" in noted
    )


BAD_ROS = {
    "a member with a slip": (
        YAML.replace("resolution", "resolutoin"),
        "lacks 'resolution'.*resolutoin is not known",
    ),
    "no YAML": ("image: [", "no YAML"),
    "a list": ("- 1\n", "no ROS map"),
    "a text for a number": (
        YAML.replace("0.05", "fine"),
        "resolution must be a finite number, got 'fine'",
    ),
    "a negative cell": (YAML.replace("0.05", "-1"), "must be positive"),
    "thresholds that cross": (
        YAML.replace("0.65", "0.1"),
        "0 <= free_thresh <= occupied_thresh <= 1",
    ),
    "a short origin": (YAML.replace(", 0.0]", "]"), "origin must be"),
    "NaN": (YAML.replace("0.05", ".nan"), "finite number"),
    "a mode that is none": (YAML + "mode: best\n", "trinary, scale, raw"),
    "a picture that is missing": (YAML.replace("m.pgm", "n.pgm"), "n.pgm: no such file"),
    "objects in it": ("image: !!python/object:os.system x\n", "no YAML"),
    "negate in words": (YAML.replace("negate: 0", "negate: maybe"), "negate must be 0 or 1"),
}


@pytest.mark.parametrize("case", BAD_ROS)
def test_bad_ros_maps_are_refused_in_one_line(here, case):
    text, message = BAD_ROS[case]
    (here / "m.yaml").write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        read_ros_map("m.yaml")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("size", [b"3 3", b"300000 300000", b"3 x", b"0 0", b"-3 2"])
def test_a_picture_of_the_wrong_size_is_refused(here, size):
    (here / "m.pgm").write_bytes(pgm(SHADES).replace(b"3 2", size))
    with pytest.raises(ValueError, match=r"m\.pgm: no whole picture"):
        read_ros_map("m.yaml")


def test_damaged_ros_maps_are_refused_in_one_line(here):
    assert refusals(read_ros_map, here / "m.yaml", YAML.encode(), count=100) > 30


# --- plain pictures


def test_pictures_have_either_polarity_and_any_depth(here):
    free, _ = drawn("""
        ..@
        .@@
    """)
    for ending in ("png", "pgm", "bmp", "tif"):
        write_image(f"m.{ending}", free)
        np.testing.assert_array_equal(read_image(f"m.{ending}").free, free)
        np.testing.assert_array_equal(read_image(f"m.{ending}", free="dark").free, ~free)
    Image.fromarray(np.where(free, 65535, 0).astype(np.uint16)).save("deep.png")
    Image.fromarray(free).save("flat.png")
    Image.fromarray(np.where(free[..., None], 255, 0).astype(np.uint8).repeat(3, axis=2)).save(
        "colour.png"
    )
    Image.fromarray(np.where(free, 255, 0).astype(np.uint8)).convert("P").save("palette.gif")
    for name in ("deep.png", "flat.png", "colour.png", "palette.gif"):
        np.testing.assert_array_equal(read_image(name).free, free, err_msg=name)


def test_the_threshold_parts_the_shades_and_what_lies_between_is_counted(here):
    (here / "m.pgm").write_bytes(pgm([[0, 99, 100, 101, 255]]))
    notes = Notes()
    assert read_image("m.pgm", threshold=100, notes=notes).free.tolist() == [
        [False, False, True, True, True]
    ]
    assert notes.count("pixels in between, parted at 100") == 3
    Image.fromarray(np.array([[[0, 0, 0, 255], [0, 0, 0, 0]]], np.uint8)).save("clear.png")
    notes = Notes()
    assert read_image("clear.png", notes=notes).free.tolist() == [[False, True]]
    assert notes.count("pixels that are not opaque, seen on white") == 1


def test_bad_pictures_are_refused_in_one_line(here):
    write_image("m.png", np.ones((9, 9), bool))
    assert refusals(read_image, here / "m.png", (here / "m.png").read_bytes(), count=60) > 30
    assert refusals(read_image, here / "m.pgm", pgm(SHADES), count=60) > 10
    for options, message in (
        ({"threshold": 0}, "threshold"),
        ({"threshold": 256}, "threshold"),
        ({"free": "grey"}, "light or the dark"),
    ):
        with pytest.raises(ValueError, match=message):
            read_image("m.png", **options)
    with pytest.raises(ValueError, match="without losses"):
        write_image("m.jpg", np.ones((2, 2), bool))


# --- XML


def test_an_xml_map_has_x_as_column_and_0_as_free(here):
    (here / "m.xml").write_text(XML)
    notes = Notes()
    read = read_xml_map("m.xml", notes=notes)
    expected, places = drawn("""
        ..@G
        ..@.
        S...
    """)
    np.testing.assert_array_equal(read.free, expected)
    assert (read.start, read.goal, read.cell_side, len(notes)) == (places["S"], places["G"], 2.5, 0)


def test_an_xml_map_is_read_back_equal(here):
    for seed in range(10):
        made = random_map(seed, with_unknown=False)
        made = GridMap(made.free, made.unknown, made.cell_side, start=made.start, goal=made.goal)
        write_xml_map("own.xml", made)
        notes = Notes()
        assert_equal(read_xml_map("own.xml", notes=notes), made)
        assert len(notes) == 0


def test_other_moves_and_other_figures_are_noted(here):
    (here / "m.xml").write_text(
        XML.replace("<cutcorners>false", "<cutcorners>true").replace(
            "<row>0 0 1 0<", "<row>0 0 5 0<"
        )
    )
    notes = Notes()
    assert not read_xml_map("m.xml", notes=notes).free[0, 2]
    noted = " | ".join(map(str, notes))
    assert "cutcorners = true" in noted and "neither 0 nor 1, blocked: 1" in noted


def test_an_xml_map_may_lack_its_ends_but_is_not_written_so(here):
    ends = XML[XML.index("<startx>") : XML.index("<grid>")]
    (here / "m.xml").write_text(XML.replace(ends, "").replace("<cellsize>2.5</cellsize>", ""))
    read = read_xml_map("m.xml")
    assert (read.start, read.goal, read.cell_side) == (None, None, 1.0)
    with pytest.raises(ValueError, match="a start and a goal"):
        write_xml_map("own.xml", read)


BAD_XML = {
    "no grid": (XML.replace("grid>", "grits>"), "has no <grid>"),
    "no map": ("<root/>", "no map in it"),
    "no XML": ("0 0 1", ":1: no whole XML"),
    "a row cut short": (
        XML.replace("<row>0 0 0 0</row>", "<row>0 0 0</row>"),
        "4 columns, row 2 .* has 3",
    ),
    "a row too few": (XML.replace("<row>0 0 0 0</row>", ""), "3 rows, its grid has 2"),
    "a width in words": (XML.replace("<width>4", "<width>four"), "<width> must be a whole number"),
    "a start outside": (XML.replace("<startx>0", "<startx>9"), r"start \(9, 2\) lies outside"),
    "half a start": (XML.replace("<startx>0</startx>", ""), "one is missing"),
    "a cell of no size": (XML.replace("2.5", "0"), "positive number"),
    "entities": (XML.replace("<root>", '<!DOCTYPE r [<!ENTITY a "b">]><root>'), "entities"),
}


@pytest.mark.parametrize("case", BAD_XML)
def test_bad_xml_maps_are_refused_in_one_line(here, case):
    text, message = BAD_XML[case]
    (here / "m.xml").write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        read_xml_map("m.xml")
    assert "\n" not in str(caught.value)


def test_damaged_xml_maps_are_refused_in_one_line(here):
    assert refusals(read_xml_map, here / "m.xml", XML.encode(), count=100) > 50


# --- all of them


def test_signs_of_a_benchmark_map_that_others_read_otherwise_are_noted(here):
    (here / "m.map").write_text("type octile\nheight 1\nwidth 4\nmap\n.SW@\n")
    notes = Notes()
    assert read_map("m.map", notes=notes).tolist() == [[True, True, False, False]]
    assert [str(note) for note in notes] == [
        "swamp cells, taken as free: 1",
        "water cells, taken as blocked: 1",
    ]


def test_free_is_a_mask_of_bools():
    assert free_map(np.ones((2, 3), bool)).unknown.sum() == 0
    with pytest.raises(TypeError, match="astype"):
        free_map(np.ones((2, 3)))
    with pytest.raises(ValueError, match="no empty side"):
        free_map(np.ones((0, 3), bool))


@pytest.mark.parametrize(("module", "package"), [("PIL.Image", "pillow"), ("yaml", "pyyaml")])
def test_a_library_that_is_absent_is_named_with_its_command(here, monkeypatch, module, package):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=rf"pip install .*{package}"):
        read_ros_map("m.yaml")


def test_benchmark_maps_are_written_as_their_makers_wrote_them(shared_data, tmp_path):
    same = 0
    for path in sorted((shared_data / "grids").glob("*.map")):
        content = path.read_bytes()
        write_map(tmp_path / "own.map", read_map(path))
        own = (tmp_path / "own.map").read_bytes()
        if set(content.split(b"\nmap\n")[-1]) <= set(b".@\n"):
            same += 1
            assert own.rstrip(b"\n") == content.rstrip(b"\n"), path.name
        np.testing.assert_array_equal(read_map(tmp_path / "own.map"), read_map(path))
    assert same >= 2, json.dumps(same)
