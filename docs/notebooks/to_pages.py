"""A hook of mkdocs: each notebook of this folder becomes a page of the site, its code as it stands.

Notebooks are kept without outputs; the tests execute them.
"""

import json
import pathlib

from mkdocs.structure.files import File, Files

FOLDER = "notebooks"


def on_files(files: Files, *, config) -> Files:
    """Adds the pages; their links to other notebooks lead to the pages of those."""
    for path in sorted(pathlib.Path(config.docs_dir, FOLDER).glob("*.ipynb")):
        place = f"{FOLDER}/{path.stem}.md"
        files.append(File.generated(config, place, content=page(path)))
    return files


def page(path: pathlib.Path) -> str:
    """Returns a notebook as Markdown."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    parts = [_part(cell["cell_type"], "".join(cell["source"])) for cell in cells]
    parts.insert(1, f"[Download this notebook]({path.name}) and run it in Jupyter.")
    return "\n\n".join(parts) + "\n"


def _part(kind: str, text: str) -> str:
    return f"```python\n{text}\n```" if kind == "code" else text.replace(".ipynb)", ".md)")
