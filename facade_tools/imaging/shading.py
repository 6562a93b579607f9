"""Compiled shading: from what each pixel sees to the light that it sends."""

from __future__ import annotations

from math import cos, exp, floor, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers
from .surfaces import Soup

OCCLUSION_RADIUS = 0.9  # metres
STEP = 0.04  # metres of depth between neighbouring parts that make an outline


class Eye(NamedTuple):
    """Pinhole: position, rows right, up, forward; focal length in pixels; ground plane's z."""

    place: Floats
    axes: Floats
    focal: float
    ground: float


class Sun(NamedTuple):
    """Shadow map (s, s): height towards the sun of the first surface.

    axes: rows right, up, towards the sun. scale: centre x, y in the map's frame, pixels a metre,
    bias (m).
    """

    shadow: Floats
    axes: Floats
    scale: Floats


class Air(NamedTuple):
    """Light and surroundings, linear RGB.

    sun, sky, bounce: light from the sun, from above, from below. horizon, zenith, soil: colours.
    ball (k, 3): points of the unit ball for the occlusion. scene: centre x, y and radius of what
    is shown (m). edges: darkness of outlines, 0..1.
    """

    sun: Floats
    sky: Floats
    bounce: Floats
    horizon: Floats
    zenith: Floats
    soil: Floats
    ball: Floats
    scene: Floats
    edges: float


@compiled
def shade(owner: Integers, inverse: Floats, soup: Soup, eye: Eye, sun: Sun, air: Air) -> Floats:
    """Return linear light (h, w, 3) of pixels that see the triangle `owner` (-1: none).

    inverse (h, w): 1 / depth where there is a triangle.
    """
    height, width = owner.shape
    depths = _depths(owner, inverse, eye)
    out = np.empty((height, width, 3))
    point, normal, color = np.empty(3), np.empty(3), np.empty(3)
    for j in range(height):
        sky = 0.75 * (1.0 - j / height)
        for i in range(width):
            bare = owner[j, i] < 0
            fade = 1.0
            if depths[j, i] < np.inf:
                _place(i, j, depths[j, i], owner, eye, point)
                fade = _fade(point, air) if bare else 0.0
            if fade < 1.0:
                _facing(owner[j, i], point, soup, eye, normal)
                _base(owner[j, i], point, soup, air, color)
                open_share = 1.0
                if not bare or fade == 0.0:  # ground away from the scene has nothing over it
                    open_share = _open((i, j), point, normal, depths, eye, air.ball)
                _lit(point, normal, open_share, sun, air, color)
                if not bare and soup.gloss[soup.looks[owner[j, i]]] > 0.0:
                    _mirror(point, normal, eye, air, color)
            dark = air.edges * _outline(i, j, owner, depths, soup)
            for k in range(3):
                behind = _sky(k, sky, air)
                shown = color[k] if fade < 1.0 else 0.0
                out[j, i, k] = (shown * (1.0 - fade) + behind * fade) * (1.0 - dark)
    return out


@compiled
def _depths(owner: Integers, inverse: Floats, eye: Eye) -> Floats:
    """Return depths along the view; the ground plane where no triangle is, inf in the sky."""
    height, width = owner.shape
    out = np.full((height, width), np.inf)
    for j in range(height):
        sy = (height / 2 - j - 0.5) / eye.focal
        for i in range(width):
            sx = (i + 0.5 - width / 2) / eye.focal
            fall = sx * eye.axes[0, 2] + sy * eye.axes[1, 2] + eye.axes[2, 2]
            if owner[j, i] >= 0:
                out[j, i] = 1.0 / inverse[j, i]
            elif fall < -1e-6 and eye.ground > -1e8:
                out[j, i] = (eye.ground - eye.place[2]) / fall
    return out


@compiled
def _place(i: int, j: int, depth: float, owner: Integers, eye: Eye, point: Floats) -> None:
    height, width = owner.shape
    sx = (i + 0.5 - width / 2) / eye.focal
    sy = (height / 2 - j - 0.5) / eye.focal
    for k in range(3):
        ray = sx * eye.axes[0, k] + sy * eye.axes[1, k] + eye.axes[2, k]
        point[k] = eye.place[k] + depth * ray


