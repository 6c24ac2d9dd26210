"""`python -m srt_jax` and the command `srt-jax`: every error is one line on standard error, and
exit code 2.
"""

import os
import pathlib
import sys

import jax


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line and exits with its code."""
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
    sys.exit(run(arguments))


def _keep_compiled_code() -> None:
    """What one run compiles, the next need not. For this process alone: the library itself
    changes no setting of its user's.
    """
    if getattr(jax.config, "jax_compilation_cache_dir", None) is None:
        cache = os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache"
        jax.config.update("jax_compilation_cache_dir", str(pathlib.Path(cache) / "srt-jax"))


if __name__ == "__main__":
    main()
