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
        ("30 ft", 9.144),
        ("12 ft 6 in", 3.81),
        ("12′6″", 3.81),
        ("~ 9 m", 9.0),
        ("350 cm", 3.5),
        ("2;3", 2.0),
        ("-1", None),
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


def test_tags_under_the_names_of_others_count_too() -> None:
    ring = feature()
    ring["properties"] = {"HEIGHT": 9.5, "roof_shape": "gabled", "roof_height": 3.5}
    (house,), _ = read(ring, metres=True)
    assert (house.height, house.roof.style) == (pytest.approx(6.0), "gable")


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


def test_degrees_are_projected_and_the_frame_leads_back_to_them() -> None:
    origin = (11.43, 48.76)
    ring = to_degrees(np.array(RECTANGLE, dtype=float), origin)
    (house,), _ = read(feature(ring.tolist()))
    assert shapely.Polygon(house.polygon[0]).area == pytest.approx(96.0, abs=2e-3)
    assert house.frame.crs.startswith("+proj=tmerc +lat_0=48.7500000 +lon_0=11.5000000 ")
    turn = math.radians(house.frame.rotation)
    c, s = math.cos(turn), math.sin(turn)
    back = np.array(house.polygon[0]) @ np.array([[c, s], [-s, c]]) + house.frame.shift[:2]
    degrees = to_degrees(back, (11.5, 48.75))
    apart = to_metres(degrees, origin)[:, None] - np.array(RECTANGLE[:4], dtype=float)
    assert np.hypot(*apart.T).min(axis=0).max() < 1e-3


def test_a_house_across_the_180th_meridian_is_whole() -> None:
    ring = to_degrees(np.array(RECTANGLE, dtype=float), (179.99995, -16.0))
    (house,), _ = read(feature(np.where(ring > 180, ring - 360, ring).tolist()))
    assert shapely.Polygon(house.polygon[0]).area == pytest.approx(96.0, abs=2e-3)


def named(name: str, factor: float = 1.0) -> bytes:
    ring = [[(x + 678000) * factor, (y + 5403000) * factor, 400.0] for x, y in RECTANGLE]
    crs = {"type": "name", "properties": {"name": f"urn:ogc:def:crs:EPSG::{name}"}}
    collection = {"type": "FeatureCollection", "features": [feature(ring)], "crs": crs}
    return json.dumps(collection).encode()


@pytest.mark.parametrize(
    ("data", "crs"),
    [
        (named("25832"), "EPSG:25832"),
        (named("2263", 3937 / 1200), "EPSG:2263 in metres"),
        (b"\xef\xbb\xbf" + named("25832"), "EPSG:25832"),
    ],
)
def test_named_systems_are_read_in_their_unit(data: bytes, crs: str) -> None:
    (record,) = geojson.records(io.BytesIO(data), ReadOptions())
    (house,) = geojson.build(record, ReadOptions()).artifacts
    assert house.frame.crs == crs
    assert house.frame.shift[:2] == pytest.approx((678006.0, 5403004.0), abs=1e-3)
    assert shapely.Polygon(house.polygon[0]).area == pytest.approx(96.0)


@pytest.mark.parametrize("indent", [None, 1])
@pytest.mark.parametrize("bare", [False, True])
def test_a_single_feature_or_geometry_is_read(indent: int | None, bare: bool) -> None:
    collection = {"type": "GeometryCollection", "geometries": [feature()["geometry"]]}
    document = collection if bare else feature()
    data = json.dumps(document, indent=indent).encode()
    assert geojson.detect(data)
    options = ReadOptions(metres=True)
    (record,) = geojson.records(io.BytesIO(data), options)
    assert len(geojson.build(record, options).artifacts) == 1


def box(x0: float, y0: float, x1: float, y1: float, name: str, **tags: Any) -> dict[str, Any]:
    ring = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    return {**feature(ring), "id": name, "properties": tags}


PARTED = (
    box(15, 3, 19, 7, "cap", **{"building:part": "yes", "height": "18", "min_height": "15"}),
    box(0, 0, 20, 10, "house", building="yes", height="15"),
    box(0, 0, 14, 10, "low", **{"building:part": "yes", "height": "20 ft"}),
    box(14, 0, 20, 10, "tower", **{"building:part": "tower", "height": "15"}),
    box(80, 0, 90, 10, "lone", **{"building:part": "yes", "height": "7"}),
)


@pytest.mark.parametrize("lines", [False, True])
def test_a_building_in_parts_is_its_parts(lines: bool) -> None:
    found, notes = read(*PARTED, lines=lines, metres=True)
    assert {house.id: house.height for house in found} == pytest.approx(
        {"cap": 18.0, "low": 6.096, "tower": 15.0, "lone": 7.0}
    )
    assert {house.tags.get("part_of") for house in found} == {"house", None}
    assert notes["begins above the ground: carried down to it"] == 1


def test_a_building_in_parts_becomes_boxes_of_their_heights() -> None:
    (house, lone), _ = read(*PARTED, metres=True, kind="buildings")
    assert (house.id, lone.id) == ("house", "lone")
    assert not list(building_problems(house))
    heights = {round(b.height, 3) for b in house.boxes}
    assert heights == {18.0, 15.0, 6.096}
    union = shapely.union_all(
        [
            shapely.box(b.x - b.width / 2, b.y - b.depth / 2, b.x + b.width / 2, b.y + b.depth / 2)
            for b in house.boxes
        ]
    )
    assert union.area == pytest.approx(200.0)


def test_what_no_part_covers_stays() -> None:
    parts = (PARTED[1], PARTED[3])
    found, _ = read(*parts, metres=True)
    areas = {h.id: shapely.Polygon(h.polygon[0]).area for h in found}
    assert areas == pytest.approx({"tower": 60.0, "house": 140.0})


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