@compiled
def _fade(point: Floats, air: Air) -> float:
    """Return how far the ground is lost in the sky: 0 at the scene, 1 far from it."""
    dx, dy = point[0] - air.scene[0], point[1] - air.scene[1]
    away = (sqrt(dx * dx + dy * dy) / air.scene[2] - 1.0) / 1.6
    t = min(max(away, 0.0), 1.0)
    return float(t * t * (3.0 - 2.0 * t))


@compiled
def _facing(triangle: int, point: Floats, soup: Soup, eye: Eye, normal: Floats) -> None:
    """Set the normal that faces the eye."""
    if triangle < 0:
        normal[0], normal[1], normal[2] = 0.0, 0.0, 1.0
        return
    towards = 0.0
    for k in range(3):
        normal[k] = soup.normals[triangle, k]
        towards += normal[k] * (eye.place[k] - point[k])
    if towards < 0.0:
        for k in range(3):
            normal[k] = -normal[k]


@compiled
def _base(triangle: int, point: Floats, soup: Soup, air: Air, color: Floats) -> None:
    """Set the surface's own colour: material, pattern, texture."""
    if triangle < 0:
        for k in range(3):
            color[k] = air.soil[k]
        return
    look = soup.looks[triangle]
    factor = 1.0
    if soup.patterns[look] > 0:
        factor = _pattern(soup.patterns[look], point, soup.normals[triangle])
    for k in range(3):
        color[k] = soup.colors[look, k] * factor
    if soup.pictures[look, 1] > 0:
        _texture(triangle, soup.pictures[look], point, soup, color)


@compiled
def _pattern(pattern: int, point: Floats, normal: Floats) -> float:
    """Return the brightness of a pattern (index into PATTERNS) at a point."""
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
def _courses(point: Floats, normal: Floats, across: float, along: float, depth: float) -> float:
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
def _texture(triangle: int, picture: Integers, point: Floats, soup: Soup, color: Floats) -> None:
    """Multiply the colour with the nearest texel."""
    d00 = d01 = d11 = d20 = d21 = 0.0
    for k in range(3):
        ab = soup.corners[triangle, 1, k] - soup.corners[triangle, 0, k]
        ac = soup.corners[triangle, 2, k] - soup.corners[triangle, 0, k]
        ap = point[k] - soup.corners[triangle, 0, k]
        d00, d01, d11 = d00 + ab * ab, d01 + ab * ac, d11 + ac * ac
        d20, d21 = d20 + ap * ab, d21 + ap * ac
    scale = d00 * d11 - d01 * d01
    if scale == 0.0:
        return
    b, c = (d11 * d20 - d01 * d21) / scale, (d00 * d21 - d01 * d20) / scale
    at = soup.uv[triangle]
    u = at[0, 0] + b * (at[1, 0] - at[0, 0]) + c * (at[2, 0] - at[0, 0])
    v = at[0, 1] + b * (at[1, 1] - at[0, 1]) + c * (at[2, 1] - at[0, 1])
    first, height, width = picture
    column = min(int((u - floor(u)) * width), width - 1)
    row = min(int((1.0 - (v - floor(v))) * height), height - 1)
    for k in range(3):
        color[k] *= soup.texels[first + row * width + column, k]


