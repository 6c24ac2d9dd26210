"""`python -m srt_jax` and the command `srt-jax`: every error is one line on standard error, and exit code 2."""

import sys


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line and exits with its code."""
    try:
        from srt_jax.cli import run
    except ImportError as error:
        if error.name not in ("typer", "rich"):
            raise
        print(f"srt-jax: error: the command line needs {error.name}: pip install 'srt-jax[cli]'", file=sys.stderr)
        sys.exit(2)
    sys.exit(run(arguments))


if __name__ == "__main__":
    main()
