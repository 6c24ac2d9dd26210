"""What needs no JAX does not wait for it: `plan`, help, version; and names stay what they are
however they are loaded.
"""

import inspect
import json
import pathlib
import subprocess
import sys

import pytest
from typer.main import get_command

from srt_jax import __main__, cli
from srt_jax.commands import plan as command
from srt_jax.commands import short_plan
from srt_jax.commands.shared import interrupts

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOMAIN = """(define (domain d) (:predicates (p ?x) (q ?x))
 (:action a :parameters (?x) :precondition (p ?x) :effect (q ?x)))"""
PROBLEM = "(define (problem t) (:domain d) (:objects o) (:init (p o)) (:goal (q o)))"


def loaded_by(arguments, folder):
    """The top-level modules that a run of the command line has loaded at its end."""
    code = (
        "import sys, atexit; sys.argv = ['srt-jax', *{!r}];atexit.register(lambda:"
        " print(*{{n.split('.')[0] for n in sys.modules}}, file=open('loaded', 'w')));from"
        " srt_jax.__main__ import main; main()"
    )
    ran = subprocess.run(
        [sys.executable, "-c", code.format(arguments)],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(folder)},
        capture_output=True,
        text=True,
    )
    return ran, set((folder / "loaded").read_text().split())


def test_planning_loads_neither_jax_nor_the_parser_of_the_command_line(tmp_path):
    (tmp_path / "d.pddl").write_text(DOMAIN)
    (tmp_path / "p.pddl").write_text(PROBLEM)
    for planner in ("map", "astar", "wastar", "gbfs"):
        ran, modules = loaded_by(["plan", "d.pddl", "p.pddl", "--planner", planner], tmp_path)
        assert (ran.returncode, ran.stdout) == (0, "(a o)\n"), ran.stderr
        assert "numpy" in modules and not modules & {"jax", "jaxlib", "chex", "typer", "rich"}


@pytest.mark.parametrize(
    "arguments", [["--version"], ["--help"], ["plan", "--help"], ["nosuch"], []]
)
def test_help_and_version_load_no_jax(arguments, tmp_path):
    ran, modules = loaded_by(arguments, tmp_path)
    assert ran.returncode == (0 if arguments and arguments != ["nosuch"] else 2)
    assert not modules & {"jax", "jaxlib", "chex", "numpy"}


