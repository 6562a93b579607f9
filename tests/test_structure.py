from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facade_tools.stylization.snapping import snapped, unsqueezed
from facade_tools.stylization.structure import Candidate, cuts, match_blocks, match_costs

sizes = st.lists(st.tuples(*[st.floats(1, 50)] * 3), min_size=1, max_size=5).map(np.array)
places = st.lists(st.floats(0, 10), min_size=1, max_size=5).map(lambda v: np.array(sorted(v)))


def test_cuts_are_strict_local_maxima_above_five_per_cent():
    assert cuts([]) == cuts([10]) == cuts([10, 10]) == []
    assert cuts([10, 9.6]) == []
    assert cuts([10, 9]) == [1]
    assert cuts([10, 8, 5]) == [2]  # 1.25 beside 1.6: only the larger
    assert cuts([10, 10, 5, 5, 5, 2]) == [2, 5]
    assert cuts([8, 4, 2]) == []  # equal neighbours: neither is strict


@given(sizes, sizes)
def test_costs_equal_the_printed_formulas(sources, targets):
    table = match_costs(sources, targets)
    for (i, a), (j, b) in itertools.product(enumerate(sources), enumerate(targets)):
        va, vb = a.prod() / sources.prod(axis=1).sum(), b.prod() / targets.prod(axis=1).sum()
        ratio = (a / a.sum()) / (b / b.sum())
        expected = np.maximum(ratio, 1 / ratio).prod() * max(va, vb) / min(va, vb)
        assert table[i, j] == pytest.approx(expected)
    assert (table >= 1 - 1e-9).all()


def block(role, *size, place=(0.5, 0.5, 0.5)):
    return Candidate(role, size, place)


def test_a_model_matches_itself_and_roles_are_respected():
    blocks = [block("bottom", 10, 10, 4), block("body", 10, 10, 30), block("top", 6, 6, 3)]
    assert match_blocks(blocks, blocks) == [0, 1, 2]
    assert match_blocks(blocks, [block("top", 20, 20, 8)]) == [2]
    assert match_blocks(blocks[1:2], blocks) == [0, 0, 0]


def test_a_storey_takes_no_moulding():
    """A garage as wide and flat as the source's cornice is not made of it, but its like is."""
    source = [block("body", 8, 6, 9), block("body", 8, 6, 0.5)]
    assert match_blocks(source, [block("body", 40, 30, 2.5), block("body", 8, 6, 0.6)]) == [0, 1]
    assert match_blocks(source[1:], [block("body", 20, 16, 2.5)]) == [0]


def test_of_equal_blocks_the_one_that_lies_alike_is_taken():
    twins = [block("body", 5, 9, 6, place=(x, 0.5, 0.5)) for x in (0.1, 0.9)]
    assert match_blocks(twins, twins[::-1]) == [1, 0]


@given(places, places)
def test_snapping_keeps_order_and_the_window(upper, lower):
    out = snapped(upper, lower, 10.0)
    assert (np.diff(out) >= 0).all()
    assert (np.abs(out - upper) <= 2.0 + 1e-9).all()


def test_snapping_moves_to_neighbours_only():
    assert snapped(np.array([0.3, 4.8, 9.9]), np.array([0.0, 5.0, 10.0]), 10).tolist() == [0, 5, 10]
    assert snapped(np.array([0.0, 3.0, 9.9]), np.array([0.0, 10.0]), 10).tolist() == [0, 3, 10]
    assert snapped(np.array([1.0]), np.array([]), 10).tolist() == [1.0]


def test_what_stands_between_snapped_edges_keeps_its_width():
    """A window whose two edges would snap to one edge below, or far apart, stays as it was."""
    window = np.array([3.0, 4.0, 8.0])
    assert unsqueezed(window, np.array([3.4, 3.4, 8.0]), (0.0, 12.0)).tolist() == [3.0, 4.0, 8.0]
    assert unsqueezed(window, np.array([2.0, 5.0, 8.0]), (0.0, 12.0)).tolist() == [3.0, 4.0, 8.0]
    moved = np.array([3.1, 4.1, 8.2])
    assert unsqueezed(window, moved, (0.0, 12.0)).tolist() == moved.tolist()
    whole = np.array([2.2])  # in reach of κ, but its wall would lose more than a quarter
    assert unsqueezed(np.array([3.0]), whole, (0.0, 12.0)).tolist() == [3.0]
