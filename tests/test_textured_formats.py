"""PLY and COLLADA with concave polygons, SGI pictures: read by our own readers, never fanned.

STL and OFF, which hold triangles alone.
"""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from test_textured_dirt import png, read_damaged

from facade_tools.errors import InvalidInput
from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.textured import GREY
from facade_tools.imaging.image_io import decoded

# a U in plan as one concave polygon, and a wall under it; uv is the place on the plan over 10
PLAN = [(0, 0), (10, 0), (10, 8), (7, 8), (7, 3), (3, 3), (3, 8), (0, 8)]
POINTS = np.array([(x, y, z) for z in (6, 0) for x, y in PLAN], dtype=np.float64)
RINGS = [list(range(8)), [8, 9, 1, 0], [9, 10, 2], [9, 2, 1]]
AREA = (10 * 8 - 4 * 5) + 10 * 6 + 8 * 6


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def check(mesh):
    """The area of a fan would be larger; every corner keeps its own texture coordinates."""
    assert area(mesh) == pytest.approx(AREA)
    corners = mesh.vertices[mesh.faces]
    assert mesh.uv == pytest.approx(corners[:, :, :2] / 10)
    assert mesh.paints[mesh.paint[0]].picture is not None
    assert not mesh.notes


def ply(encoding, at):
    """The model as PLY; at: where texture coordinates stand, "vertex" or "face"."""
    header = ["ply", f"format {encoding} 1.0", "comment TextureFile wand.PNG", "element vertex 16"]
    header += [f"property float {name}" for name in ("x", "y", "z", *"st"[: 2 * (at == "vertex")])]
    header += ["element face 4", "property list uchar int vertex_indices"]
    header += ["property list uchar float texcoord"] * (at == "face") + ["property uchar flags"]
    order = ">" if "big" in encoding else "<"
    body, text = b"", []
    for point in POINTS.tolist():
        row = [*point, point[0] / 10, point[1] / 10][: 5 if at == "vertex" else 3]
        body += struct.pack(f"{order}{len(row)}f", *row)
        text.append(" ".join(map(str, row)))
    for ring in RINGS:
        uv = [v / 10 for k in ring for v in POINTS[k, :2]] if at == "face" else []
        body += struct.pack(f"{order}B{len(ring)}i", len(ring), *ring)
        body += struct.pack(f"{order}B{len(uv)}f", len(uv), *uv) if uv else b""
        body += b"\x07"
        text.append(" ".join(map(str, [len(ring), *ring, *([len(uv), *uv] if uv else []), 7])))
    head = ("\n".join([*header, "end_header"]) + "\n").encode()
    return head + ("\n".join(text).encode() if encoding == "ascii" else body)


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("at", ["vertex", "face"])
def test_concave_polygons_of_ply_are_not_fanned(tmp_path, encoding, at):
    (tmp_path / "wand.png").write_bytes(png())  # named in another case
    (tmp_path / "x.ply").write_bytes(ply(encoding, at))
    mesh = read_textured(tmp_path / "x.ply")
    assert any("found as" in note for note in mesh.notes)
    (tmp_path / "x.ply").write_bytes(ply(encoding, at).replace(b"wand.PNG", b"wand.png"))
    mesh = read_textured(tmp_path / "x.ply")
    places = mesh.vertices[mesh.faces][:, :, :2] / 10
    assert mesh.uv == pytest.approx(places, abs=1e-6)
    assert area(mesh) == pytest.approx(AREA)
    assert mesh.paints[0].picture is not None
    assert not mesh.notes


def test_colours_of_vertices_paint_a_ply(tmp_path):
    lines = ["ply", "format ascii 1.0", "element vertex 3"]
    lines += [f"property float {a}" for a in "xyz"]
    lines += [f"property uchar {c}" for c in ("red", "green", "blue")]
    lines += ["element face 1", "property list uchar int vertex_index", "end_header"]
    lines += ["0 0 0 200 100 0", "1 0 0 200 100 0", "0 0 1 200 100 30", "3 0 1 2"]
    (tmp_path / "x.ply").write_text("\n".join(lines))
    mesh = read_textured(tmp_path / "x.ply")
    assert mesh.paints[mesh.paint[0]].color == (200, 100, 10)
    assert mesh.paints[mesh.paint[0]].picture.shape == (2, 2, 3)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["ascii", "binary_little_endian"]), st.data())
