"""Pictures: what they show, that nothing lies over another, that colour-blind people can tell the
colours apart.
"""

import io
import itertools
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from srt_jax import Frame, make_task, solve, stack
from srt_jax.draw import PolarFrame, animate, contact_sheet, draw, svg_tile
from srt_jax.draw.parts.badges import place_badges
from srt_jax.draw.parts.colours import LEGS, PALETTE, Kind, rgb, shrunk
from srt_jax.draw.parts.content import legs_of, scene_of
from srt_jax.draw.parts.legend import handles
from srt_jax.draw.parts.tile import png_of
from srt_jax.draw.stages import stages_of

pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

SIDE = 16


def case(name):
    """Tasks of one shape, so that they are compiled once."""
    labels = np.full((SIDE, SIDE), -1, np.int32)
    labels[5] = 0
    labels[10, :8], labels[10, 8:] = 1, 2
    labels[13, 2:5] = 3
    start, goal, destroyable = (0, 1), (15, 14), [True, True, False, True]
    if name == "open":
        labels[:] = np.where(labels == 3, 3, -1)
    elif name == "indestructible":
        destroyable = False
    elif name == "start blocked":
        start = (5, 5)
    elif name == "goal blocked":
        goal, destroyable = (5, 5), False
    task = make_task(labels, start, goal, destroyable=destroyable)
    return task, solve(task)


CASES = ("two walls", "open", "indestructible", "start blocked", "goal blocked")


@pytest.fixture(scope="module")
def solved():
    return {name: case(name) for name in CASES}


def test_the_scene_says_what_each_cell_is(solved):
    scene = scene_of(*solved["two walls"])
    assert (scene.kinds[0] == Kind.REACHED).all() and (scene.kinds[4] == Kind.CONTOUR).all()
    assert (scene.kinds[5] == Kind.DESTROYED).all() and (
        scene.kinds[10, :8] == Kind.DESTROYED
    ).all()
    assert (scene.kinds[10, 8:] == Kind.INDESTRUCTIBLE).all() and (
        scene.kinds[13, 2:5] == Kind.DESTROYABLE
    ).all()
    assert (scene.kinds[15] == Kind.UNREACHED).all()
    assert [removal.obstacle for removal in scene.removals] == [
        0,
        1,
    ] and "2 obstacles destroyed" in scene.headline


def test_a_route_is_cut_where_something_is_destroyed(solved):
    _, solution = solved["two walls"]
    legs = legs_of(solution)
    assert len(legs) == 3
    assert all((before[-1] == after[0]).all() for before, after in itertools.pairwise(legs))
    assert sum(len(leg) - 1 for leg in legs) == int(solution.num_cells) - 1
    assert len(legs_of(solved["open"][1])) == 1 and legs_of(solved["indestructible"][1]) == []


@pytest.mark.parametrize("name", CASES)
def test_the_stages_end_at_the_goal_or_where_no_way_is_left(name, solved):
    task, solution = solved[name]
    stages = stages_of(task, solution)
    assert len(stages) == int(solution.num_destroyed) + 1
    assert stages[0].place == tuple(task.start.tolist())
    assert stages[-1].sees_goal == (name in ("two walls", "open"))
    np.testing.assert_array_equal(stages[0].contour, solution.contour)
    assert [stage.sees_goal for stage in stages[:-1]] == [False] * (len(stages) - 1)
    if name == "two walls":
        assert [stage.removals[0].obstacle for stage in stages[:-1]] == [0, 1]
        assert tuple(stages[-1].leg[-1].tolist()) == (15, 14)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize(
    "polar", [None, PolarFrame(metres_per_cell=20.0), PolarFrame(heading=90.0)]
)
def test_no_text_lies_over_another_or_leaves_the_page(name, polar, solved, tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    pages = []
    monkeypatch.setattr(
        Figure, "savefig", lambda self, file, **options: pages.append(self) or file.write(b"x")
    )
    draw(
        *solved[name],
        tmp_path / "p.png",
        title="a title that is long enough to be broken into lines " * 3,
        polar=polar,
    )
    (figure,) = pages
    (axes,) = figure.axes
    figure.draw_without_rendering()
    texts = [
        axes.title,
        axes.xaxis.label,
        axes.yaxis.label,
        *axes.texts,
        *figure.legends[0].get_texts(),
    ]
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if text.get_text()]
    assert len(boxes) > 6
    for (one, here), (other, there) in itertools.combinations(boxes, 2):
        assert not here.overlaps(there), (one, other)
    for text, box in boxes:
        assert (
            box.x0 >= 0
            and box.y0 >= 0
            and box.x1 <= figure.bbox.width
            and box.y1 <= figure.bbox.height
        ), text


