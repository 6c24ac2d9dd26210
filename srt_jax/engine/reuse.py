"""Which shape an eager call runs in: its own, or another whose program is at hand, since compiling
one more takes longer than a thousand small tasks.

Padding changes no bit of an answer, so the choice is one of time alone. A larger shape wastes part
of each call. That is borrowed against the time to compile: once the calls of a shape have wasted
`WORTH` seconds, its own program is made, so no shape ever loses more than about twice the time to
compile it.
"""

import contextlib
import contextvars
import time
from collections.abc import Callable, Hashable, Iterator
from typing import NamedTuple

from srt_jax.engine.buckets import size_bucket

WORTH = 4.0
"""Seconds lost to padding after which a shape's own program is made: half the time that takes."""

MOST = 16
"""How many times the work of its own shape a call may be given."""

_MOST_OF_PARTS, _ALWAYS_OF_PARTS = 4.0, 1.25
_A_SECOND = 50_000_000
"""Cells of work done in a second, or more."""

_SMALL = 1 << 15
"""Work that is never too much, in cells: a fraction of a millisecond."""

_only_own = contextvars.ContextVar("only_own_shapes", default=False)


class Bucket(NamedTuple):
    """The shape of a batch of tasks: how many, layers, rows, columns, obstacles, and the cells a
    route may have.
    """

    batch: int
    layers: int
    height: int
    width: int
    obstacles: int
    room: int

    @property
    def work(self) -> int:
        """What a call in this shape takes, in cells. More layers make one pass over them longer and
        no more: measured on streets, a second one takes a quarter more at 512 x 512, less below.
        """
        cells = (3 + self.layers) * self.height * self.width // 4
        return self.batch * (cells + 8 * self.obstacles)


class Shapes:
    """The shapes that the programs of one kernel, one for each kind of call, were made for."""

    def __init__(self) -> None:
        self._at_hand: dict[Hashable, set[Bucket]] = {}
        self._chosen: dict[tuple[Hashable, Bucket], Bucket] = {}
        self._wasted: dict[tuple[Hashable, Bucket], float] = {}

    def choose(
        self,
        kind: Hashable,
        own: Bucket,
        is_kept: Callable[[Bucket], bool],
        room_of: Callable[[int, int], int],
        most: float = MOST,
    ) -> Bucket:
        """Returns the shape to run in; of a smaller batch, several times.

        Args:
          kind: what else decides the program.
          own: the smallest shape that holds the batch.
          is_kept: whether a shape's program is on disk.
          room_of: the room for a route that is usual on a map of so many rows and columns.
          most: how many times the work of its own shape the batch may be given.
        """
        known = self._at_hand.setdefault(kind, set())
        place = (kind, own)
        if _only_own.get() or own in known or self._wasted.get(place, 0.0) > WORTH:
            return own
        if place in self._chosen:
            return self._chosen[place]
        # Its own from disk costs least; then the others, those of least work first.
        if is_kept(own):
            return own
        near = sorted((n for n in known if _serves(n, own, most)), key=lambda n: _total(n, own))
        kept = near[:1] or [n for n in _larger(own, room_of, most) if is_kept(n)][:1]
        if kept:
            self._chosen[place] = kept[0]
        return kept[0] if kept else own

    @contextlib.contextmanager
    def timed(self, kind: Hashable, own: Bucket, taken: Bucket) -> Iterator[None]:
        """Counts what is wasted by a call in the shape `taken`, which is at hand from then on."""
        began = time.perf_counter()
        is_first = taken not in self._at_hand.get(kind, ())
        yield
        self._at_hand.setdefault(kind, set()).add(taken)
        if taken != own and not is_first:  # the first call loads the program from disk
            place, share = (kind, own), 1 - own.work / _total(taken, own)
            lost = (time.perf_counter() - began) * share
            self._wasted[place] = self._wasted.get(place, 0.0) + lost


def most_of_parts(own: Bucket, count: int) -> float:
    """Returns how many times the work of its own shape a call of `count` tasks in many parts may be
    given: it is long, and what it wastes is known only afterwards, so no more than a second.
    """
    seconds = own.work / own.batch * count / _A_SECOND
    return max(_ALWAYS_OF_PARTS, min(_MOST_OF_PARTS, 1 + 1 / seconds))


@contextlib.contextmanager
def only_own_shapes() -> Iterator[None]:
    """Within it every call runs in its own shape, and optimised: for those who measure."""
    token = _only_own.set(True)
    try:
        yield
    finally:
        _only_own.reset(token)


def is_measuring() -> bool:
    """Returns whether a call is within `only_own_shapes`."""
    return _only_own.get()


def _total(shape: Bucket, own: Bucket) -> int:
    """The work of a batch in another shape, as often as that must run."""
    return shape.work * max(1, -(-own.batch // shape.batch))


def _serves(shape: Bucket, own: Bucket, most: float) -> bool:
    holds = all(a >= b for a, b in zip(shape[1:], own[1:]))
    return holds and _total(shape, own) <= max(_SMALL, most * own.work)


def _larger(own: Bucket, room_of: Callable[[int, int], int], most: float) -> list[Bucket]:
    """Returns the usual shapes that hold a batch of this one, those of least work first."""
    side = size_bucket(max(own.height, own.width) + 1)
    squares = {(own.height, own.width)} | ({(side, side)} if side <= 128 else set())
    found = (
        Bucket(
            batch, own.layers * layers, height, width, own.obstacles * more, room_of(height, width)
        )
        for batch in {1, own.batch, 2 * own.batch, 4 * own.batch, 8 * own.batch}
        for layers in (1, 2, 4)
        for more in (1, 2, 4, 8)
        for height, width in squares
    )
    return sorted(
        (n for n in found if n != own and _serves(n, own, most)), key=lambda n: (_total(n, own), n)
    )
