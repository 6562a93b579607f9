"""facadegen --design: what a layout puts on a side."""

from __future__ import annotations

from dataclasses import replace

import pytest
from facade_houses import HOUSES, ROOT, bare, elements, made, sample

from facade_tools.artifacts.building import SIDES, Box, Building, Element, Roof
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read
from facade_tools.errors import InvalidInput
from facade_tools.geometry.checks import building_problems

# --- designs ------------------------------------------------------------------------------------


@pytest.mark.parametrize("style", ["colonial", "ranch_l"])
def test_design_takes_the_place_of_the_front_with_its_door(facade, tmp_path, style):
    mass = tmp_path / "mass.jsonl"
    mass.write_bytes(dump_line(encode(bare(sample(style)))))
    design = ROOT / "sample_data" / "designs" / "house-front.yaml"
    out = tmp_path / "house.jsonl"
    done = facade("facadegen", mass, "--design", f"front:{design}", "-o", out)
    assert done.returncode == 0, done.stderr
    (house,) = read([str(out)], "building")
    assert list(building_problems(house)) == []
    front = [e for side, _, e in elements(house) if side == "front"]
    assert [e.main for e in front if e.kind == "door"] == [True]
    assert len({round(e.width, 6) for e in front if e.kind == "window" and e.style == "sash"}) >= 1
    assert {side for side, *_ in elements(house)} == set(SIDES)


def door_design(width: float, height: float) -> list[Element]:
    door = Element("door", "panel", width / 2 - 0.5, 0.0, 1.0, 2.1, main=True)
    return [door, Element("window", "sash", 0.5, 1.0, 0.8, 1.0)]


def test_main_door_is_in_the_front_where_other_sides_are_designed():
    mass = bare(sample("split_garage"))
    (house,) = made(mass, designs=dict.fromkeys(SIDES, door_design))
    assert list(building_problems(house)) == []
    assert [side for side, _, e in elements(house) if e.main] == ["front"]
    assert {side for side, _, e in elements(house) if e.kind == "door" and e.known} == set(SIDES)


def test_garage_beside_a_designed_wall_has_its_door():
    mass = bare(sample("split_garage"))
    (house,) = made(mass, designs={"front": door_design})
    assert [side for side, _, e in elements(house) if e.kind == "garage-door"] == ["front"]


def test_piece_that_loses_its_whole_design_is_generated():
    mass = bare(sample("colonial"))
    (house,) = made(
        mass, designs={"front": lambda w, h: [Element("window", "sash", 1, 0.5, 1, h - 1)]}
    )
    assert list(building_problems(house)) == []
    assert all(piece.elements for piece in house.facades["front"].pieces)


def test_observed_side_cannot_be_designed():
    house = sample("colonial")
    keep = replace(house, partial=True, facades={"front": house.facades["front"]})
    with pytest.raises(InvalidInput, match="front was observed"):
        made(bare(house), keep=keep, designs={"front": door_design})


def test_main_door_goes_to_another_side_where_the_front_takes_none(caplog):
    thin = Building("thin", (Box("main", "general", 0.4, 4, 0.8, 8, 3, Roof("flat", 0, "x")),))
    (house,) = made(thin)
    assert [(side, e.kind) for side, _, e in elements(house) if e.main] == [("left", "door")]
    assert list(building_problems(house)) == []
    assert list(house.facades) == list(SIDES)
    assert "no main door" not in caplog.text


def test_house_that_takes_no_main_door_is_reported(caplog):
    post = Building("post", (Box("main", "general", 0.4, 0.4, 0.8, 0.8, 3, Roof("flat", 0, "x")),))
    made(post)
    assert "no main door" in caplog.text


def test_design_of_no_side_is_refused(facade):
    done = facade("facadegen", HOUSES / "cape.jsonl", "--design", "roof:x.yaml")
    assert done.returncode == 3
    assert b"SIDE:DESIGN" in done.stderr