def test_costs_are_told_by_every_planner_and_noted_where_they_are_not_minimised(tmp_path, capfd):
    (tmp_path / "d").write_text("""(define (domain toll) (:requirements :action-costs)
      (:predicates (a) (m) (b)) (:functions (total-cost) - number)
      (:action direct :precondition (a) :effect (and (b) (increase (total-cost) 10)))
      (:action s1 :precondition (a) :effect (and (m) (increase (total-cost) 2)))
      (:action s2 :precondition (m) :effect (and (b) (increase (total-cost) 3))))""")
    problem = "(define (problem way) (:domain toll) (:init (a)) (:goal (b)){})"
    files = [str(tmp_path / name) for name in "dp"]
    (tmp_path / "p").write_text(problem.format("(:metric minimize (total-cost))"))
    for planner, cost, is_noted in (("map", 10, True), ("astar", 5, False), ("gbfs", 10, True)):
        assert cli.run(["plan", *files, "--planner", planner]) == 0
        err = capfd.readouterr().err
        assert f"cost {cost}, " in err and ("--planner astar finds the cheapest" in err) == is_noted
    assert cli.run(["plan", *files, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["cost"] == 10
    (tmp_path / "p").write_text(problem.format(""))
    assert cli.run(["plan", *files, "--json"]) == 0
    out, err = capfd.readouterr()
    assert json.loads(out)["cost"] is None and "cost" not in err


def test_several_problems_and_swapped_files_are_told_what_to_do(tmp_path, capfd):
    (tmp_path / "d").write_text(DOMAIN)
    (tmp_path / "p").write_text(PROBLEM)
    domain, problem = (str(tmp_path / name) for name in "dp")
    assert cli.run(["plan", domain, problem, problem]) == 2
    assert "got 2 problems: call it for each, or use sign_model" in capfd.readouterr().err
    assert cli.run(["plan", problem, domain]) == 2
    assert "this is a problem; give the domain first" in capfd.readouterr().err


def test_errors_of_the_short_way_read_like_all_others(tmp_path):
    ran, _ = loaded_by(["plan", "nowhere.pddl", "p.pddl"], tmp_path)
    assert ran.returncode == 2 and ran.stdout == ""
    assert (
        ran.stderr.startswith("srt-jax: error: nowhere.pddl: no such file")
        and ran.stderr.count("\n") == 1
    )


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], []])
def test_the_list_of_commands_is_that_of_the_commands_themselves(arguments, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    cli.run(arguments)
    seen = capsys.readouterr().out
    monkeypatch.setattr(cli, "_placeholder", cli._function)
    cli.run(arguments)
    assert seen == capsys.readouterr().out and "smart relocation" in seen
    assert list(get_command(cli.app).commands) == list(cli._EXAMPLES)


def test_an_interrupt_on_the_short_way_reads_like_all_others(monkeypatch, capfd):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(interrupts._State, "is_reported", False)
    monkeypatch.setattr(short_plan, "plan_files", interrupted)
    with pytest.raises(SystemExit) as stop:
        __main__.main(["plan", "d", "p"])
    out, err = capfd.readouterr()  # the line goes past Python, to the file of standard error
    assert (stop.value.code, out) == (130, "") and err.count("\n") == 1


PLAIN = (
    "d p",
    "d p --planner gbfs",
    "d --planner astar p --json",
    "--max-expansions 7 d p --max-seconds 2.5",
    "d p --max-seconds 3 --max-seconds 0",
    "--json d --json p",
)
NOT_PLAIN = (
    "",
    "d",
    "d p q",
    "d p --planner",
    "d p --help",
    "d p --planner=gbfs",
    "d p --max-expansions 0",
    "d p --max-expansions -3",
    "d p --max-seconds 1e3",
    "d p --max-seconds nan",
    "d p --no-such",
    "-- d p",
)


@pytest.mark.parametrize("line", PLAIN)
def test_the_short_way_reads_what_the_parser_reads(line, monkeypatch):
    calls, form = [], inspect.signature(short_plan.plan_files)

    def planned(*given, **named):
        call = form.bind(*given, **named)
        call.apply_defaults()
        calls.append(call.arguments)
        return 0

    monkeypatch.setattr(short_plan, "plan_files", planned)
    monkeypatch.setattr(command, "plan_files", planned)
    short_plan.plain_call(["plan", *line.split()], {})()
    assert cli.run(["plan", *line.split()]) == 0
    assert len(calls) == 2 and calls[0] == calls[1]


@pytest.mark.parametrize("line", NOT_PLAIN)
def test_what_is_not_plain_is_left_to_the_parser(line):
    assert short_plan.plain_call(["plan", *line.split()], {}) is None


def test_a_public_function_is_never_hidden_by_the_module_of_its_name():
    code = """
import types
import srt_jax.paths.contour, srt_jax.check, srt_jax.solver, srt_jax.answers.story
import srt_jax
for name in srt_jax.__all__:
    assert not isinstance(getattr(srt_jax, name), types.ModuleType), name
assert srt_jax.types.Task is srt_jax.Task and srt_jax.solver.solve is srt_jax.solve
assert set(srt_jax.__all__) <= set(dir(srt_jax))
from srt_jax import contour
assert callable(contour)
try:
    srt_jax.nosuch
except AttributeError as error:
    assert str(error) == "module 'srt_jax' has no attribute 'nosuch'"
else:
    raise SystemExit(1)
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
