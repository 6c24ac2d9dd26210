"""Every reader on damaged files: each file is read, or refused in one sentence; nothing crashes,
hangs or fills the memory.

    python -m experiments.campaigns.readers [--count 100000] [--seed 0] [--formats map,npz,...]
    [--seconds 20] [--gigabytes 2]

Small right files of every format are damaged: bytes turned, pieces cut, doubled and moved, odd
numbers and brackets put in; arrays of an .npz file also one by one, so that the archive stays
whole. Each is read in a child process that may take so much more memory, and so many seconds a
file. Other endings than a result or a ValueError of one line are printed on standard error, with
what makes the file again. The last line: `N mutations, C crashes, H hangs`; exit code 1 unless both
are 0.
"""

import argparse
import contextlib
import enum
import gzip
import io
import json
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

AT_ONCE = 500
"""Mutations that one child process reads."""

_MAP = b"type octile\nheight 4\nwidth 6\nmap\n..@...\n..@.@.\n..@...\n..@.S.\n"
_SCEN = (
    b"version"
    b" 1\n0\tseed.map\t6\t4\t0\t0\t1\t1\t1.41421356\n0\tseed.map\t6\t4\t3\t0\t5\t3\t4.41421356\n"
)
_WORLD = {
    "format": "srt-jax world",
    "version": 1,
    "bounds": [0, 0, 10, 10],
    "agent": {"position": [1.5, 1.5], "radius": 0.4},
    "goal": {"centre": [8.5, 8.5], "side": 1.0},
    "obstacles": [
        {"name": "wall", "destroyable": True, "polygon": [[[4, 0], [5, 0], [5, 10], [4, 10]]]},
        {
            "multipolygon": [
                [[[6, 1], [7, 1], [7, 2]]],
                [[[6, 4], [8, 4], [8, 6], [6, 6]], [[6.5, 4.5], [7, 4.5], [7, 5]]],
            ]
        },
    ],
}
_GEOJSON = {
    "type": "FeatureCollection",
    "bbox": [0, 0, 10, 10],
    "features": [
        {
            "type": "Feature",
            "properties": {"name": "a", "removal_cost": 2},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[[4, 0], [5, 0], [5, 10], [4, 10], [4, 0]]],
            },
        },
        {
            "type": "Feature",
            "properties": {"barrier": "fence"},
            "geometry": {
                "type": "GeometryCollection",
                "geometries": [
                    {"type": "LineString", "coordinates": [[1, 1], [2, 3]]},
                    {"type": "Point", "coordinates": [1, 1]},
                ],
            },
        },
    ],
}
_OSM = b"""<?xml version='1.0'?>
<osm version="0.6"><bounds minlat="60.0" minlon="25.0" maxlat="60.001" maxlon="25.002"/>
<node id="1" lat="60.0002" lon="25.0005" version="1"/>
<node id="2" lat="60.0002" lon="25.0010" version="1"/>
<node id="3" lat="60.0006" lon="25.0010" version="1"/>
<node id="4" lat="60.0006" lon="25.0005" version="1"/>
<way id="7" version="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
<tag k="building" v="yes"/></way>
<way id="8" version="1"><nd ref="1"/><nd ref="3"/><tag k="barrier" v="fence"/></way></osm>
"""
_YAML = (
    b"image: seed.pgm\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\noccupied_thresh:"
    b" 0.65\nfree_thresh: 0.196\n"
)
_PGM = b"P5\n6 4\n255\n" + bytes([254, 254, 0, 254, 254, 254] * 4)
_XML = (
    b"<root><map><width>3</width><height>2</height><cellsize>1</cellsize><startx>0</startx>"
    b"<starty>0</starty><finishx>2</finishx><finishy>1</finishy><grid><row>0 1 0</row>"
    b"<row>0 0 0</row></grid></map></root>"
)
_SVG = (
    b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 500 500"><namo_config><agent'
    b' agent_id="robot_0"><goal goal_id="goal_0"/></agent></namo_config><path id="robot_0"'
    b' type="robot" d="M 40 40 h 20 v 20 h -20 z"/><path id="goal_0" type="goal" d="M 440 440 h 20'
    b' v 20 h -20 z"/><path id="box" type="movable" d="M 200 0 L 230 0 L 230 500 L 200 500'
    b' Z"/></svg>'
)
_RULES = {
    "format": "srt-jax tag rules",
    "version": 1,
    "rules": [{"key": "building", "destroyable": False}, {"key": "barrier"}],
}
_DOMAIN = b"""(define (domain switch) (:requirements :strips :typing) (:types lamp) (:predicates
   (on ?l - lamp) (off ?l - lamp))
 (:action turn-on :parameters (?l - lamp) :precondition (off ?l) :effect (and (on ?l) (not
   (off ?l)))))
"""
_PROBLEM = (
    b"(define (problem p) (:domain switch) (:objects a b - lamp) (:init (off a) (off b)) (:goal"
    b" (and (on a) (on b))))\n"
)
_SIGNS = {"heuristic_signs": [{"name": "x", "unmet": {"*": 1}}]}
_MODEL = {
    "format": "sign_model world model, version 1",
    "signs": [
        {"name": "face", "image": [[["condition", ["nose"]]]], "meaning": []},
        {"name": "nose"},
    ],
}
_TABLE = {
    "directions": [["all", 0, 360]],
    "distances": [["close", 0, 50]],
    "relocations": [["on", "close", None]],
}
_MEMORY: dict[str, Any] = {"format": "sign_model memory, version 1", "precedents": []}

