"""Maps, scenes and scenarios as other programs write them: each file with its right result
(tests/odd_inputs/maps).
"""

import json
import pathlib
import shutil

import numpy as np
import pytest

from srt_jax.cli import run
from srt_jax.formats.movingai import read_map, scaled, write_map
from srt_jax.formats.namo_svg import read_namo
from srt_jax.formats.notes import Notes
from srt_jax.formats.pictures import read_image
from srt_jax.formats.reading import Reading
from srt_jax.formats.ros_map import read_ros_map
from srt_jax.formats.task_files import read_tasks
from srt_jax.formats.xml_map import read_xml_map
from tests.helpers.pictures import drawn

Image = pytest.importorskip("PIL.Image")
pytest.importorskip("yaml")
pytest.importorskip("defusedxml")

MAPS = pathlib.Path(__file__).resolve().parents[1] / "odd_inputs" / "maps"


@pytest.fixture
def here(tmp_path, monkeypatch):
    for file in MAPS.iterdir():
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def printed(capsys, *arguments):
    code = run([*arguments])
    out, err = capsys.readouterr()
    return code, out, err


# --- ROS


@pytest.mark.parametrize("name", ["scientific.yaml", "trinary_capital.yaml"])
def test_an_odd_ros_map_has_its_right_answer(here, capsys, name):
    code, out, err = printed(capsys, "solve", name, "--start", "0,0", "--goal", "4,6", "--json")
    assert (code, err, json.loads(out)["tasks"][0]["status"]) == (0, "", "SOLVED")


def test_numbers_are_those_of_map_server(here):
    read = read_ros_map("scientific.yaml")
    assert (read.cell_side, read.corner) == (0.05, (-10, 2))


def test_notes_are_printed_even_where_reading_ends_in_an_error(here, capsys):
    code, out, err = printed(capsys, "solve", "transparent.yaml", "--start", "0,0", "--goal", "4,6")
    assert (code, out) == (2, "")
    assert "note: transparent.yaml: unknown cells, taken as blocked: 4" in err
    assert "start (0, 0) is an unknown cell" in err and "--unknown free" in err
    assert (
        printed(capsys, "solve", "transparent.yaml", "--start", "0,0", "--goal", "4,6", "--json")[2]
        == err
    )
    convert = printed(
        capsys, "convert", "transparent.yaml", "t.map", "--start", "0,0", "--goal", "4,6"
    )
    assert convert == (2, "", err) and not pathlib.Path("t.map").exists()


