"""The experiments in small: what they count and find, not how long it takes; and that nothing absent stops them early."""

import json
import pathlib
import subprocess
import sys

import pytest

from experiments import path_planning

ROOT = pathlib.Path(__file__).resolve().parents[1]
EXPERIMENTS = ("path_planning",)


def result(folder, name):
    return json.loads((folder / f"{name}.json").read_text())


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_help_teaches_and_needs_none_of_the_extras(name):
    code = (
        "import sys; sys.modules |= dict.fromkeys(('matplotlib', 'scipy', 'typer', 'rich', 'shapely')); "
        f"import experiments.{name} as e; e.main(['--help'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert "--seed" in done.stdout and "examples:" in done.stdout and f"python -m experiments.{name}" in done.stdout


@pytest.fixture(scope="module")
def figure3(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figure3")
    assert path_planning.main(["--quick", "--size", "250", "--no-pictures", "--out", str(folder)]) == 0
    return folder


def test_figure_3_finds_the_same_by_every_make_and_explores_the_papers_shares(figure3):
    data = result(figure3, "path_planning")["data"]
    assert [case["blockage"] for case in data["cases"]] == list(path_planning.BLOCKAGES)
    assert all(case["agrees"] and case["contour"] > 0 and 0 < case["explored"] < 1 for case in data["cases"])
    explored = {case["blockage"]: case["explored"] for case in data["cases"]}
    assert explored["half"] < explored["quarter"] < explored["bagel-50"] < explored["bagel-10"]
    # A line belongs to the goal's share, so on an empty map of 250 x 250 these are exact.
    assert [row["A*"] for row in data["empty"]] == [31_250, 46_875, 52_500, 60_000, 62_400]
    assert [row["JPS"] for row in data["empty"]][:2] == [1, 1]


def test_figure_3_is_drawn_and_its_record_says_how(figure3):
    record = result(figure3, "path_planning")
    assert record["command"].startswith("python -m experiments.path_planning --quick") and record["machine"]["packages"]["jax"]
    assert (figure3 / "figure3.png").read_bytes().startswith(b"\x89PNG")
    drawn = (figure3 / "figure3.svg").read_text()
    assert all(word in drawn for word in ("runtime, ms", "JPS", "A*", "Bagel-100", "obstacle detection"))
