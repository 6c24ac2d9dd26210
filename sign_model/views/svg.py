"""The few pieces of SVG that the pictures of signs are made of."""

from collections.abc import Iterable
from xml.sax.saxutils import escape

FONT = 'font-family="sans-serif"'
INK, PALE, ACCENT = "#1b1b1b", "#9a9a9a", "#b45309"


def text(
    x: float, y: float, words: str, *, size: int = 12, colour: str = INK, more: str = ""
) -> str:
    """Returns words whose baseline begins at (x, y)."""
    return (
        f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{colour}"{_spaced(more)}>'
        f"{escape(words)}</text>"
    )


def box(x: float, y: float, width: float, height: float, *, fill: str, edge: str = "none") -> str:
    """Returns a rectangle with round corners."""
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="3" fill="{fill}"'
        f' stroke="{edge}"/>'
    )


def curve(
    begin: tuple[float, float], end: tuple[float, float], colour: str, *, opacity: float = 0.55
) -> str:
    """Returns an arc with an arrow head; one that ends where it begins in height is bent."""
    (x0, y0), (x1, y1) = begin, end
    bend = (x0 + x1) / 2, (y0 + y1) / 2 - (18 if abs(y1 - y0) < 4 else 0)
    return (
        f'<path d="M{x0:g},{y0:g} Q{bend[0]:g},{bend[1]:g} {x1:g},{y1:g}" fill="none"'
        f' stroke="{colour}" stroke-width="1" stroke-opacity="{opacity:g}"'
        ' marker-end="url(#head)"/>'
    )


def picture(width: float, height: float, title: str, parts: Iterable[str]) -> str:
    """Returns the text of a file: the parts on a white ground, with a title for readers."""
    head = (
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6"'
        ' markerHeight="6" orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="#555555"/></marker>'
        "</defs>"
    )
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}"'
            f' viewBox="0 0 {width:g} {height:g}" role="img" {FONT}>',
            f"<title>{escape(title)}</title>",
            head,
            f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
            *parts,
            "</svg>\n",
        ]
    )


def _spaced(more: str) -> str:
    return f" {more}" if more else ""
