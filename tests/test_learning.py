"""EM, the score, structure search, variants, tables; oracles by enumeration and by hand."""

from __future__ import annotations

import csv
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from learned_tables import as_readings, table_layout
from scipy.special import betaln, gammaln

from facade_tools.artifacts.attributes import FacadeAttributes
from facade_tools.artifacts.store import read_whole
from facade_tools.errors import InvalidInput
from facade_tools.exteriors import em, mixture, styles
from facade_tools.exteriors.coordinates import Readings, read_attributes
from facade_tools.exteriors.dataset import build, fit_scaling
from facade_tools.exteriors.em import (
    Prior,
    Statistics,
    Stop,
    beta_mode,
    bit_pseudo_counts,
    run,
    unit_weights,
)
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.holdout import BuildingRows, compare_variants, splits, training_curve
from facade_tools.exteriors.layout import building_layout
from facade_tools.exteriors.learning import LearnOptions, learn_model, learn_readings
from facade_tools.exteriors.network import Family, Network, Pooled, infer
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.score import cheeseman_stutz, log_marginal, table_part
from facade_tools.exteriors.serialisation import network_of
from facade_tools.exteriors.structure_search import Limits, Search, search_structure
from facade_tools.exteriors.table import learn_table


@pytest.fixture(scope="module")
def houses():
    return shipped_prior()


def start(data, layout, scalings, size):
    """A network of `size` clusters everywhere, from local mixtures."""
    fits = []
    for g, group in enumerate(layout.groups):
        task = mixture.Task(data, g, group, scalings[g], np.ones(len(data)), Prior())
        fit = mixture.single(task)
        while len(fit.family.coef) < size:
            fit = mixture.grow(task, fit, 5)
        fits.append(fit)
    rows = styles.rows_of(data, unit_weights(data), Prior())
    shown = styles.evidence([styles.scaled(fit.local) for fit in fits])
    upper = styles.first(rows, shown, np.ones((len(data), 1)))
    while len(upper.style) < size:
        upper = styles.grow(rows, shown, upper)
    tables = np.split(upper.hidden, shown.starts[1:-1], axis=1)
    families = tuple(replace(f.family, hidden=h) for f, h in zip(fits, tables, strict=True))
    return Network(layout, scalings, upper.style, upper.bits, families)


@pytest.mark.parametrize("lateral", [False, True])
def test_em_never_lowers_the_objective_with_nulls(houses, lateral):
    rng = np.random.default_rng(0)
    layout = building_layout()
    readings = read_attributes(houses[::3], layout)
    values = tuple(np.where(rng.random(v.shape) < 0.2, np.nan, v) for v in readings.values)
    readings = Readings(readings.ids, values, readings.parts, readings.bits)
    scalings = fit_scaling(readings, layout)
    data = build(readings, layout, scalings)
    network = start(data, layout, scalings, 3)
    if lateral:  # wwr under bbox, its prior around the regression of all rows
        task = mixture.Task(data, 7, layout.groups[7], scalings[7], np.ones(len(data)), Prior())
        families = list(network.families)
        families[7] = mixture.reshaped(task, families[7], (0, 1, 2))
        assert np.count_nonzero(families[7].pooled.coef[:, 1:])
        network = replace(network, families=tuple(families))
    fit = run(network, data, Prior(), stop=Stop(1e-12, None, 40))
    assert len(fit.trace) > 10
    assert np.diff(fit.trace).min() > -1e-7 * abs(fit.trace[-1])


def test_upper_half_equals_the_whole_e_step(houses):
    layout = building_layout()
    readings = read_attributes(houses[::6], layout)
    scalings = fit_scaling(readings, layout)
    data = build(readings, layout, scalings)
    network = start(data, layout, scalings, 3)
    whole = infer(network, data)
    from facade_tools.exteriors.network import local_log_density

    local = [
        styles.scaled(local_log_density(f, g, data.features))
        for f, g in zip(network.families, data.groups, strict=True)
    ]
    rows = styles.rows_of(data, unit_weights(data), Prior())
    hidden = np.concatenate([f.hidden for f in network.families], axis=1)
    upper = styles.expect(rows, styles.evidence(local), network.style, network.bits, hidden)
    assert upper.log_density == pytest.approx(whole.log_density)
    assert upper.posterior == pytest.approx(whole.style, abs=1e-9)
    assert upper.counts == pytest.approx(np.concatenate(whole.joint, axis=1), abs=1e-6)


