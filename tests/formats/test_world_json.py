"""Worlds as JSON: read back equal, and refused with the place in the document."""

import copy
import json
import pathlib

import pytest

from srt_jax.formats.world_json import read_world, write_world
from srt_jax.geometry.raster import rasterize
from srt_jax.geometry.world import Obstacle, World

SQUARE = [[1, 1], [3, 1], [3, 3], [1, 3]]
DOCUMENT = {
    "format": "srt-jax world",
    "version": 1,
    "bounds": [0, 0, 10, 8],
    "agent": {"position": [0.5, 0.5], "radius": 0.4},
    "goal": {"centre": [8, 6], "side": 1},
    "obstacles": [
        {"polygon": [SQUARE]},
        {
            "name": "Дом",
            "destroyable": False,
            "removal_cost": 2.5,
            "multipolygon": [[SQUARE], [[[5, 5], [6, 5], [6, 6]]]],
        },
    ],
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "world.json"


def test_a_document_is_read_with_its_defaults(path):
    path.write_text(json.dumps(DOCUMENT), encoding="utf-8")
    first, second = (world := read_world(path)).obstacles
    assert (
        first == Obstacle.polygon(SQUARE)
        and first.destroyable
        and first.removal_cost == 1
        and first.name == ""
    )
    assert (
        second.name == "Дом"
        and not second.destroyable
        and second.removal_cost == 2.5
        and len(second.parts) == 2
    )
    assert world == World(
        bounds=(0, 0, 10, 8),
        obstacles=(first, second),
        position=(0.5, 0.5),
        radius=0.4,
        goal=((8, 6), 1),
    )


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_world_is_read_back_equal(path, count):
    yard = Obstacle.polygon(
        SQUARE, [(1.5, 1.5), (2, 1.5), (2.1, 2.123456789)], name='a "yard"', removal_cost=0.1
    )
    twins = Obstacle([[SQUARE], [[(4, 4), (5, 4), (1e3 / 3, 5)]]], destroyable=False)
    goal = [(8, 5), (9, 6), (8, 7), (7, 6)]
    world = World(
        bounds=(0, -1 / 3, 10, 8),
        obstacles=(yard, twins)[:count],
        position=(0.1, 0.2),
        radius=0.3,
        goal=goal,
    )
    write_world(path, world)
    assert read_world(path) == world


def changed(*places, to):
    document = copy.deepcopy(DOCUMENT)
    at = document
    for place in places[:-1]:
        at = at[place]
    if to is None:
        del at[places[-1]]
    else:
        at[places[-1]] = to
    return json.dumps(document)


@pytest.mark.parametrize(
    ("message", "content"),
    [
        (":1: no whole JSON file", ""),
        (":1: no whole JSON file", json.dumps(DOCUMENT)[:100]),
        (":10: no whole JSON file", json.dumps(DOCUMENT, indent=1)[:90]),
        (": the file must be an object", "[]"),
        (": nested too deeply", "[" * 100_000),
        (": the member 'a' is given twice", '{"a": 1, "a": 2}'),
        (": NaN is no coordinate", changed("bounds", 0, to=float("nan"))),
        (": the file lacks 'goal'", changed("goal", to=None)),
        (": the file has the unknown member 'color'", changed("color", to=1)),
        (": format 'srt-jax world' version 2 is not read", changed("version", to=2)),
        (": format 'srt-jax world' version True is not read", changed("version", to=True)),
        (": agent lacks 'radius'", changed("agent", "radius", to=None)),
        (": agent must be an object", changed("agent", to=[0, 0])),
        (": goal has the unknown member 'center'", changed("goal", "center", to=[1, 1])),
        (": obstacles must be a list", changed("obstacles", to={})),
        (": obstacles[1] must be an object", changed("obstacles", 1, to=5)),
        (": obstacles[0] lacks 'polygon'", changed("obstacles", 0, to={})),
        (
            ": obstacles[1] has the unknown member 'polygon'",
            changed("obstacles", 1, "polygon", to=[SQUARE]),
        ),
        (": obstacles[0]: name must be a text", changed("obstacles", 0, "name", to=5)),
        (
            ": obstacles[0]: destroyable of an obstacle must be True",
            changed("obstacles", 0, "destroyable", to="yes"),
        ),
        (
            ": obstacles[0]: removal_cost of an obstacle is -1",
            changed("obstacles", 0, "removal_cost", to=-1),
        ),
        (
            ": obstacles[0]: a ring of an obstacle has 2 different",
            changed("obstacles", 0, "polygon", to=[SQUARE[:2]]),
        ),
        (
            ": obstacles[0]: an obstacle is no polygon",
            changed("obstacles", 0, "polygon", to=[[[0, 0], [2, 2], [2, 0], [0, 2]]]),
        ),
        (
            ": obstacles[0]: an obstacle must be a sequence",
            changed("obstacles", 0, "polygon", to=1),
        ),
        (": the goal square's side, 0.5 m", changed("goal", "side", to=0.5)),
        (": the agent's position (50, 0) lies outside", changed("agent", "position", to=[50, 0])),
        (": radius must be a number", changed("agent", "radius", to="0.4")),
    ],
)
def test_a_bad_document_is_refused_with_its_place(path, message, content):
    path.write_text(content, encoding="utf-8")
    with pytest.raises(ValueError) as caught:
        read_world(path)
    assert f"{path}{message}" in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_file_and_one_that_is_no_text_are_refused(path):
    with pytest.raises(ValueError, match="no such file"):
        read_world(path)
    path.write_bytes(b"\x80\x81\x82")
    with pytest.raises(ValueError, match="no JSON text in UTF-8"):
        read_world(path)


def test_crossing_rings_are_repaired_when_asked(path):
    pytest.importorskip("shapely")
    path.write_text(changed("obstacles", 0, "polygon", to=[[[0, 0], [2, 2], [2, 0], [0, 2]]]))
    assert len(read_world(path, repair=True).obstacles[0].parts) == 2


def test_the_example_in_the_docs_is_read_and_rasterised(path):
    text = (pathlib.Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")
    (example,) = (
        block.split("```")[0] for block in text.split("```json")[1:] if "srt-jax world" in block
    )
    path.write_text(example, encoding="utf-8")
    world = read_world(path)
    task = rasterize(world)
    assert [obstacle.name for obstacle in world.obstacles] == [
        "fence",
        "house with a courtyard",
        "two sheds",
    ]
    assert (
        task.size.tolist() == [30, 40]
        and task.start.tolist() == [27, 2]
        and task.goal.tolist() == [5, 36]
    )
    assert task.destroyable.tolist() == [True, False, True]
    assert (
        (task.labels == 0).sum() == 30
        and (task.labels == 1).sum() == 100 - 16
        and (task.labels == 2).sum() == 6
    )
