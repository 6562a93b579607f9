from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from facade_tools.stylization.labels import (
    insertable_labels,
    merged,
    rule_of,
    two_means,
    variance_signal,
)
from facade_tools.stylization.splitting import (
    MARGINS,
    SplitRule,
    packed,
    repeat,
    split,
    split_rule,
)
from facade_tools.stylization.synthesis import at_scale, filled, positions

signals = st.lists(st.floats(0, 1), min_size=2, max_size=9).map(np.array)
widths = st.floats(0.2, 4)
rules = st.integers(0, 4).flatmap(
    lambda m: st.builds(
        SplitRule,
        st.tuples(*[widths] * (m + 1)),
        st.tuples(*[widths] * m),
    )
)


def energy(signal, labels, centres, smoothness):
    data = sum(abs(v - centres[int(label)]) for v, label in zip(signal, labels, strict=True))
    return data + smoothness * sum(a != b for a, b in itertools.pairwise(labels))


@given(signals, st.floats(0, 0.5))
def test_labels_are_the_exact_minimum(signal, smoothness):
    labels = insertable_labels(signal, smoothness)
    if signal.max() - signal.min() < 1e-9:
        assert not labels.any()
        return
    centres = two_means(signal)
    everything = itertools.product([False, True], repeat=len(signal))
    least = min(energy(signal, option, centres, smoothness) for option in everything)
    assert energy(signal, labels, centres, smoothness) == pytest.approx(least, abs=1e-12)


@given(signals)
def test_two_means_is_the_best_cut(signal):
    low, high = two_means(signal)
    assert low <= high + 1e-12
    cost = np.minimum((signal - low) ** 2, (signal - high) ** 2).sum()
    values = np.sort(signal)
    cuts = (
        values[:k].var() * k + values[k:].var() * (len(values) - k) for k in range(1, len(values))
    )
    assert cost <= min(cuts) + 1e-9


def test_windows_show_in_the_signal():
    picture = np.full((40, 60, 3), 180, dtype=np.uint8)
    for x in (10, 30, 45):
        picture[10:30, x : x + 8] = 20
    signal = variance_signal(picture, 0)
    assert signal.max() == 1
    rule = rule_of(insertable_labels(signal), 6.0)
    assert rule.insertable == pytest.approx((0.8, 0.8, 0.8))
    assert rule.scalable == pytest.approx((1.0, 1.2, 0.7, 0.7))
    assert len(rule_of(insertable_labels(variance_signal(picture, 1)), 4.0).insertable) == 1
    flat = np.full((5, 5, 3), 7, dtype=np.uint8)
    assert not variance_signal(flat, 0).any()


def test_fragments_are_merged():
    labels = np.array([0, 0, 1, 1, 1, 0, 1, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0], dtype=bool)
    assert merged(labels, 6).astype(int).tolist() == [0, 0] + [1] * 7 + [0] * 8


@given(rules)
def test_a_face_of_its_own_size_is_unchanged(rule):
    done = split(rule, rule.size)
    assert done.sources == tuple(range(2 * len(rule.insertable) + 1))
    assert done.stretch == pytest.approx(1)
    assert done.windows == len(rule.insertable)


