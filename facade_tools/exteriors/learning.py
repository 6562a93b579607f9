"""Learning a model of building exteriors from attribute vectors (FW16 5.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.model import Configuration, Model, TrainingRows
from ..errors import InvalidInput
from . import variants
from .coordinates import Readings, read_attributes, stack
from .dataset import Dataset, Scaling, build, fit_scaling
from .em import Fit, Prior, Stop, run
from .groups import GROUPS, Boundary, Group
from .joint_search import Joint, settled_together
from .lateral import parent_of
from .layout import Layout, building_layout, merged
from .network import Network, Weights, edges
from .prior import shipped_prior, unobserved_bits, unobserved_coordinates, weights_with_prior
from .score import cheeseman_stutz
from .serialisation import bits_to_model, groups_to_model
from .structure_search import Limits, Search, Tried, search_structure

Variant = Literal["full", "no-lateral", "no-middle", "flat", "gmm"]

LAST_ITERATIONS = 200  # of the winner, after EM has nearly settled
SEARCH_ROWS = 4000  # of which the structure is searched; EM then sees all
KEPT_ROWS = 5000  # training rows that a model carries for nearest neighbours


@dataclass(frozen=True, slots=True)
class LearnOptions:
    """How to learn. prior_rows: None takes the shipped sample houses."""

    variant: Variant = "full"
    faithful: bool = False
    restarts: int = 1
    prior: Prior = field(default_factory=Prior)
    prior_rows: Sequence[Attributes] | None = None
    groups: tuple[Group, ...] = GROUPS
    largest: int = 25


@dataclass(frozen=True, slots=True)
class Problem:
    """What learning works on: rows (training first, then prior), weights, layout, scalings."""

    layout: Layout
    readings: Readings
    data: Dataset
    scalings: tuple[Scaling, ...]
    weights: Weights
    train: int
    unobserved: tuple[str, ...]


def learn_model(
    attributes: Sequence[Attributes],
    *,
    rng: np.random.Generator,
    options: LearnOptions = LearnOptions(),
) -> Model:
    """Return the model learned from at least two attribute vectors.

    Raises InvalidInput where there are fewer, or where the prior lacks what they lack.
    """
    if len(attributes) < 2:
        raise InvalidInput(f"{len(attributes)} buildings to learn from; expected at least 2")
    problem = prepare(attributes, options)
    fit, tried = fit_variant(problem, options, rng)
    heights = float(np.median([row.storey_height for row in attributes]))
    return to_model(problem, fit, tried, options, heights, rng)


def learn_readings(
    readings: Readings, layout: Layout, *, rng: np.random.Generator, options: LearnOptions
) -> Model:
    """Return the model of rows that are no buildings: what nobody observes stays unknown.

    `unobserved` lists that.

    Raises InvalidInput on fewer than two rows.
    """
    if len(readings) < 2:
        raise InvalidInput(f"{len(readings)} rows to learn from; expected at least 2")
    missing = unobserved_coordinates(readings, layout)
    names = (*(name for group in missing for name in group), *unobserved_bits(readings, layout))
    problem = problem_of(readings, layout, 0, names, [[] for _ in layout.groups])
    fit, tried = fit_variant(problem, options, rng)
    return to_model(problem, fit, tried, options, 1.0, rng)


def boundary_of(rows: Sequence[Attributes]) -> Boundary:
    """Return `x` where at least half of the rows observe w, d and bcr, else `bdry`."""
    whole = sum(row.mass.bcr is not None and None not in row.mass.bbox[:2] for row in rows)
    return "x" if 2 * whole >= len(rows) else "bdry"


def prepare(attributes: Sequence[Attributes], options: LearnOptions) -> Problem:
    """Return the problem of attribute vectors; prior rows join where something is unobserved."""
    layout = building_layout(boundary_of(attributes), options.groups, plain=options.faithful)
    if options.variant == "gmm":
        layout = merged(layout)
    readings = read_attributes(attributes, layout, options.groups)
    missing = unobserved_coordinates(readings, layout)
    bits = unobserved_bits(readings, layout)
    names = tuple(name for group in missing for name in group) + tuple(bits)
    extra = 0
    if names:
        prior = shipped_prior() if options.prior_rows is None else options.prior_rows
        more = read_attributes(prior, layout, options.groups)
        extra = len(more)
        readings = stack(readings, more)
        _refuse_unknown(readings, layout)
    return problem_of(readings, layout, extra, names, missing)


def _refuse_unknown(readings: Readings, layout: Layout) -> None:
    names = [name for group in unobserved_coordinates(readings, layout) for name in group]
    names += unobserved_bits(readings, layout)
    if names:
        message = f"neither what is learned from nor the prior observes {', '.join(names)}"
        raise InvalidInput(f"{message}; expected a prior that does")


def problem_of(
    readings: Readings,
    layout: Layout,
    extra: int,
    names: tuple[str, ...],
    missing: list[list[str]],
) -> Problem:
    """Return the problem of readings whose last `extra` rows are the prior's."""
    train = len(readings) - extra
    scalings = _scalings(readings, layout, train, missing)
    data = build(readings, layout, scalings)
    weights = weights_with_prior(readings, layout, extra, missing)
    return Problem(layout, readings, data, scalings, weights, train, names)


def _scalings(
    readings: Readings, layout: Layout, train: int, missing: list[list[str]]
) -> tuple[Scaling, ...]:
    """Scale by the training rows; what they never observe, by the prior's."""
    own = fit_scaling(readings.take(np.arange(train)), layout)
    if train == len(readings):
        return own
    other = fit_scaling(readings.take(np.arange(train, len(readings))), layout)
    out = []
    for a, b, group, names in zip(own, other, layout.groups, missing, strict=True):
        lent = np.array([c.name in names for c in group.coordinates], dtype=np.bool_)
        out.append(Scaling(np.where(lent, b.center, a.center), np.where(lent, b.scale, a.scale)))
    return tuple(out)


