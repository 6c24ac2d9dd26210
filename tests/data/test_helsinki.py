"""The city shipped with the package."""

import importlib.resources

import numpy as np
import pytest
from scipy import ndimage

from srt_jax.data import helsinki
from srt_jax.geometry.raster import cover, square_grid
from srt_jax.types import FREE


@pytest.fixture(scope="module")
def place():
    return helsinki()


def test_it_has_446_buildings_61_of_them_with_courtyards(place):
    assert len(place.obstacles) == 446
    assert sum(any(len(part) > 1 for part in building.parts) for building in place.obstacles) == 61
    assert (
        sum(len(part) - 1 for building in place.obstacles for part in building.parts)
        == 51 + 2 * 9 + 3
    )


def test_it_spans_a_kilometre_by_more_than_one_and_a_half(place):
    x_min, y_min, x_max, y_max = place.bounds
    assert x_max - x_min == pytest.approx(1012, abs=2) and y_max - y_min == pytest.approx(
        1666, abs=2
    )


def test_known_buildings_stand_where_and_as_large_as_they_are(place):
    named = {building.name: np.array(building.parts[0][0]) for building in place.obstacles}
    cathedral, station = named["Helsingin tuomiokirkko"], named["Helsingin päärautatieasema"]
    # 24.95220 E, 60.17040 N, about 60 m across; the station lies 600 m to the west of it.
    assert np.abs(cathedral.mean(axis=0) - (436, -138)).max() < 15
    assert 40 < np.ptp(cathedral, axis=0).max() < 90
    assert 500 < cathedral[:, 0].mean() - station[:, 0].mean() < 750


def test_the_attribution_and_the_licence_note_are_there(place):
    assert "OpenStreetMap contributors" in place.attribution and "ODbL" in place.attribution
    note = (
        importlib.resources.files("srt_jax.data")
        .joinpath("HELSINKI.md")
        .read_text(encoding="utf-8")
    )
    assert "Open Database License" in note and "446 buildings" in note


@pytest.mark.parametrize("num_cells", [100, 500])
def test_its_largest_free_region_spans_the_map(place, num_cells):
    labels = cover(place.obstacles, square_grid(place.bounds, num_cells))
    regions, _ = ndimage.label((labels == FREE).all(axis=0))
    sizes = np.bincount(regions.ravel())
    rows, cols = np.nonzero(regions == sizes[1:].argmax() + 1)
    assert rows.min() == cols.min() == 0 and rows.max() == cols.max() == num_cells - 1
    assert sizes[1:].max() > 0.9 * sizes[1:].sum()
