"""Windows of a side on common axes: which move, how far, and which stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facade_tools.artifacts.building import Box, Building, Element, Facade, Roof
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.geometry.checks import building_problems
from facade_tools.geometry.pieces import facade_pieces
from facade_tools.reconstruction.axes import SLACK, on_axes


def block(offsets, side="front"):
    """A block of storeys of 3 m; windows of each stand at 2, 5 and 8 m but for their offsets."""
    main = Box("main", "general", 5, 5, 10, 10, 3.0 * len(offsets), Roof("flat"))
    building = Building("b", (main,), storey_height=3.0)
    pieces = []
    for piece in facade_pieces(building)[side]:
        row = offsets[round(piece.origin[2] / 3)]
        windows = tuple(
            Element("window", "fixed", x - 0.5 + off, 0.8, 1.0, 1.5, known=True)
            for x, off in zip((2, 5, 8), row, strict=False)
        )
        pieces.append(replace(piece, elements=windows))
    return building, pieces


def aligned(building, side, pieces):
    whole = replace(building, facades={side: Facade(tuple(pieces))}, partial=True)
    assert not list(building_problems(whole))
    index = ("front", "back", "left", "right").index(side)
    return building_attributes(whole).facade.align[index]


@pytest.mark.parametrize("side", ["front", "back", "left", "right"])
def test_columns_of_a_parse_are_aligned_on_all_sides(side):
    rng = np.random.default_rng(1)
    building, pieces = block(rng.uniform(-0.12, 0.12, (5, 3)).tolist(), side)
    assert aligned(building, side, pieces) < 0.6
    done = on_axes(side, pieces)
    assert aligned(building, side, done) == 1.0
    for before, after in zip(pieces, done, strict=True):
        for a, b in zip(before.elements, after.elements, strict=True):
            assert abs(a.u - b.u) <= SLACK + 1e-9
            assert replace(a, u=b.u) == b
    assert on_axes(side, done) == done


def test_windows_that_stand_elsewhere_stay():
    _, pieces = block([(0, 0, 0), (0.6, -0.5, 0.4), (0, 0, 0)])
    assert on_axes("front", pieces) == pieces


def test_a_window_without_room_stays():
    _, pieces = block([(0.2, 0, 0), (0, 0, 0)])
    low = pieces[0]
    door = Element("door", "panel", low.elements[0].u - 1.02, 0.0, 1.0, 2.1, main=True)
    crowded = [replace(low, elements=(*low.elements, door)), pieces[1]]
    done = on_axes("front", crowded)
    assert done[0].elements[0] == low.elements[0]
    assert done[1].elements[0].u == pytest.approx(1.6)


def test_a_side_without_windows():
    _, pieces = block([(), ()])
    assert on_axes("back", pieces) == pieces
    assert on_axes("left", []) == []
