"""How many reconstructions are valid, and whether they look like the photographs.

    python benchmarks/bench_reconstruct.py PARSES.jsonl... --images FOLDER [--sheet sheet.png]

Counts watertight masses, GLB files without an error of the Khronos validator (`make judges`, or
FACADE_TOOLS_NODE_MODULES), buildings without a problem. --sheet draws photograph and model of
twenty of them side by side.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import cv2
import numpy as np
import trimesh

from facade_tools.artifacts.store import read
from facade_tools.errors import FacadeError
from facade_tools.formats import gltf, png
from facade_tools.geometry.checks import building_problems
from facade_tools.imaging.camera import View
from facade_tools.imaging.contact_sheet import contact_sheet
from facade_tools.imaging.image_io import read_photo
from facade_tools.imaging.render import render
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.reconstruct import reconstruct

ROOT = Path(__file__).resolve().parent.parent
VALIDATE = """
const validator = require('gltf-validator');
const fs = require('fs');
(async () => {
  for (const name of process.argv.slice(1)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(name)));
    console.log(JSON.stringify(report.issues));
  }
})();
"""
CELL = 320  # pixels of a picture in the sheet


def judged(files):
    """Return the issues that the Khronos validator finds, None where it is not installed."""
    modules = os.environ.get("FACADE_TOOLS_NODE_MODULES", ROOT / "build" / "node_modules")
    node = shutil.which("node")
    if node is None or not (Path(modules) / "gltf-validator").is_dir():
        return None
    run = subprocess.run(
        [node, "-e", VALIDATE, *map(str, files)], capture_output=True, check=True,
        env={**os.environ, "NODE_PATH": str(modules)},
    )  # fmt: skip
    return [json.loads(line) for line in run.stdout.splitlines()]


def side_by_side(photo, scene):
    height, width = photo.shape[:2]
    factor = CELL / max(height, width)
    small = cv2.resize(photo, (round(width * factor), round(height * factor)),
                       interpolation=cv2.INTER_AREA)  # fmt: skip
    cell = np.full((CELL, 2 * CELL, 3), 255, np.uint8)
    cell[: small.shape[0], : small.shape[1]] = small
    cell[:, CELL:] = render(scene, View(-28.0, 7.0, (CELL, CELL)))
    return cell


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parses", nargs="+")
    parser.add_argument("--images", type=Path, required=True)
    parser.add_argument("--skip", type=int, default=0)  # parses before those that are done
    parser.add_argument("--limit", type=int, default=10**6)
    parser.add_argument("--work", type=Path, default=Path("build/reconstruct"))
    parser.add_argument("--sheet", type=Path)
    args = parser.parse_args()
    cv2.setNumThreads(1)
    args.work.mkdir(parents=True, exist_ok=True)
    parses = list(read(args.parses, "parse"))[args.skip :][: args.limit]
    drawn = {parse.id for parse in parses[:: max(1, len(parses) // 20)][:20]}
    files, cells, spent, sizes = [], [], [], []
    watertight = sound = whole = 0
    for parse in parses:
        start = time.process_time()
        photo = read_photo(str(args.images / parse.image.name)).pixels
        try:
            made = reconstruct(parse, photo, rng=item_generator(0, "reconstruct", parse.id))
            scene, building = made.scene(), made.building()
        except FacadeError as error:
            print(f"{parse.id}: {error}", flush=True)
            continue
        data = gltf.write([scene], parse.id)
        spent.append(time.process_time() - start)
        mass = next(mesh for mesh in scene.meshes if mesh.name == "mass")
        solid = trimesh.Trimesh(mass.vertices, mass.faces, process=False)
        problems = list(building_problems(building))
        watertight += solid.is_volume
        sound += not problems
        whole += not building.partial
        if not solid.is_volume or problems:
            print(f"{parse.id}: volume {solid.is_volume}, {problems[:1]}", flush=True)
        files.append(args.work / f"{parse.id}.glb")
        files[-1].write_bytes(data)
        sizes.append(len(data))
        if args.sheet and parse.id in drawn:
            cells.append(side_by_side(photo, scene))
    print(f"{len(parses)} parses, {len(files)} reconstructed")
    print(f"watertight masses      {watertight} of {len(parses)}")
    print(f"buildings without fault {sound} of {len(parses)}, {whole} with an entrance")
    reports = judged(files)
    if reports is not None:
        errors = sum(report["numErrors"] > 0 for report in reports)
        warnings = sum(report["numWarnings"] > 0 for report in reports)
        print(f"glTF validator         {errors} files with errors, {warnings} with warnings")
    print(f"median {np.median(spent):.2f} s of CPU, most {max(spent):.2f}; "
          f"median {np.median(sizes) / 1e6:.2f} MB")  # fmt: skip
    if args.sheet:
        args.sheet.write_bytes(png.write(contact_sheet(cells, (), 4)))


if __name__ == "__main__":
    main()
