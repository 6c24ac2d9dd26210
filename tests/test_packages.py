"""What users install: the packages build, pass the index's check, work in a new environment without
any extra but the command line, and the source's tests run after unpacking. Needs an index for
setuptools and for what the package depends on.
"""

import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile

import pytest

import srt_jax

ROOT = pathlib.Path(__file__).resolve().parents[1]


def test_the_package_shows_its_parts():
    shown = dir(srt_jax)
    for part in ("envs", "dataset", "draw", "formats", "instances", "coalition", "data"):
        assert part in shown and getattr(srt_jax, part).__name__ == f"srt_jax.{part}"
    assert not {"importlib", "sys", "TYPE_CHECKING"} & set(shown)


def test_one_import_is_enough_for_every_module_that_the_pages_name():
    """In a new process: here other tests have imported them."""
    asked = """
import srt_jax, sign_model
srt_jax.formats.ros_map.read_ros_map, srt_jax.formats.outlines.geometry.place_of
srt_jax.instances.generate.generate, srt_jax.answers.results_file.read_results
srt_jax.geometry.projection, srt_jax.draw.webpage, srt_jax.robots.inflate
sign_model.blocks.random_blocks_tasks, sign_model.signs.sign.sequence
sign_model.relocation.domain, sign_model.space.fuzzy_table
assert {"reading", "writing", "ros_map"} <= set(dir(srt_jax.formats))
assert {"plan", "Memory", "blocks"} <= set(dir(sign_model))
for package in (srt_jax.formats, sign_model):
    try:
        package.nosuch
    except AttributeError as error:
        assert str(error) == f"module '{package.__name__}' has no attribute 'nosuch'"
    else:
        raise AssertionError
"""
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("repository", [None, "https://example.org/srt"])
def test_the_page_of_the_index_links_to_no_file(repository):
    spec = importlib.util.spec_from_file_location("setup_of_srt", ROOT / "setup.py")
    setup = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(setup)
    readme = (ROOT / "README.md").read_text()
    page = setup.for_index(readme, repository)
    links = re.findall(r"\]\(([^)]*)\)", page)
    assert all(link.startswith("https://") for link in links) and len(links) > 0
    assert ("![" in page) == ("*A goal cut off" in page) == (repository is not None)
    if repository:
        assert f"({repository}/blob/main/docs/results.md)" in page
        assert len(links) == len(re.findall(r"\]\(", readme))


def run(*command, **options):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [str(word) for word in command],
        capture_output=True,
        text=True,
        env=environment | {"JAX_PLATFORMS": "cpu"},
        **options,
    )
    assert done.returncode == 0, f"{command}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    pytest.importorskip("build")
    source = tmp_path_factory.mktemp("source") / "srt_jax"  # building leaves folders behind
    keep = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "*.egg-info", "results")
    shutil.copytree(ROOT, source, ignore=keep)
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--outdir", out, source)
    (wheel,), (sdist,) = out.glob("*.whl"), out.glob("*.tar.gz")
    return wheel, sdist


@pytest.mark.slow
def test_the_packages_hold_what_they_should_and_pass_the_check_of_the_index(built):
    wheel, sdist = built
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {"srt_jax", "sign_model"}
    assert {"srt_jax/py.typed", "srt_jax/data/page.html"} <= set(names)
    with tarfile.open(sdist) as archive:
        inside = {pathlib.PurePath(name).parts[1] for name in archive.getnames() if "/" in name}
        page = archive.extractfile(f"{archive.getnames()[0]}/PKG-INFO").read().decode()
    assert {"tests", "docs", "experiments", "README.md", "CITATION.cff", "LICENSE"} <= inside
    assert "text/markdown" in page and "smart relocation task" in page and "](docs/" not in page
    pytest.importorskip("twine")
    run(sys.executable, "-m", "twine", "check", "--strict", wheel, sdist)


@pytest.mark.slow
def test_the_demo_runs_in_a_new_environment_without_matplotlib(built, tmp_path):
    venv.create(tmp_path / "new", with_pip=True)
    folder = tmp_path / "new" / ("Scripts" if os.name == "nt" else "bin")
    run(folder / "python", "-m", "pip", "install", "-q", f"{built[0]}[cli]")
    done = run(folder / "srt-jax", "demo", "--pairs", "1", "--out", tmp_path / "demo", cwd=tmp_path)
    assert "5 SOLVED; every answer replayed" in done.stdout and "bagel-100" in done.stdout
    assert "no pictures" in done.stderr and "pip install 'matplotlib" in done.stderr
    assert {path.name for path in (tmp_path / "demo").iterdir()} == {
        "results.json",
        "table.md",
        "tasks.npz",
    }


@pytest.mark.slow
def test_the_tests_of_the_source_run_after_unpacking(built, tmp_path):
    with tarfile.open(built[1]) as archive:
        archive.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    some = ["tests/test_architecture.py", "tests/test_moves.py", "tests/formats/test_movingai.py"]
    pages = ["tests/docs/test_site.py", "tests/docs/test_readme.py"]
    run(
        sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider",
        *some, *pages, cwd=unpacked,
    )  # fmt: skip