def test_table_part_is_the_dirichlet_marginal_over_sequences():
    """Pólya's urn, one row after the other, against the closed form."""
    counts, strength = np.array([3.0, 1.0, 2.0]), 1.5
    alpha = 1 + strength / 3
    seen, total = np.zeros(3), 0.0
    for state, count in enumerate(counts):
        for _ in range(int(count)):
            total += np.log((alpha + seen[state]) / (3 * alpha + seen.sum()))
            seen[state] += 1
    p = em.fit_table(counts, strength)
    found = table_part(counts[None], p[None], strength)
    assert found == pytest.approx(total - counts @ np.log(p))


@pytest.mark.parametrize("centred", [False, True])
def test_gaussian_marginal_is_the_chain_of_predictives(centred):
    """The marginal of n rows is the product of Student predictives, one row at a time."""
    rng = np.random.default_rng(2)
    pooled = Pooled(rng.normal(size=(2, 2)), np.array([0.3, 0.8])) if centred else None
    d, q, n, prior = 2, 1, 5, Prior()
    x, u = rng.normal(size=(n, d)), np.column_stack([np.ones(n), rng.normal(size=(n, q))])

    def marginal(rows):
        a, b = x[:rows], u[:rows]
        stats = Statistics((b.T @ b)[None], (a.T @ b)[None], (a.T @ a)[None], (), np.ones((1, 1)))
        return log_marginal(stats, prior, pooled)[0]

    precision = np.diag(em.prior_precision(1 + q, prior))
    mean = em.prior_mean(d, 1 + q, pooled)
    total = 0.0
    for i in range(n):
        a, b = x[:i], u[:i]
        after = b.T @ b + precision
        coef = np.linalg.solve(after, b.T @ a + precision @ mean.T).T
        scatter = np.diag(em.wishart_scale(d, prior, pooled)) + a.T @ a - coef @ after @ coef.T
        scatter = scatter + mean @ precision @ mean.T
        freedom = d + prior.freedom + i - d + 1
        factor = 1 + u[i] @ np.linalg.solve(after, u[i])
        shape = scatter * factor / freedom
        e = x[i] - coef @ u[i]
        quad = e @ np.linalg.solve(shape, e)
        total += (
            gammaln((freedom + d) / 2)
            - gammaln(freedom / 2)
            - 0.5 * (d * np.log(freedom * np.pi) + np.linalg.slogdet(shape)[1])
            - (freedom + d) / 2 * np.log1p(quad / freedom)
        )
        assert marginal(i + 1) - (marginal(i) if i else 0.0) == pytest.approx(
            total - (marginal(i) if i else 0.0)
        )


# --- known models -------------------------------------------------------------------------------


def known_model(rng, groups=5, styles_=3, edges=((0, 1), (1, 3), (2, 4))):
    """A table drawn from a network of this family, two coordinates a group, and its log density."""
    centers = rng.normal(size=(groups, 3, 2)) * 3.0
    hidden = rng.dirichlet(np.full(3, 0.4), (groups, styles_))
    slopes = {edge: rng.normal(size=(2, 2)) * 1.2 for edge in edges}
    bits = rng.uniform(0.05, 0.95, (styles_, 6))

    def draw(n):
        s = rng.integers(styles_, size=n)
        values = []
        for g in range(groups):
            k = (rng.random((n, 1)) > np.cumsum(hidden[g][s], axis=1)).sum(axis=1).clip(0, 2)
            x = centers[g][k] + rng.normal(size=(n, 2))
            for (a, b), slope in slopes.items():
                if b == g:
                    x = x + values[a] @ slope.T
            values.append(x)
        return values, (rng.random((n, 6)) < bits[s]).astype(np.int8)

    def log_density(values, b):
        total = np.zeros((len(b), styles_))
        for s in range(styles_):
            total[:, s] += (b * np.log(bits[s]) + (1 - b) * np.log(1 - bits[s])).sum(axis=1)
            for g in range(groups):
                shift = np.zeros_like(values[g])
                for (a, c), slope in slopes.items():
                    shift += values[a] @ slope.T if c == g else 0.0
                e = (values[g] - shift)[:, None] - centers[g][None]
                local = -0.5 * (e**2).sum(axis=2) - np.log(2 * np.pi)
                total[:, s] += np.log(np.exp(local) @ hidden[g][s])
        return np.logaddexp.reduce(total - np.log(styles_), axis=1)

    return draw, log_density


