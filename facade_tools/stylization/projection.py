"""Textures of the source projected along face normals onto the remeshed faces (LNSW13 4.1)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..compiled import compiled
from ..formats.textured import TexturedMesh
from ..geometry.arrays import Booleans, Floats, Integers
from ..imaging.image_io import Picture
from .framing import triangle_areas
from .outline import WallFace

MAX_SIDE = 4096  # pixels of one face
MAX_PIXELS = 60_000_000  # of all faces together
AMPLE_PIXELS = 8_000_000  # of all faces together, for more than the source's resolution
DEFAULT_DENSITY = 16.0  # pixels a metre where the source has no textures
MAX_DENSITY = 256.0
REACH, NICHE = 0.06, 1.2  # of the plan's size, but at least m: how far off its texture may lie
UPRIGHT, INCLINED = 0.1, 0.05  # share of a normal that points to the viewer: of walls, of the rest

# side -> axis along the wall, its direction from left to right, axis of the outward normal, sign
SIDES = {
    "front": (0, 1, 1, -1),
    "right": (1, 1, 0, 1),
    "back": (0, -1, 1, 1),
    "left": (1, -1, 0, -1),
}


@dataclass(frozen=True, slots=True)
class Palette:
    """All pictures of a model as one array of bytes, so that compiled code can read them.

    pixels: flat bytes; table (p, 4): offset, height, width, and offset in `holes`, -1 where there
    are none. A plain colour is a 1×1 picture. holes: flat, where one sees through the pictures.
    """

    pixels: Picture
    table: Integers
    holes: Booleans

    def closed(self) -> Palette:
        """Return the palette with all pictures opaque."""
        table = self.table.copy()
        table[:, 3] = -1
        return replace(self, table=table)


def palette(mesh: TexturedMesh) -> Palette:
    """Return the pictures and colours of a mesh as one palette."""
    pictures = [
        np.array([[paint.color]], dtype=np.uint8) if paint.picture is None else paint.picture
        for paint in mesh.paints
    ]
    offsets = np.cumsum([0, *(picture.size for picture in pictures)])[:-1]
    holes = [paint.holes for paint in mesh.paints]
    sizes = [0 if one is None else one.size for one in holes]
    starts = np.where(np.array(sizes) > 0, np.cumsum([0, *sizes])[:-1], -1)
    rows = [
        (o, p.shape[0], p.shape[1], h) for o, p, h in zip(offsets, pictures, starts, strict=True)
    ]
    return Palette(
        np.concatenate([p.ravel() for p in pictures]),
        np.array(rows, dtype=np.int64),
        np.concatenate([np.zeros(0, dtype=bool), *(h.ravel() for h in holes if h is not None)]),
    )


def texel_density(mesh: TexturedMesh) -> float:
    """Return the resolution of a mesh's textures on its walls, pixels a metre (median by area)."""
    vectors = triangle_areas(mesh.vertices, mesh.faces)
    area = np.linalg.norm(vectors, axis=1)
    sizes = [(0, 0) if p.picture is None else p.picture.shape[:2] for p in mesh.paints]
    height, width = np.array(sizes, dtype=np.float64)[mesh.paint].T
    e1, e2 = mesh.uv[:, 1] - mesh.uv[:, 0], mesh.uv[:, 2] - mesh.uv[:, 0]
    texels = 0.5 * np.abs(e1[:, 0] * e2[:, 1] - e1[:, 1] * e2[:, 0]) * height * width
    known = np.isfinite(texels) & (texels > 0) & (area > 1e-9)
    known &= np.abs(vectors[:, 2]) < 0.5 * area
    if not known.any():
        return DEFAULT_DENSITY
    density = np.sqrt(texels[known] / area[known])
    plain = np.array([p.gradient for p in mesh.paints])[mesh.paint[known]]
    density = np.where(plain, np.maximum(density, DEFAULT_DENSITY), density)
    order = np.argsort(density)
    weight = np.cumsum(area[known][order])
    return float(density[order][np.searchsorted(weight, 0.5 * weight[-1])])


