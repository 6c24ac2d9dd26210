"""`srt-jax draw` as a person types it."""

import json

import pytest

from srt_jax.cli import run
from srt_jax.draw.gallery import file_names

Image = pytest.importorskip("PIL.Image")
pytest.importorskip("matplotlib")

WALLED = "type octile\nheight 4\nwidth 6\nmap\n..@...\n..@.@.\n..@...\n..@...\n"
MAP = ["draw", "walled.map", "--start", "0,0", "--goal", "3,5"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walled.map").write_text(WALLED)
    assert run(["generate", "half", "--count", "3", "--size", "16", "--out", "b.npz"]) == 0
    return tmp_path


def drawn(folder):
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("name", ["one.png", "one.svg", "one.gif"])
def test_one_task_is_drawn_to_the_file_named(name, here, capsys):
    assert run([*MAP, "--out", name, "--polar"]) == 0
    assert (here / name).stat().st_size > 2000 and name in capsys.readouterr().out


def test_many_tasks_fill_a_folder_or_a_sheet(here, capsys):
    assert run(["draw", "b.npz", "--out", "p", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert drawn(here / "p") == [
        "contact-sheet.png",
        "half-0000.png",
        "half-0001.png",
        "half-0002.png",
    ]
    assert len(answer["files"]) == 4 and answer["tasks"] == ["half-0000", "half-0001", "half-0002"]
    assert run(["draw", "b.npz", "--out", "sheet.png"]) == 0
    with Image.open(here / "sheet.png") as sheet:
        assert sheet.width == 1500
    assert run(["draw", "b.npz", "--out", "s", "--show", "sheet", "--format", "svg"]) == 0
    assert drawn(here / "s") == ["contact-sheet.svg"]
    assert run(["draw", "b.npz", "--out", "w", "--show", "wave", "--limit", "2"]) == 0
    assert drawn(here / "w") == ["half-0000-wave.gif", "half-0001-wave.gif"]


def test_one_of_many_is_chosen_by_name(here):
    assert run(["draw", "b.npz", "--only", "half-0001", "--out", "one.gif"]) == 0
    with Image.open(here / "one.gif") as film:
        assert film.n_frames > 20


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["draw", "b.npz", "--out", "all.gif"], "--only"),
        (["draw", "b.npz", "--only", "nobody", "--out", "p"], "half-0000"),
        (["draw", "b.npz", "--out", "p.tif"], ".tif"),
        (["draw", "b.npz", "--out", "p", "--show", "dance"], "--show"),
        (["draw", "b.npz", "--out", "p", "--format", "bmp"], "--format"),
        (["draw", "b.npz", "--out", "p.png", "--show", "loop"], ".gif"),
        (["draw", "nowhere.npz", "--out", "p"], "no such file"),
        (["draw", "walled.map", "--out", "p"], "--start"),
        ([*MAP, "--polar", "--metres-per-cell", "0", "--out", "p"], "metres_per_cell"),
        (["draw", "b.npz", "--out", "nowhere/p.gif", "--limit", "1"], "nowhere"),
    ],
)
def test_a_slip_is_one_line_and_draws_nothing(here, capsys, arguments, message):
    before = drawn(here)
    capsys.readouterr()
    code = run(arguments)
    out, err = capsys.readouterr()
    assert (code, out) == (2, "") and err.count("\n") == 1 and message in err
    assert drawn(here) == before


def test_names_become_file_names_that_are_safe_and_unlike():
    assert file_names(["a", "a", "x/a", "so: what?", "..", ""]) == [
        "a",
        "a-2",
        "a-3",
        "so_what",
        "task",
        "task-2",
    ]
