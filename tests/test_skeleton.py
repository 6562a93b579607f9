"""Straight skeletons: faces tile the polygon, nodes lie on the planes of their faces."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import catalogue
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from facade_tools.errors import InvalidInput
from facade_tools.geometry.polygons import Rings, oriented, sound
from facade_tools.geometry.skeleton import (
    Contour,
    Skeleton,
    SkeletonFailed,
    skeleton_by,
    straight_skeleton,
)

POLYGONS = catalogue.polygons()
EVERY_PATH = range(10)


def check(rings: Rings, skeleton: Skeleton, speeds: np.ndarray | None = None) -> None:
    """All that a skeleton of speed 1 promises, by other means than its own verification."""
    contour = Contour.of(rings, speeds)
    area = shapely.Polygon(rings[0], rings[1:]).area
    assert len(skeleton.faces) == len(contour.points)
    shapes = [shapely.Polygon(skeleton.points[face]) for face in skeleton.faces]
    assert all(shape.is_valid or shape.area < 1e-9 * area for shape in shapes)
    assert sum(shape.area for shape in shapes) == pytest.approx(area, rel=1e-6)
    assert shapely.union_all(shapes, grid_size=1e-9).area == pytest.approx(area, rel=1e-6)
    assert skeleton.times.min() >= 0
    for k, face in enumerate(skeleton.faces):
        start, end = contour.points[k], contour.points[contour.following[k]]
        assert np.allclose(skeleton.points[face[:2]], [start, end], atol=1e-8)
        along = (end - start) / np.hypot(*(end - start))
        away = (skeleton.points[face] - start) @ np.array([-along[1], along[0]])
        assert np.abs(away - skeleton.times[face]).max() <= 1e-6
    sides = Counter((f[k - 1], f[k]) for f in skeleton.faces for k in range(len(f)))
    assert max(sides.values()) == 1
    open_sides = {side for side in sides if side[::-1] not in sides}
    assert len(open_sides) == len(contour.points)


@pytest.mark.parametrize("name", POLYGONS)
def test_canonical_polygon(name: str) -> None:
    rings = oriented(POLYGONS[name])
    check(rings, straight_skeleton(rings))


@pytest.mark.parametrize("kind", catalogue.POLYGON_KINDS)
def test_random_polygons(kind: str) -> None:
    rng = np.random.default_rng(7)
    for k in range(500):
        rings = oriented(catalogue.random_polygon(rng, kind))
        skeleton = straight_skeleton(rings)
        if k % 10 == 0:  # the checks take longer than the skeleton, which verifies itself
            check(rings, skeleton)


def test_real_footprints(shared_data: Path) -> None:
    footprints = catalogue.real_footprints(shared_data)
    assert len(footprints) > 300
    for k, polygon in enumerate(footprints.values()):
        for rings in sound(polygon):
            skeleton = straight_skeleton(rings)
            if k % 5 == 0:
                check(rings, skeleton)


@pytest.mark.parametrize("path", EVERY_PATH)
def test_every_path_finds_the_same_roof(path: int) -> None:
    rng = np.random.default_rng(3)
    for kind in catalogue.POLYGON_KINDS:
        for _ in range(5):
            contour = Contour.of(oriented(catalogue.random_polygon(rng, kind)))
            skeleton, problem = skeleton_by(contour, path)
            first, _ = skeleton_by(contour, 0)
            assert problem == ""
            assert skeleton is not None
            assert first is not None
            assert skeleton.times.max() == pytest.approx(first.times.max(), abs=1e-5)


def test_highest_point_of_a_hip_is_half_the_width() -> None:
    skeleton = straight_skeleton(oriented(POLYGONS["rectangle"]))
    assert skeleton.times.max() == pytest.approx(3.0)
    assert [len(face) for face in skeleton.faces] == [4, 3, 4, 3]


def test_rectilinear_roof_is_the_chebyshev_distance() -> None:
    rng = np.random.default_rng(11)
    for _ in range(30):
        polygon = catalogue.random_polygon(rng, "boxes")
        rings = oriented(polygon)
        skeleton = straight_skeleton(rings)
        inside = skeleton.points[len(Contour.of(rings).points) :]
        times = skeleton.times[len(Contour.of(rings).points) :]
        border = [
            (a, b) for ring in rings for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True)
        ]
        for point, time in zip(inside, times, strict=True):
            gaps = [
                np.maximum(np.minimum(a, b) - point, point - np.maximum(a, b)) for a, b in border
            ]
            nearest = min(float(np.maximum(gap, 0).max()) for gap in gaps)
            assert time == pytest.approx(nearest, abs=1e-6)


def test_speed_zero_leaves_a_gable() -> None:
    rings = oriented(POLYGONS["rectangle"])
    skeleton = straight_skeleton(rings, [1, 0, 1, 0])
    assert skeleton.times.max() == pytest.approx(3.0)
    upright = skeleton.points[skeleton.faces[1]]
    assert np.allclose(upright[:, 0], 10.0)
    ridge = skeleton.points[skeleton.times > 2.9]
    assert sorted(ridge[:, 0].tolist()) == pytest.approx([0, 10])


def test_faster_edge_takes_more() -> None:
    rings = oriented(POLYGONS["square"])
    skeleton = straight_skeleton(rings, [3, 1, 3, 1])
    areas = [shapely.Polygon(skeleton.points[face]).area for face in skeleton.faces]
    assert areas[0] == pytest.approx(areas[2])
    assert areas[0] > 2 * areas[1]


@pytest.mark.parametrize("kind", ["boxes", "star", "blobs"])
def test_random_weights_pass_or_say_so(kind: str) -> None:
    rng = np.random.default_rng(2)
    failed = 0
    for _ in range(60):
        rings = oriented(catalogue.random_polygon(rng, kind))
        speeds = rng.uniform(0.7, 1.4, sum(len(ring) for ring in rings))
        try:
            straight_skeleton(rings, speeds)
        except SkeletonFailed:
            failed += 1
    assert failed <= 2


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=3, max_size=14))
def test_any_ring_on_a_coarse_grid(points: list[tuple[int, int]]) -> None:
    for rings in sound([[(float(x), float(y)) for x, y in points]]):
        check(rings, straight_skeleton(rings))


def test_moving_turning_and_scaling_change_nothing() -> None:
    rings = oriented(POLYGONS["two-holes"])
    base = straight_skeleton(rings).times.max()
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    for scale, shift in ((1.0, 0.0), (1000.0, 0.0), (0.01, 5.0), (1.0, 5.6e6)):
        moved = [ring @ turn * scale + shift for ring in rings]
        found = straight_skeleton(moved).times.max()
        assert found == pytest.approx(base * scale, rel=1e-6)


@pytest.mark.parametrize(
    ("rings", "speeds", "message"),
    [
        ([[(0, 0), (1, 0)]], None, "three points"),
        ([[(0, 0), (0, 1), (1, 0)]], None, "counter-clockwise"),
        ([[(0, 0), (1, 0), (1, 0), (0, 1)]], None, "same point twice"),
        ([[(0, 0), (1, 0), (0, 1)]], [1, 1], "one speed an edge"),
        ([[(0, 0), (1, 0), (0, 1)]], [0, 0, 0], "not all zero"),
    ],
)
def test_bad_input(rings: list, speeds: list | None, message: str) -> None:
    arrays = [np.array(ring, dtype=np.float64) for ring in rings]
    with pytest.raises(InvalidInput, match=message):
        straight_skeleton(arrays, speeds)


def test_roof_that_never_closes_fails() -> None:
    rings = oriented(POLYGONS["U"])
    with pytest.raises(SkeletonFailed):
        straight_skeleton(rings, [0, 0, 0, 1, 0, 0, 0, 0])


def test_fast_edge_sweeps_around_a_slow_hole() -> None:
    rings = oriented([[(0, 0), (40, 0), (40, 30), (0, 30)], [(10, 3), (11, 3), (11, 4), (10, 4)]])
    speeds = [5, 0.2, 0.2, 0.2] + [0.05] * 4
    skeleton = straight_skeleton(rings, speeds)
    assert [edge for edge, _ in skeleton.holes] == [0]
    outer, *holes = skeleton.polygon(0)
    shapes = [shapely.Polygon(outer, holes)]
    shapes += [shapely.Polygon(skeleton.points[face]) for face in skeleton.faces[1:]]
    assert sum(shape.area for shape in shapes) == pytest.approx(40 * 30 - 1, rel=1e-6)
    assert shapely.union_all(shapes, grid_size=1e-9).area == pytest.approx(1199, rel=1e-6)


@pytest.mark.parametrize("noise", [1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-12])
def test_nearly_parallel_and_nearly_simultaneous(noise: float) -> None:
    rng = np.random.default_rng(13)
    for k in range(40):
        turn = rng.uniform(0, 2 * np.pi)
        frame = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        rings = oriented(catalogue.random_polygon(rng, ("cells", "boxes")[k % 2]))
        rings = [(ring + rng.normal(0, noise, ring.shape)) @ frame for ring in rings]
        if shapely.Polygon(rings[0], rings[1:]).is_valid:
            straight_skeleton(rings)


def test_thousand_corners() -> None:
    turn = np.arange(1000) * (2 * np.pi / 1000)
    radii = np.random.default_rng(0).uniform(80, 100, 1000)
    ring = np.column_stack([radii * np.cos(turn), radii * np.sin(turn)])
    assert len(straight_skeleton([ring]).faces) == 1000


def test_too_many_edges_are_refused() -> None:
    turn = np.arange(7000) * (2 * np.pi / 7000)
    with pytest.raises(SkeletonFailed, match="at most"):
        straight_skeleton([np.column_stack([np.cos(turn), np.sin(turn)])])
