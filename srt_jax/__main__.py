"""`python -m srt_jax` and the command `srt-jax`: every error is one line on standard error, and
exit code 2.
"""

import os
import pathlib
import sys

from srt_jax import __version__
from srt_jax.commands.short_plan import plain_call


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line and exits with its code."""
    given = sys.argv[1:] if arguments is None else arguments
    if given == ["--version"]:
        print(f"srt-jax {__version__}")
        sys.exit(0)
    failed: BaseException | None = None
    if (call := plain_call(given, os.environ)) is not None:
        try:
            code = call()
            if sys.stdout is not None:
                # a reader that went away, or a full disk, is met here and not at the very end
                sys.stdout.flush()
            sys.exit(code)
        except (Exception, KeyboardInterrupt) as error:
            failed = error  # told by the one place that tells every error
    _keep_compiled_code()
    try:
        from srt_jax.cli import run
    except ImportError as error:
        if error.name not in ("typer", "rich"):
            raise
        print(
            f"srt-jax: error: the command line needs {error.name}: pip install 'srt-jax[cli]'",
            file=sys.stderr,
        )
        sys.exit(2)
    sys.exit(run(arguments, failed=failed))


def _keep_compiled_code() -> None:
    """What one run compiles, the next need not. For this process alone: the library itself changes
    no setting of its user's.
    """
    if os.environ.get("JAX_COMPILATION_CACHE_DIR") is not None:
        return
    cache = (
        pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "srt-jax"
    )
    # importing it only for this would cost a second: it reads the variable when it is loaded
    if "jax" not in sys.modules:
        os.environ["JAX_COMPILATION_CACHE_DIR"] = str(cache)
        return
    import jax

    if getattr(jax.config, "jax_compilation_cache_dir", None) is None:
        jax.config.update("jax_compilation_cache_dir", str(cache))


if __name__ == "__main__":
    main()
