"""Compiled shading: from what each pixel sees to the light that it sends.

Points and colours are tuples, not arrays, and tables are taken out of their records once: numba
counts references to an array wherever it is looked up, which cost more than the shading itself.
"""

from __future__ import annotations

from math import cos, exp, floor, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from .raster import texel
from .surfaces import Soup

Three = tuple[float, float, float]  # a point or direction (m), or linear RGB

OCCLUSION_RADIUS = 0.9  # metres
STEP = 0.04  # metres of depth between neighbouring parts that make an outline


class Eye(NamedTuple):
    """Pinhole: position, axes right, up, forward; focal length in pixels; ground plane's z."""

    place: Three
    axes: tuple[Three, Three, Three]
    focal: float
    ground: float


class Sun(NamedTuple):
    """Light from above: axes right, up, towards the sun; how a point falls on the shadow map.

    scale: centre x, y in the map's frame, pixels a metre, bias (m).
    """

    axes: tuple[Three, Three, Three]
    scale: tuple[float, float, float, float]


class Air(NamedTuple):
    """Light and surroundings, linear RGB.

    sun, sky, bounce: light from the sun, from above, from below. horizon, zenith, soil: colours.
    scene: centre x, y and radius of what is shown (m). edges: darkness of outlines, 0..1.
    """

    sun: Three
    sky: Three
    bounce: Three
    horizon: Three
    zenith: Three
    soil: Three
    scene: Three
    edges: float


class Light(NamedTuple):
    """What lights a scene.

    shadow (s, s): height towards the sun of the first surface. ball (k, 3): points of the unit
    ball for the occlusion.
    """

    sun: Sun
    air: Air
    shadow: Floats
    ball: Floats


