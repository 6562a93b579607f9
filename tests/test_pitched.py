"""Retargeted buildings keep their roofs, gables, porches and chimneys."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from judges import khronos_issues
from test_stylization import BOX, style_of, textured_box

from facade_tools.artifacts.building import Box, Building, Chimney, Colors, Frame, Roof
from facade_tools.formats import gltf
from facade_tools.formats.textured import joined
from facade_tools.geometry.solids import building_solid, triangulated
from facade_tools.stylization.bases import building_blocks
from facade_tools.stylization.pitched import attic, crowned, plain_wall
from facade_tools.stylization.retarget import RAISED, retarget


@pytest.fixture(scope="module")
def style():
    return style_of(BOX)


def house(roof, height=6.0, **more):
    return Building("house", (Box("a", "general", 0, 0, 12, 8, height, roof),), **more)


def dressed(style, building):
    return crowned(retarget(style, building_blocks(building)), style, building)


def flushed(style, building):
    scene = retarget(style, building_blocks(building), flush=True)
    return crowned(scene, style, building)


@pytest.fixture(scope="module")
def ornate():
    """Walls of two depths behind a cornice, a niche, and a storey set back on all sides."""
    boxes = [
        ((0.6, 0.6, 0), (19.4, 11.4, 1.5)), ((0.7, 0.7, 1.5), (19.3, 11.3, 3)),
        ((0, 0, 3), (20, 12, 3.4)),
        ((0.6, 1.6, 3.4), (19.4, 11.4, 7)), ((0.6, 0.6, 3.4), (7, 1.6, 7)),
        ((13, 0.6, 3.4), (19.4, 1.6, 7)), ((2.5, 2.5, 7), (17.5, 9.5, 9.5)),
    ]  # fmt: skip
    mesh = joined([textured_box(low, high) for low, high in boxes])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("facade_tools.stylization.structure.LEAST_CHANGE", 9.0)  # one block
        return style_of(mesh, front=180.0)


def parts(scene, name):
    return [mesh for mesh in scene.meshes if mesh.name.startswith(name)]


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2


@settings(deadline=None, max_examples=15)
@given(pitch=st.floats(15, 60), height=st.floats(3, 9))
def test_gables_fill_the_triangles_between_eaves_and_ridge(style, pitch, height):
    building = house(Roof("gable", pitch, "x"), height)
    (gables,) = parts(dressed(style, building), "gables")
    assert area(gables) == pytest.approx(8 * 4 * math.tan(math.radians(pitch)), rel=1e-3)
    assert gables.vertices[:, 2].min() == pytest.approx(height, abs=2e-4)
    assert np.allclose(np.abs(gables.vertices[:, 0]), 6 + RAISED, atol=1e-5)


def test_a_flat_house_keeps_the_roof_of_the_style(style):
    scene = dressed(style, house(Roof("flat")))
    assert not parts(scene, "gables")
    assert {mesh.name for mesh in parts(scene, "roof")} == set()
    assert any(mesh.name.endswith("/roof") for mesh in scene.meshes)


WINGS = (
    Box("a", "general", 0, 0, 12, 8, 6.0, Roof("gable", 45, "x", 0.3)),
    Box("b", "general", 9, 0, 6, 6, 3.2, Roof("gable", 35, "x", 0.3)),
    Box("c", "general", -2, 6, 5, 4, 6.0, Roof("hip", 35, "y", 0.3)),
)


def test_no_film_of_the_attic_hangs_on_the_walls():
    """Where boxes end otherwise than their parts, by rounding, nothing is left of their walls."""
    building = Building("house", COLONIAL)
    solid = building_solid(building)
    assert attic(building, solid, 0.0, 0.0).vertices[:, 2].min() == 0.0
    assert attic(building, solid, 1e-6, 0.0).vertices[:, 2].min() == 3.0


COLONIAL = (  # 5.6 + 11.2 / 2 is not quite 13.0 - 3.6 / 2
    Box("main", "general", 5.6, 4.5, 11.2, 9.0, 6.0, Roof("gable", 32, "x", 0.3)),
    Box("east", "general", 13.0, 4.5, 3.6, 6.0, 3.0, Roof("gable", 28, "x", 0.25)),
    Box("west", "general", -1.8, 4.5, 3.6, 6.0, 3.0, Roof("gable", 28, "x", 0.25)),
)


FLAT = tuple(replace(box, roof=Roof("flat")) for box in COLONIAL)


@pytest.mark.parametrize("boxes", [WINGS, COLONIAL, FLAT])
def test_walls_with_relief_reach_their_roofs_and_neighbours(ornate, boxes):
    """The mass is one body, and as large as the house but for niches and cornices."""
    building = Building("house", boxes)
    vertices, triangles, _ = triangulated(building_solid(building))
    whole = trimesh.Trimesh(vertices, triangles, process=False)
    (mass,) = parts(flushed(ornate, building), "mass")
    solid = trimesh.Trimesh(mass.vertices.astype(np.float32), mass.faces, process=True)
    assert solid.is_volume
    assert solid.body_count == 1
    assert solid.volume == pytest.approx(whole.volume, rel=0.06)
    (mass,) = parts(dressed(ornate, building), "mass")
    assert solid.volume > 1.1 * trimesh.Trimesh(mass.vertices, mass.faces).volume


def test_walls_stand_on_the_sides_and_cornices_before_them(ornate):
    building = house(Roof("gable", 45, "x"))
    scene = flushed(ornate, building)
    front = np.concatenate([m.vertices for m in scene.meshes if m.name.endswith("/front")])
    planes = np.round(front[:, 1] + RAISED, 3)
    assert planes.min() == pytest.approx(-4 - 0.25)  # the cornice
    assert (planes == -4.0).mean() > 0.4
    top = front[front[:, 2] > 5.9]
    assert top[:, 1] == pytest.approx(-4 - RAISED, abs=1e-6)  # set back in the style
    assert np.ptp(top[:, 0]) == pytest.approx(12.0)


def test_a_style_without_relief_is_put_on_as_ever(style):
    building = Building("house", WINGS)
    plain, flush = (made(style, building).meshes for made in (dressed, flushed))
    assert [mesh.name for mesh in plain] == [mesh.name for mesh in flush]
    for a, b in zip(plain, flush, strict=True):
        assert np.array_equal(a.vertices, b.vertices)
        assert np.array_equal(a.faces, b.faces)


def test_roofs_keep_the_buildings_colour_or_take_the_styles(style):
    red = np.full((9, 9, 3), (200, 30, 10), np.uint8)
    red[:4] = 255
    tiled = replace(style, pictures={**style.pictures, style.sheet.roof: red})
    blue = Colors("#ffffff", "#ffffff", "#102030", "#ffffff")
    for colors, expected in ((None, "#c81e0a"), (blue, "#102030")):
        scene = dressed(tiled, house(Roof("hip", 30), colors=colors))
        assert scene.materials["own-roof"].color == expected


def test_porches_and_chimneys_stand_where_the_building_has_them(style):
    boxes = (*house(Roof("hip", 30)).boxes, Box("p", "porch", 0, -5, 4, 2, 2.6, Roof("flat")))
    building = Building("house", boxes, chimneys=(Chimney(1.0, 1.0, 0.6, 0.6, 10.0),))
    scene = dressed(style, building)
    porch = np.concatenate([mesh.vertices for mesh in parts(scene, "porch")])
    stack = np.concatenate([mesh.vertices for mesh in parts(scene, "chimney")])
    assert porch[:, 1].min() < -5.5
    assert stack[:, 2].max() >= 10.0


@pytest.mark.parametrize("turned", [False, True])
def test_the_mass_is_one_closed_solid_with_its_roof(style, turned):
    boxes = (
        *house(Roof("gable", 45, "x")).boxes,
        Box("b", "general", 4, 5, 6, 6, 4.0, Roof("hip", 30, "y")),
        Box("g", "garage", -9, 0, 6, 6, 2.8, Roof("flat")),
    )
    frame = Frame(rotation=30.0, shift=(400.0, 50.0, 10.0)) if turned else None
    building = Building("house", boxes, frame=frame)
    (mass,) = parts(dressed(style, building), "mass")
    solid = trimesh.Trimesh(mass.vertices, mass.faces, process=False)
    vertices, triangles, _ = triangulated(building_solid(building))
    whole = trimesh.Trimesh(vertices, triangles, process=False)
    assert solid.is_volume
    assert solid.volume == pytest.approx(whole.volume, rel=1e-5)


def test_no_slit_is_left_under_the_attic(style):
    """Wings whose eaves are not the walls' heights to the last digit."""
    boxes = (
        Box("main", "general", 6.6, 4.6, 13.2, 9.2, 6.0, Roof("gable", 37, "x", 0.3)),
        Box("east", "general", 15.1, 4.6, 3.8, 6.2, 3.0, Roof("gable", 28, "x", 0.25)),
        Box("west", "general", -1.9, 4.6, 3.8, 6.2, 3.0, Roof("gable", 28, "x", 0.25)),
    )
    (mass,) = parts(dressed(style, Building("house", boxes)), "mass")
    written = trimesh.Trimesh(mass.vertices.astype(np.float32), mass.faces, process=True)
    assert written.is_volume


