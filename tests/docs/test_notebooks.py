"""The notebooks hold no outputs, are code that a reader can run, and run from top to bottom."""

import ast
import importlib.util
import json
import os
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs_and_names_what_it_uses(path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    tree = ast.parse("\n".join("".join(cell["source"]) for cell in code))
    for node in ast.walk(tree):  # every name it imports is there
        if isinstance(node, ast.ImportFrom) and node.module.startswith("srt_jax"):
            if node.module == "srt_jax.draw":
                pytest.importorskip("matplotlib")
            module = importlib.import_module(node.module)
            for alias in node.names:
                assert hasattr(module, alias.name), f"{node.module}.{alias.name}"


def test_the_site_makes_a_page_of_a_notebook(tmp_path):
    pytest.importorskip("mkdocs")
    place = ROOT / "docs" / "notebooks" / "to_pages.py"
    spec = importlib.util.spec_from_file_location("to_pages", place)
    assert spec and spec.loader
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    for path in NOTEBOOKS:
        page = hook.page(path)
        assert page.startswith("# ") and f"]({path.name})" in page and "```python\n" in page
        assert page.count("```") % 2 == 0


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_from_top_to_bottom(path, tmp_path, monkeypatch):
    client = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, paths)))
    notebook = nbformat.read(path, as_version=4)
    runner = client.NotebookClient(
        notebook,
        timeout=600,
        kernel_name="python3",
        resources={"metadata": {"path": str(tmp_path)}},
    )
    runner.execute()
    outputs = [out for cell in notebook.cells for out in cell.get("outputs", [])]
    assert any(out.output_type == "stream" for out in outputs)
    if path.stem != "policy":
        assert any("image/png" in out.get("data", {}) for out in outputs)
