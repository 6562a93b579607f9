"""Training pictures rebuilt: what changes, what stays, and that picture and labels agree."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.parse import LABELS
from facade_tools.segmentation import rebuilding
from facade_tools.segmentation.rebuilding import (
    rebuilt,
    with_attic_moved,
    with_ground_windows,
)

CLASSES = LABELS[1:]
WINDOW, WALL, ROOF, SKY, SHOP = (LABELS.index(n) for n in ("window", "wall", "roof", "sky", "shop"))
COLOURS = np.random.default_rng(5).integers(40, 200, (len(LABELS), 3)).astype(np.uint8)
NUMBERS = (WINDOW, WALL, SHOP)


def facade():
    """Sky over a roof with two dormers, two storeys of three windows, a shop."""
    labels = np.full((160, 120), WALL, np.uint8)
    labels[:20] = SKY
    labels[20:44] = ROOF
    labels[28:40, 20:32] = WINDOW
    labels[28:40, 50:62] = WINDOW
    for y in (52, 84):
        for x in (12, 50, 88):
            labels[y : y + 22, x : x + 18] = WINDOW
    labels[118:, 10:110] = SHOP
    return COLOURS[labels], labels


def components(mask):
    return cv2.connectedComponents(mask.astype(np.uint8), connectivity=4)[0] - 1


def test_shops_become_wall_with_windows_of_the_floors_above(monkeypatch):
    monkeypatch.setattr(rebuilding, "SHOPS", 1.0)
    picture, labels = facade()
    seen = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        after, known = with_ground_windows(picture, labels, NUMBERS, rng=rng)
        assert not (known == SHOP).any()
        assert np.array_equal(known[:118], labels[:118])
        assert np.array_equal(after[:117], picture[:117])
        ground = known[118:]
        assert set(np.unique(ground)) <= {0, WALL, WINDOW}
        below = np.flatnonzero((ground == 0).any(axis=1))
        assert not len(below) or below[0] >= 0.7 * 42 - 1
        glass = after[118:][ground == WINDOW].astype(int)
        if len(glass):
            near = np.abs(glass - COLOURS[WINDOW].astype(int)).max(axis=1) < 12
            assert near.mean() > 0.6  # frames of narrow windows are copied with them
        seen.append(components(ground == WINDOW))
    assert max(seen) >= 3
    assert sum(n > 0 for n in seen) > 15


def test_a_picture_without_windows_or_wall_beside_them_keeps_its_shop():
    picture, labels = facade()
    bare = np.where(labels == WINDOW, WALL, labels).astype(np.uint8)
    rng = np.random.default_rng(0)
    assert np.array_equal(with_ground_windows(picture, bare, NUMBERS, rng=rng)[1], bare)
    railed = np.where(labels == WALL, LABELS.index("balcony"), labels).astype(np.uint8)
    for _ in range(5):
        assert np.array_equal(with_ground_windows(picture, railed, NUMBERS, rng=rng)[1], railed)


def test_attics_move_with_their_labels_and_floors_stay():
    picture, labels = facade()
    moved = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        after, known = with_attic_moved(picture, labels, ROOF, rng=rng)
        assert np.array_equal(known[44:], labels[44:])
        assert np.array_equal(after[44:], picture[44:])
        assert np.array_equal(known[43], np.where(known[43] == WINDOW, WINDOW, ROOF))
        agree = (np.abs(after.astype(int) - COLOURS[known]).max(axis=2) < 3).mean()
        assert agree > 0.93  # but for pixels mixed at borders
        moved += not np.array_equal(known, labels)
    assert moved == 20


@pytest.mark.parametrize("roof", [slice(0, 4), slice(60, 100)])
def test_what_is_no_attic_does_not_move(roof):
    picture, labels = facade()
    labels[labels == ROOF] = SKY
    labels[roof] = ROOF
    after, known = with_attic_moved(picture, labels, ROOF, rng=np.random.default_rng(1))
    assert known is labels
    assert after is picture


def test_without_shops_and_roofs_among_the_classes_nothing_changes():
    picture, labels = facade()
    few = ("window", "wall")
    for seed in range(10):
        after, known = rebuilt(picture, labels, few, rng=np.random.default_rng(seed))
        assert known is labels
        assert after is picture


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 70), st.integers(3, 70))
def test_any_label_map_is_rebuilt_within_its_classes(seed, height, width):
    rng = np.random.default_rng(seed)
    coarse = rng.integers(0, len(LABELS), (rng.integers(1, 9), rng.integers(1, 9)), np.uint8)
    labels = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_NEAREST)
    picture = rng.integers(0, 256, (height, width, 3), np.uint8)
    before = picture.copy(), labels.copy()
    for _ in range(4):
        after, known = rebuilt(picture, labels, CLASSES, rng=rng)
        assert after.shape == picture.shape
        assert known.shape == labels.shape
        assert after.dtype == known.dtype == np.uint8
        assert set(np.unique(known)) <= set(np.unique(labels)) | {0}
    assert np.array_equal(before[0], picture)
    assert np.array_equal(before[1], labels)
