"""Solids: closed, outward, of positive volume, for every building."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from pathlib import Path

import catalogue
import numpy as np
import pytest
import shapely
import trimesh

from facade_tools.artifacts.building import Box, Building, Roof
from facade_tools.artifacts.footprint import Footprint
from facade_tools.artifacts.store import read
from facade_tools.errors import InvalidInput
from facade_tools.geometry.polygons import oriented, shape_of, signed_area, sound
from facade_tools.geometry.roofs import union_patches
from facade_tools.geometry.solids import Label, Solid, building_solid, footprint_solid, triangulated
from facade_tools.geometry.solids_merge import Piece, merged
from facade_tools.geometry.triangulate import triangulate_rings
from facade_tools.geometry.triangulate_ears import _bridge, _joined, clipped_ears

HOUSES = Path(__file__).resolve().parent.parent / "sample_data" / "houses"
BUILDINGS = catalogue.buildings()


def as_mesh(solid: Solid) -> trimesh.Trimesh:
    vertices, triangles, _ = triangulated(solid)
    return trimesh.Trimesh(vertices, triangles, process=False)


def random_building(rng: np.random.Generator) -> Building:
    boxes = []
    for k in range(int(rng.integers(1, 6))):
        place, size = rng.uniform(-5, 5, 2), rng.uniform(3, 11, 2)
        if rng.random() < 0.6:
            place, size = np.round(place), np.round(size)
        style = str(rng.choice(catalogue.ROOF_STYLES))
        pitch = float(rng.choice([20.0, 35.0, 45.0, rng.uniform(1, 70)]))
        roof = Roof(style, pitch, str(rng.choice(["x", "y"])))  # type: ignore[arg-type]
        height = float(rng.choice([3.0, 6.0, rng.uniform(2, 9)]))
        boxes.append(Box(f"b{k}", "general", *place.tolist(), *size.tolist(), height, roof))
    return Building("random", tuple(boxes))


@pytest.mark.parametrize("name", BUILDINGS)
def test_building_is_a_volume(name: str) -> None:
    mesh = as_mesh(building_solid(BUILDINGS[name]))
    assert mesh.is_volume
    assert mesh.volume > 0


def test_random_buildings_are_volumes() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        building = random_building(rng)
        mesh = as_mesh(building_solid(building))
        assert mesh.is_volume, building
        assert mesh.volume > 0, building


def closed_and_outward(vertices: np.ndarray, triangles: np.ndarray) -> bool:
    """What trimesh's is_volume asks, of one mesh, in a fraction of the time."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forth = sides[:, 0] * len(vertices) + sides[:, 1]
    back = sides[:, 1] * len(vertices) + sides[:, 0]
    once = len(np.unique(forth)) == len(forth)
    return once and np.array_equal(np.sort(forth), np.sort(back))


