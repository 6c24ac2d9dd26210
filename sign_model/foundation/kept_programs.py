"""Compiled programs kept on disk: what one process compiled, the next one loads.

JAX can keep compiled code itself, but only by a setting that is global to the process, and it
traces a function before it looks for it. Here a program is found by its name, its options and the
shapes of its arguments, so that a later process neither traces nor compiles it. No setting of JAX
is changed; programs inside a user's own jit are the user's.

The folder is `SRT_JAX_PROGRAMS`, else `srt-jax/programs` where the system keeps caches of its user;
`SRT_JAX_PROGRAMS=off` keeps nothing. Whoever can write there can run code as its user, as with
every cache of compiled code, so the folder is made for its owner alone and left unused if it
belongs to somebody else or others can write to it. Whatever else goes wrong, a program is compiled
as if there were no folder.

The name of a file is a digest of all that decides the program: the source of both packages, the
versions of Python, JAX and jaxlib, the processor, the settings that change what is compiled, and
what the caller gives. Files appear by renaming, so several processes may share the folder. When it
holds more than `MOST_BYTES`, those not used for longest go first.

TIERS. Half of the time to compile a large program goes into LLVM's optimisation, which a few small
calls never earn back. So where the arguments are small, a program is compiled without it at first.
Once its calls have taken `PATIENCE` seconds it is compiled with it, in a thread, and takes the
place of the first. Both give the same bits. And where the caller would rather not wait for the
compiler (`uncompiled`), NumPy answers the first calls.
"""

import contextlib
import functools
import hashlib
import os
import pathlib
import pickle
import platform
import stat
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, NamedTuple

import jax
import numpy as np

from sign_model.foundation import background
from sign_model.foundation.files import atomic_write
from sign_model.foundation.uncompiled import first_answers

MOST_BYTES = 1 << 30
"""Of all programs in the folder; the solver for one size of map takes about 2 MB."""

PATIENCE = 0.25
"""Seconds that calls of a program compiled without optimisation may take: a tenth of the time to
compile it with.
"""

_OFF = "off"
_ANSWERED = ".answered"  # ends the name of an empty file: NumPy answered, nothing was compiled
_LEVEL = "xla_backend_optimization_level"
_PASSES = "xla_disable_hlo_passes"
_SETTINGS = (
    "jax_enable_x64",
    "jax_default_matmul_precision",
    "jax_debug_nans",
    "jax_debug_infs",
    "jax_enable_checks",
    "jax_check_tracer_leaks",
)
"""Settings of JAX that change what is compiled."""


class _Program(NamedTuple):
    """A compiled function of flat arrays, and the structure of its results; `lowered` is what it
    was compiled from, where it is of the first tier and was compiled in this process.
    """

    run: Callable
    out_structure: Any
    is_first_tier: bool = False
    lowered: Any = None


class _Traced(NamedTuple):
    """A function of flat arrays that is not compiled yet, and the structure of its results."""

    function: Any
    out_structure: Any
    numpy_form: first_answers.NumpyForm


