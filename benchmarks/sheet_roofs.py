"""Contact sheets of every roof style, to be looked at.

    python benchmarks/sheet_roofs.py FOLDER

Writes plans.jpg (every style on L, T, U, H and courtyard, from four sides) and, where the shared
data lies beside the checkout, real-STYLE.jpg (20 real plans from four sides).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np

from facade_tools.artifacts.footprint import Footprint
from facade_tools.geometry.mesh import Material, Mesh, Scene
from facade_tools.geometry.solids import Solid, building_solid, footprint_solid, triangulated
from facade_tools.imaging.camera import View
from facade_tools.imaging.contact_sheet import contact_sheet
from facade_tools.imaging.render import Look, render

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import catalogue  # noqa: E402  (it lies beside the tests)

COLORS = {"wall": "#e8dcc8", "roof": "#9a4a3a", "ground": "#777777"}
SIDES = (-30.0, 60.0, 150.0, 240.0)
PLANS = ("L", "T", "U", "H", "courtyard")


def scene(solid: Solid) -> Scene:
    vertices, triangles, faces = triangulated(solid)
    meanings = np.array([label.semantic for label in solid.labels])[faces]
    meshes = [Mesh(name, vertices, triangles[meanings == name], name) for name in COLORS]
    return Scene("solid", tuple(meshes), {k: Material(k, color) for k, color in COLORS.items()})


def sheet(solids: Iterable[tuple[str, Solid]], columns: int, path: Path) -> None:
    pictures, labels = [], []
    for name, solid in solids:
        for side in SIDES:
            view = View(side, 40.0, (170, 140))
            pictures.append(render(scene(solid), view, Look(rays=6)))
            labels.append(name if side == SIDES[0] else "")
    picture = contact_sheet(pictures, labels, columns)[:, :, ::-1]
    cv2.imwrite(str(path), picture, [cv2.IMWRITE_JPEG_QUALITY, 72])


def plans() -> Iterable[tuple[str, Solid]]:
    for plan in PLANS:
        for style in catalogue.ROOF_STYLES:
            building = catalogue.plan_building(plan, catalogue.roofed(style))
            yield building.id, building_solid(building)


def real_plans(data: Path, count: int = 20) -> list[catalogue.Polygon]:
    """Return plans from the one with most corners to the plainest, at least 4 m wide."""
    found = sorted(catalogue.real_footprints(data).values(), key=lambda p: -sum(map(len, p)))
    wide = [p for p in found if np.ptp(np.array(p[0]), axis=0).min() > 4]
    chosen = wide[:: len(wide) // count][:count]
    middles = [np.array(polygon[0]).mean(axis=0) for polygon in chosen]
    return [
        [[(x - cx, y - cy) for x, y in ring] for ring in polygon]
        for polygon, (cx, cy) in zip(chosen, middles, strict=True)
    ]


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    sheet(plans(), 12, folder / "plans.jpg")
    data = Path(os.environ.get("FACADE_TOOLS_DATA", ROOT.parent / "shared" / "data"))
    for style in catalogue.ROOF_STYLES if data.is_dir() else ():
        roof = catalogue.roofed(style, 35, "y")
        houses = [
            Footprint("f", tuple(tuple(map(tuple, ring)) for ring in polygon), 6.0, roof)
            for polygon in real_plans(data)
        ]
        named = [(f"{k} {style}", footprint_solid(house)) for k, house in enumerate(houses)]
        sheet(named, 12, folder / f"real-{style}.jpg")


if __name__ == "__main__":
    main()
