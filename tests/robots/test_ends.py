"""Places and radii as people type them."""

import pytest

from srt_jax import Frame
from srt_jax.geometry.projection import Projection
from srt_jax.robots.ends import as_end, as_radius, cell_in, radius_in

FRAME = Frame.over((-2.0, -1.0), 0.5, height=10, width=20, projection=Projection(24.94, 60.17))


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("3,5", (3, 5)),
        (" -1 , 7 ", (-1, 7)),  # outside: what is wrong with it is told with the map
        ("1.5m,-0.6m", (9, 7)),
        ("1.5 m, .5m", (7, 7)),
        ("15e-1m,-6e-1m", (9, 7)),
        ("24.94E,60.17N", (8, 4)),
        ("60.17n, 24.94°e", (8, 4)),
    ],
)
def test_each_form_leads_to_its_cell(text, cell):
    assert cell_in(FRAME, as_end("--start", text), "x") == cell


@pytest.mark.parametrize(
    "text",
    [
        *("", "3", "3,5,7", "1.5,2", "1.5m,2", "1km,2km", "24.94,60.17", "24.94E,24.94E", "24E,3m"),
        *("nanm,1m", "infm,1m", "a,b", "-24E,60N", "24.94E", "1e999m,0m", "190E,60N", "20E,91N"),
    ],
)
def test_anything_else_is_refused_with_the_forms(text):
    with pytest.raises(
        ValueError, match=r"--start .*(write (row,column|metres)|no place on the globe)"
    ):
        as_end("--start", text)


def test_west_and_south_are_negative():
    frame = Frame.over((-5.0, -5.0), 1.0, height=10, width=10, projection=Projection(-70.0, -33.0))
    assert cell_in(frame, as_end("--goal", "70W,33S"), "x") == (5, 5)


def test_what_the_map_does_not_know_is_told():
    bare = Frame.of_cells(10, 20)
    with pytest.raises(
        ValueError, match=r"map: start 1m,2m is in metres, and the map does not say"
    ):
        cell_in(bare, as_end("--start", "1m,2m"), "map: start")
    with pytest.raises(ValueError, match="degrees mean nothing on it"):
        cell_in(bare, as_end("--start", "24E,60N"), "map: start")
    with pytest.raises(ValueError, match=r"map: goal 99m,0m: the point \(99, 0\) lies outside"):
        cell_in(FRAME, as_end("--goal", "99m,0m"), "map: goal")
    with pytest.raises(ValueError, match="lies outside the map"):
        cell_in(FRAME, as_end("--goal", "25E,60.17N"), "map: goal")


def test_a_radius_is_metres_or_cells():
    assert radius_in(FRAME, as_radius("--radius", "0.22m"), "map") == (0.22, 0.5)
    assert radius_in(FRAME, as_radius("--radius", "3"), "map") == (3.0, 1.0)
    assert radius_in(Frame.of_cells(3, 3), as_radius("--radius", "2.5"), "map") == (2.5, 1.0)
    with pytest.raises(
        ValueError, match=r"map: --radius 0\.22m is in metres, and the map does not"
    ):
        radius_in(Frame.of_cells(3, 3), as_radius("--radius", "0.22m"), "map")
    for wrong in ("-1", "-0.2m", "nan", "inf", "22cm", "1,2", "", "m", "1e999m"):
        with pytest.raises(ValueError, match=r"is no radius: write metres such as 0\.22m, or"):
            as_radius("--radius", wrong)
