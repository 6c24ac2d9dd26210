"""Commands that install what is missing: packages by name, for a clone and an index alike."""

import importlib.metadata

import pytest

from sign_model.foundation.extras import install_command

REQUIRED = [
    "jax>=0.5",
    'matplotlib>=3.8; extra == "draw"',
    "pillow>=10.1 ; extra == 'draw'",
    'srt-jax[draw,ros]; extra == "all"',
    'pyyaml; extra == "ros"',
]


def test_the_packages_of_an_extra_are_named(monkeypatch):
    monkeypatch.setattr(importlib.metadata, "requires", lambda name: REQUIRED)
    assert install_command("draw") == "pip install 'matplotlib>=3.8' 'pillow>=10.1'"
    assert install_command("all") == "pip install 'matplotlib>=3.8' 'pillow>=10.1' pyyaml"


def test_in_a_clone_that_is_not_installed_the_caller_names_them(monkeypatch):
    def absent(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "requires", absent)
    assert install_command("cli", "typer", "rich") == "pip install typer rich"


@pytest.mark.parametrize("extra", ["cli", "draw", "osm", "parquet", "envs", "all"])
def test_no_command_asks_an_index_for_this_distribution(extra):
    command = install_command(extra, "package")
    assert command.startswith("pip install ") and "srt-jax" not in command
