"""Every public name is documented, with the shapes of its arrays, and its example runs."""

import ast
import doctest
import importlib
import inspect
import itertools
import pathlib
import re

import jax
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGES = (
    "srt_jax",
    "sign_model",
    "srt_jax.coalition",
    "srt_jax.envs",
    "srt_jax.dataset",
    "srt_jax.draw",
)
NEEDS = {"srt_jax.draw": "matplotlib", "srt_jax.scene_problem": "unified_planning"}
NAMES = [
    pytest.param(package, name, id=f"{package}.{name}")
    for package in PACKAGES
    for name in importlib.import_module(package).__all__
]


def public(package, name):
    """Returns a public object; the packages of drawings need matplotlib."""
    return getattr(importlib.import_module(package), name)


def is_constant(thing):
    return isinstance(thing, int | str) and not isinstance(thing, type)


def docstring(package, name):
    """Returns the docstring of a public name; of a constant the string below its assignment."""
    thing = public(package, name)
    if not is_constant(thing):
        return inspect.getdoc(thing) or ""
    for path in ROOT.joinpath(*package.split(".")).glob("*.py"):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for statement, following in itertools.pairwise(body):
            if (
                isinstance(statement, ast.Assign)
                and ast.unparse(statement.targets[0]) == name
                and isinstance(following, ast.Expr)
            ):
                return inspect.cleandoc(ast.literal_eval(following.value))
    return ""


def definition(thing):
    """Returns the parsed definition of a function or a class."""
    path = pathlib.Path(inspect.getsourcefile(inspect.unwrap(thing)))
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return next(node for node in tree.body if getattr(node, "name", None) == thing.__name__)


def arrays(thing):
    """Returns the parameters of a function, or the fields of a record, that are annotated as
    arrays.
    """
    node = definition(thing)
    if isinstance(node, ast.ClassDef):
        parts = [part for part in node.body if isinstance(part, ast.AnnAssign)]
        annotated = [(ast.unparse(part.target), part.annotation) for part in parts]
    else:
        given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        annotated = [(part.arg, part.annotation) for part in given]
    return [
        name
        for name, annotation in annotated
        if annotation is not None and re.search(r"Array\b|ndarray", ast.unparse(annotation))
    ]


def described(text):
    """Returns {name: description} of the items of a docstring's sections."""
    items, names = {}, []
    for line in text.split("Examples:")[0].splitlines():
        item = re.match(r" +((?:\w+, )*\w+): (.*)", line)
        names = item[1].split(", ") if item else names
        for name in names:
            items[name] = f"{items.get(name, '')} {item[2] if item else line.strip()}"
    return items


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_every_public_name_has_a_docstring(package, name):
    assert len(docstring(package, name)) > 20


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_the_docstring_names_every_array_with_its_shape(package, name):
    thing = public(package, name)
    if is_constant(thing):
        return
    items = described(docstring(package, name))
    missing = [
        field for field in arrays(thing) if not re.search(r"\[.*\]|a number", items.get(field, ""))
    ]
    assert missing == []


@pytest.mark.parametrize(("package", "name"), NAMES)
def test_the_example_runs_as_written(package, name):
    for needed in (NEEDS.get(package), NEEDS.get(f"{package}.{name}")):
        if needed is not None:
            pytest.importorskip(needed)
    thing = public(package, name)
    if is_constant(thing):
        return
    example = doctest.DocTestParser().get_doctest(docstring(package, name), {}, name, None, 0)
    assert example.examples
    runner, output = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE), []
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        runner.run(example, out=output.append)
    assert runner.failures == 0, "".join(output)
