"""The API reference is what the docstrings say now."""

import importlib.util
import pathlib

import pytest

import sign_model
import srt_jax

DOCS = pathlib.Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def pages():
    spec = importlib.util.spec_from_file_location("make_api", DOCS / "make_api.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.pages()


def test_the_pages_are_those_that_the_docstrings_make(pages):
    kept = {path.name: path.read_text() for path in (DOCS / "api").glob("*.md")}
    stale = sorted(name for name in kept.keys() | pages.keys() if kept.get(name) != pages.get(name))
    assert not stale, "run: python docs/make_api.py"


@pytest.mark.parametrize("package", [srt_jax, sign_model])
def test_every_public_name_has_its_section(package, pages):
    text = pages[f"{package.__name__}.md"]
    assert [name for name in package.__all__ if f"\n## `{name}`\n" not in text] == []


def test_arguments_and_errors_are_lists(pages):
    assert (
        "**Args**\n\n- `free`: bool [..., H, W], True where the agent fits.\n"
        in pages["srt_jax.md"]
    )
    assert "**Raises**\n\n- `TypeError, ValueError`: " in pages["srt_jax.md"]
