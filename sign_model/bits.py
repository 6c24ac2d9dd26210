"""Sets of features as words of 64 bits on the host: packing, and unions or intersections of rows
named by lists.

NumPy works on 64 bits at a time, so the exact searches use these. Kernels use words of 32 bits
(`sign_model.foundation.words`), since JAX has no 64-bit integers unless they are switched on.
"""

from collections.abc import Sequence

import numpy as np

WORD = 64
_MANY = 4
"""So many owners for each member of the largest are reduced member by member."""

_PAYS = 128
"""So many sets pay for a table of the choices among rows."""

_MOST_CHOICES = 1 << 19
"""The most words of such a table: it should stay in the cache."""

_COUNTS = (
    np.unpackbits(np.arange(1 << 16, dtype=np.uint16).view(np.uint8))
    .reshape(-1, 16)
    .sum(axis=1, dtype=np.uint8)
)


def pack(rows: np.ndarray) -> np.ndarray:
    """Returns bool [..., F] as uint64 [..., ceil(F / 64)] (at least one word), feature f in bit f %
    64 of word f // 64.
    """
    size = rows.shape[-1]
    num_words = max(1, -(-size // WORD))
    padded = np.zeros((*rows.shape[:-1], num_words * WORD), np.uint8)
    padded[..., :size] = rows
    return np.packbits(padded, axis=-1, bitorder="little").view(np.uint64)


def stacked(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Returns [N, F] of N rows, [F] each, at least one: `np.stack` for thousands of short rows, in
    a fourth of its time.
    """
    return np.concatenate(rows).reshape(len(rows), -1)


def unpack(words: np.ndarray, size: int) -> np.ndarray:
    """Returns the inverse of `pack`: uint64 [..., W] as bool [..., size]."""
    return np.unpackbits(
        np.ascontiguousarray(words).view(np.uint8), axis=-1, count=size, bitorder="little"
    ).astype(bool)


def as_number(words: np.ndarray) -> int:
    """Returns one packed row, uint64 [W], as a whole number: feature f is bit f."""
    return int.from_bytes(words.tobytes(), "little")


def as_words(number: int, size: int) -> np.ndarray:
    """Returns the inverse of `as_number`: uint64 [W] for rows of `size` features."""
    num_words = max(1, -(-size // WORD))
    return np.frombuffer(number.to_bytes(8 * num_words, "little"), np.uint64)


def as_bytes(words: np.ndarray) -> list[bytes]:
    """Returns each packed row, uint64 [N, W], as bytes: a key that no other row has."""
    return np.ascontiguousarray(words).view(f"V{8 * words.shape[1]}").ravel().tolist()


class NumberedRows:
    """The rows of some matrices as whole numbers, each made when it is first asked for.

    A search that goes from one row to the next, such as an execution step by step, is faster on
    whole numbers than on arrays of a few words.

    Args:
      matrices: bool [A, F] each.
    """

    def __init__(self, *matrices: np.ndarray) -> None:
        self.matrices = matrices
        self.known: dict[int, tuple[int, ...]] = {}

    def of(self, row: int) -> tuple[int, ...]:
        """Returns the row of each matrix as a whole number of F bits."""
        if row not in self.known:
            self.known[row] = tuple(as_number(pack(matrix[row])) for matrix in self.matrices)
        return self.known[row]


def popcount(words: np.ndarray) -> np.ndarray:
    """Returns the number of 1-bits of each row: uint64 [..., W] -> int32 [...]."""
    if hasattr(np, "bitwise_count"):  # NumPy 2 has an instruction for it
        return np.bitwise_count(words).sum(axis=-1, dtype=np.int32)
    return _COUNTS[np.ascontiguousarray(words).view(np.uint16)].sum(axis=-1, dtype=np.int32)


class UnionOfRows:
    """The OR of those rows of a table that a set names, for many sets.

    For every eight rows the OR of each of their 256 choices is tabulated when that first pays, so
    a set needs one look-up for eight of its features (Arlazarov, Dinic, Kronrod & Faradzhev 1970).

    Args:
      rows: uint64 [F, W].
    """

    def __init__(self, rows: np.ndarray) -> None:
        self.rows, self.seen = rows, 0
        self.choices: np.ndarray | None = None
        groups = -(-len(rows) // 8)
        self.is_small = groups * rows.shape[1] <= _MOST_CHOICES // 256

    def of(self, sets: np.ndarray) -> np.ndarray:
        """Returns uint64 [N, W] for sets, bool [N, F]."""
        self.seen += len(sets)
        if self.choices is None and (not self.is_small or self.seen < _PAYS):
            owner, member = np.nonzero(sets)
            return any_row(self.rows, owner, member, len(sets))
        if self.choices is None:
            self.choices = self._tabulated()
        chosen = np.packbits(sets, axis=1, bitorder="little")
        union = np.zeros((len(sets), self.rows.shape[1]), np.uint64)
        for choice, choices in zip(chosen.T, self.choices):
            union |= choices[choice]
        return union

    def _tabulated(self) -> np.ndarray:
        """Returns uint64 [F / 8, 256, W]."""
        size, width = self.rows.shape
        eights = np.zeros((-(-size // 8) * 8, width), np.uint64)
        eights[:size] = self.rows
        eights = eights.reshape(-1, 8, width)
        choices = np.zeros((len(eights), 256, width), np.uint64)
        for i in range(8):
            known = choices[:, : 1 << i]
            choices[:, 1 << i : 2 << i] = known | eights[:, i, None]
        return choices


def any_row(rows: np.ndarray, owner: np.ndarray, member: np.ndarray, num_owners: int) -> np.ndarray:
    """Returns uint64 [num_owners, W]: the OR of `rows[member]` per owner, 0 for an owner without
    members.

    Args:
      rows: uint64 [N, W].
      owner, member: int [P], owners ascending.
    """
    return _reduced(np.bitwise_or, rows, owner, member, num_owners, np.uint64(0))


def all_rows(
    rows: np.ndarray, owner: np.ndarray, member: np.ndarray, num_owners: int
) -> np.ndarray:
    """Returns uint64 [num_owners, W]: the AND of `rows[member]` per owner, all ones for an owner
    without members.
    """
    return _reduced(np.bitwise_and, rows, owner, member, num_owners, ~np.uint64(0))


def _reduced(
    operation: np.ufunc,
    rows: np.ndarray,
    owner: np.ndarray,
    member: np.ndarray,
    num_owners: int,
    empty: np.uint64,
) -> np.ndarray:
    out = np.full((num_owners, rows.shape[1]), empty, np.uint64)
    if not len(owner):
        return out
    is_first = np.ones(len(owner), bool)
    np.not_equal(owner[1:], owner[:-1], out=is_first[1:])
    first = np.flatnonzero(is_first)
    count = np.diff(np.append(first, len(owner)))
    most = int(count.max())
    if len(first) < _MANY * most:
        out[owner[first]] = operation.reduceat(rows[member], first, axis=0)
        return out

    # Many owners of few members each: the n-th members of all owners at once, owners of most
    # members first. That is several times faster than reduceat, which works element by element.
    order = np.argsort(-count, kind="stable")
    first, count = first[order], count[order]
    reduced = rows[member[first]]
    for n in range(1, most):
        num_left = int(np.searchsorted(-count, -n, side="left"))
        some = reduced[:num_left]
        operation(some, rows[member[first[:num_left] + n]], out=some)
    out[owner[first]] = reduced
    return out
