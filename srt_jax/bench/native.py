"""Peers in C++, compiled on the spot from the files beside this one."""

import ctypes
import functools
import pathlib
import subprocess
import tempfile


@functools.cache
def compiled(name: str) -> ctypes.CDLL | None:
    """Returns the library made of `name`.cpp with -O3 -march=native; None where there is no
    compiler.
    """
    source = pathlib.Path(__file__).with_name(f"{name}.cpp")
    with tempfile.TemporaryDirectory() as folder:
        built = pathlib.Path(folder) / f"{name}.so"
        flags = ["-O3", "-march=native", "-std=c++17", "-shared", "-fPIC"]
        try:
            subprocess.run(
                ["g++", *flags, str(source), "-o", str(built)], check=True, capture_output=True
            )
        except (OSError, subprocess.CalledProcessError):
            return None
        return ctypes.CDLL(str(built))
