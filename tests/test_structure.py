from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facade_tools.stylization.structure import (
    cuts,
    match_blocks,
    match_costs,
    snapped,
    transformation_cost,
)

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
        expected = transformation_cost(a, b) * max(va, vb) / min(va, vb)
        assert table[i, j] == pytest.approx(expected)
    assert (table >= 1 - 1e-9).all()


def test_a_model_matches_itself_and_roles_are_respected():
    blocks = np.array([[10, 10, 4], [10, 10, 30], [6, 6, 3]], dtype=float)
    roles = ["bottom", "body", "top"]
    assert match_blocks(blocks, roles, blocks, roles) == [0, 1, 2]
    assert match_blocks(blocks, roles, 2 * blocks[:1], ["top"]) == [2]
    assert match_blocks(blocks[1:2], ["body"], blocks, roles) == [0, 0, 0]


@given(places, places)
def test_snapping_keeps_order_and_the_window(upper, lower):
    out = snapped(upper, lower, 10.0)
    assert (np.diff(out) >= 0).all()
    assert (np.abs(out - upper) <= 2.0 + 1e-9).all()


def test_snapping_moves_to_neighbours_only():
    assert snapped(np.array([0.3, 4.8, 9.9]), np.array([0.0, 5.0, 10.0]), 10).tolist() == [0, 5, 10]
    assert snapped(np.array([0.0, 3.0, 9.9]), np.array([0.0, 10.0]), 10).tolist() == [0, 3, 10]
    assert snapped(np.array([1.0]), np.array([]), 10).tolist() == [1.0]
