"""With jax_enable_x64: the same bits and the same dtypes, and no 64-bit number in any kernel."""

import importlib
import os
import pathlib
import subprocess
import sys

import jax
import numpy as np
from jax._src import source_info_util

from tests.helpers import x64_cases

ROOT = pathlib.Path(__file__).resolve().parents[2]
_WIDE = ("int64", "uint64", "float64", "complex128")


def test_every_result_has_the_same_bits_and_dtype(tmp_path):
    file = tmp_path / "x64.npz"
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    env = os.environ | {
        "JAX_ENABLE_X64": "1",
        "PYTHONPATH": path,
    }
    own = x64_cases.results()
    done = subprocess.run(
        [sys.executable, "-m", "tests.helpers.x64_cases", str(file)],
        env=env,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    with np.load(file) as wide:
        assert set(wide.files) == set(own)
        for name, array in own.items():
            assert (wide[name].dtype, wide[name].shape) == (array.dtype, array.shape), name
            assert wide[name].tobytes() == array.tobytes(), name


def wide_values(jaxpr):
    """Yields the 64-bit values computed in lines of this repository, not those inside functions of
    JAX.
    """
    for eqn in jaxpr.eqns:
        frames = [
            frame.file_name for frame in source_info_util.user_frames(eqn.source_info.traceback)
        ]
        is_ours = bool(frames) and ("srt_jax" in frames[0] or "sign_model" in frames[0])
        if is_ours:
            yield from (
                (eqn.primitive.name, frames[0], v.aval)
                for v in eqn.outvars
                if str(getattr(v.aval, "dtype", "")) in _WIDE
            )
        for inner in jax.tree.leaves(
            list(eqn.params.values()), is_leaf=lambda x: hasattr(x, "jaxpr") or hasattr(x, "eqns")
        ):
            inner = getattr(inner, "jaxpr", inner)
            if hasattr(inner, "eqns"):
                yield from wide_values(inner)


enabled = (
    jax.enable_x64
    if hasattr(jax, "enable_x64")
    else importlib.import_module("jax.experimental").enable_x64
)


def test_no_kernel_computes_with_64_bits():
    given = x64_cases.ground()
    with enabled(True):
        for name, (fun, *args) in x64_cases.numeric_cases(given).items():
            traced = jax.make_jaxpr(fun)(*args)
            assert not [aval for aval in traced.out_avals if str(aval.dtype) in _WIDE], name
            assert list(wide_values(traced.jaxpr)) == [], name
