"""Outside judges of exported files; a test skips where one is not installed."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

ROOT = Path(__file__).resolve().parent.parent
VALIDATE = """
const validator = require('gltf-validator');
const data = new Uint8Array(require('fs').readFileSync(0));
validator.validateBytes(data, {maxIssues: 0}).then((report) => console.log(JSON.stringify(report)));
"""


def khronos_issues(data: bytes) -> dict[str, Any]:
    """Issues that the Khronos validator finds in a GLB.

    It lies in FACADE_TOOLS_NODE_MODULES, or in build/node_modules (`make judges`).
    """
    folder = Path(os.environ.get("FACADE_TOOLS_NODE_MODULES", ROOT / "build" / "node_modules"))
    node = shutil.which("node")
    if node is None or not (folder / "gltf-validator").is_dir():
        pytest.skip("no gltf-validator here: `make judges` installs it")
    run = subprocess.run(
        [node, "-e", VALIDATE],
        input=data,
        capture_output=True,
        env={**os.environ, "NODE_PATH": str(folder)},
        timeout=120,
        check=True,
    )
    found: dict[str, Any] = json.loads(run.stdout)["issues"]
    return found


@cache
def _schema(path: Path) -> Any:
    import jsonschema_rs

    return jsonschema_rs.validator_for(json.loads(path.read_text()))


def cityjson_errors(document: Any, shared_data: Path) -> list[str]:
    """What the official CityJSON 2.0 schema refuses in a document."""
    path = shared_data / "judges" / "cityjson-2.0" / "cityjson.min.schema.json"
    if not path.exists():
        pytest.skip("no CityJSON schema here")
    return [error.message for error in _schema(path).iter_errors(document)]


def solid_faults(document: Any) -> list[str]:
    """What ISO 19107 refuses in the solids of a CityJSON document, as val3dity does.

    Rings are simple and planar (to 0.1 mm), holes lie within; every edge is used once in each
    direction; the volume is positive.
    """
    corners = np.array(document["vertices"]) * document["transform"]["scale"]
    found = []
    for name, item in document["CityObjects"].items():
        for shape in item.get("geometry", ()):
            if shape["type"] == "Solid":
                place = f"{name} LoD{shape['lod']}"
                found += [f"{place}: {text}" for text in _faults(shape["boundaries"][0], corners)]
    return found


def _faults(shell: list[list[list[int]]], corners: np.ndarray) -> list[str]:
    rings = [ring for face in shell for ring in face]
    edges = [edge for ring in rings for edge in zip(ring, ring[1:] + ring[:1], strict=True)]
    found = []
    if len(set(edges)) < len(edges) or set(edges) != {(b, a) for a, b in edges}:
        found.append("not closed")
    volume = 0.0
    for face in shell:
        points = [corners[ring] - corners[shell[0][0][0]] for ring in face]
        areas = [np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0) / 2 for p in points]
        normal = areas[0] / np.linalg.norm(areas[0])
        volume += sum(float(p[0] @ area) for p, area in zip(points, areas, strict=True)) / 3
        if max(float(np.abs((p - points[0][0]) @ normal).max()) for p in points) > 1e-4:
            found.append("a face that is not planar")
        flat = [np.delete(p, int(np.argmax(np.abs(normal))), axis=1) for p in points]
        if not shapely.Polygon(flat[0], flat[1:]).is_valid:
            found.append("a face that is not simple")
    if volume <= 0.0:
        found.append("turned inside out")
    return found
