"""What was imported goes out again: outside judges on the exports of every set with geometry."""

from __future__ import annotations

import io
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from .judges import cityjson_errors, khronos_issues, solid_faults

SETS = {
    "LoD2 CityJSON": "nrw-lod2/*.city.json",
    "LoD2 CityGML": "nrw-lod2/*.gml",
    "LoD3 CityJSON": "ingolstadt-lod3/*.city.json",
    "LoD3 CityGML": "ingolstadt-lod3/citygml/*.gml",
}


class Set:
    """Buildings of a real set, imported, and their exports."""

    def __init__(self, script: str, folder: Path, files: list[Path]) -> None:
        self.script = script
        self.buildings = folder / "buildings.jsonl"
        self.run("import", *files, "--on-error", "skip", "-o", self.buildings)

    def run(self, *words: object) -> None:
        done = subprocess.run([self.script, "-q", *map(str, words)], timeout=300)
        assert done.returncode in (0, 3)  # 3: something was refused by name

    def export(self, ending: str) -> Path:
        out = self.buildings.with_name(f"out{ending}")
        if not out.exists():
            self.run("export", self.buildings, "-o", out)
        return out

    def again(self, path: Path) -> Path:
        out = path.with_suffix(".back.jsonl")
        self.run("import", path, "-o", out)
        return out


@pytest.fixture(scope="module", params=SETS)
def imported(request, facade_script, shared_data: Path, tmp_path_factory) -> Set:
    files = sorted((shared_data / "buildings").glob(SETS[request.param]))
    return Set(facade_script, tmp_path_factory.mktemp("sets"), files)


def rows(path: Path) -> dict[str, Any]:
    found = {row["id"]: row for row in map(json.loads, path.read_bytes().splitlines())}
    for row in found.values():
        row.pop("provenance")
    return found


def test_cityjson_of_every_set_is_valid_and_comes_back(imported: Set, shared_data) -> None:
    path = imported.export(".city.json")
    document = json.loads(path.read_bytes())
    assert cityjson_errors(document, shared_data) == []
    assert solid_faults(document) == []
    assert rows(imported.again(path)) == rows(imported.buildings)


def test_glb_of_every_set_is_valid_and_its_masses_are_volumes(imported: Set) -> None:
    data = imported.export(".glb").read_bytes()
    issues = khronos_issues(data)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0)
    scene = trimesh.load(io.BytesIO(data), file_type="glb")
    masses = [mesh for name, mesh in scene.geometry.items() if name.split("/")[-1] == "mass"]
    assert len(masses) == len(rows(imported.buildings))
    assert all(mesh.is_volume and mesh.volume > 0 for mesh in masses)


def test_the_models_stand_where_they_stood_on_the_map(imported: Set) -> None:
    path = imported.export(".city.json")
    document = json.loads(path.read_bytes())
    scale, shift = document["transform"]["scale"], document["transform"]["translate"]
    corners = np.array(document["vertices"]) * scale + shift
    for row in rows(imported.buildings).values():
        assert np.hypot(*(corners[:, :2] - row["frame"]["shift"][:2]).T).min() < 60.0
    assert document["metadata"]["referenceSystem"].startswith("https://www.opengis.net/def/crs/")