def test_a_known_model_is_recovered():
    rng = np.random.default_rng(5)
    draw, truth = known_model(rng)
    layout = table_layout(5, 6)
    options = LearnOptions(largest=6)
    model = learn_readings(as_readings(*draw(1000)), layout, rng=rng, options=options)
    wanted = {frozenset((f"g{a}", f"g{b}")) for a, b in ((0, 1), (1, 3), (2, 4))}
    found = {frozenset(edge) for edge in model.edges}
    assert found == wanted
    values, bits = draw(1000)
    from facade_tools.exteriors.density import log_density

    gap = truth(values, bits) - log_density(network_of(model), as_readings(values, bits))
    assert gap.mean() < 0.5


def test_cheeseman_stutz_equals_enumeration():
    """Two styles, one group of two clusters: every completion weighed by its posterior."""
    rng = np.random.default_rng(8)
    layout = table_layout(1, 2)
    readings = as_readings([rng.normal(size=(4, 2))], rng.integers(0, 2, (4, 2)).astype(np.int8))
    scalings = fit_scaling(readings, layout)
    data = build(readings, layout, scalings)
    prior = Prior()
    family = Family(
        np.array([[0.7, 0.3], [0.2, 0.8]]), (), (), rng.normal(size=(2, 2, 1)),
        np.tile(np.eye(2), (2, 1, 1)),
    )  # fmt: skip
    network = Network(
        layout, scalings, np.array([0.4, 0.6]), rng.uniform(0.2, 0.8, (2, 2)), (family,)
    )
    posterior = infer(network, data)
    x = data.groups[0].x
    counts = np.zeros((2, 2))
    ones, zeros = np.zeros((2, 2)), np.zeros((2, 2))
    uu, xu, xx = np.zeros((2, 1, 1)), np.zeros((2, 2, 1)), np.zeros((2, 2, 2))
    loglik = 0.0
    for n in range(4):
        joint = np.zeros((2, 2))
        for s, k in product(range(2), range(2)):
            e = x[n] - family.coef[k, :, 0]
            bit = np.prod(np.where(data.bits[n] == 1, network.bits[s], 1 - network.bits[s]))
            joint[s, k] = network.style[s] * bit * family.hidden[s, k]
            joint[s, k] *= np.exp(-0.5 * e @ e) / (2 * np.pi)
        loglik += np.log(joint.sum())
        p = joint / joint.sum()
        counts += p
        ones += p.sum(axis=1)[:, None] * (data.bits[n] == 1)
        zeros += p.sum(axis=1)[:, None] * (data.bits[n] == 0)
        w = p.sum(axis=0)
        uu += w[:, None, None]
        xu += w[:, None, None] * x[n][None, :, None]
        xx += w[:, None, None] * np.outer(x[n], x[n])
    stats = Statistics(uu, xu, xx, (), counts)
    from facade_tools.exteriors.score import gaussian_part

    expected = loglik + gaussian_part(stats, family, prior)
    expected += table_part(counts.sum(axis=1), network.style, prior.style)
    expected += table_part(counts, family.hidden, prior.hidden)
    pseudo = bit_pseudo_counts(1.0 * (data.bits == 1), 1.0 * (data.bits == 0), prior)
    for b, (a, c) in enumerate(zip(*(1 + pseudo), strict=True)):
        p, one, zero = network.bits[:, b], ones[:, b], zeros[:, b]
        expected += (betaln(a + one, c + zero) - betaln(a, c)).sum()
        expected -= (one * np.log(p) + zero * np.log(1 - p)).sum()
    found = cheeseman_stutz(network, data, unit_weights(data), posterior, prior)
    assert found == pytest.approx(expected)


def test_bit_that_a_style_does_not_know_has_the_share_of_all_rows():
    one, zero = np.zeros((10, 1)), np.ones((10, 1))
    one[0], zero[0] = 1.0, 0.0
    pseudo = bit_pseudo_counts(one, zero, Prior())
    style = np.stack([np.ones(10), np.zeros(10)])
    chance = beta_mode(style @ one, style @ zero, pseudo)
    assert chance[1, 0] == pytest.approx(1.5 / 11)
    assert chance[0, 0] == pytest.approx((1 + 1.5 / 11) / 11)


# --- whole runs ---------------------------------------------------------------------------------


def test_search_tries_every_number_of_styles(houses):
    layout = building_layout()
    readings = read_attributes(houses[::6], layout)
    scalings = fit_scaling(readings, layout)
    data = build(readings, layout, scalings)
    limits = Limits(largest=6, lateral=False)
    search = Search(layout, data, scalings, unit_weights(data), Prior(), limits)
    best = search_structure(search)
    assert {t.style for t in search.tried} == set(range(2, 7))
    assert best.score == max(t.score for t in search.tried)


