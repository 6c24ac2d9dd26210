"""Which cells polygons cover, in whole numbers and row by row: exact, and without a loop over
cells.

Coordinates are whole steps to the right and down from the outer corner of cell (0, 0); a cell's
side is an even number of steps, so that centres are whole too. Inside is what an odd number of an
owner's rings enclose.
"""

from typing import NamedTuple

import numpy as np

_FITS = 2.0**62
"""What products may come to, in floats, such that they and their sums fit into 64 bits."""
_ROUNDING = 2.0**-49
"""By which share a quotient of float64 may be off here, no less."""


class Edges(NamedTuple):
    """The edges of all rings.

    tail, head: int64 [E, 2], (x, y), head.y >= tail.y.
    owner: int64 [E].
    cell: the side of a cell in steps, even.
    height, width: number of rows and columns; what lies beyond is left out.
    """

    tail: np.ndarray
    head: np.ndarray
    owner: np.ndarray
    cell: int
    height: int
    width: int


class Spans(NamedTuple):
    """Runs of cells in a row, from column `first` to `last`, both included; all int64 [N]."""

    owner: np.ndarray
    row: np.ndarray
    first: np.ndarray
    last: np.ndarray


def touched_spans(edges: Edges) -> Spans:
    """Returns the cells whose open square the inside of an owner meets; runs may overlap.

    Where a border enters the open square, the inside does so too. Where none does, the square is
    all inside or all outside, and its centre says which.
    """
    low, high = edges.tail[:, 1], edges.head[:, 1]
    edge, row = _rows(edges, low // edges.cell, -(-high // edges.cell) - 1)
    top = _columns(edges, edge, np.maximum(low[edge], row * edges.cell))
    bottom = _columns(edges, edge, np.minimum(high[edge], (row + 1) * edges.cell))
    border = Spans(
        edges.owner[edge], row, np.minimum(top[0], bottom[0]), np.maximum(top[1], bottom[1]) - 1
    )
    level = _level(edges)
    row, in_row = low[level] // edges.cell, low[level] % edges.cell
    left, right = _ends(edges, level)
    level_border = Spans(edges.owner[level], row, left // edges.cell, -(-right // edges.cell) - 1)
    return _join(_inside(edges), border, _where(level_border, in_row > 0))


def centred_spans(edges: Edges) -> Spans:
    """Returns the cells whose centre lies in an owner or on its border; runs may overlap."""
    half = edges.cell // 2
    low, high = edges.tail[:, 1] - half, edges.head[:, 1] - half
    edge, row = _rows(edges, -(-low // edges.cell), high // edges.cell)
    left, right = _columns(edges, edge, row * edges.cell + half, shift=half)
    border = _where(Spans(edges.owner[edge], row, left, right), left == right)
    level = _level(edges)
    row, off_centre = low[level] // edges.cell, low[level] % edges.cell
    left, right = _ends(edges, level)
    level_border = Spans(
        edges.owner[level], row, -((half - left) // edges.cell), (right - half) // edges.cell
    )
    return _join(_inside(edges), border, _where(level_border, off_centre == 0))


def cells_of(spans: Spans, height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns owner and cell (row * width + column) of every cell on the map in the runs, each
    once, by owner and then cell.
    """
    first, last = np.maximum(spans.first, 0), np.minimum(spans.last, width - 1)
    owner, row, first, last = _where(
        Spans(spans.owner, spans.row, first, last), (first <= last) & _is_row(spans.row, height)
    )
    # All rows of all owners in one line: runs merge wherever they overlap, and never across rows.
    start, end = ((owner * height + row) * width + column for column in (first, last))
    order = np.argsort(start)
    start, end = start[order], np.maximum.accumulate(end[order])
    is_new = np.concatenate([[True], start[1:] > end[:-1]])[: len(start)]
    start, end = start[is_new], end[np.concatenate([is_new[1:], [True]])[: len(end)]]
    run, offset = _runs(end - start + 1)
    return np.divmod(start[run] + offset, height * width)


def _inside(edges: Edges) -> Spans:
    """Returns the cells whose centre is inside; a centre on the border may go either way."""
    half = edges.cell // 2
    low, high = edges.tail[:, 1] - half, edges.head[:, 1] - half
    # Half-open in y, so that a corner on the line counts once; hence an even number of crossings
    # per row and owner.
    edge, row = _rows(edges, -(-low // edges.cell), -(-high // edges.cell) - 1)
    first = _columns(edges, edge, row * edges.cell + half, shift=half)[0] + 1
    owner = edges.owner[edge]
    order = np.lexsort((first, row, owner))
    owner, row, first = owner[order], row[order], first[order]
    return Spans(owner[::2], row[::2], first[::2], first[1::2] - 1)


def _columns(
    edges: Edges, edge: np.ndarray, y: np.ndarray, *, shift: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Returns floor and ceil of (x - shift) / cell where each edge, not a level one, meets the line
    at y.
    """
    (dx, dy), low = (edges.head - edges.tail).T, edges.tail[:, 1]
    # The whole cells go first, so that the products stay small.
    start = edges.tail[:, 0] - shift
    whole, rest = start // edges.cell, start % edges.cell
    more, is_whole = _quotients(rest, dx, dy, edges.cell, edge, y - low[edge])
    floor = whole[edge] + more
    return floor, floor + ~is_whole


def _quotients(
    rest: np.ndarray, dx: np.ndarray, dy: np.ndarray, cell: int, edge: np.ndarray, down: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns floor((rest * dy + dx * down) / (cell * dy)), int64 [N], and whether that is the
    quotient itself.

    Args:
      rest, dx, dy: of every edge, int64 [E], 0 <= rest < cell.
      edge, down: int64 [N], the edge, not a level one, and how far down it, 0 <= down <= dy.
    """
    if (dy.astype(np.float64) * (float(cell) + np.abs(dx))).max(initial=0) < _FITS:
        # What is an edge's own is reckoned once, not in every row.
        above, below = (rest * dy)[edge] + dx[edge] * down, (cell * dy)[edge]
        more = above // below
        return more, more * below == above
    # Products exceed 64 bits. Floats decide, but where a whole number is nearer than they are off.
    as_float = dx / cell
    quotient = (rest / cell)[edge] + as_float[edge] * (down / dy[edge])
    most_off = (_ROUNDING * (1 + np.abs(as_float)))[edge]
    more, is_whole = np.floor(quotient).astype(np.int64), np.zeros(len(edge), bool)
    tie = np.flatnonzero(np.abs(quotient - np.rint(quotient)) <= most_off)
    rest, dx, dy = (values[edge[tie]].astype(object) for values in (rest, dx, dy))
    above, below = rest * dy + dx * down[tie].astype(object), cell * dy
    more[tie] = above // below
    is_whole[tie] = above % below == 0
    return more, is_whole


def _rows(edges: Edges, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns (edge, row) for every row on the map from `first` to `last` of every edge that is not
    level.
    """
    first = np.maximum(first, 0).astype(np.int64)
    count = np.minimum(last, edges.height - 1).astype(np.int64) - first + 1
    edge, offset = _runs(np.where(edges.tail[:, 1] < edges.head[:, 1], np.maximum(count, 0), 0))
    return edge, first[edge] + offset


def _level(edges: Edges) -> np.ndarray:
    return np.flatnonzero(edges.tail[:, 1] == edges.head[:, 1])


def _ends(edges: Edges, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    ends = edges.tail[chosen, 0], edges.head[chosen, 0]
    return np.minimum(*ends), np.maximum(*ends)


def _runs(count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns for runs of the given lengths, laid end to end, which run each item is in and its
    place there.
    """
    run = np.repeat(np.arange(len(count)), count)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(count) - count, count)


def _is_row(row: np.ndarray, height: int) -> np.ndarray:
    return (row >= 0) & (row < height)


def _where(spans: Spans, is_kept: np.ndarray) -> Spans:
    return Spans(*(field[is_kept] for field in spans))


def _join(*all_spans: Spans) -> Spans:
    return Spans(*(np.concatenate(fields).astype(np.int64) for fields in zip(*all_spans)))
