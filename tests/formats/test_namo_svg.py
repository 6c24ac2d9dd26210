"""NAMO scenes as SVG: paths, transforms, fillings, robot and goal; namosim's own scenes; broken
files refused.
"""

import numpy as np
import pytest

from srt_jax import rasterize
from srt_jax.formats.namo_svg import read_namo
from srt_jax.formats.notes import Notes
from srt_jax.formats.outlines.svg_path import filled, outlines, transform_of
from srt_jax.types import FREE
from tests.helpers.odd import refusals

SCENE = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 400 300"
  width="400cm" height="300cm">
  <namo_config cell_size_cm="10"><agent agent_id="robot"><goal goal_id="end"/></agent></namo_config>
  <defs><path id="unused" type="wall" d="M 0 0 H 9 V 9 z"/></defs>
  <path id="wall" type="wall" d="M 200,0 h 40 v 200 h -40 z"/>
  <g transform="translate(200, 200)">
    <path id="box" type="movable" d="m 0 0 l 40 0 0 100 -40 0 z"/></g>
  <path id="robot" type="shape" d="M 30 50 a 20 20 0 1 0 40 0 a 20 20 0 1 0 -40 0 z"/>
  <path id="end" type="shape" d="M 330 230 h 40 v 40 h -40 z"/>
  <path id="grass" type="lawn" d="M 0 0 H 9 V 9 z"/>
