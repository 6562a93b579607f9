"""Exposure of garages and porches at rectangular houses, against that of the artifact."""

from __future__ import annotations

import numpy as np
import pytest

from facade_tools.artifacts.building import Box, Building
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.exteriors.full_plans import Part, rectangle_exposure, snapped_garage, touching

HOUSE = (np.array([10.0]), np.array([8.0]))


def part(px, py, width, depth, exposure=0.5):
    return Part(*(np.array([float(v)]) for v in (px, py, width, depth, exposure)))


def measured(p, kind):
    """Exposure that `facade attributes` finds at a 10 × 8 m house."""
    x, y = float(p.px[0]) * 10, float(p.py[0]) * 8
    boxes = (
        Box("main", "general", 5, 4, 10, 8, 5.6),
        Box("part", kind, x, y, float(p.width[0]), float(p.depth[0]), 2.5),
    )
    mass = building_attributes(Building("h", boxes)).mass
    return mass.garage[5] if kind == "garage" else mass.porch[0 if y < 4 else 1][5]


@pytest.mark.parametrize("kind", ["porch", "garage"])
def test_exposure_is_that_of_the_artifact(kind):
    rng = np.random.default_rng(4)
    for _ in range(200):
        width, depth = np.round(rng.uniform(1, 6, 2), 1)
        if kind == "garage":
            x = rng.choice([width / 2, rng.uniform(width / 2, 10 - width / 2), 10 - width / 2])
            y = rng.choice([depth / 2, 8 - depth / 2])
        else:
            x, y = rng.uniform(0, 10), rng.choice([-depth / 2, 0.3, 8 + depth / 2])
        p = part(round(x, 2) / 10, round(y, 2) / 8, width, depth)
        assert rectangle_exposure(HOUSE, p)[0] == pytest.approx(measured(p, kind), abs=1e-9)


def test_garage_goes_to_the_walls_that_suit_its_draw():
    px, py, exposure = snapped_garage(HOUSE, part(0.68, 0.4, 6, 6, 0.5))
    assert (px[0], py[0], exposure[0]) == pytest.approx((0.7, 0.375, 0.5))
    px, py, exposure = snapped_garage(HOUSE, part(0.5, 0.375, 6, 6, 0.25))
    assert (px[0], py[0], exposure[0]) == pytest.approx((0.5, 0.375, 0.25))


def test_porch_that_stands_free_or_reaches_inside_is_moved_to_the_wall():
    assert touching(HOUSE, part(0.5, -0.4, 3, 2), -1)[0] == pytest.approx(-0.125)
    assert touching(HOUSE, part(0.5, -0.1, 3, 2), -1)[0] == pytest.approx(-0.125)
    assert touching(HOUSE, part(0.5, 1.4, 3, 2), 1)[0] == pytest.approx(1.125)
    assert touching(HOUSE, part(0.5, 0.3, 3, 2), -1)[0] == pytest.approx(-0.125)
    assert touching(HOUSE, part(0.5, 0.7, 3, 2), 1)[0] == pytest.approx(1.125)
    assert touching(HOUSE, part(1.15, 0.3, 3, 2), -1)[0] == pytest.approx(0.3)
