"""City models become buildings: boxes, roofs, facades, garages, frames."""

from __future__ import annotations

import io
import json
from collections import Counter
from typing import Any

import numpy as np
import pytest
import shapely

from facade_tools.artifacts.building import Building
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.formats import citygml, cityjson_reader
from facade_tools.formats.crs import named
from facade_tools.formats.detect import detect
from facade_tools.formats.reading import ReadOptions
from facade_tools.geometry.checks import building_problems

from .city_sources import City, flat_box, front_window, gable_house


def read(document: dict[str, Any], **options: Any) -> tuple[list[Any], Counter[str]]:
    stream = io.BytesIO(json.dumps(document).encode())
    found: list[Any] = []
    notes: Counter[str] = Counter()
    chosen = ReadOptions(**options)
    for record in cityjson_reader.records(stream, chosen):
        built = cityjson_reader.build(record, chosen)
        found += built.artifacts
        notes += built.notes
    return found, notes


def only(city: City, **options: Any) -> Building:
    (building,) = read(city.document(), **options)[0]
    assert not list(building_problems(building))
    return building


@pytest.mark.parametrize("turn", [0.0, 31.7, 90.0, -44.0, 170.0])
def test_a_turned_house_is_its_box_in_its_own_frame(turn: float) -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0), turn, (321.123, 456.789, 12.0))
    building = only(city)
    (box,) = building.boxes
    assert (box.width, box.depth, box.height) == pytest.approx((12.0, 8.0, 5.5), abs=2e-3)
    assert (box.x, box.y) == pytest.approx((0.0, 0.0), abs=1e-3)
    assert box.roof is not None
    assert (box.roof.style, box.roof.direction) == ("gable", "x")
    assert box.roof.pitch == pytest.approx(35.0, abs=0.05)
    frame = building.frame
    assert frame is not None
    assert frame.crs == "EPSG:25832"
    assert frame.shift == pytest.approx((678321.123, 5403456.789, 412.0), abs=1e-3)
    assert (frame.rotation - turn + 45.0) % 180.0 == pytest.approx(45.0, abs=0.02)


def test_the_short_side_can_be_the_front() -> None:
    (box,) = only(City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)), front="short").boxes
    assert (box.width, box.depth) == pytest.approx((8.0, 12.0), abs=2e-3)
    assert box.roof is not None
    assert box.roof.direction == "y"


def test_windows_make_the_front_and_keep_place_and_size() -> None:
    windows = [front_window(-4.0, 1.0, 1.2, 1.4, 8.0), front_window(2.0, 3.9, 1.0, 1.2, 8.0)]
    city = City().add("h", gable_house(12.0, 8.0, 6.0, 35.0) + windows, 123.0, lod="3")
    building = only(city)
    assert list(building.facades) == ["front"]
    elements = [
        (piece.origin[0] + e.u, piece.origin[2] + e.v, e.width, e.height, e.style)
        for piece in building.facades["front"].pieces
        for e in piece.elements
    ]
    assert elements[0][:4] == pytest.approx((-4.0, 1.0, 1.2, 1.4), abs=5e-3)
    assert elements[1][:4] == pytest.approx((2.0, 3.9, 1.0, 1.2), abs=5e-3)
    assert {row[4] for row in elements} == {"unknown"}
    attributes = building_attributes(building)
    assert attributes.facade.wwr[0] == pytest.approx((1.68 + 1.2) / 72.0, abs=1e-3)
    assert attributes.facade.wwr[1:] == (None,) * 3
    assert attributes.element.window["sash"] is None


def test_a_garage_by_code_becomes_a_box_of_the_house_beside_it() -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0), function="31001_1010")
    city.add("g", flat_box(6.1, -3.0, 9.1, 3.0, 2.6), function="31001_2463")
    building = only(city)
    assert [box.kind for box in building.boxes] == ["general", "garage"]
    garage = building.boxes[1]
    assert (garage.width, garage.depth, garage.height) == pytest.approx((3.0, 6.0, 2.6), abs=0.11)
    edge = building.boxes[0].x + building.boxes[0].width / 2
    assert garage.x - garage.width / 2 == pytest.approx(edge)


def test_a_small_neighbour_without_a_code_is_a_garage_too() -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0))
    city.add("g", flat_box(6.0, -3.0, 9.0, 3.0, 2.6))
    city.add("far", flat_box(40.0, -3.0, 43.0, 3.0, 2.6))
    found, _ = read(city.document())
    assert [[box.kind for box in building.boxes] for building in found] == [
        ["general", "garage"],
        ["general"],
    ]


def test_a_garage_of_no_house_is_left_out_and_counted() -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0))
    city.add("g", flat_box(60.0, -3.0, 63.0, 3.0, 2.6), function="31001_2463")
    found, notes = read(city.document())
    assert len(found) == 1
    assert notes["garage that adjoins no house: left out"] == 1


def test_parts_of_different_height_are_boxes_of_their_own() -> None:
    polygons = gable_house(10.0, 8.0, 6.0, 40.0) + flat_box(5.0, -4.0, 9.0, 4.0, 3.0)
    boxes = only(City().add("h", polygons)).boxes
    low, high = sorted(boxes, key=lambda box: box.height or 0.0)
    assert (low.height, high.height) == pytest.approx((3.0, 6.0), abs=2e-3)
    assert low.roof is not None
    assert high.roof is not None
    assert (low.roof.style, high.roof.style) == ("flat", "gable")


