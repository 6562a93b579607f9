"""The 49 attributes, against an independent slow oracle written with shapely, from CONTRACT 3."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from shapely import box as polygon_of
from shapely.ops import unary_union

from facade_tools.artifacts.building import Box, Building, Element, Facade, Piece, Roof
from facade_tools.artifacts.documents import decode, encode
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.attributes import (
    NAMES,
    attribute_matrix,
    attribute_vector,
    attributes_of_vector,
    building_attributes,
)
from facade_tools.geometry.pieces import facade_pieces

RIGHTS = {"front": (1, 0), "back": (-1, 0), "left": (0, -1), "right": (0, 1)}


# --- the oracle -----------------------------------------------------------------------------------


def oracle_polygon(box):
    xs = [round(box.x + sign * box.width / 2, 6) for sign in (-1, 1)]
    ys = [round(box.y + sign * box.depth / 2, 6) for sign in (-1, 1)]
    return polygon_of(xs[0], ys[0], xs[1], ys[1])


def oracle_floor(building, i):
    level = (i + 0.5) * building.storey_height + 1e-6
    boxes = [b for b in building.boxes if b.kind != "porch" and b.height > level]
    return unary_union([oracle_polygon(b) for b in boxes])


def oracle_part(building, candidates, outline_of):
    if not candidates:
        return [0.0] * 6
    part = max(candidates, key=lambda b: b.width * b.depth)
    x0, y0, x1, y1 = oracle_floor(building, 0).bounds
    ring = oracle_polygon(part).exterior
    exposed = ring.intersection(outline_of(part).boundary).length / ring.length
    place = [(part.x - x0) / (x1 - x0), (part.y - y0) / (y1 - y0)]
    return [*place, part.width, part.depth, part.height, exposed]


def oracle_mass(building):
    floors = [oracle_floor(building, i) for i in range(3)]
    everything = unary_union([oracle_polygon(b) for b in building.boxes if b.kind != "porch"])
    x0, y0, x1, y1 = everything.bounds
    base = floors[0].envelope.area
    total = sum(f.area for f in floors)
    _, low, _, high = floors[0].bounds
    porches = [b for b in building.boxes if b.kind == "porch"]
    front = [b for b in porches if b.y < (low + high) / 2]
    back = [b for b in porches if b.y >= (low + high) / 2]
    garages = [b for b in building.boxes if b.kind == "garage"]

    def with_porch(porch):
        return unary_union([floors[0], oracle_polygon(porch)])

    return [
        *(x1 - x0, y1 - y0, max(b.height for b in building.boxes if b.kind != "porch")),
        floors[0].area / base,
        floors[0].length / math.sqrt(floors[0].area),
        total / base,
        *(f.area / total for f in floors),
        *oracle_part(building, garages, lambda _: floors[0]),
        *oracle_part(building, front, with_porch),
        *oracle_part(building, back, with_porch),
    ]


def oracle_symmetric(piece):
    def edges(e, mirrored):
        left = piece.width - e.u - e.width if mirrored else e.u
        return np.array([left, left + e.width, e.v, e.v + e.height])

    return all(
        any(
            (e.kind, e.style) == (f.kind, f.style)
            and np.abs(edges(e, True) - edges(f, False)).max() <= 0.05 + 1e-6
            for f in piece.elements
        )
        for e in piece.elements
    )


def oracle_side(side, pieces):
    area = sum(p.width * p.height for p in pieces)
    wwr = sum(e.width * e.height for p in pieces for e in p.elements) / area
    sym = sum(p.width * p.height for p in pieces if oracle_symmetric(p)) / area

    def start(p):
        return float(np.dot(p.origin[:2], RIGHTS[side]))

    pairs = [
        (a, b)
        for a in pieces
        for b in pieces
        if a.elements and b.elements
        if abs(a.origin[2] + a.height - b.origin[2]) < 1e-6
        if abs(np.dot(np.subtract(a.origin[:2], b.origin[:2]), RIGHTS[side][::-1])) < 1e-6
        if min(start(a) + a.width, start(b) + b.width) - max(start(a), start(b))
        >= min(a.width, b.width) / 2 - 1e-6
    ]
    met = 0
    for lower, upper in pairs:
        few, many = (lower, upper) if len(lower.elements) < len(upper.elements) else (upper, lower)
        centres = [start(many) + e.u + e.width / 2 for e in many.elements]
        met += all(
            min(abs(start(few) + e.u + e.width / 2 - c) for c in centres) <= 0.1 + 1e-6
            for e in few.elements
        )
    return wwr, sym, met / len(pairs) if pairs else 1.0


def oracle(building):
    columns = [oracle_side(side, building.facades[side].pieces) for side in RIGHTS]
    roofs = {b.roof.style for b in building.boxes if b.kind == "general"}
    styles = {
        e.style
        for f in building.facades.values()
        for p in f.pieces
        for e in p.elements
        if e.kind == "window"
    }
    bits = [
        "flat" in roofs,
        bool(roofs & {"gable", "shed"}),
        bool(roofs & {"hip", "mansard"}),
        *(style in styles for style in ("sash", "sliding", "casement", "bay", "fixed")),
        *(name in building.features for name in ("chimney", "tower")),
    ]
    return np.array([*oracle_mass(building), *np.transpose(columns).ravel(), *bits], dtype=float)


# --- random buildings -----------------------------------------------------------------------------


def random_box(rng, name, kind):
    w, d = np.round(rng.uniform(2, 12, 2), int(rng.integers(0, 6)))
    x, y = np.round(rng.uniform(-5, 5, 2), int(rng.integers(0, 6)))
    height = float(rng.choice([2.6, 3.0, 4.4, 4.6, 5.8, 9.0, 12.0]))
    style = str(rng.choice(["flat", "gable", "hip", "shed", "cone", "mansard"]))
    return Box(name, kind, float(x), float(y), float(w), float(d), height, Roof(style, 30.0))


def random_elements(rng, piece):
    count = int(rng.integers(0, 4))
    symmetric_width = rng.random() < 0.5
    rows = []
    for k in range(count):
        u = (k + 0.5) * piece.width / count - 0.4
        u += 0 if symmetric_width else rng.uniform(-0.12, 0.12)
        style = str(rng.choice(["sash", "sash", "bay"]))
        kind = "window" if rng.random() < 0.8 else "door"
        rows.append(Element(kind, style, float(u), 0.8 + rng.uniform(0, 0.06), 0.8, 1.2))
    return tuple(rows)


def random_building(rng):
    kinds = ["general", *rng.choice(["general", "garage", "porch"], int(rng.integers(0, 6)))]
    boxes = tuple(random_box(rng, f"b{i}", str(kind)) for i, kind in enumerate(kinds))
    house = Building("h", boxes, storey_height=float(rng.choice([2.7, 3.0])))
    facades = {
        side: Facade(tuple(replace(p, elements=random_elements(rng, p)) for p in pieces))
        for side, pieces in facade_pieces(house).items()
    }
    features = tuple(name for name in ("chimney", "tower") if rng.random() < 0.5)
    return replace(house, facades=facades, features=features)


@pytest.fixture(scope="module")
def houses():
    rng = np.random.default_rng(3)
    return [random_building(rng) for _ in range(400)]


def test_all_49_equal_the_oracle(houses):
    for house in houses:
        found = attribute_vector(building_attributes(house))
        np.testing.assert_allclose(found, oracle(house), atol=1e-9, err_msg=str(house.boxes))


def test_names_are_49_and_vectors_round_trip(houses):
    assert len(set(NAMES)) == len(NAMES) == 49
    for house in houses[:20]:
        attributes = building_attributes(house)
        vector = attribute_vector(attributes)
        assert attributes_of_vector("h", vector, house.storey_height) == attributes
        assert decode(encode(attributes), "attributes") == attributes
    assert attribute_matrix([]).shape == (0, 49)


# --- worked examples ------------------------------------------------------------------------------


GABLE = Roof("gable", 30.0)


def general(x0, y0, x1, y1, height=3.0, name="a", kind="general", roof=GABLE):
    centre = (x0 + x1) / 2, (y0 + y1) / 2
    return Box(name, kind, *centre, x1 - x0, y1 - y0, height, roof)


def test_ell_with_garage_by_hand():
    boxes = (general(0, 0, 10, 8, 6), general(10, 0, 16, 6, 3, "g", "garage"))
    a = building_attributes(Building("h", boxes)).mass
    assert a.bbox == (16, 8, 6)
    assert a.bcr == pytest.approx(116 / 128)
    assert a.bdry == pytest.approx(48 / math.sqrt(116))
    assert a.far == pytest.approx(196 / 128)
    assert a.arf == pytest.approx((116 / 196, 80 / 196, 0))
    assert a.garage == pytest.approx((13 / 16, 3 / 8, 6, 6, 3, 18 / 24))
    assert a.porch == ((0,) * 6, (0,) * 6)


def test_largest_garage_counts_and_ties_go_by_order():
    first = general(-6, 0, 0, 6, 3, "g1", "garage")
    second = general(10, 0, 16, 6, 4, "g2", "garage")
    house = Building("h", (general(0, 0, 10, 8), first, second))
    assert building_attributes(house).mass.garage[4] == 3
    larger = replace(second, width=6.5)
    swapped = replace(house, boxes=(house.boxes[0], first, larger))
    assert building_attributes(swapped).mass.garage[4] == 4


def test_building_without_facades_has_null_facade_attributes():
    a = building_attributes(Building("h", (general(0, 0, 9, 9),)))
    assert a.facade.wwr == a.facade.sym == a.facade.align == (None,) * 4
    assert a.element.roof == {"flat": 0, "gable": 1, "hip": 0}


def test_building_without_mass_is_refused():
    with pytest.raises(InvalidInput, match="half a storey"):
        building_attributes(Building("h", (general(0, 0, 9, 9, 1.5),)))


def test_inputs_are_not_mutated(houses):
    before = json.dumps(encode(houses[0]), sort_keys=True)
    building_attributes(houses[0])
    assert json.dumps(encode(houses[0]), sort_keys=True) == before


# --- partial buildings ----------------------------------------------------------------------------


def partial(*boxes, complete=(), **rest):
    return Building("p", boxes, partial=True, complete=complete, **rest)


def test_incomplete_mass_is_null_with_bounds():
    known = general(0, 0, 10, 8, None, roof=None), general(10, 0, 16, 6, 3, "g", "garage")
    a = building_attributes(partial(*known))
    assert a.mass.bbox == (None,) * 3
    assert (a.mass.bcr, a.mass.bdry, a.mass.far, a.mass.arf) == (None, None, None, (None,) * 3)
    assert a.bounds.bbox_min == (16, 8, 3)
    assert a.bounds.low_area == (36, 36)
    assert a.mass.garage == pytest.approx((13 / 16, 3 / 8, 6, 6, 3, 18 / 24))
    assert a.mass.porch == ((None,) * 6,) * 2
    assert (a.present.garage, a.present.porch_front) == (True, None)
    assert a.element.roof == dict.fromkeys(("flat", "gable", "hip"))


@pytest.mark.parametrize(
    ("storey", "height", "low"),
    [(3.0, 3.4, (14, 14)), (3.0, 3.5, (0, 14)), (2.4, 3.6, (14, 14)), (2.4, 3.7, (0, 14))],
)
def test_plan_of_boxes_too_low_for_floors(storey, height, low):
    """Of those that lie under a box of unknown height it is not known; 3 m is not stated."""
    house, wing = general(0, 0, 10, 8, None, roof=None), general(8, 0, 12, 7, height, "wing")
    under = general(9, 0, 10, 1, 2, "under")
    for boxes in ((house, wing), (house, wing, under)):
        found = building_attributes(partial(*boxes, storey_height=storey)).bounds
        assert found.low_area == low


def test_complete_says_what_is_absent():
    known = (general(0, 0, 10, 8, 6),)
    a = building_attributes(partial(*known, complete=("mass", "porch", "roof")))
    assert a.mass.bbox == (10, 8, 6)
    assert a.bounds is None
    assert a.mass.garage == (0,) * 6
    assert a.mass.porch == ((0,) * 6,) * 2
    assert (a.present.garage, a.present.porch_back) == (False, False)
    assert a.element.roof == {"flat": 0, "gable": 1, "hip": 0}
    assert a.element.special == {"chimney": None, "tower": None}


def test_complete_mass_of_unknown_height_keeps_its_plan():
    a = building_attributes(partial(general(0, 0, 10, 8, None), complete=("mass",)))
    assert a.mass.bbox == (10, 8, None)
    assert a.mass.bcr == 1
    assert (a.mass.far, a.mass.arf) == (None, (None,) * 3)


def test_unobserved_sides_are_null_and_empty_sides_too():
    window = Element("window", "bay", 1.0, 1.0, 2.0, 1.0)
    piece = Piece("front-1", "a", (0.0, 0.0, 0.0), 10.0, 3.0, (window,))
    house = partial(general(0, 0, 10, 8), facades={"front": Facade((piece,)), "left": Facade(())})
    a = building_attributes(house)
    assert a.facade.wwr == (pytest.approx(2 / 30), None, None, None)
    assert a.facade.sym == (0, None, None, None)
    assert a.facade.align == (1, None, None, None)
    assert a.element.window["bay"] == 1
    assert a.element.window["sash"] is None


def test_porch_of_a_building_without_listed_mass_is_unknown():
    a = building_attributes(partial(general(0, 0, 3, 2, 2.5, "p", "porch")))
    assert a.mass.porch == ((None,) * 6,) * 2
    assert a.bounds is None


# --- the command ----------------------------------------------------------------------------------


def test_command_streams_buildings(facade, tmp_path, houses):
    path = tmp_path / "houses.jsonl"
    path.write_text(
        "".join(json.dumps(encode(replace(h, id=f"h{i}"))) + "\n" for i, h in enumerate(houses[:3]))
    )
    result = facade("attributes", path)
    rows = [json.loads(line) for line in result.stdout.splitlines()]
    assert [row["id"] for row in rows] == ["h0", "h1", "h2"]
    found = attribute_matrix([decode(row, "attributes") for row in rows])
    expected = np.array([oracle(h) for h in houses[:3]])
    np.testing.assert_allclose(found, expected, atol=1e-9)
    assert rows[0]["provenance"]["stage"] == "attributes"
    assert facade("attributes", tmp_path / "none.json").returncode == 3
