"""Formats: what is written is read back the same, by us and by others."""

from __future__ import annotations

import copy
import io
import json
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from facade_tools.artifacts.building import Roof
from facade_tools.artifacts.footprint import Footprint
from facade_tools.artifacts.store import read
from facade_tools.errors import InvalidInput
from facade_tools.formats import cityjson, gltf, obj, png
from facade_tools.formats.city import building_model, footprint_model
from facade_tools.formats.cityjson import CityModel, reference_url
from facade_tools.formats.exporting import model_files, placed
from facade_tools.formats.meshes import read_scene
from facade_tools.geometry.details import building_scene
from facade_tools.geometry.mesh import Material, Mesh, Scene

from .judges import cityjson_errors, khronos_issues, solid_faults

ROOT = Path(__file__).resolve().parent.parent
HOUSES = sorted((ROOT / "sample_data" / "houses").glob("*.jsonl"))


@pytest.fixture(scope="module")
def houses():
    """One sample house of each style."""
    return [next(iter(read([str(path)], "building"))) for path in HOUSES]


def triangle(name="tri", material="red", uv=None):
    vertices = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 3.0)])
    return Mesh(name, vertices, np.array([[0, 1, 2]]), material, uv)


def textured():
    picture = np.zeros((2, 2, 3), np.uint8)
    picture[0, 0] = 255
    materials = {
        "red": Material("red", "#ff0000", opacity=0.5),
        "tex": Material("tex", "#ffffff", texture=png.write(picture)),
    }
    uv = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    return Scene("t", (triangle(), triangle("other", "tex", uv)), materials)


# --- glTF -----------------------------------------------------------------------------------------


def document_of(data):
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON"
    return json.loads(data[20 : 20 + size])


def test_glb_is_y_up_with_names_and_identity_transforms():
    document = document_of(gltf.write([textured()], "t"))
    names = [node["name"] for node in document["nodes"]]
    assert names == ["tri", "other", "t"]
    assert [mesh["name"] for mesh in document["meshes"]] == ["tri", "other"]
    assert not any(key in node for node in document["nodes"] for key in ("matrix", "rotation"))
    position = document["accessors"][0]
    assert (position["min"], position["max"]) == ([0.0, 0.0, -2.0], [1.0, 3.0, 0.0])


def test_glb_materials_are_linear_and_textured():
    document = document_of(gltf.write([textured()], "t"))
    red, tex = document["materials"]
    assert red["pbrMetallicRoughness"]["baseColorFactor"] == [1.0, 0.0, 0.0, 0.5]
    assert red["alphaMode"] == "BLEND"
    assert tex["pbrMetallicRoughness"]["baseColorTexture"] == {"index": 0}
    assert document["images"][0]["mimeType"] == "image/png"


def test_parts_of_one_name_become_one_mesh_of_several_primitives():
    scene = textured()
    scene = Scene("s", (scene.meshes[0], triangle("tri", "tex", np.zeros((3, 2)))), scene.materials)
    document = document_of(gltf.write([scene], "s"))
    (mesh,) = document["meshes"]
    assert [row["material"] for row in mesh["primitives"]] == [0, 1]


def test_several_scenes_are_prefixed_and_equal_materials_shared():
    one, two = textured(), Scene("u", textured().meshes, textured().materials)
    document = document_of(gltf.write([one, two], "both"))
    assert len(document["materials"]) == 2
    assert [node["name"] for node in document["nodes"]][:3] == ["t/tri", "t/other", "t"]
    assert document["scenes"] == [{"name": "both", "nodes": [2, 5]}]


def test_an_empty_model_is_still_a_file():
    document = document_of(gltf.write([Scene("void", ())], "void"))
    assert "buffers" not in document
    assert document_of(gltf.write([], "none"))["scenes"] == [{"name": "none"}]


def test_trimesh_reads_the_same_mass_from_glb_and_obj(houses, tmp_path):
    scene = building_scene(houses[-1])
    (mass,) = (mesh for mesh in scene.meshes if mesh.name == "mass")
    glb = trimesh.load(io.BytesIO(gltf.write([scene], "x")), file_type="glb")
    read_back = glb.geometry["mass"]
    assert read_back.is_volume
    volume = trimesh.Trimesh(mass.vertices, mass.faces).volume
    assert read_back.volume == pytest.approx(volume, rel=1e-5)
    assert "mass" in glb.graph.nodes_geometry
    for name, data in obj.write([scene], "x").items():
        (tmp_path / name).write_bytes(data)
    wavefront = trimesh.load(tmp_path / "x.obj", split_object=True, group_material=False)
    assert any(
        part.is_volume and part.volume == pytest.approx(volume, rel=1e-6)
        for part in wavefront.geometry.values()
    )


def test_writing_is_deterministic_and_leaves_its_input_alone(houses):
    scene = building_scene(houses[0])
    before = copy.deepcopy([mesh.vertices for mesh in scene.meshes])
    for form in ("glb", "obj"):
        assert model_files([scene], "x", form) == model_files([scene], "x", form)
    assert all(map(np.array_equal, before, [mesh.vertices for mesh in scene.meshes]))


def test_khronos_validator_finds_nothing(houses):
    scenes = [building_scene(building) for building in houses]
    issues = khronos_issues(gltf.write(placed(scenes, "auto"), "all"))
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
    assert khronos_issues(gltf.write([textured()], "t"))["numErrors"] == 0
    assert khronos_issues(gltf.write([Scene("void", ())], "void"))["numErrors"] == 0


