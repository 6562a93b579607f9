"""capture-style and retarget on real models: what is kept, how alike the copy is, seconds.

    python benchmarks/bench_stylization.py FOLDER_OF_MODELS [--only NAME] [--pictures sheet.png]

Per model: blocks, faces, share of the surface that is no Manhattan building's, volume and facade
area of the remesh over those of the model's own sections (polygons of shapely at 60 heights;
courts count as filled on both sides), mean SSIM of four orthographic facade renders of the
self-retarget against the source (160×160 pixels, 4×4 rays each, both blurred by one pixel, 8×8
windows), period of the front by autocorrelation (m): of the source the first, of the copy, and of
the copy 1.5 times as wide in pixels of the same size, the one nearest to the source's; a pixel (m);
of the rules at 1.5 and 2 times their size: how far windows' widths are off, the share of faces that
have as many windows as eq. 8 packs, and as many give or take one; seconds of processor time.
`--pictures` draws source, copy, 1.5 times as wide and 1.6 times as high.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import shapely
from periods import period

from facade_tools.errors import FacadeError
from facade_tools.formats.mesh_reader import ENDINGS, read_textured
from facade_tools.formats.textured import Paint, TexturedMesh, joined
from facade_tools.geometry.mesh import Material, Mesh, Scene
from facade_tools.imaging.image_io import decoded, encoded
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.columns import aligned_rules
from facade_tools.stylization.framing import standard_view
from facade_tools.stylization.projection import SIDES, Palette, _rasterise, palette
from facade_tools.stylization.remesh import section
from facade_tools.stylization.resizing import resized
from facade_tools.stylization.retarget import retarget
from facade_tools.stylization.splitting import packed, split
from facade_tools.stylization.style import Style

SIZE, RAYS = 160, 4


def facade_renders(
    mesh: TexturedMesh,
    box: tuple[np.ndarray, np.ndarray],
    sides: Sequence[str] = tuple(SIDES),
    size: int = SIZE,
) -> list[np.ndarray]:
    """Return orthographic views of sides inside the box (low, high), background white."""
    return [shrunk(view) for view in rays(mesh, box, sides, size)]


def shrunk(view: np.ndarray) -> np.ndarray:
    """Return a picture whose pixels are the means of their rays."""
    size = len(view) // RAYS, view.shape[1] // RAYS
    return cv2.resize(view, size[::-1], interpolation=cv2.INTER_AREA)


def rays(
    mesh: TexturedMesh, box: tuple[np.ndarray, np.ndarray], sides: Sequence[str], size: int
) -> list[np.ndarray]:
    """Return what every ray of orthographic views sees, RAYS × RAYS of them a pixel."""
    paints = palette(mesh)
    return [_seen(mesh, paints, side, box, size * RAYS) for side in sides]


def _seen(
    mesh: TexturedMesh,
    paints: Palette,
    side: str,
    box: tuple[np.ndarray, np.ndarray],
    count: int,
) -> np.ndarray:
    low, high = box
    along, direction, depth, sign = SIDES[side]
    scale = count / max(high[along] - low[along], high[2] - low[2])
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
    picture = np.full((count, count, 3), 255, dtype=np.uint8)
    nearest = np.full((count, count), 1e9)
    uv = np.where(np.isfinite(mesh.uv), mesh.uv, 0.0)
    colours = paints.pixels, paints.table, paints.holes
    _rasterise(view, uv, mesh.paint, *colours, picture, nearest)
    return picture


def grey(picture: np.ndarray) -> np.ndarray:
    """Return the mean of the channels in 0..1."""
    return picture.astype(np.float64).mean(axis=2) / 255


def ssim(a: np.ndarray, b: np.ndarray) -> float:
    a, b = (cv2.GaussianBlur(x, (0, 0), 1.0) for x in (a, b))
    mean = lambda x: cv2.blur(x, (8, 8))  # noqa: E731
    ma, mb = mean(a), mean(b)
    va, vb, cov = mean(a * a) - ma**2, mean(b * b) - mb**2, mean(a * b) - ma * mb
    c1, c2 = 0.01**2, 0.03**2
    values = (2 * ma * mb + c1) * (2 * cov + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))
    return float(values[4:-4, 4:-4].mean())


def as_textured(scene: Scene) -> TexturedMesh:
    """Return a scene as a mesh that the same rasteriser can draw."""
    return joined([_part(mesh, scene.materials[mesh.material]) for mesh in scene.meshes])


def _part(mesh: Mesh, material: Material) -> TexturedMesh:
    count = len(mesh.faces)
    uv = np.full((count, 3, 2), np.nan) if mesh.uv is None else mesh.uv[mesh.faces]
    color = tuple(int(material.color[k : k + 2], 16) for k in (1, 3, 5))
    picture = decoded(material.texture, material.name) if material.texture else None
    paints = (Paint(material.name, color, picture),)
    return TexturedMesh(mesh.vertices, mesh.faces, uv, np.zeros(count, dtype=np.int64), paints)


def outlined(vertices: np.ndarray, faces: np.ndarray) -> tuple[float, float]:
    """Return volume and facade area from the polygons of 60 sections, courts filled."""
    triangles = vertices[faces]
    low, high = vertices[faces][:, :, 2].min(), vertices[faces][:, :, 2].max()
    step = (high - low) / 60
    volume = facade = 0.0
    for z in low + step * (np.arange(60) + 0.5):
        heights = triangles[:, :, 2]
        segments = section(triangles[(heights.max(axis=1) > z) & (heights.min(axis=1) <= z)], z)
        # a grid on which no drawn coordinate lies half-way, so that equal ends stay equal
        snapped = np.round(segments / 0.00137) * 0.00137
        snapped = snapped[(snapped[:, 0] != snapped[:, 1]).any(axis=1)]
        lines = shapely.unary_union(shapely.linestrings(snapped))
        cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
        plan = shapely.unary_union(cells)
        volume += step * plan.area
        facade += step * plan.length
    return volume, facade


def remeshed(style: Style) -> tuple[float, float]:
    """Return volume and facade area of a sheet's own blocks, courts filled."""
    mesh = retarget(style, replace(style.blocks, frame=None)).meshes[0]
    return outlined(mesh.vertices, mesh.faces)