def volume_of(vertices: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def test_thousands_of_flat_unions_have_the_volume_that_shapely_says() -> None:
    """Volume = sum over storeys between two eaves of the area of the boxes that reach them."""
    rng = np.random.default_rng(7)
    for _ in range(1000):
        count = int(rng.integers(1, 6))
        corners, sizes = rng.uniform(-5, 5, (count, 2)), rng.uniform(3, 11, (count, 2))
        heights = rng.choice([3.0, 6.0, rng.uniform(2, 9)], count)
        if rng.random() < 0.6:
            corners, sizes = np.round(corners), np.round(sizes)
        boxes = tuple(
            Box(f"b{k}", "general", *(corners[k] + sizes[k] / 2), *sizes[k], heights[k])
            for k in range(count)
        )
        vertices, triangles, _ = triangulated(building_solid(Building("flat", boxes)))
        assert closed_and_outward(vertices, triangles), boxes
        plans = shapely.box(*corners.T, *(corners + sizes).T)
        levels = np.unique([0.0, *heights])
        expected = sum(
            (high - low) * shapely.union_all(plans[heights >= high]).area
            for low, high in pairwise(levels)
        )
        assert volume_of(vertices, triangles) == pytest.approx(expected, rel=1e-5), boxes


def test_hundreds_of_roofs_are_the_highest_plane_over_every_point() -> None:
    rng = np.random.default_rng(8)
    for _ in range(300):
        building = random_building(rng)
        solid = building_solid(building)
        vertices, triangles, faces = triangulated(solid)
        assert closed_and_outward(vertices, triangles), building
        roofs = triangles[[solid.labels[face].semantic == "roof" for face in faces]]
        corners = vertices[roofs]
        (ax, ay), (bx, by) = (corners[:, k, :2].T - corners[:, 0, :2].T for k in (1, 2))
        plan = np.abs(ax * by - ay * bx)
        middle = corners[int(np.argmax(plan))].mean(axis=0)
        patches = union_patches(building.boxes)
        over = [p for p in patches if shapely.intersects_xy(shape_of(p.rings), *middle[:2])]
        heights = [p.plane[0] * middle[0] + p.plane[1] * middle[1] + p.plane[2] for p in over]
        assert max(heights) == pytest.approx(middle[2], abs=1e-4), building
        half = np.array([(box.width / 2, box.depth / 2) for box in building.boxes])
        middles = np.array([(box.x, box.y) for box in building.boxes])
        union = shapely.union_all(shapely.box(*(middles - half).T, *(middles + half).T))
        assert plan.sum() / 2 == pytest.approx(union.area, rel=1e-5)


@pytest.mark.parametrize("kind", catalogue.POLYGON_KINDS)
def test_hundreds_of_flat_footprints_have_the_area_that_shapely_says(kind: str) -> None:
    rng = np.random.default_rng(9)
    for _ in range(250):
        rings = catalogue.random_polygon(rng, kind)
        plan = shapely.Polygon(rings[0], rings[1:])
        footprint = Footprint("f", tuple(tuple(map(tuple, ring)) for ring in rings), 4.0)
        vertices, triangles, _ = triangulated(footprint_solid(footprint))
        assert closed_and_outward(vertices, triangles)
        # Corners that touch are drawn apart by 0.1 mm, so that every reader sees a manifold.
        assert volume_of(vertices, triangles) == pytest.approx(4.0 * plan.area, rel=3e-5)


@pytest.mark.parametrize("style", catalogue.ROOF_STYLES)
@pytest.mark.parametrize("kind", catalogue.POLYGON_KINDS)
def test_roofs_on_random_plans_close(kind: str, style: str) -> None:
    rng = np.random.default_rng(10)
    for direction in ("x", "y") * 6:
        rings = catalogue.random_polygon(rng, kind)
        roof = catalogue.roofed(style, float(rng.choice((10, 35, 60))), direction)
        footprint = Footprint("f", tuple(tuple(map(tuple, ring)) for ring in rings), 4.0, roof)
        vertices, triangles, _ = triangulated(footprint_solid(footprint))
        assert closed_and_outward(vertices, triangles)
        assert volume_of(vertices, triangles) > 0


@pytest.mark.parametrize("style", catalogue.ROOF_STYLES)
@pytest.mark.parametrize("jog", [1e-3, 1e-5, 2e-6, 1e-6])
def test_walls_that_jog_by_micrometres_leave_no_hole(style: str, jog: float) -> None:
    """Seen flat, two corners of a steep sliver fall together; they are two nevertheless."""
    ring = [(0, 10), (7.32, 10), (7.32, 10 - jog), (7.6044, 10 - jog), (7.6044, 10), (20, 10)]
    turn = np.radians(8.33)
    spun = np.array([*ring, (20, 0), (0, 0)]) @ np.array(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    )
    for corners in (np.array([*ring, (20, 0), (0, 0)]), spun):
        outline = tuple(map(tuple, corners.tolist()))
        footprint = Footprint("f", (outline,), 6.0, catalogue.roofed(style, 60.0))
        vertices, triangles, _ = triangulated(footprint_solid(footprint))
        assert closed_and_outward(vertices, triangles)


@pytest.mark.parametrize(("corners", "radius"), [(9, 12.0), (37, 8.0), (46, 10.0)])
def test_mansard_round_a_court_whose_skeleton_crosses_itself_by_rounding(
    corners: int, radius: float
) -> None:
    angles = 2 * np.pi * np.arange(corners) / corners
    outer = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    rings = tuple(tuple(map(tuple, ring.tolist())) for ring in (outer, 0.4 * outer))
    footprint = Footprint("f", rings, 6.0, Roof("mansard", 30.0))
    vertices, triangles, _ = triangulated(footprint_solid(footprint))
    assert closed_and_outward(vertices, triangles)
    assert volume_of(vertices, triangles) > 6.5 * shapely.Polygon(*rings[:1], rings[1:]).area


def test_outline_with_a_crossing_and_a_spike_keeps_its_area() -> None:
    """Its repair is a collection that holds a collection of polygons and a line."""
    bow = [(0, 0), (10, 0), (10, 8), (12, 8), (10, 8), (10, 9), (5, 9), (5, 14), (6, 14), (0, 4)]
    shape = shapely.make_valid(shapely.Polygon(bow))
    assert {part.geom_type for part in shapely.get_parts(shape)} == {"MultiPolygon", "LineString"}
    assert sum(map(signed_area, (rings[0] for rings in sound([bow])))) == pytest.approx(shape.area)


def test_slivers_and_pinched_loops_leave_no_hole() -> None:
    """A piece without width is a face of its own; a loop that comes back to a vertex is cut."""
    vertices = np.array(
        [
            *[(0, 0, 1), (4, 0, 1), (4, 4, 1), (0, 4, 1)],
            *[(6, 1, 1), (6.001, 1, 1), (6.0005, 0.9999, 1)],  # clockwise, without area
        ],
        dtype=np.float64,
    )
    pieces = [
        Piece([[0, 1, 2, 3]], ("roof",), Label("roof")),
        Piece([[4, 5, 6]], ("roof",), Label("roof")),
    ]
    solid = merged(vertices, pieces)
    assert sorted(len(face[0]) for face in solid.faces) == [3, 4]
    bow = np.array([(0, 0, 1), (4, 0, 1), (2, 2, 1), (4, 4, 1), (0, 4, 1)], dtype=np.float64)
    parts = [Piece([[0, 1, 2]], ("r",), Label("roof")), Piece([[2, 3, 4]], ("r",), Label("roof"))]
    assert sorted(len(face[0]) for face in merged(bow, parts).faces) == [3, 3]


def test_every_sample_house_is_a_volume() -> None:
    for path in sorted(HOUSES.glob("*.jsonl")):
        for number, building in enumerate(read([str(path)], "building")):
            solid = building_solid(building)
            vertices, triangles, _ = triangulated(solid)
            assert closed_and_outward(vertices, triangles), building.id
            assert volume_of(vertices, triangles) > 0, building.id
            if number % 8 == 0:
                assert as_mesh(solid).is_volume, building.id


def test_single_flat_box_is_six_faces() -> None:
    solid = building_solid(Building("b", (catalogue.box("b", (0, 0, 4, 3), 5),)))
    assert solid.vertices.shape == (8, 3)
    assert sorted(label.semantic for label in solid.labels) == ["ground", "roof"] + ["wall"] * 4
    assert as_mesh(solid).volume == pytest.approx(60)


def test_gable_is_seven_faces() -> None:
    roof = catalogue.roofed("gable", 45, "x")
    solid = building_solid(Building("b", (catalogue.box("b", (0, 0, 10, 6), 3, roof=roof),)))
    assert len(solid.faces) == 7
    assert as_mesh(solid).volume == pytest.approx(10 * 6 * 3 + 0.5 * 6 * 3 * 10)


def test_no_box_is_invalid() -> None:
    porch = catalogue.box("p", (0, 0, 4, 3), 3, kind="porch")
    with pytest.raises(InvalidInput, match="no general or garage box"):
        building_solid(Building("b", (porch,)))


@pytest.mark.parametrize("kind", catalogue.POLYGON_KINDS)
def test_triangles_cover_the_polygon_and_pair(kind: str) -> None:
    rng = np.random.default_rng(1)
    for _ in range(300):
        rings = [np.array(ring) for ring in catalogue.random_polygon(rng, kind)]
        check_triangles(rings, triangulate_rings(rings))
        order = oriented(rings)
        ends = np.cumsum([len(ring) for ring in rings])
        check_triangles(order, clipped_ears(np.concatenate(order), ends))


def joined_by_trying_all(points: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """The ring of `_joined`: every hole's shortest bridge is sought again after every hole."""
    ring = np.arange(ends[0])
    holes = list(range(1, len(ends)))
    while holes:
        bridges = [_bridge(points, ring, hole, starts, ends) for hole in holes]
        best = int(np.argmin([length for length, _, _ in bridges]))
        _, i, j = bridges[best]
        hole = np.roll(np.arange(starts[holes[best]], ends[holes[best]]), -j)
        holes.pop(best)
        ring = np.concatenate([ring[: i + 1], hole, hole[:1], ring[i:]])
    return ring


@pytest.mark.parametrize("seed", range(6))
def test_holes_are_joined_by_the_bridges_that_trying_all_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    columns, rows = rng.integers(2, 6, 2)
    rings = [np.array([[0, 0], [3 * columns, 0], [3 * columns, 3 * rows], [0, 3 * rows]], float)]
    for x, y in np.ndindex(columns, rows):
        hole = np.array([[1, 1], [1, 2], [2, 2], [2, 1]]) + np.array([3 * x, 3 * y])
        rings.append(hole + (seed % 3) * 0.25 * rng.uniform(-1, 1, hole.shape))
    points = np.concatenate(rings)
    ends = np.cumsum([len(ring) for ring in rings])
    starts = np.concatenate([[0], ends[:-1]])
    ring = _joined(points, starts, ends)
    assert (ring == joined_by_trying_all(points, starts, ends)).all()
    check_triangles(rings, clipped_ears(points, ends))


def check_triangles(rings: list[np.ndarray], triangles: np.ndarray) -> None:
    points = np.concatenate(rings)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    areas = ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2
    assert areas.sum() == pytest.approx(shapely.Polygon(rings[0], rings[1:]).area)
    assert areas.min() >= -1e-9
    sides = Counter((t[k - 1], t[k]) for t in triangles.tolist() for k in range(3))
    assert max(sides.values()) == 1
    assert sum(side[::-1] not in sides for side in sides) == len(points)


def test_points_in_one_line_are_kept() -> None:
    ring = np.array([[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [0, 1], [0, 0.5]], dtype=np.float64)
    assert len(triangulate_rings([ring])) == 5


def test_hole_that_touches_the_outline_is_closed() -> None:
    rings = (((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)), ((0.0, 4.0), (3.0, 3.0), (3.0, 5.0)))
    for style in catalogue.ROOF_STYLES:
        footprint = Footprint("f", rings, 5.0, catalogue.roofed(style))
        assert as_mesh(footprint_solid(footprint)).is_volume, style