PLAIN = {
    "image": "wall.pgm",
    "resolution": "0.05",
    "origin": "[-10, 2, 0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


def yaml_text(**changes):
    lines = {**PLAIN, **changes}
    return "".join(f"{name}: {value}\n" for name, value in lines.items() if value is not None)


SAME_MAP = {
    "exponents": yaml_text(
        resolution="5.0E-2", origin="[-1.0e+1, 2e0, 0e0]", free_thresh="1.96e-1"
    ),
    "a leading zero, which YAML 1.1 takes for octal": yaml_text(origin="[-010, 02, 00]"),
    "bare points": yaml_text(resolution=".05", origin="[-10., 2., 0.]", free_thresh=".196"),
    "quoted values": yaml_text(
        image='"wall.pgm"', resolution="'0.05'", negate='"0"', origin="['-10', \"2\", 0]"
    ),
    "block style": yaml_text(origin="\n  - -10\n  - 2\n  - 0"),
    "negate false": yaml_text(negate="false"),
    "negate No": yaml_text(negate="No"),
    "negate off": yaml_text(negate="off"),
    "a number of colour, as 0.0": yaml_text(negate="0.0"),
    "capitals": yaml_text() + "mode: TRINARY\n",
    "a quoted mode": yaml_text() + 'mode: "Scale"\n',
    "an empty mode": yaml_text() + "mode:\n",
    "no thresholds": yaml_text(occupied_thresh=None, free_thresh=None),
    "an empty threshold": yaml_text(occupied_thresh="", free_thresh="~"),
    "no negate": yaml_text(negate=None),
    "cartographer's order": yaml_text() + "# made by pbstream_to_ros_map\n",
    "a directive and an end": "%YAML 1.2\n---\n" + yaml_text() + "...\n",
    "a byte order mark": "\ufeff" + yaml_text(),
    "line ends of Windows": yaml_text().replace("\n", "\r\n"),
    "a path with ./": yaml_text(image="./wall.pgm"),
    "SLAM toolbox's threshold": yaml_text(free_thresh="0.25"),
    "a member of its own": yaml_text() + "map_type: [a, b]\n",
    "JSON, which is YAML": json.dumps({**PLAIN, "origin": [-10, 2, 0], "resolution": 0.05}),
}


@pytest.mark.parametrize("case", SAME_MAP)
def test_however_a_ros_map_is_written_it_is_the_same_map(here, case):
    (here / "m.yaml").write_text(SAME_MAP[case], encoding="utf-8", newline="")
    read, plain = read_ros_map("m.yaml"), read_ros_map("scientific.yaml")
    np.testing.assert_array_equal(read.free, plain.free)
    assert (read.cell_side, read.corner) == (plain.cell_side, plain.corner)


def test_the_error_names_what_a_ros_map_lacks(here):
    (here / "m.yaml").write_text(yaml_text(occupied_thresh=None, negate=None))
    notes = Notes()
    read_ros_map("m.yaml", notes=notes)
    noted = " | ".join(map(str, notes))
    assert "lacks occupied_thresh: taken as 0.65" in noted and "lacks negate: taken as 0" in noted


@pytest.mark.parametrize("value", ["1", "true", "True", "yes", "ON", "'1'"])
def test_negate_turns_the_shades_round(here, value):
    (here / "m.yaml").write_text(yaml_text(negate=value))
    plain = read_ros_map("scientific.yaml").free
    assert not (read_ros_map("m.yaml").free & plain).any()


def test_the_picture_of_a_ros_map_lies_beside_it_or_where_it_says(here):
    (here / "maps" / "pictures").mkdir(parents=True)
    shutil.move("wall.pgm", here / "maps" / "pictures" / "floor 1.pgm")
    for image in (
        "pictures/floor 1.pgm",
        "'../maps/pictures/floor 1.pgm'",
        str(here / "maps" / "pictures" / "floor 1.pgm"),
    ):
        (here / "maps" / "m.yaml").write_text(yaml_text(image=image))
        assert read_ros_map("maps/m.yaml").free.any()


def test_a_picture_of_0_and_1_is_what_map_server_makes_of_it(here):
    Image.fromarray(np.array([[0, 1]], np.uint8)).save("dark.png")
    (here / "m.yaml").write_text(yaml_text(image="dark.png"))
    assert read_ros_map("m.yaml").free.tolist() == [[False, False]]
    (here / "m.yaml").write_text(yaml_text(image="dark.png") + "mode: raw\n")
    assert read_ros_map("m.yaml").free.tolist() == [[True, True]]


REFUSED_ROS = {
    "a sexagesimal number": (
        yaml_text(resolution="1:30"),
        "resolution must be a finite number, got '1:30'",
    ),
    "a number with a unit": (yaml_text(resolution="0.05 m"), "resolution must be a finite number"),
    "a comma for a point": (yaml_text(resolution="0,05"), "resolution must be a finite number"),
    "infinite": (yaml_text(origin="[.inf, 0, 0]"), "a number of origin must be a finite number"),
    "too large": (yaml_text(resolution="1e999"), "finite number"),
    "an origin of two": (yaml_text(origin="[0, 0]"), r"origin must be \[x, y, yaw\]"),
    "an origin in words": (yaml_text(origin="0 0 0"), "origin must be"),
    "no image": (yaml_text(image=None), "lacks 'image': it needs image"),
    "an empty image": (yaml_text(image="''"), "image must be the name"),
    "a member twice": (yaml_text() + "resolution: 0.1\n", "'resolution' is given twice"),
    "negate 2": (yaml_text(negate="2"), "negate must be 0 or 1"),
    "an object": (yaml_text(image="!!python/object/apply:os.system [x]"), "no YAML"),
    "a tag of its own": (yaml_text(resolution="!metres 0.05"), "is not read"),
    "thresholds in percent": (yaml_text(occupied_thresh="65"), "occupied_thresh <= 1"),
}


@pytest.mark.parametrize("case", REFUSED_ROS)
def test_what_map_server_would_not_read_either_is_refused_in_one_line(here, case):
    text, message = REFUSED_ROS[case]
    (here / "m.yaml").write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        read_ros_map("m.yaml")
    assert "m.yaml" in str(caught.value) and "\n" not in str(caught.value)


# --- pictures

FREE, _ = drawn("""
    ...@..
    ...@..
    .@@@..
""")
SHADES = np.where(FREE, 255, 0).astype(np.uint8)


def saved(name, array, **options):
    Image.fromarray(array).save(name, **options)
    return name


def with_exif(name, shades, orientation):
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(shades).save(name, exif=exif)
    return name


def palette():
    picture = Image.new("P", FREE.shape[::-1])
    picture.putpalette([0, 0, 0, 250, 250, 250])
    picture.putdata(FREE.astype(int).ravel().tolist())
    picture.save("palette.png")
    return "palette.png"


def clear_palette():
    """White where index 1 is transparent, as GIMP exports an indexed picture."""
    picture = Image.new("P", FREE.shape[::-1])
    picture.putpalette([0, 0, 0, 0, 0, 0])
    picture.putdata(FREE.astype(int).ravel().tolist())
    picture.save("clear.png", transparency=1)
    return "clear.png"


PICTURES = {
    "floats from 0 to 1": lambda: saved("m.tif", FREE.astype(np.float32)),
    "floats from 0 to 255": lambda: saved("m.tif", SHADES.astype(np.float32)),
    "a mask of 0 and 1": lambda: saved("m.png", FREE.astype(np.uint8)),
    "a mask in colours": lambda: saved("m.png", FREE.astype(np.uint8)[..., None].repeat(3, axis=2)),
    "a mask of 16 bits": lambda: saved("m.png", FREE.astype(np.uint16)),
    "a mask of 32 bits": lambda: saved("m.tif", FREE.astype(np.int32)),
    "16 bits": lambda: saved("m.png", SHADES.astype(np.uint16) * 257),
    "16 bits in TIFF": lambda: saved("m.tif", SHADES.astype(np.uint16) * 257),
    "one bit": lambda: saved("m.png", FREE),
    "one bit in TIFF": lambda: saved("m.tif", FREE, compression="group4"),
    "a palette": palette,
    "a palette with a transparent colour": clear_palette,
    "alpha": lambda: saved("m.png", np.dstack([SHADES, np.full_like(SHADES, 255)])),
    "colours with alpha": lambda: saved(
        "m.png", np.dstack([SHADES, SHADES, SHADES, np.full_like(SHADES, 255)])
    ),
    "all transparent but the walls": lambda: saved(
        "m.png", np.dstack([SHADES * 0, np.where(FREE, 0, 255).astype(np.uint8)])
    ),
    "turned by a half": lambda: with_exif("m.png", np.ascontiguousarray(SHADES[::-1, ::-1]), 3),
    "turned by a quarter": lambda: with_exif("m.png", np.ascontiguousarray(np.rot90(SHADES)), 6),
    "mirrored, in TIFF": lambda: with_exif("m.tif", np.ascontiguousarray(SHADES[:, ::-1]), 2),
    "not turned, and it says so": lambda: with_exif("m.png", SHADES, 1),
    "another ending in capitals": lambda: saved("M.PNG", SHADES),
    "print colours": lambda: Image.fromarray(SHADES).convert("CMYK").save("m.tif") or "m.tif",
}


@pytest.mark.parametrize("case", PICTURES)
def test_however_a_picture_is_stored_it_shows_the_same_map(here, case):
    np.testing.assert_array_equal(read_image(PICTURES[case]()).free, FREE)


def test_pbm_and_pgm_are_read_as_text_and_with_any_white(here):
    rows = [" ".join("01"[not cell] for cell in row) for row in FREE.tolist()]
    (here / "m.pbm").write_text("P1\n# made by hand\n6 3\n" + "\n".join(rows) + "\n")
    np.testing.assert_array_equal(read_image("m.pbm").free, FREE)
    for white in (1, 15, 255, 1000):
        rows = [" ".join(str(white * cell) for cell in row) for row in FREE.tolist()]
        (here / "m.pgm").write_text(f"P2\n6 3\n{white}\n" + "\n".join(rows) + "\n")
        np.testing.assert_array_equal(read_image("m.pgm").free, FREE)


def test_notes_say_how_a_picture_was_converted(here):
    found = {}
    for name in ("turned by a half", "a mask of 0 and 1", "floats from 0 to 1"):
        notes = Notes()
        read_image(PICTURES[name](), notes=notes)
        found[name] = " | ".join(map(str, notes))
    assert "turned as it says itself" in found["turned by a half"]
    assert "taken as a mask, 1 is white" in found["a mask of 0 and 1"]
    assert "floats from 0, black, to 1, white" in found["floats from 0 to 1"]
    frames = [Image.fromarray(SHADES), Image.fromarray(255 - SHADES)]
    frames[0].save("two.gif", save_all=True, append_images=frames[1:])
    notes = Notes()
    np.testing.assert_array_equal(read_image("two.gif", notes=notes).free, FREE)
    assert "2 pictures: the first is read" in " ".join(map(str, notes))


@pytest.mark.parametrize(
    ("shades", "message"), [([[-1.0, 1.0]], "go from -1"), ([[0.0, 1e9]], "go up to")]
)
def test_shades_of_no_known_range_are_refused(here, shades, message):
    saved("m.tif", np.array(shades, np.float32))
    with pytest.raises(ValueError, match=message):
        read_image("m.tif")


def test_a_float_picture_of_the_wild_is_read(here, capsys):
    assert printed(capsys, "convert", "float01.tif", "float01.map")[0] == 0
    np.testing.assert_array_equal(
        read_map("float01.map"), np.tile([True, True, True, False, True, True], (4, 1))
    )


# --- endings


@pytest.mark.parametrize(
    "name", ["M.MAP", "m.Map", "M.YAML", "M.Yml", "M.PNG", "m.Pgm", "M.XML", "M.SVG", "M.TIF"]
)
def test_every_ending_counts_in_any_case(here, capsys, name):
    ending = name.rsplit(".", 1)[-1].lower()
    write_map("plain.map", FREE)
    if ending in ("yaml", "yml"):
        shutil.copy("scientific.yaml", name)
    elif ending == "svg":
        shutil.copy("held_grouped_robot.svg", name)
    else:
        assert (
            printed(
                capsys,
                "convert",
                "plain.map",
                f"plain.{ending}" if ending != "map" else "other.map",
            )[0]
            == 0
        )
        shutil.copy(f"plain.{ending}", name)
    tasks = read_tasks(name, reading=Reading(chooses=True))
    assert len(tasks) == 1 and tasks[0].name == name.rsplit(".", 1)[0]


# --- scenarios


def scen(path, *rows):
    path.write_text("version 1\n" + "".join("\t".join(map(str, row)) + "\n" for row in rows))


def test_a_scenario_without_rows_says_so(here, capsys):
    for command in ("solve", "scen"):
        code, out, err = printed(capsys, command, "no_rows.scen")
        assert (code, out) == (2, "") and "no_rows.scen: the scenario has no row" in err


def test_a_map_named_by_what_no_file_can_be_named_is_not_there(here, capsys):
    for name in ("x" * 5000 + ".map", "a\0b.map"):
        scen(here / "odd.scen", (0, name, 5, 3, 0, 0, 4, 0, 4.0))
        code, out, err = printed(capsys, "solve", "odd.scen")
        assert (code, out) == (2, "") and "odd.scen:2: the row is on the map " in err


def test_each_row_of_a_scenario_is_on_its_own_map(here, capsys):
    for command in ("solve", "scen"):
        code, out, err = printed(capsys, command, "two_maps.scen")
        assert (code, out) == (2, "") and "two_maps.scen:3: the row is on the map other.map" in err
    write_map("other.map", np.ones((3, 5), bool))
    scen(
        here / "both.scen",
        (0, "base.map", 5, 3, 0, 0, 1, 2, 2.41421356),
        (0, "maps/other.map", 5, 3, 0, 0, 4, 0, 4),
    )
    tasks = read_tasks("both.scen")
    assert [bool((task.labels >= 0).any()) for _, task in tasks] == [True, False] and [
        name for name, _ in tasks
    ] == [
        "both-0",
        "both-1",
    ]
    code, out, _ = printed(capsys, "scen", "both.scen", "--json")
    assert code == 0 and json.loads(out)["matches"] == 2
    (here / "elsewhere").mkdir()
    shutil.move("other.map", "elsewhere/other.map")
    code, out, _ = printed(capsys, "scen", "both.scen", "--map", "elsewhere/other.map", "--json")
    assert code == 0 and json.loads(out)["rows"] == 2


def test_a_scenario_of_another_size_is_on_the_scaled_map(here, capsys):
    twice = read_map("base.map").repeat(2, axis=0).repeat(2, axis=1)
    np.testing.assert_array_equal(scaled(read_map("base.map"), 6, 10), twice)
    np.testing.assert_array_equal(scaled(twice, 3, 5), read_map("base.map"))
    scen(here / "twice.scen", (0, "base.map", 10, 6, 0, 0, 3, 5, 3 * 2**0.5 + 2))
    ((_, task),) = read_tasks("twice.scen")
    np.testing.assert_array_equal(task.labels[0] < 0, twice)
    code, out, err = printed(capsys, "scen", "twice.scen")
    assert (
        code == 0
        and "1 match" in out
        and "base.map, 5 wide and 3 high, is scaled to 10 x 6 cells" in err
    )


def test_rows_are_chosen_by_number_and_by_count(here, capsys):
    scen(here / "m.scen", *((0, "base.map", 5, 3, 0, 0, 1, row % 3, 9) for row in range(6)))
    for how, expected in (
        (Reading(limit=2), [0, 1]),
        (Reading(rows=(2, 5)), [2, 3, 4]),
        (Reading(rows=(4, None)), [4, 5]),
        (Reading(rows=(None, 5), limit=1), [0]),
    ):
        assert [name for name, _ in read_tasks("m.scen", reading=how)] == [
            f"m-{number}" for number in expected
        ]
    for text, message in (
        ("9:", "holds no row: they are numbered 0 to 5"),
        ("3", "two numbers A:B"),
        ("b:c", "two numbers A:B"),
    ):
        code, out, err = printed(capsys, "solve", "m.scen", "--rows", text)
        assert (code, out) == (2, "") and message in err
    assert printed(capsys, "convert", "m.scen", "m.npz", "--rows", "1:5", "--limit", "3")[0] == 0
    assert [name for name, _ in read_tasks("m.npz", reading=Reading(rows=(1, 3)))] == ["m-2", "m-3"]
    code, out, _ = printed(capsys, "scen", "m.scen", "--rows", "1:3", "--json")
    assert json.loads(out)["rows"] == 2 and code == 1


def test_a_blocker_leaves_out_and_counts_the_rows_that_it_does_not_fit(here, capsys):
    write_map("open.map", np.ones((8, 8), bool))
    rows = [
        (0, "open.map", 8, 8, 0, 0, 7, 7, 9),
        (0, "open.map", 8, 8, 6, 6, 7, 7, 9),
        (0, "open.map", 8, 8, 0, 7, 7, 0, 9),
    ]
    scen(here / "m.scen", *rows)
    notes = Notes()
    tasks = read_tasks("m.scen", reading=Reading(block="bagel-5"), notes=notes)
    assert [name for name, _ in tasks] == ["m-0", "m-2"]
    (note,) = notes
    assert "--block bagel-5 does not fit" in note.what and (note.count, note.example) == (1, "m-1")
    code, out, err = printed(capsys, "convert", "m.scen", "m.npz", "--block", "bagel-5")
    assert code == 0 and "2 tasks" in out and "tasks left out" in err
    with pytest.raises(
        ValueError,
        match=r"m\.scen: --block bagel-99: start .*nor does it fit any other of the 3 tasks",
    ):
        read_tasks("m.scen", reading=Reading(block="bagel-99"))
    with pytest.raises(ValueError, match="unknown blockage"):
        read_tasks("m.scen", reading=Reading(block="wall"))


@pytest.mark.parametrize("command", ["solve", "draw"])
def test_one_bad_file_costs_the_others_nothing(here, capsys, command):
    ends = ["--start", "0,0", "--goal", "4,6"]
    files = ["nosuch.yaml", "scientific.yaml", "transparent.yaml"]
    code, out, err = printed(
        capsys, command, *files, *ends, *(["--out", "p.png"] if command == "draw" else [])
    )
    assert (
        code == 2 and "nosuch.yaml: no such file" in err and "transparent.yaml: start (0, 0)" in err
    )
    assert err.count("srt-jax: error:") == 2
    assert ("SOLVED" in out) if command == "solve" else pathlib.Path("p.png").exists()


# --- scenes


def test_a_robot_and_goal_that_are_groups_are_read(here, capsys):
    code, out, _ = printed(capsys, "solve", "held_grouped_robot.svg", "--json")
    (task,) = json.loads(out)["tasks"]
    assert (code, task["status"], len(task["destroyed"])) == (0, "SOLVED", 1)


def scene(*drawings, robot='<path id="r" type="shape" d="M 30,90 H 50 V 110 H 30 Z"/>'):
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 400 200"><namo_config><agent'
        f' agent_id="r"><goal goal_id="g"/></agent></namo_config>{robot}<path id="g" type="shape"'
        f' d="M 350,90 h 20 v 20 h -20 Z"/>{"".join(drawings)}</svg>'
    )


