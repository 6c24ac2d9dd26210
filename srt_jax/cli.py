"""The command `srt-jax`: which commands there are, and how whatever goes wrong becomes one line and
an exit code.

A command is loaded when it is called: `plan` and the help need no JAX, which takes longer to load
than they take to run.
"""

import ast
import importlib
import importlib.util
import inspect
import os
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from srt_jax import __version__
from srt_jax.commands.shared import console, interrupts
from srt_jax.commands.shared.console import (
    BAD_INPUT,
    CRASHED,
    PIPE_CLOSED,
    error_line,
    flush_output,
    silence_output,
)


def examples(*lines: str) -> str:
    """Returns the end of a command's help: one example a line."""
    title = "Examples" if len(lines) > 1 else "Example"
    # \b: keep the lines apart
    always = "With every command: --quiet (results and errors only), --debug (tracebacks)."
    return "\n".join(
        ["\b", f"[bold]{title}[/bold]", *(f"  {line}" for line in lines), "", "\b", always]
    )


_EXAMPLES = {
    "demo": ("srt-jax demo", "srt-jax demo --pairs 1 --out demo --report demo.html"),
    "solve": (
        "srt-jax solve city.map --start 3,5 --goal 200,310",
        "srt-jax solve tasks.npz world.json --out answers",
        "srt-jax solve city.osm.pbf --size 500 --block half",
        "srt-jax solve map.yaml --start 20,30 --goal 90,40",
        "srt-jax solve city.map --start 3,5 --goal 200,310 --mode shortest --toll 20",
        "srt-jax solve tasks.npz --report run.html",
        "srt-jax solve tasks.npz --json > answers.json",
        "srt-jax solve big/*.scen --block half --out answers --workers 8",
    ),
    "convert": (
        "srt-jax convert city.osm.pbf city.map --size 500",
        "srt-jax convert scene.svg scene.json",
        "srt-jax convert map.yaml map.xml --start 20,30 --goal 90,40",
    ),
    "draw": (
        "srt-jax draw tasks.npz --out pictures",
        "srt-jax draw city.map --start 3,5 --goal 200,310 --out city.svg --polar",
        "srt-jax draw tasks.npz --only rooms-0003 --out loop.gif",
        "srt-jax draw tasks.npz --show sheet --out pictures",
    ),
    "tradeoffs": (
        "srt-jax tradeoffs city.map --start 3,5 --goal 200,310 --out front.png",
        "srt-jax tradeoffs tasks.npz --rows 7:8 --tolls 1,5,20 --json",
    ),
    "connect": (
        "srt-jax connect level.map --out joined.png",
        "srt-jax connect town.yaml --region 1.5m,-2m --region 8m,3m --json",
    ),
    "compare": (
        "srt-jax compare before.json after.json",
        "srt-jax compare tasks.npz --modes least,paper --json",
    ),
    "scen": (
        "srt-jax scen Berlin_0_512.map.scen --map Berlin_0_512.map",
        "srt-jax scen arena.map.scen --limit 100 --json",
    ),
    "plan": (
        "srt-jax plan domain.pddl problem.pddl > problem.plan",
        "srt-jax plan domain.pddl problem.pddl --planner astar --json",
        "srt-jax plan domain.pddl problem.pddl --experience experience.json",
    ),
    "practise": ("srt-jax practise domain.pddl p1.pddl p2.pddl p3.pddl --out experience.json",),
    "signs": (
        "srt-jax signs domain.pddl problem.pddl --sign 'action stack'",
        "srt-jax signs domain.pddl problem.pddl --trace --svg networks.svg",
    ),
    "generate": (
        "srt-jax generate mixed --count 1000 --size 64-500 --out tasks.npz",
        "srt-jax generate bagel-10 --count 8 --size 500 --out bagels.npz",
    ),
    "dataset": (
        "srt-jax dataset rooms --count 100000 --size 64 --out rooms",
        "srt-jax dataset mixed --count 5000 --size 32-64 --seed 7 --out mixed",
        "srt-jax dataset rooms --count 5000 --mode shortest --toll 20 --out break-or-not",
        "srt-jax dataset mixed --count 1000000 --size 64 --out mixed --workers 8",
    ),
    "status": ("srt-jax status mixed", "srt-jax status answers --json"),
    "bench": ("srt-jax bench kernels --quick", "srt-jax bench --json > bench.json"),
}
"""The commands in the order of the help, each with the examples that end its own."""