def working_density(faces: Sequence[WallFace], resolution: float) -> float:
    """Return the density (pixels a metre) at which the pictures of faces are drawn.

    Twice the source's resolution keeps what its own pixels show; the source's own where that
    takes much memory, and less where even this exceeds the bound.
    """
    total = max(sum(face.width * face.height for face in faces), 1e-9)
    source = min(resolution, MAX_DENSITY)
    wanted = max(source, min(2 * source, math.sqrt(AMPLE_PIXELS / total)))
    return min(wanted, math.sqrt(MAX_PIXELS / total))


def face_pictures(mesh: TexturedMesh, faces: Sequence[WallFace], density: float) -> list[Picture]:
    """Return the picture of every face.

    Of several triangles over one pixel the outermost wins, as one sees it from outside; where
    another face stands before the pixel, the nearest to the face's plane. Where no upright
    triangle is near, the nearest that can be seen from the face's side at all (a slope that
    became a step, an oblique wing) takes the pixel; then the mean colour of the face; and that of
    the walls, for faces that nothing covers.
    """
    extent = float(np.ptp(mesh.vertices[:, :2], axis=0).max())
    reach = max(REACH * extent, min(NICHE, 0.5 * extent))
    upright, inclined = _shown(mesh, UPRIGHT), _shown(mesh, INCLINED)
    usual = _usual_colour(mesh)
    results = []
    for face in faces:
        shape = (_pixels(face.height, density), _pixels(face.width, density))
        scale = np.array([shape[1] / face.width, shape[0] / face.height])
        hidden = _hidden(face, faces, shape, reach)
        picture, covered = _drawn(upright.before(face, reach), scale, shape, reach, hidden)
        if not covered.all():
            behind, seen = _rendered(inclined.before(face, extent), scale, shape, 0.0, extent)
            picture[~covered], covered = behind[~covered], covered | seen
        results.append(_filled(picture, covered) if covered.any() else usual.copy())
    return results


@dataclass(frozen=True, slots=True)
class _Shown:
    """Triangles that can be seen along x and along y.

    corners (m, 3, 3), uv (m, 3, 2), paint (m,). facing: of either axis, the numbers of triangles,
    with their least and greatest corners.
    """

    corners: Floats
    uv: Floats
    paint: Integers
    paints: Palette
    facing: tuple[tuple[Integers, Floats, Floats], ...]

    def before(self, face: WallFace, reach: float) -> Surface:
        """Return what lies within reach (m) of a face's plane, as seen from its side."""
        along, direction, depth, sign = SIDES[face.side]
        numbers, low, high = self.facing[depth]
        near = numbers[_overlaps(low, high, face, reach)]
        corners = self.corners[near]
        view = np.stack(
            [
                direction * (corners[:, :, along] - face.start),
                face.top - corners[:, :, 2],
                sign * (corners[:, :, depth] - face.place),
            ],
            axis=-1,
        )
        return Surface(view, self.uv[near], self.paint[near], self.paints)


def _shown(mesh: TexturedMesh, share: float) -> _Shown:
    """Return the triangles whose normals lie along x or y by more than a share.

    Two-sided models show their texture on either winding.
    """
    vectors = np.abs(triangle_areas(mesh.vertices, mesh.faces))
    length = np.maximum(np.linalg.norm(vectors, axis=1), 1e-30)
    corners = mesh.vertices[mesh.faces]
    numbers = [np.flatnonzero(vectors[:, axis] > share * length) for axis in range(2)]
    facing = tuple((n, corners[n].min(axis=1), corners[n].max(axis=1)) for n in numbers)
    uv = np.where(np.isfinite(mesh.uv), mesh.uv, 0.0)
    return _Shown(corners, uv, mesh.paint, palette(mesh), facing)


def _usual_colour(mesh: TexturedMesh) -> Picture:
    """Return the mean colour of a mesh, weighted by area, as a picture of one pixel."""
    area = np.linalg.norm(triangle_areas(mesh.vertices, mesh.faces), axis=1)
    means = [p.color if p.picture is None else p.picture.mean(axis=(0, 1)) for p in mesh.paints]
    weights = np.bincount(mesh.paint, area, len(mesh.paints))
    colour = weights @ np.array(means, dtype=np.float64) / max(weights.sum(), 1e-12)
    return np.asarray(np.round(colour), dtype=np.uint8).reshape(1, 1, 3)


