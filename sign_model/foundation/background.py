"""Work that nobody waits for: done in a thread of its own, and finished before the process ends."""

import atexit
import contextlib
import threading
from collections.abc import Callable

_running: set[threading.Thread] = set()


def start(work: Callable[[], object]) -> None:
    """Does `work` in a thread; what goes wrong there ends it without a word."""

    def run() -> None:
        try:
            with contextlib.suppress(Exception):
                work()
        finally:
            _running.discard(thread)

    # A thread that is in the compiler when Python shuts down would take the process with it, so the
    # process waits; not as for other threads, where Ctrl-C would print a traceback.
    thread = threading.Thread(target=run, name="srt-jax compiling", daemon=True)
    _running.add(thread)
    thread.start()


@atexit.register
def finish() -> None:
    """Waits for what is running."""
    for thread in tuple(_running):
        while thread.is_alive():
            with contextlib.suppress(KeyboardInterrupt):
                thread.join()
