"""A drawn facade, its parse and its picture, for the tests of reconstruction."""

from __future__ import annotations

import numpy as np
import trimesh

from facade_tools.artifacts.parse import Floor, ImageInfo, Parse, Region
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.elevation import label_map

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
WIDTH, HEIGHT, UNIT = 120, 170, 10  # pixels, and pixels a metre


def rng():
    return item_generator(0, "test")


def regions(windows=True, roof=True):
    """Sky 20 rows, roof 30 with two dormers, three floors of 30, shops and a door in 30."""
    rows = [Region("sky", 0, 0, WIDTH, 20), Region("wall", 0, 50, WIDTH, HEIGHT)]
    rows.append(Region("roof" if roof else "sky", 0, 20, WIDTH, 50))
    if windows:
        for y in (60, 90, 120):
            rows += [Region("window", x, y, x + 12, y + 18) for x in (14, 54, 94)]
        rows.append(Region("balcony", 0, 102, WIDTH, 110))
    if roof and windows:
        rows += [Region("window", x, 28, x + 12, 42) for x in (30, 80)]
        rows.append(Region("chimney", 100, 5, 112, 20))
    rows += [Region("door", 52, 145, 68, HEIGHT), Region("shop", 75, 145, 115, HEIGHT)]
    return tuple(rows)


def parsed(**more):
    # Later regions lie on top, as in label maps; a real parse's regions tile its picture.
    floors = tuple(Floor("FL", y, y + 30, (0, WIDTH)) for y in (50, 80, 110, 140))
    info = ImageInfo("facade.png", (WIDTH, HEIGHT), "0" * 64)
    values = {"regions": regions(), "floors": floors, **more}
    return Parse("facade", info, IDENTITY, "m", "s", "g", "", 0.0, (WIDTH, HEIGHT), **values)


def picture():
    noise = rng().integers(-12, 13, (HEIGHT, WIDTH, 3))
    base = np.full((HEIGHT, WIDTH, 3), (205, 190, 155)) + noise
    base[:20], base[20:50] = (150, 190, 230), (90, 95, 105)
    labels = label_map(parsed())
    base[labels == 1] = (40, 50, 60)
    return np.clip(base, 0, 255).astype(np.uint8)


def solid_of(scene):
    mass = scene.meshes[0]
    assert mass.name == "mass"
    return trimesh.Trimesh(mass.vertices, mass.faces, process=False)