def top_picture(mesh: TexturedMesh, low: Floats, high: Floats, density: float) -> Picture:
    """Return the view from above of the plan rectangle low…high (m), north up."""
    width, depth = (float(v) for v in high - low)
    shape = (min(_pixels(depth, density), 1024), min(_pixels(width, density), 1024))
    corners = mesh.vertices[mesh.faces]
    vectors = triangle_areas(mesh.vertices, mesh.faces)
    flat = np.abs(vectors[:, 2]) > 0.5 * np.maximum(np.linalg.norm(vectors, axis=1), 1e-30)
    top = float(corners[:, :, 2].max())
    corners = corners[flat]
    view = np.stack(
        [corners[:, :, 0] - low[0], high[1] - corners[:, :, 1], corners[:, :, 2] - top], axis=-1
    )
    uv = np.where(np.isfinite(mesh.uv), mesh.uv, 0.0)[flat]
    scale = np.array([shape[1] / width, shape[0] / depth])
    reach = float(np.ptp(mesh.vertices[:, 2])) + 1.0
    surface = Surface(view, uv, mesh.paint[flat], palette(mesh))
    picture, covered = _opaque(surface, scale, shape, reach, reach)
    return _filled(picture, covered) if covered.any() else np.full((*shape, 3), 190, np.uint8)


def _pixels(metres: float, density: float) -> int:
    return min(max(round(metres * density), 1), MAX_SIDE)


def _overlaps(low: Floats, high: Floats, face: WallFace, reach: float) -> Booleans:
    along, _, depth, _ = SIDES[face.side]
    start, end = min(face.start, face.end), max(face.start, face.end)
    found: Booleans = (
        (low[:, along] < end)
        & (high[:, along] > start)
        & (low[:, 2] < face.top)
        & (high[:, 2] > face.bottom)
        & (low[:, depth] < face.place + reach)
        & (high[:, depth] > face.place - reach)
    )
    return found


@dataclass(frozen=True, slots=True)
class Surface:
    """Triangles before a face: view (m, 3, 3), uv (m, 3, 2), paint (m,) and their pictures.

    view: metres to the right of and below the face's upper left corner, and before its plane.
    """

    view: Floats
    uv: Floats
    paint: Integers
    paints: Palette


def _hidden(
    face: WallFace, faces: Sequence[WallFace], shape: tuple[int, int], reach: float
) -> Booleans:
    """Return the pixels of a face before which another face of its side stands."""
    _, direction, _, sign = SIDES[face.side]
    hidden = np.zeros(shape, dtype=bool)
    scale = shape[1] / face.width, shape[0] / face.height
    for other in faces:
        before = sign * (other.place - face.place)
        if other.side == face.side and 1e-6 < before < reach:
            left, right = (
                direction * (end - face.start) * scale[0] for end in (other.start, other.end)
            )
            top, bottom = ((face.top - z) * scale[1] for z in (other.top, other.bottom))
            rows = slice(max(round(top), 0), max(round(bottom), 0))
            hidden[rows, max(round(left), 0) : max(round(right), 0)] = True
    return hidden


def _drawn(
    surface: Surface,
    scale: Floats,
    shape: tuple[int, int],
    reach: float,
    hidden: Booleans,
) -> tuple[Picture, Booleans]:
    """Return the picture of a face, and which of its pixels anything covers.

    hidden: pixels at which the nearest surface is drawn instead of the outermost.
    """
    picture, covered = _opaque(surface, scale, shape, reach, reach)
    if hidden.any():
        nearest, near = _opaque(surface, scale, shape, 0.0, reach)
        picture[hidden], covered[hidden] = nearest[hidden], near[hidden]
    return picture, covered


