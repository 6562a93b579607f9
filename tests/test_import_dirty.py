"""Files as people have them: every version and variant of a format gives the same house."""

from __future__ import annotations

import copy
import io
import json
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from facade_tools.artifacts.building import Building
from facade_tools.errors import InvalidInput
from facade_tools.formats import assessor, hpxml
from facade_tools.formats.detect import detect
from facade_tools.formats.model_store import ModelStore
from facade_tools.formats.models import House
from facade_tools.formats.projection import to_degrees
from facade_tools.formats.reading import ReadOptions

from .city_sources import City, Polygon, flat_box, gable_house

HOUSE = gable_house(12.0, 8.0, 5.5, 35.0)
TURN, SHIFT = 31.0, (321.5, 45.25, 12.0)
PLACE = (678321.5, 5403045.25, 412.0)


def read(data: bytes) -> tuple[list[Any], Counter[str]]:
    """Read a file of any format; a refused building counts as a note."""
    options, notes, found = ReadOptions(), Counter[str](), []
    form = detect(data[: 1 << 16])
    for record in form.records(io.BytesIO(data), options):
        try:
            built = form.build(record, options)
        except InvalidInput as error:
            notes[error.message] += 1
            continue
        found += built.artifacts
        notes += built.notes
    return found, notes


def check(building: Building, place: tuple[float, ...] = PLACE, turn: float = TURN) -> None:
    (box,) = building.boxes
    assert (box.width, box.depth, box.height) == pytest.approx((12.0, 8.0, 5.5), abs=2e-3)
    assert box.roof is not None
    assert (box.roof.style, box.roof.direction) == ("gable", "x")
    assert building.frame is not None
    assert building.frame.shift == pytest.approx(place, abs=2e-3)
    assert building.frame.rotation == pytest.approx(turn, abs=0.02)


# --- CityJSON -------------------------------------------------------------------------------------
def document() -> dict[str, Any]:
    return copy.deepcopy(City().add("h", HOUSE, TURN, SHIFT).document())


def shape_of(city: dict[str, Any]) -> dict[str, Any]:
    return city["CityObjects"]["h"]["geometry"][0]


def version_1(city: dict[str, Any]) -> None:
    scale, shift = city["transform"]["scale"], city["transform"]["translate"]
    city["version"] = "1.0"
    city["vertices"] = (np.array(city["vertices"]) * scale + shift).tolist()
    city["metadata"] = {"referenceSystem": "urn:ogc:def:crs:EPSG::25832"}
    del city["transform"]
    shape_of(city)["lod"] = 2


def solid(city: dict[str, Any], kind: str = "Solid") -> None:
    shape = shape_of(city)
    values = [shape["semantics"]["values"]]
    shape["type"], shape["boundaries"] = kind, [shape["boundaries"]]
    if kind != "Solid":
        shape["boundaries"], values = [shape["boundaries"]], [values]
    shape["semantics"]["values"] = values


def solid_with_flat_values(city: dict[str, Any]) -> None:
    values = shape_of(city)["semantics"]["values"]
    solid(city)
    shape_of(city)["semantics"]["values"] = values


def without_meaning(city: dict[str, Any]) -> None:
    solid(city, "CompositeSolid")
    del shape_of(city)["semantics"]