@given(rules, st.floats(0.05, 60))
def test_a_split_fills_the_face_and_never_stretches_windows(rule, size):
    done = split(rule, size)
    assert math.fsum(done.sizes) == pytest.approx(size)
    assert min(done.sizes) >= -1e-9
    for source, width in zip(done.sources, done.sizes, strict=True):
        if source % 2:
            assert width == pytest.approx(rule.insertable[source // 2])
    assert done.windows == sum(source % 2 for source in done.sources)
    assert done.sources[0] % 2 == 0
    assert done.sources[-1] % 2 == 0


def pitches(rule, size):
    """The distances between the middles of neighbouring windows."""
    done = split(rule, size)
    ends = np.cumsum([0, *done.sizes])
    middles = [
        (a + b) / 2 for k, a, b in zip(done.sources, ends[:-1], ends[1:], strict=True) if k % 2
    ]
    return np.diff(middles)


@pytest.mark.parametrize("factor", [0.8, 1.25, 1.5, 1.7, 2.0])
def test_distances_of_windows_stay_whatever_the_width(factor):
    even = SplitRule((0.6, 1.2, 1.2, 1.2, 1.2, 1.2, 0.6), (1.5,) * 6)
    assert pitches(even, factor * even.size) == pytest.approx(2.7, rel=0.03)
    pairs = SplitRule((1.5, 2.2, 3.0, 2.2, 3.0, 2.2, 1.5), (1.0,) * 6)  # two windows over a gate
    found = pitches(pairs, factor * pairs.size)
    assert found[::2] == pytest.approx(3.2, rel=0.03)
    assert found[1::2] == pytest.approx(4.0, rel=0.03)


def test_a_rule_that_repeats_within_itself_goes_on():
    bays = SplitRule((0.8, 1.9, 1.4, 2.0, 1.3, 0.6), (3.5, 0.8, 3.3, 0.8, 3.5))
    assert repeat(bays) == 2
    done = split(bays, 1.5 * bays.size)
    widths = [bays.insertable[k // 2] for k in done.sources if k % 2]
    assert [w > 1 for w in widths] == [True, False] * 4
    assert done.sources[-1] == 10  # its own margin
    assert repeat(SplitRule((1, 1, 1, 1), (1, 2, 4))) == 0
    assert repeat(SplitRule((4, 1, 4), (1, 1))) == 0  # its margins belong to it
    assert split(SplitRule((4, 1, 4), (1, 1)), 22).windows == 4


def test_margins_and_plain_walls_take_what_is_left_over():
    rule = SplitRule((1.0, 1.0, 8.0, 1.0, 1.0), (1.0,) * 4)
    done = split(rule, 17.0)
    assert (done.windows, packed(rule, 17.0)) == (4, 5)  # five would squeeze the walls to 77%
    assert done.stretch == pytest.approx(13 / 12)
    changes = np.array(done.sizes) / np.array([1, 1, 1, 1, 8, 1, 1, 1, 1])
    assert changes[[2, 6]] == pytest.approx(1.0, abs=0.05)
    assert changes[0] == changes[4] == changes[8] > 1.09
    far = split(rule, 14.0)
    assert min(far.sizes) >= MARGINS[0]
    assert max(np.array(far.sizes)) <= MARGINS[1] * 8


@given(rules, st.floats(0.5, 60), st.floats(0.5, 60))
def test_the_rule_of_a_split_is_a_rule(rule, size, other):
    own = split_rule(rule, size)
    assert own.size == pytest.approx(size)
    assert len(own.scalable) == len(own.insertable) + 1
    assert math.fsum(split(own, other).sizes) == pytest.approx(other)


def test_equation_8_and_9_by_hand():
    rule = SplitRule((1.0, 1.0, 1.0), (2.0, 2.0))  # 7 m, two windows
    done = split(rule, 10.0)  # one repeat, one window more: walls 1·3 + 1 + 1 scaled by 4/5
    assert (done.windows, done.stretch) == (3, pytest.approx(0.8))
    assert done.sources == (0, 1, 2, 3, 4, 0, 1, 2)
    assert split(rule, 14.0).windows == 4
    assert split(rule, 1.0).windows == 0
    crowded = split(rule, 4.1)  # both windows fit, but with 3 cm of wall: one is nearer to 1
    assert crowded.windows == 1


@pytest.mark.parametrize("stretch", [0.4, 0.8, 1.0, 1.3, 2.5, 3.0])
def test_long_walls_keep_the_scale_of_what_is_on_them(stretch):
    """At every place the picture runs at its own scale, forth or back, from end to end."""
    places = at_scale(np.linspace(0, 1, 5001), stretch)
    step = np.abs(np.diff(places)) * 5000 / stretch
    assert np.mean(np.abs(step - 1) < 0.01) > 0.999
    assert (places[0], places[-1]) == pytest.approx((0, 1))
    assert 0 <= places.min() <= places.max() <= 1


@pytest.mark.parametrize("stretch", [2.0, 3.4, 11.0])
def test_much_wider_walls_show_their_plainest_part_between_their_ends(stretch):
    places = filled(np.linspace(0, 1, 5001), stretch, (0.4, 0.2))
    assert (places[0], places[-1]) == pytest.approx((0, 1))
    middle = places[round(5000 * 0.51 / stretch) : round(5000 * (1 - 0.51 / stretch))]
    assert 0.4 - 1e-9 <= middle.min() <= middle.max() <= 0.6 + 1e-9
    step = np.abs(np.diff(places)) * 5000 / stretch
    assert np.mean(np.abs(step - 1) < 0.01) > 0.98


def test_a_sill_stays_with_its_window():
    rule = SplitRule((0.5, 0.5), (3.0,))
    signal = np.zeros(400)
    signal[50:350], signal[350:365] = 1.0, 0.3  # the window, and the sill below it
    places = positions(rule, 4.0, 6.0, 600, lambda: signal) * 4.0
    sill = (places > 3.5) & (places < 3.65)
    edges = np.flatnonzero(np.diff(sill))
    assert len(edges) == 2
    assert edges[1] - edges[0] == pytest.approx(15, abs=2)


# cornice, an attic, two storeys, a high ground floor, plinth
ROWS = SplitRule((1.5, 1.2, 1.0, 1.4, 0.3), (1.0, 1.6, 1.6, 2.6), ends=True)


@pytest.mark.parametrize("size", [13.0, 15.0, 18.0, 25.0, 60.0])
@pytest.mark.parametrize("once", [(), (3,)])
def test_cornice_and_ground_floor_stand_at_the_ends_of_a_higher_face(size, once):
    done = split(replace(ROWS, once=once), size)
    assert sum(done.sizes) == pytest.approx(size)
    for end in (0, 1, 7, 8):
        assert done.sources.count(end) == 1
    assert (done.sources[:2], done.sources[-2:]) == ((0, 1), (7, 8))
    inner = [source for source in done.sources if source % 2][1:-1]
    assert set(inner) == {3, 5}
    for source, height in zip(done.sources, done.sizes, strict=True):
        assert source % 2 == 0 or height == pytest.approx(ROWS.insertable[source // 2])


def test_a_lower_face_keeps_its_ground_floor_where_it_stands_on_the_ground():
    low = split(replace(ROWS, once=(3,)), 8.0)
    assert low.sources[-2:] == (7, 8)
    assert 1 < low.windows < 4
    assert 7 not in split(ROWS, 8.0).sources


def test_a_row_without_its_like_keeps_what_stands_once_when_it_becomes_narrower():
    row = SplitRule((1.0,) * 6, (2.0,) * 5, (2,))
    for size in (13.0, 10.0, 7.0):
        assert split(row, size).sources.count(5) == 1