</svg>"""


@pytest.fixture
def read(tmp_path):
    def reading(text, **options):
        path = tmp_path / "scene.svg"
        path.write_text(text)
        notes = Notes()
        return read_namo(path, notes=notes, **options), notes

    return reading


def test_a_scene_is_a_world_in_metres_with_north_up(read):
    world, notes = read(SCENE)
    wall, box = world.obstacles
    assert (
        world.bounds == (0, 0, 4, 3)
        and world.position == (0.5, 2.5)
        and world.goal_centre == (3.5, 0.5)
    )
    assert world.radius == pytest.approx(0.2, rel=1e-5) and world.goal_side == pytest.approx(
        0.4004, abs=1e-5
    )
    assert (wall.name, wall.destroyable, box.name, box.destroyable) == ("wall", False, "box", True)
    assert set(wall.parts[0][0]) == {(2.0, 3.0), (2.4, 3.0), (2.4, 1.0), (2.0, 1.0)}
    assert set(box.parts[0][0]) == {(2.0, 1.0), (2.4, 1.0), (2.4, 0.0), (2.0, 0.0)}
    assert [str(note) for note in notes] == [
        "drawings passed over: neither wall nor movable: 1, such as grass"
    ]
    assert read(SCENE, cell_side=0.5)[0].goal_side == 0.5
    assert rasterize(read(SCENE, cell_side=0.5)[0]).labels.shape == (1, 6, 8)
    with pytest.raises(ValueError, match=r"must exceed 2 R"):
        read(SCENE, cell_side=0.3)


def test_further_robots_and_goals_are_passed_over_and_noted(read):
    more = SCENE.replace(
        '<goal goal_id="end"/>', '<goal goal_id="end"/><goal goal_id="e2"/>'
    ).replace("</namo_config>", '<agent agent_id="r2"/></namo_config>')
    noted = " | ".join(str(note) for note in read(more)[1])
    assert (
        "robots after the first, passed over: 1, such as r2" in noted
        and "goals after the first, passed over: 1" in noted
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("M 1 2 L 3 4 5 6 Z", [[(1, 2), (3, 4), (5, 6)]]),
        ("m1,2 3,4-5.5.5z", [[(1, 2), (4, 6), (-1.5, 6.5)]]),
        ("M0 0H5V4h-2v-1e0z", [[(0, 0), (5, 0), (5, 4), (3, 4), (3, 3)]]),
        ("M0 0 1 0 1 1zm5 5 1 0 0 1z", [[(0, 0), (1, 0), (1, 1)], [(5, 5), (6, 5), (6, 6)]]),
        ("M1 1 2 1 2 2z l-1 0 0 -1z", [[(1, 1), (2, 1), (2, 2)], [(1, 1), (0, 1), (0, 0)]]),
        ("", []),
    ],
)
def test_straight_paths_are_read_point_by_point(text, expected):
    assert [[tuple(point) for point in line.tolist()] for line in outlines(text)] == expected


def test_arcs_and_curves_run_where_they_should():
    circle = np.concatenate(outlines("M 30 50 a 20 20 0 1 0 40 0 20 20 0 10-40 0z"))
    np.testing.assert_allclose(np.hypot(*(circle - (50, 50)).T), 20, atol=1e-9)
    assert len(circle) > 60
    (quarter,) = outlines("M 1 0 A 1 1 0 0 1 0 1")  # clockwise on the screen, as y points down
    np.testing.assert_allclose(quarter[8], np.sqrt([0.5, 0.5]), atol=1e-9)
    (turned,) = outlines("M 0 0 A 2 1 90 0 1 0 4")  # an ellipse on its head, twice as high as wide
    np.testing.assert_allclose(turned[:, 0].max() - turned[:, 0].min(), 1, atol=1e-9)
    (enlarged,) = outlines("M 0 0 A 1 1 0 0 1 10 0")
    np.testing.assert_allclose(enlarged[:, 1].min(), -5, atol=1e-9)
    (cubic,) = outlines("M0 0C0 1 1 1 1 0S2-1 2 0")
    np.testing.assert_allclose(
        cubic[[8, 16, 24, 32]], [(0.5, 0.75), (1, 0), (1.5, -0.75), (2, 0)], atol=1e-12
    )
    (quadratic,) = outlines("M0 0q1 2 2 0t2 0")
    np.testing.assert_allclose(quadratic[[8, 16, 24]], [(1, 1), (2, 0), (3, -1)], atol=1e-12)


def test_the_filling_of_nested_outlines_follows_their_turn_or_their_number():
    def square(low, high, *, turned=False):
        ring = np.array([(low, low), (high, low), (high, high), (low, high)], float)
        return ring[::-1] if turned else ring

    outer, same, hole, island = square(0, 9), square(1, 8), square(2, 7, turned=True), square(3, 6)
    counts = [
        [len(part) for part in filled([outer, hole], is_even_odd=even)] for even in (False, True)
    ]
    assert counts == [[2], [2]]
    assert [len(part) for part in filled([island, outer, hole], is_even_odd=False)] == [2, 1]
    assert [len(part) for part in filled([outer, same], is_even_odd=False)] == [1]
    assert [len(part) for part in filled([outer, same], is_even_odd=True)] == [2]
    assert [len(part) for part in filled([outer, square(10, 12)], is_even_odd=True)] == [1, 1]


def test_a_wall_round_a_room_leaves_the_room_free(read):
    room = "M 200 0 h 100 v 100 h -100 z m 20 20 v 60 h 60 v -60 z"
    world, notes = read(SCENE.replace("M 200,0 h 40 v 200 h -40 z", room), cell_side=0.41)
    assert len(world.obstacles[0].parts[0]) == 2 and len(list(notes)) == 1
    world, _ = read(
        SCENE.replace("M 200,0 h 40 v 200 h -40 z", room).replace(
            'viewBox="0 0', 'viewBox="-40 -30'
        ),
        cell_side=0.5,
    )
    assert world.bounds == (-0.4, 0.0, 3.6, 3.0) and world.position == (0.5, 2.2)


def test_transforms_are_matrices_from_right_to_left():
    def of(text, point):
        return (transform_of(text) @ [*point, 1])[:2].round(9).tolist()

    assert of("translate(1 2) scale(3)", (1, 1)) == [4, 5]
    assert of("rotate(90)", (1, 0)) == [0, 1] and of("rotate(90, 1, 1)", (2, 1)) == [1, 2]
    assert of("matrix(1,2,3,4,5,6)", (1, 1)) == [9, 12]
    assert of("skewX(45)", (0, 1)) == [1, 1] and of("skewY(45)", (1, 0)) == [1, 1]
    assert of("", (7, 8)) == [7, 8]
    wrong = ("turn(3)", "scale()", "translate(1", "matrix(1 2 3)")
    units = ("translate(10px, 5)", "scale(nan 2)", "rotate(90deg)", "translate(inf 1 2)")
    for text in (*wrong, *units, "rotate(1e400)", "translate(1e999 0)", "skewX(-1e400)"):
        with pytest.raises(ValueError, match="transform"):
            transform_of(text)


BAD = {
    "no goal": (SCENE.replace('<goal goal_id="end"/>', ""), "no <goal>"),
    "a goal that is not drawn": (
        SCENE.replace('path id="end"', 'path id="other"'),
        "the goal 'end' is not drawn",
    ),
    "a robot that is not drawn": (
        SCENE.replace('agent_id="robot"', 'agent_id="r9"'),
        "the robot 'r9' is not drawn",
    ),
    "no scene": (SCENE.replace("agent", "agents"), "no <namo_config> with an <agent>"),
    "no SVG": ("<html/>", "its root is <html>"),
    "no XML": ("<svg>", "no whole XML"),
    "no box": (SCENE.replace("viewBox", "viewbox"), "viewBox must hold"),
    "a box of no size": (SCENE.replace("0 0 400 300", "0 0 0 300"), "viewBox must hold"),
    "a path that is none": (
        SCENE.replace("M 200,0 h 40", "M 200,0 w 40"),
        "the path 'wall': .* lacks a number|expected",
    ),
    "a path without a start": (SCENE.replace("M 200,0 h 40", "h 40"), "begins with M"),
    "a robot outside": (SCENE.replace("M 30 50", "M 930 50"), "position .* outside the bounds"),
    "a robot of no size": (
        SCENE.replace('d="M 30 50 a 20 20 0 1 0 40 0 a 20 20 0 1 0 -40 0 z"', 'd="M 30 50"'),
        "the robot 'robot' has no size",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_scenes_are_refused_in_one_line(read, case):
    text, message = BAD[case]
    with pytest.raises(ValueError, match=message) as caught:
        read(text)
    assert "scene.svg" in str(caught.value) and "\n" not in str(caught.value)


def test_damaged_scenes_are_refused_in_one_line(tmp_path):
    assert refusals(read_namo, tmp_path / "scene.svg", SCENE.encode(), count=100) > 50


@pytest.mark.parametrize(
    ("name", "num_boxes", "size"),
    [
        ("1_robot_2_obstacles", 2, (15.3, 13.5)),
        ("minimal_stilman_2005", 1, (1.5186302, 1.4725102)),
        ("willow_garage_center_small", 13, (8.6725342, 14.904243)),
    ],
)
def test_the_scenes_of_namosim_are_read_whole(shared_data, name, num_boxes, size):
    notes = Notes()
    world = read_namo(shared_data / "namo" / f"{name}.svg", notes=notes)
    assert world.bounds[2:] == size and len(notes) == 0
    assert sum(obstacle.destroyable for obstacle in world.obstacles) == num_boxes
    task = rasterize(world)
    assert (task.labels[:, *task.start] == FREE).all() and (
        task.labels[:, *task.goal] == FREE
    ).all()
