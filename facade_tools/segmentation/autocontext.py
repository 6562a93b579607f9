"""Auto-context: each stage of the classifier also sees what the stage before believes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Features, Picture, pixel_features
from ..imaging.features_context import Probabilities, context_features
from .trees import Codes, Trees, softmax

Labels = NDArray[np.uint8]  # (height, width), 0 is ignored, k is class k - 1

EARLY_STRIDE = 3  # early stages only give context, which is smooth

Fit = Callable[[Codes, NDArray[np.intp]], Trees]


@dataclass(frozen=True, slots=True)
class Example:
    """A picture at working resolution and its label map; variants of a picture share its `fold`."""

    picture: Picture
    labels: Labels
    fold: int


def features_of(picture: Picture, before: Probabilities | None) -> Features:
    """Return all planes that a stage sees; `before` is the belief of the stage before."""
    planes = pixel_features(picture)
    return planes if before is None else np.concatenate([planes, context_features(before)])


def predict(trees: Trees, features: Features, stride: int = 1) -> Probabilities:
    """Return class probabilities, (classes, height, width); `stride` asks every n-th pixel only."""
    count, height, width = features.shape
    asked = features[:, ::stride, ::stride]
    codes = np.ascontiguousarray(asked.reshape(count, -1).T)
    shares = np.ascontiguousarray(softmax(trees.scores(codes)).T)
    coarse = shares.reshape(-1, *asked.shape[1:])
    return coarse if stride == 1 else _between(coarse, stride, (height, width))


def _between(coarse: Probabilities, stride: int, shape: tuple[int, int]) -> Probabilities:
    """Interpolate planes that were asked at every `stride`-th pixel, from the first on."""
    step = np.array([[1 / stride, 0, 0], [0, 1 / stride, 0]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    size = (shape[1], shape[0])
    edge = cv2.BORDER_REPLICATE
    planes = [cv2.warpAffine(one, step, size, flags=flags, borderMode=edge) for one in coarse]
    return np.stack(planes)


def run_stages(stages: Sequence[Trees], picture: Picture) -> Probabilities:
    """Return the belief of the last stage about a picture at working resolution."""
    pixels = pixel_features(picture)
    before: Probabilities | None = None
    for number, trees in enumerate(stages, 1):
        planes = pixels if before is None else np.concatenate([pixels, context_features(before)])
        before = predict(trees, planes, 1 if number == len(stages) else EARLY_STRIDE)
    assert before is not None
    return before


def sample_pixels(labels: Labels, count: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Return flat indices of at most `count` labelled pixels."""
    known = np.flatnonzero(labels)
    if len(known) <= count:
        return known
    return np.sort(rng.choice(known, count, replace=False))


def train_stages(
    examples: Sequence[Example], fit: Fit, stages: int, pixels: int, *, rng: np.random.Generator
) -> tuple[Trees, ...]:
    """Return the stages of a classifier.

    The belief that a stage trains on comes from models that did not see the picture: the stage
    before is trained once for each fold without it, and once on everything to be kept.
    """
    chosen = [sample_pixels(e.labels, pixels, rng) for e in examples]
    labels = [
        e.labels.ravel()[at].astype(np.intp) - 1 for e, at in zip(examples, chosen, strict=True)
    ]
    before: list[Probabilities | None] = [None] * len(examples)
    kept: list[Trees] = []
    for stage in range(stages):
        codes = [_codes(e, b, at) for e, b, at in zip(examples, before, chosen, strict=True)]
        kept.append(fit(np.concatenate(codes), np.concatenate(labels)))
        if stage + 1 < stages:
            before = list(_left_out(examples, before, codes, labels, fit))
    return tuple(kept)


def _codes(example: Example, before: Probabilities | None, at: NDArray[np.intp]) -> Codes:
    planes = features_of(example.picture, before)
    return np.ascontiguousarray(planes.reshape(len(planes), -1)[:, at].T)


def _left_out(
    examples: Sequence[Example],
    before: Sequence[Probabilities | None],
    codes: Sequence[Codes],
    labels: Sequence[NDArray[np.intp]],
    fit: Fit,
) -> Iterator[Probabilities]:
    """Yield for each example the belief of a model trained without its fold."""
    models: dict[int, Trees] = {}
    for fold in sorted({e.fold for e in examples}):
        rest = [i for i, e in enumerate(examples) if e.fold != fold]
        models[fold] = fit(
            np.concatenate([codes[i] for i in rest]), np.concatenate([labels[i] for i in rest])
        )
    for example, belief in zip(examples, before, strict=True):
        yield predict(models[example.fold], features_of(example.picture, belief), EARLY_STRIDE)
