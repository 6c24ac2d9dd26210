"""The documentation site names everything that is public, and builds without a warning."""

import importlib
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "docs" / "reference"
PAGES = {
    "srt_jax": "srt_jax.md",
    "sign_model": "sign_model.md",
    "srt_jax.coalition": "coalition.md",
    "srt_jax.envs": "envs.md",
    "srt_jax.dataset": "dataset.md",
    "srt_jax.draw": "draw.md",
}


def directives(page):
    """Returns what a page takes from the docstrings: dotted names."""
    return re.findall(r"^::: ([\w.]+)$", (REFERENCE / page).read_text(), flags=re.MULTILINE)


def modules_in(folder):
    """Returns the public modules of a folder, dotted, those of its subfolders included."""
    paths = sorted((ROOT / folder).rglob("[a-z]*.py"))
    return {".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths}


@pytest.mark.parametrize(("package", "page"), PAGES.items())
def test_the_reference_has_an_entry_for_every_public_name(package, page):
    named = {name.rpartition(".")[2] for name in directives(page)}
    assert [name for name in importlib.import_module(package).__all__ if name not in named] == []


def test_the_reference_has_an_entry_for_every_module_of_formats_and_instances():
    helpers = {"json_text", "xml_text", "opposite_cells"}  # parts of readers, of no use alone
    formats = {
        name for name in modules_in("srt_jax/formats") if name.rpartition(".")[2] not in helpers
    }
    assert formats - set(directives("formats.md")) == set()
    assert modules_in("srt_jax/instances") - set(directives("instances.md")) == set()


def test_the_menu_lists_every_page():
    menu = set(re.findall(r": ([\w/]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE))
    pages = {str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")}
    pages |= {f"notebooks/{path.stem}.md" for path in (ROOT / "docs" / "notebooks").glob("*.ipynb")}
    assert menu == pages


@pytest.mark.slow
def test_the_site_builds_without_a_warning_and_holds_every_public_name(tmp_path):
    pytest.importorskip("mkdocs")
    pytest.importorskip("mkdocstrings")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    for package, page in PAGES.items():
        text = (tmp_path / "reference" / page.removesuffix(".md") / "index.html").read_text()
        entries = set(re.findall(r'id="[\w.]*?(\w+)"', text))
        public = importlib.import_module(package).__all__
        assert [name for name in public if name not in entries] == []
