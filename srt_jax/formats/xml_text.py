"""XML read whole, or refused with the line."""

import xml.etree.ElementTree as ElementTree

from srt_jax.formats.files import PathLike, read_bytes


def read_xml(path: PathLike, kind: str) -> ElementTree.Element:
    """Returns the root of an XML file.

    Raises:
      ValueError: the file is missing or no XML; entities, which plain files have no use for, are
        refused.
    """
    content = read_bytes(path, kind)
    if b"<!ENTITY" in content:
        raise ValueError(
            f"{path}: a {kind} that defines entities of its own is not read: write its text out"
        )
    try:
        return ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        line = error.position[0] if isinstance(error, ElementTree.ParseError) else 1
        raise ValueError(f"{path}:{line}: no whole XML file: {error}") from error


def plain(tag: object) -> str:
    """Returns an element's name without its namespace; "" for comments."""
    return tag.rsplit("}", 1)[-1] if isinstance(tag, str) else ""
