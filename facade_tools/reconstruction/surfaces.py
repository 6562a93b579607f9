"""Textures of a reconstruction: the photograph on its facade, synthesised ones elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS
from ..geometry.mesh import Material
from ..imaging.image_io import Picture, encoded
from ..imaging.rims import rim
from .elevation import Elevation, Rect
from .specific import FRONT, PHOTO, ROOF, SIDE, WALL, Axis
from .texture_synthesis import joined, median_color, quilted

LARGEST = 2048  # pixels of a texture's longer side
TILE = 256  # pixels of a synthesised tile
TILE_METRES = 4.0  # metres that it covers
LEAST_BLOCK = 36  # pixels of a patch
MOST_AXES = 4
RIM = 0.012  # share of a picture's width beside its rim that the interpolation darkened
SEAM = 0.12  # share of an axis' width in which its seam may run
COARSE = 0.06  # metres over which colours are averaged where exemplars are sought
ROUNDS = 4  # towards the colour that half of the pixels are nearest to
UNUSUAL = 2.5  # median distances of that half from it: what is further away is no exemplar
ALIKE = 1.0  # CIELAB units that nobody sees
SAMPLE = 20_000  # pixels that tell that colour
COLORS = {
    "wall": "#cdbf9f", "roof": "#6b727c", "chimney": "#97503e", "balcony": "#3a3c42",
    "door": "#5b4636", "shop": "#4a3e38", "window": "#3c4a58",
}  # fmt: skip

Labels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Canvas:
    """The part of the photograph that shows wall and roof, and its labels; `scale`: pixels a metre.

    Both have the same size; across and upwards the scales may differ.
    """

    picture: Picture
    labels: Labels
    scale: tuple[float, float]

    def box(self, rect: Rect) -> tuple[int, int, int, int]:
        """Return left, top, right, bottom of a rectangle of the elevation in pixels."""
        height, width = self.labels.shape
        x0, x1 = (round(u * self.scale[0]) for u in (rect.u0, rect.u1))
        y0, y1 = (round(height - v * self.scale[1]) for v in (rect.v1, rect.v0))
        return max(x0, 0), max(y0, 0), min(x1, width), min(y1, height)

    def part(self, rect: Rect) -> Picture:
        """Return the pixels of a rectangle of the elevation."""
        x0, y0, x1, y1 = self.box(rect)
        return np.asarray(self.picture[y0:y1, x0:x1])


@dataclass(frozen=True, slots=True)
class View:
    """An elevation and the part of the photograph that shows it."""

    canvas: Canvas
    plan: Elevation


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Textures by name as materials, colours by label, and the axes of the unseen sides."""

    materials: Mapping[str, Material]
    colors: Mapping[str, str]
    axes: tuple[Axis, ...]


