"""Compiled kernels of the software renderer: triangles to pixels, occlusion, shadow."""

from __future__ import annotations

import math

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Floats, Integers


@compiled
def rasterise(corners: Floats, depth: Floats, owner: Integers) -> None:
    """Draw triangles (m, 3, 3) of pixel x, y and a depth value that is linear on the screen.

    depth (h, w) keeps the largest value, owner (h, w) the index of its triangle. A pixel counts
    when its centre lies inside or on an edge.
    """
    height, width = depth.shape
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0]
        bx, by, bz = corners[t, 1]
        cx, cy, cz = corners[t, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0 or not math.isfinite(area):
            continue
        x0 = max(0, int(math.floor(min(ax, bx, cx) - 0.5)))
        x1 = min(width - 1, int(math.ceil(max(ax, bx, cx) - 0.5)))
        y0 = max(0, int(math.floor(min(ay, by, cy) - 0.5)))
        y1 = min(height - 1, int(math.ceil(max(ay, by, cy) - 0.5)))
        for j in range(y0, y1 + 1):
            py = j + 0.5
            for i in range(x0, x1 + 1):
                px = i + 0.5
                wa = ((bx - px) * (cy - py) - (cx - px) * (by - py)) / area
                wb = ((cx - px) * (ay - py) - (ax - px) * (cy - py)) / area
                wc = 1.0 - wa - wb
                if wa < 0.0 or wb < 0.0 or wc < 0.0:
                    continue
                value = wa * az + wb * bz + wc * cz
                if value > depth[j, i]:
                    depth[j, i] = value
                    owner[j, i] = t


@compiled
def positions(
    inverse: Floats, owner: Integers, eye: Floats, axes: Floats, lens: Floats
) -> tuple[Floats, Floats]:
    """Return world positions (h, w, 3) and depths (h, w) of all pixels.

    Pixels without a triangle take the ground plane; those that look at the sky get depth inf.
    lens: focal length (pixels) and height of the ground plane (m).
    """
    height, width = inverse.shape
    points = np.empty((height, width, 3))
    depths = np.empty((height, width))
    for j in range(height):
        for i in range(width):
            sx = (i + 0.5 - width / 2) / lens[0]
            sy = (height / 2 - j - 0.5) / lens[0]
            fall = sx * axes[0, 2] + sy * axes[1, 2] + axes[2, 2]
            z = np.inf
            if owner[j, i] >= 0:
                z = 1.0 / inverse[j, i]
            elif fall < -1e-6:
                z = (lens[1] - eye[2]) / fall
            depths[j, i] = z
            for k in range(3):
                ray = sx * axes[0, k] + sy * axes[1, k] + axes[2, k]
                points[j, i, k] = eye[k] + z * ray if z < np.inf else ray
    return points, depths


@compiled
def ambient_occlusion(
    points: Floats,
    depths: Floats,
    normals: Floats,
    eye: Floats,
    axes: Floats,
    focal: float,
    samples: Floats,
    radius: float,
) -> Floats:
    """Return the open share (h, w) of the hemisphere over each pixel, from the depths around it.

    samples: (k, 3) points of the unit ball; they are turned by a hash of the pixel, so that a
    picture's bytes do not depend on a generator.
    """
    height, width = depths.shape
    out = np.ones((height, width))
    for j in range(height):
        for i in range(width):
            z = depths[j, i]
            if z == np.inf:
                continue
            seed = (i * 73856093 ^ j * 19349663) & 0xFFFF
            angle = seed * (2.0 * math.pi / 65536.0)
            cosine, sine = math.cos(angle), math.sin(angle)
            hidden = 0.0
            for k in range(len(samples)):
                dx = cosine * samples[k, 0] - sine * samples[k, 1]
                dy = sine * samples[k, 0] + cosine * samples[k, 1]
                dz = samples[k, 2]
                facing = dx * normals[j, i, 0] + dy * normals[j, i, 1] + dz * normals[j, i, 2]
                if facing < 0.0:
                    dx, dy, dz = -dx, -dy, -dz
                x = points[j, i, 0] + radius * (dx + 0.05 * normals[j, i, 0]) - eye[0]
                y = points[j, i, 1] + radius * (dy + 0.05 * normals[j, i, 1]) - eye[1]
                h = points[j, i, 2] + radius * (dz + 0.05 * normals[j, i, 2]) - eye[2]
                far = x * axes[2, 0] + y * axes[2, 1] + h * axes[2, 2]
                if far <= 1e-6:
                    continue
                right = x * axes[0, 0] + y * axes[0, 1] + h * axes[0, 2]
                up = x * axes[1, 0] + y * axes[1, 1] + h * axes[1, 2]
                column = int(width / 2 + focal * right / far)
                row = int(height / 2 - focal * up / far)
                if 0 <= column < width and 0 <= row < height:
                    gap = far - depths[row, column]
                    if gap > 0.02 * radius:
                        hidden += 1.0 if gap < 1.5 * radius else 1.5 * radius / gap - 0.3
            out[j, i] = 1.0 - max(hidden, 0.0) / len(samples)
    return out


@compiled
def sunlight(
    points: Floats, depths: Floats, normals: Floats, shadow: Floats, frame: Floats, scale: Floats
) -> Floats:
    """Return the share of sunlight (h, w) by percentage-closer filtering of a shadow map.

    shadow (s, s): height towards the sun of the first surface. frame (3, 3): rows right, up,
    towards the sun. scale: centre x, y in the frame, pixels a metre, bias (m).
    """
    height, width = depths.shape
    size = shadow.shape[0]
    out = np.ones((height, width))
    for j in range(height):
        for i in range(width):
            if depths[j, i] == np.inf:
                continue
            local = np.zeros(3)
            for k in range(3):
                for m in range(3):
                    local[k] += frame[k, m] * (points[j, i, m] + 0.03 * normals[j, i, m])
            x = size / 2 + (local[0] - scale[0]) * scale[2]
            y = size / 2 - (local[1] - scale[1]) * scale[2]
            lit = 0.0
            for dy in range(-1, 2):
                for dx in range(-1, 2):
                    column, row = int(x + 0.8 * dx), int(y + 0.8 * dy)
                    if not (0 <= column < size and 0 <= row < size):
                        lit += 1.0
                    elif shadow[row, column] <= local[2] + scale[3]:
                        lit += 1.0
            out[j, i] = lit / 9.0
    return out