@compiled
def shade(
    owner: Integers, inverse: Floats, soup: Soup, eye: Eye, light: Light, samples: int
) -> Floats:
    """Return the mean linear light (h / samples, w / samples, 3) of blocks of samples.

    owner (h, w): the triangle that a sample sees, -1: none. inverse (h, w): 1 / depth where there
    is a triangle.
    """
    height, width = owner.shape
    out = np.zeros((height // samples, width // samples, 3))
    depths = _depths(owner, inverse, eye)
    sun, air, shadow, ball = light.sun, light.air, light.shadow, _turnable(light.ball, eye)
    normals, parts, looks, gloss = soup.normals, soup.parts, soup.looks, soup.gloss
    colors, patterns, pictures = soup.colors, soup.patterns, soup.pictures
    for j in range(height):
        behind = _sky(0.75 * (1.0 - j / height), air)
        for i in range(width):
            t = owner[j, i]
            fade, point, color = 1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
            if depths[j, i] < np.inf:
                point = _place(i, j, width, height, depths[j, i], eye)
                fade = _fade(point, air) if t < 0 else 0.0
            if fade < 1.0:
                normal, color, open_share = (0.0, 0.0, 1.0), air.soil, 1.0
                if t >= 0:
                    look = looks[t]
                    normal = (normals[t, 0], normals[t, 1], normals[t, 2])
                    color = (colors[look, 0], colors[look, 1], colors[look, 2])
                    if patterns[look] > 0:
                        color = _scaled(_pattern(patterns[look], point, normal), color)
                    if pictures[look, 1] > 0:
                        color = _textured(t, point, soup, color)
                    normal = _facing(normal, point, eye)
                if t >= 0 or fade == 0.0:  # ground away from the scene has nothing over it
                    open_share = _open(i, j, normal, depths, eye, ball)
                color = _lit(point, normal, open_share, sun, shadow, air, color)
                if t >= 0 and gloss[looks[t]] > 0.0:
                    color = _mirror(point, normal, eye, air, color)
            dark = air.edges * _outline(i, j, owner, depths, normals, parts, looks)
            for k in range(3):
                seen = (color[k] * (1.0 - fade) + behind[k] * fade) * (1.0 - dark)
                out[j // samples, i // samples, k] += seen
    return out / (samples * samples)


@compiled
def _textured(t: int, point: Three, soup: Soup, color: Three) -> Three:
    """Return a colour times the nearest texel of triangle t."""
    first, height, width = soup.pictures[soup.looks[t]]
    u, v = _uv(t, point, soup.corners, soup.uv)
    row = first + texel(u, v, height, width)
    texels, tones = soup.texels, soup.tones
    return (
        color[0] * tones[texels[row, 0]],
        color[1] * tones[texels[row, 1]],
        color[2] * tones[texels[row, 2]],
    )


@compiled
def _scaled(factor: float, row: Three) -> Three:
    return factor * row[0], factor * row[1], factor * row[2]


@compiled
def _dot(a: Three, b: Three) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _depths(owner: Integers, inverse: Floats, eye: Eye) -> Floats:
    """Return depths along the view; the ground plane where no triangle is, inf in the sky."""
    height, width = owner.shape
    out = np.full((height, width), np.inf)
    right, up, forward = eye.axes
    for j in range(height):
        sy = (height / 2 - j - 0.5) / eye.focal
        for i in range(width):
            sx = (i + 0.5 - width / 2) / eye.focal
            fall = sx * right[2] + sy * up[2] + forward[2]
            if owner[j, i] >= 0:
                out[j, i] = 1.0 / inverse[j, i]
            elif fall < -1e-6 and eye.ground > -1e8:
                out[j, i] = (eye.ground - eye.place[2]) / fall
    return out


@compiled
def _place(i: int, j: int, width: int, height: int, depth: float, eye: Eye) -> Three:
    """Return the point that a pixel sees."""
    sx = (i + 0.5 - width / 2) / eye.focal
    sy = (height / 2 - j - 0.5) / eye.focal
    right, up, forward = eye.axes
    place = eye.place
    return (
        place[0] + depth * (sx * right[0] + sy * up[0] + forward[0]),
        place[1] + depth * (sx * right[1] + sy * up[1] + forward[1]),
        place[2] + depth * (sx * right[2] + sy * up[2] + forward[2]),
    )


@compiled
def _fade(point: Three, air: Air) -> float:
    """Return how far the ground is lost in the sky: 0 at the scene, 1 far from it."""
    dx, dy = point[0] - air.scene[0], point[1] - air.scene[1]
    away = (sqrt(dx * dx + dy * dy) / air.scene[2] - 1.0) / 1.6
    t = min(max(away, 0.0), 1.0)
    return float(t * t * (3.0 - 2.0 * t))


@compiled
def _facing(normal: Three, point: Three, eye: Eye) -> Three:
    """Return the normal that faces the eye."""
    place = eye.place
    towards = _dot(normal, (place[0] - point[0], place[1] - point[1], place[2] - point[2]))
    return _scaled(-1.0 if towards < 0.0 else 1.0, normal)


@compiled
def _pattern(pattern: int, point: Three, normal: Three) -> float:
    """Return the brightness of a pattern (index into PATTERNS) at a point."""
    if pattern == 0:
        return 1.0
    if pattern == 1:
        board = point[2] / 0.17
        within = board - floor(board)
        return 0.78 if within < 0.16 else 1.0 + 0.06 * (within - 0.5)
    if pattern == 2:
        return _courses(point, normal, 0.33, 0.26, 0.3)
    if pattern == 3:
        return _courses(point, normal, 0.26, 0.085, 0.22)
    return _courses(point, normal, 0.55, 0.28, 0.25)


@compiled
def _courses(point: Three, normal: Three, across: float, along: float, depth: float) -> float:
    """Staggered tiles in rows, each a little lighter or darker than the next.

    across, along: size of a tile (m). depth: darkness of the joints.
    """
    slope = sqrt(normal[0] * normal[0] + normal[1] * normal[1])
    if slope < 0.05:
        return 1.0
    level = (point[1] * normal[0] - point[0] * normal[1]) / slope
    up = point[2] / slope / along
    row = floor(up)
    column = level / across + 0.5 * (row % 2)
    cell = floor(column)
    noise = sin(cell * 12.9898 + row * 78.233) * 43758.5453
    tint = 1.0 + 0.16 * (noise - floor(noise) - 0.5)
    joint = up - row < 0.16 or column - cell < 0.05
    return tint * (1.0 - depth) if joint else tint


@compiled
def _uv(t: int, point: Three, corners: Floats, uv: Floats) -> tuple[float, float]:
    """Return the texture coordinates of a point of triangle t."""
    d00 = d01 = d11 = d20 = d21 = 0.0
    for k in range(3):
        ab = corners[t, 1, k] - corners[t, 0, k]
        ac = corners[t, 2, k] - corners[t, 0, k]
        ap = point[k] - corners[t, 0, k]
        d00, d01, d11 = d00 + ab * ab, d01 + ab * ac, d11 + ac * ac
        d20, d21 = d20 + ap * ab, d21 + ap * ac
    scale = d00 * d11 - d01 * d01
    if scale == 0.0:
        return uv[t, 0, 0], uv[t, 0, 1]
    b, c = (d11 * d20 - d01 * d21) / scale, (d00 * d21 - d01 * d20) / scale
    return (
        uv[t, 0, 0] + b * (uv[t, 1, 0] - uv[t, 0, 0]) + c * (uv[t, 2, 0] - uv[t, 0, 0]),
        uv[t, 0, 1] + b * (uv[t, 1, 1] - uv[t, 0, 1]) + c * (uv[t, 2, 1] - uv[t, 0, 1]),
    )


@compiled
def _open(i: int, j: int, normal: Three, depths: Floats, eye: Eye, ball: Floats) -> float:
    """Return the open share of the hemisphere over a pixel, from the depths around it.

    The sample points are turned by a hash of the pixel, so that a picture's bytes do not depend
    on a generator.
    """
    height, width = depths.shape
    angle = ((i * 73856093 ^ j * 19349663) & 0xFFFF) * (2.0 * pi / 65536.0)
    cosine, sine = cos(angle), sin(angle)
    lift, near = 0.05 * OCCLUSION_RADIUS, 1.5 * OCCLUSION_RADIUS
    outward = _in_view(normal, eye)
    x0 = (i + 0.5 - width / 2) / eye.focal * depths[j, i] + lift * outward[0]
    y0 = (height / 2 - j - 0.5) / eye.focal * depths[j, i] + lift * outward[1]
    z0 = depths[j, i] + lift * outward[2]
    hidden = 0.0
    for k in range(len(ball)):
        x = cosine * ball[k, 0] + sine * ball[k, 3]
        y = cosine * ball[k, 1] + sine * ball[k, 4] + ball[k, 6]
        z = cosine * ball[k, 2] + sine * ball[k, 5] + ball[k, 7]
        outer = x * outward[0] + y * outward[1] + z * outward[2] >= 0.0
        reach = OCCLUSION_RADIUS if outer else -OCCLUSION_RADIUS
        far = z0 + reach * z
        if far <= 1e-6:
            continue
        scale = eye.focal / far
        column = int(width / 2 + scale * (x0 + reach * x))
        row = int(height / 2 - scale * (y0 + reach * y))
        if 0 <= column < width and 0 <= row < height:
            gap = far - depths[row, column]
            if gap > 0.02 * OCCLUSION_RADIUS:
                hidden += 1.0 if gap < near else max(near / gap - 0.3, 0.0)
    return 1.0 - hidden / max(len(ball), 1)


@compiled
def _in_view(vector: Three, eye: Eye) -> Three:
    """Return a direction's components to the right, up and forward."""
    right, up, forward = eye.axes
    return _dot(right, vector), _dot(up, vector), _dot(forward, vector)


@compiled
def _turnable(ball: Floats, eye: Eye) -> Floats:
    """Return what points (k, 3) are in the view when they turn about the vertical, rows (k, 8).

    Of each row: right, up, forward of the cosine's share and of the sine's; up, forward at rest.
    """
    out = np.empty((len(ball), 8))
    for k in range(len(ball)):
        x, y, z = ball[k, 0], ball[k, 1], ball[k, 2]
        out[k, 0], out[k, 1], out[k, 2] = _in_view((x, y, 0.0), eye)
        out[k, 3], out[k, 4], out[k, 5] = _in_view((-y, x, 0.0), eye)
        _, out[k, 6], out[k, 7] = _in_view((0.0, 0.0, z), eye)
    return out


@compiled
def _sunlit(point: Three, normal: Three, sun: Sun, shadow: Floats) -> float:
    """Return the share of sunlight by percentage-closer filtering of the shadow map."""
    size = shadow.shape[0]
    at = (
        point[0] + 0.03 * normal[0],
        point[1] + 0.03 * normal[1],
        point[2] + 0.03 * normal[2],
    )
    right, up, towards = sun.axes
    column = size / 2 + (_dot(right, at) - sun.scale[0]) * sun.scale[2]
    row = size / 2 - (_dot(up, at) - sun.scale[1]) * sun.scale[2]
    limit = _dot(towards, at) + sun.scale[3]
    lit = 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            r, c = floor(row + 0.8 * dy), floor(column + 0.8 * dx)
            inside = 0 <= r < size and 0 <= c < size
            lit += not inside or shadow[r, c] <= limit
    return lit / 9.0


@compiled
def _lit(
    point: Three,
    normal: Three,
    open_share: float,
    sun: Sun,
    shadow: Floats,
    air: Air,
    color: Three,
) -> Three:
    """Return the colour in the light that falls on it."""
    direct = max(_dot(sun.axes[2], normal), 0.0)
    if direct > 0.0:
        direct *= _sunlit(point, normal, sun, shadow)
    above = (0.5 + 0.5 * normal[2]) * open_share
    below = open_share - above
    return (
        color[0] * (direct * air.sun[0] + (above * air.sky[0] + below * air.bounce[0])),
        color[1] * (direct * air.sun[1] + (above * air.sky[1] + below * air.bounce[1])),
        color[2] * (direct * air.sun[2] + (above * air.sky[2] + below * air.bounce[2])),
    )


@compiled
def _sky(rise: float, air: Air) -> Three:
    """Return the sky in a direction of the given rise (0 horizon, 1 overhead)."""
    share = max(rise, 0.0) ** 0.6
    low, high = air.horizon, air.zenith
    return (
        low[0] + (high[0] - low[0]) * share,
        low[1] + (high[1] - low[1]) * share,
        low[2] + (high[2] - low[2]) * share,
    )


@compiled
def _mirror(point: Three, normal: Three, eye: Eye, air: Air, color: Three) -> Three:
    """Return a colour with what a glossy surface mirrors.

    Towards the horizon it is trees more than sky.
    """
    place = eye.place
    ray = (point[0] - place[0], point[1] - place[1], point[2] - place[2])
    length = sqrt(_dot(ray, ray))
    cosine = min(max(-_dot(ray, normal) / length, 0.0), 1.0)
    rise = ray[2] / length + 2.0 * cosine * normal[2]
    share = 0.1 + 0.75 * (1.0 - cosine) ** 3
    bright = min(max(0.5 + 1.6 * rise, 0.18), 1.0)
    sky = _sky(rise, air)
    return (
        color[0] * (1.0 - share) + sky[0] * bright * share,
        color[1] * (1.0 - share) + sky[1] * bright * share,
        color[2] * (1.0 - share) + sky[2] * bright * share,
    )


@compiled
def _outline(
    i: int,
    j: int,
    owner: Integers,
    depths: Floats,
    normals: Floats,
    parts: Integers,
    looks: Integers,
) -> float:
    """Return 1 where the pixel and its right or lower neighbour see different planes or parts."""
    height, width = owner.shape
    a = owner[j, i]
    for step in range(2):
        column, row = i + 1 - step, j + step
        if column >= width or row >= height:
            continue
        b = owner[row, column]
        if a == b:
            continue
        if a < 0 or b < 0:
            if depths[j, i] == np.inf or depths[row, column] == np.inf:
                return 1.0
            continue
        bend = 0.0
        for k in range(3):
            bend += normals[a, k] * normals[b, k]
        if bend < 0.75:
            return 1.0
        other = parts[a] != parts[b] or looks[a] != looks[b]
        if other and abs(depths[j, i] - depths[row, column]) > STEP:
            return 1.0
    return 0.0


@compiled
def tone(light: Floats) -> None:
    """Compress highlights in place: linear in the dark, 1 for infinitely bright."""
    flat = light.reshape(-1)
    for i in range(len(flat)):
        scaled = 0.78 * flat[i]
        flat[i] = scaled if scaled < 0.6 else 0.6 + 0.4 * (1.0 - exp(-(scaled - 0.6) / 0.4))
