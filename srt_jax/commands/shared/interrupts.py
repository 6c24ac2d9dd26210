"""Ctrl-C and SIGTERM end the program at any moment: one line on standard error, exit code 130 or
143, no draft left.

Only where this package runs as a program of its own (`srt-jax`, `python -m srt_jax`); imported as a
library it changes nothing. This module comes before all others and needs the standard library
alone, so that importing JAX can be interrupted, too.

An exception raised by a signal handler is not enough. Callbacks of JAX and of the garbage collector
swallow it, worker threads continue without it, and no handler runs while the main thread waits for
a compiler. Therefore a thread that sleeps until a signal comes gives the exception some seconds to
unwind the stack, and then ends the process itself. While a module is imported nothing is raised at
all: extension modules in C++ abort the process where an exception meets their first lines.
"""

import atexit
import contextlib
import itertools
import os
import pathlib
import signal
import sys
import threading
from types import FrameType
from typing import Any, NoReturn

GRACE = 3.0
"""Seconds that the stack may take to unwind."""

_NAMES = ("srt-jax", "srt-jax.exe", "srt-jax-script.py")


class Stopped(BaseException):
    """The user, or the system, asked the program to end. No KeyboardInterrupt, which libraries
    catch.
    """


class _State:
    """stopped_by: the first signal. is_working: whether `begin_work` was called. echoes: signals
    sent by this module itself.
    """

    stopped_by: int | None = None
    is_working = False
    is_reported = False
    echoes = 0


_reporting = threading.RLock()


def install_for_program() -> None:
    """Installs the handlers where this process runs the command line; does nothing otherwise."""
    if _is_program() and threading.current_thread() is threading.main_thread():
        _open_missing_streams()
        _install()


def begin_work() -> None:
    """From now on a signal unwinds the stack first; before, while modules are imported, the
    process ends at once.
    """
    _State.is_working = True


def stopped_by() -> int | None:
    """Returns the signal that asked the program to end; None where none did."""
    return _State.stopped_by


def report_stop() -> int:
    """Prints the one line about the interrupt, unless it was printed, and returns the exit code."""
    # the other thread may end the process as soon as the line is out, not before
    is_mine = _reporting.acquire(timeout=1.0)
    try:
        if not _State.is_reported:
            _State.is_reported = True
            word = "terminated" if _State.stopped_by == signal.SIGTERM else "interrupted"
            with contextlib.suppress(OSError, ValueError):
                os.write(
                    2,
                    f"srt-jax: {word}; files appear only when whole, so nothing half-written is"
                    " left\n".encode(),
                )
    finally:
        if is_mine:
            _reporting.release()
    return exit_code()


def exit_code() -> int:
    """Returns 128 and the number of the signal: 130 for Ctrl-C, 143 for SIGTERM."""
    return 128 + (_State.stopped_by or signal.SIGINT)


def _is_program() -> bool:
    process = sys.modules.get("multiprocessing.process")
    if process is not None and process.parent_process() is not None:
        return False  # a child of Python's own, which only was given the same arguments
    given, orig = sys.argv[0] if sys.argv else "", sys.orig_argv
    path = pathlib.PurePath(given)
    # "-m" is what runpy leaves there while it imports the package; later it is the file itself
    if given == "-m" or path.parts[-2:] == ("srt_jax", "__main__.py"):
        return (
            any(pair == ("-m", "srt_jax") for pair in itertools.pairwise(orig))
            or "-msrt_jax" in orig
        )
    return path.name in _NAMES


def _open_missing_streams() -> None:
    """Puts the null device where a standard stream was closed, or the first file opened would
    take its place.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one


def _install() -> None:
    # a shell's background job: Ctrl-C is not for it, but the system may end it
    is_background = signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    sys.excepthook = _on_crash  # before the thread: the first signal may come right after it
    sys.unraisablehook = _on_unraisable
    threading.excepthook = _in_thread
    if not is_background:
        atexit.register(_let_it_end)  # the first that is registered is the last that runs
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    threading.Thread(target=_watch, args=(reading,), name="srt-jax-interrupts", daemon=True).start()
    for number in (signal.SIGTERM,) if is_background else (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _on_signal)


def _on_signal(number: int, frame: FrameType | None) -> None:
    """In the main thread, between two steps of the interpreter."""
    if _State.stopped_by is None:
        _State.stopped_by = number
    if not _State.is_working or _is_importing(frame):
        _end()
    if not _State.is_reported:
        raise Stopped


def _is_importing(frame: FrameType | None) -> bool:
    """Whether a module is being imported, at any depth of the stack."""
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            return True
        frame = frame.f_back
    return False


def _let_it_end() -> None:
    """At the very end, when all is written and printed, Ctrl-C has nothing left to stop: it is
    ignored, as the interpreter would otherwise be killed by it without a line.
    """
    if _State.stopped_by is None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _watch(reading: int) -> None:
    """In a thread of its own, which a signal wakes even while the main thread runs compiled
    code.
    """
    count = 0
    while True:
        for number in os.read(reading, 64):
            if number not in (signal.SIGINT, signal.SIGTERM):
                continue
            if _State.echoes:
                _State.echoes -= 1
                continue
            count += 1
            if _State.stopped_by is None:
                _State.stopped_by = number
            if count > 1 or not _State.is_working:
                _end()
            timer = threading.Timer(GRACE, _end)
            timer.daemon = True
            timer.start()


def _end() -> NoReturn:
    """Ends the process without unwinding anything; what was being written is removed."""
    files = sys.modules.get("sign_model.foundation.files")
    remove = getattr(files, "remove_open_drafts", None)
    if remove is not None:
        remove()
    report_stop()
    os._exit(exit_code())


def _on_unraisable(event: Any) -> None:
    """An exception in a callback is printed and forgotten by the interpreter: the one of a
    signal is raised again.
    """
    if isinstance(event.exc_value, Stopped):
        if not _State.is_reported and hasattr(signal, "pthread_kill"):
            # not from here: the hook's own exceptions are forgotten, too
            timer = threading.Timer(0.01, _raise_again)
            timer.daemon = True
            timer.start()
    else:
        sys.__unraisablehook__(event)


def _raise_again() -> None:
    _State.echoes += 1
    number = _State.stopped_by or signal.SIGINT  # not one that this process ignores
    signal.pthread_kill(threading.main_thread().ident or 0, number)


def _on_crash(kind: type[BaseException], error: BaseException, trace: Any) -> None:
    """What goes wrong while modules are imported, such as no room for temporary files: one line,
    and no exit code 1.
    """
    if _State.stopped_by is not None or issubclass(kind, KeyboardInterrupt):
        _end()
    if "--debug" in sys.argv or os.environ.get("SRT_JAX_DEBUG", "") not in ("", "0"):
        sys.__excepthook__(kind, error, trace)
    message = " ".join(f"{kind.__name__}: {error}".split())
    with contextlib.suppress(OSError, ValueError):
        os.write(2, f"srt-jax: error: {message}\n".encode("utf-8", "backslashreplace"))
    os._exit(2 if isinstance(error, ImportError) else 70)


def _in_thread(event: Any) -> None:
    if _State.stopped_by is None:
        threading.__excepthook__(event)


install_for_program()
