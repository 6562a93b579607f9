from __future__ import annotations

import itertools
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.building import Box, Building, Roof
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.parse import LABELS, ImageInfo, Parse, Region
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.geometry.checks import building_problems
from facade_tools.reconstruction.assemble import Assembly, assemble
from facade_tools.reconstruction.sides import view_of_labels, view_of_parse

INDEX = {name: i for i, name in enumerate(LABELS)}


def label_map(
    storeys: int = 4, columns: int = 5, *, door: bool = True, roof: int = 40
) -> np.ndarray:
    """A front of storeys of 60 pixels, the lowest without windows, under a roof and the sky."""
    height, width = 40 + roof + storeys * 60, columns * 50 + 10
    labels = np.full((height, width), INDEX["wall"], np.uint8)
    labels[: 40 + roof] = INDEX["roof"]
    labels[:40] = INDEX["sky"]
    for storey in range(1, storeys):
        y = height - storey * 60 - 48
        for column in range(columns):
            labels[y : y + 34, 20 + column * 50 : 40 + column * 50] = INDEX["window"]
    labels[50:65, 20:40] = INDEX["window"]  # of the roof
    if door:
        labels[height - 42 :, 100:120] = INDEX["door"]
    return labels


def elements(building: Building, side: str = "front"):
    return [e for piece in building.facades[side].pieces for e in piece.elements]


def test_storeys_and_eaves_are_read_from_a_label_map():
    view = view_of_labels(label_map())
    assert view.storeys == 4
    assert view.lines[0] == 320
    assert view.lines[-1] == pytest.approx(80, abs=6)
    assert view.storey == pytest.approx(60, abs=8)
    assert len(view.windows) == 15  # the roof's is none of the wall
    assert len(view.doors) == 1


def test_one_side_becomes_a_partial_building():
    building = assemble("one", {"front": view_of_labels(label_map())}, Assembly())
    assert not list(building_problems(building))
    assert building.partial
    assert building.complete == ()
    assert set(building.facades) == {"front"}
    assert building.boxes[0].height == 12.0
    assert building.boxes[0].width == pytest.approx(260 / 20, rel=0.15)
    assert len([e for e in elements(building) if e.kind == "window"]) == 15
    assert all(e.style == "unknown" and e.known for e in elements(building) if e.kind == "window")
    attributes = building_attributes(building)
    assert attributes.mass.bbox == (None, None, None)
    assert attributes.facade.wwr[1:] == (None, None, None)
    drawn = (label_map()[80:] == INDEX["window"]).mean() + (label_map() == INDEX["door"]).sum() / (
        240 * 260
    )
    assert attributes.facade.wwr[0] == pytest.approx(drawn, rel=0.12)


def test_the_main_door_is_the_one_that_is_seen():
    building = assemble("door", {"front": view_of_labels(label_map())}, Assembly())
    (door,) = [e for e in elements(building) if e.kind == "door"]
    assert door.main
    assert door.known
    assert door.v == 0.0
    assert door.u == pytest.approx(100 / 260 * building.boxes[0].width, abs=0.05)


@pytest.mark.parametrize(("pixels", "known"), [(8, False), (24, True)])
def test_a_door_seen_in_part_is_as_high_as_doors_are_and_a_fragment_is_none(pixels, known):
    """A storey has 60 pixels: the fragments are 0.4 and 1.2 m high."""
    labels = label_map(door=False)
    labels[len(labels) - pixels :, 100:120] = INDEX["door"]
    building = assemble("x", {"front": view_of_labels(labels)}, Assembly())
    (door,) = [e for e in elements(building) if e.kind == "door"]
    assert door.known == known
    assert door.height == pytest.approx(2.1)


def test_a_door_that_nobody_sees_is_a_guess():
    view = view_of_labels(label_map(door=False))
    (door,) = [e for e in elements(assemble("x", {"front": view}, Assembly())) if e.kind == "door"]
    assert door.main
    assert not door.known
    without = assemble("x", {"front": view}, Assembly(door=False))
    assert all(e.kind == "window" for e in elements(without))


def test_four_sides_make_the_mass_known():
    views = {
        "front": view_of_labels(label_map(4, 5)), "back": view_of_labels(label_map(4, 5)),
        "left": view_of_labels(label_map(4, 3)), "right": view_of_labels(label_map(4, 3)),
    }  # fmt: skip
    building = assemble("four", views, Assembly())
    assert set(building.complete) == {"mass", "garage"}
    assert not list(building_problems(building))
    box = building.boxes[0]
    assert box.width / box.depth == pytest.approx(260 / 160, rel=0.02)
    assert len(elements(building, "left")) == 10  # a door too: it is no main door
    assert sum(e.main for side in views for e in elements(building, side)) == 1


