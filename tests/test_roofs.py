"""Roofs: what is built over boxes and over polygons of maps."""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from pathlib import Path

import catalogue
import numpy as np
import pytest
import shapely
import trimesh

from facade_tools.artifacts.building import Box, Building, Roof
from facade_tools.artifacts.footprint import Footprint
from facade_tools.errors import InvalidInput
from facade_tools.geometry.polygons import oriented, shape_of, signed_area, sound
from facade_tools.geometry.roofs import Patch, sloped_patches, truncated, union_patches
from facade_tools.geometry.skeleton import Contour, straight_skeleton
from facade_tools.geometry.solids import Solid, building_solid, footprint_solid, triangulated

POLYGONS = catalogue.polygons()
SLOPE = math.tan(math.radians(35.0))


def as_mesh(solid: Solid) -> trimesh.Trimesh:
    vertices, triangles, _ = triangulated(solid)
    return trimesh.Trimesh(vertices, triangles, process=False)


def height(patches: list[Patch], x: float, y: float) -> float:
    """The upper envelope, by brute force."""
    over = [p for p in patches if shapely.intersects_xy(shape_of(p.rings), x, y)]
    return max(p.plane[0] * x + p.plane[1] * y + p.plane[2] for p in over)


def footprint(polygon: catalogue.Polygon, roof: Roof | None) -> Footprint:
    rings = tuple(tuple((float(x), float(y)) for x, y in ring) for ring in polygon)
    return Footprint("f", rings, 6.0, roof)


# --- one box --------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("style", "volume"),
    [
        ("flat", 0.0),
        ("gable", 10 * 6 * 3 * SLOPE / 2),
        ("hip", (6 * 6 / 3 + 6 * 4 / 2) * 3 * SLOPE),
        ("shed", 10 * 6 * 10 * SLOPE / 2),
    ],
)
def test_volume_of_one_roof(style: str, volume: float) -> None:
    box = catalogue.box("b", (0, 0, 10, 6), 4, roof=catalogue.roofed(style))
    assert as_mesh(building_solid(Building("b", (box,)))).volume == pytest.approx(240 + volume)


def test_mansard_is_steep_then_shallow() -> None:
    box = catalogue.box("b", (0, 0, 10, 8), 4, roof=catalogue.roofed("mansard", 30))
    slopes = {round(math.hypot(*p.plane[:2]), 6) for p in union_patches([box])}
    assert slopes == {
        round(math.tan(math.radians(70)), 6),
        round(math.tan(math.radians(30)), 6),
    }


def test_cone_has_its_apex_in_the_middle() -> None:
    box = catalogue.box("b", (0, 0, 4, 4), 4, roof=catalogue.roofed("cone", 60))
    solid = building_solid(Building("b", (box,)))
    top = solid.vertices[np.argmax(solid.vertices[:, 2])]
    assert top == pytest.approx([2, 2, 4 + 2 * math.tan(math.radians(60))])


def test_a_tower_stands_out_of_a_roof_at_its_own_height() -> None:
    house = catalogue.box("a", (0, 0, 12, 10), 6, roof=catalogue.roofed("hip", 45))
    tower = catalogue.box("t", (-1, -1, 3, 3), 6, roof=catalogue.roofed("cone", 60))
    apart = catalogue.box("t", (20, 0, 24, 4), 6, roof=catalogue.roofed("cone", 60))
    rise = 2 * math.tan(math.radians(60))
    patches = union_patches([house, tower])
    # The house's roof stands 1 m above the eaves over the tower's middle.
    assert height(patches, 1.0, 1.0) == pytest.approx(7.0 + rise)
    assert as_mesh(building_solid(Building("b", (house, tower)))).is_volume
    assert height(union_patches([house, apart]), 22.0, 2.0) == pytest.approx(6.0 + rise)
    low = catalogue.box("t", (-1, -1, 3, 3), 3, roof=catalogue.roofed("cone", 60))
    assert max(p.plane[2] for p in union_patches([house, low]) if p.owner == "t") < 30.0


# --- unions of boxes ------------------------------------------------------------------------------
def test_touching_hips_are_the_roof_of_their_outline() -> None:
    boxes = catalogue.plan_building("L", catalogue.roofed("hip")).boxes
    rings = oriented(POLYGONS["L"])
    expected = sloped_patches(rings, 6.0, catalogue.roofed("hip"))
    found = union_patches(boxes)
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(0, 13, (200, 2)):
        if shapely.contains_xy(shape_of(rings), x, y):
            assert height(found, x, y) == pytest.approx(height(expected, x, y), abs=1e-6)


