"""The web page of a run: whole in one file, safe whatever the names, and its filters work in a real
browser.
"""

import html
import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from srt_jax import make_task, solve_many
from srt_jax.answers.results_file import as_record
from srt_jax.cli import run
from srt_jax.draw.webpage import write_page
from srt_jax.task import NamedTask

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
NASTY = "</script><script>document.title='broken'</script><b>&amp;"


@pytest.fixture(scope="module")
def answered():
    labels = np.full((12, 16), -1, np.int32)
    labels[:, 8] = 0
    open_way = np.where(np.arange(12)[:, None] == 11, -1, labels)
    tasks = [
        NamedTask("wall", make_task(labels, (0, 0), (6, 15))),
        NamedTask("indestructible", make_task(labels, (0, 0), (6, 15), destroyable=False)),
        NamedTask(NASTY, make_task(open_way, (0, 0), (6, 15))),
        NamedTask("another wall", make_task(labels, (5, 0), (5, 15), removal_cost=2.5)),
        NamedTask("inside", make_task(labels, (0, 8), (6, 15))),
    ]
    solutions = solve_many([named.task for named in tasks])
    return (
        tasks,
        solutions,
        [as_record(name, task, solution) for (name, task), solution in zip(tasks, solutions)],
    )


def test_the_page_holds_everything_and_asks_no_network(answered, tmp_path):
    write_page(tmp_path / "run.html", *answered, seconds=1.5)
    text = (tmp_path / "run.html").read_text()
    assert "default-src 'none'" in text and not re.search(r"(src|href)=[\"']?(http|//)", text)
    data = json.loads(re.search(r'<script id="data"[^>]*>(.*?)</script>', text, flags=re.DOTALL)[1])
    assert [task["name"] for task in data["tasks"]] == [
        "wall",
        "indestructible",
        NASTY,
        "another wall",
        "inside",
    ]
    assert (
        all(task["picture"] and task["explanation"] for task in data["tasks"])
        and data["notice"] == ""
    )
    assert len(text) < 40_000


def test_pictures_are_limited_and_the_page_says_so(answered, tmp_path):
    write_page(tmp_path / "run.html", *answered, most_pictures=2)
    data = json.loads(
        re.search(
            r'<script id="data"[^>]*>(.*?)</script>', (tmp_path / "run.html").read_text(), re.DOTALL
        )[1]
    )
    assert ["picture" in task for task in data["tasks"]] == [True, True, False, False, False]
    assert "first 2 of 5" in data["notice"]


def test_five_hundred_tasks_of_a_real_size_stay_light(answered, tmp_path):
    rng = np.random.default_rng(0)
    free = rng.random((400, 400)) > 0.3  # noise, the hardest to compress
    task = make_task(np.where(free, -1, 0).astype(np.int32), (0, 0), (399, 399))
    _, solutions, records = answered
    solution = solutions[0].replace(contour=np.zeros((400, 400), bool))
    page = tmp_path / "run.html"
    write_page(page, [NamedTask("noise", task)] * 3, [solution] * 3, [records[0]] * 3)
    assert page.stat().st_size / 3 * 500 < 25e6


def in_browser(page, script):
    """Runs a script in the page once it has loaded, and returns what it leaves in `window.page`."""
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if browser is None:
        pytest.skip("no Chromium on this machine")
    ask = (
        f"<script>{{ {script} }} document.body.dataset.page = JSON.stringify(window.page)</script>"
    )
    tried = page.with_name("tried.html")
    tried.write_text(page.read_text().replace("</body>", ask + "</body>"))
    options = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
    ]
    options += [
        "--disable-component-update",
        "--disable-sync",
        "--disable-quic",
        f"--user-data-dir={page.parent / 'profile'}",
    ]
    done = subprocess.run(
        [browser, *options, "--dump-dom", tried.as_uri()],
        capture_output=True,
        text=True,
        timeout=120,
    )
    return json.loads(html.unescape(re.search(r'data-page="([^"]*)"', done.stdout)[1]))


SCRIPT = """
const all = selector => [...document.querySelectorAll(selector)];
const names = () => all("tr.task td.name").map(cell => cell.textContent);
const press = text => all("button").find(button => button.textContent.startsWith(text)).click();
const page = {title: document.title, first: names(), images: all("td img").length};
press("SOLVED"); page.solved = names();
page.pressed = all("button[aria-pressed=true]").map(one => one.textContent);
press("START_BLOCKED"); page.blocked = names();
page.count = document.getElementById("count").textContent;
press("all"); press("removal cost"); page.rising = names();
press("removal cost"); page.falling = names();
page.sorted = all("th[aria-sort=descending]").map(one => one.textContent);
const find = document.getElementById("find");
find.value = "cost 2.5"; find.dispatchEvent(new Event("input")); page.found = names();
find.value = "nothing like this"; find.dispatchEvent(new Event("input")); page.none = names();
find.value = ""; find.dispatchEvent(new Event("input")); press("task");
all("tr.task")[1].click(); page.opened = all("tr.more").map(row => row.textContent.slice(0, 40));
page.natural = all("tr.more img").length;
all("tr.task")[1].dispatchEvent(new KeyboardEvent("keydown", {key: "Enter"}));
page.closed = all("tr.more").length;
window.page = page;
"""


def test_filters_sorting_search_and_details_work_in_a_real_browser(answered, tmp_path):
    write_page(tmp_path / "run.html", *answered, seconds=1.5)
    page = in_browser(tmp_path / "run.html", SCRIPT)
    assert page["title"] == "srt-jax: a run" and page["images"] == 5
    assert page["first"] == ["wall", "indestructible", NASTY, "another wall", "inside"]
    assert page["solved"] == ["wall", "another wall"] and page["pressed"] == ["SOLVED (2)"]
    assert page["blocked"] == ["inside"] and page["count"] == "1 of 5 tasks"
    assert page["rising"] == [NASTY, "wall", "another wall", "indestructible", "inside"]
    assert page["falling"][:2] == ["another wall", "wall"] and page["sorted"] == ["removal cost ▼"]
    assert page["found"] == ["another wall"] and page["none"] == []
    assert (
        len(page["opened"]) == 1
        and page["opened"][0].startswith("The goal")
        and page["natural"] == 1
    )
    assert page["closed"] == 0


def test_solve_writes_the_page_and_refuses_other_names_before_solving(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "walled.map").write_text("type octile\nheight 2\nwidth 4\nmap\n..@.\n..@.\n")
    solve = ["solve", "walled.map", "--start", "0,0", "--goal", "1,3", "--report"]
    assert run([*solve, "run.html"]) == 0 and "Wrote run.html" in capsys.readouterr().out
    assert "walled" in (tmp_path / "run.html").read_text()
    for wrong in ("run.pdf", "nowhere/run.html"):
        assert run([*solve, wrong]) == 2
        assert capsys.readouterr().err.count("\n") == 1