def test_badges_keep_clear_of_marks_and_of_each_other(solved):
    scene = scene_of(*solved["two walls"])
    scale = 20.0
    marks = np.array(
        [scene.start, scene.goal, scene.seed, *(removal.standing for removal in scene.removals)],
        float,
    )
    marks = (marks[:, ::-1] + 0.5) * scale
    places = place_badges(scene, marks, scale, (SIDE * scale, SIDE * scale))
    for one, other in itertools.combinations([*marks[3:], *places], 2):
        assert np.hypot(*(one - other)) > 12
    # no room anywhere: still placed, on the obstacle
    tight = place_badges(scene, marks / 20, 1.0, (SIDE, SIDE))
    assert len(tight) == 2 and all((place >= 0).all() and (place <= SIDE).all() for place in tight)


def test_the_legend_names_what_is_there_and_nothing_else(solved):
    names = {handle.get_label() for handle in handles([scene_of(*solved["open"])])}
    assert names == {"reached at first", "destroyable obstacle", "start", "goal", "route"}
    names = {handle.get_label() for handle in handles([scene_of(*solved["two walls"])])}
    assert {
        "seed",
        "contour",
        "destroyed",
        "destroys from here",
        "leg 1",
        "leg 2",
        "leg 3",
    } < names and "route" not in names


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_each_format_is_written_whole_and_the_same_again(ending, solved, tmp_path):
    for name in ("a", "b"):
        draw(*solved["two walls"], tmp_path / f"{name}.{ending}", title="two walls")
    first, second = ((tmp_path / f"{name}.{ending}").read_bytes() for name in "ab")
    assert first == second and len(first) > 3000
    if ending == "svg":
        ElementTree.fromstring(first)


def test_a_sheet_holds_many_tasks_and_refuses_too_many(solved, tmp_path):
    named = [(name, *solved[name]) for name in CASES]
    contact_sheet(named, tmp_path / "sheet.png", title="all")
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.width == 1500
    with pytest.raises(ValueError, match="several sheets"):
        contact_sheet(named * 25, tmp_path / "more.png")
    assert not (tmp_path / "more.png").exists()


@pytest.mark.parametrize("what", ["loop", "wave"])
@pytest.mark.parametrize("name", CASES)
def test_an_animation_shows_wave_blockage_walk_and_destroying(what, name, solved, tmp_path):
    animate(*solved[name], tmp_path / "a.gif", what=what, title=name)
    film = Image.open(tmp_path / "a.gif")
    seen, reached = set(), []
    for index in range(film.n_frames):
        film.seek(index)
        pixels = np.asarray(film.convert("RGB"))[60:500]
        kinds = {kind for kind in Kind if (pixels == PALETTE[kind]).all(axis=2).sum() > 200}
        seen |= kinds
        reached.append(int((pixels == PALETTE[Kind.REACHED]).all(axis=2).sum()))
    blocked = name in ("two walls", "indestructible", "goal blocked")
    assert (Kind.CONTOUR in seen) == blocked
    assert (Kind.DESTROYED in seen) == (name == "two walls" and what == "loop")
    assert (Kind.FRONT in seen) == (name != "start blocked")
    if name != "start blocked":
        wave = reached[: 10 if what == "loop" else 28]
        assert wave == sorted(wave) and wave[-1] > wave[0]
    else:
        assert film.n_frames == 1


