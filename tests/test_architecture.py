"""Imports run one way; judges share nothing with what they judge; the core loads nothing but jax,
numpy and chex.
"""

import ast
import collections
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[1]

# From the lowest up: a folder or a top module may import from lower floors and from itself.
FLOORS = {
    "srt_jax": (
        ("types", "components"),
        ("moves", "engine"),
        ("task", "obstacles", "padding", "propagation", "symbols"),
        ("gradients", "instances"),
        ("paths", "geometry", "data", "robots", "connecting"),
        ("removal", "formats", "scale"),
        ("tolls",),
        ("solver_kernel",),
        ("solver",),
        ("coalition",),
        ("draw",),
        ("many_tasks", "removal_gradient", "total_gradient", "tradeoffs", "answers", "envs"),
        ("dataset",),
        ("bench",),
        ("commands",),
        ("cli",),
        ("__main__", "__init__"),
    ),
    "sign_model": (
        ("foundation",),
        ("bits", "result", "clock"),
        ("pddl",),
        ("forward_search", "signs"),
        ("map_algorithm", "space", "description"),
        ("relocation", "strategies"),
        ("plan_task", "views"),
        ("map_batch",),
        ("experience", "blocks", "up_engine"),
        ("__init__",),
    ),
}
JUDGES = ("check", "reference")


def modules(package):
    return sorted(path for path in (ROOT / package).rglob("*.py"))


def part_of(path):
    """The module, or the sub-package, directly below the package: `formats/osm.py` -> `formats`."""
    return path.relative_to(ROOT).parts[1].removesuffix(".py")


def imports_of(path):
    """Every module imported anywhere in a file, with its line."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            for alias in node.names:
                inner = f"{node.module}.{alias.name}"
                yield (inner if is_module(inner) else node.module), node.lineno


def is_module(name):
    path = ROOT.joinpath(*name.split("."))
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def names(package):
    """Every module of a package by its dotted name, with its file."""
    dotted = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in modules(package)
    }
    return {name.removesuffix(".__init__"): path for name, path in dotted.items()}


@pytest.mark.parametrize("package", FLOORS)
def test_every_folder_and_top_module_has_a_floor(package):
    known = {name for floor in FLOORS[package] for name in floor} | set(JUDGES)
    assert {part_of(path) for path in modules(package)} <= known


@pytest.mark.parametrize("package", FLOORS)
def test_imports_run_from_high_floors_to_low_ones(package):
    height = {name: level for level, floor in enumerate(FLOORS[package]) for name in floor}
    wrong = []
    for path in modules(package):
        here = height.get(part_of(path))
        for name, line in imports_of(path):
            there = height.get(name.split(".")[1]) if name.startswith(f"{package}.") else None
            if here is not None and there is not None and there > here:
                wrong.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
    assert not wrong


@pytest.mark.parametrize("package", FLOORS)
def test_no_import_circle_joins_two_modules(package):
    files = names(package)
    below = {
        name: {there for there, _ in imports_of(path) if there in files} - {name, package}
        for name, path in files.items()
    }
    settled = set()
    while ready := {
        name for name, needed in below.items() if name not in settled and needed <= settled
    }:
        settled |= ready
    assert set(files) - settled == set()


@pytest.mark.parametrize("package", FLOORS)
def test_no_folder_holds_more_modules_than_a_reader_can_overlook(package):
    held = collections.Counter(path.parent for path in modules(package))
    assert {
        str(folder.relative_to(ROOT)): count for folder, count in held.items() if count > 20
    } == {}


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
        if name.startswith("sign_model") and not name.startswith("sign_model.foundation")
    }
    assert users <= {"symbols", "commands", "bench", "draw"}


def test_the_shared_foundation_stands_on_nothing_of_ours():
    wrong = [
        f"{path.name}:{line} imports {name}"
        for path in modules("sign_model/foundation")
        for name, line in imports_of(path)
        if name.split(".")[0] in ("srt_jax", "sign_model")
        and not name.startswith("sign_model.foundation")
    ]
    assert not wrong


def test_importing_the_shared_foundation_loads_little_of_the_symbolic_level():
    code = (
        "import sys, sign_model.foundation.marks, sign_model.foundation.core_count;"
        " print(*(m for m in sys.modules if 'sign_model' in m))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert all(
        name in ("sign_model", "sign_model.foundation") or name.startswith("sign_model.foundation.")
        for name in done.stdout.split()
    )


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


_IMPORT_ALL = """
import importlib, sys, jax
before = dict(jax.config.values)
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except ImportError as error:  # an extra that is not installed, such as jumanji
        if "pip install " not in str(error):
            raise
print({key for key, value in jax.config.values.items() if value != before.get(key)})
"""


def test_importing_changes_no_setting_of_jax():
    files = [path for name in ("srt_jax", "sign_model", "experiments") for path in modules(name)]
    parts = [path.relative_to(ROOT).with_suffix("").parts for path in files]
    names = [".".join(part) for part in parts if part[-1] not in ("__init__", "__main__")]
    done = subprocess.run(
        [sys.executable, "-c", _IMPORT_ALL, *names],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert done.stdout.strip() == "set()"
