"""`python -m srt_jax` and the command `srt-jax`: every error is one line on standard error, with
an exit code of its kind.
"""

import contextlib
import os
import sys

from srt_jax import __version__
from srt_jax.commands.shared import interrupts, xla_flags
from srt_jax.commands.short_plan import plain_call


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line and exits with its code."""
    sys.exit(_run(sys.argv[1:] if arguments is None else arguments))


def _run(arguments: list[str]) -> int:
    _prepare_streams()
    if arguments == ["--version"]:
        print(f"srt-jax {__version__}")
        return 0
    failed: BaseException | None = None
    if (call := plain_call(arguments, os.environ)) is not None:
        interrupts.begin_work()
        try:
            code = call()
            # a reader that went away, or a full disk, is met here and not at the very end
            sys.stdout.flush()
            return code
        except BaseException as error:
            failed = error  # `cli.run` has a message and a code for every error
    _keep_compiled_code()
    try:
        from srt_jax.cli import run
    except ImportError as error:
        if error.name not in ("typer", "rich"):
            raise
        from sign_model.foundation.extras import install_command

        print(
            f"srt-jax: error: the command line needs {error.name}:"
            f" {install_command('cli', 'typer', 'rich')}",
            file=sys.stderr,
        )
        return 2
    interrupts.begin_work()
    try:
        wrong = xla_flags.what_is_wrong(os.environ)
    except BaseException as error:  # an interrupt
        return run(arguments, failed=error)
    if wrong is not None:
        print(f"srt-jax: error: {wrong}", file=sys.stderr)
        return 2
    return run(arguments, failed=failed)


def _prepare_streams() -> None:
    """Makes streams that replace what their encoding cannot express; a closed one loses what is
    printed.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115  # until the end
    for stream, errors in ((sys.stdout, "replace"), (sys.stderr, "backslashreplace")):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors=errors)  # type: ignore[union-attr]


def _keep_compiled_code() -> None:
    """What one run compiles, the next need not. For this process alone: the library itself changes
    no setting of its user's.

    Where there is no folder for it (no home, or one that cannot be written to) nothing is kept. JAX
    reads the variable when it is loaded; importing it only for this would cost a second.
    """
    if os.environ.get("JAX_COMPILATION_CACHE_DIR") is not None:
        return
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    folder = os.path.join(cache, "srt-jax")
    if not os.path.isabs(folder):  # "~" stays where nothing says where home is
        return
    with contextlib.suppress(OSError, ValueError):
        os.makedirs(folder, exist_ok=True)
        if not os.access(folder, os.W_OK):
            return
        if "jax" not in sys.modules:
            os.environ["JAX_COMPILATION_CACHE_DIR"] = folder
            return
        import jax

        if getattr(jax.config, "jax_compilation_cache_dir", None) is None:
            jax.config.update("jax_compilation_cache_dir", folder)


if __name__ == "__main__":
    main()
