"""Varied copies of training pictures: mirror, light, blur, noise, small perspective."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Picture
from .autocontext import Labels


def varied(picture: Picture, labels: Labels, *, rng: np.random.Generator) -> tuple[Picture, Labels]:
    """Return a changed copy of a picture and its labels; what comes into view is ignored (0)."""
    warp = _perspective(picture.shape, rng)
    size = (picture.shape[1], picture.shape[0])
    moved = cv2.warpPerspective(picture, warp, size, borderMode=cv2.BORDER_REPLICATE)
    known = cv2.warpPerspective(labels, warp, size, flags=cv2.INTER_NEAREST)
    return relit(moved.astype(np.uint8), rng=rng), known.astype(np.uint8)


def _perspective(shape: tuple[int, ...], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a homography that moves each corner by up to 2% and mirrors half of the pictures."""
    height, width = shape[:2]
    corners = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    target = corners + rng.uniform(-0.02, 0.02, (4, 2)).astype(np.float32) * [width, height]
    if rng.random() < 0.5:
        target[:, 0] = width - target[:, 0]
    return cv2.getPerspectiveTransform(corners, target.astype(np.float32)).astype(np.float64)


def relit(picture: Picture, *, rng: np.random.Generator) -> Picture:
    """Return a picture in another light: gain, gamma, colour cast, blur and noise."""
    shares = (picture.astype(np.float32) / 255) ** rng.uniform(0.75, 1.35)
    shares *= rng.uniform(0.8, 1.2) * (1 + rng.uniform(-0.06, 0.06, 3)).astype(np.float32)
    if rng.random() < 0.4:
        shares = cv2.GaussianBlur(shares, (0, 0), rng.uniform(0.3, 1.2)).astype(np.float32)
    shares += rng.normal(0, rng.uniform(0, 0.02), shares.shape).astype(np.float32)
    return (255 * np.clip(shares, 0, 1)).astype(np.uint8)
