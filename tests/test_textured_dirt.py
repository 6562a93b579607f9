"""Models as people draw them: capture survives every kind of dirt, and says what it did."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest
from hypothesis import strategies as st
from test_stylization import BOX, DEPTH, HEIGHT, WIDTH, style_of, textured_box, turned

from facade_tools.errors import InvalidInput
from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.textured import Paint, TexturedMesh, joined
from facade_tools.stylization.framing import standard_view
from facade_tools.stylization.remesh import slabs
from facade_tools.stylization.retarget import retarget

VOLUME = WIDTH * DEPTH * HEIGHT


def read_damaged(path, data, most):
    """Change up to `most` bytes of a mesh file and cut it: it is refused, or read as numbers."""
    whole = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, most))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(whole[: data.draw(st.integers(1, len(whole)))]))
    try:
        mesh = read_textured(path)
    except InvalidInput:
        return
    assert np.isfinite(mesh.vertices).all()


def volume(mesh):
    """Volume of the remeshed model."""
    standard = standard_view(mesh)
    found = slabs(standard.mesh.vertices, standard.mesh.faces)
    return sum(slab.area * slab.height for slab in found)


def changed(mesh, **parts):
    values = {k: getattr(mesh, k) for k in ("vertices", "faces", "uv", "paint", "paints")}
    return TexturedMesh(**{**values, **parts})


def unwelded(mesh):
    faces = np.arange(3 * len(mesh.faces)).reshape(-1, 3)
    return changed(mesh, vertices=mesh.vertices[mesh.faces].reshape(-1, 3), faces=faces)


def four_times(mesh):
    """Each wall four times: both windings, both diagonals."""
    parts = [mesh.faces, mesh.faces[:, ::-1], mesh.faces, mesh.faces[:, [1, 2, 0]]]
    uv = np.concatenate([mesh.uv, mesh.uv[:, ::-1], mesh.uv, mesh.uv[:, [1, 2, 0]]])
    return changed(mesh, faces=np.concatenate(parts), uv=uv, paint=np.tile(mesh.paint, 4))


def flipped(mesh):
    return changed(mesh, faces=mesh.faces[:, ::-1], uv=mesh.uv[:, ::-1])


def with_slivers(mesh):
    """Triangles without area, and a vertex that nothing uses."""
    faces = np.concatenate([mesh.faces, [[0, 0, 1], [2, 2, 2]]])
    uv = np.concatenate([mesh.uv, np.zeros((2, 3, 2))])
    vertices = np.concatenate([mesh.vertices, [[1e4, 1e4, 1e4]]])
    return changed(mesh, vertices=vertices, faces=faces, uv=uv, paint=np.append(mesh.paint, [0, 0]))


def far_away(mesh):
    return turned(mesh, 0, (4.5e6, 5.8e6, 40))


@pytest.mark.parametrize(
    "dirt", [unwelded, four_times, flipped, with_slivers, far_away, lambda m: turned(m, 37.5)]
)
def test_dirt_changes_neither_volume_nor_windows(dirt):
    mesh = dirt(BOX)
    assert volume(mesh) == pytest.approx(VOLUME, rel=1e-4)
    rules = {len(rule.b) for rule in style_of(mesh).sheet.rules}
    assert 8 in rules  # windows of the long sides
    assert 5 in rules  # storeys, or windows of the short sides


def test_buildings_that_overlap_add_up():
    """Parity alone would take the overlap for outside."""
    parts = [textured_box((0, 0, 0), (20, 12, 6)), textured_box((8, 4, 0), (14, 8, 15))]
    assert volume(joined(parts)) == pytest.approx(20 * 12 * 6 + 6 * 4 * 9, rel=1e-3)


def test_buildings_apart_are_blocks_side_by_side():
    parts = [textured_box((0, 0, 0), (10, 10, 9)), textured_box((14, 0, 0), (24, 10, 9))]
    style = style_of(joined(parts))
    assert len(style.blocks.blocks) == 2
    assert sum(b.width * b.depth * b.height for b in style.blocks.blocks) == pytest.approx(1800)


def test_a_bridge_without_end_walls_is_filled():
    """The bar of an H has no walls where it meets the other bars: its roof tells."""
    bars = [textured_box((0, y, 0), (40, y + 8, 9)) for y in (0, 20)]
    middle = textured_box((16, 8, 0), (24, 20, 9))
    kept = [2, 3, 6, 7, 8, 9]
    open_ = changed(middle, faces=middle.faces[kept], uv=middle.uv[kept], paint=middle.paint[kept])
    mesh = joined([*bars, open_])
    assert volume(mesh) == pytest.approx((2 * 40 * 8 + 8 * 12) * 9, rel=1e-3)
    assert len(style_of(mesh).blocks.blocks) == 3


def test_a_courtyard_stays_open():
    parts = [
        textured_box((0, 0, 0), (30, 8, 9)), textured_box((0, 22, 0), (30, 30, 9)),
        textured_box((0, 8, 0), (8, 22, 9)), textured_box((22, 8, 0), (30, 22, 9)),
    ]  # fmt: skip
    assert volume(joined(parts)) == pytest.approx((900 - 14 * 14) * 9, rel=1e-3)


def test_below_ground_counts_and_overhangs_need_no_soffit():
    deep = turned(BOX, 0, (0, 0, -4))
    assert volume(deep) == pytest.approx(VOLUME)
    parts = [textured_box((2, 2, 0), (18, 10, 5)), textured_box((0, 0, 5), (20, 12, 15))]
    assert volume(joined(parts)) == pytest.approx(16 * 8 * 5 + 20 * 12 * 10, rel=1e-3)


def test_repeated_pictures_are_unrolled():
    """One bay drawn eight times by uv 0…8 has the period of the bay."""
    tile = np.full((30, 25, 3), 200, dtype=np.uint8)
    tile[8:23, 8:18] = (40, 50, 70)
    paints = tuple(Paint("tile", picture=tile) for _ in BOX.paints)
    mesh = changed(BOX, uv=BOX.uv * np.array([8.0, 5.0]), paints=paints)
    style = style_of(mesh, front=180.0)
    wall = next(w for w in style.sheet.walls if w.side == "front")
    rule = {r.id: r for r in style.sheet.rules}[wall.faces[0].vertical]
    assert len(rule.b) == 8
    assert rule.b == pytest.approx([1.0] * 8, abs=0.15)


def test_pictures_upside_down_do_not_turn_the_model_over():
    uv = BOX.uv.copy()
    uv[:, :, 1] = 1 - uv[:, :, 1]
    standard = standard_view(changed(BOX, uv=uv))
    assert np.ptp(standard.mesh.vertices[:, 2]) == pytest.approx(HEIGHT)


def write_box(folder, name="wand é 壁.png", picture=None):
    """An OBJ of a box with one texture; returns its path."""
    folder.mkdir()
    lines = ["mtllib möbel.mtl"]
    lines += [f"v {x} {y} {z}" for z in (0, 9) for x, y in ((0, 0), (12, 0), (12, 8), (0, 8))]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "usemtl wall"]
    walls = [(1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8), (5, 6, 7, 8)]
    lines += ["f " + " ".join(f"{v}/{k}" for k, v in enumerate(wall, 1)) for wall in walls]
    (folder / "haus ü.obj").write_text("\n".join(lines), encoding="utf-8")
    (folder / "möbel.mtl").write_text(f"newmtl wall\nKd 0.8 0.2 0.1\nmap_Kd {name}\n")
    if picture is not None:
        (folder / name).write_bytes(picture)
    return folder / "haus ü.obj"


def png():
    picture = np.full((90, 120, 3), 180, np.uint8)
    picture[30:60, 20:100:30] = 30
    return cv2.imencode(".png", picture)[1].tobytes()


def test_names_need_not_be_ascii(tmp_path):
    mesh = read_textured(write_box(tmp_path / "a", picture=png()))
    assert mesh.paints[1].picture is not None
    assert not mesh.notes


@pytest.mark.parametrize(
    ("picture", "word"), [(None, "missing"), (b"no picture", "drawn"), (png()[:200], "drawn")]
)
def test_lost_textures_are_said_and_drawn_plain(tmp_path, facade, picture, word):
    path = write_box(tmp_path / "a", picture=picture)
    assert any(word in note for note in read_textured(path).notes)
    done = facade("capture-style", path, "-o", tmp_path / "style")
    assert done.returncode == 0, done.stderr
    assert word.encode() in done.stderr


def test_inches_and_y_up(tmp_path, facade):
    path = write_box(tmp_path / "a", picture=png())
    text = path.read_text(encoding="utf-8")
    lying = [
        "v {} {} {}".format(*(float(v) / 0.0254 for v in (x, z, f"-{y}")))
        for x, y, z in (line.split()[1:] for line in text.splitlines() if line.startswith("v "))
    ]
    rest = [line for line in text.splitlines() if not line.startswith("v ")]
    path.write_text("\n".join([*lying, *rest]), encoding="utf-8")
    out = tmp_path / "style"
    assert facade("capture-style", path, "--unit", "in", "-o", out).returncode == 0
    blocks = (out / "blocks.json").read_text()
    assert '"height": 9.0' in blocks or '"height": 9,' in blocks
    assert facade("validate", out / "stylesheet.json").returncode == 0


def test_many_formats_tell_the_same_house(tmp_path):
    import trimesh

    path = write_box(tmp_path / "a", picture=png())
    scene = trimesh.load_scene(path)
    y_up = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])
    scene.apply_transform(y_up)
    scene.export(tmp_path / "house.glb")
    mesh = read_textured(tmp_path / "house.glb")
    assert volume(mesh) == pytest.approx(12 * 8 * 9)
    assert mesh.paints[0].picture is not None
    trimesh.load_mesh(path).export(tmp_path / "house.ply")
    assert volume(read_textured(tmp_path / "house.ply")) == pytest.approx(12 * 8 * 9)


@pytest.mark.parametrize(
    "data", [b"", b"\x00" * 64, b"glTF" + struct.pack("<II", 2, 9999), b"ply\n"]
)
@pytest.mark.parametrize("ending", [".glb", ".ply", ".dae", ".obj"])
def test_garbage_is_refused(tmp_path, data, ending):
    (tmp_path / f"x{ending}").write_bytes(data)
    with pytest.raises(InvalidInput):
        read_textured(tmp_path / f"x{ending}")


def test_a_pitched_roof_is_measured_and_round_towers_are_refused():
    roof = [(0, 0, 15), (20, 0, 15), (20, 12, 15), (0, 12, 15), (4, 6, 20), (16, 6, 20)]
    faces = [(0, 1, 5), (0, 5, 4), (2, 3, 4), (2, 4, 5), (1, 2, 5), (3, 0, 4)]
    slope = TexturedMesh(np.array(roof, float), np.array(faces), np.full((6, 3, 2), np.nan),
                         np.zeros(6, np.int64), (Paint("roof"),))  # fmt: skip
    sheet = style_of(joined([BOX, slope])).sheet
    assert 0.05 < sheet.lost < 0.4
    assert any("approximated" in note for note in sheet.notes)
    angle = np.linspace(0, 2 * np.pi, 33)[:-1]
    ring = np.stack([5 * np.cos(angle), 5 * np.sin(angle)], axis=1)
    points = np.concatenate([np.c_[ring, np.zeros(32)], np.c_[ring, np.full(32, 20.0)]])
    k, n = np.arange(32), (np.arange(32) + 1) % 32
    walls = np.concatenate([np.stack([k, n, n + 32], 1), np.stack([k, n + 32, k + 32], 1)])
    tower = TexturedMesh(points, walls, np.full((64, 3, 2), np.nan), np.zeros(64, np.int64),
                         (Paint("wall"),))  # fmt: skip
    with pytest.raises(InvalidInput, match="Manhattan"):
        style_of(tower)


def test_dirty_models_give_closed_solids():
    parts = [textured_box((0, 0, 0), (20, 12, 6)), textured_box((8, 4, 0), (14, 8, 15))]
    style = style_of(four_times(joined(parts)))
    body = next(m for m in retarget(style, style.blocks).meshes if m.name == "mass")
    edges = np.sort(body.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()


def test_collada_is_read_quietly(tmp_path, capfd):
    """Nothing of COLLADA reading reaches standard error by itself."""
    import trimesh

    path = write_box(tmp_path / "a", picture=png())
    data = trimesh.exchange.dae.export_collada(trimesh.load_mesh(path))
    lost = data.replace(b"<library_images>", b"<library_images><image id='x'><init_from>lost.png"
                        b"</init_from></image>")  # fmt: skip
    (tmp_path / "house.dae").write_bytes(lost)
    mesh = read_textured(tmp_path / "house.dae")
    assert np.ptp(mesh.vertices, axis=0).max() == pytest.approx(12)
    assert capfd.readouterr().err == ""
