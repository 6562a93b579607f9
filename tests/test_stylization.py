from __future__ import annotations

import json
import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.blocks import Block, Blocks
from facade_tools.artifacts.building import Box, Building, Roof
from facade_tools.errors import InvalidInput
from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.textured import Paint, TexturedMesh
from facade_tools.stylization.atlas import painted, planned
from facade_tools.stylization.bases import building_blocks
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.framing import standard_view
from facade_tools.stylization.groups import splitting_rule
from facade_tools.stylization.model import CaptureOptions
from facade_tools.stylization.outline import wall_faces
from facade_tools.stylization.projection import texel_density
from facade_tools.stylization.remesh import slabs
from facade_tools.stylization.resizing import resized
from facade_tools.stylization.retarget import retarget
from facade_tools.stylization.roles import SeenTier, tier_roles
from facade_tools.stylization.splitting import SplitRule
from facade_tools.stylization.structure import chosen_style
from facade_tools.stylization.synthesis import synthesised

WIDTH, DEPTH, HEIGHT = 20.0, 12.0, 15.0
PIXELS = 10  # a metre


def facade_picture(width: float, height: float) -> np.ndarray:
    """Plaster with windows of 1 m × 1.5 m every 2.5 m and 3 m."""
    picture = np.full((round(height * PIXELS), round(width * PIXELS), 3), 200, dtype=np.uint8)
    for z in np.arange(0.75, height - 1.5, 3.0):
        for x in np.arange(0.75, width - 1.0, 2.5):
            top, left = round((height - z - 1.5) * PIXELS), round(x * PIXELS)
            picture[top : top + 15, left : left + 10] = (40, 50, 70)
    return picture


