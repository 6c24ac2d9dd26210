"""A process forked after JAX has started is told so, and does not wait for ever."""

import os
import warnings

import numpy as np
import pytest

from srt_jax import make_task, solve
from srt_jax.engine import forks


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_refuses_to_solve():
    task = make_task(np.ones((4, 4), bool), (0, 0), (3, 3))
    solve(task)
    read, write = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # JAX's own: forking and threads
        child = os.fork()
    if child == 0:
        try:
            solve(task)
        except RuntimeError as error:
            os.write(write, str(error).encode())
        finally:
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        said = pipe.read()
    os.waitpid(child, 0)
    assert "forked after JAX had started" in said and 'get_context("spawn")' in said
    assert not forks.is_forked()