def view_of(photo: Picture, labels: Labels, plan: Elevation) -> View:
    """Return an elevation with the part of a rectified photograph that shows it.

    photo: (h, w, 3); labels: its label map, of the same shape.
    """
    x0, y0, x1, y1 = plan.pixels
    part, own = photo[y0:y1, x0:x1], labels[y0:y1, x0:x1]
    factor = min(1.0, LARGEST / max(part.shape[:2]))
    size = (max(1, round(part.shape[1] * factor)), max(1, round(part.shape[0] * factor)))
    picture = np.asarray(cv2.resize(part, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    index = np.asarray(cv2.resize(own, size, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
    scale = size[0] / plan.width, size[1] / (plan.eaves + plan.loft)
    return View(Canvas(picture, index, scale), plan)


def surfaces_of(
    front: View, sides: View, colors: Mapping[str, str], *, rng: np.random.Generator
) -> Surfaces:
    """Return all textures of a reconstruction.

    front: as it is fitted to its wall; sides: as the picture shows it, what the others are made
    of, of the same height. colors: of the labels (see `colors_of`).
    """
    pictures = {PHOTO: front.canvas.picture, FRONT: _cleaned(front.canvas, front.plan)}
    clean = replace(sides.canvas, picture=_cleaned(sides.canvas, sides.plan))
    axes, strips = _axes(clean, sides.plan)
    if strips:
        pictures[SIDE] = joined(strips, _margin(clean, axes[0].width))
    for name, label in ((WALL, "wall"), (ROOF, "roof")):
        exemplars = list(_exemplars(clean, LABELS.index(label)))
        if exemplars:
            scaled = [_resampled(e, TILE / TILE_METRES / clean.scale[0]) for e in exemplars]
            block = int(np.clip(min(min(e.shape[:2]) for e in scaled), LEAST_BLOCK, TILE // 4))
            pictures[name] = quilted(scaled, (TILE, TILE), block, rng=rng)
    materials = {
        name: Material(name, "#ffffff", texture=encoded(picture, ".jpg"))
        for name, picture in pictures.items()
    }
    for name, label in ((WALL, "wall"), (ROOF, "roof")):
        materials.setdefault(name, Material(name, colors[label]))
    return Surfaces(materials, colors, axes)


def colors_of(picture: Picture, labels: Labels) -> dict[str, str]:
    """Return the median colour of every label in a picture of the labels' shape."""
    return {
        label: median_color(picture[labels == LABELS.index(label)], default)
        for label, default in COLORS.items()
    }


def without_rim(picture: Picture) -> Picture:
    """Return a rectified picture whose black or grey rim is a mirror image of the rest."""
    hidden = rim(picture)
    if not hidden.any():
        return picture
    reach = np.ones((2 * round(RIM * picture.shape[1]) + 1,) * 2, np.uint8)
    hidden = cv2.dilate(hidden.astype(np.uint8), reach) > 0
    out = picture.copy()
    filled = np.flatnonzero(~hidden.all(axis=1))
    for y in filled.tolist():
        seen = np.flatnonzero(~hidden[y])
        left, right = int(seen[0]), int(seen[-1]) + 1
        if right - left < hidden.shape[1]:
            ends = ((left, hidden.shape[1] - right), (0, 0))
            out[y] = np.pad(out[y, left:right], ends, mode="symmetric")
    for y in np.flatnonzero(hidden.all(axis=1)).tolist() if len(filled) else []:
        out[y] = out[filled[int(np.abs(filled - y).argmin())]]
    return out


# --- the front ------------------------------------------------------------------------------------
def _cleaned(canvas: Canvas, plan: Elevation) -> Picture:
    """Return the photograph without what stands before the wall: balconies, sky beside the roof.

    Behind a balcony the wall above it goes on downwards, mirrored.
    """
    out = canvas.picture.copy()
    for rect in plan.balconies:
        x0, y0, x1, y1 = canvas.box(rect)
        above = out[max(2 * y0 - y1, 0) : y0, x0:x1][::-1]
        if len(above):
            rows = np.arange(y1 - y0) % len(above)
            out[y0:y1, x0:x1] = above[rows]
    sky = np.isin(canvas.labels, [LABELS.index(name) for name in ("sky", "chimney", "outlier")])
    sky[round(canvas.labels.shape[0] - plan.eaves * canvas.scale[1]) :] = False
    roof = canvas.picture[canvas.labels == LABELS.index("roof")]
    if sky.any() and len(roof):
        out[sky] = np.median(roof, axis=0).astype(np.uint8)
    return out


# --- the other sides ------------------------------------------------------------------------------
def _axes(canvas: Canvas, plan: Elevation) -> tuple[tuple[Axis, ...], list[Picture]]:
    """Return the window axes that the other sides repeat, and their strips with margins."""
    centres = _columns(plan)
    if len(centres) == 0 or len(plan.lines) < 3:
        return (), []
    gaps = np.diff(centres)
    width = float(np.clip(np.median(gaps), 1.5, 6.0)) if len(gaps) else min(plan.width, 4.0)
    margin = SEAM * width
    found = [c for c in centres if c >= width / 2 + margin and c <= plan.width - width / 2 - margin]
    if not found:
        return (), []
    # Axes whose neighbours stand as far away as usual cut no window in two.
    lone = [
        c for c in found if np.abs(np.abs(centres - c)[centres != c] - width).min(initial=0) < 0.35
    ]
    chosen = (lone or found)[:MOST_AXES]
    axes = tuple(Axis(width, tuple(_openings(plan, c, width))) for c in chosen)
    strips = [_strip(canvas, plan, c, width) for c in chosen]
    return axes, strips


def _columns(plan: Elevation) -> NDArray[np.float64]:
    """Return the middles of the columns of windows above the ground floor (n,), metres."""
    upper = [r for r in plan.openings if r.label == "window" and r.v0 >= plan.lines[1] - 0.5]
    groups: list[list[float]] = []
    for rect in sorted(upper, key=lambda r: r.middle):
        if groups and rect.middle - groups[-1][-1] < 0.6 * rect.width:
            groups[-1].append(rect.middle)
        else:
            groups.append([rect.middle])
    most = max((len(group) for group in groups), default=0)
    return np.array([float(np.median(g)) for g in groups if len(g) > most / 2])


def _openings(plan: Elevation, centre: float, width: float) -> Iterator[Rect]:
    """Yield the openings of an axis, those of the first upper storey on the ground floor too."""
    low, high = centre - width / 2, centre + width / 2
    ground, first = plan.lines[1], plan.lines[2] - plan.lines[1]
    for rect in plan.openings:
        middle = (rect.v0 + rect.v1) / 2
        if rect.label != "window" or middle < ground or not low < rect.middle < high:
            continue
        u0, u1 = max(rect.u0, low) - low, min(rect.u1, high) - low
        yield Rect("window", u0, rect.v0, u1, rect.v1)
        if middle < plan.lines[2]:
            v0, v1 = ((v - ground) * ground / first for v in (rect.v0, rect.v1))
            yield Rect("window", u0, max(v0, 0.0), u1, min(v1, ground))


def _margin(canvas: Canvas, width: float) -> int:
    return max(1, round(SEAM * width * canvas.scale[0]))


def _strip(canvas: Canvas, plan: Elevation, centre: float, width: float) -> Picture:
    """Return an axis from ground to eaves with margins; the ground floor is the storey above."""
    margin = _margin(canvas, width)
    pixels = max(4 * margin + 1, round(width * canvas.scale[0]) + 2 * margin)
    left = min(max(round(centre * canvas.scale[0]) - pixels // 2, 0),
               canvas.picture.shape[1] - pixels)  # fmt: skip
    left = max(left, 0)
    height = canvas.labels.shape[0]

    def rows(low: float, high: float) -> Picture:
        y0, y1 = round(height - high * canvas.scale[1]), round(height - low * canvas.scale[1])
        return np.asarray(canvas.picture[max(y0, 0) : max(y1, 1), left : left + pixels])

    upper = rows(plan.lines[1], plan.eaves)
    first = rows(plan.lines[1], plan.lines[2])
    size = (upper.shape[1], max(1, round(plan.lines[1] * canvas.scale[1])))
    ground = np.asarray(cv2.resize(first, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return np.concatenate([upper, ground])


# --- tiles ----------------------------------------------------------------------------------------
def _exemplars(canvas: Canvas, label: int) -> Iterator[Picture]:
    """Yield the largest rectangles of one label and about one colour, at most four."""
    free = _usual(canvas, canvas.labels == label)
    for _ in range(4):
        y0, x0, y1, x1 = largest_rectangle(free)
        if min(y1 - y0, x1 - x0) < 6:
            return
        yield np.asarray(canvas.picture[y0:y1, x0:x1])
        free[y0:y1, x0:x1] = False


def _usual(canvas: Canvas, free: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where pixels look like most of the `free` ones, coarsely: a dormer's frame does not.

    What a parse calls roof or wall is edged by what it calls nothing, and may hold signs and sky.
    """
    if not free.any():
        return free
    lab = cv2.cvtColor(canvas.picture.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    colors = cv2.GaussianBlur(lab, (0, 0), max(1.0, COARSE * canvas.scale[0]))[free]
    some = colors[:: max(1, len(colors) // SAMPLE)]
    near = some
    for _ in range(ROUNDS):
        centre = np.median(near, axis=0)
        away = np.linalg.norm(some - centre, axis=1)
        near = some[away <= np.median(away)]
    most = UNUSUAL * float(np.quantile(away, 0.25)) + ALIKE
    out = np.zeros_like(free)
    out[free] = np.linalg.norm(colors - centre, axis=1) <= most
    return out


def largest_rectangle(free: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """Return top, left, bottom, right of the rectangle that the largest square of trues grows to.

    >>> largest_rectangle(np.array([[1, 1, 0], [1, 1, 1]], bool))
    (0, 0, 2, 2)
    """
    inside = np.pad(free.astype(np.uint8), 1)
    reach = np.round(cv2.distanceTransform(inside, cv2.DIST_C, 3)[1:-1, 1:-1]).astype(np.int64)
    y, x = (int(k) for k in np.unravel_index(int(np.argmax(reach)), reach.shape))
    half = int(reach[y, x])
    if half == 0:
        return y, x, y, x
    y0, x0, y1, x1 = y - half + 1, x - half + 1, y + half, x + half
    while y1 < free.shape[0] and free[y1, x0:x1].all():
        y1 += 1
    while y0 > 0 and free[y0 - 1, x0:x1].all():
        y0 -= 1
    while x1 < free.shape[1] and free[y0:y1, x1].all():
        x1 += 1
    while x0 > 0 and free[y0:y1, x0 - 1].all():
        x0 -= 1
    return y0, x0, y1, x1


def _resampled(picture: Picture, factor: float) -> Picture:
    """Return a picture at another resolution."""
    size = [max(8, round(n * factor)) for n in (picture.shape[1], picture.shape[0])]
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)
