"""Learning a model of building exteriors from attribute vectors (FW16 5.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.model import Model, TrainingRows
from ..errors import InvalidInput
from . import mixture, styles
from .coordinates import Readings, read_attributes, stack
from .dataset import Dataset, Scaling, build, fit_scaling
from .em import Fit, Prior, Stop, run
from .groups import GROUPS, Boundary, Group
from .layout import Layout, building_layout
from .network import Network, Weights, edges
from .prior import shipped_prior, unobserved_bits, unobserved_coordinates, weights_with_prior
from .serialisation import bits_to_model, groups_to_model

Variant = Literal["full", "no-lateral", "no-middle", "flat", "gmm"]

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

    Raises InvalidInput where there are fewer, or where one observes nothing.
    """
    if len(attributes) < 2:
        raise InvalidInput(f"{len(attributes)} buildings to learn from; expected at least 2")
    problem = prepare(attributes, options)
    fit = fixed_structure(problem, options)
    heights = float(np.median([row.storey_height for row in attributes]))
    return to_model(problem, fit, options, heights, rng)


def boundary_of(rows: Sequence[Attributes]) -> Boundary:
    """Return `x` where at least half of the rows observe w, d and bcr, else `bdry`."""
    whole = sum(row.mass.bcr is not None and None not in row.mass.bbox[:2] for row in rows)
    return "x" if 2 * whole >= len(rows) else "bdry"


def prepare(attributes: Sequence[Attributes], options: LearnOptions) -> Problem:
    """Return the problem of attribute vectors; prior rows join where something is unobserved."""
    layout = building_layout(boundary_of(attributes), options.groups, plain=options.faithful)
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
    return problem_of(readings, layout, extra, names, missing)


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


def fixed_structure(problem: Problem, options: LearnOptions, size: int = 4) -> Fit:
    """Return the model with fixed cardinalities and no lateral edges."""
    fits = []
    for g, group in enumerate(problem.layout.groups):
        task = mixture.Task(
            problem.data, g, group, problem.scalings[g], problem.weights.groups[g], options.prior
        )
        fit = mixture.single(task)
        while len(fit.family.coef) < size:
            fit = mixture.grow(task, fit)
        fits.append(fit)
    shown = styles.evidence([fit.local for fit in fits])
    everyone = np.ones((len(problem.data), 1))
    upper = styles.first(shown, problem.data, problem.weights, options.prior, everyone)
    while len(upper.style) < size:
        upper = styles.grow(upper, shown, problem.data, problem.weights, options.prior)
    families = tuple(
        replace(fit.family, hidden=hidden) for fit, hidden in zip(fits, upper.hidden, strict=True)
    )
    network = Network(problem.layout, problem.scalings, upper.style, upper.bits, families)
    return run(network, problem.data, options.prior, weights=problem.weights, stop=Stop())


def to_model(
    problem: Problem, fit: Fit, options: LearnOptions, height: float, rng: np.random.Generator
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
        unobserved=problem.unobserved,
        storey_height=height,
        training=training_rows(problem, rng),
    )


def training_rows(problem: Problem, rng: np.random.Generator) -> TrainingRows:
    """Return the rows that the model carries: all, or `KEPT_ROWS` drawn by `rng`."""
    rows = np.arange(problem.train)
    if len(rows) > KEPT_ROWS:
        rows = np.sort(rng.choice(rows, KEPT_ROWS, replace=False))
    kept = problem.readings.take(rows)
    table = np.concatenate([*kept.values, np.where(kept.bits < 0, np.nan, kept.bits)], axis=1)
    shown = [[x if np.isfinite(x) else None for x in row] for row in table.tolist()]
    return TrainingRows(kept.ids, tuple(map(tuple, shown)))