class KeptProgram:
    """A function of arrays whose programs are kept: called like the jitted function it is made
    from.

    Only for arguments that are arrays on the host or on the one device, never tracers.
    """

    def __init__(
        self,
        fun: Callable,
        name: tuple,
        options: dict[str, Any],
        in_tiers: Callable[..., bool] | None = None,
    ) -> None:
        """Args:
        fun: a pure function of pytrees of arrays.
        name: what decides the program besides the shapes and dtypes of the arguments; its `repr` is
          the same in every process.
        options: of the compiler.
        in_tiers: takes the arguments; whether a program for such is compiled without optimisation
          at first. By default none is.
        """
        self._fun, self._name, self._options = fun, name, options
        self._in_tiers = in_tiers
        self._loaded: dict[Any, _Program] = {}
        self._seconds: dict[Any, float] = {}
        self._traced: dict[Any, _Traced] = {}

    def __call__(self, *args: Any) -> Any:
        leaves, structure = jax.tree.flatten(args)
        shapes = _shapes(leaves)
        key = (structure, shapes, _settings())
        if key not in self._loaded:
            if first_answers.patience() and (found := self._on_numpy(key, args, leaves)):
                return found[0]
            self._loaded[key] = self._load(args, structure, shapes, lowered=self._lowered_of(key))
        program = self._loaded[key]
        if program.is_first_tier:
            return self._call_first_tier(key, program, args)
        return jax.tree.unflatten(program.out_structure, program.run(*leaves))

    def _on_numpy(self, key: Any, args: tuple, leaves: list) -> tuple[Any] | None:
        """Returns the result, in a tuple, as NumPy computes it; None where there is a program, or
        it is time to make one.
        """
        if self.is_kept(*args):
            return None
        structure, shapes, _ = key
        mark = self._file(structure, shapes, is_first_tier=False)
        mark = None if mark is None else mark.with_suffix(_ANSWERED)
        if key not in self._traced:
            if mark is not None and mark.is_file():  # asked for again: worth compiling
                return None
            traced, out_structure = self._trace(args, structure)
            self._traced[key] = _Traced(traced, out_structure, first_answers.NumpyForm(traced))
        traced = self._traced[key]
        out = traced.numpy_form.answer(leaves, first_answers.patience())
        if out is None:
            return None
        if mark is not None:
            with contextlib.suppress(OSError):
                mark.touch()
        return (jax.tree.unflatten(traced.out_structure, out),)

    def _lowered_of(self, key: Any) -> tuple[Any, Any] | None:
        """Returns what was traced for NumPy, lowered; it is not needed for that any more."""
        traced = self._traced.pop(key, None)
        return None if traced is None else (traced.function.lower(), traced.out_structure)

    def _call_first_tier(self, key: Any, program: _Program, args: tuple) -> Any:
        began = time.perf_counter()
        out = jax.block_until_ready(program.run(*jax.tree.leaves(args)))
        before = self._seconds.get(key, 0.0)
        self._seconds[key] = spent = before + time.perf_counter() - began
        if before <= PATIENCE < spent:
            self._optimise(key, program, args)
        return jax.tree.unflatten(program.out_structure, out)

    def _optimise(self, key: Any, program: _Program, args: tuple) -> None:
        """Puts the optimised program in the place of that of the first tier, once it is there."""
        # traced here: settings of JAX may hold for this thread alone
        lowered = program.lowered or self._lowered(args, key[0])

        def work() -> None:
            self._loaded[key] = self._load(args, *key[:2], is_final=True, lowered=lowered)

        background.start(work)

    def is_kept(self, *args: Any) -> bool:
        """Returns whether the program for such arguments, arrays or what only has their shapes and
        dtypes, is loaded or on disk.
        """
        leaves, structure = jax.tree.flatten(args)
        shapes = _shapes(leaves)
        if (structure, shapes, _settings()) in self._loaded:
            return True
        files = [self._file(structure, shapes, tier) for tier in self._tiers(args)]
        return any(file is not None and file.is_file() for file in files)

    def num_programs(self) -> int:
        """Returns how many programs have been loaded or compiled in this process."""
        return len(self._loaded)

    def _tiers(self, args: tuple) -> tuple[bool, ...]:
        """Returns whether a program is of the first tier, for all that may be, the faster one
        first.
        """
        is_small = self._in_tiers is not None and self._in_tiers(*args)
        return (False, True) if is_small else (False,)

    def _options_of(self, is_first_tier: bool) -> dict[str, Any]:
        return self._options | ({_LEVEL: 0} if is_first_tier else {})

    def _file(self, structure: Any, shapes: tuple, is_first_tier: bool) -> pathlib.Path | None:
        options = sorted(self._options_of(is_first_tier).items())
        return _file_of((self._name, str(structure), shapes, options))

    def _load(
        self,
        args: tuple,
        structure: Any,
        shapes: tuple,
        *,
        is_final: bool = False,
        lowered: Any = None,
    ) -> _Program:
        """Returns a program on flat arguments and the structure of its results: from disk, else
        compiled, and kept.
        """
        # A result is kept as flat arrays and a pattern of them, numbers in the place of arrays:
        # JAX cannot store the structure of classes that are not its own.
        tiers = (False,) if is_final else self._tiers(args)
        for is_first in tiers:
            file = self._file(structure, shapes, is_first)
            if file is not None:
                with contextlib.suppress(Exception):
                    return _Program(*_read(file), is_first)
        is_first = tiers[-1]
        file = self._file(structure, shapes, is_first)
        options = self._options_of(is_first)
        if file is not None:
            options = _never_seen(options)
        if lowered is None:
            lowered = self._lowered(args, structure)
        flat, out_structure = lowered
        compiled = flat.compile(options or None)
        if file is not None:
            with contextlib.suppress(Exception):
                _write(file, compiled, out_structure)
        return _Program(compiled, out_structure, is_first, lowered if is_first else None)

    def _lowered(self, args: tuple, structure: Any) -> tuple[Any, Any]:
        """Returns the function of flat arguments, traced and lowered, and the structure of its
        results.
        """
        traced, out_structure = self._trace(args, structure)
        return traced.lower(), out_structure

    def _trace(self, args: tuple, structure: Any) -> tuple[Any, Any]:
        out_structure = None

        def flat(*leaves: Any) -> tuple:
            nonlocal out_structure
            out, out_structure = jax.tree.flatten(self._fun(*jax.tree.unflatten(structure, leaves)))
            return tuple(out)

        traced = jax.jit(flat).trace(*jax.tree.leaves(args))
        return traced, out_structure


