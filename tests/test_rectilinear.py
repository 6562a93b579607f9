"""Polygons become rectangles: main direction, cover, residual."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.geometry.polygons_cover import cover, maximal_rectangles
from facade_tools.geometry.rectilinear import (
    main_direction,
    partition,
    residual,
    rotated,
    valid_polygon,
)

L_PLAN = shapely.Polygon([(0, 0), (10, 0), (10, 4), (6, 4), (6, 9), (0, 9)])


@pytest.mark.parametrize("turn", [-44.0, -30.0, 0.0, 12.5, 44.9])
def test_the_main_direction_of_a_turned_plan_is_its_turn(turn: float) -> None:
    assert main_direction(rotated(L_PLAN, turn)) == pytest.approx(turn, abs=1e-9)


def test_an_l_plan_is_two_overlapping_rectangles() -> None:
    found = partition([L_PLAN])
    assert len(found.rectangles[0]) == 2
    assert found.residual == pytest.approx(0.0, abs=1e-12)


def test_a_courtyard_stays_open() -> None:
    plan = shapely.Polygon([(0, 0), (12, 0), (12, 9), (0, 9)], [[(3, 3), (9, 3), (9, 6), (3, 6)]])
    found = partition([plan])
    assert len(found.rectangles[0]) == 4
    assert found.residual == pytest.approx(0.0, abs=1e-12)


def test_neighbours_share_the_lines_between_them() -> None:
    a = shapely.box(0, 0, 6, 8)
    b = shapely.box(6.05, 1, 11, 5)  # measured 5 cm apart
    first, second = partition([a, b]).rectangles
    assert first[0, 2] == second[0, 0]


def test_nothing_gives_nothing() -> None:
    assert partition([]).rectangles == ()
    assert partition([shapely.Polygon()]).rectangles[0].shape == (0, 4)


def test_a_bow_tie_is_repaired() -> None:
    bow = valid_polygon([np.array([(0, 0), (4, 4), (4, 0), (0, 4.0)])])
    assert bow.is_valid
    assert bow.area == pytest.approx(8.0)
    assert valid_polygon([np.zeros((2, 2))]).is_empty


@given(st.lists(st.booleans(), min_size=30, max_size=30))
@settings(max_examples=200, deadline=None)
def test_the_cover_is_the_cells(cells: list[bool]) -> None:
    inside = np.array(cells).reshape(6, 5)
    lines = np.arange(7.0), np.arange(6.0)
    again = np.zeros_like(inside)
    for x0, y0, x1, y1 in cover(inside, *lines).astype(int).tolist():
        assert inside[x0:x1, y0:y1].all()
        again[x0:x1, y0:y1] = True
    assert (again == inside).all()


@given(st.lists(st.booleans(), min_size=12, max_size=12))
@settings(max_examples=100, deadline=None)
def test_maximal_rectangles_match_brute_force(cells: list[bool]) -> None:
    inside = np.array(cells).reshape(3, 4)
    full = [
        (i0, i1, j0, j1)
        for i0 in range(3)
        for i1 in range(i0 + 1, 4)
        for j0 in range(4)
        for j1 in range(j0 + 1, 5)
        if inside[i0:i1, j0:j1].all()
    ]
    best = [
        a
        for a in full
        if not any(
            b != a and b[0] <= a[0] and a[1] <= b[1] and b[2] <= a[2] and a[3] <= b[3] for b in full
        )
    ]
    assert maximal_rectangles(inside).tolist() == [list(row) for row in sorted(best)]


sizes = st.floats(3.0, 15.0).map(lambda value: round(value, 2))


@given(st.lists(st.tuples(sizes, sizes, sizes, sizes), min_size=1, max_size=4), st.floats(-40, 40))
@settings(max_examples=60, deadline=None)
def test_unions_of_boxes_come_back_from_any_angle(
    rows: list[tuple[float, float, float, float]], turn: float
) -> None:
    plan = shapely.union_all([shapely.box(0, 0, w, d) for w, d, _, _ in rows])
    turned = rotated(plan, turn)
    back = rotated(turned, -main_direction(turned))
    found = partition([back])
    # Jogs below the grid's tolerance may be straightened; nothing else may be lost.
    assert found.residual <= 0.45 * plan.length / plan.area
    assert residual(back, np.vstack(found.rectangles)) == pytest.approx(found.residual)