@pytest.mark.parametrize("place", [0.0, 300.0])
def test_the_mass_under_a_cone_stays_closed_in_single_precision(style, place):
    """A tower's cone in the valley of two roofs, as on the sample houses."""
    boxes = (
        Box("main", "general", 5.1, 5.3, 10.2, 10.6, 6.4, Roof("hip", 44, "y", 0.35)),
        Box("tower", "general", 9.5, 0.7, 3.2, 3.2, 7.2, Roof("cone", 60, "x", 0.2)),
        Box("cross", "general", -0.2, 6.54, 2.4, 4.6, 6.4, Roof("gable", 44, "x", 0.35)),
        Box("rear", "general", 4.6, 12.2, 7.2, 3.2, 3.2, Roof("hip", 25, "x", 0.3)),
    )
    frame = Frame(0.0, (place, place, 0.0)) if place else None
    (mass,) = parts(dressed(style, Building("house", boxes, frame=frame)), "mass")
    written = trimesh.Trimesh(mass.vertices.astype(np.float32), mass.faces, process=True)
    assert written.is_volume
    assert len(written.faces) == len(mass.faces)
    assert len(np.unique(mass.faces)) == len(mass.vertices)


def test_the_roof_turns_with_the_building(style):
    plain = house(Roof("gable", 30, "x"))
    placed = house(Roof("gable", 30, "x"), frame=Frame(rotation=90.0, shift=(100.0, 50.0, 0.0)))
    before, after = (parts(dressed(style, b), "gables")[0].vertices for b in (plain, placed))
    assert np.allclose(np.abs(after[:, 1] - 50.0), np.abs(before[:, 0]))