def test_storeys_are_those_that_most_sides_show():
    views = {
        "front": view_of_labels(label_map(5)), "left": view_of_labels(label_map(4)),
        "right": view_of_labels(label_map(4)),
    }  # fmt: skip
    building = assemble("most", views, Assembly())
    assert building.boxes[0].height == 12.0
    drawn = assemble("draw", {k: views[k] for k in ("front", "left")}, Assembly())
    assert drawn.boxes[0].height == 15.0
    assert not list(building_problems(building))


def test_scales_are_reconciled():
    metric = replace(view_of_labels(label_map()), scale=3.4 / 60)
    views = {"front": metric, "left": view_of_labels(label_map(4, 3))}
    building = assemble("scaled", views, Assembly())
    assert building.storey_height == pytest.approx(3.4, abs=0.3)
    assert building.boxes[0].width == pytest.approx(260 * 3.4 / 60, rel=0.01)


def test_a_footprint_with_a_wing_gets_the_front_on_its_foremost_walls():
    boxes = (
        Box("main", "general", 5, 8, 10, 8, 9.0, None),
        Box("wing", "general", 2, 3, 4, 6, 9.0, None),
    )
    mass = Building("plan", boxes, partial=True, complete=("mass",))
    building = assemble("l", {"front": view_of_labels(label_map(3, 5))}, Assembly(mass))
    assert not list(building_problems(building))
    assert building.boxes[0].height == 9.0
    assert building.storey_height == 3.0
    pieces = building.facades["front"].pieces
    assert {piece.box for piece in pieces if piece.elements} == {"main", "wing"}


def test_a_roof_from_above_stands_on_every_box():
    roof = Roof("hip", 30.0, "x")
    building = assemble("r", {"front": view_of_labels(label_map())}, Assembly(roof=roof))
    assert building.boxes[0].roof == roof
    assert "roof" in building.complete


def test_a_stated_depth_makes_the_mass_known():
    """What learn reads as the building's size and floors is then that of the pictures."""
    views = {"front": view_of_labels(label_map(5, 4))}
    open_ended = building_attributes(assemble("o", views, Assembly()))
    known = building_attributes(assemble("k", views, Assembly(depth=11.0)))
    assert open_ended.mass.bbox[2] is None
    assert known.mass.bbox[1:] == (11.0, 15.0)
    assert known.mass.arf == pytest.approx((1 / 3, 1 / 3, 1 / 3))
    assert set(known.mass.garage) == {0.0}
    assert set(known.mass.porch[0]) == {None}
    bare = building_attributes(assemble("b", views, Assembly(depth=11.0, porch=False)))
    assert set(bare.mass.porch[0]) == {0.0}


def parse_of(labels: np.ndarray) -> Parse:
    """The label map as regions: runs of every row."""
    regions = []
    for y, row in enumerate(labels):
        cuts = [0, *(np.flatnonzero(np.diff(row)) + 1).tolist(), len(row)]
        for x0, x1 in itertools.pairwise(cuts):
            regions.append(Region(LABELS[row[x0]], x0, y, x1, y + 1))
    size = (labels.shape[1], labels.shape[0])
    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return Parse(
        "p", ImageInfo("p.png", size, "0" * 64), identity, "mrf", "chain", "g", "none", 0.0, size,
        tuple(regions),
    )  # fmt: skip


def test_a_parse_shows_what_its_label_map_shows():
    labels = label_map()
    one, two = view_of_parse(parse_of(labels)), view_of_labels(labels)
    assert one.lines == two.lines
    assert sorted(one.windows.tolist()) == sorted(two.windows.tolist())


def test_a_picture_without_a_wall_is_refused():
    with pytest.raises(InvalidInput, match="no wall"):
        view_of_labels(np.full((60, 60), INDEX["sky"], np.uint8))


@st.composite
def openings(draw):
    labels = np.full((200, 160), INDEX["wall"], np.uint8)
    for _ in range(draw(st.integers(0, 12))):
        y, x = draw(st.integers(0, 190)), draw(st.integers(0, 150))
        height, width = draw(st.integers(3, 60)), draw(st.integers(3, 40))
        labels[y : y + height, x : x + width] = INDEX[draw(st.sampled_from(["window", "door"]))]
    return labels


@settings(deadline=None, max_examples=60)
@given(openings(), st.sampled_from([None, 2.6, 4.0]))
def test_any_picture_of_a_wall_gives_a_valid_building(labels, storey):
    try:
        view = view_of_labels(labels)
    except InvalidInput:
        return
    building = assemble("any", {"front": view}, Assembly(storey=storey))
    assert not list(building_problems(building))
    encode(building)