BOX = "M 190,0 H 210 V 200 H 190 Z"
CORNERS = {(1.9, 2.0), (2.1, 2.0), (2.1, 0.0), (1.9, 0.0)}
SAME_BOX = {
    "a path": f'<path id="b" type="movable" d="{BOX}"/>',
    "a path without an id": f'<path type="movable" d="{BOX}"/>',
    "a group with its outline and a mark": (
        f'<g id="b" type="movable"><path type="shape" d="{BOX}"/>'
        '<path type="orientation" d="M 0 0 H 9"/></g>'
    ),
    "a group of a group": f'<g type="movable"><g><path d="{BOX}"/></g></g>',
    "a rectangle": '<rect id="b" type="movable" x="190" y="0" width="20" height="200"/>',
    "a polygon": '<polygon type="movable" points="190,0 210,0 210,200 190,200"/>',
    "a moved group": (
        '<g transform="translate(190)"><rect type="movable" width="20" height="200"/></g>'
    ),
    "relative commands": '<path type="movable" d="m190 0h20v200h-20z"/>',
}


@pytest.mark.parametrize("case", SAME_BOX)
def test_however_a_box_is_drawn_it_is_the_same_box(tmp_path, case):
    (tmp_path / "s.svg").write_text(scene(SAME_BOX[case]))
    (box,) = read_namo(tmp_path / "s.svg").obstacles
    assert box.destroyable and set(box.parts[0][0]) == CORNERS


