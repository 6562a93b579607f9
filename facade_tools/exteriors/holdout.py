"""The paper's comparison (FW16 Fig. 12): variants on the same random splits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.model import Model
from ..randomness import item_generator
from .coordinates import Floats, Readings, read_attributes
from .evaluation import negative_log_density
from .layout import Layout
from .learning import LearnOptions, Variant, learn_model

VARIANTS: tuple[Variant, ...] = ("full", "no-lateral", "no-middle", "flat", "gmm")
TEST_SHARE = 0.2


class Rows(Protocol):
    """Rows that a model can be learned from and that it can foresee: of buildings, of a table."""

    def __len__(self) -> int: ...

    def learn(
        self, rows: Sequence[int], options: LearnOptions, *, rng: np.random.Generator
    ) -> Model:
        """Return the model of some of the rows."""

    def foresee(self, model: Model, rows: Sequence[int]) -> Floats:
        """Return the negative log density (n,) of some of the rows, nats."""

    def under(self, layout: Layout) -> Readings:
        """Return all rows as a layout sees them."""


@dataclass(frozen=True, slots=True)
class BuildingRows:
    """The attribute vectors of buildings."""

    attributes: Sequence[Attributes]

    def __len__(self) -> int:
        return len(self.attributes)

    def learn(
        self, rows: Sequence[int], options: LearnOptions, *, rng: np.random.Generator
    ) -> Model:
        """Return the model of some of the buildings."""
        return learn_model([self.attributes[i] for i in rows], rng=rng, options=options)

    def foresee(self, model: Model, rows: Sequence[int]) -> Floats:
        """Return the negative log density (n,) of some of the buildings, nats."""
        return negative_log_density(model, [self.attributes[i] for i in rows])

    def under(self, layout: Layout) -> Readings:
        """Return all buildings as a layout sees them."""
        return read_attributes(self.attributes, layout)


@dataclass(frozen=True, slots=True)
class Comparison:
    """One variant: held-out mean NLL, and the paired difference to the first variant, nats."""

    variant: str
    nll: float
    error: float
    difference: float
    difference_error: float
    rows: int


def splits(count: int, repeats: int, seed: int) -> Iterator[tuple[list[int], list[int]]]:
    """Yield training and test rows of random 80/20 splits."""
    for repeat in range(repeats):
        order = item_generator(seed, "holdout", repeat).permutation(count).tolist()
        cut = max(1, round(count * TEST_SHARE))
        yield order[cut:], order[:cut]


def compare_variants(
    rows: Rows,
    repeats: int,
    *,
    seed: int = 0,
    options: LearnOptions | None = None,
    variants: Sequence[Variant] = VARIANTS,
) -> tuple[Comparison, ...]:
    """Return the held-out comparison of variants, each on the same splits."""
    found: dict[str, list[Floats]] = {v: [] for v in variants}
    for train, test in splits(len(rows), repeats, seed):
        for variant in variants:
            rng = item_generator(seed, "holdout", variant)
            chosen = replace(options or LearnOptions(), variant=variant)
            model = rows.learn(train, chosen, rng=rng)
            found[variant].append(rows.foresee(model, test))
    first = np.concatenate(found[variants[0]])
    return tuple(_compared(v, np.concatenate(found[v]), first) for v in variants)


def training_curve(
    rows: Rows,
    *,
    seed: int = 0,
    options: LearnOptions | None = None,
    shares: Sequence[float] = (0.125, 0.25, 0.5, 1.0),
) -> tuple[tuple[int, float], ...]:
    """Return training rows and held-out mean NLL for growing parts of the first split's 80%."""
    train, test = next(splits(len(rows), 1, seed))
    out = []
    for share in shares:
        part = train[: max(2, round(share * len(train)))]
        rng = item_generator(seed, "curve", len(part))
        model = rows.learn(part, options or LearnOptions(), rng=rng)
        out.append((len(part), float(rows.foresee(model, test).mean())))
    return tuple(out)


def _compared(variant: str, nll: Floats, first: Floats) -> Comparison:
    root = float(np.sqrt(len(nll)))
    gap = nll - first
    return Comparison(
        variant,
        float(nll.mean()),
        float(nll.std()) / root,
        float(gap.mean()),
        float(gap.std()) / root,
        len(nll),
    )


def table_lines(table: Sequence[Comparison]) -> Iterator[str]:
    """Yield the comparison as lines of text."""
    yield f"{'variant':<12} {'nll':>9} {'s.e.':>7} {'difference':>11} {'s.e.':>7}"
    for row in table:
        yield (
            f"{row.variant:<12} {row.nll:9.3f} {row.error:7.3f} "
            f"{row.difference:11.3f} {row.difference_error:7.3f}"
        )