@pytest.mark.parametrize(
    ("shape", "style"),
    [("lean_to", "shed"), ("Side_Hipped", "hip"), ("cross_gabled;flat", "gable"), ("shed", "shed")],
)
def test_rarer_shapes_of_roofs_are_built(shape: str, style: str) -> None:
    (found,), notes = read(feature(height=9, **{"roof:shape": shape}), metres=True)
    assert (found.roof.style, notes) == (style, Counter())


@pytest.mark.parametrize(
    ("tag", "value"),
    [
        ("height", "-1"),
        ("height", "tall"),
        ("building:levels", "1-2"),
        ("roof:height", "3 storeys"),
        ("roof:direction", "uphill"),
    ],
)
def test_what_cannot_be_read_is_counted_by_its_tag(tag: str, value: str) -> None:
    tags = {"building:levels": "2", "roof:shape": "gabled"}
    plain, _ = read(feature(**{**tags, tag: None}), metres=True)
    found, notes = read(feature(**{**tags, tag: value}), metres=True)
    assert notes[f"{tag} cannot be read: taken as not stated"] == 1
    assert (found[0].height, found[0].roof) == (plain[0].height, plain[0].roof)


def test_shape_of_a_roof_that_is_none_is_flat_and_counted() -> None:
    (found,), notes = read(feature(height=9, **{"roof:shape": "sawtooth"}), metres=True)
    assert (found.height, found.roof.style) == (9.0, "flat")
    assert notes == {"roof:shape is none that is built: flat": 1}


@pytest.mark.parametrize("bearing", ["west", "WEST", "270°", "270 degrees", "-90", "W"])
def test_directions_in_words(bearing: str) -> None:
    plan = shapely.box(0, 0, 12, 8)
    notes: Counter[str] = Counter()
    tags = {"height": 9, "roof:shape": "gabled", "roof:direction": bearing}
    assert shape_of(tags, plan, 0.0, notes).roof.direction == "y"
    assert not notes


def test_keys_in_order_put_the_type_behind_the_features() -> None:
    many = [{**feature(note="x" * 70_000), "id": k} for k in range(3)]
    data = json.dumps({"features": many, "type": "FeatureCollection"}, indent=1, sort_keys=True)
    options = ReadOptions(metres=True)
    assert len(list(geojson.records(io.BytesIO(data.encode()), options))) == 3
    line = json.dumps({"features": many, "type": "FeatureCollection"})
    assert len(list(geojson.records(io.BytesIO(line.encode()), options))) == 3


def test_a_sliver_beside_the_house_does_not_refuse_it() -> None:
    sliver = [[20, 0], [21, 0], [21, 1], [20, 0]]
    both = feature()
    both["geometry"] = {"type": "MultiPolygon", "coordinates": [[sliver], [RECTANGLE]]}
    (found,), notes = read(both, metres=True)
    assert found.id == "way/1"
    assert notes["piece smaller than 4 m² beside others: left out"] == 1
    both["geometry"]["coordinates"] = [[sliver], [sliver]]
    with pytest.raises(InvalidInput, match="none of 4 m²"):
        read(both, metres=True)


def test_a_part_of_two_square_metres_stays_a_part() -> None:
    turret = feature([[1, 1], [2.5, 1], [2.5, 2.5], [1, 2.5]], height=12)
    turret["properties"] = {"building:part": "yes", "height": 12}
    turret["id"] = "way/2"
    found, _ = read(feature(height=6), turret, metres=True)
    assert sorted((row.id, row.height) for row in found) == [("way/1", 6.0), ("way/2", 12.0)]


def test_both_sides_of_the_date_line_share_a_system() -> None:
    west = [[179.9998, -16.5], [179.9999, -16.5], [179.9999, -16.4999], [179.9998, -16.4999]]
    east = [[x - 359.9998, y] for x, y in west]
    found, _ = read(feature(west), {**feature(east), "id": "way/2"})
    assert len({row.frame.crs for row in found}) == 1
    assert abs(found[0].frame.shift[0] - found[1].frame.shift[0]) < 30.0


@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_nesting_without_end_is_refused_in_bounded_memory(opening: str) -> None:
    closing = "]" if opening == "[" else "}"
    bomb = opening * 100_000 + "1" + closing * 100_000
    text = json.dumps({"type": "FeatureCollection", "features": [feature(bomb="BOMB")]})
    with pytest.raises(InvalidInput, match="nested deeper than 500 levels"):
        list(geojson.records(io.BytesIO(text.replace('"BOMB"', bomb).encode()), ReadOptions()))


@given(
    st.lists(st.sampled_from(['"', "\\", "[", "{", "]", "é", "a"]), max_size=40), st.integers(1, 9)
)
def test_brackets_in_strings_are_no_levels(letters: list[str], size: int) -> None:
    """Whatever stands in strings, and wherever a block ends, the depth is that of the brackets."""
    from facade_tools.formats.json_stream import _Shallow

    data = json.dumps([["".join(letters)], {"".join(letters): [1]}]).encode()
    stream = _Shallow(io.BytesIO(data))
    while stream.read(size):
        pass
    assert (stream._depth, stream._quotes) == (0, 0)


def test_text_that_is_not_utf_8_is_refused_in_one_line() -> None:
    text = json.dumps(
        {"type": "FeatureCollection", "features": [feature(name="ß")]}, ensure_ascii=False
    )
    with pytest.raises(
        InvalidInput, match=r"^not valid JSON: lexical error: invalid bytes in UTF8 string\.$"
    ):
        list(geojson.records(io.BytesIO(text.encode("latin-1")), ReadOptions()))