def test_drawings_of_one_id_do_not_hide_each_other(tmp_path):
    (tmp_path / "s.svg").write_text(
        scene(SAME_BOX["a path"], SAME_BOX["a path"].replace("movable", "wall"))
    )
    assert [box.destroyable for box in read_namo(tmp_path / "s.svg").obstacles] == [True, False]


def test_a_robot_may_be_a_circle_or_one_path_in_a_group(tmp_path):
    for robot in (
        '<circle id="r" type="shape" cx="40" cy="100" r="10"/>',
        '<g id="r"><circle cx="40" cy="100" r="10"/></g>',
        (
            '<g id="r"><path type="orientation" d="M 0 0 H 9"/><ellipse type="shape" cx="40"'
            ' cy="100" rx="10" ry="10"/></g>'
        ),
    ):
        (tmp_path / "s.svg").write_text(scene(robot=robot))
        world = read_namo(tmp_path / "s.svg")
        assert world.position == (0.4, 1.0) and world.radius == pytest.approx(0.1, rel=1e-4)
    (tmp_path / "s.svg").write_text(
        scene(robot='<g id="r"><path d="M 0 0 H 9"/><path d="M 0 0 H 9"/></g>')
    )
    with pytest.raises(ValueError, match="is a group of 2 drawings"):
        read_namo(tmp_path / "s.svg")


