"""Buildings and footprints as CityJSON objects: LoD2 solids, LoD3 solids with openings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from ..artifacts.building import Building
from ..artifacts.documents import encode
from ..artifacts.footprint import Footprint
from ..artifacts.numbers import canonical
from ..geometry.arrays import Points3
from ..geometry.details import crown_scene
from ..geometry.mesh import Scene
from ..geometry.openings import Opening, openings_of, pierced
from ..geometry.solids import Solid, building_solid, footprint_solid
from .cityjson import CityModel

ARTIFACT = "facade-tools"  # attribute that holds the artifact, for `facade import`
SEMANTIC = {"ground": "GroundSurface", "wall": "WallSurface", "roof": "RoofSurface"}


class _Table:
    """Vertices of a model while it is put together."""

    def __init__(self) -> None:
        self.parts: list[Points3] = []
        self.count = 0

    def add(self, points: Points3) -> int:
        """Append vertices; returns the index of the first."""
        self.parts.append(points)
        self.count += len(points)
        return self.count - len(points)

    def vertices(self) -> Points3:
        return np.concatenate([np.zeros((0, 3)), *self.parts])


def building_model(building: Building) -> CityModel:
    """Return a building as city objects: LoD2 and LoD3 solid, porches and chimneys as LoD3 parts.

    Raises InvalidInput where no mass can be built.
    """
    solid = building_solid(building)
    table = _Table()
    open_solid, openings = pierced(solid, openings_of(building))
    geometry = [_lod2(solid, table), _lod3(open_solid, openings, table)]
    installations = _installations(crown_scene(building, None), building.id, table)
    attributes: dict[str, Any] = {
        "measuredHeight": round(float(solid.vertices[:, 2].max()), 3),
        "storeyHeight": float(building.storey_height),
    }
    styles = [box.roof.style for box in building.boxes if box.kind == "general" and box.roof]
    if styles:
        attributes["roofType"] = styles[0]
    attributes[ARTIFACT] = canonical(encode(building))
    main: dict[str, Any] = {"type": "Building", "attributes": attributes, "geometry": geometry}
    if installations:
        main["children"] = list(installations)
    return CityModel(building.id, table.vertices(), {building.id: main, **installations})


def footprint_model(footprint: Footprint) -> CityModel:
    """Return a footprint as a building with a LoD2 solid."""
    solid = footprint_solid(footprint)
    table = _Table()
    attributes: dict[str, Any] = {"measuredHeight": round(float(solid.vertices[:, 2].max()), 3)}
    if footprint.roof is not None:
        attributes["roofType"] = footprint.roof.style
    attributes[ARTIFACT] = canonical(encode(footprint))
    main = {"type": "Building", "attributes": attributes, "geometry": [_lod2(solid, table)]}
    return CityModel(footprint.id, table.vertices(), {footprint.id: main})


def _lod2(solid: Solid, table: _Table) -> dict[str, Any]:
    kinds = [SEMANTIC[label.semantic] for label in solid.labels]
    distinct = list(dict.fromkeys(kinds))
    surfaces = [{"type": kind} for kind in distinct]
    return _solid("2.2", solid, table, surfaces, [distinct.index(kind) for kind in kinds])


def _lod3(solid: Solid, openings: Sequence[Opening | None], table: _Table) -> dict[str, Any]:
    """Return the LoD3 shape; openings: what each face closes, after the wall that holds it."""
    surfaces: list[dict[str, Any]] = []
    number: dict[object, int] = {}
    values = []
    for index, (label, opening) in enumerate(zip(solid.labels, openings, strict=True)):
        if opening is None:
            key: object = label.owner if label.owner.startswith("wall-") else index
            if key not in number:
                number[key] = len(surfaces)
                surfaces.append({"type": SEMANTIC[label.semantic]})
            values.append(number[key])
            continue
        parent = surfaces[number[opening.wall]]
        parent.setdefault("children", []).append(len(surfaces))
        values.append(len(surfaces))
        kind = "Window" if opening.kind == "window" else "Door"
        row = {"type": kind, "parent": number[opening.wall], "name": opening.name}
        surfaces.append(row | ({"style": opening.style} if opening.style else {}))
    return _solid("3.2", solid, table, surfaces, values)


def _solid(
    lod: str,
    solid: Solid,
    table: _Table,
    surfaces: list[dict[str, Any]],
    values: list[int],
) -> dict[str, Any]:
    first = table.add(solid.vertices)
    shell = [[[first + vertex for vertex in ring] for ring in face] for face in solid.faces]
    return {
        "type": "Solid",
        "lod": lod,
        "boundaries": [shell],
        "semantics": {"surfaces": surfaces, "values": [values]},
    }


def _installations(scene: Scene, parent: str, table: _Table) -> dict[str, Mapping[str, Any]]:
    """Return porches and chimneys of the detailed scene as BuildingInstallations."""
    out: dict[str, Mapping[str, Any]] = {}
    parts = [mesh for mesh in scene.meshes if mesh.name.startswith(("porch-", "chimney-"))]
    for name, group in groupby(parts, key=lambda mesh: mesh.name.split("/")[0]):
        triangles: list[list[list[int]]] = []
        for mesh in group:
            faces = mesh.faces + table.add(mesh.vertices)
            triangles += [[face] for face in faces.tolist()]
        shape = {"type": "MultiSurface", "lod": "3.2", "boundaries": triangles}
        out[f"{parent}/{name}"] = {
            "type": "BuildingInstallation",
            "parents": [parent],
            "attributes": {"function": name.rpartition("-")[0]},
            "geometry": [shape],
        }
    return out
