"""Auto-context: each stage of the classifier also sees what the stage before believes.

The first stages look at a coarse picture and only give context; the last one or two look at the
picture itself, where the context leaves doubt.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Features, Picture, pixel_features
from ..imaging.features_context import (
    Probabilities,
    belief_features,
    context_features,
    repeated,
)
from ..imaging.features_fine import fine_features
from ..imaging.image_io import fitted
from .final import Planes, finished, planes_again, planes_of
from .trees import Codes, Trees, softmax

Labels = NDArray[np.uint8]  # (height, width), 0 is ignored, k is class k - 1

EARLY_STRIDE = 3  # early stages only give context, which is smooth
COARSE_PIXELS = 160_000
FINE = 2  # stages that see the picture itself

Fit = Callable[[Sequence[Codes], NDArray[np.intp]], Trees]


@dataclass(frozen=True, slots=True)
class Example:
    """A picture and its label map, and both at the resolution of the early stages.

    Variants of a picture share its `fold`.
    """

    picture: Picture
    labels: Labels
    coarse: Picture
    coarse_labels: Labels
    fold: int


@dataclass(frozen=True, slots=True)
class Belief:
    """Class probabilities at every EARLY_STRIDE-th pixel of a picture, a ninth of its memory.

    asked: (classes, rows, columns). shape: height and width of the picture.
    """

    asked: Probabilities
    shape: tuple[int, int]

    def whole(self) -> Probabilities:
        """Return the probabilities of all pixels, (classes, height, width)."""
        step = np.array([[1 / EARLY_STRIDE, 0, 0], [0, 1 / EARLY_STRIDE, 0]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = (self.shape[1], self.shape[0])
        edge = cv2.BORDER_REPLICATE
        return np.stack([
            cv2.warpAffine(one, step, size, flags=flags, borderMode=edge) for one in self.asked
        ])  # fmt: skip


def example(picture: Picture, labels: Labels, height: int, fold: int) -> Example:
    """Return an example whose early stages work at `height` rows."""
    coarse = fitted(picture, height, COARSE_PIXELS)
    size = (coarse.shape[1], coarse.shape[0])
    small = cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST).astype(np.uint8)
    return Example(picture, labels, coarse, small, fold)


def features_of(picture: Picture, before: Probabilities | None) -> Features:
    """Return all planes that an early stage sees; `before` is the belief of the stage before."""
    planes = pixel_features(picture)
    if before is None:
        return planes
    means = [belief_features(one) for one in repeated(before)]
    return np.concatenate([planes, context_features(before), *means])


def predict(trees: Trees, features: Features) -> Belief:
    """Return what an early stage believes, asked at every EARLY_STRIDE-th pixel."""
    count, height, width = features.shape
    asked = features[:, ::EARLY_STRIDE, ::EARLY_STRIDE]
    codes = np.ascontiguousarray(asked.reshape(count, -1).T)
    shares = np.ascontiguousarray(softmax(trees.scores(codes)).T)
    return Belief(shares.reshape(-1, *asked.shape[1:]), (height, width))


def run_stages(
    stages: Sequence[Trees],
    picture: Picture,
    height: int,
    fine: int,
    told: NDArray[np.bool_] | None = None,
) -> Probabilities:
    """Return the belief of the last stages about a picture.

    fine: how many of the stages see the picture itself, 1 or 2; the others see `height` rows.
    told: pixels that the last stages need not be asked about.
    """
    coarse = fitted(picture, height, COARSE_PIXELS)
    before: Probabilities | None = None
    for trees in stages[:-fine]:
        before = predict(trees, features_of(coarse, before)).whole()
    edges = fine_features(picture)
    first = finished(stages[-fine], planes_of(edges, coarse, before), told)
    if fine == 1:
        return first
    second = finished(stages[-1], planes_again(edges, first), told)
    mean: Probabilities = (first + second) / np.float32(2)
    return mean


def sample_pixels(
    known: NDArray[np.bool_], count: int, rng: np.random.Generator
) -> NDArray[np.intp]:
    """Return flat indices of at most `count` of the pixels that are set."""
    at = np.flatnonzero(known)
    if len(at) <= count:
        return at
    return np.sort(rng.choice(at, count, replace=False))


def train_stages(
    examples: Sequence[Example],
    fits: Sequence[Fit],
    pixels: int,
    *,
    rng: np.random.Generator,
) -> tuple[Trees, ...]:
    """Return the stages of a classifier, one a fit; the last two see the picture itself.

    The belief that a stage trains on comes from models that did not see the picture: the stage
    before is trained once for each fold without it, and once on everything to be kept.
    """
    before: list[Belief | None] = [None] * len(examples)
    kept: list[Trees] = []
    for fit in fits[:-FINE]:
        trees, before = _coarse_stage(examples, before, fit, pixels, rng)
        kept.append(trees)
    return (*kept, *_fine_stages(examples, before, fits[-FINE:], pixels, rng))


def _coarse_stage(
    examples: Sequence[Example],
    before: Sequence[Belief | None],
    fit: Fit,
    pixels: int,
    rng: np.random.Generator,
) -> tuple[Trees, list[Belief | None]]:
    """Return a stage, and its belief about each example from a model that did not see it."""
    chosen = [sample_pixels(e.coarse_labels > 0, pixels, rng) for e in examples]
    codes = [_codes(e, _whole(b), at) for e, b, at in zip(examples, before, chosen, strict=True)]
    labels = [
        e.coarse_labels.ravel()[at].astype(np.intp) - 1
        for e, at in zip(examples, chosen, strict=True)
    ]
    models = _left_out(examples, codes, labels, fit)
    after = [
        predict(models[e.fold], features_of(e.coarse, _whole(b)))
        for e, b in zip(examples, before, strict=True)
    ]
    return fit(codes, np.concatenate(labels)), list(after)


def _whole(belief: Belief | None) -> Probabilities | None:
    return None if belief is None else belief.whole()


def _codes(example: Example, before: Probabilities | None, at: NDArray[np.intp]) -> Codes:
    planes = features_of(example.coarse, before)
    return np.ascontiguousarray(planes.reshape(len(planes), -1)[:, at].T)


def _left_out(
    examples: Sequence[Example],
    codes: Sequence[Codes],
    labels: Sequence[NDArray[np.intp]],
    fit: Fit,
) -> dict[int, Trees]:
    """Return for each fold a model trained without it."""
    models: dict[int, Trees] = {}
    for fold in sorted({e.fold for e in examples}):
        rest = [i for i, e in enumerate(examples) if e.fold != fold]
        models[fold] = fit([codes[i] for i in rest], np.concatenate([labels[i] for i in rest]))
    return models


def _fine_stages(
    examples: Sequence[Example],
    before: Sequence[Belief | None],
    fits: Sequence[Fit],
    pixels: int,
    rng: np.random.Generator,
) -> Iterator[Trees]:
    """Train on pixels that the stages before leave in doubt."""
    codes, labels = [], []
    for example, belief in zip(examples, before, strict=True):
        planes = planes_of(fine_features(example.picture), example.coarse, _whole(belief))
        code, label = _in_doubt(example, planes, pixels, rng)
        codes.append(code)
        labels.append(label)
    yield fits[0](codes, np.concatenate(labels))
    if len(fits) == 1:
        return
    models = _left_out(examples, codes, labels, fits[0])
    for i, (example, belief) in enumerate(zip(examples, before, strict=True)):
        edges = fine_features(example.picture)
        first = finished(models[example.fold], planes_of(edges, example.coarse, _whole(belief)))
        again = planes_again(edges, first)
        codes[i], labels[i] = _in_doubt(example, again, pixels, rng)
    yield fits[1](codes, np.concatenate(labels))


def _in_doubt(
    example: Example, planes: Planes, pixels: int, rng: np.random.Generator
) -> tuple[Codes, NDArray[np.intp]]:
    at = sample_pixels(planes.doubtful() & (example.labels > 0), pixels, rng)
    return planes.codes(at), example.labels.ravel()[at].astype(np.intp) - 1
