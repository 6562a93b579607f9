"""Surfaces from photographs: quilts, exemplars, rims."""

from __future__ import annotations

import numpy as np
import pytest

from facade_tools.artifacts.parse import LABELS
from facade_tools.reconstruction.surfaces import (
    Canvas,
    _exemplars,
    largest_rectangle,
    without_rim,
)
from facade_tools.reconstruction.texture_synthesis import cheapest_cut, joined, quilted

from .parsed_facade import picture, rng


def test_the_cheapest_cut_is_the_cheapest_of_all():
    cost = rng().random((5, 4))
    path = cheapest_cut(cost)
    assert (np.abs(np.diff(path)) <= 1).all()
    paths = [[]]
    for _ in range(5):
        paths = [[*p, c] for p in paths for c in range(4) if not p or abs(p[-1] - c) <= 1]
    best = min(sum(cost[row, c] for row, c in enumerate(p)) for p in paths)
    assert cost[np.arange(5), path].sum() == pytest.approx(best)


def test_quilts_hold_the_exemplars_colours_and_repeat():
    exemplar = np.zeros((40, 40, 3), np.uint8)
    exemplar[::2] = 200
    quilt = quilted([exemplar], (64, 48), 16, rng=rng())
    assert quilt.shape == (64, 48, 3)
    assert abs(float(quilt.mean()) - 100.0) < 15.0
    plain = quilted([np.full((9, 9, 3), 77, np.uint8)], (32, 32), 16, rng=rng())
    assert (plain == 77).all()


def test_joined_tiles_keep_their_middles():
    tiles = [np.full((6, 20, 3), value, np.uint8) for value in (10, 100, 200)]
    strip = joined(tiles, 3)
    assert strip.shape == (6, 3 * 14, 3)
    assert [int(strip[0, 14 * k + 7, 0]) for k in range(3)] == [10, 100, 200]


def test_the_largest_rectangle_of_free_pixels():
    free = np.zeros((20, 30), bool)
    assert largest_rectangle(free) == (0, 0, 0, 0)
    free[3:9, 10:25] = True
    free[9:20, 2:4] = True
    assert largest_rectangle(free) == (3, 10, 9, 25)


def test_exemplars_of_a_roof_hold_no_frames_of_its_dormers():
    """White frames stand around every dormer and the sky looks in; both are labelled roof."""
    slate = rng().normal((70, 80, 100), 6, (60, 200, 3)).clip(0, 255).astype(np.uint8)
    slate[:6] = (170, 200, 240)
    for x in range(20, 200, 45):
        slate[20:44, x : x + 14] = 245
    labels = np.full(slate.shape[:2], LABELS.index("roof"), np.uint8)
    found = list(_exemplars(Canvas(slate, labels, (20.0, 20.0)), LABELS.index("roof")))
    assert len(found) == 4
    assert max(int(exemplar.max()) for exemplar in found) < 150


def test_the_rim_of_a_rectified_picture_is_filled():
    shown = picture()
    assert without_rim(shown) is shown
    rimmed = shown.copy()
    rimmed[:, :20], rimmed[-12:] = 0, 128
    whole = without_rim(rimmed)
    assert not (whole[:, :15].max(axis=2) < 14).any()
    assert not (np.abs(whole[-10:].astype(int) - 128).max(axis=2) < 6).all()
    assert np.array_equal(whole[:140, 40:], shown[:140, 40:])
    assert without_rim(np.zeros((40, 40, 3), np.uint8)).max() == 0
