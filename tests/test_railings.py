from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from facade_tools.artifacts.grammar import Node
from facade_tools.grammar.derivation import leaves, painted
from facade_tools.grammar.library import builtin
from facade_tools.grammar.reading import label_index
from facade_tools.segmentation.deriving import Frame, regions_of
from facade_tools.segmentation.railings import cut_railings, expected_length

FRAME = Frame((20, 10), (40, 20))  # two pixels of the picture to a working one


def floor(symbol="FL"):
    """A tile with a railing (rows 24 to 32) under a window (8 to 24), wall beside it."""
    parts = (
        Node("Ba", (4.0, 24.0, 16.0, 32.0), label="balcony"),
        Node("Wi", (4.0, 8.0, 16.0, 24.0), label="window"),
    )
    tile = Node("TL", (4.0, 8.0, 16.0, 32.0), "up", None, parts)
    walls = [Node("Wa", (a, 8.0, b, 32.0), label="wall") for a, b in ((0.0, 4.0), (16.0, 20.0))]
    return Node(symbol, (0.0, 8.0, 20.0, 32.0), "right", None, (walls[0], tile, walls[1]))


def facade(symbol="FL"):
    above = Node("Wa", (0.0, 0.0, 20.0, 8.0), label="wall")
    below = Node("Wa", (0.0, 32.0, 20.0, 40.0), label="wall")
    return Node("FA", (0.0, 0.0, 20.0, 40.0), "up", None, (below, floor(symbol), above))


def window_plane(rows):
    """Belief in windows at working resolution: `rows` maps working rows to shares."""
    plane = np.zeros((20, 10), np.float32)
    for row, share in rows.items():
        plane[row, 2:8] = share
    return plane


def border(tree):
    (window,) = (leaf for leaf in leaves(tree) if leaf.label == "window")
    return window.scope[3]


def cut(rows, symbol="FL", grammar="haussmann-floors"):
    return cut_railings(facade(symbol), builtin(grammar), window_plane(rows), FRAME)


def test_a_certain_border_is_found():
    for last in range(9, 16):
        assert border(cut(dict.fromkeys(range(4, last), 0.9))) == 2 * last


def test_a_wavering_border_is_the_mean_of_its_readings():
    # window for certain down to row 12, then half believed down to the tile's end at 16
    shares = {**dict.fromkeys(range(4, 12), 0.8), **dict.fromkeys(range(12, 16), 0.4)}
    assert border(cut(shares)) == 2 * 14


def test_a_window_below_a_bar_that_is_none_does_not_count():
    shares = {**dict.fromkeys(range(4, 10), 0.8), 10: 0.0, **dict.fromkeys(range(11, 16), 0.8)}
    assert border(cut(shares)) == 2 * 10


def test_floors_that_derive_alike_are_left_alone():
    certain = dict.fromkeys(range(4, 9), 0.9)
    assert border(cut(certain)) == 18
    assert cut(certain, grammar="haussmann") == facade()
    assert cut(certain, symbol="GF") == facade("GF")


def railing(x0, x1, label):
    parts = (
        Node("Ba", (x0, 24.0, x1, 32.0), label="balcony"),
        Node("Wi", (x0, 8.0, x1, 24.0), label=label),
    )
    return Node("T", (x0, 8.0, x1, 32.0), "up", None, parts)


def test_tiles_that_touch_share_the_top_of_their_railing():
    # two windows of one balcony, wall between them, and a third with a railing of its own
    kinds = [(0.0, 6.0, "window"), (6.0, 8.0, "wall"), (8.0, 12.0, "window")]
    tiles = [railing(*kind) for kind in kinds]
    wall = Node("Wa", (12.0, 8.0, 14.0, 32.0), label="wall")
    row = Node("FL", (0.0, 8.0, 20.0, 32.0), "right", None,
               (*tiles, wall, railing(14.0, 20.0, "window")))  # fmt: skip
    plane = np.zeros((20, 10), np.float32)
    for (low, high), last in {(0, 3): 10, (4, 6): 14, (7, 10): 15}.items():
        plane[4:last, low:high] = 0.9
    tree = cut_railings(row, builtin("haussmann-floors"), plane, FRAME)
    tops = [tile.children[0].scope[1] for tile in tree.children if tile.children]
    assert tops == [24, 24, 24, 30]
    assert all(tile.children[1].scope[3] == top for tile, top in
               zip([t for t in tree.children if t.children], tops, strict=True))  # fmt: skip


def test_without_belief_in_windows_nothing_changes():
    assert cut({}) == facade()


def test_what_is_hidden_says_nothing():
    certain = window_plane(dict.fromkeys(range(4, 9), 0.9))
    post, car = certain.copy(), certain.copy()
    post[:, 2:5] = np.nan
    car[10:] = np.nan
    grammar = builtin("haussmann-floors")
    assert border(cut_railings(facade(), grammar, post, FRAME)) == 18
    assert cut_railings(facade(), grammar, car, FRAME) == facade()


@given(arrays(np.float32, (20, 10), elements=st.floats(0, 1, width=32)))
def test_regions_tile_whatever_is_believed(plane):
    tree = cut_railings(facade(), builtin("haussmann-floors"), plane, FRAME)
    canvas = np.zeros((40, 20), int)
    for region in regions_of(tree):
        canvas[region.y0 : region.y1, region.x0 : region.x1] += 1
    assert (canvas == 1).all()
    assert 8 < border(tree) <= 32
    assert (painted(tree, (40, 20), label_index()) > 0).all()
    assert replace(tree, children=()) == replace(facade(), children=())


@pytest.mark.parametrize(
    ("profile", "length"),
    [([0.3], 1.0), ([0.5, 0.5, 0.0, 0.5], 2.0), ([0.8, 0.4, 0.6, 0.2], 2.25)],
)
def test_expected_length_is_the_sum_of_what_belongs(profile, length):
    assert expected_length(np.array(profile, np.float32)) == pytest.approx(length)
