"""How to install what an optional part needs: the packages themselves, by name. That works from a
clone and from an index alike, whatever either calls this distribution.
"""

import importlib.metadata
import re

_DISTRIBUTION = "srt-jax"


def install_command(extra: str, *packages: str) -> str:
    """Returns the command that installs what an extra of this distribution brings.

    Args:
      packages: what it needs where the distribution is not installed, as in a clone on the path.
    """
    return " ".join(["pip install", *(_quoted(one) for one in _brought_by(extra) or packages)])


def _brought_by(extra: str) -> list[str]:
    """Returns the requirements of an extra, those of extras within it included, in order."""
    try:
        required = importlib.metadata.requires(_DISTRIBUTION) or []
    except importlib.metadata.PackageNotFoundError:
        return []
    found: list[str] = []
    for one in required:
        package, _, marker = one.partition(";")
        if re.search(rf"""extra\s*==\s*['"]{re.escape(extra)}['"]""", marker) is None:
            continue
        within = re.match(rf"\s*{_DISTRIBUTION}\[(.*?)\]", package)
        names = [name.strip() for name in within[1].split(",")] if within else []
        found += [p for name in names for p in _brought_by(name)] or [package.strip()]
    return list(dict.fromkeys(found))


def _quoted(requirement: str) -> str:
    """Returns a requirement as a shell takes it: > and [ would mean something else."""
    return requirement if re.fullmatch(r"[\w.-]+", requirement) else f"'{requirement}'"
