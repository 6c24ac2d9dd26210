"""What the pages in docs/ say is what runs; what needs a package that is not there is skipped."""

import pathlib
import re

import pytest

from srt_jax import Status
from srt_jax.cli import app

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"
PAGES = sorted(path for path in DOCS.glob("*.md"))
EXAMPLES = [path for path in PAGES if path.stem != "learning"]  # it has a test of its own
BLOCKS = [
    pytest.param(block, id=f"{path.stem}-{number}")
    for path in EXAMPLES
    for number, block in enumerate(
        re.findall(r"```python\n(.*?)```", path.read_text(), flags=re.DOTALL)
    )
]


@pytest.mark.parametrize("block", BLOCKS)
def test_the_examples_run_as_written(block, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    try:
        exec(block, {})
    except ModuleNotFoundError as error:
        if error.name.split(".")[0] in ("srt_jax", "sign_model"):
            raise
        pytest.skip(f"{error.name} is not installed")


@pytest.mark.parametrize("page", ["conventions.md"])
def test_every_status_stands_with_its_meaning(page):
    rows = re.findall(
        r"^\| ([A-Z_]+) \| (\d) \| (.*?) \|", (DOCS / page).read_text(), flags=re.MULTILINE
    )
    assert rows == [(status.name, str(status.value), status.meaning) for status in Status]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_links_lead_somewhere_and_commands_exist(path):
    text = path.read_text()
    for link in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
        place = path.parent / link
        if place.parent.name == "notebooks":  # the site makes a page of each
            place = place.with_suffix(".ipynb")
        assert place.exists(), link
    there = {command.callback.__name__ for command in app.registered_commands}
    for command in re.findall(r"^srt-jax (\w+)", text, flags=re.MULTILINE):
        assert command in there