def test_the_command_takes_label_maps_and_named_sides(tmp_path, facade_here):
    for name, columns in (("a", 5), ("b", 3)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), label_map(4, columns))
    many = facade_here("assemble", tmp_path)
    assert [json.loads(line)["id"] for line in many.stdout.splitlines()] == ["a", "b"]
    options = ["--front", tmp_path / "a.png", "--left", tmp_path / "b.png", "--roof", "hip:30:y"]
    done = facade_here("assemble", *options, "--footprint", "13x8", "--windows", "sash")
    document = json.loads(done.stdout)
    assert document["complete"] == ["mass", "roof"]
    assert document["boxes"][0]["roof"] == {"style": "hip", "pitch": 30.0, "direction": "y"}
    assert set(document["facades"]) == {"front", "left"}
    assert len(document["provenance"]["inputs"]) == 2


def rectangles(path, sizes):
    """Write GeoJSON of rectangles (planar metres) by the ids of its features."""
    features = [{"type": "Feature", "properties": {}, "id": name,
                 "geometry": {"type": "Polygon",
                              "coordinates": [[[0, 0], [w, 0], [w, d], [0, d], [0, 0]]]}}
                for name, w, d in sizes]  # fmt: skip
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_of_several_footprints_each_picture_takes_its_own(tmp_path, facade_here):
    """By id, so that a picture left out shifts none of the others, and none is guessed."""
    for name in "abcd":
        cv2.imwrite(str(tmp_path / f"{name}.png"), label_map(4, 5))
    plots = rectangles(tmp_path / "plots.geojson", [("c", 12, 9), ("b", 14, 10), ("a", 15, 11)])
    options = ("--footprint", plots, "--metres")
    pictures = {name: tmp_path / f"{name}.png" for name in "abcd"}
    done = facade_here("assemble", pictures["a"], pictures["c"], *options, "--jobs", "2")
    found = [json.loads(line) for line in done.stdout.splitlines()]
    sizes = [(row["id"], row["boxes"][0]["width"], row["boxes"][0]["depth"]) for row in found]
    assert sizes == [("a", 15, 11), ("c", 12, 9)]
    named = facade_here("assemble", "--front", pictures["b"], "--left", pictures["d"], *options)
    assert json.loads(named.stdout)["boxes"][0]["width"] == 14
    missing = facade_here("assemble", *pictures.values(), *options, "--on-error", "skip")
    assert missing.returncode == 3
    assert len(missing.stdout.splitlines()) == 3
    assert b"d.png: none of 3 footprints has the parse's id 'd'; expected it among 'c'" in (
        missing.stderr
    )
    twice = rectangles(tmp_path / "twice.geojson", [("a", 12, 9), ("a", 14, 10)])
    done = facade_here("assemble", pictures["a"], "--footprint", twice, "--metres")
    assert done.returncode == 3
    assert b"two footprints have the id 'a'" in done.stderr


@pytest.mark.parametrize(("tags", "eaves", "storey"), [
    ({}, 12.0, 3.0), ({"building:levels": 5}, 15.0, 3.75), ({"height": "20 m"}, 20.0, 5.0),
])  # fmt: skip
def test_a_map_without_heights_leaves_them_to_the_picture(
    tmp_path, facade_here, tags, eaves, storey
):
    ring = [[0, 0], [13, 0], [13, 8], [0, 8], [0, 0]]
    feature = {"type": "Feature", "properties": {"building": "yes", **tags},
               "geometry": {"type": "Polygon", "coordinates": [ring]}}  # fmt: skip
    (tmp_path / "plot.geojson").write_text(json.dumps(feature))
    cv2.imwrite(str(tmp_path / "a.png"), label_map(4, 5))
    plot = ("--footprint", tmp_path / "plot.geojson", "--metres")
    done = facade_here("assemble", "--front", tmp_path / "a.png", *plot)
    assert done.returncode == 0, done.stderr
    building = json.loads(done.stdout)
    assert [box["height"] for box in building["boxes"]] == [eaves]
    assert building["storey_height"] == storey
    assert building["provenance"]["options"]["metres"] is True


@pytest.mark.parametrize(("arguments", "code", "word"), [
    ((), 2, b"name parses"), (("--front", "missing.json"), 3, b"missing.json"),
    (("--front", "x.png", "--roof", "onion"), 2, b"expected STYLE"),
    (("--front", "x.png", "--footprint", "0x9"), 2, b"2 to 1000"),
    (("x.png", "--footprint", "8x9", "--depth", "9"), 2, b"--footprint or --depth"),
])  # fmt: skip
def test_what_is_wrong_is_said(facade_here, tmp_path, arguments, code, word):
    done = facade_here("assemble", *arguments, cwd=tmp_path)
    assert done.returncode == code
    assert word in done.stderr