def test_gabled_wing_meets_the_main_roof_in_valleys() -> None:
    boxes = catalogue.plan_building("T", catalogue.roofed("gable", 45)).boxes
    patches = union_patches(boxes)
    assert height(patches, 7.5, 1.0) == pytest.approx(6 + 2.5)  # ridge of the wing
    assert height(patches, 7.5, 7.0) == pytest.approx(6 + 2.5)  # goes on into the main roof
    assert height(patches, 7.5, 9.0) == pytest.approx(6 + 3.0)  # below the main ridge
    assert height(patches, 7.5, 11.9) == pytest.approx(6 + 0.1)  # and does not come out behind
    assert height(patches, 5.5, 6.2) == pytest.approx(6 + 0.5)  # valley


def test_a_gable_that_would_come_out_of_another_roof_is_hidden() -> None:
    main = Box("main", "general", 4.7, 7.3, 9.4, 14.6, 3.0, Roof("gable", 38, "y"))
    alone = building_solid(Building("b", (main,)))
    inside = Box("wing", "general", 5.0, 6.4, 8.0, 7.5, 2.3, Roof("gable", 38, "x"))
    assert as_mesh(building_solid(Building("b", (main, inside)))).volume == pytest.approx(
        as_mesh(alone).volume
    )
    flush = replace(inside, x=4.0, height=3.0)  # the cross gable of a house front
    crossed = as_mesh(building_solid(Building("b", (main, flush))))
    assert crossed.volume > as_mesh(alone).volume + 5


def test_low_wing_is_clipped_by_the_high_wall() -> None:
    house = catalogue.box("a", (0, 0, 8, 8), 6, roof=catalogue.roofed("flat"))
    wing = catalogue.box("b", (8, 1, 14, 7), 3, roof=catalogue.roofed("gable", 30, "x"))
    solid = building_solid(Building("b", (house, wing)))
    over = solid.vertices[solid.vertices[:, 0] < 8 - 1e-6]
    assert set(np.round(over[:, 2], 6)) == {0.0, 6.0}
    assert as_mesh(solid).is_volume


def test_lean_to_falls_away_from_its_wall() -> None:
    house = catalogue.box("a", (0, 0, 8, 8), 6)
    shed = catalogue.box("b", (1, 8, 6, 11), 3, roof=catalogue.roofed("shed", 15, "y"))
    patches = union_patches([house, shed])
    assert height(patches, 3, 8.5) > height(patches, 3, 10.5)


def test_no_roof_below_its_eaves_and_walls_at_the_eaves() -> None:
    rng = np.random.default_rng(4)
    for name, building in catalogue.buildings().items():
        boxes = [box for box in building.boxes if box.kind != "porch"]
        patches = union_patches(boxes)
        for box in boxes:
            inside = rng.uniform(-0.5, 0.5, (10, 2)) * (box.width, box.depth) + (box.x, box.y)
            for x, y in inside:
                assert height(patches, x, y) >= (box.height or 0) - 1e-6, name


def test_solid_is_the_envelope() -> None:
    """Volume under the solid = integral of the envelope, by Monte Carlo over a fine grid."""
    for building in (catalogue.buildings()["victorian"], catalogue.buildings()["heights"]):
        patches = union_patches([box for box in building.boxes if box.kind != "porch"])
        shapes = shapely.union_all([shape_of(patch.rings) for patch in patches])
        x0, y0, x1, y1 = shapes.bounds
        step = 0.25
        total = 0.0
        for x in np.arange(x0 + step / 2, x1, step):
            for y in np.arange(y0 + step / 2, y1, step):
                if shapely.contains_xy(shapes, x, y):
                    total += height(patches, x, y) * step * step
        assert as_mesh(building_solid(building)).volume == pytest.approx(total, rel=0.02)


@pytest.mark.parametrize("plan", catalogue.PLANS)
@pytest.mark.parametrize("style", catalogue.ROOF_STYLES)
def test_every_style_on_every_plan_is_a_volume(plan: str, style: str) -> None:
    building = catalogue.plan_building(plan, catalogue.roofed(style))
    mesh = as_mesh(building_solid(building))
    assert mesh.is_volume
    boxes = shapely.union_all([shapely.box(*r) for r in catalogue.rectangles(plan)])
    assert mesh.volume >= boxes.area * 6.0 - 1e-6


# --- polygons of maps -----------------------------------------------------------------------------
@pytest.mark.parametrize("name", POLYGONS)
@pytest.mark.parametrize("style", catalogue.ROOF_STYLES)
def test_every_style_on_every_polygon_is_a_volume(name: str, style: str) -> None:
    polygon = POLYGONS[name]
    mesh = as_mesh(footprint_solid(footprint(polygon, catalogue.roofed(style))))
    assert mesh.is_volume
    assert mesh.volume >= 6.0 * shapely.Polygon(polygon[0], polygon[1:]).area * (1 - 1e-6)


