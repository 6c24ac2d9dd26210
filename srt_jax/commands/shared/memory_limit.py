"""Memory that a long run has given back stays with the process where the C library cuts it up."""

import contextlib
import ctypes

_ARENAS = 2
_M_ARENA_MAX = -8


def keep_together() -> None:
    """Lets glibc take memory from few places (arenas) in this process, where it is glibc.

    Each thread of JAX would get its own, and what one has given back the others do not use: after
    some thousand maps of 512 x 512 that was half of the memory of the process. Only for a program:
    a library leaves this to its user.
    """
    with contextlib.suppress(OSError, AttributeError, TypeError):  # no glibc
        ctypes.CDLL(None).mallopt(_M_ARENA_MAX, _ARENAS)