def _opaque(
    surface: Surface, scale: Floats, shape: tuple[int, int], focus: float, reach: float
) -> tuple[Picture, Booleans]:
    """Return as `_rendered` does what one does not see through, and where anything is.

    Where nothing else is, holes of pictures are drawn: many alpha channels mean nothing.
    """
    picture, covered = _rendered(surface, scale, shape, focus, reach)
    if len(surface.paints.holes) and not covered.all():
        closed = replace(surface, paints=surface.paints.closed())
        under, seen = _rendered(closed, scale, shape, focus, reach)
        picture[~covered], covered = under[~covered], covered | seen
    return picture, covered


def _filled(picture: Picture, covered: Booleans) -> Picture:
    """Give pixels that nothing covers the mean colour of the others."""
    if not covered.all():
        picture[~covered] = np.round(picture[covered].mean(axis=0)).astype(np.uint8)
    return picture


def _rendered(
    surface: Surface, scale: Floats, shape: tuple[int, int], focus: float, reach: float
) -> tuple[Picture, Booleans]:
    """Return what lies nearest to the plane `focus` metres before a face, and where anything is."""
    pixels = surface.view * np.array([*scale, 1.0]) - np.array([0.0, 0.0, focus])
    picture = np.zeros((*shape, 3), dtype=np.uint8)
    depth = np.full(shape, focus + reach)
    colours = surface.paints.pixels, surface.paints.table, surface.paints.holes
    _rasterise(pixels, surface.uv, surface.paint, *colours, picture, depth)
    return picture, depth < focus + reach


@compiled
def _rasterise(
    view: Floats,
    uv: Floats,
    paint: Integers,
    pixels: Picture,
    table: Integers,
    holes: Booleans,
    picture: Picture,
    depth: Floats,
) -> None:
    """Draw triangles by texture; the pixel keeps the sample of least |distance to the plane|.

    view (m, 3, 3): column, row (pixels) and distance (m). depth (h, w): in, the farthest distance
    that counts; out, the distance of what was drawn.
    """
    rows, columns = depth.shape
    for t in range(len(view)):
        x0, y0, d0 = view[t, 0, 0], view[t, 0, 1], view[t, 0, 2]
        x1, y1, d1 = view[t, 1, 0], view[t, 1, 1], view[t, 1, 2]
        x2, y2, d2 = view[t, 2, 0], view[t, 2, 1], view[t, 2, 2]
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-9:
            continue
        top = max(0, math.floor(min(y0, y1, y2)))
        bottom = min(rows, math.ceil(max(y0, y1, y2)) + 1)
        left = max(0, math.floor(min(x0, x1, x2)))
        right = min(columns, math.ceil(max(x0, x1, x2)) + 1)
        offset, h, w = table[paint[t], 0], table[paint[t], 1], table[paint[t], 2]
        hole = table[paint[t], 3]
        for row in range(top, bottom):
            for column in range(left, right):
                x, y = column + 0.5, row + 0.5
                b1 = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
                b2 = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
                b0 = 1.0 - b1 - b2
                if b0 < -1e-6 or b1 < -1e-6 or b2 < -1e-6:
                    continue
                distance = abs(b0 * d0 + b1 * d1 + b2 * d2)
                if distance >= depth[row, column]:
                    continue
                u = b0 * uv[t, 0, 0] + b1 * uv[t, 1, 0] + b2 * uv[t, 2, 0]
                v = b0 * uv[t, 0, 1] + b1 * uv[t, 1, 1] + b2 * uv[t, 2, 1]
                fx = (u - math.floor(u)) * w - 0.5
                fy = (1.0 - (v - math.floor(v))) * h - 0.5
                if hole >= 0:
                    nearest = math.floor(fy + 0.5) % h * w + math.floor(fx + 0.5) % w
                    if holes[hole + nearest]:
                        continue
                depth[row, column] = distance
                c0, r0 = math.floor(fx), math.floor(fy)
                ax, ay = fx - c0, fy - r0
                for channel in range(3):
                    total = 0.0
                    for i in range(2):
                        for j in range(2):
                            place = ((r0 + i) % h * w + (c0 + j) % w) * 3 + channel
                            weight = (ay if i else 1.0 - ay) * (ax if j else 1.0 - ax)
                            total += weight * pixels[offset + place]
                    picture[row, column, channel] = int(total + 0.5)