@pytest.mark.parametrize("variant", ["full", "no-middle", "flat", "gmm"])
def test_every_variant_learns_the_same_schema(houses, variant):
    options = LearnOptions(variant=variant, largest=3)
    model = learn_model(houses[::5], rng=np.random.default_rng(0), options=options)
    assert model.variant == variant
    assert np.isfinite(negative_log_density(model, houses)).all()


def test_faithful_and_restarts_learn(houses):
    options = LearnOptions("no-lateral", faithful=True, largest=2, restarts=2)
    model = learn_model(houses[::6], rng=np.random.default_rng(0), options=options)
    assert model.faithful
    assert all(c.transform == "identity" for g in model.groups for c in g.coordinates)


def test_what_nobody_observes_comes_from_the_prior(houses):
    nothing = ((None,) * 6,) * 2
    rows = [
        replace(
            h,
            facade=replace(h.facade, sym=(None,) * 4),
            mass=replace(h.mass, porch=nothing),
        )
        for h in houses[:40]
    ]
    options = LearnOptions("no-lateral", largest=2)
    model = learn_model(rows, rng=np.random.default_rng(0), options=options)
    assert {"sym.front", "porch_front", "porch_front.px"} <= set(model.unobserved)
    assert "wwr.front" not in model.unobserved
    assert model.count == 40


def test_singular_data_learns(houses):
    """Copies of one house: constant columns, singular clusters, an absent garage everywhere."""
    rows = [replace(houses[0], id=str(i)) for i in range(12)]
    model = learn_model(rows, rng=np.random.default_rng(0), options=LearnOptions(largest=3))
    assert np.isfinite(negative_log_density(model, rows)).all()


def test_one_building_is_not_enough(houses):
    with pytest.raises(InvalidInput, match="at least 2"):
        learn_model(houses[:1], rng=np.random.default_rng(0))


def test_splits_are_disjoint_and_repeat():
    for train, test in splits(50, 3, 0):
        assert sorted(train + test) == list(range(50))
        assert len(test) == 10
    assert list(splits(50, 2, 1)) == list(splits(50, 2, 1))


def test_comparison_pairs_the_same_rows(houses):
    options = LearnOptions(largest=2)
    table = compare_variants(
        BuildingRows(houses[::6]), 1, options=options, variants=("no-lateral", "flat")
    )
    assert [row.variant for row in table] == ["no-lateral", "flat"]
    assert table[0].difference == 0.0
    assert table[0].rows == table[1].rows == 10


def test_training_curve_uses_more_and_more_rows(houses):
    options = LearnOptions("no-lateral", largest=2)
    curve = training_curve(BuildingRows(houses[::4]), options=options, shares=(0.5, 1.0))
    assert [rows for rows, _ in curve] == [29, 58]
    assert np.isfinite([nll for _, nll in curve]).all()


def test_a_prior_without_what_is_unobserved_is_refused(houses):
    rows = [replace(house, facade=FacadeAttributes()) for house in houses[:20]]

    def learn(prior):
        options = LearnOptions(largest=2, prior_rows=prior)
        return learn_model(rows, rng=np.random.default_rng(0), options=options)

    assert "wwr.front" in learn(houses[20:40]).unobserved
    for prior in ([], rows):
        with pytest.raises(InvalidInput, match=r"nor the prior observes wwr\.front"):
            learn(prior)


def test_a_table_of_any_kind(tmp_path):
    rng = np.random.default_rng(4)
    with (tmp_path / "table.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["id", "a", "b", "c", "flag"])
        for i in range(60):
            a = rng.normal()
            row = [f"r{i}", a, 2 * a + 0.1 * rng.normal(), rng.gamma(2.0), int(rng.random() < 0.3)]
            out.writerow("" if rng.random() < 0.05 and j else x for j, x in enumerate(row))
    text = "groups: {pair: [a, b], size: {columns: [c], transform: log}}\nbits: {flags: [flag]}\n"
    (tmp_path / "groups.yaml").write_text(text)
    paths = [read_whole(str(tmp_path / "table.csv"))], str(tmp_path / "groups.yaml")
    model = learn_table(*paths, rng=rng, options=LearnOptions(largest=3))
    assert [g.name for g in model.groups] == ["pair", "size"]
    assert model.count == 60
    (tmp_path / "groups.yaml").write_text("groups: {pair: [a, nobody]}")
    with pytest.raises(InvalidInput, match="nobody"):
        learn_table(*paths, rng=rng, options=LearnOptions(largest=3))
