"""Retargeted buildings keep their doors, before the wall."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from facade_tools.artifacts.building import Box, Building, Element, Facade, Frame, Roof
from facade_tools.formats.style_folder import write_style
from facade_tools.geometry.details import building_scene
from facade_tools.geometry.mesh import Mesh
from facade_tools.geometry.pieces import facade_pieces
from facade_tools.stylization.bases import building_blocks
from facade_tools.stylization.doors import door_covers, door_meshes
from facade_tools.stylization.pitched import crowned
from facade_tools.stylization.retarget import retarget

SAMPLES = Path(__file__).parent.parent / "sample_data"
SIDES = ["front", "back", "left", "right"]
DOOR = Element("door", "panel", 2.0, 0.0, 1.0, 2.1, main=True)
GARAGE = Element("garage-door", "sectional", 5.0, 0.0, 2.5, 2.2)
BALCONY = Element("door", "french", 2.0, 0.1, 1.0, 2.1)
WINDOW = Element("window", "fixed", 3.5, 1.0, 1.0, 1.0)


def house(side="front", frame=None):
    """Two storeys, 12 × 9 m: on one side a door, a garage door, and a door upstairs."""
    box = Box("h", "general", 6.0, 4.5, 12.0, 9.0, 6.0, Roof("gable", 35, "x"))
    bare = Building("house", (box,), frame=frame)
    ground, upper = facade_pieces(bare)[side]
    pieces = (
        replace(ground, elements=(DOOR, WINDOW, GARAGE)),
        replace(upper, elements=(BALCONY,)),
    )
    return replace(bare, facades={side: Facade(pieces)})


def corners(meshes):
    points = np.concatenate([mesh.vertices for mesh in meshes])
    return np.array([points.min(axis=0), points.max(axis=0)])


def doors(scene):
    return [mesh for mesh in scene.meshes if "door-" in mesh.name]


@pytest.mark.parametrize("side", SIDES)
def test_covers_are_the_doors_on_the_ground(side):
    built = building_scene(house(side))
    covers = door_covers(house(side))
    assert [cover.side for cover in covers] == [side, side]
    along = 0 if side in ("front", "back") else 1
    for cover, kind in zip(covers, ("door-1", "garage-door-1"), strict=True):
        own = corners([m for m in built.meshes if m.name == f"{side}/piece-1/{kind}"])
        low, bottom, high, top = cover.rectangle
        drawn = own[0][along], own[0][2], own[1][along], own[1][2]
        assert np.allclose((low, bottom, high, top), drawn, atol=0.04)  # the head board is wider


def wall(w, side_width=12.0):
    """A quad of a front wall, w before y = 0."""
    points = [[0, -w, 0], [side_width, -w, 0], [side_width, -w, 3], [0, -w, 3]]
    return Mesh("h/front", np.array(points, dtype=float), np.array([[0, 1, 2], [0, 2, 3]]), "a")


@pytest.mark.parametrize(
    ("depths", "block"),
    [
        ((0.0,), None),
        ((0.005,), None),
        ((0.005, 0.2), (0.0, 0.2)),  # a plinth
        ((-0.3, 0.0), (-0.3, 0.0)),  # a niche
        ((-2.0, 0.0, 1.0), None),  # a court behind, and another wing before
    ],
)
def test_a_door_stands_on_the_foremost_wall_and_nothing_gapes_behind_it(depths, block):
    made = door_meshes(house(), [wall(w) for w in depths])
    front = max((w for w in depths if w < 0.3), default=0.0)
    for name in ("front/piece-1/door-1", "front/piece-1/garage-door-1"):
        own = [mesh for mesh in made if mesh.name == name]
        leaf = corners([m for m in own if m.material in ("door", "garage-door")])
        assert leaf[1][1] == pytest.approx(-front)  # the leaf begins where the wall ends
        behind = [m for m in own if corners([m])[1][1] > 1e-9 - front]
        if block is None:
            assert behind == []
        else:
            span = -corners(behind)[::-1, 1]
            assert span == pytest.approx(block)
    assert {mesh.name for mesh in made} == {"front/piece-1/door-1", "front/piece-1/garage-door-1"}


def test_walls_beside_a_door_or_turned_away_do_not_move_it():
    beside = wall(0.2, side_width=1.5)
    away = replace(wall(0.2), vertices=wall(0.2).vertices[[1, 0, 3, 2]])
    whole, moved = door_meshes(house(), []), door_meshes(house(), [beside, away])
    assert all(np.array_equal(a.vertices, b.vertices) for a, b in zip(whole, moved, strict=True))


@pytest.mark.parametrize("frame", [None, Frame(30.0, (100.0, 50.0, 7.0))])
def test_dressed_doors_stand_where_the_buildings_own_stand(frame, styles):
    own = building_scene(house())  # in the building's own frame
    dressed = house(frame=frame)
    style, blocks = styles["l-block"], building_blocks(dressed)
    scene = retarget(style, blocks, flush=True, covers=door_covers(dressed))
    scene = crowned(scene, style, dressed)
    turn = np.eye(4) if frame is None else np.array(blocks.frame)
    for name in ("front/piece-1/door-1", "front/piece-1/garage-door-1"):
        for mesh in (m for m in own.meshes if m.name == name):
            (found,) = (
                m for m in scene.meshes if (m.name, m.material) == (name, f"own-{mesh.material}")
            )
            place = mesh.vertices @ turn[:3, :3].T + turn[:3, 3]
            assert np.abs(found.vertices - place).max() < 0.02
    assert len({mesh.name for mesh in doors(scene)}) == 2
    assert {m.material for m in doors(scene)} <= set(scene.materials)


def test_the_chain_keeps_doors_and_masses_have_none(tmp_path, styles, facade_here):
    style = styles["l-block"]
    (tmp_path / "style").mkdir()
    write_style(tmp_path / "style", style.sheet, style.blocks, style.pictures)
    lines = (SAMPLES / "houses" / "split_garage.jsonl").read_text().splitlines()
    whole = json.loads(lines[0])
    mass = {key: value for key, value in whole.items() if key != "facades"}
    for name, document in (("whole", whole), ("mass", mass)):
        path, model = tmp_path / f"{name}.json", tmp_path / f"{name}.obj"
        path.write_text(json.dumps(document))
        assert facade_here("retarget", tmp_path / "style", path, "-o", model).returncode == 0
        drawn = model.read_text()
        assert ("own-garage-door" in drawn) == (name == "whole")
        assert ("own-door" in drawn) == (name == "whole")
