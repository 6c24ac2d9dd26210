"""Obstacles named by a second picture."""

import numpy as np
import pytest

from srt_jax.formats.label_pictures import read_labels, with_labels
from srt_jax.formats.notes import Notes
from srt_jax.formats.reading import Reading
from srt_jax.formats.task_files import read_tasks
from tests.helpers.odd import refusals

image = pytest.importorskip("PIL.Image")

WHITE, BLACK, GREY = (255, 255, 255), (0, 0, 0), (205, 205, 205)
RED, BLUE = (255, 0, 0), (0, 0, 255)


def saved(path, pixels):
    image.fromarray(np.array(pixels, np.uint8)).save(path)
    return str(path)


def test_each_colour_is_an_obstacle_and_greys_name_nothing(tmp_path):
    notes = Notes()
    path = saved(tmp_path / "a.png", [[WHITE, RED, BLACK], [BLUE, GREY, RED]])
    found = read_labels(path, notes=notes)
    assert found.labels.tolist() == [[-1, 1, -1], [0, -1, 1]]
    assert found.names == ("#0000ff", "#ff0000")  # by ascending colour
    told = " ".join(map(str, notes))
    assert "#0000ff is obstacle 0 (1 cell), #ff0000 is obstacle 1 (2 cells)" in told
    # corner to corner is one piece; one apart is not
    assert "several pieces" not in told
    path = saved(tmp_path / "b.png", [[RED, WHITE, RED]])
    read_labels(path, notes=(again := Notes()))
    assert "several pieces" in (told := " ".join(map(str, again))) and "#ff0000" in told


def test_a_picture_of_numbers_names_them_and_0_nothing(tmp_path):
    path = saved(tmp_path / "a.png", [[0, 7, 7], [255, 0, 3]])
    found = read_labels(path)
    assert found.labels.tolist() == [[-1, 1, 1], [2, -1, 0]] and found.names == ("3", "7", "255")
    deep = np.array([[0, 300], [40_000, 300]], np.uint16)
    image.fromarray(deep).save(tmp_path / "deep.png")
    assert read_labels(tmp_path / "deep.png").labels.tolist() == [[-1, 0], [1, 0]]


def test_what_is_not_opaque_names_nothing(tmp_path):
    pixels = np.zeros((1, 3, 4), np.uint8)
    pixels[0] = (*RED, 255), (*BLUE, 0), (*BLUE, 128)
    image.fromarray(pixels).save(tmp_path / "a.png")
    assert read_labels(tmp_path / "a.png").labels.tolist() == [[0, -1, -1]]


def test_a_door_keeps_to_itself_and_walls_come_after_it(tmp_path):
    free = np.array([[1, 0, 1, 1], [1, 0, 1, 1], [1, 0, 1, 0]], bool)
    doors = saved(tmp_path / "d.png", [[WHITE] * 4, [WHITE, RED, WHITE, WHITE], [WHITE] * 4])
    labels, flags = with_labels(doors, free, "m", Notes())
    assert labels.tolist() == [[-1, 1, -1, -1], [-1, 0, -1, -1], [-1, 2, -1, 3]]
    assert flags.tolist() == [True, False, False, False]
    # a door drawn where the map is free blocks as well
    open_door = saved(tmp_path / "o.png", [[WHITE, WHITE, RED, WHITE]] * 3)
    labels, _ = with_labels(open_door, free, "m", Notes())
    assert labels[:, 2].tolist() == [0, 0, 0] and labels[:, 1].tolist() == [1, 1, 1]


def test_a_map_with_labels_is_read_as_a_task(tmp_path):
    walls = np.full((5, 6), 255, np.uint8)
    walls[:, 3] = 0
    name = saved(tmp_path / "m.png", walls)
    pixels = np.full((5, 6, 3), 255, np.uint8)
    pixels[2, 3] = RED
    doors = saved(tmp_path / "doors.png", pixels)
    how = Reading(start=(0, 0), goal=(0, 5), labels=doors)
    (named,) = read_tasks(name, reading=how)
    assert named.task.labels[0, :, 3].tolist() == [1, 1, 0, 2, 2]
    assert named.task.destroyable.tolist() == [True, False, False]
    (named,) = read_tasks(name, reading=how, destroyable="all")
    assert named.task.destroyable.all()
    # a goal may stand in the door, a start may not
    (named,) = read_tasks(name, reading=Reading(start=(0, 0), goal=(2, 3), labels=doors))
    assert named.task.goal.tolist() == [2, 3]
    with pytest.raises(ValueError, match="is on a wall"):
        read_tasks(name, reading=Reading(start=(2, 3), goal=(0, 0), labels=doors))
    with pytest.raises(ValueError, match="is on a wall"):
        read_tasks(name, reading=Reading(start=(0, 0), goal=(0, 3), labels=doors))


def test_broken_pictures_of_labels_are_refused_in_one_line(tmp_path):
    free = np.ones((2, 3), bool)
    small = saved(tmp_path / "small.png", [[RED, WHITE]])
    with pytest.raises(
        ValueError, match="2 pixels wide and 1 high, but the map m 3 wide and 2 high"
    ):
        with_labels(small, free, "m", Notes())
    greys = saved(tmp_path / "greys.png", [[254, 254, 205], [254, 254, 254]])
    with pytest.raises(ValueError, match="on every free cell of m: a picture of greys"):
        with_labels(greys, free, "m", Notes())
    plain = saved(tmp_path / "plain.png", [[WHITE, BLACK], [RED, WHITE]])
    saved(tmp_path / "plain.png", [[0, 0], [0, 0]])
    with pytest.raises(ValueError, match="it names no obstacle"):
        read_labels(plain)
    with pytest.raises(ValueError, match="a JPEG blurs"):
        read_labels(tmp_path / "a.jpg")
    floats = np.array([[0.5, 1.0]], np.float32)
    image.fromarray(floats).save(tmp_path / "f.tif")
    with pytest.raises(ValueError, match="no whole numbers"):
        read_labels(tmp_path / "f.tif")
    many = np.random.default_rng(0).integers(0, 256, (200, 200, 3)).astype(np.uint8)
    with pytest.raises(ValueError, match="colours or numbers, more than"):
        read_labels(saved(tmp_path / "many.png", many))
    content = (tmp_path / "small.png").read_bytes()
    assert refusals(read_labels, tmp_path / "small.png", content) > 10
    scen = tmp_path / "a.npz"
    scen.write_bytes(b"x")
    with pytest.raises(ValueError, match="--labels names the obstacles of a map of cells"):
        read_tasks(str(scen), reading=Reading(labels=small))
