"""MovingAI maps and scenarios: read as they come, written back equal, refused with file and
line.
"""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from srt_jax.formats.movingai import ScenRow, read_map, read_scen, write_map, write_scen
from tests.helpers.pictures import drawn

HEADER = "type octile\nheight 2\nwidth 4\nmap\n"


@pytest.fixture
def file(tmp_path):
    """Writes a file and returns its path."""

    def write(content: str | bytes) -> str:
        path = tmp_path / "given"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    return write


def test_ground_and_swamp_are_free_and_the_rest_is_blocked(file):
    free = read_map(file("type octile\nheight 1\nwidth 7\nmap\n.G@OTSW\n"))
    assert free.tolist() == [[True, True, False, False, False, True, False]] and free.dtype == bool


@pytest.mark.parametrize(
    "content",
    [
        HEADER + ".@..\n...@\n",
        HEADER + ".@..\n...@",
        HEADER.replace("\n", "\r\n") + ".@..\r\n...@",
        HEADER + ".@..\n...@\n\n  \n",
        "type octile\nwidth 4\nheight 2\nmap\n.@..\n...@\n",
        "\ufeff" + HEADER + ".@..\n...@\n",
    ],
)
def test_line_ends_trailing_blanks_and_the_order_of_the_header_do_not_matter(file, content):
    expected, _ = drawn("""
        .@..
        ...@
    """)
    np.testing.assert_array_equal(read_map(file(content)), expected)


@pytest.mark.parametrize(
    ("message", "content"),
    [
        (":1: a map starts with", ""),
        (":1: a map starts with", b"\x80\x00\xff" * 30),
        (":2: a map starts with", "type octile\nheigth 2\n"),
        (":2: a map starts with", "type octile\ntype octile\n"),
        (":2: the file ends within its header", "type octile\nheight 2\n"),
        (":3: the header ends without height", "type octile\nwidth 2\nmap\n..\n"),
        (":1: maps of type 'tile' are not read", "type tile\nheight 2\nwidth 4\nmap\n....\n....\n"),
        (
            ":2: the height must be a positive whole number, got '-2'",
            HEADER.replace("2", "-2") + "....\n....\n",
        ),
        (":2: the height must be a positive whole number, got '0'", HEADER.replace("2", "0")),
        (
            ":3: the width must be a positive whole number, got '4.0'",
            HEADER.replace("4", "4.0") + "....\n....\n",
        ),
        (":5: the header says 2 rows, the file holds 1", HEADER + "....\n"),
        (":6: the header says 2 rows, the file holds 3", HEADER + "....\n....\n....\n"),
        (":6: the header says 4 columns, this row has 3", HEADER + "....\n...\n"),
        (":6: the header says 4 columns, this row has 5", HEADER + "....\n.....\n"),
        (":6: column 3 holds '#'", HEADER + "....\n..#.\n"),
        (":5: column 1 holds", HEADER.encode() + b"\xff...\n....\n"),
    ],
)
def test_a_bad_map_is_refused_with_file_and_line(file, message, content):
    path = file(content)
    with pytest.raises(ValueError) as caught:
        read_map(path)
    assert f"{path}{message}" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("message", "line"),
    [
        (":2: a row has 9 fields", "0 a.map 3 3 0 0 1 1"),
        (":2: goal y is 3, outside a map of height 3", "0 a.map 3 3 0 0 1 3 2"),
        (":2: start x must be a whole number", "0 a.map 3 3 -1 0 1 2 2"),
        (":2: width must be a whole number", "0 a.map x 3 0 0 1 2 2"),
        (":2: the optimal length must be a number", "0 a.map 3 3 0 0 1 2 nan"),
        (":2: the optimal length must be a number", "0 a.map 3 3 0 0 1 2 -1"),
        (":2: the optimal length must be a number", "0 a.map 3 3 0 0 1 2 x"),
    ],
)
def test_a_bad_scenario_row_is_refused_with_file_and_line(file, message, line):
    path = file("version 1\n" + line + "\n")
    with pytest.raises(ValueError) as caught:
        read_scen(path)
    assert f"{path}{message}" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("content", ["", "version 2\n", "0\ta.map\t3\t3\t0\t0\t1\t1\t1\n"])
def test_a_scenario_without_its_version_is_refused(file, content):
    with pytest.raises(ValueError, match=":1: a scenario starts with 'version 1'"):
        read_scen(file(content))


def test_missing_files_and_folders_are_refused(tmp_path):
    for read in (read_map, read_scen):
        with pytest.raises(ValueError, match="no such file"):
            read(tmp_path / "none")
        with pytest.raises(ValueError, match="cannot be read"):
            read(tmp_path)
    with pytest.raises(ValueError, match="folder that exists"):
        write_map(tmp_path / "none" / "a.map", np.ones((2, 2), bool))


def test_x_is_the_column_and_folders_of_the_map_name_go(file):
    rows = read_scen(file("version 1.0\r\n3\tmaps\\city/a b.map\t8\t9\t1\t2\t7\t8\t9.5\r\n\r\n"))
    assert rows == [ScenRow(3, "a b.map", 8, 9, (2, 1), (8, 7), 9.5)]
    assert read_scen(file("version 1")) == []


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**20))
def test_what_is_written_is_read_back_equal(tmp_path_factory, height, width, seed):
    folder = tmp_path_factory.mktemp("back")
    rng = np.random.default_rng(seed)
    free = rng.random((height, width)) < 0.5
    write_map(folder / "a.map", free)
    np.testing.assert_array_equal(read_map(folder / "a.map"), free)
    cells = rng.integers(0, (height, width), (6, 2)).tolist()
    rows = [
        ScenRow(n, "a.map", width, height, tuple(a), tuple(b), rng.random() * 100)
        for n, (a, b) in enumerate(zip(cells, cells[3:]))
    ]
    write_scen(folder / "a.scen", rows)
    assert read_scen(folder / "a.scen") == rows


def test_a_map_that_is_no_mask_is_not_written(tmp_path):
    with pytest.raises(TypeError, match="bool"):
        write_map(tmp_path / "a.map", np.ones((2, 2)))
    with pytest.raises(ValueError, match="shape"):
        write_map(tmp_path / "a.map", np.ones((2, 2, 2), bool))
    assert not os.listdir(tmp_path)


def test_a_failure_while_writing_leaves_the_older_file_and_nothing_else(tmp_path):
    path = tmp_path / "a.scen"
    write_scen(path, [])
    before = path.read_bytes()
    with pytest.raises(AttributeError):
        write_scen(path, [ScenRow(0, "a.map", 2, 2, (0, 0), (0, 1), 1.0), None])
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["a.scen"]


def test_every_outside_map_and_scenario_is_read_and_written_back_equal(shared_data, tmp_path):
    # which are odd on purpose
    files = [path for path in sorted(shared_data.glob("*/*")) if path.parent.name != "hunt"]
    maps, scens = (
        [path for path in files if path.suffix == ending] for ending in (".map", ".scen")
    )
    assert len(maps) > 20 and len(scens) > 20
    sizes = {}
    for path in maps:
        free = read_map(path)
        sizes[path.name] = free.shape
        write_map(tmp_path / "a.map", free)
        np.testing.assert_array_equal(read_map(tmp_path / "a.map"), free)
    for path in scens:
        rows = read_scen(path)
        assert rows and all(sizes[row.map_name] == (row.height, row.width) for row in rows)
        write_scen(tmp_path / "a.scen", rows)
        assert read_scen(tmp_path / "a.scen") == rows
