"""Colours of other people's meshes: which picture, which part of it, tints, holes, vertices."""

from __future__ import annotations

import base64
import json
import struct

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_stylization import BOX, style_of, turned
from test_textured_dirt import changed, read_damaged

from facade_tools.errors import InvalidInput
from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.textured import GREY, Paint, TexturedMesh, gradients, joined
from facade_tools.stylization.projection import texel_density

RED, GREEN, BLUE, WHITE = (200, 0, 0), (0, 200, 0), (0, 0, 200), (250, 250, 250)
# a picture of four quarters as seen on the wall: red and green above, blue and white below
QUARTERS = np.repeat(np.repeat(np.array([[RED, GREEN], [BLUE, WHITE]], np.uint8), 8, 0), 8, 1)
WALL = [(0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3)]  # z up, seen from the front
UV = [(0, 0), (1, 0), (1, 1), (0, 1)]


def png(picture=QUARTERS):
    return cv2.imencode(".png", picture[:, :, [2, 1, 0, 3][: picture.shape[2]]])[1].tobytes()


def colour(mesh, x, z):
    """The colour of the wall at a place, and the name of its paint."""
    for t, face in enumerate(mesh.faces):
        corners = mesh.vertices[face][:, [0, 2]]
        weights = np.linalg.solve(np.vstack([corners.T, np.ones(3)]), [x, z, 1])
        if weights.min() >= 0:
            paint = mesh.paints[mesh.paint[t]]
            if paint.picture is None:
                return paint.color
            u, v = weights @ mesh.uv[t]
            h, w = paint.picture.shape[:2]
            row, column = int((1 - v) % 1 * h), int(u % 1 * w)
            return tuple(paint.picture[row, column].tolist())
    raise AssertionError("no wall there")


def quarters(mesh):
    """The colours in the middles of the wall's four quarters, row by row."""
    return [colour(mesh, x, z) for z in (2.2, 0.8) for x in (1, 3)]


ALL = [RED, GREEN, BLUE, WHITE]


# --- OBJ and MTL ----------------------------------------------------------------------------------
def obj(folder, uv=UV, mtl="map_Kd wall.png", obj_lines="mtllib m.mtl", tab=" ", more=""):
    lines = [obj_lines]
    lines += [tab.join(["v", *map(str, p)]) + more for p in WALL]
    lines += [tab.join(["vt", *map(str, p)]) for p in uv] + ["usemtl wall"]
    (folder / "m.mtl").write_text(f"newmtl wall\nKd 0 0 0.5\n\t{mtl}\n")
    (folder / "wall.png").write_bytes(png())
    lines += [tab.join(["f", "1/1", "2/2", "3/3", "4/4"])]
    (folder / "m.obj").write_text("\n".join(lines))
    return read_textured(folder / "m.obj")


@pytest.mark.parametrize(
    "how",
    [
        {},
        {"tab": "\t"},
        {"mtl": "map_Kd\twall.png"},
        {"mtl": 'map_kd -blendu on -texres 512 -mm 0 1 "wall.png"'},
        {"mtl": "map_Kd -s 2 2 1 wall.png", "uv": [(u / 2, v / 2) for u, v in UV]},
        {"mtl": "map_Kd -o 0.25 wall.png", "uv": [(u - 0.25, v) for u, v in UV]},
        {"mtl": "map_Kd -o 0.25 -0.5 wall.png", "uv": [(u - 0.25, v + 0.5) for u, v in UV]},
        {"obj_lines": "mtllib other.mtl m.mtl"},
        {"uv": [(u + 5, v - 3) for u, v in UV]},
    ],
)
def test_textures_of_obj_are_found_and_placed(tmp_path, how):
    (tmp_path / "other.mtl").write_text("newmtl roof\n")
    mesh = obj(tmp_path, **how)
    assert quarters(mesh) == ALL
    assert not mesh.notes


def test_colours_behind_vertices_of_obj_count_where_no_texture_does(tmp_path):
    colours = " 1 0 0"
    assert quarters(obj(tmp_path, more=colours)) == ALL
    assert quarters(obj(tmp_path, more=colours, mtl="Ns 1")) == [(255, 0, 0)] * 4
    assert quarters(obj(tmp_path, mtl="Ns 1")) == [(0, 0, 128)] * 4
    assert any("no texture" in note for note in obj(tmp_path, mtl="Ns 1").notes)


