"""Writes docs/api/*.md from the docstrings: `python docs/make_api.py`. Reads the source, imports
nothing of it.

A test (tests/test_api_docs.py) says when the pages have fallen behind.
"""

import ast
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[1]
OUT = ROOT / "docs" / "api"
SECTIONS = ("Args", "Returns", "Raises", "Yields")


def pages() -> dict[str, str]:
    """Returns the pages by file name."""
    written = {
        "srt_jax.md": package_page(
            "srt_jax", "What users call. A leading ... stands for any batch dimensions."
        ),
        "sign_model.md": package_page("sign_model", "The symbolic level."),
        "draw.md": package_page(
            "srt_jax.draw", "`from srt_jax.draw import draw`; needs `pip install '.[draw]'`."
        ),
        "files.md": modules_page(
            "Reading and writing files",
            [name_of(path) for path in sorted((ROOT / "srt_jax" / "formats").glob("[a-z]*.py"))]
            + [
                "srt_jax.formats.task_files",
                "srt_jax.answers.results_file",
                "srt_jax.draw.webpage",
            ],
        ),
        "worlds.md": modules_page(
            "Making worlds, maps and tasks",
            [
                "srt_jax.instances.maps",
                "srt_jax.instances.generate",
                "srt_jax.instances.paper_blockers",
                "srt_jax.instances.doors",
                "srt_jax.instances.barriers",
                "srt_jax.data",
            ],
        ),
    }
    listed = "\n".join(
        f"- [{text.splitlines()[0].lstrip('# ')}]({name})" for name, text in written.items()
    )
    return {
        "README.md": (
            "# API reference\n\nMade from the docstrings by `python"
            f" docs/make_api.py`.\n\n{listed}\n"
        )
    } | written


def name_of(path: pathlib.Path) -> str:
    """Returns the dotted name of a module's file."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)


def tree_of(module: str) -> ast.Module:
    """Returns the parsed source of a module or package."""
    path = ROOT.joinpath(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(path.read_text(encoding="utf-8"))


def package_page(package: str, note: str) -> str:
    """Returns the page of a package: what its __all__ names, each from the module it comes from."""
    tree = tree_of(package)
    homes = {
        alias.asname or alias.name: (node.module, alias.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }
    names = next(
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and node.targets[0].id == "__all__"
    )
    parts = [f"# `{package}`", ast.get_docstring(tree) or "", note]
    for name in sorted(names, key=str.lower):
        module, original = homes[name]
        found = definition(tree_of(module), original)
        parts.append(
            entry(found, module) if found is not None else f"## `{name}`\n\nOf `{module}`."
        )
    return "\n\n".join(parts) + "\n"


def modules_page(title: str, modules: list[str]) -> str:
    """Returns a page of whole modules: every public function and class of each."""
    parts = [f"# {title}"]
    for module in modules:
        tree = tree_of(module)
        parts += [f"# `{module}`", ast.get_docstring(tree) or ""]
        parts += [entry(node, module) for node in tree.body if is_public(node)]
    return "\n\n".join(parts) + "\n"


def is_public(node: ast.stmt) -> bool:
    """Returns whether a statement defines a public function or class."""
    return isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")


def definition(tree: ast.Module, name: str) -> ast.FunctionDef | ast.ClassDef | None:
    """Returns where a name is defined in a module."""
    found = (
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name
    )
    return next(found, None)


def entry(node: ast.FunctionDef | ast.ClassDef, module: str) -> str:
    """Returns the section of one function or class."""
    told = docstring(ast.get_docstring(node) or "")
    if isinstance(node, ast.FunctionDef):
        return f"## `{node.name}`\n\n```text\n{signature(node)}\n```\n\n*`{module}`*\n\n{told}"
    fields = [ast.unparse(part) for part in node.body if isinstance(part, ast.AnnAssign)]
    fields += [
        ast.unparse(part) for part in node.body if isinstance(part, ast.Assign) and part.lineno
    ]
    methods = [part for part in node.body if is_public(part) and isinstance(part, ast.FunctionDef)]
    bases = ", ".join(
        ast.unparse(base) for base in node.bases if not ast.unparse(base).startswith("_")
    )
    head = f"class {node.name}({bases}):" if bases else f"class {node.name}:"
    body = "\n".join(f"    {line}" for line in fields) or "    ..."
    parts = [f"## `{node.name}`", f"```text\n{head}\n{body}\n```", f"*`{module}`*", told]
    for method in methods:
        first = (ast.get_docstring(method) or "").split("\n")[0]
        parts.append(f"- `{signature(method)}`: {first}")
    return "\n\n".join(part for part in parts if part)


def signature(node: ast.FunctionDef) -> str:
    """Returns `name(arguments) -> type`, broken into lines where it is long."""
    arguments = ast.unparse(node.args)
    returned = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    line = f"{node.name}({arguments}){returned}"
    if len(line) <= 100 or node.args.posonlyargs:
        return line
    parts = re.split(r", (?![^\[\(]*[\]\)])", arguments)
    return f"{node.name}(\n    " + ",\n    ".join(parts) + f",\n){returned}"


def docstring(text: str) -> str:
    """Returns a docstring as Markdown: its sections as lists, one item an argument."""
    lines, out = text.splitlines(), []
    in_section = False
    for line in lines:
        title = line.rstrip(":")
        if title in SECTIONS and line.endswith(":"):
            in_section = True
            out += [f"**{title}**", ""]
        elif in_section and re.match(r"  [\w*, .]+: ", line):
            name, _, told = line.strip().partition(": ")
            out.append(f"- `{name}`: {told}")
        elif in_section and line.startswith("  "):
            starts = (
                line.startswith("  ")
                and not line.startswith("    ")
                and not (out and out[-1].startswith("- "))
            )
            out.append(f"- {line.strip()}" if starts else f"  {line.strip()}")
        else:
            in_section = in_section and not line.strip()
            out.append(line)
    return "\n".join(out).strip()


def main() -> None:
    """Writes the pages, and removes those that are no longer made."""
    OUT.mkdir(exist_ok=True)
    made = pages()
    for name, text in made.items():
        (OUT / name).write_text(text, encoding="utf-8")
    for path in OUT.glob("*.md"):
        if path.name not in made:
            path.unlink()


if __name__ == "__main__":
    main()