def test_a_damaged_ply_is_refused_or_read(tmp_path_factory, encoding, data):
    path = tmp_path_factory.mktemp("ply") / "x.ply"
    path.write_bytes(ply(encoding, "face"))
    read_damaged(path, data, 3)


@pytest.mark.parametrize("line", ["v nan 0 1", "v 1 inf 0", "v 1 2"])
def test_a_vertex_that_is_no_point_is_refused_with_its_line(tmp_path, line):
    path = tmp_path / "x.obj"
    path.write_text(f"v 0 0 0\n{line}\nv 1 1 1\nf 1 2 3\n")
    with pytest.raises(InvalidInput, match=f"{path}:2: vertices need three finite"):
        read_textured(path)


def test_a_ply_that_is_not_finite_is_refused_with_its_file(tmp_path):
    path = tmp_path / "x.ply"
    lines = ["ply", "format ascii 1.0", "element vertex 3"]
    lines += [f"property float {a}" for a in "xyz"]
    lines += ["element face 1", "property list uchar int vertex_index", "end_header"]
    path.write_text("\n".join([*lines, "0 0 0", "1 nan 0", "0 0 1", "3 0 1 2"]))
    with pytest.raises(InvalidInput, match=f"{path}: .*finite"):
        read_textured(path)


DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="inch" meter="0.0254"/><up_axis>Z_UP</up_axis></asset>
<library_images><image id="i"><init_from>{image}</init_from></image></library_images>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="t"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="c"><lambert><diffuse><texture texture="t" texcoord="UV"/></diffuse></lambert>
</technique></profile_COMMON></effect></library_effects>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="48">{points}</float_array><technique_common>
<accessor source="#pa" count="16" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="u"><float_array id="ua" count="32">{places}</float_array><technique_common>
<accessor source="#ua" count="16" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{faces}
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><translate>100 0 0</translate>
<instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="brick" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#w"/></scene></COLLADA>"""
INPUTS = """<input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#u" offset="1" set="0"/>"""
CORNERS = [" ".join(f"{k} {k}" for k in ring) for ring in RINGS]
KINDS = {
    "polylist": f'<polylist material="brick" count="4">{INPUTS}<vcount>8 4 3 3</vcount>'
    f"<p>{' '.join(CORNERS)}</p></polylist>",
    "polygons": f'<polygons material="brick" count="4">{INPUTS}'
    + "".join(f"<p>{ring}</p>" for ring in CORNERS)
    + "</polygons>",
}


