"""What a notebook shows of records, and pictures that go to no file."""

import io
import json
import pickle
import re
import xml.dom.minidom

import jax
import numpy as np
import pytest

import sign_model
import srt_jax
from srt_jax import Obstacle, World
from srt_jax.draw import animate, contact_sheet, draw, svg_tile


@pytest.fixture(scope="module")
def task():
    free = np.ones((12, 15), bool)
    free[:, 7] = False
    return srt_jax.make_task(free, (2, 0), (2, 14))


@pytest.fixture(scope="module")
def solution(task):
    return srt_jax.solve(task)


def test_a_line_says_what_a_task_and_its_solution_are(task, solution):
    assert repr(task) == (
        "Task(12 x 15 cells, 1 obstacle, 1 of them destroyable, start (2, 0), goal (2, 14))"
    )
    assert repr(solution) == (
        "Solution(SOLVED, length 14.00, 15 cells, destroyed [0], removal cost 1, proven least)"
    )
    blocked = task.replace(destroyable=np.zeros(1, bool))
    assert repr(srt_jax.solve(blocked)) == "Solution(UNSOLVABLE, removal_bound=inf)"


def test_a_batch_is_summed_up(task):
    batch = srt_jax.stack([task] * 3)
    assert repr(batch) == "Task(batch of 3, 12 x 15 cells, 1 layer, at most 1 obstacle)"
    assert repr(srt_jax.solve(batch)) == "Solution(batch of 3: 3 SOLVED)"


def test_while_tracing_shapes_are_shown(task):
    seen = []
    jax.make_jaxpr(lambda task: seen.append(repr(task)) or task.start)(task)
    assert seen[0].startswith("Task(labels=int32[1,12,15], destroyable=bool[1]")


def test_other_records_show_small_arrays_and_the_shapes_of_large_ones(task):
    path = srt_jax.trace_path(
        srt_jax.cost_to_come(np.ones((4, 4), bool), (0, 0)), (0, 2), max_cells=9
    )
    assert repr(path) == "Path(cells=int32[9,2], num_cells=3, cost=2.0)"


def test_an_explanation_is_data_with_a_picture(task, solution):
    data = srt_jax.explanation(task, solution)
    page = data._repr_html_()
    assert "<svg" in page and "<td" in page and "&lt;" not in page
    assert "from [2, 6]" in page and "None" not in page
    again = pickle.loads(pickle.dumps(data))
    assert again == data == json.loads(json.dumps(data)) and type(again) is type(data)
    assert "<svg" not in again._repr_html_() and "from [2, 6]" in again._repr_html_()


def test_the_pages_hold_pictures_and_facts(task, solution):
    page = task._repr_html_()
    svg = re.search(r"<svg.*</svg>", page).group()
    xml.dom.minidom.parseString(svg)
    assert "12 x 15 cells" in page
    table = solution._repr_html_()
    assert "<td" in table and "SOLVED: route of 14.0 cell sides, 1 obstacle destroyed" in table
    batch = srt_jax.stack([task] * 9)
    assert batch._repr_html_().count("<svg") == 6
    assert ">9<" in srt_jax.solve(batch)._repr_html_()


def test_a_world_is_a_line_and_a_picture():
    world = World(
        bounds=(0, 0, 7, 5),
        obstacles=(Obstacle.polygon([(3, 0), (4, 0), (4, 5), (3, 5)]),),
        position=(0.5, 2.5),
        radius=0.4,
        goal=((6.5, 2.5), 1.0),
    )
    assert repr(world).startswith("World(7 x 5 m, 1 obstacle, 1 of them destroyable, agent of")
    xml.dom.minidom.parseString(re.search(r"<svg.*</svg>", world._repr_html_()).group())


def test_a_plan_is_a_list():
    result = sign_model.PlanResult(sign_model.PlanStatus.SOLVED, ("(go a b)", "(take <x>)"), 3)
    assert repr(result) == "PlanResult(SOLVED, 2 steps, 3 expansions)"
    page = result._repr_html_()
    assert page.count("<li>") == 2 and "&lt;x&gt;" in page


