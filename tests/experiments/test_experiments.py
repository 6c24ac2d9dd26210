"""The experiments in small: what they count and find, not how long it takes; and that nothing
absent stops them early.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from experiments import figure1, figure2, figure3, report
from experiments import repeat as repeated
from experiments.figures import blocks_tasks, city_fragments, fuzzy_goal, planners
from experiments.figures.column_style import style
from experiments.figures.loop_tables import checks
from experiments.figures.outcome import Table, as_markdown, as_text
from sign_model import load
from sign_model.space.polar import from_polar, sector_corners
from srt_jax import Obstacle
from srt_jax.bench.machine import machine
from srt_jax.geometry.place import Place

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXPERIMENTS = ("figure2", "figure3", "figure1")


def result(folder, name):
    return json.loads((folder / f"{name}.json").read_text())


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_help_teaches_and_needs_none_of_the_extras(name):
    code = (
        "import sys; sys.modules |= dict.fromkeys(('matplotlib', 'scipy', 'typer', 'rich',"
        f" 'shapely')); import experiments.{name} as e; e.main(['--help'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert (
        "--seed" in done.stdout
        and "examples:" in done.stdout
        and f"python -m experiments.{name}" in done.stdout
    )


@pytest.fixture(scope="module")
def third_figure(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figure3")
    assert figure3.main(["--quick", "--size", "250", "--no-pictures", "--out", str(folder)]) == 0
    return folder


def test_figure_3_finds_the_same_by_every_make_and_explores_the_papers_shares(third_figure):
    data = result(third_figure, "figure3")["data"]
    assert [case["blockage"] for case in data["cases"]] == list(figure3.BLOCKAGES)
    assert all(
        case["agrees"] and case["contour"] > 0 and 0 < case["explored"] < 1
        for case in data["cases"]
    )
    explored = {case["blockage"]: case["explored"] for case in data["cases"]}
    assert explored["half"] < explored["quarter"] < explored["bagel-50"] < explored["bagel-10"]
    # A line belongs to the goal's share, so on an empty map of 250 x 250 these are exact.
    assert [row["A*"] for row in data["empty"]] == [31_250, 46_875, 52_500, 60_000, 62_400]
    assert [row["JPS"] for row in data["empty"]][:2] == [1, 1]


def test_figure_3_tells_what_has_to_hold_and_that_it_does(third_figure):
    record = result(third_figure, "figure3")
    table = next(table for table in record["tables"] if table["title"] == "Checks")
    assert len(table["rows"]) == len(record["data"]["checks"]) >= 3 and {
        row[-1] for row in table["rows"]
    } == {"yes"}


def test_on_the_papers_size_a_wrong_count_on_the_empty_map_is_reported():
    theirs = {
        "half": (125_000, 1),
        "quarter": (187_500, 1),
        "bagel-100": (240_000, 5),
        "bagel-50": (247_500, 5),
    }
    rows = [
        {"blockage": name, "A*": a, "JPS": j, "explored": a / 500**2}
        for name, (a, j) in theirs.items()
    ]
    assert [holds for _, _, holds in checks([], rows, 500)] == [True, True]
    rows[0] |= {"A*": 120_000, "explored": 0.48}
    assert [(found, holds) for _, found, holds in checks([], rows, 500)] == [
        ("off by 2.00 at most", False),
        ("3 of 4", False),
    ]


def test_of_an_extract_the_window_with_the_most_buildings_is_taken(tmp_path, monkeypatch):
    houses = [
        Obstacle.polygon([(x, 40), (x + 9, 40), (x + 9, 60), (x, 60)])
        for x in (100, 2600, 2700, 2800)
    ]
    monkeypatch.setattr(
        city_fragments, "read_osm", lambda path: Place((0, 0, 3000, 1200), tuple(houses), "none")
    )
    (fragment,) = city_fragments.extracts([tmp_path / "town.osm.pbf"], 100, lambda text: None)
    assert fragment.name == "town" and len(np.unique(fragment.labels)) == 4
    monkeypatch.setattr(
        city_fragments,
        "read_osm",
        lambda path: Place((0, 0, 5, 5), (Obstacle.polygon([(1, 1), (2, 1), (1, 2)]),), ""),
    )
    with pytest.raises(ValueError, match="5 m a side is too small for 500 x 500 cells"):
        list(city_fragments.extracts([tmp_path / "tiny.osm"], 500, lambda text: None))
    monkeypatch.setattr(city_fragments, "read_osm", lambda path: Place((0, 0, 500, 500), (), ""))
    with pytest.raises(ValueError, match="no building in it"):
        list(city_fragments.extracts([tmp_path / "fields.osm"], 500, lambda text: None))


def test_figure_3_is_drawn_and_its_record_says_how(third_figure):
    record = result(third_figure, "figure3")
    assert (
        record["command"].startswith("python -m experiments.figure3 --quick")
        and record["machine"]["packages"]["jax"]
    )
    assert (third_figure / "figure3.png").read_bytes().startswith(b"\x89PNG")
    drawn = (third_figure / "figure3.svg").read_text()
    assert all(
        word in drawn for word in ("runtime, ms", "JPS", "A*", "Bagel-100", "obstacle detection")
    )


@pytest.fixture(scope="module")
def second_figure(tmp_path_factory, monkeypatch_module):
    folder = tmp_path_factory.mktemp("figure2")
    monkeypatch_module.setattr(blocks_tasks, "SHARED", folder / "absent")
    assert figure2.main(["--quick", "--no-peers", "--most-blocks", "5", "--out", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def monkeypatch_module():
    with pytest.MonkeyPatch.context() as patch:
        yield patch


def test_figure_2_has_the_papers_lengths_on_its_two_tasks(second_figure):
    paper = result(second_figure, "figure2")["data"]["paper"]
    for task, length in (("BLOCKS-4-0", 6), ("BLOCKS-4-1", 10)):
        assert {paper[task][name]["length"] for name in ("MAP", "A*", "W*", "authors' rule")} == {
            length
        }
    assert set(paper["BLOCKS-4-0"]["MAP"]["parts"]) == set(figure2.STAGES)
    assert paper["BLOCKS-4-0"]["MAP"]["parts"]["network"] > 0
    assert (second_figure / "figure2.svg").is_file() and (
        second_figure / "figure2-series.png"
    ).is_file()


def test_the_series_is_solved_at_its_optimum_by_astar(second_figure):
    rows = result(second_figure, "figure2")["data"]["series"]
    assert [row["blocks"] for row in rows] == [4, 4, 4, 5, 5, 5]
    for row in rows:
        lengths = {name: answer["length"] for name, answer in row["answers"].items()}
        assert (
            lengths["A*"]
            == row["optimum"]
            <= min(length for length in lengths.values() if length is not None)
        )
        # the authors' rule cuts, and may end without a plan
        assert None not in (lengths["MAP"], lengths["W*"])


def test_the_papers_tasks_in_our_words_are_those_of_the_competition(shared_data):
    for task in blocks_tasks.paper_tasks():
        path = shared_data / "pddl" / "blocks" / f"prob{task.name}.pddl"
        theirs, ours = (
            load(path.parent / "domain.pddl", path),
            load(
                task.domain, re.sub(r"\bb(\d)\b", lambda found: "abcd"[int(found[1])], task.problem)
            ),
        )
        assert theirs.problem.start == ours.problem.start and set(theirs.problem.goal) == set(
            ours.problem.goal
        )
    names = [
        (task.name, task.optimum)
        for task in blocks_tasks.series(5, seed=0, folder=shared_data / "pddl" / "blocks")
    ]
    assert (
        names[:4] == [("BLOCKS-4-0", 6), ("BLOCKS-4-1", 10), ("BLOCKS-4-2", 6), ("BLOCKS-5-0", 12)]
        and len(names) == 6
    )


def test_a_peers_plan_counts_only_when_it_is_one():
    task = blocks_tasks.paper_tasks()[0]
    write = "import pathlib; pathlib.Path('problem.pddl.soln').write_text('(pick-up b1)\\n{}')"
    right = "(stack b1 b0)\\n(pick-up b2)\\n(stack b2 b1)\\n(pick-up b3)\\n(stack b3 b2)\\n; cost 6"
    for rest, length in ((right, 6), ("(stack b1 b0)", None)):
        assert (
            planners._peer([sys.executable, "-c", write.format(rest)], 20.0)(task).length == length
        )
    assert (
        planners._peer([sys.executable, "-c", "import time; time.sleep(9)"], 0.1)(task).length
        is None
    )


def test_figure_1_goes_down_from_the_goals_sign_to_the_route_and_up_again_to_the_plan():
    story = fuzzy_goal.plan_and_walk()
    (x, y), side = story.square
    corners = from_polar(
        sector_corners(story.sector), fuzzy_goal.AGENT, np.float64(fuzzy_goal.HEADING)
    )
    assert (np.abs(corners - (x, y)) <= side / 2).all() and side > 2 * fuzzy_goal.RADIUS
    assert story.grid.side == side and story.first_plan == ("(relocate i here goal-area)",)
    assert [step.split()[0] for step in story.plan] == ["(approach", "(destroy", "(pass"] and set(
        story.seen
    ) == {"fence"}
    assert [name for _, name, _, _ in story.legs] == [
        "moving midway in a straight line",
        "moving midway on a curve",
    ]
    assert all(strays <= deviation for _, _, deviation, strays in story.legs)
    with style():
        texts = {text.get_text() for text in fuzzy_goal.draw(story).legends[0].get_texts()}
    assert {
        "$L_1$",
        "$L_2$",
        "$H_1$ = 5 m",
        "$H_2$ = 12 m",
        "contour",
        "destroyed",
        "indestructible",
    } <= texts


@pytest.mark.slow
def test_the_least_removal_never_costs_more_than_the_papers_loop(tmp_path):
    assert figure1.main(["--quick", "--count", "4", "--size", "24", "--out", str(tmp_path)]) == 0
    data = result(tmp_path, "figure1")["data"]
    rows = {(row["kind"], row["mode"]): row for row in data["modes"]}
    assert data["problems"] == 0 and {"cities", "Helsinki", "rooms", "fences", "rings"} <= {
        kind for kind, _ in rows
    }
    for (_, mode), row in rows.items():
        if row["compared"] or mode != "literal":  # which may solve none
            assert row["cost"] >= row["least_cost"] >= row["bound"] >= 0
        if mode != "literal":  # which stops short where the least may be nothing at all
            assert row["bound"] > 0
        assert row["solved"] == row["solvable"] or mode == "literal"


def test_the_page_of_results_holds_every_table_with_its_command_and_figure(second_figure, tmp_path):
    place = tmp_path / "results" / "figure2"
    shutil.copytree(second_figure, place)
    (tmp_path / "results" / "bench").mkdir()
    record = result(place, "figure2")
    bench = {"command": "srt-jax bench solve", "made_on": record["machine"], "text": "ours 1.00 ms"}
    (tmp_path / "results" / "bench" / "solve.json").write_text(json.dumps(bench))
    page = tmp_path / "page.md"
    assert (
        report.main(["--no-run", "--results", str(tmp_path / "results"), "--page", str(page)]) == 0
    )
    text = page.read_text()
    assert (
        "`python -m experiments.figure2 --quick --no-peers --most-blocks 5`" in text
        and str(tmp_path) not in text
    )
    assert (
        "![figure2.png](page/figure2.png)" in text and (tmp_path / "page" / "figure2.png").is_file()
    )
    assert "`srt-jax bench solve`" in text and "ours 1.00 ms" in text
    assert all(f"**{table['title']}**" in text for table in record["tables"])


def test_the_page_names_a_failed_run_and_keeps_its_older_section(tmp_path, monkeypatch):
    (tmp_path / "bench").mkdir()
    record = {
        "command": "srt-jax bench solve",
        "date": "2026-01-02",
        "made_on": machine(),
        "text": "ours 1.00 ms",
    }
    (tmp_path / "bench" / "solve.json").write_text(json.dumps(record))
    monkeypatch.setattr(report, "_ran", lambda name, given: False)
    page = tmp_path / "page.md"
    page.write_text("# Old\n\n<!-- by hand -->\nIn short.\n<!-- end by hand -->\n\n## Older\n")
    assert report.main(["--only", "solve", "--results", str(tmp_path), "--page", str(page)]) == 1
    text = page.read_text()
    assert text.count("In short.") == 1 and "Older" not in text
    assert "The latest run failed" in text and "ours 1.00 ms" in text and "2026-01-02" in text
    assert (
        text.count("*Not run yet.*") == len(report.TITLES) - 1
        and report.TITLES.keys() == report.MINUTES.keys()
    )


def test_two_runs_are_held_together_but_for_their_times():
    one = {
        "rows": [{"length": 6, "seconds": {"median": 1.0}, "checks": {"kernels": True}}],
        "kernels": [1.0],
    }
    same = {
        "rows": [{"length": 6, "seconds": {"median": 2.0}, "checks": {"kernels": True}}],
        "kernels": [2.0],
    }
    assert list(repeated.differences(one, same)) == []
    same["rows"][0] |= {"length": 7, "checks": {"kernels": False}}
    assert list(repeated.differences(one, same)) == [
        "data.rows[0].checks.kernels: True and False",
        "data.rows[0].length: 6 and 7",
    ]


def test_without_results_the_page_is_refused(tmp_path):
    with pytest.raises(ValueError, match="run without --no-run first"):
        report.main(["--no-run", "--results", str(tmp_path), "--page", str(tmp_path / "page.md")])


def test_a_table_is_written_for_terminals_and_in_markdown_with_numbers_to_the_right():
    table = Table(
        "A table",
        ("name", "ms", "what"),
        [["a|b", "1.50", "slow"], ["c", "20.0", "fast"]],
        "a note",
    )
    assert as_text(table).splitlines() == [
        "A table",
        "",
        "name    ms  what",
        "----  ----  ----",
        "a|b   1.50  slow",
        "c     20.0  fast",
        "a note",
    ]
    assert "| a\\|b | 1.50 | slow |" in as_markdown(table) and "|---|---:|---|" in as_markdown(
        table
    )


def test_bad_input_becomes_one_line(tmp_path):
    command = [
        sys.executable,
        "-m",
        "experiments.figure3",
        "--windows",
        "0",
        "--no-street",
        "--out",
        str(tmp_path),
    ]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 2 and done.stderr.splitlines()[-1].startswith(
        "error: no fragment has room"
    )
