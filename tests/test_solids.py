"""Solids: closed, outward, of positive volume, for every building."""

from __future__ import annotations

import catalogue
import numpy as np
import pytest
import trimesh

from facade_tools.artifacts.building import Box, Building, Roof
from facade_tools.errors import InvalidInput
from facade_tools.geometry.solids import Solid, building_solid, triangulated

BUILDINGS = catalogue.buildings()


def as_mesh(solid: Solid) -> trimesh.Trimesh:
    vertices, triangles, _ = triangulated(solid)
    return trimesh.Trimesh(vertices, triangles, process=False)


def random_building(rng: np.random.Generator) -> Building:
    boxes = []
    for k in range(int(rng.integers(1, 6))):
        place, size = rng.uniform(-5, 5, 2), rng.uniform(3, 11, 2)
        if rng.random() < 0.6:
            place, size = np.round(place), np.round(size)
        style = str(rng.choice(catalogue.ROOF_STYLES))
        pitch = float(rng.choice([20.0, 35.0, 45.0, rng.uniform(1, 70)]))
        roof = Roof(style, pitch, str(rng.choice(["x", "y"])))  # type: ignore[arg-type]
        height = float(rng.choice([3.0, 6.0, rng.uniform(2, 9)]))
        boxes.append(Box(f"b{k}", "general", *place.tolist(), *size.tolist(), height, roof))
    return Building("random", tuple(boxes))


@pytest.mark.parametrize("name", BUILDINGS)
def test_building_is_a_volume(name: str) -> None:
    mesh = as_mesh(building_solid(BUILDINGS[name]))
    assert mesh.is_volume
    assert mesh.volume > 0


def test_random_buildings_are_volumes() -> None:
    rng = np.random.default_rng(0)
    for _ in range(200):
        building = random_building(rng)
        mesh = as_mesh(building_solid(building))
        assert mesh.is_volume, building
        assert mesh.volume > 0, building


def test_single_flat_box_is_six_faces() -> None:
    solid = building_solid(Building("b", (catalogue.box("b", (0, 0, 4, 3), 5),)))
    assert solid.vertices.shape == (8, 3)
    assert sorted(label.semantic for label in solid.labels) == ["ground", "roof"] + ["wall"] * 4
    assert as_mesh(solid).volume == pytest.approx(60)


def test_gable_is_seven_faces() -> None:
    roof = catalogue.roofed("gable", 45, "x")
    solid = building_solid(Building("b", (catalogue.box("b", (0, 0, 10, 6), 3, roof=roof),)))
    assert len(solid.faces) == 7
    assert as_mesh(solid).volume == pytest.approx(10 * 6 * 3 + 0.5 * 6 * 3 * 10)


def test_no_box_is_invalid() -> None:
    porch = catalogue.box("p", (0, 0, 4, 3), 3, kind="porch")
    with pytest.raises(InvalidInput, match="no general or garage box"):
        building_solid(Building("b", (porch,)))
