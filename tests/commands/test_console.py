"""Progress, tables that fit, help, and completion in a real shell."""

import io
import os
import pathlib
import shutil
import subprocess
import sys
import time

import pytest
from rich.console import Console

from srt_jax.cli import app, run
from srt_jax.commands.shared import console

ROOT = pathlib.Path(__file__).resolve().parents[2]
COLUMNS = (
    ("task", 0),
    ("status", 0),
    ("blocked by", 2),
    ("destroyed", 2),
    ("route", 1),
    ("cost / bound", 3),
    ("contour", 4),
)
ROWS = [
    [
        "noise-in-parts-0012",
        "START_BLOCKED",
        "1 2 3 4 5 6 +20",
        "1 2 3 4 5 6 +2",
        "1234.56",
        "12.5 / 12.5",
        "1030",
    ]
] * 3


@pytest.mark.parametrize("width", [40, 60, 80, 100, 160])
def test_a_table_is_never_wider_than_the_terminal_nor_breaks_a_line(width):
    text = io.StringIO()
    Console(file=text, width=width, color_system=None).print(
        console.fit_table(COLUMNS, ROWS, width)
    )
    lines = text.getvalue().splitlines()
    assert len(lines) == 4 and max(map(len, lines)) <= width
    assert "task" in lines[0] and "status" in lines[0]
    assert ("contour" in lines[0]) == (width >= 100)
    assert ("1234.56" in lines[1]) == (width >= 60)
    if width >= 60:
        assert "START_BLOCKED" in lines[1]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def shown(monkeypatch, patience, work, quiet=False):
    """What a terminal gets to see while `work` runs."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(console, "_PATIENCE", patience)
    monkeypatch.setenv("TERM", "xterm")
    with console.show_progress("solving", 10, quiet=quiet, compiles=True) as progress:
        work(progress)
    return terminal.getvalue()


def test_long_work_shows_rate_and_time_left_and_before_its_first_step_is_done(monkeypatch):
    def slowly(progress):
        time.sleep(0.3)
        progress(4)
        time.sleep(0.3)

    seen = shown(monkeypatch, 0.05, slowly)
    assert "0/10" in seen and "4/10" in seen and "/s" in seen and "left 0:00:0" in seen
    assert "solving (compiling first)" in seen.split("4/10")[0]
    assert "compiling" not in seen[seen.rindex("solving") :]


def test_short_or_quiet_work_shows_nothing(monkeypatch):
    assert shown(monkeypatch, 30, lambda progress: progress(10)) == ""
    assert shown(monkeypatch, 0, lambda progress: time.sleep(0.1), quiet=True) == ""


def test_quiet_leaves_results_and_errors(monkeypatch, capsys, tmp_path):
    (tmp_path / "d.pddl").write_text(
        "(define (domain d) (:predicates (p ?x)) (:action a :parameters (?x) :effect (p ?x)))"
    )
    (tmp_path / "p.pddl").write_text(
        "(define (problem t) (:domain d) (:objects o) (:init) (:goal (p o)))"
    )
    files = [str(tmp_path / "d.pddl"), str(tmp_path / "p.pddl")]
    assert run(["plan", *files]) == 0
    assert "expansions" in capsys.readouterr().err
    assert run(["plan", *files, "--quiet"]) == 0
    assert capsys.readouterr() == ("(a o)\n", "")
    assert run(["--quiet", "plan", "no.pddl", files[1]]) == 2
    assert "no.pddl: no such file" in capsys.readouterr().err


def test_an_error_in_the_work_takes_the_bar_down(monkeypatch):
    def fails(progress):
        time.sleep(0.2)
        raise ValueError("broken")

    with pytest.raises(ValueError, match="broken"):
        shown(monkeypatch, 0.01, fails)


@pytest.mark.parametrize(
    "command", [None, *(command.callback.__name__ for command in app.registered_commands)]
)
def test_help_fits_eighty_columns_and_gives_examples_that_are_commands(
    command, capsys, monkeypatch
):
    monkeypatch.setenv("COLUMNS", "80")
    assert run([*([command] if command else []), "--help"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    examples = [line.split() for line in out.splitlines() if line.strip().startswith("srt-jax ")]
    assert examples and all(example[1] == command for example in examples if command)


def test_no_command_at_all_prints_the_help_and_no_error(capsys):
    assert run([]) == 2
    out, err = capsys.readouterr()
    assert "Commands" in out and err == ""


def test_the_version_is_printed(capsys):
    assert run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("srt-jax 0.")


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        (["sol"], {"solve"}),
        (["draw", "--sh"], {"--show"}),
        (["draw", "--show", ""], {"pictures", "sheet", "loop", "wave"}),
        (["solve", "--re"], {"--repair", "--report"}),
    ],
)
def test_bash_completes_commands_options_and_values(typed, offered, tmp_path):
    """The script that the command prints is sourced by a real bash, and asked as bash asks on the
    tab key.
    """
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("no bash on this machine")
    command = tmp_path / "srt-jax"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m srt_jax "$@"\n')
    command.chmod(0o755)
    words = " ".join(f"'{word}'" for word in ["srt-jax", *typed])
    script = (
        f'eval "$(srt-jax --show-completion bash)"; COMP_WORDS=({words}); COMP_CWORD={len(typed)};'
        ' complete -p srt-jax >/dev/null && _srt_jax_completion srt-jax; printf "%s\\n"'
        ' "${COMPREPLY[@]}"'
    )
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [bash, "-c", script], capture_output=True, text=True, env=environment, timeout=60
    )
    assert set(done.stdout.split()) >= offered, done.stderr


def test_quiet_results_do_not_say_how_long_they_took(monkeypatch):
    assert console.took(1.234) == " in 1.23 s, compiling included"
    assert console.took(1.234, compiles=False) == " in 1.23 s"
    monkeypatch.setitem(console._QUIET, "is_quiet", True)
    assert console.took(1.234) == ""
