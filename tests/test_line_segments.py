"""Line segments along the edges of pictures."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from facade_tools.imaging import line_segments as module
from facade_tools.imaging.edges import edges
from facade_tools.imaging.line_segments import line_segments

PHOTOS = Path(__file__).parent.parent / "sample_data" / "photos"


def square(turn, size=200, side=90):
    """A dark square on a light ground, turned by degrees; its corners (4, 2)."""
    grey = np.full((size, size), 200, np.uint8)
    corners = cv2.boxPoints(((size / 2, size / 2), (side, side), turn))
    cv2.fillConvexPoly(grey, np.round(corners).astype(np.int32), 40)
    return grey, np.round(corners)


@pytest.mark.parametrize("turn", [0, 11, 30, 45, 77])
def test_the_sides_of_a_square_are_found(turn):
    grey, corners = square(turn)
    found = line_segments(grey, 30)
    for one, other in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        way = (other - one) / np.linalg.norm(other - one)
        ends = found.reshape(-1, 2, 2) - one
        away = np.abs(ends[..., 0] * way[1] - ends[..., 1] * way[0]).max(axis=1)
        along = (ends @ way)[away < 2.0]
        assert along.max() - along.min() == pytest.approx(np.linalg.norm(other - one), abs=8)
    lengths = np.hypot(found[:, 2] - found[:, 0], found[:, 3] - found[:, 1])
    assert lengths.min() >= 30


def test_curves_and_flat_pictures_hold_none():
    grey = np.full((120, 160), 90, np.uint8)
    assert line_segments(grey, 10).shape == (0, 4)
    cv2.circle(grey, (80, 60), 30, 220, -1)
    assert len(line_segments(grey, 25)) == 0


@pytest.mark.parametrize("name", ["facade-1.jpg", "facade-2.jpg", "at-an-angle.jpg"])
def test_edges_are_those_of_opencv(name):
    grey = cv2.imread(str(PHOTOS / name), cv2.IMREAD_GRAYSCALE)
    np.testing.assert_array_equal(edges(grey, 50, 120) > 0, cv2.Canny(grey, 50, 120) > 0)
    assert edges(grey, 50, 120).mean() > 0.02


def test_lines_along_the_border_do_not_count():
    grey = np.full((120, 160), 90, np.uint8)
    grey[:4] = 220
    grey[:, 70:] = 220
    found = line_segments(grey, 20)
    assert len(found) >= 1
    assert np.abs(found[:, [0, 2]] - 70).max() < 2


@pytest.mark.parametrize("shape", [(200, 150), (480, 360)])
def test_pictures_of_many_edges_are_taken(shape):
    """OpenCV's Canny writes beyond its memory and takes the process with it."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    joints = (y % 4 < 1) | ((x + y // 4 % 2 * 4) % 8 < 1)
    noise = np.random.default_rng(0).normal(0, 8, shape)
    grey = np.clip(np.where(joints, 190, 90) + noise, 0, 255).astype(np.uint8)
    assert edges(grey, 50, 120).mean() > 0.5
    assert len(line_segments(grey, 8)) > 10


@pytest.mark.parametrize("shape", [(1, 1), (1, 90), (90, 1), (7, 5), (16, 16), (100, 75)])
def test_pictures_of_any_size_and_any_noise_are_taken(shape):
    for seed in range(5):
        grey = np.random.default_rng(seed).integers(0, 256, shape).astype(np.uint8)
        for picture in (grey, cv2.GaussianBlur(grey, (0, 0), 2.0)):
            found = line_segments(picture, 8)
            assert np.isfinite(found).all()
            assert (found >= -1).all()
            assert (found <= max(shape)).all()


def test_the_compiled_loops_do_what_is_written():
    marks = edges(square(20, 60, 30)[0], 50, 120)
    plain = module._segments.py_func(marks.copy(), 8)
    np.testing.assert_array_equal(plain, module._segments(marks.copy(), 8))
    assert len(plain) >= 4