# --- OBJ ------------------------------------------------------------------------------------------


def test_obj_refers_to_its_files_by_relative_name():
    files = obj.write([textured()], "model")
    assert list(files) == ["model-0.png", "model.mtl", "model.obj"]
    assert b"mtllib model.mtl" in files["model.obj"]
    assert b"map_Kd model-0.png" in files["model.mtl"]
    lines = files["model.obj"].decode().splitlines()
    assert "f 4/1 5/2 6/3" in lines
    assert "o tri" in lines


def test_obj_keeps_materials_of_equal_names_apart():
    one = Scene("a", (triangle(),), {"red": Material("red", "#ff0000")})
    two = Scene("b", (triangle(),), {"red": Material("red", "#00ff00")})
    text = obj.write([one, two], "x")["x.obj"].decode()
    assert "usemtl red\n" in text
    assert "usemtl red-2\n" in text
    assert "o a/tri\n" in text


# --- CityJSON -------------------------------------------------------------------------------------


def shells(document):
    for key, item in document["CityObjects"].items():
        for shape in item.get("geometry", ()):
            if shape["type"] == "Solid":
                yield key, shape


@pytest.fixture(scope="module")
def city(houses):
    ring = ((90.0, 0.0), (99.0, 0.0), (99.0, 4.0), (94.0, 4.0), (94.0, 9.0), (90.0, 9.0))
    plan = Footprint("way", (ring,), 5.0, Roof("hip", 30.0))
    models = [*(building_model(building) for building in houses), footprint_model(plan)]
    return json.loads(cityjson.write(placed(models, "auto"), "all"))


def test_solids_are_closed_planar_simple_and_outward(city):
    assert len(list(shells(city))) == 2 * len(HOUSES) + 1
    assert solid_faults(city) == []


def test_lod3_has_a_semantic_surface_for_every_opening(city, houses):
    for building in houses:
        (shape,) = (s for k, s in shells(city) if k == building.id and s["lod"] == "3.2")
        surfaces = shape["semantics"]["surfaces"]
        assert len(shape["semantics"]["values"][0]) == len(shape["boundaries"][0])
        elements = [e for f in building.facades.values() for p in f.pieces for e in p.elements]
        opened = [s for s in surfaces if s["type"] in ("Window", "Door")]
        assert len(opened) == len(elements)
        for index, surface in enumerate(surfaces):
            if surface["type"] in ("Window", "Door"):
                assert index in surfaces[surface["parent"]]["children"]
                assert surfaces[surface["parent"]]["type"] == "WallSurface"


def test_official_schema_accepts_it(city, shared_data):
    assert cityjson_errors(city, shared_data) == []
    assert cityjson_errors({**city, "version": "9"}, shared_data)


@pytest.mark.parametrize(
    ("crs", "url"),
    [
        ("", ""),
        ("local", ""),
        ("EPSG:7415", "https://www.opengis.net/def/crs/EPSG/0/7415"),
        ("https://www.opengis.net/def/crs/EPSG/0/1", "https://www.opengis.net/def/crs/EPSG/0/1"),
    ],
)
def test_reference_systems_are_urls(crs, url):
    assert reference_url(crs) == url


def test_city_models_move_and_an_empty_one_is_a_file():
    assert json.loads(cityjson.write([], "none"))["vertices"] == []
    model = CityModel(
        "m", np.array([(0.0, 0.0, 0.0), (1.0, 1.0, 1.0)]), {"m": {"type": "Building"}}
    )
    (moved,) = placed([model], "own")
    assert moved is model


# --- PNG ------------------------------------------------------------------------------------------


@given(arrays(np.uint8, array_shapes(min_dims=2, max_dims=2, max_side=9)))
def test_png_of_grey_reads_back(picture):
    assert np.array_equal(cv2.imdecode(np.frombuffer(png.write(picture), np.uint8), 0), picture)


@given(arrays(np.uint8, st.tuples(st.integers(1, 7), st.integers(1, 7), st.just(3))))
def test_png_of_color_reads_back(picture):
    read_back = cv2.imdecode(np.frombuffer(png.write(picture), np.uint8), cv2.IMREAD_COLOR)
    assert np.array_equal(read_back[:, :, ::-1], picture)


# --- reading meshes -------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["glb", "obj"])
def test_our_own_models_are_read_back(form, tmp_path):
    for name, data in model_files([textured()], "x", form).items():
        (tmp_path / name).write_bytes(data)
    scene = read_scene(next(tmp_path.glob(f"*.{form}")))
    points = np.concatenate([mesh.vertices for mesh in scene.meshes])
    assert np.allclose(points.min(axis=0), (0, 0, 0), atol=1e-6)
    assert np.allclose(points.max(axis=0), (1, 2, 3), atol=1e-6)
    assert any(material.texture is not None for material in scene.materials.values())


@pytest.mark.parametrize("data", [b"", b"nonsense", b"glTF"])
def test_a_broken_mesh_is_invalid_input(data, tmp_path):
    path = tmp_path / "broken.glb"
    path.write_bytes(data)
    with pytest.raises(InvalidInput, match=r"broken\.glb"):
        read_scene(path)
