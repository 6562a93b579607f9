"""The last stage: pixels of the picture's own resolution that the stages before leave in doubt."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
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
from ..imaging.features_fine import enlarged, fine_features
from .trees import Codes, Trees, softmax

CERTAIN = 0.98  # what the stages before believe more than this stays
BLOCK = 20_000  # pixels whose codes are in memory at once, in each thread
THREADS = 2


@dataclass(frozen=True, slots=True)
class Planes:
    """All that the last stage sees of a picture.

    coarse: planes of the working resolution. fine: planes of the picture. belief: of the stages
    before, interpolated; None where there are none.
    """

    coarse: Features
    fine: Features
    belief: Probabilities | None

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the picture."""
        return self.fine.shape[1], self.fine.shape[2]

    def doubtful(self) -> NDArray[np.bool_]:
        """Return where the last stage is asked, (height, width)."""
        if self.belief is None:
            return np.ones(self.shape, np.bool_)
        doubt: NDArray[np.bool_] = self.belief.max(axis=0) < CERTAIN
        return doubt

    def codes(self, at: NDArray[np.intp]) -> Codes:
        """Return the features of pixels given by flat indices, (pixels, features)."""
        height, width = self.shape
        y, x = np.divmod(at, width)
        rows = (2 * y + 1) * self.coarse.shape[1] // (2 * height)
        columns = (2 * x + 1) * self.coarse.shape[2] // (2 * width)
        parts = [self.coarse[:, rows, columns], self.fine[:, y, x]]
        return np.ascontiguousarray(np.concatenate(parts).T)


def planes_of(picture: Picture, coarse: Picture, before: Probabilities | None) -> Planes:
    """Return the planes of a picture, its coarse version, and the coarse belief about it."""
    low, fine = pixel_features(coarse), fine_features(picture)
    if before is None:
        return Planes(low, fine, None)
    shape = picture.shape[:2]
    belief = enlarged(before, shape)
    means = [belief_features(enlarged(one, shape)) for one in repeated(before)]
    fine = np.concatenate([fine, belief_features(belief), *means])
    return Planes(np.concatenate([low, context_features(before)]), fine, belief)


def finished(trees: Trees, planes: Planes) -> Probabilities:
    """Return class probabilities of every pixel, (classes, height, width)."""
    where = np.flatnonzero(planes.doubtful())
    height, width = planes.shape
    out = np.zeros((trees.classes, height * width), np.float32)
    if planes.belief is not None:
        out[:] = planes.belief.reshape(trees.classes, -1)

    def fill(at: NDArray[np.intp]) -> None:
        out[:, at] = softmax(trees.scores(planes.codes(at))).T

    blocks = [where[start : start + BLOCK] for start in range(0, len(where), BLOCK)]
    with ThreadPoolExecutor(THREADS) as pool:  # compiled loops let go of the interpreter
        list(pool.map(fill, blocks))
    return out.reshape(-1, height, width)
