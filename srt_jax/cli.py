"""The command `srt-jax`: which commands there are, and how whatever goes wrong becomes one line
and an exit code.
"""

from typing import Annotated

import typer

from srt_jax import __version__
from srt_jax.commands.bench import bench
from srt_jax.commands.console import error_line
from srt_jax.commands.convert import convert
from srt_jax.commands.dataset import dataset
from srt_jax.commands.demo import demo
from srt_jax.commands.draw import draw
from srt_jax.commands.generate import generate
from srt_jax.commands.plan import plan
from srt_jax.commands.scen import scen
from srt_jax.commands.solve import solve


def examples(*lines: str) -> str:
    """Returns the end of a command's help: one example a line."""
    title = "Examples" if len(lines) > 1 else "Example"
    # \b: keep the lines apart
    return "\n".join(["\b", f"[bold]{title}[/bold]", *(f"  {line}" for line in lines)])


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


def _print_version(is_asked: bool) -> None:
    if is_asked:
        print(f"srt-jax {__version__}")
        raise typer.Exit


@app.callback()
def _whole(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version and stop.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Solves smart relocation tasks: finds the way, or what blocks it, what to destroy, and the
    way then.
    """


app.command(
    epilog=examples("srt-jax demo", "srt-jax demo --pairs 1 --out demo --report demo.html")
)(demo)
app.command(
    epilog=examples(
        "srt-jax solve city.map --start 3,5 --goal 200,310",
        "srt-jax solve tasks.npz world.json --out answers",
        "srt-jax solve city.osm.pbf --size 500 --block half",
        "srt-jax solve map.yaml --start 20,30 --goal 90,40",
        "srt-jax solve tasks.npz --report run.html",
        "srt-jax solve tasks.npz --json > answers.json",
    )
)(solve)
app.command(
    epilog=examples(
        "srt-jax convert city.osm.pbf city.map --size 500",
        "srt-jax convert scene.svg scene.json",
        "srt-jax convert map.yaml map.xml --start 20,30 --goal 90,40",
    )
)(convert)
app.command(
    epilog=examples(
        "srt-jax draw tasks.npz --out pictures",
        "srt-jax draw city.map --start 3,5 --goal 200,310 --out city.svg --polar",
        "srt-jax draw tasks.npz --only rooms-0003 --out loop.gif",
        "srt-jax draw tasks.npz --show sheet --out pictures",
    )
)(draw)
app.command(
    epilog=examples(
        "srt-jax scen Berlin_0_512.map.scen --map Berlin_0_512.map",
        "srt-jax scen arena.map.scen --limit 100 --json",
    )
)(scen)
app.command(
    epilog=examples(
        "srt-jax plan domain.pddl problem.pddl > problem.plan",
        "srt-jax plan domain.pddl problem.pddl --planner astar --json",
    )
)(plan)
app.command(
    epilog=examples(
        "srt-jax generate mixed --count 1000 --size 64-500 --out tasks.npz",
        "srt-jax generate bagel-10 --count 8 --size 500 --out bagels.npz",
    )
)(generate)
app.command(
    epilog=examples(
        "srt-jax dataset rooms --count 100000 --size 64 --out rooms",
        "srt-jax dataset mixed --count 5000 --size 32-64 --seed 7 --out mixed",
    )
)(dataset)
app.command(epilog=examples("srt-jax bench kernels --quick", "srt-jax bench --json > bench.json"))(
    bench
)


def run(arguments: list[str] | None = None) -> int:
    """Runs one command and returns its exit code; whatever goes wrong is told in one line on
    standard error.
    """
    try:
        return app(arguments, prog_name="srt-jax", standalone_mode=False) or 0
    except typer.Exit as stop:
        return stop.exit_code
    except (typer.Abort, KeyboardInterrupt):
        error_line("stopped; files appear only when whole, so nothing half-written is left")
        return 130
    except (ValueError, ImportError) as error:
        return error_line(str(error))
    except Exception as error:
        # what all of the parser's errors have, and only they
        told = getattr(error, "format_message", None)
        if told is None:
            raise
        if not told():  # no command at all: the help has been printed
            return 2
        context = getattr(error, "ctx", None)
        hint = f"; see '{context.command_path} --help'" if context else ""
        return error_line(told().rstrip(".") + hint)