# --- PLY ------------------------------------------------------------------------------------------
def ply(folder, vertex=(), face=(), textures=(), uv=False, colours=WALL):
    """Two triangles; vertex, face: names of further bytes, `colours` of each in turn."""
    head = ["ply", "format ascii 1.0", *(f"comment TextureFile {name}" for name in textures)]
    head += ["element vertex 4", *(f"property float {a}" for a in "xyz")]
    head += [f"property uchar {c}" for c in vertex]
    head += ["element face 2", "property list uchar int vertex_indices"]
    head += ["property list uchar float texcoord", "property int texnumber"] * uv
    head += [f"property uchar {c}" for c in face]
    rows = [
        " ".join(map(str, [*p, *(colours[k] if vertex else ())])) for k, p in enumerate(WALL)
    ]  # fmt: skip
    for k, ring in enumerate([(0, 1, 2), (0, 2, 3)]):
        places = [6, *(c for corner in ring for c in UV[corner]), k] if uv else []
        rows.append(" ".join(map(str, [3, *ring, *places, *(colours[k] if face else ())])))
    (folder / "x.ply").write_text("\n".join([*head, "end_header", *rows]))
    return read_textured(folder / "x.ply")


RGB = ("red", "green", "blue")


def test_every_face_of_a_ply_has_its_own_texture(tmp_path):
    for name, picture in (("a.png", QUARTERS), ("b.png", 255 - QUARTERS)):
        (tmp_path / name).write_bytes(png(picture))
    mesh = ply(tmp_path, textures=("a.png", "b.png"), uv=True)
    assert colour(mesh, 3, 0.8) == WHITE  # the lower triangle
    assert colour(mesh, 1, 2.2) == tuple(255 - c for c in RED)


def test_colours_of_faces_and_vertices_of_a_ply(tmp_path):
    by_face = ply(tmp_path, face=RGB, colours=[RED, BLUE])
    assert (colour(by_face, 3, 0.8), colour(by_face, 1, 2.2)) == (RED, BLUE)
    assert not by_face.notes
    by_vertex = ply(tmp_path, vertex=RGB, colours=[RED, RED, BLUE, BLUE])
    low, high = colour(by_vertex, 2, 0.1), colour(by_vertex, 2, 2.9)
    assert low[0] > low[2]
    assert high[0] < high[2]


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.integers(0, 2**32))
def test_gradients_are_linear_and_apart(count, seed):
    faces = np.random.default_rng(seed).integers(60, 120, (count, 3, 3)).astype(np.uint8)
    paint, uv = gradients(faces)
    h, w = paint.picture.shape[:2]
    places = uv * [w, h] * [1, -1] + [0, h] - 0.5
    assert np.allclose(places, np.round(places), atol=1e-9)
    column, row = np.round(places).astype(int).transpose(2, 0, 1)
    assert (paint.picture[row, column] == faces).all()


