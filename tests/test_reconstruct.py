"""Parses to textured buildings: `facade reconstruct`."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from facade_tools.artifacts.building import Building
from facade_tools.artifacts.parse import Region
from facade_tools.artifacts.store import read, read_one
from facade_tools.artifacts.writing import write_artifacts
from facade_tools.errors import InvalidInput
from facade_tools.formats import gltf
from facade_tools.geometry.checks import building_problems
from facade_tools.reconstruction.engine import Lot
from facade_tools.reconstruction.reconstruct import Ask, reconstruct

from .judges import khronos_issues
from .parsed_facade import WIDTH, parsed, picture, regions, rng, solid_of


@pytest.fixture(scope="module")
def made():
    return reconstruct(parsed(), picture(), rng=rng())


def test_the_mass_is_closed_and_holds_everything(made):
    scene = made.scene()
    solid = solid_of(scene)
    assert solid.is_volume
    low, high = solid.bounds
    np.testing.assert_allclose(low, [-6.0, -6.0, 0.0], atol=1e-6)
    assert high[2] == pytest.approx(16.5)  # the chimney
    names = {mesh.name.split("/")[0] for mesh in scene.meshes}
    assert {"mass", "front", "back", "left", "right"} <= names
    assert {mesh.material for mesh in scene.meshes} >= {"photo", "front", "side", "roof-tile"}


def test_windows_stand_back_and_balconies_out(made):
    front = [mesh for mesh in made.scene().meshes if mesh.material == "front"]
    depths = np.concatenate([mesh.vertices[:, 1] for mesh in front if "-window" in mesh.name])
    assert depths.max() > -5.9
    out = min(mesh.vertices[:, 1].min() for mesh in made.scene().meshes)
    assert out == pytest.approx(-6.7, abs=0.02)


def test_the_photograph_lies_where_the_wall_is(made):
    for mesh in made.scene().meshes:
        if mesh.material == "front" and mesh.name.startswith("front/F"):
            assert mesh.uv is not None
            expected = np.column_stack([
                (mesh.vertices[:, 0] + 6.0) / 12.0, mesh.vertices[:, 2] / 15.0
            ])  # fmt: skip
            np.testing.assert_allclose(mesh.uv, expected, atol=1e-6)


def test_the_building_is_sound_and_knows_its_front(made):
    building = made.building()
    assert list(building_problems(building)) == []
    assert not building.partial
    front = [e for piece in building.facades["front"].pieces for e in piece.elements]
    assert sum(e.kind == "window" for e in front) == 9
    assert sum(e.main for e in front) == 1
    assert all(e.known for e in front)
    back = [e for piece in building.facades["back"].pieces for e in piece.elements]
    assert len(back) >= 8
    assert not any(e.known for e in back)
    assert building.boxes[0].roof.style == "mansard"


def test_without_a_door_the_building_is_partial():
    rows = tuple(r for r in regions() if r.label != "door")
    building = reconstruct(parsed(regions=rows), picture(), rng=rng()).building()
    assert building.partial
    assert list(building_problems(building)) == []


@pytest.mark.parametrize("roof", ["flat", "gable", "hip", "mansard"])
def test_roofs_party_walls_and_depths(roof):
    ask = Ask(depth=8.0, roof=roof, party=frozenset(["left", "right"]))
    scene = reconstruct(parsed(), picture(), (), ask, rng=rng()).scene()
    solid = solid_of(scene)
    assert solid.is_volume
    assert solid.bounds[1][1] == pytest.approx(4.0)
    assert not any("left/" in mesh.name and "window" in mesh.name for mesh in scene.meshes)


def test_footprints_of_several_heights():
    low = Lot([np.array([[-10.0, 0.0], [-6.0, 0.0], [-6.0, 6.0], [-10.0, 6.0]])], 6.0)
    high = Lot([np.array([[-6.0, 0.0], [12.0, 0.0], [9.0, 9.0], [-6.0, 9.0]])], 15.0)
    made = reconstruct(parsed(), picture(), [low, high], rng=rng())
    assert made.plan.width == pytest.approx(18.0)
    assert made.plan.eaves == pytest.approx(15.0)
    scene = made.scene()
    assert solid_of(scene).is_volume
    # Where the two volumes meet, only the wall above the lower one is seen.
    windows = [m.vertices for m in scene.meshes if "left/" in m.name and "window" in m.name]
    inner = [v for v in windows if np.allclose(v[:, 0], -6.0, atol=0.2) and v[:, 1].max() < 5.9]
    assert inner
    assert all(v[:, 2].max() > 6.0 for v in inner)
    assert list(building_problems(made.building())) == []


def test_the_validator_finds_nothing(made):
    issues = khronos_issues(gltf.write([made.scene()], "x"))
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:3]


def test_another_picture_is_refused():
    with pytest.raises(InvalidInput, match="30×20 pixels"):
        reconstruct(parsed(), np.zeros((20, 30, 3), np.uint8), rng=rng())


def test_a_picture_that_shows_no_opening_is_warned_of(caplog):
    rows = tuple(r for r in regions(windows=False) if r.label not in ("door", "shop"))
    reconstruct(parsed(regions=rows), picture(), rng=rng())
    assert "facade: shows neither window nor door" in caplog.text
    caplog.clear()
    reconstruct(parsed(), picture(), rng=rng())
    assert not caplog.text


def test_dormers_at_the_picture_s_edge_show_the_photograph():
    edge = tuple(Region("window", x, 28, x + 12, 42) for x in (0, WIDTH - 12))
    made = reconstruct(parsed(regions=regions() + edge), picture(), rng=rng())
    assert {"glass", "trim"}.isdisjoint(mesh.material for mesh in made.scene().meshes)


# --- the command ----------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """Two random facades with their pictures beside them."""
    import sys
    from pathlib import Path
    from subprocess import run

    folder = tmp_path_factory.mktemp("rendered")
    script = Path(sys.executable).with_name("facade")
    run([script, "sample-grammar", "haussmann-floors", "-n", "2", "-o", folder / "parses.jsonl",
         "--pictures", folder], check=True)  # fmt: skip
    return folder


def test_the_command_makes_models_and_buildings(facade_here, rendered, tmp_path):
    parses = rendered / "parses.jsonl"
    done = facade_here("reconstruct", parses, "-o", tmp_path / "models")
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in (tmp_path / "models").iterdir()) == ["0-0.glb", "0-1.glb"]
    data = facade_here("reconstruct", parses, "-o", tmp_path / "b.jsonl", "--jobs", 2,
                       "--tree", tmp_path / "t.jsonl")  # fmt: skip
    assert data.returncode == 0, data.stderr
    for name in ("b.jsonl", "t.jsonl"):
        assert facade_here("validate", tmp_path / name).returncode == 0
    piped = facade_here("reconstruct", parses)
    assert piped.stdout == (tmp_path / "b.jsonl").read_bytes()
    building = json.loads((tmp_path / "b.jsonl").read_text().splitlines()[0])
    assert [row["name"] for row in building["provenance"]["inputs"]] == ["parses.jsonl", "0-0.png"]


def test_objects_bring_their_textures(facade_here, rendered, tmp_path):
    first = (rendered / "parses.jsonl").read_text().splitlines()[0]
    (tmp_path / "one.json").write_text(first)
    missing = facade_here("reconstruct", tmp_path / "one.json", "-o", tmp_path / "x.glb")
    assert missing.returncode == 3
    assert b"name it with --image" in missing.stderr
    done = facade_here("reconstruct", tmp_path / "one.json", "--image", rendered,
                       "-o", tmp_path / "x.obj")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "x.mtl").read_text().count("map_Kd") >= 4
    style = facade_here("capture-style", tmp_path / "x.obj", "-o", tmp_path / "style")
    assert style.returncode == 0, style.stderr
    drawn = facade_here("view", tmp_path / "x.obj", "-o", tmp_path / "x.png", "--size", "80x60")
    assert drawn.returncode == 0


def test_a_parse_on_a_buildings_mass(facade_here, rendered, tmp_path):
    (tmp_path / "parse.jsonl").write_text((rendered / "parses.jsonl").read_text().splitlines()[0])
    first = facade_here("reconstruct", tmp_path / "parse.jsonl", "--image", rendered,
                        "-o", tmp_path / "a.json")  # fmt: skip
    assert first.returncode == 0, first.stderr
    second = facade_here("reconstruct", tmp_path / "parse.jsonl", "--image", rendered,
                         "--footprint", tmp_path / "a.json", "-o", tmp_path / "b.json")  # fmt: skip
    assert second.returncode == 0, second.stderr
    one, two = (read_one(str(tmp_path / name), "building") for name in ("a.json", "b.json"))
    assert [replace(box, roof=None) for box in one.boxes] == [
        replace(box, roof=None) for box in two.boxes
    ]


def test_of_several_footprints_each_parse_takes_its_own(facade_here, rendered, tmp_path):
    first = facade_here("reconstruct", rendered / "parses.jsonl", "-o", tmp_path / "a.jsonl")
    assert first.returncode == 0, first.stderr
    houses = list(read(tmp_path / "a.jsonl", Building))
    mine = [replace(houses[1], boxes=(replace(houses[1].boxes[0], depth=9.0),)),
            replace(houses[0], id="unseen")]  # fmt: skip
    write_artifacts(tmp_path / "plots.jsonl", mine)
    done = facade_here("reconstruct", rendered / "parses.jsonl", "--footprint",
                       tmp_path / "plots.jsonl", "--on-error", "skip",
                       "-o", tmp_path / "b.jsonl")  # fmt: skip
    assert done.returncode == 3
    assert b"parses.jsonl:1: none of 2 footprints has the parse's id '0-0'" in done.stderr
    (made,) = read(tmp_path / "b.jsonl", Building)
    assert (made.id, made.boxes[0].depth) == ("0-1", 9.0)
