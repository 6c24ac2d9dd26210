"""A worker process of `pool`: `python -m srt_jax.scale.crews.worker NUMBER`.

The first line on its standard input is the job, each further one the number of a unit; for each it
answers by one line of JSON. When the input ends so does the process, in the middle of a unit too.
"""

import base64
import contextlib
import json
import os
import pickle
import queue
import signal
import sys
import threading
from typing import Any


def main() -> None:
    # What libraries print goes to standard error: standard output is for answers alone.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    lines: queue.Queue[str] = queue.Queue()
    threading.Thread(target=_listen, args=(lines,), daemon=True).start()

    with _one_core(int(sys.argv[1])):
        job = pickle.loads(base64.b64decode(lines.get()))
        if "jax" in sys.modules:
            sys.modules["jax"].devices()  # starts its threads: as many as there are cores now
    from srt_jax.scale.job import attempt

    while True:
        answer: dict[str, Any]
        try:
            answer = attempt(job, int(lines.get()))._asdict()
        except Exception as error:
            kind = next((k for k in (ValueError, ImportError) if isinstance(error, k)), None)
            text = str(error) if kind else f"{type(error).__name__}: {error}"
            answer = {"kind": kind.__name__ if kind else "", "error": text}
        print(json.dumps(answer), file=answers, flush=True)


def _listen(lines: "queue.Queue[str]") -> None:
    """In a thread, so that the end of the input is noticed while a unit is made."""
    for line in sys.stdin:
        lines.put(line)
    from sign_model.foundation.files import remove_open_drafts

    remove_open_drafts()
    os._exit(0)


@contextlib.contextmanager
def _one_core(number: int) -> Any:
    """Restricts the process to one core while JAX starts, which sizes its pools of threads by that;
    afterwards the system may move them.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {cores[number % len(cores)]})
    try:
        yield
    finally:
        for thread in os.listdir("/proc/self/task") if os.path.isdir("/proc/self/task") else ["0"]:
            with contextlib.suppress(OSError):
                os.sched_setaffinity(int(thread), cores)


if __name__ == "__main__":
    main()
