"""A small right file of every format, for the campaign that damages them (`readers`)."""

import gzip
import io
import json
import pathlib
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np

MAP = b"type octile\nheight 4\nwidth 6\nmap\n..@...\n..@.@.\n..@...\n..@.S.\n"
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
PGM = b"P5\n6 4\n255\n" + bytes([254, 254, 0, 254, 254, 254] * 4)
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
DOMAIN = b"""(define (domain switch) (:requirements :strips :typing) (:types lamp) (:predicates
   (on ?l - lamp) (off ?l - lamp))
 (:action turn-on :parameters (?l - lamp) :precondition (off ?l) :effect (and (on ?l) (not
   (off ?l)))))
"""
PROBLEM = (
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
    "a.map": lambda: MAP,
    "a.scen": lambda: _SCEN,
    "a.npz": _npz,
    "a.json": _json(_WORLD),
    "a.geojson": _json(_GEOJSON),
    "a.osm": lambda: _OSM,
    "a.osm.gz": lambda: gzip.compress(_OSM, mtime=0),
    "a.yaml": lambda: _YAML,
    "a.xml": lambda: _XML,
    "a.svg": lambda: _SVG,
    "a.pgm": lambda: PGM,
    "a.png": _picture("png"),
    "a.tif": _picture("tiff"),
    "a.gif": _picture("gif"),
    "a.bmp": _picture("bmp"),
    "a.parquet": _parquet,
    "rules.json": _json(_RULES),
    "domain.pddl": lambda: DOMAIN,
    "problem.pddl": lambda: PROBLEM,
    "signs.json": _json(_SIGNS),
    "model.json": _json(_MODEL),
    "table.json": _json(_TABLE),
    "memory.json": _json(_MEMORY),
}
"""A right file of each format: a name that says which reader it is for, and what makes its
bytes.
"""