def test_a_document_type_is_no_entity_and_entities_are_refused_in_every_encoding(tmp_path):
    kind = (
        '<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN"'
        ' "http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">'
    )
    (tmp_path / "s.svg").write_text(kind + scene(SAME_BOX["a path"]))
    assert len(read_namo(tmp_path / "s.svg").obstacles) == 1
    for encoding in ("utf-8", "utf-16", "utf-16-le", "utf-16-be"):
        head = f'<?xml version="1.0" encoding="{encoding[:6]}"?><!DOCTYPE svg [<!ENTITY a "b">]>'
        (tmp_path / "s.svg").write_bytes((head + scene()).encode(encoding))
        (tmp_path / "m.xml").write_bytes((head + "<root/>").encode(encoding))
        for read, name in ((read_namo, "s.svg"), (read_xml_map, "m.xml")):
            with pytest.raises(ValueError, match="entities"):
                read(tmp_path / name)


def test_an_xml_map_may_be_in_another_encoding(tmp_path):
    text = "<root><map><width>2</width><height>1</height><grid><row>0 1</row></grid></map></root>"
    (tmp_path / "m.xml").write_bytes(
        ('<?xml version="1.0" encoding="utf-16"?>' + text).encode("utf-16")
    )
    assert read_xml_map(tmp_path / "m.xml").free.tolist() == [[True, False]]


