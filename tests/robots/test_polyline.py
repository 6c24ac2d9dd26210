"""Routes as lines in metres, and as files."""

import json
import math

import numpy as np
import pytest

from srt_jax import Frame, approach, make_task, polyline, shortest_path, solve, stack, write_path
from srt_jax.geometry.projection import Projection


@pytest.fixture(scope="module")
def walled():
    """A wall with an obstacle in its only gap, and the solution."""
    labels = np.full((20, 30), -1, np.int32)
    labels[:, 15] = 1
    labels[4:7, 15] = 0
    task = make_task(labels, (15, 2), (15, 27), destroyable=[0])
    return task, solve(task)


FRAME = Frame.over((-3.0, 2.0), 0.5, height=20, width=30, yaw=0.4)


def test_the_line_has_the_points_of_the_cells_and_the_length_of_the_route(walled):
    task, solution = walled
    points = polyline(task, solution, FRAME)
    cells = np.asarray(solution.cells)[: int(solution.num_cells)]
    assert np.array_equal(points, FRAME.point_of(cells))
    length = np.hypot(*np.diff(points, axis=0).T).sum()
    assert length == pytest.approx(float(solution.cost) * 0.5, rel=1e-6)
    # without a frame: cell sides from the lower left corner
    bare = polyline(task, solution)
    assert bare[0].tolist() == [2.5, 4.5] and bare[-1].tolist() == [27.5, 4.5]


def test_its_turns_alone_make_the_same_line_and_keep_the_stops(walled):
    task, solution = walled
    turns = polyline(task, solution, FRAME, turns_only=True)
    whole = polyline(task, solution, FRAME)
    assert 4 <= len(turns) < len(whole)
    assert np.hypot(*np.diff(turns, axis=0).T).sum() == pytest.approx(
        np.hypot(*np.diff(whole, axis=0).T).sum()
    )
    stop = whole[int(solution.destroyed_at[0])]
    assert (turns == stop).all(axis=1).any()


def test_paths_and_approaches_are_lines_too_and_none_is_none(walled):
    task, _ = walled
    free = (np.asarray(task.labels) == -1).all(axis=0)
    near, none = approach(task), shortest_path(free, (15, 2), (15, 27))
    assert polyline(task, near, FRAME).shape == (int(near.num_cells), 2)
    assert polyline(task, none, FRAME).shape == (0, 2)
    with pytest.raises(ValueError, match="20 x 30: give the frame of that map"):
        polyline(task, near, Frame.of_cells(3, 3))
    with pytest.raises(ValueError, match="takes one task"):
        polyline(stack([task]), solve(stack([task])))


def test_geojson_holds_the_line_and_the_stops_in_metres_or_degrees(walled, tmp_path):
    task, solution = walled
    write_path(tmp_path / "a.geojson", task, solution, FRAME, name="hall")
    document = json.loads((tmp_path / "a.geojson").read_text())
    line, stop = document["features"]
    assert document["srt-jax"] == {"units": "metres"}
    assert line["geometry"]["type"] == "LineString" and line["properties"]["name"] == "hall"
    turns = polyline(task, solution, FRAME, turns_only=True)
    assert np.allclose(line["geometry"]["coordinates"], turns, atol=1e-6)
    assert line["properties"]["length"] == pytest.approx(float(solution.cost) * 0.5, abs=1e-5)
    assert stop["properties"] == {"what": "destroys", "obstacle": 0, "order": 1}
    at = int(solution.destroyed_at[0])
    assert np.allclose(
        stop["geometry"]["coordinates"], polyline(task, solution, FRAME)[at], atol=1e-6
    )
    globe = Frame(FRAME.grid, projection=Projection(24.94, 60.17))
    write_path(tmp_path / "b.geojson", task, solution, globe)
    document = json.loads((tmp_path / "b.geojson").read_text())
    assert "srt-jax" not in document
    first = document["features"][0]["geometry"]["coordinates"][0]
    assert globe.cell_at(first).tolist() == [15, 2]


def test_a_path_of_ros_has_its_members_alone_and_looks_ahead(walled, tmp_path):
    task, solution = walled
    write_path(tmp_path / "a.json", task, solution, FRAME)
    message = json.loads((tmp_path / "a.json").read_text())
    assert set(message) == {"header", "poses"} and message["header"]["frame_id"] == "map"
    points = polyline(task, solution, FRAME)
    assert len(message["poses"]) == len(points)
    for index, stamped in enumerate(message["poses"]):
        assert set(stamped) == {"header", "pose"}
        position, turn = stamped["pose"]["position"], stamped["pose"]["orientation"]
        assert (position["x"], position["y"]) == pytest.approx(points[index], abs=1e-6)
        if index + 1 < len(points):
            x, y = points[index + 1] - points[index]
            yaw = 2 * math.atan2(turn["z"], turn["w"])
            assert (math.cos(yaw), math.sin(yaw)) == pytest.approx(
                (x / math.hypot(x, y), y / math.hypot(x, y)), abs=1e-9
            )


def test_what_is_not_solved_is_written_as_near_as_one_gets(walled, tmp_path):
    task, _ = walled
    firm = task.replace(destroyable=np.zeros(2, bool))
    solution, near = solve(firm), approach(firm)
    write_path(tmp_path / "a.geojson", firm, solution, FRAME)
    write_path(tmp_path / "b.geojson", firm, solution, FRAME, approach=near)
    assert (tmp_path / "a.geojson").read_text() == (tmp_path / "b.geojson").read_text()
    (line,) = json.loads((tmp_path / "a.geojson").read_text())["features"]
    assert line["properties"]["what"] == "approach" and line["properties"]["status"] == "UNSOLVABLE"
    assert line["properties"]["gap"] == pytest.approx(float(near.gap) * 0.5, abs=1e-6)
    here = make_task(np.ones((2, 2), bool), (0, 0), (0, 0))
    write_path(tmp_path / "c.geojson", here, solve(here))
    (line,) = json.loads((tmp_path / "c.geojson").read_text())["features"]
    assert line["geometry"]["coordinates"] == [[0.5, 1.5], [0.5, 1.5]]
    frame = Frame.over((0.0, 0.0), 0.5, height=2, width=2)
    write_path(tmp_path / "c.json", here, solve(here), frame)
    assert len(json.loads((tmp_path / "c.json").read_text())["poses"]) == 1


def test_what_cannot_be_written_is_refused_in_one_sentence(walled, tmp_path):
    task, solution = walled
    with pytest.raises(ValueError, match=r"\.geojson, or as \.json \(nav_msgs/Path\)"):
        write_path(tmp_path / "a.csv", task, solution)
    with pytest.raises(ValueError, match="there is no folder"):
        write_path(tmp_path / "no" / "a.json", task, solution)
    with pytest.raises(ValueError, match="there is no folder"):  # nor could there be one
        write_path(tmp_path / ("x" * 400) / "a.json", task, solution)
    none = make_task(np.zeros((2, 2), bool), (0, 0), (1, 1))
    with pytest.raises(ValueError, match="there is no route to write: the start lies outside"):
        write_path(tmp_path / "a.geojson", none, solve(none))
    with pytest.raises(ValueError, match="a nav_msgs/Path is in metres"):
        write_path(tmp_path / "a.json", task, solution)
    assert list(tmp_path.iterdir()) == []
