"""Imports run one way; judges share nothing with what they judge; the core loads nothing but
jax, numpy and chex.
"""

import ast
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]

# From the ground up; a module may import from lower layers and from its own.
LAYERS = (
    ("types", "notes"),
    ("moves", "shapes", "fixed_point", "cores", "devices"),
    ("kernel", "packing", "bucketed", "components"),
    ("target",),
    ("cones", "frontier", "wavefront", "wordqueue"),
    ("traversal",),
    ("tree",),
    ("gradient",),
    ("reach", "distance", "path", "corridor", "seed", "contour"),
    ("objects", "task", "rings", "scanlines", "world", "place", "raster"),
    ("openings", "sums"),
    ("planner", "route", "prices", "acts", "symbols"),
    ("removal", "greedy", "proof"),
    ("solver",),
    ("many", "whatif", "least", "soft"),
    ("explanation",),
    (
        "explain",
        "story",
        "maps",
        "blockage",
        "doors",
        "barriers",
        "generate",
        "data",
        "formats",
        "draw",
        "ends",
    ),
    ("envs", "dataset_labels", "dataset_shards", "dataset"),
    ("sources", "targets", "inputs", "results", "console"),
    ("webpage",),
    ("demo", "scenario", "bench"),
    ("commands",),
    ("cli",),
    ("__main__", "__init__"),
)
JUDGES = ("check", "reference")


def modules(package):
    return sorted(path for path in (ROOT / package).rglob("*.py"))


def part_of(path):
    """The module, or the sub-package, directly below the package: `formats/npz.py` -> `formats`."""
    return path.relative_to(ROOT).parts[1].removesuffix(".py")


def imports_of(path):
    """Every module imported anywhere in a file, with its line."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            yield node.module, node.lineno
            if node.module in ("srt_jax", "sign_model"):
                yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


def test_every_module_has_a_layer():
    known = {name for layer in LAYERS for name in layer} | set(JUDGES)
    assert {part_of(path) for path in modules("srt_jax")} <= known


def test_imports_run_from_high_layers_to_low_ones():
    height = {name: level for level, layer in enumerate(LAYERS) for name in layer}
    wrong = []
    for path in modules("srt_jax"):
        here = height.get(part_of(path))
        for name, line in imports_of(path):
            there = height.get(name.split(".")[1]) if name.startswith("srt_jax.") else None
            if here is not None and there is not None and there > here:
                wrong.append(f"{path.name}:{line} imports {name}")
    assert not wrong


def test_judges_import_nothing_of_ours_but_types():
    wrong = []
    for path in modules("srt_jax"):
        if part_of(path) in JUDGES:
            allowed = ("srt_jax.types", f"srt_jax.{part_of(path)}")
            ours = [
                (name, line)
                for name, line in imports_of(path)
                if name.split(".")[0] in ("srt_jax", "sign_model")
            ]
            wrong += [
                f"{path.name}:{line} imports {name}"
                for name, line in ours
                if not name.startswith(allowed)
            ]
    assert not wrong


def test_the_symbolic_level_never_imports_the_grid_level():
    wrong = [
        f"{path.name}:{line}"
        for path in modules("sign_model")
        for name, line in imports_of(path)
        if name.startswith("srt_jax")
    ]
    assert not wrong


def test_one_gate_joins_both_levels():
    users = {
        part_of(path)
        for path in modules("srt_jax")
        for name, _ in imports_of(path)
        if name.startswith("sign_model")
    }
    assert users <= {"symbols", "commands", "bench", "draw"}


@pytest.mark.parametrize("package", ["srt_jax", "sign_model"])
def test_importing_loads_no_more_than_jax_numpy_and_chex_do(package):
    code = "import sys; {}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"

    def loaded(imports):
        done = subprocess.run(
            [sys.executable, "-c", code.format(imports)],
            capture_output=True,
            text=True,
            check=True,
            cwd=ROOT,
        )
        return set(done.stdout.split())

    extra = (
        loaded(f"import {package}")
        - loaded("import jax, numpy, chex, jax.numpy, jax.experimental")
        - set(sys.stdlib_module_names)
    )
    assert extra <= {package, "sign_model"}
