"""Parses to textured buildings: elevation, texture synthesis, and `facade reconstruct`."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from facade_tools.artifacts.building import Building
from facade_tools.artifacts.parse import LABELS, Floor, ImageInfo, Parse, Region
from facade_tools.artifacts.store import read, read_one
from facade_tools.artifacts.writing import write_artifacts
from facade_tools.errors import InvalidInput
from facade_tools.formats import gltf
from facade_tools.geometry.checks import building_problems
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.elevation import building_lines, elevation, label_map, stretched
from facade_tools.reconstruction.engine import Lot
from facade_tools.reconstruction.facets import faceted
from facade_tools.reconstruction.reconstruct import Ask, reconstruct
from facade_tools.reconstruction.surfaces import (
    Canvas,
    _exemplars,
    largest_rectangle,
    without_rim,
)
from facade_tools.reconstruction.texture_synthesis import cheapest_cut, joined, quilted
from facade_tools.reconstruction.widening import widened

from .judges import khronos_issues

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
WIDTH, HEIGHT, UNIT = 120, 170, 10  # pixels, and pixels a metre


def rng():
    return item_generator(0, "test")


def regions(windows=True, roof=True):
    """Sky 20 rows, roof 30 with two dormers, three floors of 30, shops and a door in 30."""
    rows = [Region("sky", 0, 0, WIDTH, 20), Region("wall", 0, 50, WIDTH, HEIGHT)]
    rows.append(Region("roof" if roof else "sky", 0, 20, WIDTH, 50))
    if windows:
        for y in (60, 90, 120):
            rows += [Region("window", x, y, x + 12, y + 18) for x in (14, 54, 94)]
        rows.append(Region("balcony", 0, 102, WIDTH, 110))
    if roof and windows:
        rows += [Region("window", x, 28, x + 12, 42) for x in (30, 80)]
        rows.append(Region("chimney", 100, 5, 112, 20))
    rows += [Region("door", 52, 145, 68, HEIGHT), Region("shop", 75, 145, 115, HEIGHT)]
    return tuple(rows)


def parsed(**more):
    # Later regions lie on top, as in label maps; a real parse's regions tile its picture.
    floors = tuple(Floor("FL", y, y + 30, (0, WIDTH)) for y in (50, 80, 110, 140))
    info = ImageInfo("facade.png", (WIDTH, HEIGHT), "0" * 64)
    values = {"regions": regions(), "floors": floors, **more}
    return Parse("facade", info, IDENTITY, "m", "s", "g", "", 0.0, (WIDTH, HEIGHT), **values)


def picture():
    noise = rng().integers(-12, 13, (HEIGHT, WIDTH, 3))
    base = np.full((HEIGHT, WIDTH, 3), (205, 190, 155)) + noise
    base[:20], base[20:50] = (150, 190, 230), (90, 95, 105)
    labels = label_map(parsed())
    base[labels == 1] = (40, 50, 60)
    return np.clip(base, 0, 255).astype(np.uint8)


def solid_of(scene):
    mass = scene.meshes[0]
    assert mass.name == "mass"
    return trimesh.Trimesh(mass.vertices, mass.faces, process=False)


# --- elevation ------------------------------------------------------------------------------------
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


def test_a_picture_that_shows_no_opening_is_warned_of(caplog):
    rows = tuple(r for r in regions(windows=False) if r.label not in ("door", "shop"))
    reconstruct(parsed(regions=rows), picture(), rng=rng())
    assert "facade: shows neither window nor door" in caplog.text
    caplog.clear()
    reconstruct(parsed(), picture(), rng=rng())
    assert not caplog.text


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


# --- textures -------------------------------------------------------------------------------------
def test_the_cheapest_cut_is_the_cheapest_of_all():
    cost = rng().random((5, 4))
    path = cheapest_cut(cost)
    assert (np.abs(np.diff(path)) <= 1).all()
    paths = [[]]
    for _ in range(5):
        paths = [[*p, c] for p in paths for c in range(4) if not p or abs(p[-1] - c) <= 1]
    best = min(sum(cost[row, c] for row, c in enumerate(p)) for p in paths)
    assert cost[np.arange(5), path].sum() == pytest.approx(best)


def test_quilts_hold_the_exemplars_colours_and_repeat():
    exemplar = np.zeros((40, 40, 3), np.uint8)
    exemplar[::2] = 200
    quilt = quilted([exemplar], (64, 48), 16, rng=rng())
    assert quilt.shape == (64, 48, 3)
    assert abs(float(quilt.mean()) - 100.0) < 15.0
    plain = quilted([np.full((9, 9, 3), 77, np.uint8)], (32, 32), 16, rng=rng())
    assert (plain == 77).all()


def test_joined_tiles_keep_their_middles():
    tiles = [np.full((6, 20, 3), value, np.uint8) for value in (10, 100, 200)]
    strip = joined(tiles, 3)
    assert strip.shape == (6, 3 * 14, 3)
    assert [int(strip[0, 14 * k + 7, 0]) for k in range(3)] == [10, 100, 200]


def test_the_largest_rectangle_of_free_pixels():
    free = np.zeros((20, 30), bool)
    assert largest_rectangle(free) == (0, 0, 0, 0)
    free[3:9, 10:25] = True
    free[9:20, 2:4] = True
    assert largest_rectangle(free) == (3, 10, 9, 25)


# --- buildings ------------------------------------------------------------------------------------
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


# --- walls of other widths ------------------------------------------------------------------------
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


def test_dormers_at_the_picture_s_edge_show_the_photograph():
    edge = tuple(Region("window", x, 28, x + 12, 42) for x in (0, WIDTH - 12))
    made = reconstruct(parsed(regions=regions() + edge), picture(), rng=rng())
    assert {"glass", "trim"}.isdisjoint(mesh.material for mesh in made.scene().meshes)


def test_exemplars_of_a_roof_hold_no_frames_of_its_dormers():
    """White frames stand around every dormer and the sky looks in; both are labelled roof."""
    slate = rng().normal((70, 80, 100), 6, (60, 200, 3)).clip(0, 255).astype(np.uint8)
    slate[:6] = (170, 200, 240)
    for x in range(20, 200, 45):
        slate[20:44, x : x + 14] = 245
    labels = np.full(slate.shape[:2], LABELS.index("roof"), np.uint8)
    found = list(_exemplars(Canvas(slate, labels, (20.0, 20.0)), LABELS.index("roof")))
    assert len(found) == 4
    assert max(int(exemplar.max()) for exemplar in found) < 150


def test_the_rim_of_a_rectified_picture_is_filled():
    shown = picture()
    assert without_rim(shown) is shown
    rimmed = shown.copy()
    rimmed[:, :20], rimmed[-12:] = 0, 128
    whole = without_rim(rimmed)
    assert not (whole[:, :15].max(axis=2) < 14).any()
    assert not (np.abs(whole[-10:].astype(int) - 128).max(axis=2) < 6).all()
    assert np.array_equal(whole[:140, 40:], shown[:140, 40:])
    assert without_rim(np.zeros((40, 40, 3), np.uint8)).max() == 0
