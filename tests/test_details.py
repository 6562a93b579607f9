"""Detailed scenes: parts where they belong, closed, in the right frame."""

from __future__ import annotations

import copy
from dataclasses import replace
from itertools import permutations

import catalogue
import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.building import Box, Building, Chimney, Element, Facade, Piece, Roof
from facade_tools.errors import InvalidInput
from facade_tools.geometry.detail_boxes import box_triangles, side_frame
from facade_tools.geometry.detail_cladding import wall_pattern
from facade_tools.geometry.detail_overhangs import trimmed
from facade_tools.geometry.detail_roofs import THICKNESS, _slabs, roof_slabs
from facade_tools.geometry.detail_volumes import porch, prism
from facade_tools.geometry.details import (
    building_scene,
    building_sketch,
    footprint_scene,
    signed_volume,
)
from facade_tools.geometry.openings import openings_of, pierced
from facade_tools.geometry.polygons import shape_of
from facade_tools.geometry.scenes import bounds, shifts
from facade_tools.geometry.solids import building_solid, triangulated

BUILDINGS = catalogue.buildings()
WINDOWS = ("sash", "sliding", "casement", "bay", "fixed", "unknown")


def house(*elements: Element, roof: Roof | None = None) -> Building:
    """A box of 10 x 8 x 3 m with its front on y = 0."""
    box = Box("main", "general", 5.0, 4.0, 10.0, 8.0, 3.0, roof or Roof("gable", 30.0, "x", 0.4))
    piece = Piece("front-1", "main", (0.0, 0.0, 0.0), 10.0, 3.0, elements)
    return Building("house", (box,), {"front": Facade((piece,))})


def parts(scene, name):
    return [mesh for mesh in scene.meshes if mesh.name == name]


def as_trimesh(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)


@pytest.mark.parametrize("name", BUILDINGS)
def test_mass_is_a_closed_outward_solid_and_faces_index_vertices(name):
    before = copy.deepcopy(BUILDINGS[name])
    scene = building_scene(BUILDINGS[name])
    assert before == BUILDINGS[name]
    (mass,) = parts(scene, "mass")
    assert as_trimesh(mass).is_volume
    assert signed_volume(mass) > 0.0
    for mesh in scene.meshes:
        assert mesh.material in scene.materials
        assert np.isfinite(mesh.vertices).all()
        assert len(mesh.faces) == 0 or 0 <= mesh.faces.min() <= mesh.faces.max() < len(
            mesh.vertices
        )


@pytest.mark.parametrize("style", WINDOWS)
def test_window_stands_proud_of_its_wall_within_its_place(style):
    element = Element("window", style, 4.0, 0.9, 1.8, 1.3)
    scene = building_scene(house(element))
    meshes = parts(scene, "front/piece-1/window-1")
    assert {"trim", "glass"} <= {mesh.material for mesh in meshes}
    points = np.concatenate([mesh.vertices for mesh in meshes])
    assert points[:, 1].max() <= 1e-9  # the wall is the plane y = 0, outside is y < 0
    assert points[:, 1].min() > -0.8
    glass = np.concatenate([mesh.vertices for mesh in meshes if mesh.material == "glass"])
    assert glass[:, 0].min() > 4.0 - 1e-9
    assert glass[:, 0].max() < 5.8 + 1e-9
    assert glass[:, 2].min() > 0.9 - 1e-9
    assert glass[:, 2].max() < 2.2 + 1e-9
    for mesh in meshes:
        assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
        assert signed_volume(mesh) > 0.0


@pytest.mark.parametrize(
    ("kind", "style"), [("door", "panel"), ("door", "patio"), ("garage-door", "sectional")]
)
def test_doors_have_depth_and_stay_closed(kind, style):
    scene = building_scene(house(Element(kind, style, 3.0, 0.0, 2.4, 2.1, main=True)))
    meshes = parts(scene, f"front/piece-1/{kind}-1")
    assert len(meshes) >= 2
    depths = {round(float(y), 4) for mesh in meshes for y in mesh.vertices[:, 1]}
    assert len(depths) >= 4  # casing, leaf, panels, pane: not one flat colour
    assert all(signed_volume(mesh) > 0.0 for mesh in meshes)


