"""Processes forked after JAX has started: its threads do not live on in them, so that whatever they
compute waits for ever. They are told so instead.
"""

import os

try:
    from jax._src.xla_bridge import backends_are_initialized as _has_started
except ImportError:  # a JAX that names it otherwise: take it as started

    def _has_started() -> bool:
        return True


_STATE = {"forked": False}


def _note() -> None:
    _STATE["forked"] = _STATE["forked"] or _has_started()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note)


def is_forked() -> bool:
    """Returns whether this process was forked from one in which JAX had started."""
    return _STATE["forked"]


def refuse_fork() -> None:
    """Raises RuntimeError in a process that was forked after JAX had started."""
    if is_forked():
        raise RuntimeError(
            "this process was forked after JAX had started, where JAX waits for ever: start worker"
            ' processes afresh, AsyncVectorEnv(..., context="spawn") or'
            ' multiprocessing.get_context("spawn")'
        )