def test_colours_of_corners_do_not_make_a_picture_coarse():
    paint, uv = gradients(np.full((2, 3, 3), 90, np.uint8))
    points = np.array(WALL, dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = TexturedMesh(points, faces, uv, np.zeros(2, np.int64), (paint,))
    assert texel_density(mesh) == 16


# --- holes ----------------------------------------------------------------------------------------
def rail(alpha):
    """Bars of 0.3 m before the front of the box; what is between them has this alpha."""
    picture = np.zeros((300, 2000, 4), np.uint8)
    picture[:, :, 3] = alpha
    picture[::100, :, 3] = 255
    corners = np.array([(0, -0.4, 3), (20, -0.4, 3), (20, -0.4, 6), (0, -0.4, 6)], float)
    uv = np.array(UV, float)[[[0, 1, 2], [0, 2, 3]]]
    holes = picture[:, :, 3] < 128
    paint = Paint("rail", GREY, picture[:, :, :3].copy(), holes if alpha < 128 else None)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return TexturedMesh(corners, faces, uv, np.zeros(2, np.int64), (paint,))


def front_mean(mesh):
    style = style_of(mesh, front=180.0)
    faces = [f for wall in style.sheet.walls if wall.side == "front" for f in wall.faces]
    seen = [style.pictures[f.texture].mean() for f in faces if f.bottom >= 3 and f.top <= 6.01]
    return float(np.mean(seen))


def test_one_sees_the_wall_through_a_railing():
    assert front_mean(joined([BOX, rail(0)])) > 100
    assert front_mean(joined([BOX, rail(255)])) < 5


def test_an_alpha_channel_behind_which_nothing_stands_changes_nothing():
    def holed(paint):
        if paint.picture is None:
            return paint
        holes = paint.picture.mean(axis=2) < 128
        return Paint(paint.name, paint.color, paint.picture, holes)

    style = style_of(BOX)
    same = style_of(changed(BOX, paints=tuple(map(holed, BOX.paints))))
    for name, picture in style.pictures.items():
        assert (picture == same.pictures[name]).all(), name


# --- glTF -----------------------------------------------------------------------------------------
def gltf(folder, change=None, uv=UV, picture=None, binary=False, extra=()):
    """The wall as glTF; change: does something to the document; extra: further accessors."""
    points = np.array([(x, z, -y) for x, y, z in WALL], "<f4")
    places = np.array([(u, 1 - v) for u, v in uv], "<f4")
    index = np.array([0, 1, 2, 0, 2, 3], "<u2")
    image = png() if picture is None else picture
    data, views, accessors = b"", [], []
    for values, kind in ((points, "VEC3"), (places, "VEC2"), (index, "SCALAR"), *extra):
        codes = {"f4": 5126, "u2": 5123, "u1": 5121}
        accessor = {"bufferView": len(views), "componentType": codes[values.dtype.str[1:]]}
        accessors.append(accessor | {"count": len(values), "type": kind})
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        data += values.tobytes() + bytes(-values.nbytes % 4)
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(image)})
    data += image + bytes(-len(image) % 4)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "accessors": accessors, "bufferViews": views,
        "meshes": [{"primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"name": "wall", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"bufferView": len(views) - 1}],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    if not binary:
        head = "data:application/octet-stream;base64,"
        document["buffers"][0]["uri"] = head + base64.b64encode(data).decode()
    if change:
        change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    path = folder / ("m.glb" if binary else "m.gltf")
    if binary:
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
        text = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
    path.write_bytes(text)
    return path


def primitive(document):
    return document["meshes"][0]["primitives"][0]


def base(document):
    return document["materials"][0]["pbrMetallicRoughness"]


@pytest.mark.parametrize("binary", [False, True])
def test_a_wall_of_gltf(tmp_path, binary):
    mesh = read_textured(gltf(tmp_path, binary=binary))
    assert quarters(mesh) == ALL
    assert mesh.vertices == pytest.approx(np.array(WALL, float))
    assert not mesh.notes


def test_textures_of_gltf_are_placed_as_their_transform_says(tmp_path):
    def transformed(document):
        more = {"offset": [0.5, 0.25], "scale": [2, 0.5], "rotation": np.pi / 2}
        base(document)["baseColorTexture"]["extensions"] = {"KHR_texture_transform": more}
        document["extensionsRequired"] = ["KHR_texture_transform"]

    # what the specification's own matrices (translation, rotation, scale) make of a place
    c, s = np.cos(np.pi / 2), np.sin(np.pi / 2)
    matrix = np.array([[1, 0, 0.5], [0, 1, 0.25], [0, 0, 1]])
    matrix = matrix @ [[c, s, 0], [-s, c, 0], [0, 0, 1]] @ np.diag([2, 0.5, 1])
    wanted = np.array([(u, 1 - v, 1) for u, v in UV]).T  # in the picture
    given_ = (np.linalg.inv(matrix) @ wanted)[:2].T
    mesh = read_textured(gltf(tmp_path, transformed, uv=[(u, 1 - v) for u, v in given_.tolist()]))
    assert quarters(mesh) == ALL


def test_a_texture_of_gltf_takes_the_coordinates_that_it_names(tmp_path):
    def second(document):
        base(document)["baseColorTexture"]["texCoord"] = 1
        primitive(document)["attributes"] |= {"TEXCOORD_0": 3, "TEXCOORD_1": 1}

    nothing = np.zeros((4, 2), "<f4")
    mesh = read_textured(gltf(tmp_path, second, extra=[(nothing, "VEC2")]))
    assert quarters(mesh) == ALL


def test_a_factor_tints_the_texture_in_linear_light(tmp_path):
    path = gltf(tmp_path, lambda d: base(d).update(baseColorFactor=[0.5, 1, 0.0, 1]))
    red, green, blue, white = quarters(read_textured(path))
    assert (red, green, blue) == ((146, 0, 0), GREEN, (0, 0, 0))
    assert white == (184, 250, 0)


def test_colours_of_vertices_of_gltf(tmp_path):
    def painted(document):
        primitive(document)["attributes"]["COLOR_0"] = 3
        document["accessors"][3]["normalized"] = True
        del primitive(document)["material"]

    colours = np.tile(np.array([255, 0, 55, 255], "u1"), (4, 1))
    mesh = read_textured(gltf(tmp_path, painted, extra=[(colours, "VEC4")]))
    assert quarters(mesh) == [(255, 0, 128)] * 4


@pytest.mark.parametrize(("mode", "expected"), [("OPAQUE", False), ("MASK", True), ("BLEND", True)])
def test_holes_of_gltf_count_where_the_material_says_so(tmp_path, mode, expected):
    alpha = np.dstack([QUARTERS, np.full(QUARTERS.shape[:2], 255, np.uint8)])
    alpha[:4, :4, 3] = 0
    path = gltf(tmp_path, lambda d: d["materials"][0].update(alphaMode=mode), picture=png(alpha))
    paint = read_textured(path).paints[0]
    assert (paint.holes is not None) == expected
    if expected:
        assert paint.holes[:4, :4].all()
        assert paint.holes.sum() == 16


def test_strips_sparse_places_and_nodes_in_nodes(tmp_path):
    def odd(document):
        primitive(document).update(mode=5)
        document["accessors"][2]["count"] = 4
        document["nodes"] = [
            {"children": [1], "scale": [2, 1, 1]},
            {"mesh": 0, "translation": [-1, 0, 0], "rotation": [0, 0, 0, 1]},
        ]
        where = {"bufferView": 3, "componentType": 5123}
        document["accessors"][0]["sparse"] = {
            "count": 1, "indices": where, "values": {"bufferView": 4}
        }  # fmt: skip

    extra = [(np.array([0], "<u2"), "SCALAR"), (np.array([(1, 0, 0)], "<f4"), "VEC3")]
    path = gltf(tmp_path, odd, extra=extra)
    document = json.loads(path.read_text())
    data = bytearray(base64.b64decode(document["buffers"][0]["uri"].split(",")[1]))
    start = document["bufferViews"][2]["byteOffset"]
    data[start : start + 8] = struct.pack("<4H", 1, 2, 0, 3)
    head = "data:application/octet-stream;base64,"
    document["buffers"][0]["uri"] = head + base64.b64encode(data).decode()
    path.write_text(json.dumps(document))
    mesh = read_textured(path)
    assert mesh.faces.tolist() == [[1, 2, 0], [3, 0, 2]]
    assert mesh.vertices[:, 0].tolist() == [0, 6, 6, -2]  # the first was moved by one


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]), "draco"),
        (lambda d: d["buffers"][0].update(uri="../secret.bin"), "outside"),
        (lambda d: d["buffers"][0].update(uri="data:;base64,AAAA"), "ends too early"),
        (lambda d: d["nodes"][0].update(children=[0]), "hold themselves"),
        (lambda d: d["accessors"][2].update(componentType=5121), ""),
        (lambda d: d["accessors"][0].update(count=10**12), "values"),
        (lambda d: d.update(meshes=[]), "IndexError"),
        (lambda d: primitive(d).update(mode=1), "no faces"),
    ],
)
def test_bad_gltf_is_refused_with_its_file(tmp_path, change, expected):
    path = gltf(tmp_path, change)
    if not expected:  # an index of another width still names vertices
        read_textured(path)
        return
    with pytest.raises(InvalidInput, match=f"m.gltf: .*{expected}"):
        read_textured(path)