def _shapes(leaves: list[Any]) -> tuple:
    return tuple((tuple(leaf.shape), np.dtype(leaf.dtype).str) for leaf in leaves)


def folder() -> pathlib.Path | None:
    """Returns the folder of kept programs, or None where none is to be used."""
    wish = os.environ.get("SRT_JAX_PROGRAMS", "")
    if wish == _OFF:
        return None
    if wish:
        return pathlib.Path(wish)
    home = os.path.expanduser("~")
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(home, ".cache")
    return pathlib.Path(cache, "srt-jax", "programs") if os.path.isabs(cache) else None


def is_on() -> bool:
    """Returns whether a program can be a `KeptProgram`: where it runs on one CPU. Without a folder
    it is kept in memory alone.
    """
    return jax.default_backend() == "cpu" and jax.device_count() == 1


def _safe_folder() -> pathlib.Path | None:
    place = folder()
    return None if place is None or not _is_safe(str(place)) else place


@functools.cache
def _is_safe(place: str) -> bool:
    """Returns whether the folder is there, or could be made, and is its user's alone."""
    try:
        os.makedirs(place, mode=0o700, exist_ok=True)
        status = os.lstat(place)
    except OSError:
        return False
    if not stat.S_ISDIR(status.st_mode) or not os.access(place, os.W_OK):
        return False
    is_own = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    return is_own and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _settings() -> tuple:
    values = tuple(getattr(jax.config, name, None) for name in _SETTINGS)
    return (*values, os.environ.get("XLA_FLAGS", ""), os.environ.get("SRT_JAX_PLAIN", ""))


@functools.cache
def _world() -> str:
    """A digest of what decides every program: our source, the versions and the processor."""
    root = pathlib.Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for package in ("sign_model", "srt_jax"):
        for path in sorted((root / package).rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode())
            digest.update(path.read_bytes())
    versions = (sys.version, jax.__version__, version("jaxlib"), platform.machine())
    digest.update(repr((versions, _processor())).encode())
    return digest.hexdigest()


def _processor() -> str:
    """The instructions that the processor knows: compiled code may use any of them."""
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as file:
        for line in file:
            if line.startswith(("flags", "Features")):
                return line
    return platform.processor()


def _file_of(what: Any) -> pathlib.Path | None:
    place = _safe_folder()
    if place is None:
        return None
    try:
        key = repr((what, _settings(), _world()))
    except OSError:  # our source cannot be read: run from an archive
        return None
    return place / f"{hashlib.sha256(key.encode()).hexdigest()[:40]}.program"


def _never_seen(options: dict[str, Any]) -> dict[str, Any]:
    """Returns the options with one that changes nothing and that no program had before.

    Where JAX keeps compiled code as well, it would return a program that it loaded, and one that
    was loaded cannot be stored again: parts of it are missing.
    """
    if getattr(jax.config, "jax_compilation_cache_dir", None) is None:
        return options
    passes = [options[_PASSES]] if _PASSES in options else []
    return options | {_PASSES: ",".join([*passes, f"no-pass-{os.urandom(8).hex()}"])}


def _read(file: pathlib.Path) -> tuple[Callable, Any]:
    from jax.experimental.serialize_executable import deserialize_and_load

    payload, num_args, pattern = pickle.loads(file.read_bytes())
    out, out_structure = jax.tree.flatten(pattern)
    trees = (tuple(range(num_args)), {}), tuple(out)
    program = deserialize_and_load(payload, *map(jax.tree.structure, trees))
    os.utime(file)  # used just now
    return program, out_structure


def _write(file: pathlib.Path, compiled: Any, out_structure: Any) -> None:
    from jax.experimental.serialize_executable import serialize

    payload, in_tree, _ = serialize(compiled)
    pattern = jax.tree.unflatten(out_structure, range(out_structure.num_leaves))
    content = pickle.dumps((payload, in_tree.num_leaves, pattern))
    with atomic_write(file, "wb") as draft:
        draft.write(content)
    with contextlib.suppress(OSError):
        file.with_suffix(_ANSWERED).unlink()
    _make_room(file.parent)


def _make_room(place: pathlib.Path) -> None:
    """Removes the programs not used for longest until the others fit."""
    files = sorted(place.glob("*.program"), key=lambda path: path.stat().st_mtime, reverse=True)
    total = 0
    for path in files:
        total += path.stat().st_size
        if total > MOST_BYTES:
            with contextlib.suppress(OSError):
                path.unlink()