_PIECES = [
    *(
        b"[",
        b"{",
        b"(",
        b"<",
        b"]",
        b"}",
        b")",
        b'"',
        b"\0",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"\x1b[31m",
        b"\r",
        b" " * 99,
    ),
    *(
        b"1e400",
        b"-1",
        b"NaN",
        b"null",
        b"true",
        b"9" * 30,
        b"1" * 400,
        b"7" * 5000,
        b"-0.0",
        b"1e-400",
        b"\xed\xb2\x80",
    ),
    *(
        b"[" * 3000,
        b"(" * 3000,
        b"<a>" * 3000,
        b"99999999",
        b"{}",
        b"[]",
        b"*a",
        b"&a [*a]",
        b"/dev/zero",
        b"../",
    ),
]


class Outcome(enum.Enum):
    """How the reading of a file ended."""

    READ = "read"
    REFUSED = "refused"
    CRASHED = "crashed"
    HUNG = "hung"


def _npz() -> bytes:
    from srt_jax.formats.batch import write_batch
    from srt_jax.task import make_task, stack

    tasks = [
        make_task(np.array([[[-1, 0, -1], [-1, 0, 1]]]), (0, 0), (0, 2)),
        make_task(np.ones((2, 2), bool), (0, 0), (1, 1)),
    ]
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "seed.npz"
        write_batch(path, stack(tasks), names=["a", "b"], optimum=[1.0, 0.0])
        return path.read_bytes()


def _picture(form: str) -> Callable[[], bytes]:
    def made() -> bytes:
        from PIL import Image

        file = io.BytesIO()
        Image.fromarray(np.kron(np.eye(4, dtype=np.uint8), np.full((2, 2), 255, np.uint8))).save(
            file, format=form
        )
        return file.getvalue()

    return made


def _parquet() -> bytes:
    from srt_jax.answers.results_file import write_results

    record = {
        name: []
        for name in ("cells", "destroyed", "destroyed_at", "contour", "blocking", "separating")
    }
    record |= {
        "name": "a",
        "status": "SOLVED",
        "cost": 1.0,
        "removal_cost": 0.0,
        "removal_bound": 0.0,
        "seed": [0, 1],
    }
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "seed.parquet"
        write_results(path, [record | {"plan": [["pass", None, 1]], "explanation": "x"}])
        return path.read_bytes()


def _json(document: Any) -> Callable[[], bytes]:
    return lambda: json.dumps(document).encode()


SEEDS: dict[str, Callable[[], bytes]] = {
    "a.map": lambda: _MAP,
    "a.scen": lambda: _SCEN,
    "a.npz": _npz,
    "a.json": _json(_WORLD),
    "a.geojson": _json(_GEOJSON),
    "a.osm": lambda: _OSM,
    "a.osm.gz": lambda: gzip.compress(_OSM, mtime=0),
    "a.yaml": lambda: _YAML,
    "a.xml": lambda: _XML,
    "a.svg": lambda: _SVG,
    "a.pgm": lambda: _PGM,
    "a.png": _picture("png"),
    "a.tif": _picture("tiff"),
    "a.gif": _picture("gif"),
    "a.bmp": _picture("bmp"),
    "a.parquet": _parquet,
    "rules.json": _json(_RULES),
    "domain.pddl": lambda: _DOMAIN,
    "problem.pddl": lambda: _PROBLEM,
    "signs.json": _json(_SIGNS),
    "model.json": _json(_MODEL),
    "table.json": _json(_TABLE),
    "memory.json": _json(_MEMORY),
}
"""A right file of each format: a name that says which reader it is for, and what makes its
bytes.
"""


