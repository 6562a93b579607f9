"""Parses to elevations: lines, openings, metres."""

from __future__ import annotations

import pytest

from facade_tools.artifacts.parse import Region
from facade_tools.errors import InvalidInput
from facade_tools.reconstruction.elevation import building_lines, elevation, label_map, stretched

from .parsed_facade import HEIGHT, WIDTH, parsed, regions


def test_lines_of_the_building():
    assert building_lines(label_map(parsed())) == (20, 50, HEIGHT)
    assert building_lines(label_map(parsed(regions=regions(roof=False)))) == (50, 50, HEIGHT)


def test_the_elevation_is_in_metres():
    plan = elevation(parsed())
    assert (plan.width, plan.eaves, plan.loft) == pytest.approx((12.0, 12.0, 3.0))
    assert plan.lines == pytest.approx((0.0, 3.0, 6.0, 9.0, 12.0))
    assert [len(plan.openings), len(plan.dormers), len(plan.chimneys)] == [10, 2, 1]
    assert elevation(parsed(), storey_height=4.0).eaves == pytest.approx(16.0)
    assert elevation(parsed(), height=7.5).loft == pytest.approx(1.5)


def test_a_sliver_of_roof_is_no_loft():
    rows = tuple(r for r in regions(windows=False) if r.label != "roof")
    low = (*rows, Region("roof", 0, 45, WIDTH, 50), Region("sky", 0, 20, WIDTH, 45))
    plan = elevation(parsed(regions=low))
    assert (plan.loft, plan.pixels[1]) == (0.0, 50)


def test_windows_reach_down_to_the_balcony_before_them():
    plan = elevation(parsed())
    french = [r for r in plan.openings if r.label == "window" and 6.0 <= r.v0 < 6.5]
    assert len(french) == 3
    assert {round(r.v0, 6) for r in french} == {6.0}


@pytest.mark.parametrize(("top", "right", "head"), [
    (145, 68, 2.5), (158, 68, 2.1), (163, 68, None), (145, 57, None),
])  # fmt: skip
def test_fragments_of_doors_are_none_and_low_ones_get_the_usual_height(top, right, head):
    rows = tuple(r for r in regions() if r.label != "door")
    plan = elevation(parsed(regions=(*rows, Region("door", 52, top, right, HEIGHT))))
    doors = [(r.v0, r.v1) for r in plan.openings if r.label == "door"]
    assert doors == ([] if head is None else [pytest.approx((0.0, head))])


def test_what_a_parse_says_of_its_scale_counts():
    tags = {"scale": "height", "metres_per_pixel": 0.2}
    assert elevation(parsed(tags=tags)).eaves == pytest.approx(24.0)
    tags["scale"] = "relative"
    assert elevation(parsed(tags=tags)).eaves == pytest.approx(12.0)


def test_a_parse_without_floors_or_windows_still_has_storeys():
    plan = elevation(parsed(floors=(), regions=regions(windows=False)))
    assert len(plan.lines) > 3
    with pytest.raises(InvalidInput, match="shows no wall"):
        elevation(parsed(regions=(Region("sky", 0, 0, 9, 9),)))


def test_stretching_keeps_proportions():
    plan = elevation(parsed())
    wide = stretched(plan, 24.0, 6.0)
    assert (wide.width, wide.eaves, wide.storey) == pytest.approx((24.0, 6.0, 1.5))
    assert wide.openings[0].u1 == pytest.approx(2 * plan.openings[0].u1)