def of_a_template(city: dict[str, Any]) -> None:
    plain = City().add("h", HOUSE)
    c, s = math.cos(math.radians(TURN)), math.sin(math.radians(TURN))
    city["geometry-templates"] = {
        "templates": [shape_of(city)],
        "vertices-templates": (np.array(plain.vertices) / 1000).tolist(),
    }
    instance = {
        "type": "GeometryInstance",
        "template": 0,
        "boundaries": [0],
        "transformationMatrix": [c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
    }
    city["vertices"] = [[round(1000 * value) for value in SHIFT]]
    city["CityObjects"]["h"]["geometry"] = [instance]


def dirty(city: dict[str, Any]) -> None:
    shape = shape_of(city)
    shape["boundaries"] += [[[0, 0, 0]], [[0, 1]]]
    shape["semantics"]["values"] += [None, 0]
    for polygon in shape["boundaries"][:4]:
        polygon[0].reverse()


def of_an_extension(city: dict[str, Any]) -> None:
    city["CityObjects"]["h"]["type"] = "+NoisyBuilding"


def with_a_room(city: dict[str, Any]) -> None:
    city["CityObjects"]["room"] = {"type": "BuildingRoom", "parents": ["h"], "geometry": []}
    city["CityObjects"]["h"]["children"] = ["room"]


def without_its_parent(city: dict[str, Any]) -> None:
    city["CityObjects"]["h"] |= {"type": "BuildingPart", "parents": ["missing"]}


@pytest.mark.parametrize(
    "change",
    [
        version_1,
        solid,
        lambda city: solid(city, "MultiSolid"),
        solid_with_flat_values,
        without_meaning,
        of_a_template,
        dirty,
        of_an_extension,
        with_a_room,
        without_its_parent,
    ],
)
def test_every_kind_of_cityjson_gives_the_house(change: Any) -> None:
    city = document()
    change(city)
    (building,), _ = read(json.dumps(city).encode())
    check(building)


@pytest.mark.parametrize(
    "text",
    [
        b"\xef\xbb\xbf" + json.dumps(document()).encode(),
        json.dumps(document(), indent=1).encode(),
        json.dumps({name: document()[name] for name in reversed(document())}).encode(),
    ],
)
def test_layout_and_order_of_a_document_do_not_matter(text: bytes) -> None:
    (building,), _ = read(text)
    check(building)


def lines(*values: Any) -> bytes:
    return b"\n\n".join(v if isinstance(v, bytes) else json.dumps(v).encode() for v in values)


def feature(city: dict[str, Any]) -> dict[str, Any]:
    kept = {name: city[name] for name in ("CityObjects", "vertices")}
    return {"type": "CityJSONFeature", "id": "f", **kept}


def test_a_broken_line_of_a_sequence_is_refused_alone() -> None:
    header = {**document(), "CityObjects": {}, "vertices": []}
    found, notes = read(lines(header, b'{"type": "CityJSONFeature", ', feature(document())))
    check(found[0])
    assert len(found) == 1
    assert sum(notes.values()) == 1


def test_a_sequence_gives_garages_to_their_houses() -> None:
    house = City().add("h", HOUSE, function="31001_1010").document()
    garage = City().add("g", flat_box(6.1, -3, 9.1, 3, 2.6), function="31001_2463").document()
    header = {**house, "CityObjects": {}, "vertices": []}
    (building,), _ = read(lines(header, feature(garage), feature(house)))
    assert [box.kind for box in building.boxes] == ["general", "garage"]


def test_a_small_building_that_adjoins_nothing_after_all_is_kept() -> None:
    city = City().add("h", HOUSE, 45.0)
    city.add("hut", flat_box(5.2, 5.2, 9.0, 8.2, 2.6))  # near the box around the turned house
    found, _ = read(json.dumps(city.document()).encode())
    assert sorted(building.id for building in found) == ["h", "hut"]


def in_degrees(city: dict[str, Any], north_first: bool = False) -> dict[str, Any]:
    degrees = to_degrees(np.array(city["vertices"])[:, :2] / 1000, (11.43, 48.76))
    if north_first:
        degrees = degrees[:, ::-1]
    base = degrees[0]
    steps = np.rint((degrees - base) / 1e-10)
    heights = [row[2] for row in city["vertices"]]
    city["vertices"] = [[int(a), int(b), z] for (a, b), z in zip(steps, heights, strict=True)]
    city["transform"] = {"scale": [1e-10, 1e-10, 1e-3], "translate": [*base.tolist(), 400.0]}
    return city


@pytest.mark.parametrize("system", ["https://www.opengis.net/def/crs/EPSG/0/4979", None])
def test_degrees_of_a_city_model_are_projected(system: str | None) -> None:
    city = in_degrees(document())
    city["metadata"] = {} if system is None else {"referenceSystem": system}
    (building,), _ = read(json.dumps(city).encode())
    frame = building.frame
    assert frame is not None
    assert "+lat_0=48.7500000 +lon_0=11.5000000" in frame.crs
    middle = to_degrees(np.array([frame.shift[:2]]), (11.5, 48.75))
    expected = to_degrees(np.array([SHIFT[:2]]), (11.43, 48.76))
    assert middle == pytest.approx(expected, abs=1e-8)
    check(building, frame.shift, frame.rotation)
    assert frame.shift[2] == pytest.approx(412.0)
    assert frame.rotation == pytest.approx(TURN, abs=0.1)  # the grid's north turns a little


def test_feet_of_a_city_model_become_metres() -> None:
    city = document()
    city["transform"]["scale"] = [0.001 * 3937 / 1200] * 3
    city["transform"]["translate"] = [v * 3937 / 1200 for v in City().translate]
    city["metadata"] = {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/2263"}
    (building,), _ = read(json.dumps(city).encode())
    check(building)
    assert building.frame is not None
    assert building.frame.crs == "EPSG:2263 in metres"


# --- CityGML --------------------------------------------------------------------------------------
GML = {
    "1.0": ("http://www.opengis.net/citygml/1.0", "http://www.opengis.net/gml"),
    "2.0": ("http://www.opengis.net/citygml/2.0", "http://www.opengis.net/gml"),
    "3.0": ("http://www.opengis.net/citygml/3.0", "http://www.opengis.net/gml/3.2"),
}


def citygml(
    version: str, points: Any, srs: str = "urn:ogc:def:crs:EPSG::25832", whole: bool = False
) -> bytes:
    """A house; points: text of a corner; whole: one solid without meanings."""

    def polygon(rings: Any) -> str:
        (ring,) = rings
        text = " ".join(points(point) for point in [*ring, ring[0]])
        return (
            f"<g:surfaceMember><g:Polygon><g:exterior><g:LinearRing><g:posList>{text}"
            "</g:posList></g:LinearRing></g:exterior></g:Polygon></g:surfaceMember>"
        )

    if whole:
        faces = "".join(polygon(rings) for _, rings in HOUSE)
        body = (
            f"<lod2Solid><g:Solid><g:exterior><g:CompositeSurface>{faces}"
            "</g:CompositeSurface></g:exterior></g:Solid></lod2Solid>"
        )
    else:
        holder = "boundary" if version == "3.0" else "boundedBy"
        body = "".join(
            f"<{holder}><{kind}><lod2MultiSurface><g:MultiSurface>{polygon(rings)}"
            f"</g:MultiSurface></lod2MultiSurface></{kind}></{holder}>"
            for kind, rings in HOUSE
        )
    core, gml = GML[version]
    return (
        f'<?xml version="1.0"?><c:CityModel xmlns:c="{core}" xmlns="{core}/building" '
        f'xmlns:g="{gml}"><g:boundedBy><g:Envelope srsName="{srs}"/></g:boundedBy>'
        f'<c:cityObjectMember><Building g:id="h">{body}</Building></c:cityObjectMember>'
        "</c:CityModel>"
    ).encode()


def metres(point: Any) -> str:
    return " ".join(str(a + b) for a, b in zip(point, PLACE, strict=True))


@pytest.mark.parametrize("version", list(GML))
@pytest.mark.parametrize("whole", [False, True])
def test_every_version_of_citygml_gives_the_house(version: str, whole: bool) -> None:
    (building,), _ = read(citygml(version, metres, whole=whole))
    check(building, turn=0.0)


@pytest.mark.parametrize(
    ("system", "north_first"),
    [
        ("http://www.opengis.net/def/crs/EPSG/0/6697", True),
        ("EPSG:4326", False),
        ("http://www.opengis.net/def/crs/EPSG/0/4979", True),
    ],
)
@pytest.mark.parametrize("origin", [(139.7, 35.69), (11.43, 48.76), (-74.0, 40.7), (-43.2, -22.9)])
def test_axes_of_geographic_citygml(system: str, north_first: bool, origin: Any) -> None:
    def degrees(point: Any) -> str:
        place = to_degrees(np.array([point[:2]]), origin)[0].tolist()
        pair = reversed(place) if north_first else place
        return " ".join(f"{value:.11f}" for value in pair) + f" {point[2] + 12.0}"

    (building,), _ = read(citygml("2.0", degrees, system))
    frame = building.frame
    assert frame is not None
    check(building, frame.shift, frame.rotation)
    cell = [round(value * 4) / 4 for value in origin]
    middle = to_degrees(np.array([frame.shift[:2]]), (cell[0], cell[1]))
    assert middle[0] == pytest.approx(origin, abs=1e-8)


def test_coordinates_of_gml_2_are_read() -> None:
    data = citygml("1.0", lambda p: metres(p).replace(" ", ","))
    (building,), _ = read(data.replace(b"posList", b"coordinates"))
    check(building, turn=0.0)


# --- models on disk -------------------------------------------------------------------------------
def test_models_come_back_from_disk_as_they_went() -> None:
    polygons: list[Polygon] = [*HOUSE, ("Window", [[(0, -4, 1), (1, -4, 1), (1, -4, 2)]])]
    city = City().add("h", polygons, TURN, SHIFT, function="f", storeysAboveGround=2)
    city.add("b", flat_box(30, 0, 40, 9, 6), roofType="flat")
    data = json.dumps(city.document()).encode()
    records = detect(data).records(io.BytesIO(data), ReadOptions())
    models = [r.payload.model for r in records if isinstance(r.payload, House)]
    store = ModelStore()
    for model in models:
        store.add(model)
    for number in (1, 0):
        back, model = store[number], models[number]
        assert (back.id, back.origin, back.crs) == (model.id, model.origin, model.crs)
        assert (back.function, back.storeys) == (model.function, model.storeys)
        assert back.roof_types == model.roof_types
        pairs = list(zip(back.surfaces, model.surfaces, strict=True))
        assert all((a.meaning, a.group) == (b.meaning, b.group) for a, b in pairs)
        assert all(np.array_equal(a.rings[0], b.rings[0]) for a, b in pairs)


# --- tables ---------------------------------------------------------------------------------------
NAMES = sorted(assessor._named(assessor.AMES))


def table(**values: str) -> list[list[str]]:
    usual = {"PID": "7", "1st Flr SF": "1000", "2nd Flr SF": "500", "Roof Style": "Hip"}
    row = dict.fromkeys(NAMES, "0") | usual | {"Garage Type": "Attchd"} | values
    return [NAMES, [row[name] for name in NAMES]]


def written(rows: list[list[str]], mark: str, end: str = "\n", encoding: str = "utf-8") -> bytes:
    quoted = [[f'"{v}"' if mark in v or "\n" in v else v for v in row] for row in rows]
    return "".join(mark.join(row) + end for row in quoted).encode(encoding)


@pytest.mark.parametrize("mark", list(",;\t|"))
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_tables_are_read_however_they_are_written(mark: str, end: str, encoding: str) -> None:
    rows = table(**{"House Style": "Zweistöckig"})
    (found,), _ = read(written(rows, mark, end, encoding))
    assert found.id == "7"
    assert found.mass.arf == pytest.approx((2 / 3, 1 / 3, 0.0))
    assert found.tags["House Style"] == "Zweistöckig"


@pytest.mark.parametrize(
    ("mark", "main", "upper"), [(",", "1,000", "500.0"), (";", "1.000,0", "500,0")]
)
def test_thousands_and_decimal_commas(mark: str, main: str, upper: str) -> None:
    (found,), _ = read(written(table(**{"1st Flr SF": main, "2nd Flr SF": upper}), mark))
    assert found.mass.arf == pytest.approx((2 / 3, 1 / 3, 0.0))


def test_a_cell_may_run_over_lines_and_a_short_row_is_refused_alone() -> None:
    rows = [*table(**{"House Style": "2\nStory"}), ["8", "900"], table(PID="9")[1]]
    found, notes = read(written(rows, ","))
    assert [row.id for row in found] == ["7", "9"]
    assert sum(notes.values()) == 1


@pytest.mark.parametrize("text", ["Dear Sir, I write\nto you, as\nsaid before.\n", "a\nb\n"])
def test_prose_is_no_table(text: str) -> None:
    assert not assessor.detect(text.encode())


# --- HPXML ----------------------------------------------------------------------------------------
def test_a_prefix_of_the_name_space_does_not_hide_hpxml() -> None:
    assert hpxml.detect(b'<?xml version="1.0"?>\n<h:HPXML xmlns:h="x">')
    assert not hpxml.detect(b"<NotHPXML/>")


@pytest.mark.parametrize("order", [1, -1])
def test_thousands_of_parts_below_one_another_are_one_building(order: int) -> None:
    city = document()
    (root,) = city["CityObjects"]
    house = city["CityObjects"].pop(root)
    count = 3000
    chain = {
        f"p{k}": {"type": "BuildingPart", "parents": [f"p{k - 1}" if k else root]}
        for k in range(count)
    }
    for k in range(count - 1):
        chain[f"p{k}"]["children"] = [f"p{k + 1}"]
    rows = [(root, {**house, "children": ["p0"]}), *chain.items()]
    city["CityObjects"] = dict(rows[::order])
    found, _ = read(json.dumps(city).encode())
    assert [building.id for building in found] == [root]


@pytest.mark.parametrize("value", ["abc", {"x": 1}, 5, True])
@pytest.mark.parametrize("key", ["parents", "children"])
def test_relations_that_are_no_lists_are_refused_alone(key: str, value: Any) -> None:
    city = document()
    city["CityObjects"]["odd"] = {"type": "Building", key: value}
    records = detect(json.dumps(city).encode()[:1000]).records
    found = list(records(io.BytesIO(json.dumps(city).encode()), ReadOptions()))
    errors = [row.payload for row in found if isinstance(row.payload, InvalidInput)]
    assert [str(error) for error in errors] == [
        "/CityObjects/odd: parents or children are no list; expected ids of city objects"
    ]
    assert len(found) == 2
