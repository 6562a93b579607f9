"""Canonical buildings and polygons that every geometric test runs over."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from facade_tools.artifacts.building import Box, Building, Chimney, Roof

ROOF_STYLES = ("flat", "gable", "hip", "shed", "cone", "mansard")
Corner = tuple[float, float]
Polygon = list[list[Corner]]  # outer ring, then holes


def box(
    name: str, rectangle: tuple[float, float, float, float], height: float, **more: object
) -> Box:
    """A box from its plan corners (x0, y0, x1, y1), its height, and its roof and kind."""
    x0, y0, x1, y1 = rectangle
    roof = more.get("roof", Roof("flat"))
    kind = more.get("kind", "general")
    place = ((x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0)
    return Box(name, kind, *place, height, roof)  # type: ignore[arg-type]


def roofed(style: str, pitch: float = 35.0, direction: str = "x") -> Roof:
    return Roof(style, pitch, direction)  # type: ignore[arg-type]


def rectangles(plan: str) -> list[tuple[float, float, float, float]]:
    """Touching rectangles (x0, y0, x1, y1) of a named plan, metres."""
    return list(_PLANS[plan])


_PLANS = {
    "single": [(0, 0, 10, 8)],
    "square": [(0, 0, 8, 8)],
    "L": [(0, 0, 14, 6), (0, 6, 6, 13)],
    "T": [(0, 6, 15, 12), (5, 0, 10, 6)],
    "U": [(0, 0, 5, 12), (5, 7, 13, 12), (13, 0, 18, 12)],
    "H": [(0, 0, 5, 14), (5, 5, 12, 9), (12, 0, 17, 14)],
    "courtyard": [(0, 0, 18, 5), (0, 11, 18, 16), (0, 5, 5, 11), (13, 5, 18, 11)],
    "plus": [(0, 5, 15, 10), (5, 0, 10, 5), (5, 10, 10, 15)],
    "Z": [(0, 0, 9, 6), (6, 6, 15, 12)],
}
PLANS = tuple(_PLANS)


def plan_building(plan: str, roof: Roof, height: float = 6.0) -> Building:
    """A building of one height on a named plan; ridges run along the longer sides, sheds across."""
    boxes = []
    for k, (x0, y0, x1, y1) in enumerate(rectangles(plan)):
        along = "x" if (x1 - x0 >= y1 - y0) != (roof.style == "shed") else "y"
        own = replace(roof, direction=along)
        boxes.append(box(f"box-{k}", (x0, y0, x1, y1), height, roof=own))
    return Building(f"{plan}-{roof.style}", tuple(boxes))


def _bungalow() -> Building:
    house = box("main", (0, 0, 14, 8), 3.0, roof=roofed("hip", 25))
    garage = box("garage", (14, 1, 18, 7), 2.6, roof=roofed("gable", 25, "y"), kind="garage")
    porch = box("porch", (3, -1.8, 7, 0), 2.5, roof=roofed("shed", 10, "y"), kind="porch")
    return Building("bungalow", (house, garage, porch))


def _victorian() -> Building:
    boxes = (
        box("main", (0, 0, 9, 11), 6.4, roof=roofed("gable", 45, "y")),
        box("wing", (7, 3, 14, 9), 6.4, roof=roofed("gable", 45, "x")),
        box("kitchen", (1, 11, 7, 14), 3.2, roof=roofed("shed", 15, "y")),
        box("tower", (8, -0.5, 11.5, 3), 9.6, roof=roofed("cone", 60)),
        box("veranda", (0, -2, 8, 0), 3.0, roof=roofed("shed", 12, "y"), kind="porch"),
    )
    chimney = Chimney(3.0, 7.0, 0.8, 0.8, 12.5)
    return Building(
        "victorian", boxes, storey_height=3.2, features=("chimney", "tower"), chimneys=(chimney,)
    )


def buildings() -> dict[str, Building]:
    """Canonical complete buildings by name."""
    found = [plan_building(plan, roofed("gable")) for plan in PLANS]
    found += [plan_building("single", roofed(style)) for style in ROOF_STYLES]
    low, high = roofed("hip"), roofed("gable", 40, "y")
    extra = {
        "heights": (box("a", (0, 0, 8, 8), 6, roof=high), box("b", (8, 1, 14, 6), 3, roof=low)),
        "overlap": (box("a", (0, 0, 10, 6), 6, roof=low), box("b", (6, 3, 14, 12), 6, roof=high)),
        "inside": (box("a", (0, 0, 12, 12), 4), box("b", (4, 4, 8, 8), 9, roof=high)),
        "equal-twice": (box("a", (0, 0, 9, 7), 5, roof=low), box("b", (0, 0, 9, 7), 5, roof=high)),
        "corner": (box("a", (0, 0, 5, 5), 6, roof=low), box("b", (5, 5, 9, 9), 3, roof=high)),
        "apart": (box("a", (0, 0, 5, 5), 6, roof=low), box("b", (7, 0, 12, 5), 3, roof=high)),
        "sliver": (box("a", (0, 0, 5, 5), 6), box("b", (0.00001, 0.00002, 5, 9), 6.00001)),
    }
    found += [Building(name, boxes) for name, boxes in extra.items()]
    found += [_bungalow(), _victorian()]
    return {building.id: building for building in found}


def polygons() -> dict[str, Polygon]:
    """Canonical polygons (outer ring, then holes) by name; orientation is not normalised."""
    turn = [2 * math.pi * k / 12 for k in range(12)]
    star = [(math.cos(a) * (9, 4)[k % 2], math.sin(a) * (9, 4)[k % 2]) for k, a in enumerate(turn)]
    return {
        "triangle": [[(0, 0), (7, 0), (2, 5)]],
        "square": [[(0, 0), (8, 0), (8, 8), (0, 8)]],
        "rectangle": [[(0, 0), (10, 0), (10, 6), (0, 6)]],
        "collinear": [[(0, 0), (4, 0), (10, 0), (10, 3), (10, 6), (0, 6)]],
        "L": [[(0, 0), (14, 0), (14, 6), (6, 6), (6, 13), (0, 13)]],
        "L-equal": [[(0, 0), (12, 0), (12, 6), (6, 6), (6, 12), (0, 12)]],
        "T": [[(0, 6), (5, 6), (5, 0), (10, 0), (10, 6), (15, 6), (15, 12), (0, 12)]],
        "U": [[(0, 0), (5, 0), (5, 7), (13, 7), (13, 0), (18, 0), (18, 12), (0, 12)]],
        "plus": [
            [
                *[(5, 0), (10, 0), (10, 5), (15, 5), (15, 10), (10, 10)],
                *[(10, 15), (5, 15), (5, 10), (0, 10), (0, 5), (5, 5)],
            ],
        ],
        "courtyard": [
            [(0, 0), (18, 0), (18, 16), (0, 16)],
            [(5, 5), (13, 5), (13, 11), (5, 11)],
        ],
        "two-holes": [
            [(0, 0), (20, 0), (20, 9), (0, 9)],
            [(3, 3), (8, 3), (8, 6), (3, 6)],
            [(12, 3), (17, 3), (17, 6), (12, 6)],
        ],
        "star": [star],
        "circle": [[(5 * math.cos(a / 5), 5 * math.sin(a / 5)) for a in np.arange(0, 31)]],
        "nearly-parallel": [[(0, 0), (30, 0), (30, 8.001), (0, 8)]],
        "spike": [[(0, 0), (20, 0), (20, 10), (10.01, 10), (10, 0.5), (9.99, 10), (0, 10)]],
        "wedge": [[(0, 0), (40, 0), (40, 0.2)]],
    }


def random_polygon(rng: np.random.Generator, kind: str) -> Polygon:
    """A random valid polygon of at most 100 vertices, often with holes.

    kind: "cells" (rectilinear on a grid, full of simultaneous events), "boxes" (rectilinear, off
    the grid), "star" (no holes), "blobs" (a union of triangles less other triangles).
    """
    while True:
        shape = _RANDOM[kind](rng)
        parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
        if parts:
            rings = _rings(max(parts, key=lambda part: part.area))
            if sum(len(ring) for ring in rings) <= 100:
                return rings


POLYGON_KINDS = ("cells", "boxes", "star", "blobs")


def _rings(polygon: shapely.Polygon) -> Polygon:
    loops = [polygon.exterior, *polygon.interiors]
    return [[(float(x), float(y)) for x, y in loop.coords[:-1]] for loop in loops]


def _cells(rng: np.random.Generator) -> shapely.Geometry:
    size = int(rng.integers(2, 9))
    filled = np.argwhere(rng.random((size, size)) < 0.7)
    union = shapely.union_all([shapely.box(x, y, x + 1, y + 1) for x, y in filled.tolist()])
    return shapely.simplify(union, 0) if rng.random() < 0.7 else union


def _boxes(rng: np.random.Generator) -> shapely.Geometry:
    corners = rng.uniform(0, 20, (int(rng.integers(1, 14)), 2))
    sizes = rng.uniform(1, 9, corners.shape)
    return shapely.union_all(
        [shapely.box(*c, *(c + s)) for c, s in zip(corners, sizes, strict=True)]
    )


def _star(rng: np.random.Generator) -> shapely.Geometry:
    count = int(rng.integers(3, 101))
    angles = np.sort(rng.uniform(0, 2 * np.pi, count))
    radii = rng.uniform(2, 10, count)
    ring = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
    polygon = shapely.Polygon(ring)
    return polygon if polygon.is_valid else shapely.Point()


def _blobs(rng: np.random.Generator) -> shapely.Geometry:
    added = [shapely.Polygon(rng.uniform(0, 20, (3, 2))) for _ in range(int(rng.integers(2, 14)))]
    cut = [shapely.Polygon(rng.uniform(0, 20, (1, 2)) + rng.uniform(-2, 2, (3, 2))) for _ in added]
    return shapely.difference(shapely.union_all(added), shapely.union_all(cut))


_RANDOM = {"cells": _cells, "boxes": _boxes, "star": _star, "blobs": _blobs}


def real_footprints(shared_data: Path) -> dict[str, Polygon]:
    """Ground polygons of every building and part in the CityJSON files of the shared data."""
    found: dict[str, Polygon] = {}
    for folder in ("nrw-lod2", "ingolstadt-lod3"):
        for path in sorted((shared_data / "buildings" / folder).glob("*.city.json")):
            city = json.loads(path.read_text())
            for name, thing in city["CityObjects"].items():
                for k, polygon in enumerate(_ground(city, thing)):
                    found[f"{path.name}/{name}/{k}"] = polygon
    return found


def _ground(city: dict, thing: dict) -> list[Polygon]:
    """The union, in plan, of all that is not upright in the surfaces of one city object."""
    scale, shift = (np.array(city["transform"][key]) for key in ("scale", "translate"))
    vertices = np.array(city["vertices"]) * scale + shift - np.round(shift)
    shapes = []
    for geometry in thing.get("geometry", []):
        solid = geometry["type"] == "Solid"
        for surface in (
            s for shell in geometry["boundaries"] for s in (shell if solid else [shell])
        ):
            rings = [vertices[ring][:, :2] for ring in surface if len(ring) >= 3]
            if rings:
                shapes.append(shapely.make_valid(shapely.Polygon(rings[0], rings[1:])))
    flat = [part for part in shapely.get_parts(shapes) if part.area > 1e-4]
    union = shapely.set_precision(shapely.union_all(flat), 0.001)
    parts = [part for part in shapely.get_parts(union) if part.geom_type == "Polygon"]
    return [_rings(part) for part in parts]