def test_a_chimney_is_noted_and_a_dormer_is_not_a_chimney() -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.0, 45.0))
    city.add("stack", flat_box(2.0, -0.4, 2.8, 0.4, 10.0), lod="3")
    city.add("dormer", flat_box(-3.0, -3.0, -1.8, -1.0, 7.0), lod="3")
    for name in ("stack", "dormer"):
        city.objects[name] |= {"type": "BuildingInstallation", "parents": ["h"]}
    city.objects["h"]["children"] = ["stack", "dormer"]
    building = only(city)
    assert building.features == ("chimney",)
    (stack,) = building.chimneys
    assert (stack.x, stack.y, stack.top) == pytest.approx((2.4, 0.0, 10.0), abs=2e-3)


def test_a_sequence_of_features_reads_like_the_document() -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0), 20.0)
    document = city.document()
    header = {**document, "CityObjects": {}, "vertices": []}
    feature = {
        "type": "CityJSONFeature",
        "id": "h",
        "CityObjects": document["CityObjects"],
        "vertices": document["vertices"],
    }
    text = "\n".join(map(json.dumps, [header, feature])) + "\n"
    options = ReadOptions()
    records = list(cityjson_reader.records(io.BytesIO(text.encode()), options))
    (building,) = cityjson_reader.build(records[0], options).artifacts
    assert building == only(city)
    assert records[0].line == 2


def test_parts_may_come_before_their_building() -> None:
    city = City().add("part", gable_house(12.0, 8.0, 5.5, 35.0))
    city.objects["part"] |= {"type": "BuildingPart", "parents": ["h"]}
    city.objects["h"] = {"type": "Building", "children": ["part"], "geometry": []}
    assert only(city).id == "h"


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda d: d.update(vertices=d["vertices"][:3]), "broken geometry"),
        (lambda d: d["CityObjects"]["h"].update(geometry=[]), "no surfaces"),
        (lambda d: d["transform"].update(scale=[1.0] * 3), "m large"),
    ],
)
def test_broken_buildings_are_refused_by_name_and_reason(change: Any, reason: str) -> None:
    document = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)).document()
    change(document)
    with pytest.raises(InvalidInput, match=reason):
        read(document)


def test_a_model_without_meanings_is_told_by_its_normals() -> None:
    document = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)).document()
    del document["CityObjects"]["h"]["geometry"][0]["semantics"]
    ((building,), _) = read(document)
    assert building.boxes[0].roof.style == "gable"


def test_footprints_and_attributes_on_request(facade, tmp_path) -> None:
    path = tmp_path / "city"
    path.write_text(json.dumps(City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)).document()))
    plan = json.loads(facade("import", path, "--as", "footprints").stdout)
    assert shapely.Polygon(plan["polygon"][0]).area == pytest.approx(96.0)
    numbers = json.loads(facade("import", path, "--as", "attributes").stdout)
    assert numbers["mass"]["bbox"] == pytest.approx([12.0, 8.0, 5.5], abs=2e-3)
    assert numbers["facade"]["wwr"] == [None] * 4


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("urn:ogc:def:crs:EPSG::25832", "EPSG:25832"),
        ("http://www.opengis.net/def/crs/OGC/1.3/CRS84", "OGC:CRS84"),
        ("EPSG:7415", "EPSG:7415"),
        ("urn:adv:crs:ETRS89_UTM33*DE_DHHN2016_NH", "EPSG:25833"),
    ],
)
def test_reference_systems_are_named_one_way(text: str, name: str) -> None:
    assert named(text) == name


# --- real sources -------------------------------------------------------------------------------


def real(shared_data: Any, *names: str) -> list[Any]:
    folder = shared_data / "buildings"
    return sorted(path for name in names for path in folder.glob(name))


def buildings_of(path: Any, module: Any) -> dict[str, Building]:
    options = ReadOptions()
    found = {}
    with path.open("rb") as stream:
        for record in module.records(stream, options):
            try:
                built = module.build(record, options)
            except InvalidInput:
                continue
            found |= {building.id: building for building in built.artifacts}
    return found


def test_citygml_and_cityjson_of_the_same_house_agree(shared_data) -> None:
    pairs = real(shared_data, "ingolstadt-lod3/citygml/*.gml")
    assert pairs
    for path in pairs:
        other = path.parent.parent / f"{path.stem}.city.json"
        gml = buildings_of(path, citygml)
        cityjson = buildings_of(other, cityjson_reader)
        for name, building in gml.items():
            ours = np.array([(b.x, b.y, b.width, b.depth, b.height) for b in building.boxes])
            theirs = np.array(
                [(b.x, b.y, b.width, b.depth, b.height) for b in cityjson[name].boxes]
            )
            assert ours == pytest.approx(theirs, abs=5e-3)


def test_formats_are_told_apart_by_their_first_bytes(shared_data) -> None:
    names = {
        "nrw-lod2/*.city.json": "CityJSON",
        "nrw-lod2/*.gml": "CityGML",
        "ifc-sample-houses/*.ifc": "IFC",
        "nrel-hpxml-real-homes/house01.xml": "HPXML",
        "nrcan-energuide-h2k/houses.jsonl": "HOT2000",
        "ames-assessor/*.csv": "assessor table (CSV)",
    }
    for pattern, name in names.items():
        for path in real(shared_data, pattern):
            with path.open("rb") as stream:
                assert detect(stream.read(1 << 16)).name == name
    with pytest.raises(InvalidInput, match="no format"):
        detect(b"hello\n")
    with pytest.raises(InvalidInput, match="empty"):
        detect(b"")
