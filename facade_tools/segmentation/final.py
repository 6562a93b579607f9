"""The last stages: pixels of the picture's own resolution that the stages before leave in doubt.

The first of them sees where edges run and the coarse belief; the second what the first believes
around a pixel. The result is the mean of both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Features, Picture, pixel_features
from ..imaging.features_context import (
    Probabilities,
    belief_features,
    context_features,
    repeated,
)
from ..imaging.features_fine import enlarged
from .trees import Codes, Trees, softmax

CERTAIN = 0.98  # what the stages before believe more than this stays
BLOCK = 20_000  # pixels whose codes are in memory at once


@dataclass(frozen=True, slots=True)
class Planes:
    """All that a last stage sees of a picture.

    coarse: planes of the coarse picture, if any. fine: planes of the picture, in parts: together
    they would only be copied. belief: of the stages before; None where there are none.
    """

    coarse: Features | None
    fine: tuple[Features, ...]
    belief: Probabilities | None

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture."""
        height, width = self.fine[0].shape[1:]
        return height, width

    def doubtful(self) -> NDArray[np.bool_]:
        """Return where the stage is asked, (height, width)."""
        if self.belief is None:
            return np.ones(self.shape, np.bool_)
        doubt: NDArray[np.bool_] = self.belief.max(axis=0) < CERTAIN
        return doubt

    def codes(self, at: NDArray[np.intp]) -> Codes:
        """Return the features of pixels given by flat indices, (pixels, features)."""
        height, width = self.shape
        y, x = np.divmod(at, width)
        parts = [part[:, y, x] for part in self.fine]
        if self.coarse is not None:
            rows = (2 * y + 1) * self.coarse.shape[1] // (2 * height)
            columns = (2 * x + 1) * self.coarse.shape[2] // (2 * width)
            parts.insert(0, self.coarse[:, rows, columns])
        return np.ascontiguousarray(np.concatenate(parts).T)


def planes_of(edges: Features, coarse: Picture, before: Probabilities | None) -> Planes:
    """Return what the first last stage sees: the coarse picture and the belief about it too.

    edges: the fine features of the picture.
    """
    low = pixel_features(coarse)
    if before is None:
        return Planes(low, (edges,), None)
    shape = edges.shape[1], edges.shape[2]
    belief = enlarged(before, shape)
    means = [belief_features(enlarged(one, shape)) for one in repeated(before)]
    fine = (edges, belief_features(belief), *means)
    return Planes(np.concatenate([low, context_features(before)]), fine, belief)


def planes_again(edges: Features, belief: Probabilities) -> Planes:
    """Return what the second last stage sees: the belief of the first about the picture too."""
    means = [belief_features(one) for one in repeated(belief)]
    return Planes(None, (edges, context_features(belief), *means), belief)


def finished(trees: Trees, planes: Planes, told: NDArray[np.bool_] | None = None) -> Probabilities:
    """Return class probabilities of every pixel, (classes, height, width).

    told: where the belief of the stages before is enough, because something else is certain.
    """
    doubt = planes.doubtful()
    if told is not None and planes.belief is not None:
        doubt &= ~told
    where = np.flatnonzero(doubt)
    height, width = planes.shape
    out = np.zeros((trees.classes, height * width), np.float32)
    if planes.belief is not None:
        out[:] = planes.belief.reshape(trees.classes, -1)
    for start in range(0, len(where), BLOCK):
        at = where[start : start + BLOCK]
        out[:, at] = softmax(trees.scores(planes.codes(at))).T
    return out.reshape(-1, height, width)
