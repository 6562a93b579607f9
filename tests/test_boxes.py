"""Unions of boxes and their outlines, against shapely on random cases."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import box as polygon_of
from shapely.ops import unary_union

from facade_tools.artifacts.building import Box, Building
from facade_tools.geometry.boxes import (
    area_perimeter,
    box_rectangles,
    rounded,
    shared_outline,
    union_area_perimeter,
)
from facade_tools.geometry.floors import floor_boxes, floor_rectangles, storeys


def random_rectangles(rng, most=8):
    """Half of the cases stand on a coarse lattice, so that edges and corners coincide."""
    n = int(rng.integers(1, most))
    if rng.random() < 0.5:
        low = rng.integers(0, 6, (n, 2))
        return np.hstack([low, low + rng.integers(1, 4, (n, 2))]).astype(float)
    low = rng.uniform(-8, 8, (n, 2))
    return np.hstack([low, low + rng.uniform(0.2, 9, (n, 2))])


@pytest.fixture
def cases():
    rng = np.random.default_rng(11)
    return [random_rectangles(rng) for _ in range(2500)]


def test_area_and_perimeter_equal_shapely(cases):
    for rectangles in cases:
        union = unary_union([polygon_of(*r) for r in rounded(rectangles)])
        area, perimeter = union_area_perimeter(rectangles)
        assert area == pytest.approx(union.area, abs=1e-9)
        assert perimeter == pytest.approx(union.length, abs=1e-9)


def test_shared_outline_equals_shapely(cases):
    for rectangles in cases:
        edges = rounded(rectangles)
        union = unary_union([polygon_of(*r) for r in edges])
        expected = polygon_of(*edges[-1]).exterior.intersection(union.boundary).length
        assert shared_outline(edges[-1], edges) == pytest.approx(expected, abs=1e-9)


def test_kernels_equal_their_plain_versions(cases):
    for rectangles in cases[:3]:
        edges = rounded(rectangles)
        assert area_perimeter(edges) == pytest.approx(area_perimeter.py_func(edges), abs=1e-12)


def test_edges_equal_after_rounding_are_shared():
    area, perimeter = union_area_perimeter(np.array([[0, 0, 1, 1], [1 + 4e-7, 0, 2, 1.0]]))
    assert (area, perimeter) == pytest.approx((2, 6), abs=1e-12)
    assert union_area_perimeter(np.array([[0, 0, 1, 1], [1.00001, 0, 2, 1]]))[1] > 7.9


def test_nothing_has_no_area():
    assert union_area_perimeter(np.empty((0, 4))) == (0, 0)


def test_courtyards_have_a_perimeter_of_their_own():
    walls = np.array([[0, 0, 6, 1], [0, 5, 6, 6], [0, 0, 1, 6], [5, 0, 6, 6.0]])
    assert union_area_perimeter(walls) == (20, 40)


def test_floors_follow_the_half_storey_rule():
    boxes = tuple(
        Box(name, kind, 0, 0, 4, 4, height)
        for name, kind, height in (
            ("a", "general", 4.5),
            ("b", "general", 4.6),
            ("c", "garage", 1.6),
            ("d", "porch", 9.0),
        )
    )
    building = Building("h", boxes)
    assert [[b.id for b in floor_boxes(building, i)] for i in range(3)] == [
        ["a", "b", "c"],
        ["b"],
        [],
    ]
    assert floor_rectangles(building, 2).shape == (0, 4)
    assert box_rectangles([]).shape == (0, 4)
    assert [storeys(h, 2.7) for h in (1.35, 1.36, 4.05, 4.06)] == [0, 1, 1, 2]
