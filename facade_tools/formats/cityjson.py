"""CityJSON 2.0: city objects over one table of vertices."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.arrays import Floats, Points3

SCALE = 1e-6  # metres a step: as fine as plan comparisons are made


@dataclass(frozen=True, slots=True)
class CityModel:
    """One item as CityJSON: its name, vertices (n, 3) in metres, city objects by id.

    Boundaries in `objects` are indices of `vertices`. crs: the coordinates' reference system, a
    URL or an EPSG code, or nothing.
    """

    name: str
    vertices: Points3
    objects: Mapping[str, Mapping[str, Any]]
    crs: str = ""

    def bounds(self) -> Floats:
        """Return lowest and highest corner (2, 3)."""
        if not len(self.vertices):
            return np.zeros((2, 3))
        return np.array([self.vertices.min(axis=0), self.vertices.max(axis=0)])


def write(models: Sequence[CityModel], name: str) -> bytes:
    """Return one CityJSON 2.0 file of all models; coordinates are kept to the micrometre."""
    low = _lowest(models)
    rows: dict[tuple[int, ...], int] = {}
    objects: dict[str, Any] = {}
    for model in models:
        steps = np.rint((model.vertices - low) / SCALE).astype(np.int64).tolist()
        index = [rows.setdefault(tuple(step), len(rows)) for step in steps]
        for key, city_object in model.objects.items():
            objects[key] = _indexed(city_object, index)
    document = {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [SCALE] * 3, "translate": low.tolist()},
        "metadata": _metadata(models, name),
        "CityObjects": objects,
        "vertices": [list(row) for row in rows],
    }
    return (json.dumps(document, ensure_ascii=False, separators=(",", ":")) + "\n").encode()


def _lowest(models: Sequence[CityModel]) -> Floats:
    corners = [model.bounds()[0] for model in models if len(model.vertices)]
    return np.floor(np.min(corners, axis=0)) if corners else np.zeros(3)


def _metadata(models: Sequence[CityModel], name: str) -> dict[str, Any]:
    out: dict[str, Any] = {"identifier": name}
    boxes = [model.bounds() for model in models if len(model.vertices)]
    if boxes:
        low, high = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
        out["geographicalExtent"] = [round(value, 6) for value in [*low.tolist(), *high.tolist()]]
    systems = {model.crs for model in models}
    if len(systems) == 1 and (url := reference_url(next(iter(systems)))):
        out["referenceSystem"] = url
    return out


def reference_url(crs: str) -> str:
    """Return the URL that CityJSON wants for a reference system, or nothing.

    >>> reference_url("EPSG:28992")
    'https://www.opengis.net/def/crs/EPSG/0/28992'
    """
    head, _, code = crs.rpartition(":")
    if head.upper() == "EPSG" and code.isdigit():
        return f"https://www.opengis.net/def/crs/EPSG/0/{code}"
    return crs if crs.startswith("https://www.opengis.net/def/crs/") else ""


def _indexed(city_object: Mapping[str, Any], index: Sequence[int]) -> dict[str, Any]:
    geometry = [
        {**shape, "boundaries": _mapped(shape["boundaries"], index)}
        for shape in city_object.get("geometry", ())
    ]
    return {**city_object, **({"geometry": geometry} if geometry else {})}


def _mapped(boundaries: Any, index: Sequence[int]) -> Any:
    if isinstance(boundaries, int):
        return index[boundaries]
    return [_mapped(item, index) for item in boundaries]
