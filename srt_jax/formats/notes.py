"""What a reader did with odd input, and how often: counted while reading, reported afterwards."""

from collections.abc import Iterator
from typing import Any, NamedTuple


class Note(NamedTuple):
    """what: in words. count: how often; 0 for a plain fact. example: one place where it was so, or
    "".
    """

    what: str
    count: int = 0
    example: str = ""

    def __str__(self) -> str:
        counted = f": {self.count}" if self.count else ""
        return f"{self.what}{counted}" + (f", such as {self.example}" if self.example else "")


class Notes:
    """The notes on one file, in the order in which each kind was met first."""

    def __init__(self) -> None:
        self._notes: dict[str, Note] = {}

    def tell(self, fact: str) -> None:
        """Notes a fact that is not counted, such as which cells were chosen."""
        self._notes.setdefault(fact, Note(fact))

    def add(self, what: str, count: int = 1, *, example: str = "") -> None:
        """Counts `what` some more times; the first example stays. A count of 0 notes nothing."""
        if count:
            known = self._notes.get(what, Note(what, 0, example))
            self._notes[what] = known._replace(count=known.count + count)

    def count(self, what: str) -> int:
        """Returns how often `what` was noted; 0 where it was not."""
        return self._notes[what].count if what in self._notes else 0

    def __iter__(self) -> Iterator[Note]:
        return iter(self._notes.values())

    def __len__(self) -> int:
        return len(self._notes)

    def records(self, file: str) -> list[dict[str, Any]]:
        """Returns the notes as JSON types, each with the file's name."""
        return [{"file": file, **note._asdict()} for note in self]
