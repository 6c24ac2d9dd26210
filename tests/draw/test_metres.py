"""Pictures in metres, and the way as near as one gets as a dashed line."""

import re

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from srt_jax import Frame, approach, make_task, solve
from srt_jax.draw import animate, contact_sheet, draw, svg_tile
from srt_jax.draw.parts.canvas import Canvas
from srt_jax.draw.parts.colours import Kind
from srt_jax.draw.parts.content import scene_of
from srt_jax.draw.parts.legend import handles
from srt_jax.draw.picture import draw_map, label_axes


@pytest.fixture(scope="module")
def unsolved():
    free = np.ones((20, 30), bool)
    free[:, 15] = False
    task = make_task(free, (10, 2), (4, 27), destroyable=False)
    return task, solve(task)


FRAME = Frame.over((-3.0, 2.0), 0.5, height=20, width=30)


def test_the_way_as_near_as_one_gets_is_a_dashed_line_with_an_entry(unsolved):
    task, solution = unsolved
    scene = scene_of(task, solution)
    near = approach(task)
    assert np.array_equal(scene.approach, np.asarray(near.cells)[: int(near.num_cells)])
    assert scene.headline.endswith("one gets within 13.0 cell sides of the goal")
    assert scene_of(task, solution, frame=FRAME).headline.endswith("within 6.50 m of the goal")
    assert "as near as one gets" in [entry.get_label() for entry in handles([scene])]
    assert "stroke-dasharray" in svg_tile(task, solution)
    axes = Figure().add_subplot()
    draw_map(axes, scene)
    drawn = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert len(drawn) == 1
    xy = np.stack(drawn[0].get_data(), axis=1)
    assert np.array_equal(xy[:, ::-1], scene.approach)


def test_axes_are_in_metres_where_the_map_has_them(unsolved):
    task, solution = unsolved
    axes = Figure().add_subplot()
    scene = scene_of(task, solution, frame=FRAME)
    draw_map(axes, scene)
    label_axes(axes, scene)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x, metres", "y, metres")
    for axis, place in ((axes.xaxis, 0), (axes.yaxis, 1)):
        ticks = list(zip(axis.get_ticklocs(), axis.get_ticklabels()))
        assert len(ticks) >= 3
        for at, label in ticks:
            # where a whole cell's centre lies, the tick says its metres
            row, col = (0.0, at) if place == 0 else (at, 0.0)
            x, y = -3 + (col + 0.5) * 0.5, 2 + (19 - row + 0.5) * 0.5
            assert float(label.get_text().replace("−", "-")) == pytest.approx((x, y)[place])
    turned = Frame.over((-3.0, 2.0), 0.5, height=20, width=30, yaw=np.pi / 2)
    label_axes(axes, scene_of(task, solution, frame=turned))
    assert axes.get_xlabel() == "x, metres, turned by 90 degrees"
    bare = scene_of(task, solution, frame=Frame.of_cells(20, 30))
    assert bare.frame is None and "cell sides" in bare.headline


def test_a_solved_task_has_no_such_line_and_its_length_in_metres(tmp_path):
    free = np.ones((6, 9), bool)
    free[:, 4] = False
    task = make_task(free, (0, 0), (0, 8))
    solution = solve(task)
    frame = Frame.over((0.0, 0.0), 0.25, height=6, width=9)
    scene = scene_of(task, solution, frame=frame)
    assert scene.approach is None and "route of 2.00 m" in scene.headline
    draw(task, solution, tmp_path / "a.svg", frame=frame)
    assert len(re.findall("<svg", (tmp_path / "a.svg").read_text())) == 1
    captions = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Canvas, "frame", lambda *args, **_: captions.append(args[3]))
        patch.setattr(Axes, "set_title", lambda *args, **_: captions.append(args[1]))
        patch.setattr("srt_jax.draw.animation.save_gif", lambda path, shown: None)
        animate(task, solution, tmp_path / "a.gif", frame=frame)
        contact_sheet([("a", task, solution)] * 2, tmp_path / "b.svg", frames=[frame, None])
    assert captions[-3:] == [
        "At the goal: 2.00 m, 1 obstacle destroyed",
        "a\nSOLVED, 1 destroyed, 2.00 m",
        "a\nSOLVED, 1 destroyed",
    ]


def test_what_stays_under_another_obstacle_is_not_shown_as_gone():
    labels = np.full((2, 3, 7), -1, np.int32)
    labels[0, :, 3] = 1
    labels[0, 1, 3] = 0
    labels[1, 1, 3] = -1
    labels[1, 2, 3] = 0  # the door reaches under the wall
    task = make_task(labels, (1, 0), (1, 6), destroyable=[True, False])
    scene = scene_of(task, solve(task))
    assert scene.kinds[:, 3].tolist() == [Kind.INDESTRUCTIBLE, Kind.DESTROYED, Kind.INDESTRUCTIBLE]
