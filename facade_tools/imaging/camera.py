"""Perspective cameras that look at a scene, and the frame of the sun's shadow map."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..geometry.arrays import Floats, Points3


@dataclass(frozen=True, slots=True)
class View:
    """From where a scene is seen.

    azimuth: degrees, 0 looks at the front, 90 at the right side. elevation: degrees above the
    horizon. size: (width, height) of the picture in pixels.
    """

    azimuth: float = -30.0
    elevation: float = 6.0
    size: tuple[int, int] = (960, 720)
    field: float = 25.0  # vertical angle of view, degrees


@dataclass(frozen=True, slots=True)
class Camera:
    """Pinhole at `eye`; rows of `axes` are right, up, forward; focal length in pixels."""

    eye: Floats
    axes: Floats
    focal: float
    width: int
    height: int

    def project(self, points: Points3) -> Points3:
        """Return pixel x (right), pixel y (down) and depth along the view, metres, of (…, 3)."""
        local = (points - self.eye) @ self.axes.T
        depth = local[..., 2]
        x = self.width / 2 + self.focal * local[..., 0] / depth
        y = self.height / 2 - self.focal * local[..., 1] / depth
        return np.stack([x, y, depth], axis=-1)


def directions(azimuth: float, elevation: float) -> Floats:
    """Return right, up and forward (rows) of a viewer who stands at these angles, degrees."""
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = np.array([-math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), -math.sin(e)])
    right = np.array([math.cos(a), math.sin(a), 0.0])
    return np.array([right, np.cross(right, forward), forward])


def fitted(points: Points3, view: View, samples: int = 1, margin: float = 0.06) -> Camera:
    """Return the camera of a view that shows all points (n, 3) as large as possible.

    samples: pixels along an edge of each picture pixel. margin: share of the picture that stays
    free around them.
    """
    width, height = view.size[0] * samples, view.size[1] * samples
    axes = directions(view.azimuth, view.elevation)
    tangent = np.array([width / height, 1.0]) * math.tan(math.radians(view.field) / 2)
    focal = height / 2 / tangent[1]
    free = tangent * (1.0 - margin)
    local = points @ axes.T
    # |x - c| <= free (z + d) for all points: the half-planes' envelopes meet at c and d.
    right_most = np.max(local[:, :2] - free * local[:, 2:], axis=0)
    left_most = np.max(-local[:, :2] - free * local[:, 2:], axis=0)
    centre = (right_most - left_most) / 2
    distance = float(np.max((right_most + left_most) / (2 * free)))
    behind = min(-distance, float(local[:, 2].min()) - 1e-3)
    eye = np.array([centre[0], centre[1], behind]) @ axes
    return Camera(eye, axes, float(focal), width, height)