def mutate(content: bytes, *, seed: int | tuple[int, ...]) -> bytes:
    """Returns the bytes damaged in one to four places; the same seed damages them in the same
    way.
    """
    rng = np.random.default_rng(seed)
    if content.startswith(b"PK") and rng.random() < 0.6:
        return _repack(content, rng)
    damaged = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        _damage(damaged, rng)
    return bytes(damaged)


def _damage(content: bytearray, rng: np.random.Generator) -> None:
    at, length = int(rng.integers(0, len(content) + 1)), int(rng.integers(1, 20))
    match rng.integers(0, 7):
        case 0:
            content[at : at + 1] = bytes([int(rng.integers(0, 256))])
        case 1:
            del content[at : at + length]
        case 2:
            content[at:at] = content[at : at + 10 * length]
        case 3:
            del content[at:]
        case 4:
            content[at : at + length] = content[
                (other := int(rng.integers(0, len(content) + 1))) : other + length
            ]
        case _:
            content[at : at + int(rng.integers(0, 3))] = _PIECES[int(rng.integers(len(_PIECES)))]


def _repack(content: bytes, rng: np.random.Generator) -> bytes:
    """Returns a whole archive in which one member is damaged, missing or there twice."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: bytearray(archive.read(name)) for name in archive.namelist()}
    chosen = sorted(members)[int(rng.integers(len(members)))]
    if rng.random() < 0.1:
        del members[chosen]
    else:
        _damage(members[chosen], rng)
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, member in members.items():
            archive.writestr(zipfile.ZipInfo(name), bytes(member))
    return file.getvalue()


def read_one(path: pathlib.Path) -> tuple[Outcome, str]:
    """Reads a file by the reader that its name in `SEEDS` stands for; returns how that ended,
    and its message.
    """
    for name, content in (("seed.map", _MAP), ("seed.pgm", _PGM)):
        if not (path.parent / name).exists():
            (path.parent / name).write_bytes(content)
    try:
        _reader(path)
    except (ValueError, ImportError) as error:
        message = str(error)
        return (
            (Outcome.REFUSED, message)
            if "\n" not in message and message
            else (Outcome.CRASHED, f"not one line: {message!r}")
        )
    except _TooLong:
        return Outcome.HUNG, ""
    except Exception as error:
        return Outcome.CRASHED, f"{type(error).__name__}: {error}"
    return Outcome.READ, ""


def _reader(path: pathlib.Path) -> None:
    import sign_model
    from sign_model.experience.memory import load_memory
    from sign_model.map_algorithm.heuristics import load_signs
    from sign_model.signs.model_file import load_model
    from sign_model.space.fuzzy_table import load_table
    from srt_jax.answers.results_file import read_results
    from srt_jax.formats.outlines.tag_rules import read_rules
    from srt_jax.formats.reading import Reading
    from srt_jax.formats.task_files import read_tasks

    ends = Reading(start=(0, 0), goal=(3, 5))
    readers: dict[str, Callable[[], object]] = {
        "rules.json": lambda: read_rules(path),
        "signs.json": lambda: load_signs(path),
        "model.json": lambda: load_model(path),
        "table.json": lambda: load_table(path),
        "memory.json": lambda: load_memory(path),
        "domain.pddl": lambda: sign_model.load(path, _PROBLEM.decode()),
        "problem.pddl": lambda: sign_model.load(_DOMAIN.decode(), path),
        "a.parquet": lambda: read_results(path),
        "a.map": lambda: read_tasks(str(path), reading=ends),
        "a.geojson": lambda: read_tasks(str(path), reading=Reading(size=20)),
        "a.osm": lambda: read_tasks(str(path), reading=Reading(size=20)),
        "a.osm.gz": lambda: read_tasks(str(path), reading=Reading(size=20)),
    }
    readers.get(path.name, lambda: read_tasks(str(path)))()


class _TooLong(BaseException):
    """The seconds of a file are over."""


@contextlib.contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def stop(number: int, frame: object) -> None:
        raise _TooLong

    signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)


def _child(
    names: list[str], seed: int, first: int, count: int, seconds: float, gigabytes: float
) -> None:
    """Reads the mutations from `first` on; prints the number of each before, and a line of JSON
    after it.
    """
    warm = pathlib.Path(tempfile.mkdtemp())
    seeds = {name: SEEDS[name]() for name in names}
    for name, content in seeds.items():  # imports and compiles before memory is limited
        (warm / name).write_bytes(content)
        read_one(warm / name)
    now = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + int(gigabytes * 2**30),) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with tempfile.TemporaryDirectory() as folder:
        for number in range(first, first + count):
            name = names[number % len(names)]
            path = pathlib.Path(folder) / name
            path.write_bytes(mutate(seeds[name], seed=(seed, number)))
            print(number, flush=True)
            outcome, message = Outcome.HUNG, ""
            with contextlib.suppress(_TooLong), _time_limit(seconds):
                outcome, message = read_one(path)
            print(json.dumps([outcome.name, message]), flush=True)


def _run_child(
    options: argparse.Namespace, names: list[str], first: int, count: int
) -> list[tuple[int, Outcome, str]]:
    """Returns what became of each mutation; where the child dies, of that one, and the rest goes
    to another child.
    """
    command = [sys.executable, "-m", "experiments.campaigns.readers", "--child", f"{first},{count}"]
    command += ["--seed", str(options.seed), "--formats", ",".join(names)]
    command += ["--seconds", str(options.seconds), "--gigabytes", str(options.gigabytes)]
    done = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace"
    )
    try:
        out, err = done.communicate(timeout=600 + count * options.seconds / 10)
        died = Outcome.CRASHED
    except subprocess.TimeoutExpired:
        done.kill()
        out, err = done.communicate()
        died = Outcome.HUNG
    found: list[tuple[int, Outcome, str]] = []
    number = None
    for line in out.splitlines():
        if line.startswith("["):
            name, message = json.loads(line)
            found.append((number if number is not None else first, Outcome[name], message))
            number = None
        elif line.isdigit():
            number = int(line)
    if len(found) < count:
        if number is None and not found:
            raise RuntimeError(f"a child process cannot start: {err[-2000:]}")
        place = first + len(found)
        found.append((place, died, f"the process ended with code {done.returncode}: {err[-300:]}"))
        if (rest := first + count - place - 1) > 0:
            found += _run_child(options, names, place + 1, rest)
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--formats", default=",".join(SEEDS), help="names, or parts of them, separated by commas"
    )
    parser.add_argument(
        "--seconds", type=float, default=20.0, help="that the reading of one file may take"
    )
    parser.add_argument(
        "--gigabytes", type=float, default=2.0, help="of memory beyond what the libraries take"
    )
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    names = [name for name in SEEDS if any(part in name for part in options.formats.split(","))]
    if options.child:
        first, count = map(int, options.child.split(","))
        _child(names, options.seed, first, count, options.seconds, options.gigabytes)
        return 0
    totals: dict[str, Counter[Outcome]] = {name: Counter() for name in names}
    for first in range(0, options.count, AT_ONCE):
        for number, outcome, message in _run_child(
            options, names, first, min(AT_ONCE, options.count - first)
        ):
            name = names[number % len(names)]
            totals[name][outcome] += 1
            if outcome in (Outcome.CRASHED, Outcome.HUNG):
                print(
                    f"{name}, mutate(..., seed=({options.seed}, {number})): {outcome.value}"
                    f" {message}",
                    file=sys.stderr,
                )
        print(f"{min(first + AT_ONCE, options.count)} mutations", file=sys.stderr, flush=True)
    for name, counts in totals.items():
        print(f"{name:14s}", ", ".join(f"{counts[outcome]} {outcome.value}" for outcome in Outcome))
    crashes, hangs = (
        sum(counts[outcome] for counts in totals.values())
        for outcome in (Outcome.CRASHED, Outcome.HUNG)
    )
    print(f"{options.count} mutations, {crashes} crashes, {hangs} hangs")
    return int(crashes + hangs > 0)


if __name__ == "__main__":
    sys.exit(main())
