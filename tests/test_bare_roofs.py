from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.parse import LABELS
from facade_tools.grammar.derivation import leaves, painted
from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.grammar.reading import label_index
from facade_tools.grammar.rules import grammar_below, symbols_below
from facade_tools.grammar.segments import bounds
from facade_tools.segmentation import dp
from facade_tools.segmentation.bare_roofs import (
    Seen,
    favoured,
    highest_windows,
    with_dormers,
)
from facade_tools.segmentation.deriving import Frame, derivation, regions_of
from facade_tools.segmentation.energy import field_of

CLASSES = LABELS[1:]
WINDOW, WALL, ROOF, SKY, SHOP = (
    CLASSES.index(n) for n in ("window", "wall", "roof", "sky", "shop")
)
SHAPE = (200, 160)
COLUMNS = ((20, 36), (60, 76), (100, 116))
ROOF_ROWS, DORMER_ROWS = (30, 55), (36, 50)


def belief_of(dormers, doubt=0.12):
    """Beliefs in a facade of two floors of three windows, and in dormers to a share each."""
    labels = np.full(SHAPE, SKY)
    labels[ROOF_ROWS[0] : ROOF_ROWS[1]] = ROOF
    labels[ROOF_ROWS[1] : 160] = WALL
    labels[160:] = SHOP
    for top in (70, 115):
        for left, right in COLUMNS:
            labels[top : top + 30, left:right] = WINDOW
    out = np.full((len(CLASSES), *SHAPE), doubt / 7, np.float32)
    np.put_along_axis(out, labels[None], 1 - doubt, axis=0)
    for share, (left, right) in zip(dormers, COLUMNS, strict=True):
        out[:, slice(*DORMER_ROWS), left:right] *= (1 - share) / (1 - doubt / 7)
        out[WINDOW, slice(*DORMER_ROWS), left:right] = share
    return out


def read(belief, grammar, hidden=None):
    """The solver's tree, and the tree with dormers."""
    made = plan(grammar)
    frame = Frame(SHAPE, SHAPE)
    hidden = np.zeros(SHAPE, bool) if hidden is None else hidden
    solution = dp.solve(field_of(np.where(hidden, np.float32(1), belief), CLASSES, made), made)
    tree = derivation(made, solution.layout, frame)
    seen = Seen(belief, CLASSES, hidden)
    return tree, with_dormers(tree, grammar, seen, frame, dp.solve)


def windows_above(tree, row):
    return [leaf for leaf in leaves(tree) if leaf.label == "window" and leaf.scope[3] <= row]


@pytest.mark.parametrize("name", ["haussmann", "haussmann-floors"])
def test_a_row_of_doubtful_dormers_is_found_where_it_is(name):
    before, after = read(belief_of((0.3, 0.3, 0.3)), builtin(name))
    assert not windows_above(before, ROOF_ROWS[1])
    dormers = windows_above(after, ROOF_ROWS[1])
    assert len(dormers) == len(COLUMNS)
    for dormer, (left, right) in zip(dormers, COLUMNS, strict=True):
        assert dormer.scope == pytest.approx((left, DORMER_ROWS[0], right, DORMER_ROWS[1]), abs=2)


def test_below_the_roof_nothing_changes():
    before, after = read(belief_of((0.3, 0.3, 0.3)), builtin("haussmann-floors"))
    assert [c for c in before.children if c.symbol != "AT"] == [
        c for c in after.children if c.symbol != "AT"
    ]
    own = painted(after, SHAPE, label_index())
    assert (own > 0).all()


@pytest.mark.parametrize("dormers", [(0.3, 0.0, 0.0), (0.02, 0.02, 0.02), (0.0, 0.0, 0.0)])
def test_one_dormer_or_a_trace_is_no_row(dormers):
    before, after = read(belief_of(dormers), builtin("haussmann-floors"))
    assert before == after