def standing(scene: Scene, frame: np.ndarray) -> TexturedMesh:
    """Return a scene as a mesh in the standard view."""
    copy = as_textured(scene)
    vertices = copy.vertices @ frame[:3, :3].T + frame[:3, 3]
    return TexturedMesh(vertices, copy.faces, copy.uv, copy.paint, copy.paints)


def bigger(style: Style, factors: tuple[float, float, float]) -> Scene:
    """Return the style on its own blocks with other sizes."""
    sizes = {
        b.id: (factors[0] * b.width, factors[1] * b.depth, factors[2] * b.height)
        for b in style.blocks.blocks
    }
    return retarget(style, resized(style.blocks, sizes))


def bounds(mesh: TexturedMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return least and greatest corner."""
    used = mesh.vertices[np.unique(mesh.faces)]
    return used.min(axis=0), used.max(axis=0)


def largest(box: tuple[np.ndarray, np.ndarray]) -> float:
    """Return the larger of width and height of a box (m)."""
    return float(max(box[1][0] - box[0][0], box[1][2] - box[0][2]))


@dataclass(frozen=True)
class Counts:
    """Of the rules of a sheet at ×1.5 and ×2.

    width: how far a window's width is off at most, as a share. packed: share of the faces whose
    number of windows is the one that eq. 8 packs; near: the same or one more or less.
    """

    width: float
    packed: float
    near: float


def counts(style: Style) -> Counts:
    """Return how windows of wide faces are counted and how their widths are kept."""
    worst, off = 0.0, []
    rules = aligned_rules(style.sheet, style.blocks, style.pictures)
    for group in sorted({f.vertical for w in style.sheet.walls for f in w.faces}):
        rule = rules[group]
        for factor in (1.5, 2.0) if rule.insertable else ():
            done = split(rule, factor * rule.size)
            off.append(abs(done.windows - packed(rule, factor * rule.size)))
            for source, size in zip(done.sources, done.sizes, strict=True):
                if source % 2:
                    worst = max(worst, abs(size / rule.insertable[source // 2] - 1))
    differences = np.array(off or [0])
    return Counts(worst, float((differences == 0).mean()), float((differences <= 1).mean()))


def measure(path: Path) -> tuple[str, np.ndarray]:
    """Return a model's row of the table, and its pictures side by side."""
    mesh = read_textured(path)
    start = time.process_time()
    style = capture_style(mesh, path.parent.name)
    captured = time.process_time()
    scene = retarget(style, style.blocks)
    done = time.process_time()
    standard = standard_view(mesh)
    frame = np.linalg.inv(standard.frame)
    copy, wide, high = (
        standing(s, frame) for s in (scene, bigger(style, (1.5, 1, 1)), bigger(style, (1, 1, 1.6)))
    )
    box = bounds(standard.mesh)
    pairs = list(zip(facade_renders(standard.mesh, box), facade_renders(copy, box), strict=True))
    likeness = np.mean([ssim(grey(a), grey(b)) for a, b in pairs])
    scale = largest(box) / SIZE
    size = round(largest(bounds(wide)) / scale)  # pixels of the same size as the source's
    fronts = (
        rays(m, bounds(m), ["front"], pixels)[0]
        for m, pixels in ((standard.mesh, SIZE), (copy, SIZE), (wide, size))
    )
    own, *others = fronts
    first = period(own, RAYS)
    periods = [scale * p for p in (first, *(period(view, RAYS, first) for view in others))]
    reference = np.array(outlined(standard.mesh.vertices, standard.mesh.faces))
    kept = np.array(remeshed(style)) / reference
    faces = sum(len(wall.faces) for wall in style.sheet.walls)
    kinds = counts(style)
    row = (
        f"{path.parent.name[:34]:34} {len(mesh.faces):6} {len(style.blocks.blocks):3} "
        f"{faces:5} {style.sheet.lost:5.0%} {kept[0]:6.3f} {kept[1]:6.3f} {likeness:6.3f}  "
        f"{periods[0]:6.2f} {periods[1]:6.2f} {periods[2]:6.2f} {scale:6.2f}  "
        f"{kinds.width:5.1%} {kinds.packed:4.0%} {kinds.near:4.0%}  "
        f"{captured - start:5.2f} {done - captured:5.2f}"
    )
    small = cv2.resize(shrunk(others[1]), (SIZE, SIZE), interpolation=cv2.INTER_AREA)
    views = [pairs[0][0], pairs[0][1], pairs[1][0], pairs[1][1], small]
    return row, np.hstack([*views, facade_renders(high, bounds(high), ["front"])[0]])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--pictures", type=Path)
    options = parser.parse_args()
    print(
        f"{'model':34} {'tris':>6} {'blk':>3} {'faces':>5} {'lost':>5} {'volume':>6} {'walls':>6} "
        f"{'SSIM':>6}  {'period':>6} {'copy':>6} {'x1.5':>6} {'column':>6}  "
        f"{'width':>5} {'eq8':>4} {'±1':>4}  {'capt':>5} {'retg':>5}"
    )
    pictures = []
    for folder in sorted(p for p in options.folder.iterdir() if p.is_dir()):
        models = [p for p in sorted(folder.iterdir()) if p.suffix.lower() in ENDINGS]
        if models and options.only in folder.name:
            try:
                row, picture = measure(models[0])
                pictures.append(picture)
                print(row, flush=True)
            except FacadeError as error:
                print(f"{folder.name[:34]:34} refused: {error}", flush=True)
    if options.pictures and pictures:
        options.pictures.write_bytes(encoded(np.vstack(pictures), ".png"))


if __name__ == "__main__":
    main()
