"""Walls of other widths than the picture: axes are repeated, left out, not squeezed."""

from __future__ import annotations

import numpy as np
import pytest

from facade_tools.geometry.checks import building_problems
from facade_tools.reconstruction.elevation import label_map
from facade_tools.reconstruction.engine import Lot
from facade_tools.reconstruction.facets import faceted
from facade_tools.reconstruction.reconstruct import reconstruct
from facade_tools.reconstruction.widening import widened

from .parsed_facade import HEIGHT, WIDTH, parsed, picture, regions, rng, solid_of


@pytest.mark.parametrize(
    ("ratio", "columns"), [(0.7, 2), (1.05, 3), (1.35, 4), (2.0, 6), (4.0, 12)]
)
def test_axes_repeat_where_the_wall_is_wider(ratio, columns):
    parse = parsed(regions=tuple(r for r in regions(roof=False) if r.label != "door"))
    labels = label_map(parse)
    more = widened(labels, ratio)
    assert (more is None) == (columns == 3)
    if more is None:
        return
    assert abs(np.log(more.width / (ratio * WIDTH))) < abs(np.log(ratio))
    other, wide = more.parse(parse), more.picture(picture())
    assert wide.shape == (HEIGHT, more.width, 3)
    assert label_map(other).shape == (HEIGHT, more.width)
    row = [r for r in other.regions if r.label == "window" and r.y0 == 60]
    assert len(row) == columns
    assert {r.x1 - r.x0 for r in row} == {12}
    dark = (wide[65] < 90).all(axis=1)
    assert all(dark[r.x0 + 1 : r.x1 - 1].all() for r in row)


def test_doors_are_never_repeated_and_lone_axes_stretch():
    labels = label_map(parsed())
    more = widened(labels, 3.0)
    if more is not None:
        doors = [r for r in more.parse(parsed()).regions if r.label == "door"]
        assert len(doors) == 1
    assert widened(labels[:, :40], 3.0) is None
    assert widened(np.full((50, 50), 2, np.uint8), 3.0) is None


def test_a_wide_footprint_has_more_axes_and_nothing_is_seen_twice():
    lot = Lot([np.array([[-15.0, -6.0], [15.0, -6.0], [15.0, 6.0], [-15.0, 6.0]])])
    parse = parsed(regions=tuple(r for r in regions(roof=False) if r.label != "door"))
    made = reconstruct(parse, picture(), [lot], rng=rng())
    upper = [r for r in made.plan.openings if r.label == "window" and r.v0 > 8]
    assert len(upper) > 6
    assert not made.seen
    assert solid_of(made.scene()).is_watertight
    assert not list(building_problems(made.building()))
    assert all(
        not element.known
        for piece in made.building().facades["front"].pieces
        for element in piece.elements
    )


def windows_on(building, side):
    return [e for p in building.facades[side].pieces for e in p.elements if e.kind == "window"]


def test_a_narrow_front_leaves_no_blank_sides():
    lot = Lot([np.array([[0.0, 0.0], [2.5, 0.0], [2.5, 9.0], [0.0, 9.0]])])
    made = reconstruct(parsed(), picture(), [lot], rng=rng())
    building = made.building()
    assert solid_of(made.scene()).is_watertight
    assert not list(building_problems(building))
    for side in ("left", "right", "back", "front"):
        assert len(windows_on(building, side)) >= 3
    assert not made.seen
    widths = [e.width for e in windows_on(building, "left")]
    assert max(widths) / min(widths) < 1.5
    assert min(widths) > 0.8  # 1.2 m in the picture


def test_curves_of_short_walls_have_axes_that_are_not_squeezed():
    turn = np.linspace(np.pi, 2 * np.pi, 21)
    curve = 7.97 * np.column_stack([np.cos(turn), np.sin(turn)])
    ring = np.concatenate([curve, [[7.97, 10.0], [-7.97, 10.0]]])
    made = reconstruct(parsed(), picture(), [Lot([ring])], rng=rng())
    assert solid_of(made.scene()).is_watertight
    leaves = [x.shape for x in made.derived.leaves if x.shape.symbol.endswith("-window")]
    assert leaves
    assert min(shape.scope.size[0] for shape in leaves) > 0.55


def test_only_curves_are_faceted():
    square = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]])
    jogs = np.array([[0, 0], [8, 0], [8, 5], [7, 5], [7, 6], [8, 6], [8, 8], [0, 8.0]])
    small = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    for ring in (square, jogs, small):
        assert np.array_equal(faceted(ring), ring)
    turn = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    rounded = 8.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    for first in (0, 1, 7):
        found = faceted(np.roll(rounded, first, axis=0))
        lengths = np.hypot(*(np.roll(found, -1, axis=0) - found).T)
        assert 10 < len(found) < 22
        assert lengths.max() < 4.0
        assert set(map(tuple, found)) <= set(map(tuple, rounded))