def test_a_banner_is_no_dormer():
    banner = belief_of((0.3, 0.3, 0.3))
    banner[:, slice(*DORMER_ROWS), 53:82] = banner[:, DORMER_ROWS[0], 65][:, None, None]
    before, after = read(banner, builtin("haussmann-floors"))
    assert before == after
    narrow = belief_of((0.3, 0.3, 0.3))
    narrow[:, slice(*DORMER_ROWS), 57:78] = narrow[:, DORMER_ROWS[0], 65][:, None, None]
    _, after = read(narrow, builtin("haussmann-floors"))
    assert len(windows_above(after, ROOF_ROWS[1])) == len(COLUMNS)


def test_what_is_hidden_brings_no_dormers():
    hidden = np.zeros(SHAPE, bool)
    hidden[ROOF_ROWS[0] - 5 : ROOF_ROWS[1] - 3, :60] = True
    before, after = read(belief_of((0.3, 0.0, 0.0)), builtin("haussmann-floors"), hidden)
    assert before == after


def test_roofs_that_share_the_columns_of_floors_are_left_alone():
    grammar = builtin("haussmann")
    rules = dict(grammar.rules)
    rules["AF"] = replace(rules["AF"], like="FL", sizes={})
    before, after = read(belief_of((0.3, 0.3, 0.3)), replace(grammar, rules=rules))
    assert before == after


def test_without_floors_there_is_no_measure_of_a_row():
    tree, _ = read(belief_of((0.0, 0.0, 0.0)), builtin("haussmann-floors"))
    assert highest_windows(tree) == pytest.approx([16, 16, 16], abs=2)
    assert highest_windows(replace(tree, children=tree.children[-2:])) == []


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.lists(st.floats(0, 0.5), min_size=3, max_size=3))
def test_regions_tile_whatever_is_believed_of_dormers(seed, dormers):
    rng = np.random.default_rng(seed)
    belief = belief_of(dormers) * rng.uniform(0.5, 1, (len(CLASSES), *SHAPE)).astype(np.float32)
    belief /= belief.sum(axis=0)
    _, tree = read(belief, builtin("haussmann-floors"))
    canvas = np.zeros(SHAPE, int)
    for region in regions_of(tree):
        canvas[region.y0 : region.y1, region.x0 : region.x1] += 1
    assert (canvas == 1).all()


@given(st.floats(0.01, 0.99), st.floats(1, 50))
def test_favoured_multiplies_the_odds(share, favour):
    belief = np.array([share, (1 - share) / 3, 2 * (1 - share) / 3], np.float32).reshape(3, 1, 1)
    out = favoured(belief, 0, favour)[:, 0, 0]
    assert out.sum() == pytest.approx(1, abs=1e-5)
    assert out[0] / out[1:].sum() == pytest.approx(favour * share / (1 - share), rel=1e-3)
    assert out[2] / out[1] == pytest.approx(2, rel=1e-4)


def test_sizes_of_a_shape_bind_as_before():
    grammar = builtin("haussmann-floors")
    part = plan(grammar_below(grammar, "AT", 30 / 200))
    whole = plan(grammar)
    paths = {state.path[1:] for state in whole.states if state.path[1:2] == ("AT",)}
    assert {state.path for state in part.states} == paths
    for state in part.states:
        other = next(s for s in whole.states if (s.path[1:], s.parts) == (state.path, state.parts))
        own, same = bounds((state.size,), 30, 30), bounds((other.size,), 200, 200)
        assert own.least == same.least
        assert min(own.most[0], 30) == min(same.most[0], 30)
        assert own.prior == pytest.approx(same.prior)


def test_symbols_below_a_shape():
    grammar = builtin("haussmann-floors")
    assert symbols_below(grammar, "AT") == {"AT", "AF", "TA", "LeR", "Rf", "Ba", "Wi"}
    assert symbols_below(grammar, "Rf") == {"Rf"}
    assert set(grammar_below(grammar, "AT", 0.1).rules) >= {"AT", "AF", "TA", "LeR", "FL", "TL"}