def fit_variant(
    problem: Problem, options: LearnOptions, rng: np.random.Generator
) -> tuple[Fit, list[Tried]]:
    """Return the fitted network of the variant, and every configuration that was tried."""
    tried: list[Tried] = []
    plain = options.faithful or options.variant in ("flat", "gmm")
    rows = variants.Rows(
        problem.layout, problem.data, problem.scalings, problem.weights, options.prior, plain
    )
    if options.variant == "no-middle":
        fit = variants.no_middle(rows, options.largest, tried)
    elif options.variant == "flat":
        fit = variants.flat(rows, tried)
    elif options.variant == "gmm":
        fit = variants.gmm(rows, options.largest, tried)
    else:
        return fit_hierarchical(problem, options, rng)
    return finished(problem, fit.network, options), tried


def fit_hierarchical(
    problem: Problem, options: LearnOptions, rng: np.random.Generator
) -> tuple[Fit, list[Tried]]:
    """Return the best of the searched structures after EM to the end, on all rows."""
    part = searched_rows(problem, rng)
    limits = Limits(largest=options.largest, lateral=options.variant != "no-lateral")
    best: Joint | None = None
    tried: list[Tried] = []
    for restart in range(options.restarts):
        search = Search(part.layout, part.data, part.scalings, part.weights, options.prior, limits)
        search.tied = options.faithful
        search.rng = rng if restart else None
        found = settled_together(search, search.network(search_structure(search)))
        tried += search.tried
        if best is None or found.score > best.score:
            best = found
    assert best is not None
    return finished(problem, best.fit.network, options), tried


def searched_rows(problem: Problem, rng: np.random.Generator) -> Problem:
    """Return the problem of at most `SEARCH_ROWS` training rows, drawn by `rng`, and the prior."""
    if problem.train <= SEARCH_ROWS:
        return problem
    chosen = np.sort(rng.choice(problem.train, SEARCH_ROWS, replace=False))
    rows = np.concatenate([chosen, np.arange(problem.train, len(problem.readings))])
    readings, w = problem.readings.take(rows), problem.weights
    weights = Weights(w.style[rows], tuple(g[rows] for g in w.groups), w.bits[rows])
    data = build(readings, problem.layout, problem.scalings)
    return replace(problem, readings=readings, data=data, weights=weights, train=SEARCH_ROWS)


def finished(problem: Problem, network: Network, options: LearnOptions) -> Fit:
    """Return the network after EM until its parameters rest."""
    stop = Stop(parameters=1e-6, iterations=LAST_ITERATIONS)
    fit = run(network, problem.data, options.prior, weights=problem.weights, stop=Stop())
    return run(fit.network, problem.data, options.prior, weights=problem.weights, stop=stop)


def to_model(
    problem: Problem,
    fit: Fit,
    tried: Sequence[Tried],
    options: LearnOptions,
    height: float,
    rng: np.random.Generator,
) -> Model:
    """Return the artifact of a fit."""
    network = fit.network
    sizes = {"style": len(network.style)}
    sizes |= {
        g.name: len(f.coef) for g, f in zip(network.layout.groups, network.families, strict=True)
    }
    return Model(
        id="model",
        variant=options.variant,
        boundary=network.layout.boundary,
        count=problem.train,
        style=tuple(network.style.tolist()),
        elements=bits_to_model(network),
        groups=groups_to_model(network),
        faithful=options.faithful,
        cardinalities=sizes,
        edges=tuple(edges(network)),
        score=cheeseman_stutz(network, problem.data, problem.weights, fit.posterior, options.prior),
        trace=score_trace(tried),
        search=tuple(configuration(one, network.layout) for one in tried),
        unobserved=problem.unobserved,
        storey_height=height,
        training=training_rows(problem, rng),
    )


def score_trace(tried: Sequence[Tried]) -> tuple[float, ...]:
    """Return the best score so far after each change of |S|."""
    out: list[float] = []
    last, best = -1, -np.inf
    for one in tried:
        best = max(best, one.score)
        if one.style == last:
            out[-1] = best
        else:
            out.append(best)
        last = one.style
    return tuple(float(score) for score in out)


def configuration(tried: Tried, layout: Layout) -> Configuration:
    """Return a configuration as it stands in the artifact."""
    owners = parent_of(layout)
    pairs = sorted({(g, owners[f]) for g, features in enumerate(tried.inputs) for f in features})
    names = [group.name for group in layout.groups]
    bits = [group.name for group in layout.bit_groups]
    named = tuple((names[p] if p >= 0 else bits[-1 - p], names[g]) for g, p in pairs)
    return Configuration(tried.style, tried.hidden, tried.score, named)


def training_rows(problem: Problem, rng: np.random.Generator) -> TrainingRows:
    """Return the rows that the model carries: all, or `KEPT_ROWS` drawn by `rng`."""
    rows = np.arange(problem.train)
    if len(rows) > KEPT_ROWS:
        rows = np.sort(rng.choice(rows, KEPT_ROWS, replace=False))
    kept = problem.readings.take(rows)
    table = np.concatenate([*kept.values, np.where(kept.bits < 0, np.nan, kept.bits)], axis=1)
    shown = [[x if np.isfinite(x) else None for x in row] for row in table.tolist()]
    return TrainingRows(kept.ids, tuple(map(tuple, shown)))
