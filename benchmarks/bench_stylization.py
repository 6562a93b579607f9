"""capture-style and retarget on real models: what is kept, how alike the copy is, seconds.

    python benchmarks/bench_stylization.py FOLDER_OF_MODELS [--only NAME]

Per model: share of volume and wall area that the remesh keeps (of Manhattan models), mean SSIM of
four orthographic facade renders of the self-retarget against the source (160×160 pixels, 4×4 rays
each, both blurred by one pixel, 8×8 windows), period of the front's columns by autocorrelation
before and after widening by 1.5, seconds.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import cv2
import numpy as np

from facade_tools.errors import FacadeError
from facade_tools.formats.mesh_reader import ENDINGS, read_textured
from facade_tools.formats.textured import Paint, TexturedMesh, joined
from facade_tools.geometry.mesh import Material, Mesh, Scene
from facade_tools.imaging.image_io import decoded
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.framing import standard_view, triangle_areas
from facade_tools.stylization.model import CaptureOptions
from facade_tools.stylization.outline import wall_faces
from facade_tools.stylization.projection import SIDES, _rasterise, palette
from facade_tools.stylization.remesh import slabs
from facade_tools.stylization.resizing import resized
from facade_tools.stylization.retarget import Style, retarget

SIZE, RAYS = 160, 4


def facade_render(mesh: TexturedMesh, side: str, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Orthographic view of one side inside the box low…high, background white."""
    along, direction, depth, sign = SIDES[side]
    side_pixels = SIZE * RAYS
    scale = side_pixels / max(high[along] - low[along], high[2] - low[2])
    corners = mesh.vertices[mesh.faces]
    start = low[along] if direction > 0 else -high[along]
    far = high[depth] if sign > 0 else -low[depth]
    view = np.stack(
        [
            (direction * corners[:, :, along] - start) * scale,
            (high[2] - corners[:, :, 2]) * scale,
            far + 1.0 - sign * corners[:, :, depth],
        ],
        axis=-1,
    )
    picture = np.full((side_pixels, side_pixels, 3), 255, dtype=np.uint8)
    nearest = np.full((side_pixels, side_pixels), 1e9)
    paints = palette(mesh)
    uv = np.where(np.isfinite(mesh.uv), mesh.uv, 0.0)
    _rasterise(view, uv, mesh.paint, paints.pixels, paints.table, picture, nearest)
    small = cv2.resize(picture, (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    return small.astype(np.float64).mean(axis=2) / 255


def ssim(a: np.ndarray, b: np.ndarray) -> float:
    a, b = (cv2.GaussianBlur(x, (0, 0), 1.0) for x in (a, b))
    mean = lambda x: cv2.blur(x, (8, 8))  # noqa: E731
    ma, mb = mean(a), mean(b)
    va, vb, cov = mean(a * a) - ma**2, mean(b * b) - mb**2, mean(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    values = (2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))
    return float(values[4:-4, 4:-4].mean())


def as_textured(scene: Scene) -> TexturedMesh:
    """The scene as a mesh that the same rasteriser can draw."""
    return joined([_part(mesh, scene.materials[mesh.material]) for mesh in scene.meshes])


def _part(mesh: Mesh, material: Material) -> TexturedMesh:
    count = len(mesh.faces)
    uv = np.full((count, 3, 2), np.nan) if mesh.uv is None else mesh.uv[mesh.faces]
    color = tuple(int(material.color[k : k + 2], 16) for k in (1, 3, 5))
    picture = decoded(material.texture, material.name) if material.texture else None
    paints = (Paint(material.name, color, picture),)
    return TexturedMesh(mesh.vertices, mesh.faces, uv, np.zeros(count, dtype=np.int64), paints)


def period(render: np.ndarray, metres_a_pixel: float) -> float:
    """Metres of the strongest repeat of the columns' mean, by autocorrelation."""
    signal = render.mean(axis=0)
    signal = signal[signal < 0.999]
    n = len(signal)
    signal = signal - cv2.blur(signal.reshape(1, -1), (31, 1)).ravel() if n else signal
    if n < 16 or signal.std() < 1e-4:
        return float("nan")
    power = np.correlate(signal, signal, "full")[n - 1 :] / (n - np.arange(n))
    peaks = [k for k in range(3, n // 2) if power[k] > power[k - 1] and power[k] >= power[k + 1]]
    strong = [k for k in peaks if power[k] > 0.5 * max(power[k] for k in peaks)]
    return strong[0] * metres_a_pixel if strong else float("nan")


def measure(path: Path) -> str:
    start = time.perf_counter()
    mesh = read_textured(path)
    read = time.perf_counter()
    capture = capture_style(mesh, path.parent.name, CaptureOptions())
    captured = time.perf_counter()
    style = Style(capture.sheet, capture.blocks, capture.pictures)
    scene = retarget(style, capture.blocks)
    done = time.perf_counter()
    standard = standard_view(mesh)
    found = slabs(standard.mesh.vertices, standard.mesh.faces)
    faces = [face for i, slab in enumerate(found) for face in wall_faces(slab, i)]
    vectors = triangle_areas(standard.mesh.vertices, standard.mesh.faces)
    area = np.linalg.norm(vectors, axis=1)
    walls = area[np.abs(vectors[:, 2]) < 0.2 * area].sum()
    kept = sum(face.width * face.height for face in faces) / walls
    frame = np.linalg.inv(standard.frame)
    copy = as_textured(scene)
    copy = TexturedMesh(
        copy.vertices @ frame[:3, :3].T + frame[:3, 3], copy.faces, copy.uv, copy.paint, copy.paints
    )
    low, high = standard.mesh.vertices.min(axis=0), standard.mesh.vertices.max(axis=0)
    pairs = [
        (facade_render(standard.mesh, side, low, high), facade_render(copy, side, low, high))
        for side in SIDES
    ]
    likeness = np.mean([ssim(a, b) for a, b in pairs])
    scale = max(high[0] - low[0], high[2] - low[2]) / SIZE
    wide = {b.id: (1.5 * b.width, b.depth, b.height) for b in capture.blocks.blocks}
    bigger = as_textured(retarget(style, resized(capture.blocks, wide)))
    bigger = TexturedMesh(
        bigger.vertices @ frame[:3, :3].T + frame[:3, 3],
        bigger.faces, bigger.uv, bigger.paint, bigger.paints,
    )  # fmt: skip
    blow, bhigh = bigger.vertices.min(axis=0), bigger.vertices.max(axis=0)
    bscale = max(bhigh[0] - blow[0], bhigh[2] - blow[2]) / SIZE
    periods = (
        period(pairs[0][0], scale),
        period(pairs[0][1], scale),
        period(facade_render(bigger, "front", blow, bhigh), bscale),
    )
    return (
        f"{path.parent.name[:34]:34} {len(mesh.faces):6} {len(capture.blocks.blocks):3} "
        f"{len(faces):5} "
        f"{capture.sheet.lost:5.0%} {kept:6.3f} {likeness:6.3f}  "
        f"{periods[0]:6.2f} {periods[1]:6.2f} {periods[2]:6.2f}  "
        f"{read - start:5.2f} {captured - read:5.2f} {done - captured:5.2f}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    print(
        f"{'model':34} {'tris':>6} {'blk':>3} {'faces':>5} {'lost':>5} {'walls':>6} {'SSIM':>6}  "
        f"{'period':>6} {'copy':>6} {'x1.5':>6}  {'read':>5} {'capt':>5} {'retg':>5}"
    )
    for folder in sorted(p for p in options.folder.iterdir() if p.is_dir()):
        models = [p for p in sorted(folder.iterdir()) if p.suffix.lower() in ENDINGS]
        if models and options.only in folder.name:
            try:
                print(measure(models[0]), flush=True)
            except FacadeError as error:
                print(f"{folder.name[:34]:34} refused: {error}", flush=True)
