"""capture-style and retarget on large models: seconds of processor time, memory.

    python benchmarks/bench_stylization_size.py MODEL [--triangles 200000]

Every triangle is cut in four until there are enough. The compiled loops are run once before.
"""

from __future__ import annotations

import argparse
import resource
import time
from pathlib import Path

import numpy as np

from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.textured import TexturedMesh
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.retarget import retarget


def finer(mesh: TexturedMesh) -> TexturedMesh:
    """Return a mesh with every triangle cut in four."""
    corners, uv = mesh.vertices[mesh.faces], mesh.uv
    parts = []
    for values in (corners, uv):
        a, b, c = (values[:, k] for k in range(3))
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        parts.append(np.concatenate([np.stack(q, axis=1) for q in quarters]))
    vertices, faces = np.unique(parts[0].reshape(-1, 3), axis=0, return_inverse=True)
    triangles = faces.reshape(-1, 3).astype(np.int64)
    return TexturedMesh(vertices, triangles, parts[1], np.tile(mesh.paint, 4), mesh.paints)


def main() -> None:
    """Print one line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("model", type=Path)
    parser.add_argument("--triangles", type=int, default=0)
    options = parser.parse_args()
    mesh = read_textured(options.model)
    style = capture_style(mesh, "warm")
    retarget(style, style.blocks)
    while len(mesh.faces) < options.triangles:
        mesh = finer(mesh)
    start = time.process_time()
    style = capture_style(mesh, "large")
    middle = time.process_time()
    retarget(style, style.blocks)
    end = time.process_time()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    print(
        f"{options.model.parent.name}: {len(mesh.faces):,} triangles, "
        f"capture {middle - start:.2f} s, "
        f"retarget {end - middle:.2f} s, peak memory {peak} MB"
    )


if __name__ == "__main__":
    main()
