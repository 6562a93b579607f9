"""Editing: what an edit contradicts is loosened and drawn anew, the rest stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facade_tools.artifacts.building import Box, Building, Element, Facade, Piece, Roof
from facade_tools.errors import Infeasible
from facade_tools.exteriors import mass_editing
from facade_tools.exteriors.attributes import attribute_vector, building_attributes
from facade_tools.exteriors.mass_editing import contradicted, loosened, suggestion
from facade_tools.exteriors.mass_energy import GROUPS
from facade_tools.exteriors.mass_hints import observed_zones, search_target
from facade_tools.exteriors.mass_porches import clear_porches, hidden, outside_porches
from facade_tools.exteriors.massgen import generate_mass
from facade_tools.geometry.blocked import porch_strips
from facade_tools.geometry.checks import element_rectangles, overlaps

MAIN = Box("main", "general", 5, 4, 10, 8, 5.6)
GARAGE = Box("added", "garage", 13, 2, 6, 6.5, 2.7)
WANTED = building_attributes(Building("wanted", (MAIN,)))
EDITED = Building("edited", (MAIN, GARAGE), partial=True)
KNOWN_WINDOW = Element("window", "sash", 1.5, 0.9, 2.8, 1.4, known=True)
KNOWN_DOOR = Element("door", "panel", 5.0, 0.0, 0.95, 2.1, main=True, known=True)


def shares(**missed):
    return dict.fromkeys((*GROUPS, "topology", "thickness"), 0.0) | missed


def test_plan_groups_are_contradicted_together():
    assert contradicted(shares()) == ()
    assert contradicted(shares(garage=0.2)) == ("garage",)
    assert contradicted(shares(bcr=0.01)) == ("bbox", "bcr", "bdry", "far", "arf")


def test_loosened_keeps_what_is_not_contradicted_and_what_is_seen():
    free = loosened(WANTED, EDITED, ("bbox", "garage"))
    assert free.mass.bbox == (None, None, None)
    assert free.mass.bcr == WANTED.mass.bcr
    assert free.mass.garage == (None, None, 6, 6.5, 2.7, None)
    assert free.present.garage is True
    assert free.present.porch_front is False
    assert free.bounds.bbox_min == (16, pytest.approx(9.25), 5.6)
    assert free.element == WANTED.element


def test_suggestion_draws_only_where_something_is_contradicted(monkeypatch):
    asked = []

    def draw(model, n, *, rng, given):
        asked.append(given)
        yield replace(building_attributes(Building("x", (MAIN, GARAGE))), id="0-0")

    monkeypatch.setattr(mass_editing, "sample_attributes", draw)
    rng = np.random.default_rng(0)
    assert suggestion(WANTED, EDITED, shares(), None, rng=rng) is None
    assert not asked
    (building,) = generate_mass(WANTED, rng=rng, keep=EDITED, model=object())
    assert asked[0].id == "wanted"
    assert building.id == "wanted"
    assert building.energy.mass < 1e-5
    assert attribute_vector(building.targets)[11] == 6
    assert {b.id for b in building.boxes} >= {"main", "added"}


def test_suggestion_survives_a_model_that_has_nothing(monkeypatch, caplog):
    def draw(model, n, *, rng, given):
        raise Infeasible("no such house")
        yield

    monkeypatch.setattr(mass_editing, "sample_attributes", draw)
    found = suggestion(WANTED, EDITED, shares(garage=1.0), None, rng=np.random.default_rng(0))
    assert found is None
    assert "nothing that suits the edit" in caplog.text


def test_nothing_is_built_before_an_observed_wall():
    window = Element("window", "sash", 4.0, 0.9, 1.2, 1.4, known=True)
    wall = Piece("front-1", "main", (0.0, 0.0, 0.0), 10.0, 3.0, (window,))
    seen = Building("seen", (MAIN,), {"front": Facade((wall,))}, partial=True)
    (zone,) = observed_zones(seen)
    assert zone.tolist() == [0, -3, 10, 0]
    wider = building_attributes(Building("w", (MAIN, replace(MAIN, id="b", x=8, y=9))))
    for seed in range(3):
        (building,) = generate_mass(wider, rng=np.random.default_rng(seed), keep=seen)
        assert building.facades == seen.facades
        for box in building.boxes[1:]:
            assert box.y - box.depth / 2 >= 0 or abs(box.x - 5) >= 5 + box.width / 2 - 1e-6


def test_complete_parts_are_not_added():
    target = search_target(
        WANTED, replace(EDITED, complete=("mass",)), rng=np.random.default_rng(0)
    )
    assert target.extra == 0


def test_complete_mass_takes_no_tower():
    special = {"chimney": 0, "tower": 1}
    wanted = replace(WANTED, element=replace(WANTED.element, special=special))
    seen = Building("seen", (MAIN,), partial=True, complete=("mass",))
    for seed in range(3):
        (building,) = generate_mass(wanted, rng=np.random.default_rng(seed), keep=seen)
        assert [box.id for box in building.boxes if box.kind == "general"] == ["main"]


def test_nothing_known_and_everything_complete_is_infeasible():
    nothing = Building("n", (), partial=True, complete=("mass", "garage", "porch", "roof"))
    with pytest.raises(Infeasible, match="general box"):
        list(generate_mass(WANTED, rng=np.random.default_rng(0), keep=nothing))


def test_storey_height_of_the_known_part_stays():
    seen = Building("seen", (MAIN,), storey_height=2.7, partial=True)
    (building,) = generate_mass(WANTED, rng=np.random.default_rng(0), keep=seen)
    assert building.storey_height == building.targets.storey_height == 2.7
    silent = replace(seen, storey_height=3.0)
    wanted = replace(WANTED, storey_height=2.8)
    (building,) = generate_mass(wanted, rng=np.random.default_rng(0), keep=silent)
    assert building.storey_height == 2.8


def test_no_new_box_hides_a_known_one():
    low = Box("garage", "garage", 13.0, 3.0, 6.0, 6.0, 2.7, Roof("hip", 26))
    seen = Building("seen", (low, replace(MAIN, height=None)), partial=True)
    high = Box("high", "general", 8.0, 5.0, 16.0, 10.0, 6.0)
    wanted = building_attributes(Building("w", (high, replace(low, x=15.9))))
    for seed in range(4):
        (building,) = generate_mass(wanted, rng=np.random.default_rng(seed), keep=seen)
        heights = {box.id: box.height for box in building.boxes}
        for new in building.boxes[2:]:
            for known in building.boxes[:2]:
                over = new.kind != "porch" and _overlap(new, known) > 1e-6
                assert not over or new.height <= heights[known.id] + 0.01


def _overlap(a, b):
    x = min(a.x + a.width / 2, b.x + b.width / 2) - max(a.x - a.width / 2, b.x - b.width / 2)
    y = min(a.y + a.depth / 2, b.y + b.depth / 2) - max(a.y - a.depth / 2, b.y - b.depth / 2)
    return min(x, y)


def test_hidden_porch_goes_before_the_wall_and_a_visible_one_stays():
    inside = Box("porch", "porch", 5.0, 1.0, 3.0, 2.0, 2.5)
    assert hidden(inside, [MAIN])
    (_, moved) = outside_porches((MAIN, inside), None)
    assert (moved.x, moved.y) == (5.0, -1.0)
    behind = replace(inside, y=6.9)
    assert outside_porches((MAIN, behind), None)[1].y == MAIN.depth + 1.0
    half = replace(inside, y=0.0)
    assert outside_porches((MAIN, half), None) == (MAIN, half)
    seen = Building("seen", (MAIN, inside), partial=True)
    assert outside_porches(seen.boxes, seen) == seen.boxes


@pytest.mark.parametrize(("depth", "width"), [(6.4, 2.0), (4.0, 1.2), (6.4, 1.2)])
def test_a_porch_in_a_notch_of_the_plan_gets_a_plan_with_a_notch(depth, width):
    """Plans without one are as good until their porch is put before the wall."""
    flat = Roof("flat")
    house = Building(
        "notch",
        (
            Box("wing", "general", 2.6, 2.4, 8.2 - width, 6.4, 3.3, flat),
            Box("street", "general", 0, -3, 14, 4.4, 3.3, flat),
            Box("porch", "porch", 7 - width / 2, 2.4, width, depth, 2.7, flat),
            Box("garage", "garage", -12, -4.5, 10, 6, 3.1, flat),
        ),
    )
    for seed in range(3):
        wanted = replace(building_attributes(house), id=f"notch-{seed}")
        (mass,) = generate_mass(wanted, rng=np.random.default_rng(seed))
        assert mass.energy.mass < 1e-3


@pytest.mark.parametrize("side", [-1, 1])
def test_a_porch_in_a_corner_of_the_plan_stands_outside_the_walls(side):
    """The corner may be left or right, as far as the attributes of the house alone say."""
    flat = Roof("flat")
    house = Building(
        "corner",
        (
            Box("main", "general", 0, 6, 14, 7, 3.0, flat),
            Box("wing", "general", side * 3.5, 1, 7, 4, 3.0, flat),
            Box("porch", "porch", side * -2.0, 1.3, 4, 2.4, 2.5, flat),
        ),
    )
    for seed in range(5):
        wanted = replace(building_attributes(house), id=f"corner-{seed}")
        (mass,) = generate_mass(wanted, rng=np.random.default_rng(seed))
        (porch,) = (box for box in mass.boxes if box.kind == "porch")
        assert mass.energy.mass < 1e-3
        assert all(_overlap(porch, box) < 2e-3 for box in mass.boxes if box is not porch)


@pytest.mark.parametrize("width", [2.2, 4.0, 6.0])
def test_posts_and_roof_of_a_new_porch_leave_known_elements_free(width):
    wall = Piece("front-1", "main", (0.0, 0.0, 0.0), 10.0, 3.0, (KNOWN_WINDOW, KNOWN_DOOR))
    seen = Building("seen", (MAIN,), {"front": Facade((wall,))}, partial=True)
    porch = Box("porch", "porch", 4.0 + width / 2, -1.0, width, 2.0, 2.6)
    (_, moved) = clear_porches((MAIN, porch), seen)
    roofed = replace(porch, x=moved.x, width=moved.width, roof=Roof("shed", 14, "y", 0.25))
    whole = replace(seen, boxes=(MAIN, roofed))
    strips = porch_strips(whole, roofed, "front", wall)
    assert not overlaps(element_rectangles(wall.elements), strips).any()
    assert abs(moved.x - porch.x) + abs(moved.width - width) < 2.5


def test_porch_whose_roof_would_cross_a_known_window_is_left_out():
    tall = replace(KNOWN_WINDOW, u=0.1, width=9.8, height=1.8)
    wall = Piece("front-1", "main", (0.0, 0.0, 0.0), 10.0, 3.0, (tall,))
    seen = Building("seen", (MAIN,), {"front": Facade((wall,))}, partial=True)
    porch = Box("porch", "porch", 5.0, -1.0, 4.0, 2.0, 2.6)
    assert clear_porches((MAIN, porch), seen) == (MAIN,)


def test_suggestion_holds_to_less_where_the_model_knows_no_such_building(monkeypatch):
    asked = []

    def draw(model, n, *, rng, given):
        asked.append(given)
        if len(asked) < 4:
            raise Infeasible("no such building")
        yield replace(building_attributes(Building("x", (MAIN, GARAGE))), id="0-0")

    monkeypatch.setattr(mass_editing, "sample_attributes", draw)
    rng = np.random.default_rng(0)
    suited = suggestion(WANTED, EDITED, shares(garage=0.5), None, rng=rng)
    assert suited.id == "wanted"
    kept, free, same, last = asked
    assert kept.mass.bcr == WANTED.mass.bcr
    assert free.mass.bcr is None
    assert free.element.roof["gable"] is None
    assert free.bounds == kept.bounds
    assert same.mass.bbox == (*free.bounds.bbox_min[:2], None)
    assert last.mass.bbox == free.bounds.bbox_min
