"""The compiled inner loop of mass generation, against slow versions and oracles."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest
from shapely import LineString
from shapely import box as polygon_of
from shapely.ops import unary_union

from facade_tools.artifacts.attributes import Attributes, MassAttributes
from facade_tools.artifacts.building import Box, Building
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.attributes import building_attributes, packed_boxes
from facade_tools.exteriors.mass_attributes import mass_vector
from facade_tools.exteriors.mass_energy import (
    GROUPS,
    layout_energy,
    layout_of,
    mass_energy,
    relative_residuals,
    target_of,
)
from facade_tools.exteriors.mass_layout import (
    attributes_of_layout,
    connected,
    in_contact,
    new_layout,
    new_work,
    thinness,
)
from facade_tools.exteriors.mass_polish import gather, polish, round_layout, scatter
from facade_tools.exteriors.mass_taste import covered_share

WORK = new_work()


def random_boxes(rng, lattice=True):
    kinds = ["general", *rng.choice(["general", "garage", "porch"], int(rng.integers(0, 6)))]
    boxes = []
    for i, kind in enumerate(kinds):
        low = rng.integers(0, 14, 2) if lattice else np.round(rng.uniform(0, 9, 2), 3)
        size = rng.integers(1, 12, 2) if lattice else np.round(rng.uniform(0.5, 9, 2), 3)
        x, y = low + size / 2
        height = float(rng.choice([2.0, 2.7, 4.6, 6.0, 8.5]))
        boxes.append(Box(f"b{i}", str(kind), float(x), float(y), *map(float, size), height))
    return tuple(boxes)


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(8)
    return [random_boxes(rng, lattice=k % 2 == 0) for k in range(400)]


def polygons(boxes):
    return [
        polygon_of(b.x - b.width / 2, b.y - b.depth / 2, b.x + b.width / 2, b.y + b.depth / 2)
        for b in boxes
    ]


# --- attributes -----------------------------------------------------------------------------------


def test_fast_attributes_equal_those_of_the_stage(cases):
    for boxes in cases:
        assert attributes_of_layout(layout_of(boxes), 3.0, WORK)
        np.testing.assert_allclose(WORK.values, mass_vector(*packed_boxes(boxes), 3.0), atol=1e-9)


def test_compiled_loop_equals_its_plain_version(cases):
    for boxes in cases[:5]:
        target = target_of(building_attributes(Building("h", cases[0])))
        fast = layout_energy(layout_of(boxes), target, WORK)
        slow = layout_energy.py_func(layout_of(boxes), target, new_work())
        assert fast == pytest.approx(slow, rel=1e-12)


# --- topology and thickness -----------------------------------------------------------------------


def oracle_connected(boxes):
    groups = {i: {i} for i in range(len(boxes))}
    for (i, a), (j, b) in combinations(enumerate(polygons(boxes)), 2):
        common = a.intersection(b)
        x0, y0, x1, y1 = common.bounds if not common.is_empty else (0, 0, 0, 0)
        if max(x1 - x0, y1 - y0) >= 0.5 - 1e-9:
            merged = groups[i] | groups[j]
            for k in merged:
                groups[k] = merged
    return len(groups[0]) == len(boxes)


def test_connected_equals_the_oracle(cases):
    found = [connected(layout_of(boxes)) for boxes in cases]
    assert found == [oracle_connected(boxes) for boxes in cases]
    assert 0.1 < np.mean(found) < 0.95


@pytest.mark.parametrize(
    ("row", "together"),
    [
        ((4.0, 0.0, 8.0, 4.0), True),
        ((4.0, 3.5, 8.0, 8.0), True),
        ((4.0, 3.6, 8.0, 8.0), False),
        ((4.001, 0.0, 8.0, 4.0), False),
        ((3.0, 3.0, 8.0, 8.0), True),
        ((1.0, 1.0, 2.0, 2.0), True),
    ],
)
def test_contact_is_half_a_metre(row, together):
    assert in_contact(np.array([0.0, 0, 4, 4, 3]), np.array([*row, 3.0])) == together


def oracle_thin_strips(boxes, least):
    """Scan lines through the middle of every row of the compressed grid, both directions."""
    total = 0.0
    for floor in range(3):
        shapes = [b for b in boxes if b.kind != "porch" and b.height > 3.0 * (floor + 0.5)]
        union = unary_union(polygons(shapes))
        for axis in range(2):
            lines = sorted({v for p in polygons(boxes) for v in p.bounds[1 - axis :: 2]})
            before = set()
            for a, b in pairwise(lines):
                ends = [(-99, (a + b) / 2), (99, (a + b) / 2)]
                cut = LineString([p[:: 1 if axis == 0 else -1] for p in ends]).intersection(union)
                parts = [g.bounds[axis::2] for g in getattr(cut, "geoms", [cut]) if not g.is_empty]
                parts = sorted((round(s, 6), round(t, 6)) for s, t in parts)
                gaps = [(s[1], t[0]) for s, t in pairwise(parts)]
                now = {(*p, True) for p in parts} | {(*g, False) for g in gaps}
                for s, t, _ in now - before:
                    total += ((t - s - least) / least) ** 2 if t - s < least - 1e-6 else 0.0
                before = now
    return total


def test_thinness_equals_the_oracle(cases):
    for boxes in cases[:120]:
        attributes_of_layout(layout_of(boxes), 3.0, WORK)
        for least in (0.5, 2.5):
            assert thinness(WORK, least) == pytest.approx(oracle_thin_strips(boxes, least))


def test_share_of_a_porch_in_the_house_equals_the_oracle(cases):
    for boxes in cases[:120]:
        attributes_of_layout(layout_of(boxes), 3.0, WORK)
        plans = polygons(boxes)
        # At storeys of 3 m all solid boxes of the cases have a ground floor.
        solid = unary_union([p for p, b in zip(plans, boxes, strict=True) if b.kind != "porch"])
        for k, (plan, box) in enumerate(zip(plans, boxes, strict=True)):
            if box.kind == "porch":
                share = plan.intersection(solid).area / plan.area
                assert covered_share(k, WORK) == pytest.approx(share)


# --- energy ---------------------------------------------------------------------------------------


def test_energy_is_equation_3(cases):
    for boxes, wanted in zip(cases[:100], cases[100:], strict=False):
        attributes = building_attributes(Building("h", wanted))
        target = target_of(attributes)
        found = mass_vector(*packed_boxes(boxes), 3.0)
        want = mass_vector(*packed_boxes(wanted), 3.0)
        expected = oracle_thin_strips(boxes, 0.5) + 1e6 * (not oracle_connected(boxes))
        for place in GROUPS.values():
            norm = (want[place] ** 2).sum() or 100.0
            expected += ((found[place] - want[place]) ** 2).sum() / norm
        energy, shares = mass_energy(boxes, target)
        assert energy == pytest.approx(expected, rel=1e-9)
        assert energy == pytest.approx(layout_energy(layout_of(boxes), target, WORK), rel=1e-9)
        assert energy == pytest.approx(sum(shares.values()))


def test_unknown_and_left_out_values_weigh_nothing():
    boxes = (Box("a", "general", 5, 4, 10, 8, 3.0),)
    attributes = Attributes("h", MassAttributes(bbox=(20.0, None, 3.0), bcr=0.5))
    energy, shares = mass_energy(boxes, target_of(attributes))
    assert shares["bbox"] == pytest.approx(100 / 409)
    assert shares["bcr"] == pytest.approx(1.0)
    assert energy == pytest.approx(100 / 409 + 1)
    assert mass_energy(boxes, target_of(attributes, without=["bcr"]))[0] == shares["bbox"]
    assert relative_residuals(shares, 0.6) == {"bcr": 1.0}


def test_empty_layout_costs_one_a_group():
    target = target_of(building_attributes(Building("h", (Box("a", "general", 0, 0, 9, 9, 3.0),))))
    assert layout_energy(new_layout(), target, WORK) == pytest.approx(5)  # no garage, no porch


def test_too_many_boxes_are_refused():
    with pytest.raises(InvalidInput, match="at most 20"):
        layout_of([Box(str(i), "general", i, 0, 1, 1, 3.0) for i in range(21)])


# --- polishing ------------------------------------------------------------------------------------


def test_polishing_never_raises_the_energy_and_finds_the_way_back(cases):
    rng = np.random.default_rng(4)
    solved = []
    for boxes in cases[::4]:
        if not oracle_connected(boxes) or oracle_thin_strips(boxes, 0.5):
            continue
        target = target_of(building_attributes(Building("h", boxes)))
        layout = layout_of(boxes)
        variables = gather(layout)
        scatter(variables, variables.values + rng.normal(0, 0.05, len(variables.values)), layout)
        before = layout_energy(layout, target, WORK)
        after = polish(layout, target, WORK)
        assert after <= before
        assert after == pytest.approx(layout_energy(layout, target, WORK))
        solved.append(after < 1e-8)
    assert np.mean(solved) > 0.7


def test_locked_boxes_do_not_move():
    boxes = (Box("a", "general", 5, 4, 10, 8, 3.0), Box("b", "general", 11, 3, 4, 6, None))
    layout = layout_of(boxes, locked=True)
    layout.rows[1, 4] = 2.8
    assert gather(layout).values.tolist() == [2.8]
    for lift, height in ((0.0, 3.0), (-0.5, 2.5), (0.5, 3.0)):
        layout.rows[1, 4] = 2.8
        round_layout(layout, 0.5, lift)
        assert layout.rows[0].tolist() == [0, 0, 10, 8, 3]
        assert layout.rows[1].tolist() == [9, 0, 13, 6, height]
    round_layout(layout, 0.5, 0.5)
    assert layout.rows[1, 4] == 3.0  # what is round already stays
