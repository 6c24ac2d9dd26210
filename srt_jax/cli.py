"""The command `srt-jax`: which commands there are, and how whatever goes wrong becomes one line and an exit code."""

import typer

from srt_jax.commands.bench import bench
from srt_jax.commands.dataset import dataset
from srt_jax.commands.demo import demo
from srt_jax.commands.generate import generate
from srt_jax.commands.plan import plan
from srt_jax.commands.scen import scen
from srt_jax.commands.solve import solve
from srt_jax.console import error_line

app = typer.Typer(
    add_completion=True,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Solves smart relocation tasks: finds the way, or what blocks it, what to destroy, and the way then.",
)

app.command(epilog="Example:  srt-jax demo --out demo")(demo)
app.command(
    epilog="Examples:  srt-jax solve city.map --start 3,5 --goal 200,310   |   srt-jax solve tasks.npz world.json --out answers"
)(solve)
app.command(epilog="Example:  srt-jax scen Berlin_0_512.map.scen --map Berlin_0_512.map")(scen)
app.command(epilog="Example:  srt-jax plan domain.pddl problem.pddl > problem.plan")(plan)
app.command(
    epilog="Examples:  srt-jax generate mixed --count 1000 --size 64-500 --out tasks.npz   |   "
    "srt-jax generate bagel-10 --count 8 --size 500 --out bagels.npz"
)(generate)
app.command(epilog="Example:  srt-jax dataset rooms --count 100000 --size 64 --out rooms")(dataset)
app.command(epilog="Example:  srt-jax bench kernels --quick")(bench)


def run(arguments: list[str] | None = None) -> int:
    """Runs one command and returns its exit code; whatever goes wrong is told in one line on standard error."""
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
        told = getattr(error, "format_message", None)  # what all of the parser's errors have, and only they
        if told is None:
            raise
        context = getattr(error, "ctx", None)
        hint = f"; see '{context.command_path} --help'" if context else ""
        return error_line(told().rstrip(".") + hint)
