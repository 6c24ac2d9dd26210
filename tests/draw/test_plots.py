"""Plots of many answers: what stands on the axes, and that a column of a paper can hold it."""

import io

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.figure import Figure

from srt_jax.draw import bound_against_cost, boxes_by_kind, time_against_size
from srt_jax.draw.plots import kind_of


def answers(modes=("least", "paper")):
    rng = np.random.default_rng(0)
    return [
        {
            "name": f"{kind}-{number:04d}",
            "mode": mode,
            "is_solved": number > 0,
            "length": None if number == 0 else float(rng.uniform(10, 60)),
            "removal_cost": None if number == 0 else float(number),
            "removal_bound": None if number == 0 else float(min(number, 6)),
            "height": 2**number,
            "width": 64,
            "seconds": 0.001 * 2**number,
        }
        for mode in modes
        for kind in ("half", "double-wall", "bagel")
        for number in range(8)
    ]


def axes():
    return Figure().subplots()


def test_a_box_stands_for_each_kind_and_mode():
    drawn = axes()
    boxes_by_kind(answers(), "length", axes=drawn)
    assert [text.get_text() for text in drawn.get_xticklabels()] == ["half", "double-wall", "bagel"]
    assert len([patch for patch in drawn.patches if patch.get_alpha() == 0.75]) == 6
    assert [text.get_text() for text in drawn.get_legend().get_texts()] == ["least", "paper"]
    other = axes()
    boxes_by_kind(answers(["least"]), "length", kinds=["all"] * 24, axes=other)
    assert len(other.get_xticklabels()) == 1 and other.get_legend() is None


def test_bounds_and_times_stand_where_they_belong():
    drawn = axes()
    bound_against_cost(answers(["least"]), axes=drawn)
    diagonal, points = drawn.lines
    assert (diagonal.get_xdata() == diagonal.get_ydata()).all()
    assert len(points.get_xdata()) == 21 and (points.get_ydata() <= points.get_xdata()).all()
    assert drawn.get_title() == "18 of 21 answers proven least"
    timed = axes()
    time_against_size(answers(["least"]), axes=timed)
    assert timed.get_xscale() == timed.get_yscale() == "log"
    assert timed.lines[0].get_xdata()[3] == 512


@pytest.mark.parametrize("plot", [boxes_by_kind, bound_against_cost, time_against_size])
def test_a_plot_is_a_column_wide_and_its_text_is_legible(plot, tmp_path):
    from PIL import Image

    picture = plot(answers())
    assert Image.open(io.BytesIO(picture.png)).width == round(3.4 * 150)
    plot(answers(), path=tmp_path / "plot.svg")
    assert (tmp_path / "plot.svg").stat().st_size > 3000


def test_what_cannot_be_plotted_is_named():
    with pytest.raises(
        ValueError, match=r"no column is called 'height_m'.*it has height, is_solved, "
    ):
        boxes_by_kind(answers(), "height_m")
    with pytest.raises(ValueError, match="24 answers and 1 kinds"):
        boxes_by_kind(answers(["least"]), kinds=["half"])
    with pytest.raises(ValueError, match=r"'seconds' holds no number: give srt_jax.table sec"):
        time_against_size([row | {"seconds": None} for row in answers()])
    with pytest.raises(
        TypeError, match=r"a plot takes the table of srt_jax.table, a pandas or pol"
    ):
        boxes_by_kind("answers.csv")
    with pytest.raises(ValueError, match="onto axes or to a path"):
        bound_against_cost(answers(), "plot.png", axes=axes())


def test_a_frame_is_as_good_as_the_table_and_axes_as_a_file():
    pandas = pytest.importorskip("pandas")
    frame, on_axes = pandas.DataFrame(answers()), axes()
    assert isinstance(frame["length"][0], float)
    boxes_by_kind(frame, "length", on_axes)
    assert [text.get_text() for text in on_axes.get_xticklabels()] == [
        "half",
        "double-wall",
        "bagel",
    ]
    assert boxes_by_kind(frame).png == boxes_by_kind(answers()).png


def test_kinds_are_read_off_names():
    assert kind_of("double-wall-0003") == "double-wall" and kind_of("my-task") == "my-task"