def test_elements_are_numbered_by_kind():
    window = Element("window", "fixed", 1.0, 1.0, 1.0, 1.0)
    door = Element("door", "panel", 3.0, 0.0, 1.0, 2.1)
    scene = building_scene(house(window, door, replace(window, u=6.0)))
    names = {mesh.name for mesh in scene.meshes if "front/" in mesh.name}
    assert {
        "front/piece-1/window-1",
        "front/piece-1/window-2",
        "front/piece-1/door-1",
        "front/piece-1/plinth",
    } == names


@pytest.mark.parametrize(
    ("side", "u", "out"),
    [
        ("front", (1, 0, 0), (0, -1, 0)),
        ("right", (0, 1, 0), (1, 0, 0)),
        ("back", (-1, 0, 0), (0, 1, 0)),
        ("left", (0, -1, 0), (-1, 0, 0)),
    ],
)
def test_frames_run_right_seen_from_outside(side, u, out):
    frame = side_frame(side, (1.0, 2.0, 3.0))
    assert np.array_equal(frame.world(np.array([[1.0, 0.0, 0.0]]))[0], np.add((1, 2, 3), u))
    assert np.array_equal(frame.world(np.array([[0.0, 0.0, 1.0]]))[0], np.add((1, 2, 3), out))
    assert np.linalg.det(frame.axes) == pytest.approx(1.0)


def test_boxes_are_closed_and_none_is_empty():
    vertices, faces = box_triangles([(0, 0, 0, 1, 2, 3), (5, 5, 5, 6, 6, 6)])
    assert trimesh.Trimesh(vertices, faces, process=False).volume == pytest.approx(7.0)
    vertices, faces = box_triangles([])
    assert vertices.shape == (0, 3)
    assert faces.shape == (0, 3)


def test_prism_is_closed_outward():
    vertices, faces = prism(np.array([(0.0, 0.0), (3.0, 0.0), (2.0, 1.0), (1.0, 1.0)]), 0.0, 2.0)
    solid = trimesh.Trimesh(vertices, faces)
    assert solid.is_volume
    assert solid.volume == pytest.approx(4.0)


@pytest.mark.parametrize("style", catalogue.ROOF_STYLES)
@pytest.mark.parametrize("plan", catalogue.PLANS)
def test_slab_covers_the_roof_and_reaches_over_the_walls(plan, style):
    roof = Roof(style, 35.0, "x", 0.5)
    building = catalogue.plan_building(plan, roof)
    solid = building_solid(building)
    top, fascia = roof_slabs(solid, {box.id: 0.5 for box in building.boxes})
    low, high = solid.vertices[:, :2].min(axis=0), solid.vertices[:, :2].max(axis=0)
    reach = np.array(
        [top.vertices[:, :2].min(axis=0) - low, high - top.vertices[:, :2].max(axis=0)]
    )
    # A mansard's steep foot goes out less: it hangs down by half a metre at most.
    assert (reach < (-0.18 if style == "mansard" else -0.3)).all()
    assert (reach > -0.5 * 4.0 - 1e-9).all()
    # Seen from above, the slab covers the whole plan: its area is at least the mass's.
    a, b, c = (top.vertices[top.faces[:, k], :2] for k in range(3))
    p, q = (b - a).T, (c - a).T
    area = 0.5 * np.abs(p[0] * q[1] - p[1] * q[0]).sum()
    assert area >= catalogue_area(building) - 1e-6
    assert len(fascia.faces)
    # The top lies above the solid's roof by the slab's thickness; a shed's upper edge goes on.
    rise = 0.5 * np.tan(np.radians(35.0)) if style == "shed" else 0.0
    top_of_roof = solid.vertices[:, 2].max() + THICKNESS + rise
    assert top.vertices[:, 2].max() == pytest.approx(top_of_roof)


def catalogue_area(building):
    plans = [
        shapely.box(b.x - b.width / 2, b.y - b.depth / 2, b.x + b.width / 2, b.y + b.depth / 2)
        for b in building.boxes
    ]
    return shapely.unary_union(plans).area