def _print_version(is_asked: bool) -> None:
    if is_asked:
        print(f"srt-jax {__version__}")
        raise typer.Exit


def _whole(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version and stop.", callback=_print_version, is_eager=True
        ),
    ] = False,
    debug: Annotated[
        bool,
        typer.Option(
            "--debug",
            help="With any command: print the Python traceback of an error (or SRT_JAX_DEBUG=1).",
        ),
    ] = False,
    quiet: Annotated[
        bool,
        typer.Option(
            "--quiet",
            help="With any command: no progress, notes or timings; results and errors only.",
        ),
    ] = False,
) -> None:
    """Solves smart relocation tasks: finds the way, or what blocks it, what to destroy, and the way
    then.

    Exit codes: [bold]0[/bold] all solved, [bold]1[/bold] some task cannot be solved, [bold]2[/bold]
    bad input, [bold]3[/bold] budget spent, [bold]70[/bold] anything else went wrong,
    [bold]130[/bold] interrupted, [bold]141[/bold] the reader of the output went away,
    [bold]143[/bold] terminated.
    """


def _new_app() -> typer.Typer:
    """The program without its commands."""
    app = typer.Typer(
        add_completion=True,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
        epilog=examples(
            "srt-jax demo --out demo",
            "srt-jax generate mixed --count 40 --size 64 --out tasks.npz",
            "srt-jax solve tasks.npz --out answers --report answers.html",
            "srt-jax COMMAND --help",
            "srt-jax --install-completion",
        ),
    )
    app.callback()(_whole)
    return app


def _function(name: str) -> Callable[..., int]:
    """The command called `name`."""
    return getattr(importlib.import_module(f"srt_jax.commands.{name}"), name)


def _placeholder(name: str) -> Callable[..., int]:
    """Takes the place of a command in the list of all: its name and docstring, from the source."""
    spec = importlib.util.find_spec(f"srt_jax.commands.{name}")
    source = getattr(spec.loader, "get_source", lambda _: None)(spec.name) if spec else None
    found = [
        node
        for node in ast.parse(source or "").body
        if isinstance(node, ast.FunctionDef) and node.name == name
    ]
    if not found:  # installed without its sources
        return _function(name)

    def command() -> int:
        raise AssertionError(f"'{name}' was only listed")

    command.__name__, command.__doc__ = name, inspect.cleandoc(ast.get_docstring(found[0]) or "")
    return command


def _with_commands(
    load: Callable[[str], Callable[..., int]], names: Sequence[str] = tuple(_EXAMPLES)
) -> typer.Typer:
    app = _new_app()
    for name in names:
        function = load(name)
        line = _in_a_line(function.__doc__ or "")
        app.command(name, short_help=line, epilog=examples(*_EXAMPLES[name]))(function)
    return app


def _in_a_line(text: str) -> str:
    """Returns what the list of commands says of one: its first sentence without the exit codes,
    which the command's own help has.
    """
    first = " ".join(text.split("\n\n")[0].split())
    for codes in (": [bold]0", " Exit code"):
        first = first.split(codes)[0]
    return first.rstrip(".") + "."


def _app_for(arguments: Sequence[str]) -> typer.Typer:
    """The program with the commands that these arguments can reach."""
    if arguments and arguments[0] in _EXAMPLES:
        return _with_commands(_function, arguments[:1])
    can_complete = any(name.endswith("_COMPLETE") for name in os.environ)
    return _with_commands(
        _function if can_complete or set(arguments) & set(_EXAMPLES) else _placeholder
    )


def __getattr__(name: str) -> object:
    """`app` is the program with all of its commands loaded."""
    if name == "app":
        return _with_commands(_function)
    raise AttributeError(f"module 'srt_jax.cli' has no attribute {name!r}")


