"""A picture of a scene without a display: perspective, sun with soft shadow, open sky, ground."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Floats, Integers
from ..geometry.mesh import Scene
from .camera import Camera, View, directions, fitted
from .raster import ambient_occlusion, positions, rasterise, sunlight
from .surfaces import Soup, linear_rgb, patterned, soup_of, to_srgb

Picture = NDArray[np.uint8]  # (h, w, 3) sRGB

MAX_PIXELS = 64_000_000  # of the supersampled picture
SHADOW_SIZE = 1400
OCCLUSION_RADIUS = 0.9  # metres


@dataclass(frozen=True, slots=True)
class Look:
    """Light and surroundings of a picture.

    samples: pixels along an edge of each picture pixel. sun: azimuth (as a View's) and elevation,
    degrees. edges: how dark outlines are, 0 for none. ground: draw the ground plane.
    """

    samples: int = 2
    sun: tuple[float, float] = (-62.0, 42.0)
    edges: float = 0.28
    ground: bool = True
    sky: tuple[str, str] = ("#e9eff4", "#a9c3dc")  # at the horizon, overhead
    ground_color: str = "#b9bfae"
    sun_color: tuple[float, float, float] = (1.62, 1.5, 1.32)
    sky_color: tuple[float, float, float] = (0.56, 0.62, 0.72)
    bounce: tuple[float, float, float] = (0.3, 0.28, 0.25)
    occlusion: Floats = field(default_factory=lambda: _ball(14))


def _ball(count: int) -> Floats:
    """Return points of the unit ball on a golden spiral, radii spread towards the centre."""
    i = np.arange(count) + 0.5
    height = 1.0 - 2.0 * i / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * i
    around = np.sqrt(1.0 - height**2)
    radius = 0.12 + 0.88 * ((i * 0.618034) % 1.0)
    points = np.stack([around * np.cos(turn), around * np.sin(turn), height], axis=1)
    return np.ascontiguousarray(points * radius[:, None])


def render(scene: Scene, view: View | None = None, look: Look | None = None) -> Picture:
    """Return the picture (h, w, 3) of a scene; an empty scene is sky and ground.

    Raises ValueError where the picture would take more than MAX_PIXELS samples.
    """
    view, look = view or View(), look or Look()
    if view.size[0] * view.size[1] * look.samples**2 > MAX_PIXELS:
        raise ValueError(f"picture of {view.size[0]} x {view.size[1]} pixels is too large")
    soup = soup_of(scene)
    points = soup.corners.reshape(-1, 3) if len(soup.corners) else np.zeros((1, 3))
    camera = fitted(points, view, look.samples)
    floor = float(points[:, 2].min())
    owner, inverse = _drawn(soup, camera)
    lens = np.array([camera.focal, floor if look.ground else -1e9])
    places, depths = positions(inverse, owner, camera.eye, camera.axes, lens)
    normals = (
        np.where(owner[..., None] >= 0, soup.normals[owner], [0.0, 0.0, 1.0])
        if len(soup.corners)
        else np.broadcast_to([0.0, 0.0, 1.0], (*owner.shape, 3)).copy()
    )
    facing = np.sum(normals * (places - camera.eye), axis=2, keepdims=True)
    normals = np.where((facing > 0) & (owner[..., None] >= 0), -normals, normals)
    seen = _Seen(owner, places, depths, np.ascontiguousarray(normals))
    light = _shaded(soup, camera, look, seen, points)
    small = light.reshape(view.size[1], look.samples, view.size[0], look.samples, 3).mean(
        axis=(1, 3)
    )
    return np.round(255 * to_srgb(_tone(small))).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class _Seen:
    """What each pixel sees: triangle (or -1), world position, depth, normal towards the eye."""

    owner: Integers
    places: Floats
    depths: Floats
    normals: Floats


def _drawn(soup: Soup, camera: Camera) -> tuple[Integers, Floats]:
    shape = (camera.height, camera.width)
    owner, inverse = np.full(shape, -1, dtype=np.int64), np.zeros(shape)
    screen = camera.project(soup.corners)
    screen[..., 2] = 1.0 / screen[..., 2]
    behind = np.any(screen[..., 2] <= 0.0, axis=1)
    screen[behind] = np.nan
    rasterise(np.ascontiguousarray(screen), inverse, owner)
    return owner, inverse


def _shaded(soup: Soup, camera: Camera, look: Look, seen: _Seen, points: Floats) -> Floats:
    sun = -directions(*look.sun)[2]
    shade = _shadow(soup, look, seen, points)
    facing = np.clip(seen.normals @ sun, 0.0, 1.0)
    open_sky = ambient_occlusion(
        seen.places, seen.depths, seen.normals, camera.eye, camera.axes, camera.focal,
        look.occlusion, OCCLUSION_RADIUS,
    )  # fmt: skip
    upward = (0.5 + 0.5 * seen.normals[..., 2:]) * open_sky[..., None]
    ambient = upward * np.array(look.sky_color) + (open_sky[..., None] - upward) * np.array(
        look.bounce
    )
    light = (facing * shade)[..., None] * np.array(look.sun_color) + ambient
    color = _surface(soup, look, seen, points)
    out = color * light
    _mirror(soup, camera, look, seen, out)
    _surroundings(camera, look, seen, points, out)
    if look.edges:
        out *= 1.0 - look.edges * _edges(soup, seen)[..., None]
    return out


def _shadow(soup: Soup, look: Look, seen: _Seen, points: Floats) -> Floats:
    frame = directions(*look.sun)
    frame[2] = -frame[2]
    local = points @ frame.T
    low, high = local.min(axis=0), local.max(axis=0)
    centre = (low + high) / 2
    per_metre = 0.98 * SHADOW_SIZE / max(float((high - low)[:2].max()), 1e-3)
    corners = soup.corners @ frame.T
    corners[..., 0] = SHADOW_SIZE / 2 + (corners[..., 0] - centre[0]) * per_metre
    corners[..., 1] = SHADOW_SIZE / 2 - (corners[..., 1] - centre[1]) * per_metre
    shadow = np.full((SHADOW_SIZE, SHADOW_SIZE), -1e9)
    rasterise(np.ascontiguousarray(corners), shadow, np.zeros(shadow.shape, dtype=np.int64))
    scale = np.array([centre[0], centre[1], per_metre, 1.5 / per_metre])
    return sunlight(seen.places, seen.depths, seen.normals, shadow, frame, scale)


def _surface(soup: Soup, look: Look, seen: _Seen, points: Floats) -> Floats:
    """Return the base colour of every pixel, linear light (h, w, 3)."""
    out = np.empty(seen.places.shape)
    out[:] = linear_rgb(look.ground_color)
    if not len(soup.corners):
        return out
    hit = seen.owner >= 0
    owner = seen.owner[hit]
    looks = soup.looks[owner]
    colors = soup.colors[looks]
    places, normals = seen.places[hit], soup.normals[owner]
    for index in np.unique(looks):
        rows = looks == index
        if soup.patterns[index]:
            factor = patterned(int(soup.patterns[index]), places[rows], normals[rows])
            colors[rows] *= factor[:, None]
        texture = soup.textures[index]
        if texture is not None:
            colors[rows] *= _texels(texture, soup, owner[rows], places[rows])
    out[hit] = colors
    return out


def _texels(texture: Floats, soup: Soup, owner: Integers, places: Floats) -> Floats:
    a, b, c = soup.corners[owner].transpose(1, 0, 2)
    ab, ac, ap = b - a, c - a, places - a
    d00, d01, d11 = (np.sum(p * q, axis=1) for p, q in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = np.sum(ap * ab, axis=1), np.sum(ap * ac, axis=1)
    scale = d00 * d11 - d01 * d01
    scale = np.where(scale == 0.0, 1.0, scale)
    v, w = (d11 * d20 - d01 * d21) / scale, (d00 * d21 - d01 * d20) / scale
    corners = soup.uv[owner]
    uv = (
        corners[:, 0]
        + v[:, None] * (corners[:, 1] - corners[:, 0])
        + w[:, None] * (corners[:, 2] - corners[:, 0])
    )
    height, width = texture.shape[:2]
    column = np.floor((uv[:, 0] % 1.0) * width).astype(np.int64) % width
    row = np.floor(((1.0 - uv[:, 1]) % 1.0) * height).astype(np.int64) % height
    texels: Floats = texture[row, column]
    return texels


def _sky(look: Look, height: Floats) -> Floats:
    """Return the sky's colour (…, 3) in directions of the given rise (-1..1)."""
    low, high = (np.array(linear_rgb(color)) for color in look.sky)
    mix = np.clip(height, 0.0, 1.0)[..., None] ** 0.6
    return low + (high - low) * mix


def _mirror(soup: Soup, camera: Camera, look: Look, seen: _Seen, out: Floats) -> None:
    """Let glossy surfaces show the sky that they mirror."""
    if not len(soup.corners):
        return
    glossy = (seen.owner >= 0) & (soup.gloss[soup.looks[seen.owner]] > 0.0)
    ray = seen.places[glossy] - camera.eye
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    normal = seen.normals[glossy]
    cosine = -np.sum(ray * normal, axis=1, keepdims=True)
    rise = (ray + 2.0 * cosine * normal)[:, 2]
    share = 0.1 + 0.75 * (1.0 - np.clip(cosine, 0.0, 1.0)) ** 3
    # Towards the horizon a window mirrors trees and neighbours more than sky.
    sky = _sky(look, rise) * np.clip(0.55 + 1.4 * rise, 0.18, 1.0)[:, None]
    out[glossy] = out[glossy] * (1.0 - share) + sky * share


def _surroundings(camera: Camera, look: Look, seen: _Seen, points: Floats, out: Floats) -> None:
    """Fill the sky; let the ground fade into it with the distance from the scene."""
    bare = seen.owner < 0
    rows = np.linspace(0.75, 0.0, camera.height)[:, None]
    backdrop = np.broadcast_to(_sky(look, rows * np.ones((1, camera.width))), out.shape)
    centre = (points.min(axis=0) + points.max(axis=0)) / 2
    reach = float(np.linalg.norm(points[:, :2] - centre[:2], axis=1).max()) + 1.0
    away = np.linalg.norm(seen.places[..., :2] - centre[:2], axis=2) / reach
    fade = np.clip((away - 1.0) / 1.6, 0.0, 1.0)
    fade = np.where(np.isfinite(seen.depths), fade * fade * (3.0 - 2.0 * fade), 1.0)[..., None]
    out[bare] = (out * (1.0 - fade) + backdrop * fade)[bare]


def _edges(soup: Soup, seen: _Seen) -> Floats:
    """Return 1 where neighbouring pixels see other parts, other planes or a step in depth."""
    out = np.zeros(seen.owner.shape)
    if not len(soup.corners):
        return out
    part = np.where(seen.owner >= 0, soup.parts[seen.owner] * 64 + soup.looks[seen.owner], -1)
    for axis in (0, 1):
        ahead, back = (_slices(axis, k) for k in (1, 0))
        bend = np.sum(seen.normals[ahead] * seen.normals[back], axis=2) < 0.75
        other = part[ahead] != part[back]
        step = np.abs(seen.depths[ahead] - seen.depths[back]) > 0.04
        sky = ~np.isfinite(seen.depths[ahead]) | ~np.isfinite(seen.depths[back])
        line = (bend | (other & step) | sky) & ((part[ahead] >= 0) | (part[back] >= 0))
        out[back] = np.maximum(out[back], line)
    return out


def _slices(axis: int, shift: int) -> tuple[slice, ...]:
    cut = slice(1, None) if shift else slice(None, -1)
    return (cut, slice(None)) if axis == 0 else (slice(None), cut)


def _tone(light: Floats) -> Floats:
    """Compress highlights smoothly: linear in the dark, 1 for infinitely bright."""
    scaled = 0.78 * light
    return np.where(scaled < 0.6, scaled, 0.6 + 0.4 * (1.0 - np.exp(-(scaled - 0.6) / 0.4)))
