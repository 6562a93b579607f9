"""A parse as geometry: a wall with its openings and balconies in relief."""

from __future__ import annotations

import numpy as np

from ..artifacts.parse import Parse, Region
from ..geometry.mesh import Material, Mesh, Scene

STOREY = 3.0  # metres between floors, which gives a picture its scale
WALL = 0.3  # metres, thickness of the slab
FLAT = ("sky", "outlier")  # no part of the facade

# Label -> how far the part stands out of the wall (metres) and its colour.
RELIEF = {
    "window": (0.02, "#3c4a58"), "balcony": (0.5, "#4a4a4e"), "door": (0.03, "#6a4630"),
    "roof": (0.05, "#5c6474"), "shop": (0.1, "#3a2e2a"), "chimney": (0.0, "#8a6a58"),
    "wall": (0.01, "#d8caa8"),
}  # fmt: skip

_CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], np.float64)
_FACES = np.array([
    [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
    [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
])  # fmt: skip


def parse_scene(parse: Parse) -> Scene:
    """Return a slab (`mass`) and one box a region, metres, z up, the facade facing −y.

    The scale follows from the parse's floors, one every 3 m; without two floors the picture is
    18 m high. Sky is left out.
    """
    scale = metres_per_pixel(parse)
    height = parse.image.size[1]
    solid = [region for region in parse.regions if region.label not in FLAT]
    meshes = []
    walls = [region for region in solid if region.label in ("wall", "window", "balcony", "door")]
    frame = walls or solid or list(parse.regions)
    top = min(region.y0 for region in frame)
    body = Region("wall", 0, top, parse.image.size[0], height)
    meshes.append(_box("mass", body, scale, height, (0.0, WALL)))
    for number, region in enumerate(solid, 1):
        depth = RELIEF.get(region.label, (0.01, ""))[0]
        name = f"{region.label}-{number}"
        meshes.append(_box(name, region, scale, height, (-depth, WALL if depth == 0 else 0.0)))
    materials = {label: Material(label, color) for label, (_, color) in RELIEF.items()}
    return Scene(parse.id, tuple(meshes), materials)


def metres_per_pixel(parse: Parse) -> float:
    """Return the scale that the parse's tags say, else that at which floors stand 3 m apart."""
    said = parse.tags.get("metres_per_pixel")
    if isinstance(said, int | float) and said > 0:
        return float(said)
    feet = sorted({floor.y1 for floor in parse.floors})
    gaps = np.diff(feet)
    if len(gaps) == 0 or np.median(gaps) <= 0:
        return 6 * STOREY / parse.image.size[1]
    return STOREY / float(np.median(gaps))


def _box(name: str, region: Region, scale: float, height: int, depth: tuple[float, float]) -> Mesh:
    low = np.array([region.x0 * scale, depth[0], (height - region.y1) * scale])
    high = np.array([region.x1 * scale, depth[1], (height - region.y0) * scale])
    material = region.label if region.label in RELIEF else "wall"
    return Mesh(name, low + _CORNERS * (high - low), _FACES.copy(), material)