@pytest.mark.parametrize("address", ["../wall.png", "lost.png", "data:image/png;base64,AAAA"])
def test_lost_pictures_of_gltf_are_said_once(tmp_path, address):
    (tmp_path / "wall.png").write_bytes(png())
    (tmp_path / "m").mkdir()
    mesh = read_textured(gltf(tmp_path / "m", lambda d: d.update(images=[{"uri": address}])))
    assert mesh.paints[0].color == GREY
    assert mesh.paints[0].picture is None
    assert len(mesh.notes) == 2  # the picture, and that there is no other


def test_many_plain_parts_are_one_note(tmp_path):
    def plain(document):
        bare = [{"pbrMetallicRoughness": {}} for _ in range(9)]
        document["materials"] += bare
        every = [primitive(document) | {"material": k} for k in range(10)]
        document["meshes"][0]["primitives"] = every

    mesh = read_textured(gltf(tmp_path, plain))
    assert mesh.notes == ("9 of 10 materials have no texture: drawn in their plain colours",)


@settings(max_examples=80, deadline=None)
@given(st.data())
def test_a_damaged_gltf_is_refused_or_read(tmp_path_factory, data):
    path = gltf(tmp_path_factory.mktemp("gltf"), binary=True)
    read_damaged(path, data, 4)


def test_a_turned_model_of_colours_is_captured():
    paint, uv = gradients(np.full((len(BOX.faces), 3, 3), (180, 90, 40), np.uint8))
    numbers = np.zeros(len(BOX.faces), np.int64)
    style = style_of(turned(changed(BOX, uv=uv, paint=numbers, paints=(paint,)), 30))
    assert all(np.allclose(p.mean(axis=(0, 1)), (180, 90, 40), atol=1) for p in
               style.pictures.values())  # fmt: skip
