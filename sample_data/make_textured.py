"""Draw the sample textured buildings: `python sample_data/make_textured.py`.

Four invented buildings with rhythms, set-backs, shops at the bottom and a stylish top, every
texture painted here. The same bytes every time.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from textured_paint import (  # noqa: E402  (beside this file, which is not a package)
    Picture,
    attic,
    bays,
    brickwork,
    crown,
    offices,
    roof,
    shops,
)

from facade_tools.artifacts.writing import write_bytes  # noqa: E402
from facade_tools.imaging.image_io import encoded  # noqa: E402

Point = tuple[float, float]
Painter = Callable[[float, float], Picture]  # width and height in metres -> picture


@dataclass
class Model:
    """An OBJ file in the making; every wall has its own picture unless an equal one is there."""

    points: list[tuple[float, float, float]] = field(default_factory=list)
    faces: list[tuple[str, list[int]]] = field(default_factory=list)
    pictures: dict[str, Picture] = field(default_factory=dict)

    def storeys(self, ring: Sequence[Point], z0: float, z1: float, kind: str, paint: Painter):
        """Add the walls over a counter-clockwise ring between two heights."""
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            width = math.dist(a, b)
            name = f"{kind}-{width:g}"
            self.pictures.setdefault(name, paint(width, z1 - z0))
            self._polygon(name, [(*a, z0), (*b, z0), (*b, z1), (*a, z1)])

    def top(self, ring: Sequence[Point], z: float):
        """Add a flat roof, one concave polygon where the plan is concave."""
        self.pictures.setdefault("roof", roof())
        self._polygon("roof", [(*p, z) for p in ring])

    def _polygon(self, name: str, corners: Sequence[tuple[float, float, float]]):
        first = len(self.points) + 1
        self.points += corners
        self.faces.append((name, list(range(first, first + len(corners)))))

    def lines(self) -> Iterator[str]:
        """Yield the lines of the OBJ file."""
        yield "mtllib model.mtl"
        yield from (f"v {x:g} {y:g} {z:g}" for x, y, z in self.points)
        yield from ("vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1")
        for name, corners in self.faces:
            yield f"usemtl {name}"
            uv = [1, 2, 3, 4] if len(corners) == 4 else [1] * len(corners)
            yield "f " + " ".join(f"{v}/{t}" for v, t in zip(corners, uv, strict=True))


def box(x0: float, y0: float, x1: float, y1: float) -> list[Point]:
    """Return the corners of a rectangle, counter-clockwise."""
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def corner_house() -> Model:
    """Brick over shops: four storeys of paired windows, an attic under a cornice."""
    model, plan = Model(), box(0, 0, 15, 12)
    model.storeys(plan, 0, 4, "shop", shops)
    model.storeys(plan, 4, 16, "brick", brickwork)
    model.storeys(plan, 16, 18.5, "attic", attic)
    model.top(plan, 18.5)
    return model


def stepped_tower() -> Model:
    """Offices on a podium, set back twice, with a crown of fins."""
    model = Model()
    for plan, z0, z1, kind, paint in (
        (box(0, 0, 36, 30), 0, 8, "podium", shops),
        (box(4, 4, 32, 26), 8, 39.5, "office", offices),
        (box(8, 7, 28, 23), 39.5, 64.7, "upper", offices),
        (box(10, 9, 26, 21), 64.7, 71, "crown", crown),
    ):
        model.storeys(plan, z0, z1, kind, paint)
        model.top(plan, z1)
    return model


def l_block() -> Model:
    """Homes in an L with balconies between narrow and wide bays."""
    model = Model()
    plan = [(0, 0), (33, 0), (33, 11), (12, 11), (12, 27), (0, 27)]
    model.storeys(plan, 0, 18, "homes", bays)
    model.top(plan, 18)
    return model


def u_court() -> Model:
    """Build a court open to the back: shops below brick."""
    model = Model()
    plan = [(0, 0), (40, 0), (40, 28), (29, 28), (29, 12), (11, 12), (11, 28), (0, 28)]
    model.storeys(plan, 0, 4, "shop", shops)
    model.storeys(plan, 4, 13, "brick", brickwork)
    model.top(plan, 13)
    return model


MODELS = {
    "corner-house": corner_house,
    "l-block": l_block,
    "stepped-tower": stepped_tower,
    "u-court": u_court,
}


def materials(model: Model) -> Iterator[str]:
    """Yield the lines of the MTL file."""
    for name in model.pictures:
        yield f"newmtl {name}\nKd 1 1 1\nmap_Kd {name}.png"


def write(model: Model, folder: Path) -> None:
    """Write a model's files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_bytes(folder / "model.obj", ("\n".join(model.lines()) + "\n").encode())
    write_bytes(folder / "model.mtl", ("\n".join(materials(model)) + "\n").encode())
    for name, picture in model.pictures.items():
        write_bytes(folder / f"{name}.png", encoded(picture, ".png"))


def main() -> None:
    """Write one folder a building."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=HERE / "textured")
    out = parser.parse_args().out
    for name, make in MODELS.items():
        write(make(), out / name)


if __name__ == "__main__":
    main()