@pytest.mark.parametrize(
    "text",
    ["M 0 0 w 9", "M 0 0 L 1", "M 0 0 Z 5 5", "M 0 0 L 1e999 0", "0 0 L 1 1", "M 0 0 C 1 1 2"],
)
def test_paths_with_a_slip_are_refused_with_their_name(tmp_path, text):
    (tmp_path / "s.svg").write_text(scene(f'<path id="crooked" type="wall" d="{text}"/>'))
    with pytest.raises(ValueError, match=r"s\.svg: the path 'crooked'"):
        read_namo(tmp_path / "s.svg")


def test_names_for_values_do_not_multiply_them(here):
    """Nine lists of nine, each of the one before, would be 400 million values."""
    lines = ["v0: &v0 [" + "1," * 8 + "1]"]
    lines += [f"v{n}: &v{n} [" + f"*v{n - 1}," * 8 + f"*v{n - 1}]" for n in range(1, 9)]
    pathlib.Path("laughs.yaml").write_text(yaml_text() + "\n".join(lines) + "\n")
    with pytest.raises(ValueError, match=r"laughs\.yaml: .*more than 1000 values"):
        read_ros_map("laughs.yaml")
    pathlib.Path("named.yaml").write_text(yaml_text(negate="&no 0") + "more: *no\n")
    assert (read_ros_map("named.yaml").free == read_ros_map("scientific.yaml").free).all()