def test_the_plain_wall_repeats_without_seams(style):
    picture, (width, height) = plain_wall(style)
    assert np.array_equal(picture[:, 0], picture[:, -1])
    assert np.array_equal(picture[0], picture[-1])
    assert min(width, height) > 0
    assert picture.reshape(-1, 3).std(axis=0).max() < 12  # no window in it


def test_the_validator_finds_nothing(style):
    issues = khronos_issues(gltf.write([dressed(style, house(Roof("gable", 40, "y")))], "x"))
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:3]


def winding(solid, point):
    """Return how often a solid's surface winds around a point: 1 inside, 0 outside."""
    a, b, c = np.moveaxis(solid.triangles - np.array(point), 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    near = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(np.arctan2(volume, near).sum() / (2 * np.pi))


def test_niches_right_under_a_roof_are_closed_below_it():
    boxes = [((0, 0.4, 0), (20, 12, 6)), ((0, 0, 0), (8, 0.4, 6)), ((12, 0, 0), (20, 0.4, 6))]
    niche = style_of(joined([textured_box(low, high) for low, high in boxes]), front=180.0)
    building = Building("house", (Box("a", "general", 10, 6, 20, 12, 6.0, Roof("hip", 30.0)),))
    scene = flushed(niche, building)
    mass = scene.meshes[0]
    solid = trimesh.Trimesh(mass.vertices, mass.faces, process=False)
    assert solid.is_watertight
    inside = [round(winding(solid, (10.0, 0.2, z))) for z in (3.0, 5.7, 5.9)]
    assert inside == [0, 0, 1]