def run(arguments: list[str] | None = None, *, failed: BaseException | None = None) -> int:
    """Runs one command and returns its exit code; whatever goes wrong ends in one line on standard
    error.

    0 all solved, 1 some task cannot be solved, 2 bad input, 3 budget spent, 130 interrupted, 143
    terminated, 141 the reader of standard output went away, 70 anything else that went wrong.
    `--debug`, or SRT_JAX_DEBUG=1, prints the Python traceback too.

    Args:
      arguments: those of the process where None.
      failed: what ended a command that ran already: its message is printed, and nothing is run.
    """
    typed, given = _without_flags(sys.argv[1:] if arguments is None else list(arguments))
    is_debug = "--debug" in given or os.environ.get("SRT_JAX_DEBUG", "") not in ("", "0")
    console.be_quiet("--quiet" in given)
    try:
        if failed is not None:
            raise failed
        code = _app_for(typed)(typed, prog_name="srt-jax", standalone_mode=False) or 0
        if code == 128 + signal.SIGINT:  # the parser makes this of an interrupt, without a word
            return interrupts.report_stop()
        flush_output()
        return code
    except BaseException as error:
        code = _report(error)
        if is_debug and code not in (0, typer.Exit().exit_code):
            traceback.print_exception(error)
        silence_output()
        return code


_FLAGS = ("--debug", "--quiet")
"""Flags of every command, which may come anywhere before "--"."""


def _without_flags(typed: list[str]) -> tuple[list[str], set[str]]:
    """Returns what was typed without the flags that every command has, and those given."""
    end = typed.index("--") if "--" in typed else len(typed)
    rest = [word for word in typed[:end] if word not in _FLAGS]
    return rest + typed[end:], set(typed[:end]) & set(_FLAGS)


def _report(error: BaseException) -> int:
    """Prints in one line what went wrong, and returns the exit code."""
    if interrupts.stopped_by() is not None or isinstance(
        error, KeyboardInterrupt | interrupts.Stopped | typer.Abort
    ):
        return interrupts.report_stop()  # what an interrupt breaks may end in any error
    if isinstance(error, typer.Exit):
        return error.exit_code
    if isinstance(error, SystemExit):
        # which the parser makes an exit with code 1
        is_pipe = isinstance(error.__context__, BrokenPipeError)
        return PIPE_CLOSED if is_pipe else error.code if isinstance(error.code, int) else CRASHED
    # what all of the parser's errors have, and only they
    format_message = getattr(error, "format_message", None)
    if format_message is not None:
        if not format_message():  # no command at all: the help has been printed
            return BAD_INPUT
        context = getattr(error, "ctx", None)
        said = format_message().rstrip(".")
        joined = " See" if said.endswith("?") else "; see"
        hint = f"{joined} '{context.command_path} --help'" if context else ""
        return error_line(said + hint)
    if isinstance(error, BrokenPipeError):
        return PIPE_CLOSED  # as a shell reports it: its reader, such as `head`, has all it wants
    if isinstance(error, ImportError | ValueError):
        return error_line(str(error))
    return error_line(_crash(error), CRASHED)


def _crash(error: BaseException) -> str:
    """Returns the message for an error that is no fault of the input."""
    if isinstance(error, MemoryError) or "RESOURCE_EXHAUSTED" in str(error):
        return f"out of memory ({_brief(error)}): give fewer or smaller tasks at once"
    if isinstance(error, OSError):
        return f"{error.filename or 'the output'}: {error.strerror or _brief(error)}"
    if "Unable to initialize backend" in str(error):
        return f"{_brief(error)}: set JAX_PLATFORMS to a device that is there, such as cpu"
    if _lacks_device():
        requested = os.environ.get("JAX_PLATFORMS")
        return (
            f"JAX finds no device{f' of JAX_PLATFORMS={requested}' if requested else ''}: set"
            " JAX_PLATFORMS to one that is there"
        )
    name = type(error).__name__
    return f"internal error: {name}: {_brief(error)}; please report it with what --debug prints"


def _lacks_device() -> bool:
    """Whether JAX cannot start on the device that it is to use; its own error says little where
    a callback met it first.
    """
    try:
        import jax

        return not jax.devices()
    except Exception:
        return True


def _brief(error: BaseException, most: int = 300) -> str:
    """Returns the message of an error on one line; the first of long ones, which compilers end
    with pages of their state.
    """
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0][:most].rstrip(".;: ") if lines else type(error).__name__