def collada(kind, image="wand.png"):
    numbers = [" ".join(map(str, array.ravel())) for array in (POINTS / 0.0254, POINTS[:, :2] / 10)]
    return DAE.format(image=image, points=numbers[0], places=numbers[1], faces=KINDS[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_concave_polygons_of_collada_are_not_fanned(tmp_path, kind):
    (tmp_path / "wand.png").write_bytes(png())
    (tmp_path / "x.dae").write_text(collada(kind))
    mesh = read_textured(tmp_path / "x.dae")
    assert mesh.vertices[:, 0].min() == pytest.approx(2.54)  # the node's translation
    vertices = mesh.vertices - np.array([2.54, 0, 0])
    check(type(mesh)(vertices, mesh.faces, mesh.uv, mesh.paint, mesh.paints, mesh.notes))


@pytest.mark.parametrize(
    "address",
    [
        "WAND.PNG",
        "./wand.png",
        "file:///C:/maya/wand.png",
        "C:\\tex\\wand.png",
        "/home/me/wand.png",
    ],
)
def test_pictures_of_collada_are_found_beside_it(tmp_path, address):
    (tmp_path / "wand.png").write_bytes(png())
    (tmp_path / "x.dae").write_text(collada("polylist", address))
    assert read_textured(tmp_path / "x.dae").paints[0].picture is not None


def test_entities_and_lost_pictures_of_collada(tmp_path):
    (tmp_path / "x.dae").write_text(collada("polylist"))
    assert any("missing" in note for note in read_textured(tmp_path / "x.dae").notes)
    bomb = collada("polylist").replace("<COLLADA", '<!DOCTYPE x [<!ENTITY a "a">]><COLLADA', 1)
    (tmp_path / "x.dae").write_text(bomb)
    with pytest.raises(InvalidInput, match="entities"):
        read_textured(tmp_path / "x.dae")


# --- SGI ------------------------------------------------------------------------------------------
def packed_row(row, wide):
    """A row as runs: repeated values, and literals between them."""
    out, at = [], 0
    while at < len(row):
        run = 1
        while at + run < len(row) and run < 127 and row[at + run] == row[at]:
            run += 1
        out += [run, int(row[at])] if run > 1 else [129, int(row[at])]
        at += run
    out.append(0)
    if wide == 1:
        return bytes(out)
    values = iter(out)
    body = b""
    for code in values:
        body += struct.pack(">H", code)
        if code & 127:
            body += bytes([next(values), 99])
    return body


def sgi(picture, wide, packed):
    """A picture (h, w, c) as SGI."""
    h, w, c = picture.shape
    head = struct.pack(">HBBHHHH", 474, packed, wide, 3 if c > 1 else 2, w, h, c).ljust(512, b"\0")
    rows = [picture[::-1][y, :, z] for z in range(c) for y in range(h)]
    if not packed:
        pad = (lambda row: bytes(row)) if wide == 1 else (lambda row: bytes(np.c_[row, row]))
        return head + b"".join(pad(row) for row in rows)
    bodies = [packed_row(row, wide) for row in rows]
    starts = 512 + 8 * len(rows) + np.cumsum([0, *map(len, bodies)])[:-1]
    table = np.concatenate([starts, [len(body) for body in bodies]]).astype(">u4").tobytes()
    return head + table + b"".join(bodies)


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("wide", [1, 2])
@pytest.mark.parametrize("is_packed", [False, True])
def test_sgi_pictures_are_read(channels, wide, is_packed):
    picture = np.random.default_rng(channels).integers(0, 3, (5, 300, channels)).astype(np.uint8)
    found = decoded(sgi(picture, wide, is_packed), "x.rgb")
    assert np.array_equal(found, picture[:, :, :3] if channels > 2 else picture[:, :, [0, 0, 0]])


def test_sgi_pictures_agree_with_pillow():
    picture = np.random.default_rng(0).integers(0, 256, (9, 14, 3)).astype(np.uint8)
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="SGI")
    assert np.array_equal(decoded(file.getvalue(), "x.sgi"), picture)
    again = Image.open(io.BytesIO(sgi(picture, 1, True)), formats=["SGI"])
    assert np.array_equal(np.asarray(again), picture)


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_damaged_sgi_is_refused_or_read(data):
    picture = np.arange(120, dtype=np.uint8).reshape(4, 10, 3) // 7
    whole = bytearray(sgi(picture, data.draw(st.integers(1, 2)), data.draw(st.booleans())))
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(2, len(whole) - 1))] = data.draw(st.integers(0, 255))
    try:
        found = decoded(bytes(whole[: data.draw(st.integers(4, len(whole)))]), "x.rgb")
    except InvalidInput:
        return
    assert found.dtype == np.uint8


@pytest.mark.parametrize("ending", [".stl", ".off", ".STL"])
def test_triangles_alone_are_read_closed_and_in_grey(tmp_path, ending):
    path = tmp_path / f"box{ending}"
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    data = box.export(file_type=ending[1:].lower())
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    mesh = read_textured(path)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(24.0)
    assert [paint.color for paint in mesh.paints] == [GREY]
    assert any("no texture" in note for note in mesh.notes)


@pytest.mark.parametrize(("name", "data"), [
    ("x.stl", b""), ("x.stl", b"solid x\nendsolid x\n"), ("x.stl", b"\0" * 80 + b"\xff" * 4),
    ("x.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"), ("x.off", b"OFF\n"),
    ("x.off", b"\xff\xfe"),
    ("x.off", b"OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n"),
])  # fmt: skip
def test_triangles_that_are_none_are_refused_with_their_file(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InvalidInput, match=str(path)):
        read_textured(path)