@pytest.mark.parametrize("name", POLYGONS)
@pytest.mark.parametrize("style", catalogue.ROOF_STYLES)
def test_patches_tile_the_polygon(name: str, style: str) -> None:
    rings = oriented(POLYGONS[name])
    patches = sloped_patches(rings, 3.0, catalogue.roofed(style))
    shapes = [shape_of(patch.rings) for patch in patches]
    area = shape_of(rings).area
    assert sum(shape.area for shape in shapes) == pytest.approx(area, rel=1e-6)
    assert shapely.union_all(shapes, grid_size=1e-9).area == pytest.approx(area, rel=1e-6)
    heights = [
        patch.plane[0] * x + patch.plane[1] * y + patch.plane[2]
        for patch in patches
        for x, y in patch.rings[0]
    ]
    assert min(heights) >= 3.0 - 1e-5


def test_real_footprints_are_volumes(shared_data: Path) -> None:
    for polygon in list(catalogue.real_footprints(shared_data).values())[::8]:
        for style in ("gable", "hip", "mansard"):
            mesh = as_mesh(footprint_solid(footprint(polygon, catalogue.roofed(style))))
            assert mesh.is_volume
            assert mesh.volume > 0


def test_gable_follows_the_direction() -> None:
    square = POLYGONS["square"]
    for direction, axis in (("x", 0), ("y", 1)):
        patches = sloped_patches(oriented(square), 3.0, catalogue.roofed("gable", 40, direction))
        assert len(patches) == 2
        assert all(abs(patch.plane[axis]) < 1e-9 for patch in patches)


def test_gable_ignores_a_small_jog() -> None:
    ring = [(0, 0), (12, 0), (12, 3), (12.2, 3), (12.2, 6), (0, 6)]
    patches = sloped_patches(oriented([ring]), 3.0, catalogue.roofed("gable", 40, "x"))
    assert len(patches) == 2


def test_a_square_plan_with_a_slit_still_gets_its_gables() -> None:
    outline = [(0, 0), (10, 0), (10, 5), (9.8, 5.1), (10, 5.2), (10, 10), (0, 10)]
    slit = [(9.7, 5.05), (9.8, 5.1), (9.7, 5.15)]  # touches the outline
    for direction in ("x", "y"):
        roof = catalogue.roofed("gable", 40, direction)
        (rings,) = sound([outline, slit])
        patches = sloped_patches(rings, 3.0, roof)
        axis = 0 if direction == "x" else 1
        along = [p for p in patches if abs(p.plane[axis]) < 0.1]
        area = sum(shape_of(patch.rings).area for patch in along)
        assert area > 0.7 * shape_of(rings).area  # of a hip half


def test_truncation_cuts_at_one_height() -> None:
    rings = oriented(POLYGONS["T"])
    contour, skeleton = Contour.of(rings), straight_skeleton(rings)
    parts = truncated(contour, skeleton, 1.0)
    low = [shape_of(rings_) for low, _ in parts for rings_ in low]
    inner = shapely.buffer(shape_of(rings), -1.0, join_style="mitre")
    ring = shape_of(rings).difference(inner)
    assert shapely.union_all(low, grid_size=1e-9).area == pytest.approx(ring.area, rel=1e-6)


def test_no_roof_is_flat() -> None:
    assert as_mesh(footprint_solid(footprint(POLYGONS["square"], None))).volume == 64 * 6


def test_polygon_without_area_is_invalid() -> None:
    with pytest.raises(InvalidInput, match="no area"):
        footprint_solid(footprint([[(0, 0), (1, 0), (2, 0)]], None))


def test_crossing_outline_is_repaired() -> None:
    bow_tie = [[(0, 0), (4, 4), (4, 0), (0, 4)]]
    assert len(sound(bow_tie)) == 2
    mesh = as_mesh(footprint_solid(footprint(bow_tie, catalogue.roofed("hip"))))
    assert mesh.is_volume


def test_failure_of_a_skeleton_gives_a_flat_roof(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("facade_tools.geometry.skeleton._PATHS", ())
    with caplog.at_level(logging.WARNING):
        patches = sloped_patches(oriented(POLYGONS["L"]), 3.0, catalogue.roofed("hip"))
    assert [patch.plane for patch in patches] == [(0.0, 0.0, 3.0)]
    assert "flat roof instead of hip" in caplog.text


def test_rings_are_oriented() -> None:
    outer, hole = oriented([POLYGONS["courtyard"][0][::-1], POLYGONS["courtyard"][1]])
    assert signed_area(outer) > 0 > signed_area(hole)
