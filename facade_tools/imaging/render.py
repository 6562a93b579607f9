"""A picture of a scene without a display: perspective, sun with soft shadow, open sky, ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Floats, Points3
from ..geometry.mesh import Scene
from .camera import View, directions, fitted
from .raster import NONE_CUT, Cutouts, rasterise
from .shading import Air, Eye, Light, Sun, Three, shade, tone
from .surfaces import Soup, linear_rgb, soup_of, to_srgb

Picture = NDArray[np.uint8]  # (h, w, 3) sRGB

MAX_SAMPLES = 64_000_000  # of a supersampled picture
SHADOW_SIZE = 1400


@dataclass(frozen=True, slots=True)
class Look:
    """Light and surroundings of a picture; colours are #rrggbb, light is linear RGB.

    samples: pixels along an edge of each picture pixel. sun: azimuth relative to the viewer's and
    elevation, degrees. edges: darkness of outlines, 0..1. ground: draw the ground plane.
    rays: directions of the ambient occlusion, 0 for none.
    """

    samples: int = 2
    sun: tuple[float, float] = (-38.0, 40.0)
    edges: float = 0.28
    ground: bool = True
    rays: int = 14
    horizon: str = "#e9eff4"
    zenith: str = "#a9c3dc"
    soil: str = "#b9bfae"
    sunlight: tuple[float, float, float] = (1.62, 1.5, 1.32)
    skylight: tuple[float, float, float] = (0.56, 0.62, 0.72)
    bounce: tuple[float, float, float] = (0.3, 0.28, 0.25)


def render(scene: Scene, view: View | None = None, look: Look | None = None) -> Picture:
    """Return the picture (h, w, 3) of a scene; an empty scene is sky and ground.

    Raises ValueError where the picture would take more than MAX_SAMPLES samples.
    """
    view, look = view or View(), look or Look()
    width, height = view.size
    if width * height * look.samples**2 > MAX_SAMPLES:
        raise ValueError(f"picture of {width} x {height} pixels is too large")
    soup = soup_of(scene)
    points = soup.corners.reshape(-1, 3) if len(soup.corners) else np.zeros((1, 3))
    camera = fitted(points, view, look.samples)
    owner = np.full((camera.height, camera.width), -1, dtype=np.int64)
    inverse = np.zeros(owner.shape)
    screen = camera.project(soup.corners)
    screen[..., 2] = 1.0 / screen[..., 2]
    screen[np.any(screen[..., 2] <= 0.0, axis=1)] = np.nan
    rasterise(np.ascontiguousarray(screen), inverse, owner, _cutouts(soup, screen[..., 2]))
    eye = Eye(_three(camera.eye), _rows(camera.axes), camera.focal, _ground(points, look))
    sun, shadow = _sun(soup, points, view, look)
    light = Light(sun, _air(points, look), shadow, _ball(look.rays))
    picture = shade(owner, inverse, soup, eye, light, look.samples)
    tone(picture)
    return np.round(255 * to_srgb(picture)).astype(np.uint8)


def _cutouts(soup: Soup, weight: Floats) -> Cutouts:
    """Return the pictures with holes of a scene, for corners (m, 3) of these weights."""
    if not soup.cutouts.any():
        return NONE_CUT
    cut, pictures = soup.cutouts[soup.looks], soup.pictures[soup.looks]
    return Cutouts(cut, pictures, soup.uv, np.ascontiguousarray(weight), soup.texels)


def _three(values: Sequence[float] | Floats) -> Three:
    first, second, third = map(float, values)
    return first, second, third


def _rows(axes: Floats) -> tuple[Three, Three, Three]:
    return _three(axes[0]), _three(axes[1]), _three(axes[2])


def _ground(points: Points3, look: Look) -> float:
    return float(points[:, 2].min()) if look.ground else -1e9


def _sun(soup: Soup, points: Points3, view: View, look: Look) -> tuple[Sun, Floats]:
    """Return the sun with its shadow map over all points (n, 3)."""
    axes = directions(view.azimuth + look.sun[0], look.sun[1])
    axes[2] = -axes[2]
    local = points @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    centre = (low + high) / 2
    per_metre = 0.98 * SHADOW_SIZE / max(float((high - low)[:2].max()), 1e-3)
    corners = soup.corners @ axes.T
    corners[..., 0] = SHADOW_SIZE / 2 + (corners[..., 0] - centre[0]) * per_metre
    corners[..., 1] = SHADOW_SIZE / 2 - (corners[..., 1] - centre[1]) * per_metre
    shadow = np.full((SHADOW_SIZE, SHADOW_SIZE), -1e9)
    cutouts = _cutouts(soup, np.ones(corners.shape[:2]))
    rasterise(np.ascontiguousarray(corners), shadow, np.zeros((0, 0), dtype=np.int64), cutouts)
    scale = (float(centre[0]), float(centre[1]), per_metre, 1.5 / per_metre)
    return Sun(_rows(axes), scale), shadow


def _air(points: Points3, look: Look) -> Air:
    centre = (points.min(axis=0) + points.max(axis=0))[:2] / 2
    reach = float(np.linalg.norm(points[:, :2] - centre, axis=1).max()) + 1.0
    return Air(
        look.sunlight,
        look.skylight,
        look.bounce,
        linear_rgb(look.horizon),
        linear_rgb(look.zenith),
        linear_rgb(look.soil),
        _three([*centre, reach]),
        look.edges,
    )


def _ball(count: int) -> Floats:
    """Return points (count, 3) of the unit ball on a golden spiral, radii spread inward."""
    i = np.arange(count) + 0.5
    height = 1.0 - 2.0 * i / max(count, 1)
    turn = np.pi * (1.0 + np.sqrt(5.0)) * i
    around = np.sqrt(1.0 - height**2)
    radius = 0.12 + 0.88 * ((i * 0.618034) % 1.0)
    points = np.stack([around * np.cos(turn), around * np.sin(turn), height], axis=1)
    return np.ascontiguousarray(points * radius[:, None])