def test_colours_of_cells_and_of_neighbouring_legs_stay_apart_for_the_colour_blind():
    shown = {kind.called: rgb(kind.colour) for kind in Kind}
    for simulate in BLINDNESS.values():
        seen = {name: lab(simulate @ linear(colour)) for name, colour in shown.items()}
        for (one, here), (other, there) in itertools.combinations(seen.items(), 2):
            assert np.linalg.norm(here - there) > 13, (one, other)
        legs = [lab(simulate @ linear(rgb(colour))) for colour in LEGS]
        for here, there in zip(legs, legs[1:] + legs[:1]):
            assert np.linalg.norm(here - there) > 20


# Machado, Oliveira, Fernandes (2009), severity 1, on linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "protan": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deutan": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "tritan": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}


def linear(colour):
    part = np.array(colour) / 255
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def lab(colour):
    """CIE L*a*b* (D65) of a linear RGB colour."""
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    f = np.cbrt(np.maximum(to_xyz @ colour.clip(0, 1) / [0.9505, 1, 1.089], 1e-4))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_a_shrunk_map_loses_no_thin_thing():
    kinds = np.full((1000, 600), Kind.UNREACHED, np.uint8)
    kinds[123, 7] = Kind.CONTOUR
    kinds[:, 301] = Kind.INDESTRUCTIBLE
    kinds[501, 400:500] = Kind.DESTROYED
    small = shrunk(kinds, 250)
    assert small.shape == (250, 150)
    assert (small == Kind.CONTOUR).sum() == 1 and (small[:, 75] == Kind.INDESTRUCTIBLE).sum() == 250
    assert (small == Kind.DESTROYED).sum() == 25 and (small == Kind.UNREACHED).sum() > 37000
    assert shrunk(kinds, 1000) is kinds


def test_the_tile_is_a_small_svg_whose_cells_are_the_maps(solved):
    for name in CASES:
        scene, tile = scene_of(*solved[name]), svg_tile(*solved[name])
        ElementTree.fromstring(tile)
        assert len(tile) < 4000 and not re.search(r'(href|src)="(?!data:)', tile)
        read = np.asarray(Image.open(io.BytesIO(png_of(scene.kinds))).convert("RGB"))
        np.testing.assert_array_equal(read, PALETTE[scene.kinds])


def test_the_frame_names_the_region_of_the_goal(solved):
    scene = scene_of(*solved["two walls"])
    assert PolarFrame(metres_per_cell=1.0).region_of(scene, scene.goal) == "close, ahead"
    assert (
        PolarFrame(metres_per_cell=20.0, heading=0.0).region_of(scene, scene.goal)
        == "afar, ahead-right"
    )
    # a map that says how large its cells are need not be told again
    frame = Frame.over((0.0, 0.0), 20.0, height=scene.kinds.shape[0], width=scene.kinds.shape[1])
    assert PolarFrame().over(frame) == PolarFrame(metres_per_cell=20.0)
    assert PolarFrame(metres_per_cell=1.0).over(frame).side == 1 == PolarFrame().side
    with pytest.raises(ValueError, match="metres_per_cell"):
        PolarFrame(metres_per_cell=0.0)


def test_what_cannot_be_drawn_is_refused(solved, tmp_path):
    task, solution = solved["two walls"]
    batch = stack([task, task])
    with pytest.raises(ValueError, match="unstack"):
        draw(batch, solution, tmp_path / "a.png")
    with pytest.raises(ValueError, match=r"\.tif"):
        draw(task, solution, tmp_path / "a.tif")
    with pytest.raises(ValueError, match="own solution"):
        draw(make_task(np.ones((3, 3), bool), (0, 0), (2, 2)), solution, tmp_path / "a.png")
    with pytest.raises(ValueError, match=r"\.gif"):
        animate(task, solution, tmp_path / "a.png")
    with pytest.raises(ValueError, match="loop, wave"):
        animate(task, solution, tmp_path / "a.gif", what="dance")
    assert list(tmp_path.iterdir()) == []
