"""XML read whole, or refused with the line."""

from typing import TYPE_CHECKING
from xml.etree.ElementTree import ParseError

from srt_jax.formats.shared.whole_files import PathLike, read_bytes, require_module

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element


def read_xml(path: PathLike, kind: str) -> "Element":
    """Returns the root of an XML file; needs defusedxml.

    Raises:
      ValueError: the file is missing or no XML; entities, which plain files have no use for, are
        refused in every encoding.
    """
    defused = require_module("defusedxml", extra="xml", what=f"reading a {kind}")
    parser = require_module("defusedxml.ElementTree", extra="xml", what=f"reading a {kind}")
    content = read_bytes(path, kind)
    try:
        return parser.fromstring(content)
    except defused.DefusedXmlException as error:
        raise ValueError(
            f"{path}: a {kind} that defines entities of its own is not read: write its text out"
        ) from error
    except (ParseError, ValueError, LookupError) as error:
        line = error.position[0] if isinstance(error, ParseError) else 1
        raise ValueError(f"{path}:{line}: no whole XML file: {error}") from error


def plain(tag: object) -> str:
    """Returns an element's name without its namespace; "" for comments."""
    return tag.rsplit("}", 1)[-1] if isinstance(tag, str) else ""