def random_house(rng: np.random.Generator) -> Building:
    boxes = []
    for k in range(int(rng.integers(2, 5))):
        place, size = np.round(rng.uniform(-5, 5, 2)), np.round(rng.uniform(3, 11, 2))
        roof = Roof(
            str(rng.choice(("flat", "gable", "hip", "shed"))), float(rng.choice((25.0, 40.0))),
            str(rng.choice(("x", "y"))), 0.5,
        )  # fmt: skip
        height = float(rng.choice((3.0, 3.4, 6.0)))
        boxes.append(Box(f"b{k}", "general", *place.tolist(), *size.tolist(), height, roof))
    return Building("h", tuple(boxes))


def test_no_overhang_runs_into_another_part_of_the_roof():
    rng = np.random.default_rng(5)
    met = 0
    for _ in range(60):
        building = random_house(rng)
        solid = building_solid(building)
        slabs = list(_slabs(solid, {box.id: 0.5 for box in building.boxes}))
        left = trimmed(slabs, THICKNESS)
        shapes = [shapely.union_all([shape_of(rings) for rings in parts]) for parts in left]
        met += sum(len(p) != 1 or p[0] is not s.rings for p, s in zip(left, slabs, strict=True))
        for (a, mine), (b, other) in permutations(zip(slabs, shapes, strict=True), 2):
            assert mine.buffer(1e-4).covers(a.face)
            for x, y in points_in(mine.difference(a.face.buffer(2e-3)).intersection(other), rng):
                rise = np.subtract(b.plane, a.plane) @ (x, y, 1.0)
                # Below another's own roof is inside the mass; between overhangs, one goes on.
                inside = shapely.intersects_xy(b.face.buffer(-2e-3), x, y)
                assert not (inside and rise > 1e-3), building
                assert inside or abs(rise) > 1e-3, building
    assert met > 20


def test_the_eaves_between_a_tower_and_a_wing_stay():
    """Hips whose common border differs in its last digit: GEOS took one for the overlap of both."""
    boxes = (
        Box("main", "general", 5.65, 6.0, 11.3, 12.0, 6.4, Roof("hip", 43.0, "y", 0.35)),
        Box("tower", "general", 0.6, 0.6, 3.0, 3.0, 9.4, Roof("cone", 57.0, "x", 0.2)),
        Box("cross", "general", 11.3, 7.1, 2.0, 4.6, 6.4, Roof("gable", 43.0, "x", 0.35)),
    )
    solid = building_solid(Building("h", boxes))
    slabs = list(_slabs(solid, {"main": 0.35, "tower": 0.2, "cross": 0.35}))
    left = trimmed(slabs, THICKNESS)
    (front,) = [
        rings
        for slab, rings in zip(slabs, left, strict=True)
        if np.allclose(slab.plane, (0.0, np.tan(np.radians(43.0)), 6.4), atol=1e-6)
    ]
    assert min(float(part[0][:, 1].min()) for part in front) == pytest.approx(-0.35)


def test_roofs_that_share_an_area_and_a_line_are_cut():
    """A garage before two wings in one plane: what lies under its roof is an area and a line."""
    boxes = (
        Box("main", "general", 8.15, 2.5095, 16.3, 5.019, 6.0, Roof("gable", 40.0, "x", 0.3)),
        Box("wing", "general", 8.15, 7.7095, 16.3, 5.381, 2.5, Roof("gable", 40.0, "x", 0.3)),
        Box("garage", "garage", 2.394, 3.727, 4.788, 6.4, 2.5, Roof("gable", 40.0, "y", 0.3)),
    )
    scene = building_scene(Building("h", boxes))
    above = 0.0
    for mesh in scene.meshes:
        if mesh.name.startswith("roof") and mesh.material == "roof":
            a, b, c = (mesh.vertices[mesh.faces[:, k], :2] for k in range(3))
            (x, y), (u, v) = (b - a).T, (c - a).T
            above += float(np.maximum(x * v - y * u, 0.0).sum()) / 2
    assert above >= 16.3 * 10.4 - 1e-6  # the plan


def points_in(shape, rng):
    if shape.area < 1e-2:
        return []
    x0, y0, x1, y1 = shape.bounds
    points = rng.uniform((x0, y0), (x1, y1), (30, 2))
    return points[shapely.contains_xy(shape.buffer(-2e-3), *points.T)]


