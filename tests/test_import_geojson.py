"""GeoJSON with Simple 3D Buildings tags becomes footprints; degrees become metres."""

from __future__ import annotations

import io
import json
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from facade_tools.errors import InvalidInput
from facade_tools.formats import geojson
from facade_tools.formats.osm import length, shape_of
from facade_tools.formats.projection import to_degrees, to_metres
from facade_tools.formats.reading import ReadOptions
from facade_tools.geometry.checks import building_problems

RECTANGLE = [[0, 0], [12, 0], [12, 8], [0, 8], [0, 0]]


def feature(ring: Any = None, **tags: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "id": "way/1",
        "properties": {"building": "house", **tags},
        "geometry": {"type": "Polygon", "coordinates": [ring or RECTANGLE]},
    }


def read(*features: Any, lines: bool = False, **options: Any) -> tuple[list[Any], Counter[str]]:
    chosen = ReadOptions(**options)
    if lines:
        data = "\n".join(map(json.dumps, features))
    else:
        data = json.dumps({"type": "FeatureCollection", "features": features})
    found: list[Any] = []
    notes: Counter[str] = Counter()
    for record in geojson.records(io.BytesIO(data.encode()), chosen):
        built = geojson.build(record, chosen)
        found += built.artifacts
        notes += built.notes
    return found, notes


@pytest.mark.parametrize(
    ("origin", "point", "metres"),
    [  # PROJ 9, +proj=tmerc +k=1 +ellps=WGS84
        ((11.43, 48.76), (11.4312, 48.7609), (88.22568115568798, 100.08527960176053)),
        ((-120.5, 39.2), (-120.45, 39.3), (4312.970350264583, 11103.217566416857)),
        ((151.2, -33.86), (151.3, -33.9), (9249.292055950056, -4441.310675138593)),
        ((0.0, 0.0), (2.0, 3.0), (222381.1216994205, 331929.06330384355)),
        ((25.0, -70.0), (25.5, -70.2), (18909.997926635824, -22390.290258349967)),
    ],
)
def test_the_projection_is_that_of_proj(origin: Any, point: Any, metres: Any) -> None:
    assert to_metres(np.array([point]), origin)[0] == pytest.approx(metres, abs=1e-6)


@given(st.floats(-179, 179), st.floats(-80, 80), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_the_projection_comes_back(lon: float, lat: float, east: float, north: float) -> None:
    points = np.array([[lon + east, lat + north]])
    back = to_degrees(to_metres(points, (lon, lat)), (lon, lat))
    assert back == pytest.approx(points, abs=1e-10)


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("7.5", 7.5),
        ("7,5 m", 7.5),
        ("24 ft", 7.3152),
        ("24'6\"", 7.4676),
        ("high", None),
        ("", None),
    ],
)
def test_lengths_are_read_as_mappers_write_them(text: str, metres: float | None) -> None:
    assert length(text) == pytest.approx(metres)


def test_levels_give_the_eaves_and_height_gives_the_top() -> None:
    (by_levels,), _ = read(feature(**{"building:levels": "2", "roof:shape": "gabled"}), metres=True)
    assert by_levels.height == 6.0
    (by_height,), _ = read(
        feature(height="10 m", **{"roof:shape": "gabled", "roof:height": "4"}), metres=True
    )
    assert by_height.height == pytest.approx(6.0)
    assert by_height.roof.pitch == pytest.approx(45.0)
    assert by_height.roof.direction == "x"


def test_a_roof_that_leaves_too_little_wall_is_flattened_and_counted() -> None:
    tags = {"roof:shape": "gabled", "roof:height": "4"}
    (low,), notes = read(feature(height="5", **tags), metres=True)
    assert low.height == 2.5
    assert low.roof.pitch == pytest.approx(math.degrees(math.atan(2.5 / 4.0)))
    assert notes["less than 2.5 m of wall under the roof: pitch lowered"] == 1


@pytest.mark.parametrize(
    ("turn", "bearing", "axis"),
    [(0.0, "N", "x"), (0.0, "90", "y"), (30.0, "330", "x"), (30.0, "WSW", "y")],
)
def test_the_roofs_direction_follows_the_turned_plan(turn: float, bearing: str, axis: str) -> None:
    plan = shapely.box(0, 0, 10, 10)
    shape = shape_of({"roof:shape": "gabled", "roof:direction": bearing}, plan, turn, Counter())
    assert shape.roof.direction == axis


def test_a_turned_house_lies_along_its_axes_and_its_frame_leads_back() -> None:
    c, s = math.cos(math.radians(25)), math.sin(math.radians(25))
    corners = np.array(RECTANGLE, dtype=float) @ np.array([[c, s], [-s, c]])
    ring = (corners + np.array([678000.25, 5403000.75])).tolist()
    (house,), _ = read(feature(ring), metres=True)
    points = np.array(house.polygon[0])
    assert np.abs(points) == pytest.approx(np.tile([6.0, 4.0], (4, 1)), abs=1e-3)
    assert shapely.LinearRing(points).is_ccw
    turn = math.radians(house.frame.rotation)
    c, s = math.cos(turn), math.sin(turn)
    back = points @ np.array([[c, s], [-s, c]]) + house.frame.shift[:2]
    given_ring = shapely.Polygon(ring)
    assert shapely.Polygon(back).symmetric_difference(given_ring).area < 0.01


def test_degrees_are_projected_around_each_footprint() -> None:
    origin = (11.43, 48.76)
    ring = to_degrees(np.array(RECTANGLE, dtype=float), origin).tolist()
    (house,), _ = read(feature(ring))
    assert shapely.Polygon(house.polygon[0]).area == pytest.approx(96.0, abs=0.05)
    assert house.frame.crs.startswith("+proj=tmerc +lat_0=48.76")


def test_planar_coordinates_without_metres_are_refused_with_the_remedy() -> None:
    ring = [[x + 678000, y + 5403000] for x, y in RECTANGLE]
    with pytest.raises(InvalidInput, match="--metres"):
        read(feature(ring))


def test_a_feature_a_line_reads_like_a_collection() -> None:
    other = {**feature(), "id": "way/2"}
    assert read(feature(), other, lines=True, metres=True) == read(feature(), other, metres=True)


def test_what_is_no_building_is_left_out_and_counted() -> None:
    road = {"type": "Feature", "properties": {"highway": "x"}, "geometry": None}
    lake = feature(natural="water", building="no")
    found, notes = read(road, lake, feature(), metres=True)
    assert len(found) == 1
    assert notes["feature that is no building polygon: left out"] == 2


def test_a_crossing_outline_keeps_its_largest_part() -> None:
    bow = [[0, 0], [12, 9], [12, 0], [4, 6], [0, 0]]
    (house,), _ = read(feature(bow, height="5"), metres=True)
    assert shapely.Polygon(house.polygon[0]).is_valid


@pytest.mark.parametrize("ring", [[[0, 0], [1, 0], [1, 1], [0, 0]], [[0, "a"], [1, 0], [1, 1]]])
def test_bad_polygons_are_refused(ring: Any) -> None:
    with pytest.raises(InvalidInput):
        read(feature(ring), metres=True)


def test_footprints_become_boxes_on_request() -> None:
    plan = [[0, 0], [12, 0], [12, 5], [7, 5], [7, 9], [0, 9], [0, 0]]
    (house,), _ = read(feature(plan, height="6"), metres=True, kind="buildings")
    assert len(house.boxes) == 2
    assert house.tags["plan_residual"] == 0.0
    assert not list(building_problems(house))
