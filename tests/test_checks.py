"""The rules of facade geometry: good houses pass, every planted fault is found."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from facade_tools.artifacts.building import (
    Box,
    Building,
    Element,
    Energy,
    Facade,
    Piece,
    Roof,
    Side,
)
from facade_tools.artifacts.footprint import Footprint
from facade_tools.artifacts.store import read
from facade_tools.geometry.blocked import BuiltRoof, blocked_rectangles, porch_posts, roof_height
from facade_tools.geometry.checks import Problem, building_problems
from facade_tools.geometry.checks_plan import footprint_problems, parse_problems
from facade_tools.geometry.pieces import facade_pieces

SAMPLES = Path(__file__).parent.parent / "sample_data"
GABLE = Roof("gable", 30, "x", 0.4)
DOOR = Element("door", "panel", 1.0, 0.0, 0.9, 2.1, main=True)
WINDOW = Element("window", "sash", 4.0, 0.9, 1.0, 1.4)


def house(*extra: Box, front: tuple[Element, ...] = (DOOR, WINDOW)) -> Building:
    """A two-storey box with a door and a window in its first front piece."""
    main = Box("main", "general", 5, 4, 10, 8, 6, GABLE)
    bare = Building("h", (main, *extra))
    facades: dict[Side, Facade] = {
        side: Facade(pieces) for side, pieces in facade_pieces(bare).items()
    }
    first, *others = facades["front"].pieces
    facades["front"] = Facade((replace(first, elements=front), *others))
    return replace(bare, facades=facades)


def problems(building: Building) -> list[Problem]:
    return list(building_problems(building))


def with_front(building: Building, change: Callable[[Piece], Piece]) -> Building:
    first, *others = building.facades["front"].pieces
    front = Facade((change(first), *others))
    return replace(building, facades={**building.facades, "front": front})


def test_sample_houses_and_partials_break_no_rule() -> None:
    for building in read([str(SAMPLES / "houses"), str(SAMPLES / "partial")], "building"):
        assert problems(building) == []


def test_plain_house_is_sound() -> None:
    assert problems(house()) == []


def test_mass_without_facades_is_sound() -> None:
    assert problems(replace(house(), facades={})) == []


def _beside(lower: Box, higher: Box) -> Building:
    return Building("m", (lower, higher))


# a mass -> the side and the origin of a wall in whose middle a lower roof stands
RISING: dict[str, tuple[Building, Side, tuple[float, float, float]]] = {
    "hip that runs on into the wall": (
        _beside(
            Box("wing", "general", 6, 9.5, 12, 3, 3, Roof("hip", 30, "x", 0.5)),
            Box("main", "general", 6, 4, 12, 8, 6, Roof("hip", 30, "x", 0.5)),
        ),
        "back",
        (12.0, 8.0, 3.0),
    ),
    "gable around a tall box, eaves far below": (
        _beside(
            Box("main", "general", 6, 5, 12, 10, 4.9, Roof("gable", 40, "x", 0.3)),
            Box("tall", "general", 6, 4, 4, 4, 9, Roof("flat")),
        ),
        "back",
        (8.0, 6.0, 6.0),
    ),
    "shed around a tall box": (
        _beside(
            Box("main", "general", 7, 5, 14, 10, 5, Roof("shed", 30, "x", 0.5)),
            Box("tall", "general", 8, 6, 3, 3, 11, Roof("flat")),
        ),
        "right",
        (9.5, 4.5, 9.0),
    ),
}

FAULTS: dict[str, tuple[Callable[[Building], Building], str, str]] = {
    "no general box": (
        lambda b: replace(b, boxes=(replace(b.boxes[0], kind="garage"),), facades={}),
        "/boxes",
        "general",
    ),
    "low box": (
        lambda b: replace(b, boxes=(replace(b.boxes[0], height=1.5),), facades={}),
        "/boxes/0/height",
        "half a storey",
    ),
    "box id twice": (
        lambda b: replace(b, boxes=b.boxes * 2),
        "/boxes/1/id",
        "twice",
    ),
    "piece id twice": (
        lambda b: with_front(b, lambda p: replace(p, id="front-2")),
        "/facades/front/pieces/1/id",
        "twice",
    ),
    "piece of no box": (
        lambda b: with_front(b, lambda p: replace(p, box="nowhere")),
        "/facades/front/pieces/0/box",
        "nowhere",
    ),
    "wrong wall": (
        lambda b: with_front(b, lambda p: replace(p, width=9.9)),
        "/facades/front/pieces/0",
        "no exterior wall",
    ),
    "missing wall": (
        lambda b: replace(b, facades={**b.facades, "left": Facade(())}),
        "/facades/left/pieces",
        "missing",
    ),
    "outside": (
        lambda b: with_front(b, lambda p: replace(p, elements=(DOOR, replace(WINDOW, u=9.5)))),
        "/facades/front/pieces/0/elements/1",
        "border",
    ),
    "overlap": (
        lambda b: with_front(b, lambda p: replace(p, elements=(DOOR, replace(WINDOW, u=1.5)))),
        "/facades/front/pieces/0/elements/1",
        "overlaps",
    ),
    "no main door": (
        lambda b: with_front(b, lambda p: replace(p, elements=(WINDOW,))),
        "/facades",
        "0 main doors",
    ),
    "two main doors": (
        lambda b: with_front(b, lambda p: replace(p, elements=(DOOR, replace(DOOR, u=6.0)))),
        "/facades",
        "2 main doors",
    ),
    "heads of two heights": (
        lambda b: with_front(
            replace(b, energy=Energy(facade=0.0)),
            lambda p: replace(p, elements=(DOOR, WINDOW, replace(WINDOW, u=6.0, height=1.2))),
        ),
        "/facades/front/pieces/0/elements/2",
        "head is 0.20 m below",
    ),
    "sill too high": (
        lambda b: with_front(
            b, lambda p: replace(p, elements=(DOOR, replace(WINDOW, v=2.3, height=0.5)))
        ),
        "/facades/front/pieces/0/elements/1",
        "sill is 2.30 m",
    ),
    "main door is a window": (
        lambda b: with_front(b, lambda p: replace(p, elements=(replace(WINDOW, main=True),))),
        "/facades/front/pieces/0/elements/0",
        "no door at ground level",
    ),
    "main door upstairs": (
        lambda b: replace(
            b,
            facades={
                **b.facades,
                "front": Facade(
                    (
                        replace(b.facades["front"].pieces[0], elements=()),
                        replace(b.facades["front"].pieces[1], elements=(DOOR,)),
                    )
                ),
            },
        ),
        "/facades/front/pieces/1/elements/0",
        "no door at ground level",
    ),
    "hanging door": (
        lambda b: with_front(b, lambda p: replace(p, elements=(replace(DOOR, v=0.6),))),
        "/facades/front/pieces/0/elements/0",
        "hangs",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_fault_is_found(fault: str) -> None:
    plant, pointer, words = FAULTS[fault]
    found = problems(plant(house()))
    assert any(p.pointer == pointer and words in p.message for p in found), found


@pytest.mark.parametrize("fault", sorted(FAULTS.keys() - {"no main door", "main door upstairs"}))
def test_planted_fault_is_the_only_one(fault: str) -> None:
    plant, pointer, _ = FAULTS[fault]
    beside = {"piece of no box", "wrong wall", "box id twice"}  # leave other walls over, too
    found = {p.pointer for p in problems(plant(house()))}
    assert pointer in found
    assert fault in beside or found == {pointer}


def test_wall_of_another_box_is_found() -> None:
    wing = Box("wing", "general", 12, 4, 4, 6, 2.8, Roof("flat"))
    sound = house(wing)
    assert problems(sound) == []
    broken = with_front(sound, lambda p: replace(p, box="wing" if p.box == "main" else "main"))
    pointer = "/facades/front/pieces/0/box"
    assert [p.pointer for p in problems(broken)] == [pointer]


def test_garage_door_outside_the_garage_is_found() -> None:
    garage = Box("garage", "garage", 13, 4, 6, 6, 2.7, Roof("flat"))
    door = Element("garage-door", "panel", 0.5, 0.0, 2.4, 2.1)
    sound = house(garage)
    pieces = {s: list(f.pieces) for s, f in sound.facades.items()}

    def with_door(box: str) -> Building:
        j = next(j for j, p in enumerate(pieces["back"]) if p.box == box and p.origin[2] == 0.0)
        back = [
            replace(p, elements=(door,) if i == j else ()) for i, p in enumerate(pieces["back"])
        ]
        return replace(sound, facades={**sound.facades, "back": Facade(tuple(back))})

    assert problems(with_door("garage")) == []
    found = [p.message for p in problems(with_door("main"))]
    assert "a garage door in box 'main', no garage" in found


RECTANGLE = ((0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (0.0, 6.0))
HOLE = ((1.0, 1.0), (1.0, 3.0), (3.0, 3.0), (3.0, 1.0))


@pytest.mark.parametrize(
    ("rings", "pointer", "words"),
    [
        ((((0, 0), (8, 6), (8, 0), (0, 6)),), "/polygon/0", "crosses itself"),
        ((((0, 0), (8, 0), (4, 0)),), "/polygon/0", "no area"),
        ((RECTANGLE, ((1, 1), (1, 1), (1, 1))), "/polygon/1", "no area"),
        ((RECTANGLE, ((6, 2), (10, 2), (10, 4), (6, 4))), "/polygon/1", "4 m² outside"),
        ((RECTANGLE, HOLE, ((2, 2), (5, 2), (5, 5), (2, 5))), "/polygon/2", "/polygon/1 by 1 m²"),
        ((RECTANGLE, RECTANGLE[::-1]), "/polygon", "no area"),
    ],
)
def test_footprint_whose_rings_are_no_plan_is_found(rings, pointer, words) -> None:
    found = list(footprint_problems(Footprint("f", rings, 5.0)))
    assert [p.pointer for p in found] == [pointer]
    assert words in found[0].message


@pytest.mark.parametrize(
    "rings",
    [
        (RECTANGLE,),
        (RECTANGLE[::-1], HOLE),
        ((*RECTANGLE, RECTANGLE[0]),),
        (RECTANGLE, HOLE, tuple((x + 2, y) for x, y in HOLE)),
    ],
)
def test_footprint_of_sound_rings_passes(rings) -> None:
    assert list(footprint_problems(Footprint("f", rings, 5.0))) == []


@pytest.mark.parametrize(
    ("change", "pointer", "words"),
    [
        (lambda rows: rows[:-1], "/regions", "without a label"),
        (lambda rows: (*rows, rows[0]), "/regions/{last}", "overlaps /regions/0"),
        (lambda rows: (replace(rows[0], x1=rows[0].x0), *rows[1:]), "/regions/0", "no pixels"),
        (lambda rows: (*rows, replace(rows[0], x0=-5)), "/regions/{last}", "leaves the image"),
    ],
)
def test_parse_whose_regions_do_not_tile_the_image_is_found(change, pointer, words) -> None:
    parse = next(iter(read([str(Path(__file__).parent / "golden" / "parses.jsonl")], "parse")))
    assert list(parse_problems(parse)) == []
    broken = replace(parse, regions=change(parse.regions))
    found = list(parse_problems(broken))
    assert [p.pointer for p in found] == [pointer.format(last=len(parse.regions))]
    assert words in found[0].message


def test_window_in_front_of_a_lower_roof_is_found() -> None:
    lean = Box("lean", "general", 12, 4, 4, 6, 2.8, Roof("gable", 45, "x", 0.3))
    sound = house(lean)
    upper = next(p for p in sound.facades["right"].pieces if p.origin[2] >= 3 and p.box == "main")
    over_ridge = Element("window", "sash", upper.width / 2 - 0.5, 0.9, 1.0, 1.4)
    pieces = tuple(
        replace(p, elements=(over_ridge,)) if p is upper else p
        for p in sound.facades["right"].pieces
    )
    broken = replace(sound, facades={**sound.facades, "right": Facade(pieces)})
    assert [p.message for p in problems(broken) if "roof" in p.message]


@pytest.mark.parametrize("name", RISING)
def test_window_where_a_lower_roof_runs_into_the_wall_is_found(name: str) -> None:
    mass, side, origin = RISING[name]
    facades: dict[Side, Facade] = {s: Facade(p) for s, p in facade_pieces(mass).items()}
    wall = next(p for p in facades[side].pieces if p.origin == origin)
    sunk = Element("window", "sash", wall.width / 2 - 0.5, 0.9, 1.0, 1.4)
    pieces = tuple(replace(p, elements=(sunk,)) if p is wall else p for p in facades[side].pieces)
    found = problems(replace(mass, facades={**facades, side: Facade(pieces)}))
    assert [p.message for p in found if "roof" in p.message]


def test_no_roof_stands_before_a_wall_beside_the_lower_box() -> None:
    mass, side, _ = RISING["hip that runs on into the wall"]
    free = [p for p in facade_pieces(mass)["left"] if p.box == "main" and p.origin[2] == 3.0]
    assert (
        blocked_rectangles(mass, BuiltRoof.of(mass), "left", free[0])[:, 3].max() < 0.06
    )  # the eaves' overhang
    buried = next(p for p in facade_pieces(mass)[side] if p.origin[2] == 3.0)
    ridge = blocked_rectangles(mass, BuiltRoof.of(mass), side, buried)[:, 3].max()
    assert ridge == pytest.approx(3.0 * math.tan(math.radians(30)) + 0.2, abs=0.02)


def test_window_behind_a_post_is_found_and_a_known_one_is_let_be() -> None:
    porch = Box("porch", "porch", 5, -1, 4, 2, 2.5, Roof("flat"))
    behind = replace(WINDOW, u=2.8)
    found = problems(house(porch, front=(replace(DOOR, u=4.5), behind)))
    assert ["post" in p.message for p in found] == [True]
    kept = house(porch, front=(replace(DOOR, u=4.5), replace(behind, known=True)))
    assert problems(kept) == []


def test_garage_wants_its_door() -> None:
    garage = Box("garage", "garage", 13, 4, 6, 6, 2.7, Roof("flat"))
    assert [p.pointer for p in problems(house(garage))] == ["/boxes/1"]


def test_garage_under_the_house_wants_its_door_in_the_wall_of_the_house() -> None:
    inside = house(Box("garage", "garage", 8, 3, 4, 6, 2.6, Roof("flat")))
    assert [p.pointer for p in problems(inside)] == ["/boxes/1"]
    door = Element("garage-door", "panel", 6.5, 0.0, 2.4, 2.1)
    assert problems(with_front(inside, lambda p: replace(p, elements=(*p.elements, door)))) == []
    aside = replace(door, u=0.1)
    wrong = with_front(inside, lambda p: replace(p, elements=(aside,)))
    assert "a garage door in box 'main', no garage" in [p.message for p in problems(wrong)]


def test_garage_behind_an_observed_wall_wants_no_door() -> None:
    """Known windows stand where a garage under the house ends: its door is where nobody saw it."""
    inside = house(Box("garage", "garage", 7, 3, 4, 6, 2.6, Roof("flat")))
    assert [p.pointer for p in problems(inside)] == ["/boxes/1"]

    def seen(piece: Piece) -> Piece:
        return replace(piece, elements=tuple(replace(e, known=True) for e in piece.elements))

    assert problems(with_front(inside, seen)) == []


def test_garage_behind_porches_wants_no_door() -> None:
    garage = Box("garage", "garage", 8, 3, 4, 6, 2.6, Roof("flat"))
    front = Box("porch", "porch", 8, -1, 4, 2, 2.5, Roof("flat"))
    aside = Box("porch-2", "porch", 11, 3, 2, 6, 2.5, Roof("flat"))
    assert problems(house(garage, front, aside)) == []


def test_partial_building_is_held_to_what_it_says() -> None:
    whole = house()
    partial = replace(whole, partial=True, facades={"front": whole.facades["front"]})
    assert problems(partial) == []
    bad = with_front(partial, lambda p: replace(p, width=9.0))
    assert problems(bad) == []
    assert problems(replace(bad, complete=("mass",)))


def test_roof_height_over_the_middle_and_the_eaves() -> None:
    import numpy as np

    box = Box("b", "general", 0, 0, 10, 8, 3, Roof("gable", 45, "x", 0.5))
    at = np.array([[0.0, 0.0], [0.0, 4.0], [0.0, -4.5], [0.0, 5.0]])
    heights = roof_height(box, at)
    assert heights[:3] == pytest.approx([7.0, 3.0, 2.5])
    assert np.isnan(heights[3])


def test_porch_posts_leave_the_middle_free_and_touch_no_wall() -> None:
    porch = Box("porch", "porch", 5, -1, 8, 2, 2.5, Roof("flat"))
    posts = porch_posts(house(porch), porch)
    assert len(posts) == 4
    assert posts[:, 1] == pytest.approx(-1.9)
    assert abs(posts[:, 0] - 5).min() > 1


def test_upper_wall_is_not_blocked_by_the_porch_below() -> None:
    porch = Box("porch", "porch", 5, -1, 8, 2, 2.5, Roof("flat"))
    building = house(porch)
    upper = building.facades["front"].pieces[-1]
    assert upper.origin[2] == 3
    assert len(blocked_rectangles(building, BuiltRoof.of(building), "front", upper)) == 0