def textured_box(low, high, first_paint=0):
    """Four textured walls and a plain roof; no bottom."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    walls = [((x0, y0), (x1, y0)), ((x1, y0), (x1, y1)), ((x1, y1), (x0, y1)), ((x0, y1), (x0, y0))]
    vertices, faces, uv, paint, paints = [], [], [], [], []
    for i, (a, b) in enumerate(walls):
        n = len(vertices)
        vertices += [(*a, z0), (*b, z0), (*b, z1), (*a, z1)]
        faces += [(n, n + 1, n + 2), (n, n + 2, n + 3)]
        uv += [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]]
        paint += [first_paint + i] * 2
        paints.append(Paint(f"wall-{i}", picture=facade_picture(math.dist(a, b), z1 - z0)))
    n = len(vertices)
    vertices += [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)]
    faces += [(n, n + 1, n + 2), (n, n + 2, n + 3)]
    uv += [np.full((3, 2), np.nan)] * 2
    paint += [first_paint + 4] * 2
    paints.append(Paint("roof", (90, 60, 50)))
    return TexturedMesh(
        np.array(vertices, dtype=float), np.array(faces), np.array(uv, dtype=float),
        np.array(paint), tuple(paints),
    )  # fmt: skip


BOX = textured_box((0, 0, 0), (WIDTH, DEPTH, HEIGHT))


def turned(mesh, degrees, shift=(0, 0, 0)):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = mesh.vertices @ matrix.T + np.array(shift)
    return TexturedMesh(moved, mesh.faces, mesh.uv, mesh.paint, mesh.paints)


def style_of(mesh, **options):
    return capture_style(mesh, "box", CaptureOptions(**options))


@settings(deadline=None, max_examples=25)
@given(st.floats(-180, 180), st.tuples(*[st.floats(-1e6, 1e6)] * 2))
def test_the_standard_view_undoes_any_turn_and_shift(degrees, shift):
    mesh = turned(BOX, degrees, (*shift, 0.0))
    standard = standard_view(mesh)
    size = np.ptp(standard.mesh.vertices, axis=0)
    assert sorted(size) == pytest.approx(sorted((WIDTH, DEPTH, HEIGHT)), abs=1e-6)
    back = standard.mesh.vertices @ standard.frame[:3, :3].T + standard.frame[:3, 3]
    assert np.abs(back - mesh.vertices).max() < 1e-6


def test_the_front_is_where_it_is_said_to_be():
    for front, width in ((180.0, WIDTH), (90.0, DEPTH), (0.0, WIDTH), (270.0, DEPTH)):
        standard = standard_view(BOX, front)
        assert np.ptp(standard.mesh.vertices[:, 0]) == pytest.approx(width)
        assert standard.front == pytest.approx(front)


def test_y_up_is_told_by_the_textures():
    x, y, z = BOX.vertices.T
    lying = TexturedMesh(np.column_stack([x, z, -y]), BOX.faces, BOX.uv, BOX.paint, BOX.paints)
    standard = standard_view(lying)
    assert np.ptp(standard.mesh.vertices[:, 2]) == pytest.approx(HEIGHT)
    assert "y up" in standard.mesh.notes[0]


def doubled(mesh):
    faces = np.concatenate([mesh.faces, mesh.faces[:, ::-1]])
    uv = np.concatenate([mesh.uv, mesh.uv[:, ::-1]])
    return TexturedMesh(mesh.vertices, faces, uv, np.tile(mesh.paint, 2), mesh.paints)


def without_one_wall(mesh):
    return TexturedMesh(mesh.vertices, mesh.faces[2:], mesh.uv[2:], mesh.paint[2:], mesh.paints)


@pytest.mark.parametrize("dirt", [lambda mesh: mesh, doubled, without_one_wall])
def test_the_remesh_keeps_volume_and_walls(dirt):
    mesh = dirt(BOX)
    found = slabs(mesh.vertices, mesh.faces)
    assert sum(slab.area * slab.height for slab in found) == pytest.approx(WIDTH * DEPTH * HEIGHT)
    faces = [face for i, slab in enumerate(found) for face in wall_faces(slab, i)]
    assert sum(f.width * f.height for f in faces) == pytest.approx(2 * (WIDTH + DEPTH) * HEIGHT)


def test_touching_boxes_are_one_plan():
    from facade_tools.formats.textured import joined

    parts = [textured_box((0, 0, 0), (8, 8, 6), 0), textured_box((8, 2, 0), (14, 6, 6), 0)]
    mesh = joined(parts)
    found = slabs(mesh.vertices, mesh.faces)
    assert [slab.area for slab in found] == pytest.approx([64 + 24])


def test_windows_become_rules_in_metres():
    sheet = style_of(BOX).sheet
    assert sheet.resolution == pytest.approx(PIXELS)
    assert sheet.density == pytest.approx(2 * PIXELS)
    assert texel_density(BOX) == pytest.approx(PIXELS)
    rules = {rule.id: rule for rule in sheet.rules}
    groups = {group.id: rules[group.rule] for group in sheet.groups}
    front = next(wall for wall in sheet.walls if wall.side == "front").faces[0]
    columns, rows = groups[front.vertical], groups[front.horizontal]
    assert columns.b == pytest.approx([1.0] * 8, abs=0.11)
    assert columns.a[1:-1] == pytest.approx([1.5] * 7, abs=0.11)
    assert len(rows.b) == 5


def test_a_model_retargeted_onto_itself_is_itself():
    style = style_of(turned(BOX, 30, (5, 7, 2)))
    scene = retarget(style, style.blocks)
    points = np.concatenate([mesh.vertices for mesh in scene.meshes])
    original = turned(BOX, 30, (5, 7, 2)).vertices
    assert points.min(axis=0) == pytest.approx(original.min(axis=0), abs=0.02)
    assert points.max(axis=0) == pytest.approx(original.max(axis=0), abs=0.02)
    assert {mesh.name for mesh in scene.meshes} == {
        "mass",
        *(f"block-0/{side}" for side in ("front", "right", "back", "left")),
        "block-0/roof",
    }


def front_texture(style, blocks):
    """The picture on the front of the first block, cut out of the atlas."""
    scene = retarget(style, blocks)
    mesh = next(m for m in scene.meshes if m.name.endswith("/front"))
    data = np.frombuffer(scene.materials[mesh.material].texture, np.uint8)
    page = cv2.imdecode(data, cv2.IMREAD_COLOR)
    (x0, y0), (x1, y1) = mesh.uv[:4].min(axis=0), mesh.uv[:4].max(axis=0)
    h, w = page.shape[:2]
    return page[round((1 - y1) * h) : round((1 - y0) * h), round(x0 * w) : round(x1 * w)]


def window_runs(picture, metres):
    dark = (picture.mean(axis=2) < 120).any(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], dark.astype(np.int8), [0]])))
    runs = edges.reshape(-1, 2)
    return (runs[:, 1] - runs[:, 0]) * metres / picture.shape[1]


@pytest.mark.parametrize("factor", [1.0, 1.5, 2.0, 0.5])
def test_resizing_repeats_windows_and_keeps_their_width(factor):
    style = style_of(BOX, front=180.0)
    width = factor * WIDTH
    found = window_runs(
        front_texture(style, resized(style.blocks, {"block-0": (width, DEPTH, HEIGHT)})), width
    )
    assert len(found) == round(8 * factor)
    assert found == pytest.approx([1.0] * len(found), abs=0.1)


def test_what_stands_on_a_block_moves_with_it():
    blocks = Blocks(
        "x",
        (Block("a", "bottom", 0, 0, 0, 5, 5, 4, 1), Block("b", "body", 1, 1, 4, 3, 3, 9, 3)),
    )
    grown = resized(blocks, {"a": (6, 5, 6)})
    assert grown.blocks[1].z == 6
    with pytest.raises(InvalidInput, match="no block"):
        resized(blocks, {"c": (1, 1, 1)})


def tiers(*heights, broken=(), alike=()):
    plain = np.zeros(4)
    looks = [np.roll([0.5, 0.5, 0, 0], i % 4) if i not in alike else plain + 0.25
             for i in range(len(heights))]  # fmt: skip
    return [SeenTier(h, i in broken, looks[i]) for i, h in enumerate(heights)]


def test_roles_by_height_and_look():
    assert tier_roles(tiers(10), None, None) == ["body"]
    assert tier_roles(tiers(4, 20, 3), None, None) == ["bottom", "body", "top"]
    assert tier_roles(tiers(20, 18), None, None) == ["body", "body"]
    assert tier_roles(tiers(4, 20, 3), 0, 2) == ["body", "top", "top"]
    assert tier_roles(tiers(20, 5, alike=(0, 1)), None, None) == ["body", "body"]
    assert tier_roles(tiers(1, 4, 20, 5, broken=(2, 3)), None, None) == [
        *["bottom"] * 2, "body", "top",
    ]  # fmt: skip
    with pytest.raises(InvalidInput):
        tier_roles(tiers(4, 20), 2, 1)


def test_building_boxes_become_disjoint_blocks():
    roof = Roof("flat")
    building = Building(
        "b",
        (
            Box("main", "general", 5, 5, 10, 10, 6, roof),
            Box("wing", "general", 10, 5, 10, 4, 3, roof),
            Box("porch", "porch", 5, -1, 4, 2, 3, roof),
        ),
    )
    blocks = building_blocks(building).blocks
    assert sum(b.width * b.depth for b in blocks) == pytest.approx(100 + 20)
    assert {b.floors for b in blocks} == {1, 2}


@given(st.lists(st.tuples(st.integers(1, 60), st.integers(1, 60)), max_size=12))
def test_an_atlas_holds_every_picture_unharmed(sizes):
    pictures = [np.full((h, w, 3), 20 * i + 5, dtype=np.uint8) for i, (h, w) in enumerate(sizes)]
    atlas = planned([picture.shape[:2] for picture in pictures])
    pages = [painted(atlas, k, pictures.__getitem__) for k in range(len(atlas.sheets))]
    for i, picture in enumerate(pictures):
        page = pages[atlas.page[i]]
        h, w = page.shape[:2]
        x0, y0, x1, y1 = atlas.rectangles[i]
        cut = page[round((1 - y1) * h) : round((1 - y0) * h), round(x0 * w) : round(x1 * w)]
        assert np.array_equal(cut, picture)


def test_alike_styles_are_chosen_more_often():
    style = style_of(BOX)
    tall = [type(style.sheet.blocks[0])("t", "body", (2.0, 2.0, 60.0), 20)]
    rng = np.random.default_rng(0)
    target = style.blocks.blocks
    drawn = [chosen_style([style.sheet.blocks, tall], target, rng=rng) for _ in range(300)]
    assert drawn.count(0) > drawn.count(1) > 0


OBJ = """mtllib Model.mtl
v 0 0 0
v 4 0 0
v 4 0 3
v 2 0 1
v 0 0 3
vt 0 0
usemtl brick
f 1/1 2/1 3/1 4/1 5/1
f 5/1 4/1 3/1 2/1 1/1
f -5 -4 -3
"""


def test_obj_is_read_as_people_write_it(tmp_path):
    (tmp_path / "model.obj").write_text(OBJ)
    (tmp_path / "Model.mtl").write_text("newmtl brick\nKd 1 0 0\nmap_Kd -s 1 1 1 Wall Ä.png\n")
    cv2.imencode(".png", np.zeros((2, 2, 3), np.uint8))[1].tofile(tmp_path / "wall ä.PNG")
    mesh = read_textured(tmp_path / "model.obj")
    a, b, c = (mesh.vertices[mesh.faces[:-1, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(8.0)  # concave: 12 less the notch of 4
    assert mesh.paints[1].picture is not None
    assert any("stand twice" in note for note in mesh.notes)
    assert any("was found as" in note for note in mesh.notes)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("f 1 2 3\n", "x.obj:1: "),
        ("v 0 0\nf 1 1 1\n", "three finite"),
        ("v 0 0 0\n", "no faces"),
        ("v 0 0 nan\nf 1 1 1\n", "finite"),
        ("v a b c\n", "x.obj:1: "),
    ],
)
def test_bad_obj_is_refused(tmp_path, text, message):
    (tmp_path / "x.obj").write_text(text)
    with pytest.raises(InvalidInput, match=message):
        read_textured(tmp_path / "x.obj")


def test_textures_stay_inside_the_folder(tmp_path):
    (tmp_path / "secret.png").touch()
    inside = tmp_path / "model"
    inside.mkdir()
    (inside / "m.obj").write_text(OBJ.replace("Model.mtl", "m.mtl"))
    (inside / "m.mtl").write_text("newmtl brick\nmap_Kd ../secret.png\n")
    mesh = read_textured(inside / "m.obj")
    assert mesh.paints[1].picture is None
    assert any("outside" in note for note in mesh.notes)


def test_real_models_are_captured_or_refused_with_a_reason(shared_data, facade_here, tmp_path):
    folder = shared_data / "textured_buildings"
    for name in ("tecalemit_h", "robust_cube_apartment_sgi_1channel"):
        out = tmp_path / name
        done = facade_here("capture-style", folder / name / "model.obj", "-o", out)
        assert done.returncode == 0, done.stderr
        assert facade_here("validate", out / "stylesheet.json", out / "blocks.json").returncode == 0
        glb = tmp_path / f"{name}.glb"
        assert facade_here("retarget", out, out / "blocks.json", "-o", glb).returncode == 0
        assert glb.read_bytes()[:4] == b"glTF"


def test_a_tampered_sheet_is_refused(facade_here, tmp_path, shared_data):
    out = tmp_path / "style"
    source = shared_data / "textured_buildings" / "immeuble1" / "model.obj"
    assert facade_here("capture-style", source, "-o", out).returncode == 0
    path = out / "stylesheet.json"
    document = json.loads(path.read_text())
    for change in (
        lambda d: d["groups"][0].update(rule="none"),
        lambda d: d.update(roof="../../etc/passwd"),
        lambda d: d["rules"][0].update(a=[1.0] * 99),
    ):
        broken = json.loads(json.dumps(document))
        change(broken)
        path.write_text(json.dumps(broken))
        done = facade_here("retarget", out, out / "blocks.json", "-o", tmp_path / "x.glb")
        assert done.returncode == 3, done.stderr
        assert b"stylesheet.json" in done.stderr


# --- fainter windows, plain walls -----------------------------------------------------------------
def bands(*colours_and_metres, density=20):
    """A picture of horizontal bands 6 m wide, a window of the colour in its middle third."""
    rows = []
    for colour, metres in colours_and_metres:
        row = np.full((round(metres * density), 6 * density, 3), 215, dtype=np.uint8)
        row[:, 2 * density : 4 * density] = colour
        rows.append(row)
    return np.concatenate(rows)


def test_a_pale_upper_pane_belongs_to_its_window():
    """Dark panes alone are insertable in one pass; a cut between the panes would show."""
    storey = [(215, 0.7), (185, 1.0), (30, 1.0), (215, 0.3)]
    rule = splitting_rule([bands(*storey * 4)], 12.0, 1)
    assert rule.insertable == pytest.approx([2.0] * 4, abs=0.2)


def test_pale_windows_beside_a_dark_bay_are_found():
    storey = np.full((60, 400, 3), 215, dtype=np.uint8)
    storey[20:40, 190:210] = 20
    for left in (*range(20, 180, 40), *range(230, 390, 40)):
        storey[20:40, left : left + 20] = 170
    rule = splitting_rule([storey], 20.0, 0)
    assert len(rule.insertable) == 9


def test_a_wall_too_low_for_windows_shows_none():
    """What frames windows reaches into the walls between them: a plain face leaves it out."""
    picture = np.full((100, 60, 3), 200, dtype=np.uint8)
    picture[30:70, 20:40] = 20
    picture[24:30, 16:44] = 90  # a lintel wider than the window
    rules = SplitRule((1.0, 1.0), (1.0,)), SplitRule((0.9, 0.9), (3.2,))
    low = synthesised(picture, rules, (3.0, 5.0), (3.0, 1.5), 20.0)
    assert low.min() == 200
    narrow = synthesised(picture, rules, (3.0, 5.0), (0.6, 5.0), 20.0)
    assert narrow.min() == 200