def test_a_picture_goes_to_the_notebook_a_buffer_or_axes(task, solution):
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    picture = draw(task, solution, title="a wall")
    assert picture._repr_png_().startswith(b"\x89PNG") and "bytes of PNG" in repr(picture)
    buffer = io.BytesIO()
    assert draw(task, solution, buffer, kind="svg") is None
    assert b"<svg" in buffer.getvalue()
    axes = Figure().add_subplot()
    assert draw(task, solution, axes=axes) is None and axes.images and axes.lines
    with pytest.raises(ValueError, match="onto axes or to a path"):
        draw(task, solution, buffer, axes=axes)
    with pytest.raises(ValueError, match="cannot draw a picture with the ending"):
        draw(task, solution, buffer, kind="bmp")


def test_a_task_is_drawn_alone(task):
    pytest.importorskip("matplotlib")
    assert draw(task).png != b"" and "<circle" in svg_tile(task)


def test_an_animation_goes_to_the_notebook(task, solution):
    pytest.importorskip("PIL")
    animation = animate(task, solution)
    assert animation.gif.startswith(b"GIF8")
    assert 'src="data:image/gif;base64,' in animation._repr_html_()


def test_maps_and_places_are_told_in_a_line_and_shown_as_a_picture():
    place = srt_jax.data.helsinki()
    assert len(repr(place)) < 200 and "446 obstacles, 446 of them destroyable" in repr(place)
    assert repr(place.obstacles[0]).startswith("Obstacle(removal cost 1, 1 polygon of ")
    named = Obstacle.polygon([(0, 0), (1, 0), (1, 1)], name="shed", destroyable=False)
    assert repr(named) == "Obstacle('shed', indestructible, 1 polygon of 3 points)"
    svg = re.search(r"<svg.*</svg>", place._repr_html_())[0]
    assert xml.dom.minidom.parseString(svg).getElementsByTagName("path").length == 446

    free, unknown = np.ones((2, 3), bool), np.zeros((2, 3), bool)
    free[0, :2], unknown[0, 0] = False, True
    found = srt_jax.formats.gridmap.GridMap(free, unknown, cell_side=0.05, has_metres=True)
    assert repr(found) == "GridMap(2 x 3 cells of 0.05 m, 4 of them free, 1 unknown)"
    assert "data:image/png;base64," in found._repr_html_()


def test_what_other_functions_return_is_told_in_a_line(task, tmp_path):
    assert repr(srt_jax.connect(task)) == (
        "Connection(destroyed [0], removal cost 1, proven least, 180 cells joined)"
    )
    srt_jax.formats.batch.write_batch(tmp_path / "one.npz", srt_jax.stack([task]))
    assert repr(srt_jax.formats.batch.read_batch(tmp_path / "one.npz")) == (
        "Batch(Task(batch of 1, 12 x 15 cells, 1 layer, at most 1 obstacle), names ('0'), least"
        " removal known of 0)"
    )
    door = """(define (domain door) (:predicates (closed) (open))
      (:action push :precondition (closed) :effect (and (open) (not (closed)))))"""
    wanted = "(define (problem out) (:domain door) (:init (closed)) (:goal (open)))"
    planning = sign_model.load(door, wanted)
    assert repr(planning) == (
        "PlanningTask('out' of 'door', 2 features, 1 action, 1 true at the start, 1 wanted)"
    )
    assert re.fullmatch(
        r"WorldModel\(\d+ signs: .*, \.\.\.\)", repr(sign_model.world_model_of(planning))
    )
    assert repr(sign_model.trace(planning)) == (
        "Trace(by the sign 'landmarks', 1 iteration, plan of 1 step)"
    )
    assert repr(sign_model.Memory().learned(planning, ["(push)"])) == "Memory(1 precedent)"
    with pytest.raises(TypeError, match=r"plan_batch takes a list of tasks, got a single one"):
        sign_model.plan_batch(planning)


def test_a_sheet_and_a_picture_go_to_a_notebook_and_onto_axes(task, solution):
    from matplotlib.figure import Figure

    sheet = contact_sheet(iter([("a wall", task, solution)] * 2))
    assert sheet.png.startswith(b"\x89PNG")
    axes = Figure().subplots()
    assert draw(task, solution, axes) is None and len(axes.images) == 1
    with pytest.raises(ValueError, match="onto axes or to a path"):
        draw(task, solution, "one.png", axes=axes)
