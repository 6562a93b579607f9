"""Rules of plans and tilings that schemas cannot say: footprints and parses."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import Polygon

from ..artifacts.footprint import Footprint
from ..artifacts.parse import Parse
from .arrays import Points2
from .checks import Problem
from .rectilinear import valid_polygon

SLIVER = 1e-6  # m²: two rings that share less only touch


def footprint_problems(footprint: Footprint) -> Iterator[Problem]:
    """Yield where a footprint's rings have no area, cross themselves or lie over each other."""
    rings = [np.array(ring, dtype=np.float64) for ring in footprint.polygon]
    faults = [fault for k, ring in enumerate(rings) for fault in _ring_problems(ring, k)]
    yield from faults
    if faults:
        return
    outer, *holes = (Polygon(ring) for ring in rings)
    for k, hole in enumerate(holes, 1):
        pointer = f"/polygon/{k}"
        outside = hole.difference(outer).area
        if outside > SLIVER:
            yield Problem(pointer, f"the hole lies {outside:.3g} m² outside the outer ring")
        for other, before in enumerate(holes[: k - 1], 1):
            shared = hole.intersection(before).area
            if shared > SLIVER:
                yield Problem(pointer, f"overlaps the hole /polygon/{other} by {shared:.3g} m²")
    if holes and not shapely.difference(outer, shapely.union_all(holes)).area > SLIVER:
        yield Problem("/polygon", "the holes leave no area")


def _ring_problems(ring: Points2, k: int) -> Iterator[Problem]:
    mended = valid_polygon([ring])
    if mended.area <= SLIVER:
        yield Problem(f"/polygon/{k}", "the ring has no area")
        return
    x, y = (ring - ring[0]).T
    enclosed = abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))) / 2
    if abs(mended.area - enclosed) > SLIVER * max(1.0, enclosed):
        yield Problem(f"/polygon/{k}", "the ring crosses itself")


def parse_problems(parse: Parse) -> Iterator[Problem]:
    """Yield where the regions of a parse do not tile its rectified image."""
    width, height = parse.image.size
    rows = [(region.x0, region.y0, region.x1, region.y1) for region in parse.regions]
    boxes = np.array(rows, dtype=np.float64).reshape(-1, 4)
    flat = (boxes[:, 2:] <= boxes[:, :2]).any(axis=1)
    beyond = (boxes[:, :2] < 0).any(axis=1) | (boxes[:, 2:] > (width, height)).any(axis=1)
    for k in np.flatnonzero(flat).tolist():
        yield Problem(f"/regions/{k}", "has no pixels; expected x0 < x1 and y0 < y1")
    for k in np.flatnonzero(beyond & ~flat).tolist():
        yield Problem(f"/regions/{k}", f"leaves the image of {width} × {height} pixels")
    if (flat | beyond).any():
        return
    shapes = [shapely.box(x0, y0, x1, y1) for x0, y0, x1, y1 in boxes.tolist()]
    doubled = False
    for first, second in zip(*shapely.STRtree(shapes).query(shapes, "intersects"), strict=True):
        if first < second and shapes[first].intersection(shapes[second]).area > 0:
            doubled = True
            yield Problem(f"/regions/{second}", f"overlaps /regions/{first}")
    missing = width * height - float((boxes[:, 2:] - boxes[:, :2]).prod(axis=1).sum())
    if missing > 0 and not doubled:
        yield Problem("/regions", f"leave {missing:.0f} pixels of the image without a label")
