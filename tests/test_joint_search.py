"""The steps of the whole network: each finds what a known table hides, none lowers the score."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from learned_tables import as_readings, table_layout

from facade_tools.exteriors import joint_search, mixture, styles
from facade_tools.exteriors.dataset import build, fit_scaling
from facade_tools.exteriors.em import Prior, unit_weights
from facade_tools.exteriors.joint_search import (
    joint,
    settled_edges,
    settled_sizes,
    settled_styles,
    settled_together,
)
from facade_tools.exteriors.network import Network
from facade_tools.exteriors.structure_search import Limits, Search


def searched(values, bits):
    """A search over the table, without anything fitted yet."""
    layout = table_layout(len(values), bits.shape[1])
    readings = as_readings(values, bits.astype(np.int8))
    scalings = fit_scaling(readings, layout)
    data = build(readings, layout, scalings)
    return Search(layout, data, scalings, unit_weights(data), Prior(), Limits(1, 6))


def network(search, sizes, n_styles):
    """Families of these sizes by themselves, under `n_styles` styles."""
    fits = []
    for g, size in enumerate(sizes):
        fit = mixture.single(search.task(g))
        while len(fit.family.coef) < size:
            fit = mixture.grow(search.task(g), fit)
        fits.append(fit)
    shown = styles.evidence([styles.scaled(fit.local) for fit in fits])
    upper = styles.first(search.rows, shown, np.ones((len(search.data), 1)))
    while len(upper.style) < n_styles:
        upper = styles.grow(search.rows, shown, upper)
    upper = styles.improve(search.rows, shown, upper)
    tables = np.split(upper.hidden, shown.starts[1:-1], axis=1)
    families = tuple(
        replace(fit.family, hidden=np.ascontiguousarray(table))
        for fit, table in zip(fits, tables, strict=True)
    )
    return Network(search.layout, search.scalings, upper.style, upper.bits, families)


@pytest.fixture
def three_styles():
    """Three styles that differ in the clusters of four groups and in their bits."""
    rng = np.random.default_rng(0)
    s = rng.integers(0, 3, 300)
    cluster = [(s == g % 3).astype(int) for g in range(4)]
    values = [3.0 * c[:, None] + rng.normal(0, 0.6, (300, 2)) for c in cluster]
    bits = rng.random((300, 3)) < np.where(s[:, None] == np.arange(3), 0.9, 0.1)
    return searched(values, bits)


def test_a_missing_style_is_found(three_styles):
    before = joint(three_styles, network(three_styles, (2, 2, 2, 2), 2))
    after = settled_styles(three_styles, before)
    assert len(after.fit.network.style) == 3
    assert after.score > before.score + 20
    again = settled_styles(three_styles, after)
    assert again is after


def test_a_missing_cluster_is_found(three_styles):
    before = joint(three_styles, network(three_styles, (2, 1, 2, 2), 3))
    after = settled_sizes(three_styles, before)
    assert [len(f.coef) for f in after.fit.network.families] == [2, 2, 2, 2]
    assert after.score > before.score + 20


def test_a_missing_edge_is_found_and_a_needless_one_dropped():
    rng = np.random.default_rng(1)
    first, second = rng.normal(size=(250, 2)), rng.normal(size=(250, 2))
    third = first @ np.array([[0.8, 0.0], [0.0, -0.7]]) + 0.3 * rng.normal(size=(250, 2))
    search = searched([first, second, third], rng.random((250, 2)) < 0.5)
    plain = network(search, (1, 1, 1), 1)
    family = mixture.reshaped(search.task(1), plain.families[1], (0,))
    families = (plain.families[0], family, plain.families[2])
    before = joint(search, replace(plain, families=families))
    after = settled_edges(search, before, set())
    inputs = [f.inputs for f in after.fit.network.families]
    assert inputs[1] == ()
    pairs = {(g, f // 2) for g, shown in enumerate(inputs) for f in shown}
    assert {frozenset(pair) for pair in pairs} == {frozenset((0, 2))}


def test_without_lateral_edges_the_other_steps_are_taken(three_styles):
    three_styles.limits = replace(three_styles.limits, lateral=False)
    found = settled_together(three_styles, network(three_styles, (2, 1, 2, 2), 2))
    assert len(found.fit.network.style) == 3
    assert [len(f.coef) for f in found.fit.network.families] == [2, 2, 2, 2]
    assert all(f.inputs == () for f in found.fit.network.families)


def test_no_step_lowers_the_score_and_all_are_listed(three_styles, monkeypatch):
    seen = []
    plain = joint_search.joint

    def listened(*args, **options):
        seen.append(plain(*args, **options))
        return seen[-1]

    monkeypatch.setattr(joint_search, "joint", listened)
    start = network(three_styles, (1, 2, 1, 2), 2)
    found = settled_together(three_styles, start)
    assert found.score == pytest.approx(max(one.score for one in seen))
    assert len(three_styles.tried) == len(seen)