def test_slab_of_a_gable_meets_at_its_ridge_and_follows_its_slope():
    building = house(roof=Roof("gable", 45.0, "x", 0.5))
    top, _ = roof_slabs(building_solid(building), {"main": 0.5})
    z = top.vertices[:, 2] - THICKNESS
    assert z.min() == pytest.approx(3.0 - 0.5)  # 45 degrees: half a metre out is half a metre down
    assert z.max() == pytest.approx(3.0 + 4.0)
    ridge = top.vertices[np.isclose(z, 7.0)]
    assert np.allclose(ridge[:, 1], 4.0)


@pytest.mark.parametrize(
    ("roof", "lowest"),
    [
        (Roof("mansard", 30.0, "x", 0.5), 0.5),
        (Roof("gable", 65.0, "x", 0.4), 0.5),
        (Roof("mansard", 30.0, "x", 1.2), 1.2),
        (Roof("hip", 40.0, "x", 0.7), 0.7 * np.tan(np.radians(40.0))),
    ],
)
def test_eaves_of_steep_roofs_do_not_hang_down_before_the_windows(roof, lowest):
    box = Box("main", "general", 5.0, 4.5, 9.0, 9.0, 6.0, roof)
    building = replace(house(), boxes=(box,), facades={})
    top, _ = roof_slabs(building_solid(building), {"main": roof.overhang})
    assert top.vertices[:, 2].min() - THICKNESS == pytest.approx(6.0 - lowest, abs=0.02)


def test_porch_has_floor_posts_roof_and_none_of_its_posts_stands_in_the_house():
    building = house()
    box = Box("porch", "porch", 5.0, -1.0, 6.0, 2.0, 2.5, Roof("shed", 10.0, "y", 0.2))
    meshes = porch("porch-1", box, replace(building, boxes=(*building.boxes, box)))
    names = {mesh.name for mesh in meshes}
    assert {"porch-1/floor", "porch-1/posts", "porch-1/beam", "porch-1/roof"} == names
    (posts,) = (mesh for mesh in meshes if mesh.name == "porch-1/posts")
    assert posts.vertices[:, 1].max() < -1.0
    (beam,) = (mesh for mesh in meshes if mesh.name == "porch-1/beam")
    assert as_trimesh(beam).is_volume


def test_chimney_is_made_of_closed_parts():
    building = replace(house(), chimneys=(Chimney(2.0, 4.0, 0.8, 0.6, 7.0),))
    meshes = parts(building_scene(building), "chimney-1")
    assert {mesh.material for mesh in meshes} == {"brick", "stone", "clay"}
    assert max(mesh.vertices[:, 2].max() for mesh in meshes) == pytest.approx(7.14)


@given(
    kind=st.sampled_from(["window", "door", "garage-door"]),
    style=st.sampled_from([*WINDOWS, "panel", "patio"]),
    width=st.floats(0.01, 12.0),
    height=st.floats(0.01, 6.0),
)
@settings(max_examples=60, deadline=None)
def test_an_element_of_any_size_is_made_of_outward_closed_parts(kind, style, width, height):
    element = Element(kind, style, 1.0, 0.5, width, height)
    for mesh in building_scene(house(element)).meshes:
        if mesh.name.startswith("front/"):
            assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight
            assert signed_volume(mesh) > 0.0


def test_boards_stand_on_the_outer_corners_only():
    building = catalogue.plan_building("L", Roof("hip", 30.0))
    boards = next(m for m in building_scene(building).meshes if m.name == "corner-boards")
    assert len(boards.vertices) == 5 * 8  # an L has five outer corners and one inner
    assert boards.vertices[:, 2].max() == pytest.approx(6.0)
    outline = shapely.unary_union([shapely.box(*r) for r in catalogue.rectangles("L")])
    far = [outline.exterior.distance(shapely.Point(x, y)) for x, y, _ in boards.vertices]
    assert max(far) < 0.2


