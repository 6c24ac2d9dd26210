"""What `pyproject.toml` cannot say: the page of a package index is the README with links that lead
somewhere from there.
"""

import pathlib
import re
import tomllib

from setuptools import setup

ROOT = pathlib.Path(__file__).parent

_PICTURE = re.compile(r"!\[([^\]]*)\]\((?!https?:)([^)\s]+)\)\n(\n\*.+?\*\n)?", re.DOTALL)
_LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?:|#)([^)\s]+)\)")


def for_index(readme: str, repository: str | None) -> str:
    """Returns the README with the files of the repository as absolute links; without an address of
    it, links become their words, and pictures go with their captions.
    """
    if repository is None:
        return _LINK.sub(r"\1", _PICTURE.sub("", readme))
    pictures = _PICTURE.sub(rf"![\1]({repository}/raw/main/\2)\n\3", readme)
    return _LINK.sub(rf"[\1]({repository}/blob/main/\2)", pictures)


if __name__ == "__main__":
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["urls"]
    setup(
        long_description=for_index((ROOT / "README.md").read_text(), urls.get("Repository")),
        long_description_content_type="text/markdown",
    )