@compiled
def _open(
    pixel: tuple[int, int], point: Floats, normal: Floats, depths: Floats, eye: Eye, ball: Floats
) -> float:
    """Return the open share of the hemisphere over a pixel, from the depths around it.

    The sample points are turned by a hash of the pixel, so that a picture's bytes do not depend
    on a generator.
    """
    height, width = depths.shape
    angle = ((pixel[0] * 73856093 ^ pixel[1] * 19349663) & 0xFFFF) * (2.0 * pi / 65536.0)
    cosine, sine = cos(angle), sin(angle)
    hidden = 0.0
    for k in range(len(ball)):
        dx = cosine * ball[k, 0] - sine * ball[k, 1]
        dy = sine * ball[k, 0] + cosine * ball[k, 1]
        dz = ball[k, 2]
        side = 1.0 if dx * normal[0] + dy * normal[1] + dz * normal[2] >= 0.0 else -1.0
        x = point[0] + OCCLUSION_RADIUS * (side * dx + 0.05 * normal[0]) - eye.place[0]
        y = point[1] + OCCLUSION_RADIUS * (side * dy + 0.05 * normal[1]) - eye.place[1]
        z = point[2] + OCCLUSION_RADIUS * (side * dz + 0.05 * normal[2]) - eye.place[2]
        far = x * eye.axes[2, 0] + y * eye.axes[2, 1] + z * eye.axes[2, 2]
        if far <= 1e-6:
            continue
        right = x * eye.axes[0, 0] + y * eye.axes[0, 1] + z * eye.axes[0, 2]
        up = x * eye.axes[1, 0] + y * eye.axes[1, 1] + z * eye.axes[1, 2]
        column = int(width / 2 + eye.focal * right / far)
        row = int(height / 2 - eye.focal * up / far)
        if 0 <= column < width and 0 <= row < height:
            gap = far - depths[row, column]
            if gap > 0.02 * OCCLUSION_RADIUS:
                near = 1.5 * OCCLUSION_RADIUS
                hidden += 1.0 if gap < near else max(near / gap - 0.3, 0.0)
    return 1.0 - hidden / max(len(ball), 1)


@compiled
def _sunlit(point: Floats, normal: Floats, sun: Sun) -> float:
    """Return the share of sunlight by percentage-closer filtering of the shadow map."""
    size = sun.shadow.shape[0]
    x = y = z = 0.0
    for k in range(3):
        at = point[k] + 0.03 * normal[k]
        x, y, z = x + sun.axes[0, k] * at, y + sun.axes[1, k] * at, z + sun.axes[2, k] * at
    column = size / 2 + (x - sun.scale[0]) * sun.scale[2]
    row = size / 2 - (y - sun.scale[1]) * sun.scale[2]
    lit = 0
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            r, c = floor(row + 0.8 * dy), floor(column + 0.8 * dx)
            inside = 0 <= r < size and 0 <= c < size
            lit += not inside or sun.shadow[r, c] <= z + sun.scale[3]
    return lit / 9.0


@compiled
def _lit(
    point: Floats, normal: Floats, open_share: float, sun: Sun, air: Air, color: Floats
) -> None:
    """Multiply the colour with the light that falls on it."""
    direct = 0.0
    for k in range(3):
        direct += sun.axes[2, k] * normal[k]
    direct = max(direct, 0.0)
    if direct > 0.0:
        direct *= _sunlit(point, normal, sun)
    above = (0.5 + 0.5 * normal[2]) * open_share
    for k in range(3):
        around = above * air.sky[k] + (open_share - above) * air.bounce[k]
        color[k] *= direct * air.sun[k] + around


@compiled
def _sky(k: int, rise: float, air: Air) -> float:
    """Return channel k of the sky in a direction of the given rise (0 horizon, 1 overhead)."""
    return float(air.horizon[k] + (air.zenith[k] - air.horizon[k]) * max(rise, 0.0) ** 0.6)


@compiled
def _mirror(point: Floats, normal: Floats, eye: Eye, air: Air, color: Floats) -> None:
    """Add what a glossy surface mirrors; towards the horizon it is trees more than sky."""
    length = dot = 0.0
    for k in range(3):
        ray = point[k] - eye.place[k]
        length += ray * ray
        dot += ray * normal[k]
    length = sqrt(length)
    cosine = min(max(-dot / length, 0.0), 1.0)
    rise = (point[2] - eye.place[2]) / length + 2.0 * cosine * normal[2]
    share = 0.1 + 0.75 * (1.0 - cosine) ** 3
    bright = min(max(0.5 + 1.6 * rise, 0.18), 1.0)
    for k in range(3):
        color[k] = color[k] * (1.0 - share) + _sky(k, rise, air) * bright * share


@compiled
def _outline(i: int, j: int, owner: Integers, depths: Floats, soup: Soup) -> float:
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
            bend += soup.normals[a, k] * soup.normals[b, k]
        if bend < 0.75:
            return 1.0
        other = soup.parts[a] != soup.parts[b] or soup.looks[a] != soup.looks[b]
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
