"""Facade pieces: worked examples, and invariants against shapely on random buildings."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from shapely import box as polygon_of
from shapely.ops import unary_union

from facade_tools.artifacts.building import SIDES, Box, Building
from facade_tools.geometry.boxes import rounded
from facade_tools.geometry.pieces import facade_pieces

NORMALS = {"front": (0, -1), "back": (0, 1), "left": (-1, 0), "right": (1, 0)}
RIGHTS = {"front": (1, 0), "back": (-1, 0), "left": (0, -1), "right": (0, 1)}


def building_of(*rows, storey=3.0):
    """Rows are x0, y0, x1, y1, height and optionally kind."""
    boxes = tuple(
        Box(
            f"b{i}",
            row[5] if len(row) > 5 else "general",
            (row[0] + row[2]) / 2,
            (row[1] + row[3]) / 2,
            row[2] - row[0],
            row[3] - row[1],
            row[4],
        )
        for i, row in enumerate(rows)
    )
    return Building("house", boxes, storey_height=storey)


def spans(building, side):
    return [(p.origin, p.width, p.height, p.box) for p in facade_pieces(building)[side]]


def test_one_box_has_a_piece_a_storey_and_side():
    house = building_of((0, 0, 10, 8, 5.5))
    assert spans(house, "front") == [((0, 0, 0), 10, 3, "b0"), ((0, 0, 3), 10, 2.5, "b0")]
    assert spans(house, "back")[0] == ((10, 8, 0), 10, 3, "b0")
    assert spans(house, "left")[0] == ((0, 8, 0), 8, 3, "b0")
    assert spans(house, "right")[0] == ((10, 0, 0), 8, 3, "b0")
    assert [p.id for p in facade_pieces(house)["left"]] == ["left-1", "left-2"]


def test_top_storey_runs_to_the_eaves():
    assert [s[2] for s in spans(building_of((0, 0, 4, 4, 4.5)), "front")] == [4.5]
    assert [s[2] for s in spans(building_of((0, 0, 4, 4, 6.5)), "front")] == [3, 3.5]
    assert [s[2] for s in spans(building_of((0, 0, 4, 4, 1.2)), "front")] == [1.2]


def test_wall_above_a_lower_neighbour_counts_where_it_is_exposed():
    house = building_of((0, 0, 10, 8, 6), (10, 0, 14, 6, 3.4, "garage"))
    assert spans(house, "right") == [
        ((14, 0, 0), 6, 3.4, "b1"),
        ((10, 6, 0), 2, 3, "b0"),
        ((10, 6, 3), 2, 3, "b0"),
        ((10, 0, 3.4), 6, 2.6, "b0"),
    ]
    assert spans(house, "front") == [
        ((0, 0, 0), 10, 3, "b0"),
        ((10, 0, 0), 4, 3.4, "b1"),
        ((0, 0, 3), 10, 3, "b0"),
    ]


def test_courtyard_walls_belong_to_the_side_of_their_normal():
    house = building_of((0, 0, 9, 3, 3), (0, 6, 9, 9, 3), (0, 0, 3, 9, 3), (6, 0, 9, 9, 3))
    front = spans(house, "front")
    assert [(s[0], s[1]) for s in front] == [((0, 0, 0), 9), ((3, 6, 0), 3)]


def test_porches_count_for_nothing():
    plain = building_of((0, 0, 9, 6, 3))
    porch = building_of((0, 0, 9, 6, 3), (2, -2, 5, 0, 2.5, "porch"))
    assert facade_pieces(plain) == facade_pieces(porch)


def random_building(rng):
    rows = []
    for _ in range(int(rng.integers(1, 6))):
        x, y = rng.integers(0, 7, 2) if rng.random() < 0.7 else rng.uniform(0, 7, 2)
        w, d = rng.integers(1, 6, 2) if rng.random() < 0.7 else rng.uniform(0.5, 6, 2)
        height = float(rng.choice([2.4, 3.0, 3.2, 5.8, 6.0, 6.0, 8.9, 12.5]))
        rows.append((float(x), float(y), float(x + w), float(y + d), height))
    return building_of(*rows, storey=float(rng.choice([2.7, 3.0])))


def union_at(building, height):
    cut = [b for b in building.boxes if b.height > height]
    edges = [
        (b.x - b.width / 2, b.y - b.depth / 2, b.x + b.width / 2, b.y + b.depth / 2) for b in cut
    ]
    return unary_union([polygon_of(*e) for e in rounded(np.array(edges).reshape(-1, 4))])


@pytest.fixture
def cases():
    rng = np.random.default_rng(5)
    return [random_building(rng) for _ in range(800)]


def test_wall_area_equals_the_slices(cases):
    """The area of all pieces is the perimeter of the slice, integrated over the height."""
    for house in cases:
        levels = sorted({0.0, *(b.height for b in house.boxes)})
        expected = sum((b - a) * union_at(house, (a + b) / 2).length for a, b in pairwise(levels))
        area = sum(p.width * p.height for side in facade_pieces(house).values() for p in side)
        assert area == pytest.approx(expected, abs=1e-5)


def test_pieces_lie_on_walls_and_are_maximal(cases):
    for house in cases:
        for side, pieces in facade_pieces(house).items():
            normal, right = np.array(NORMALS[side]), np.array(RIGHTS[side])
            faces = set()
            for p in pieces:
                for u, v in ((0.01, 0.01), (0.99, 0.99), (0.5, 0.3)):
                    at = np.array(p.origin[:2]) + right * u * p.width
                    slice_ = union_at(house, p.origin[2] + v * p.height)
                    inside, outside = at - 1e-4 * normal, at + 1e-4 * normal
                    assert slice_.contains(polygon_of(*inside, *(inside + 1e-9)))
                    assert not slice_.contains(polygon_of(*outside, *(outside + 1e-9)))
                start = np.dot(p.origin[:2], right)
                key = (np.dot(p.origin[:2], normal), p.origin[2], p.height)
                faces.add((*key, round(start, 5), "start"))
                faces.add((*key, round(start + p.width, 5), "stop"))
            for *key, at, kind in faces:  # no piece continues an equal one
                other = "start" if kind == "stop" else "stop"
                assert (*key, at, other) not in faces


def test_no_piece_crosses_a_storey_line_below_the_top(cases):
    for house in cases:
        s = house.storey_height
        for side in SIDES:
            for p in facade_pieces(house)[side]:
                low, high = p.origin[2], p.origin[2] + p.height
                owner = next(b for b in house.boxes if b.id == p.box)
                crossed = [i for i in range(1, 6) if low + 1e-6 < i * s < high - 1e-6]
                assert high <= owner.height + 1e-6
                assert not crossed or (high == pytest.approx(owner.height) and len(crossed) == 1)
