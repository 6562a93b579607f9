"""Retargeting: blocks side by side, storeys, bases, closed solids, the same bytes."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_stylization import BOX, style_of, textured_box

from facade_tools.artifacts.blocks import Block, Blocks
from facade_tools.artifacts.design import Canvas
from facade_tools.artifacts.layout import Layout, LayoutShape
from facade_tools.formats.style_folder import write_style
from facade_tools.formats.textured import joined
from facade_tools.imaging.image_io import decoded
from facade_tools.stylization.bases import layout_blocks, with_ends
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.drawing import sheet_picture
from facade_tools.stylization.model import CaptureOptions
from facade_tools.stylization.placing import placed_blocks
from facade_tools.stylization.resizing import resized
from facade_tools.stylization.retarget import retarget

SAMPLES = Path(__file__).parent.parent / "sample_data" / "textured"
NAMES = sorted(path.name for path in SAMPLES.iterdir())


def volume(blocks):
    return sum(b.width * b.depth * b.height for b in blocks.blocks)


def solid_volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6


def closed(mesh):
    """Whether every edge is run along once in each direction."""
    edges = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forth = {(a, b) for a, b in edges.tolist()}
    return len(forth) == len(edges) and all((b, a) in forth for a, b in forth)


# --- structure ------------------------------------------------------------------------------------
def test_sample_buildings_have_the_structure_they_were_drawn_with(styles):
    roles = {name: [b.role for b in style.blocks.blocks] for name, style in styles.items()}
    assert roles["corner-house"] == ["bottom", "body", "top"]
    assert roles["stepped-tower"] == ["bottom", "body", "body", "top"]
    assert roles["l-block"] == ["body"] * 2
    assert roles["u-court"] == ["bottom"] * 3 + ["body"] * 3
    assert volume(styles["l-block"].blocks) == pytest.approx((33 * 11 + 12 * 16) * 18)
    assert volume(styles["u-court"].blocks) == pytest.approx((40 * 12 + 2 * 11 * 16) * 13)


# --- onto itself, and onto others -----------------------------------------------------------------
@pytest.mark.parametrize("name", NAMES)
def test_every_scene_has_its_closed_mass(styles, name):
    for base in (styles[name].blocks, styles["u-court"].blocks):
        body = retarget(styles[name], base).meshes[0]
        assert body.name == "mass"
        assert closed(body)
        assert solid_volume(body) == pytest.approx(volume(base), rel=0.02)


def test_faces_between_wings_are_hidden_until_a_wing_stands_alone(styles):
    style = styles["l-block"]
    whole = retarget(style, style.blocks)
    area = sum(wall_area(mesh) for mesh in whole.meshes if "/" in mesh.name)
    assert area == pytest.approx((33 + 27) * 2 * 18 + 33 * 11 + 12 * 16, rel=1e-2)
    alone = retarget(style, replace(style.blocks, blocks=style.blocks.blocks[1:]))
    sides = {mesh.name.split("/")[1] for mesh in alone.meshes if "/" in mesh.name}
    assert sides == {"front", "right", "back", "left", "roof"}


def wall_area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_storeys_are_inserted_not_stretched():
    """Six storeys with a ledge each, to a house half as high again: nine storeys."""
    parts = []
    for k in range(6):
        parts.append(textured_box((0, 0, 3 * k), (16, 10, 3 * k + 2.4)))
        parts.append(textured_box((0.4, 0.4, 3 * k + 2.4), (15.6, 9.6, 3 * k + 3)))
    style = style_of(joined(parts))
    assert len(style.blocks.blocks) == 1
    own = style.blocks.blocks[0]
    for height, storeys in ((18, 6), (27, 9), (12, 4), (28, 9)):
        target = replace(style.blocks, blocks=(replace(own, height=height),))
        placed = placed_blocks(style.sheet, style.blocks, target)[0]
        assert len(placed.storeys) == 2 * storeys
        heights = [s.top - s.bottom for s in placed.storeys]
        assert heights[::2] == pytest.approx([2.4 * height / (3 * storeys)] * storeys)
        assert placed.storeys[-1].top == pytest.approx(own.z + height)


def test_storeys_of_a_model_that_is_not_in_metres_are_inserted():
    parts = []
    for k in range(6):
        parts.append(textured_box((0, 0, 1.5 * k), (8, 5, 1.5 * k + 1.2)))
        parts.append(textured_box((0.4, 0.4, 1.5 * k + 1.2), (7.6, 4.6, 1.5 * k + 1.5)))
    style = style_of(joined(parts))
    own = style.blocks.blocks[0]
    target = replace(style.blocks, blocks=(replace(own, height=13.5),))
    assert len(placed_blocks(style.sheet, style.blocks, target)[0].storeys) == 18


def test_sign_boards_and_mouldings_are_no_storeys():
    """Two boards of 0.8 m with a joint of 0.2 m each, on a wall that grows to its double."""
    levels = [(0, 3.4), (0.3, 0.2), (0.15, 0.8), (0.3, 0.2), (0.15, 0.8), (0, 4.6)]
    parts, z = [], 0.0
    for inset, height in levels:
        low, high = (inset, inset, z), (16 - inset, 10 - inset, z + height)
        parts.append(textured_box(low, high))
        z += height
    style = style_of(joined(parts))
    own = max(style.blocks.blocks, key=lambda block: block.height)
    target = replace(style.blocks, blocks=(replace(own, height=20.0),))
    floors = [floor for floor in style.sheet.floors if floor.block == own.id]
    assert len(floors) > 4
    placed = placed_blocks(style.sheet, style.blocks, target)[0].storeys
    assert len(placed) == len(floors)
    before = np.array([floor.top - floor.bottom for floor in floors])
    after = np.array([storey.top - storey.bottom for storey in placed])
    boards = before < 2
    assert after[boards] == pytest.approx(before[boards])
    assert after.sum() == pytest.approx(20)
    stretch = after[~boards] / before[~boards]
    assert stretch == pytest.approx(stretch[0])
    lower = replace(style.blocks, blocks=(replace(own, height=6.0),))
    squeezed = placed_blocks(style.sheet, style.blocks, lower)[0].storeys
    heights = np.array([storey.top - storey.bottom for storey in squeezed])
    assert heights == pytest.approx(before * 6 / before.sum())


# --- bases ----------------------------------------------------------------------------------------
def test_resizing_keeps_neighbours_together(styles):
    blocks = styles["l-block"].blocks
    first = blocks.blocks[0]
    wide = {first.id: (first.width + 9, first.depth + 6, first.height)}
    before, after = blocks.blocks, resized(blocks, wide).blocks
    overlap = [
        min(a.x + a.width, b.x + b.width) - max(a.x, b.x) > 1e-6
        and min(a.y + a.depth, b.y + b.depth) - max(a.y, b.y) > 1e-6
        for a, b in (after[:2],)
    ]
    assert overlap == [False]
    assert after[0].width == first.width + 9
    assert after[1].width == before[1].width


def test_set_backs_stay_in_place_when_all_grow(styles):
    blocks = styles["stepped-tower"].blocks
    double = {b.id: (2 * b.width, 2 * b.depth, b.height) for b in blocks.blocks}
    grown = resized(blocks, double).blocks
    middles = {(b.x + b.width / 2, b.y + b.depth / 2) for b in grown}
    assert len({(round(x, 6), round(y, 6)) for x, y in middles}) == 1


def test_plain_bases_get_the_bottom_and_top_of_the_style(styles):
    plain = Blocks("b", (Block("main", "body", 0, 0, 0, 20, 12, 30, 10),))
    ends = with_ends(plain, styles["corner-house"].blocks)
    assert [(b.role, b.height) for b in ends.blocks] == [
        ("bottom", 4.0), ("body", 23.5), ("top", 2.5),
    ]  # fmt: skip
    low = Blocks("b", (Block("main", "body", 0, 0, 0, 20, 12, 6, 2),))
    assert with_ends(low, styles["corner-house"].blocks) == low
    given_roles = styles["stepped-tower"].blocks
    assert with_ends(given_roles, styles["corner-house"].blocks) is given_roles


def test_a_layout_is_a_house_front_with_its_bays():
    shapes = (
        LayoutShape("bay", ("A", "B"), 2.0, 0.0, 6.0, 8.0, 1.2),
        LayoutShape("sill", ("A", "B"), 8.0, 1.0, 9.0, 1.2, 0.2),
        LayoutShape("hidden", ("A", "B"), 8.0, 0.0, 12.0, 9.0, 2.0, visible=False),
    )
    blocks = layout_blocks(Layout("front", Canvas(12.0, 9.0), {}, {}, shapes)).blocks
    assert [b.id for b in blocks] == ["canvas", "bay-0"]
    assert (blocks[1].y, blocks[1].depth, blocks[1].height) == (-1.2, 1.2, 8.0)


def test_several_styles_and_the_same_bytes_again(facade, facade_here, styles, tmp_path):
    for name in ("corner-house", "u-court"):
        style = styles[name]
        (tmp_path / name).mkdir()
        write_style(tmp_path / name, style.sheet, style.blocks, style.pictures)
    block = {"role": "body", "x": 0, "y": 0, "z": 0, "width": 18, "depth": 9, "height": 9}
    blocks = [block | {"id": "a", "floors": 3}]
    base = {"schema": "facade-tools/blocks/1", "id": "b", "blocks": blocks}
    (tmp_path / "b.json").write_text(json.dumps(base))
    first, second = tmp_path / "corner-house", tmp_path / "u-court"
    base = tmp_path / "b.json"
    one = ("retarget", first, base, "--styles", first, "--styles", second)
    other = ("retarget", first, base, "--styles", first, second)
    for run, command, words in (("1", facade, one), ("2", facade_here, other)):
        done = command(*words, "--seed", "3", "-o", tmp_path / run / "b.glb")  # 1: a new process
        assert done.returncode == 0, done.stderr
    none = facade_here("retarget", first, "--styles", first, second, "-o", tmp_path / "c.glb")
    assert none.returncode == 2
    assert (tmp_path / "1/b.glb").read_bytes() == (tmp_path / "2/b.glb").read_bytes()


def test_a_sheet_is_drawn_with_and_without_its_files(styles, tmp_path):
    style = styles["u-court"]
    write_style(tmp_path, style.sheet, style.blocks, style.pictures)
    alone, whole = sheet_picture(style.sheet), sheet_picture(style.sheet, tmp_path)
    assert whole.shape[1] == alone.shape[1]
    assert whole.shape[0] > 1.3 * alone.shape[0]  # the model and the signal too
    assert np.array_equal(sheet_picture(style.sheet, tmp_path / "nowhere"), alone)


GOLDEN = Path(__file__).parent / "golden" / "styles"


@pytest.mark.parametrize("name", ["corner-house", "l-block"])
def test_bytes_of_sample_styles(facade_here, tmp_path, name, update_golden):
    """The sheets of the samples; refreshed by `make golden` with --update-golden."""
    out = tmp_path / name
    done = facade_here("capture-style", SAMPLES / name / "model.obj", "-o", out)
    assert done.returncode == 0, done.stderr
    for part in ("stylesheet.json", "blocks.json"):
        golden = GOLDEN / f"{name}.{part}"
        if update_golden:
            golden.parent.mkdir(exist_ok=True)
            golden.write_bytes((out / part).read_bytes())
        assert (out / part).read_bytes() == golden.read_bytes(), "changed: review, `make golden`"


def test_samples_are_made_again_byte_for_byte(tmp_path):
    script = SAMPLES.parent / "make_textured.py"
    subprocess.run([sys.executable, script, "--out", tmp_path], check=True, timeout=60)
    made = {p.relative_to(tmp_path): p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    kept = {p.relative_to(SAMPLES): p.read_bytes() for p in SAMPLES.rglob("*") if p.is_file()}
    assert made == kept
    assert sum(len(data) for data in kept.values()) < 1_000_000


OUTWARDS = {"front": (0, -1), "right": (1, 0), "back": (0, 1), "left": (-1, 0)}


@pytest.mark.parametrize("name", NAMES)
def test_walls_face_outwards(styles, name):
    for mesh in retarget(styles[name], replace(styles[name].blocks, frame=None)).meshes:
        side = mesh.name.split("/")[1] if "/" in mesh.name else ""
        if side in OUTWARDS:
            a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
            normals = np.cross(b - a, c - a)[:, :2]
            assert (normals @ np.array(OUTWARDS[side]) > 0).all()


def test_what_no_page_can_hold_goes_on_several_in_full_resolution(styles, monkeypatch):
    style = styles["l-block"]
    whole = retarget(style, style.blocks)
    for module in ("atlas", "retarget"):
        monkeypatch.setattr(f"facade_tools.stylization.{module}.LARGEST_PAGE", 256)
    monkeypatch.setattr("facade_tools.stylization.atlas.USUAL_HEIGHT", 256)
    tiled = retarget(style, style.blocks)
    areas = [sum(wall_area(mesh) for mesh in s.meshes if "/" in mesh.name) for s in (whole, tiled)]
    assert areas[0] == pytest.approx(areas[1])
    assert sum(name.startswith("atlas") for name in tiled.materials) > 4
    for mesh in (m for m in tiled.meshes if m.material.startswith("atlas")):
        page = decoded(tiled.materials[mesh.material].texture, "page")
        assert max(page.shape) <= 256
        texels = mesh.uv[mesh.faces] * np.array(page.shape[1::-1])
        (ux, uy), (vx, vy) = (np.moveaxis(texels[:, k] - texels[:, 0], -1, 0) for k in (1, 2))
        share = 0.5 * np.abs(ux * vy - uy * vx).sum() / wall_area(mesh)
        assert share == pytest.approx((2 * style.sheet.resolution) ** 2, rel=0.05)


def test_thickness_of_walls_can_be_given():
    sheet = capture_style(BOX, "x", CaptureOptions(thickness=0.6)).sheet
    found = [wall.thickness.inner - wall.thickness.outer for wall in sheet.walls]
    assert found == pytest.approx([0.6] * 4)


def test_the_front_of_a_court_is_its_open_side(styles):
    """The walls inside the court face left and right, but nobody sees them from there."""
    assert styles["u-court"].sheet.front == 180.0