@pytest.mark.parametrize(
    ("color", "style", "pattern"),
    [
        ("#b5543f", "gable", "brick"),
        ("#d9d3c3", "gable", "siding"),
        ("#d9d3c3", "flat", ""),
        ("#b5543f", "flat", "brick"),
    ],
)
def test_walls_are_made_of_what_their_colour_and_roof_say(color, style, pattern):
    assert wall_pattern(house(roof=Roof(style, 30.0)), color) == pattern


def test_an_unknown_height_is_sketched_but_not_exported():
    box = Box("main", "general", 0.0, 0.0, 6.0, 6.0)
    building = Building("part", (box,), storey_height=2.5, partial=True)
    assert parts(building_sketch(building), "mass")[0].vertices[:, 2].max() == 2.5
    with pytest.raises(InvalidInput, match="height"):
        building_scene(building)


def test_partial_building_without_facades_and_roof_is_drawn():
    box = Box("main", "general", 0.0, 0.0, 6.0, 6.0, 3.0)
    scene = building_scene(Building("part", (box,), partial=True))
    assert {mesh.name for mesh in scene.meshes} == {"mass", "cladding", "corner-boards", "roof"}


@pytest.mark.parametrize("name", ["victorian", "bungalow"])
def test_pierced_solid_stays_closed_and_loses_the_recesses_volume(name):
    building = BUILDINGS[name] if name in BUILDINGS else next(iter(BUILDINGS.values()))
    solid = building_solid(building)
    openings = openings_of(building)
    cut, closes = pierced(solid, openings)
    held = [opening for opening in closes if opening is not None]
    assert len(closes) == len(cut.faces) == len(cut.labels)
    vertices, triangles, _ = triangulated(cut)
    recessed = trimesh.Trimesh(vertices, triangles, process=False)
    assert recessed.is_volume
    vertices, triangles, _ = triangulated(solid)
    whole = trimesh.Trimesh(vertices, triangles, process=False).volume
    areas = [(o.rectangle[2] - o.rectangle[0]) * (o.rectangle[3] - o.rectangle[1]) for o in held]
    assert whole - recessed.volume <= sum(areas) * 0.12 + 1e-9
    assert not openings or whole > recessed.volume


def test_opening_outside_every_wall_is_left_out_with_a_warning(caplog):
    building = house(Element("window", "fixed", 40.0, 1.0, 1.0, 1.0))
    with caplog.at_level("WARNING", logger="facade_tools.geometry"):
        _, closes = pierced(building_solid(building), openings_of(building))
    assert closes.count(None) == len(closes)
    assert "front/piece-1/window-1" in caplog.text


def test_models_apart_keep_their_place_and_others_go_side_by_side():
    one = np.array([[0.0, 0.0, 0.0], [10.0, 8.0, 3.0]])
    assert not shifts([one, one + np.array([20.0, 0.0, 0.0])]).any()
    assert shifts([one, one + np.array([20.0, 0.0, 0.0])], always=True).any()
    moved = [one + step for step in shifts([one, one, one])]
    for k, a in enumerate(moved):
        for b in moved[:k]:
            assert (np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]))[:2].min() <= 0.0
    assert shifts([]).shape == (0, 3)


def test_a_town_in_which_some_bounds_overlap_stays_where_it_is() -> None:
    one = np.array([[0.0, 0.0, 0.0], [10.0, 8.0, 6.0]])
    terrace = [one + np.array([9.0 * k, 5.0 * k, 0.0]) for k in range(6)]  # askew: bounds meet
    assert not shifts(terrace).any()
    row = [one + np.array([20.0 * k, 0.0, 0.0]) for k in range(6)]
    assert not shifts([*row, one]).any()  # one house twice
    assert shifts([*row, *row]).any()


def test_footprint_scene_is_closed_with_a_slab():
    from facade_tools.artifacts.footprint import Footprint

    ring = ((0.0, 0.0), (9.0, 0.0), (9.0, 4.0), (4.0, 4.0), (4.0, 10.0), (0.0, 10.0))
    scene = footprint_scene(Footprint("f", (ring,), 5.0, Roof("flat")))
    (mass,) = parts(scene, "mass")
    assert as_trimesh(mass).is_volume
    assert signed_volume(mass) == pytest.approx(5.0 * 60.0)
    assert np.allclose(bounds(scene)[0], (0.0, 0.0, 0.0))
