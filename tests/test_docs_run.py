"""Commands of the docs run as they are printed: those that take no more than a second or two.

Not run: what learns, trains or parses, needs data of others, or is run by a test of its own.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest
import yaml
from test_docs import blocks

ROOT = Path(__file__).resolve().parent.parent
SAMPLES = ROOT / "sample_data"
PAGES = (
    "attributes", "derive", "export", "facadegen", "geojson", "layer-solve", "massgen", "rectify",
    "sample", "view",
)  # fmt: skip
TOO_LONG = ("sample_data/houses -o", "modern -n 50")  # 288 houses; 50 in worker processes
PLOT = [[2.3, 48.8], [2.30016, 48.8], [2.30016, 48.8001], [2.3, 48.8001], [2.3, 48.8]]


def commands(name: str) -> list[str]:
    """Return the commands of a page, without the lines that name options only, or an error."""
    lines = [
        line.strip()
        for block in blocks(ROOT / "docs" / f"{name}.md")
        for line in block.replace("\\\n", " ").splitlines()
    ]
    found = [line for line in lines if re.match(r"facade [a-z-]+ ", line) and " [" not in line]
    return [line for line in found if not any(part in line for part in TOO_LONG)]


@pytest.fixture
def folder(tmp_path, facade_here):
    """A folder with the files that the pages name."""
    (tmp_path / "sample_data").symlink_to(SAMPLES)
    shutil.copy(ROOT / "tests" / "golden" / "model.json", tmp_path)
    houses = (SAMPLES / "houses" / "cape.jsonl").read_bytes().splitlines(keepends=True)[:2]
    (tmp_path / "buildings.jsonl").write_bytes(b"".join(houses))
    (tmp_path / "house.json").write_bytes(houses[0])
    for name in ("partial", "photo"):
        shutil.copy(SAMPLES / "partial" / "front-photo.yaml", tmp_path / f"{name}.yaml")
    edited = yaml.safe_load((SAMPLES / "partial" / "garage-corner.yaml").read_text())
    (tmp_path / "edited.json").write_text(json.dumps(edited))
    shutil.copy(SAMPLES / "photos" / "at-an-angle.jpg", tmp_path / "street.jpg")
    write_plots(tmp_path)
    for line in (
        "facade attributes buildings.jsonl -o attributes.jsonl",
        "facade attributes house.json -o wanted.json",
        "facade massgen attributes.jsonl -o masses.jsonl",
        "facade import plots.geojson -o map.jsonl",
        "facade export house.json -o someone.obj",
        "facade export house.json -o theirs.glb",
    ):
        run(line, tmp_path, facade_here)
    return tmp_path


def write_plots(folder: Path) -> None:
    """Write a plot in degrees, under the names that the pages use, and one in metres."""
    for name, corners in (
        ("plots", PLOT),
        ("export", PLOT),
        ("cadastre", [[0, 0], [12, 0], [12, 9], [0, 9], [0, 0]]),
    ):
        plot = {
            "type": "Feature",
            "id": name,
            "properties": {"building": "yes", "building:levels": "2"},
            "geometry": {"type": "Polygon", "coordinates": [corners]},
        }
        (folder / f"{name}.geojson").write_text(json.dumps(plot))


def run(line: str, folder: Path, facade_here) -> None:
    """Run one command, or several in a pipe; the first reads attributes where it reads `-`."""
    words, pipe = shlex.split(line, comments=True), [[]]
    for word in words:
        if word == "|":
            pipe.append([])
        else:
            pipe[-1].append(word)
    data = b""
    if "-" in pipe[0]:
        data = (folder / "attributes.jsonl").read_bytes()
    for command in pipe:
        assert command[0] == "facade", line
        done = facade_here(*command[1:], stdin=data, cwd=folder)
        assert done.returncode == 0, (line, done.stderr.decode())
        data = done.stdout
    if "-o" in words:
        assert (folder / words[words.index("-o") + 1]).exists(), line
    else:
        assert data, line


@pytest.mark.parametrize("page", PAGES)
def test_commands_run_as_printed(page, folder, facade_here):
    lines = commands(page)
    assert lines, page
    for line in lines:
        run(line, folder, facade_here)
