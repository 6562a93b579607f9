"""Beliefs of windows and walls moved towards another reading, as far as the classifier doubts.

A classifier that meets pictures unlike those it has seen doubts, and is wrong where it does not;
what repeats in rows and columns is seen without any training.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS
from ..imaging.features_context import Probabilities

WEIGHT = 1.5  # of the second reading at most: log odds of a window, and of a wall
SURE, LOST = 0.3, 0.5  # mean entropies in nats: below, it counts nothing; above, all of its weight


def moved(
    belief: Probabilities, classes: tuple[str, ...], labels: NDArray[np.uint8]
) -> Probabilities:
    """Return beliefs (classes, height, width) that sum to 1, seen together with other labels.

    labels: another reading's label map, of any size. Where it has a window, windows gain and walls
    lose; elsewhere the other way round. Other classes only follow the sum.
    """
    doubt = (_mean_entropy(belief) - SURE) / (LOST - SURE)
    weight = WEIGHT * min(max(doubt, 0.0), 1.0)
    windows = (labels == LABELS.index("window")).astype(np.float32)
    size = (belief.shape[2], belief.shape[1])
    share = cv2.resize(windows, size, interpolation=cv2.INTER_AREA)
    factor = np.exp(np.float32(weight) * (2 * share - 1))
    out = belief.copy()
    for name, by in (("window", factor), ("wall", 1 / factor)):
        if name in classes:
            out[classes.index(name)] *= by
    out /= out.sum(axis=0)
    return out


def _mean_entropy(belief: Probabilities) -> float:
    """Return the mean over pixels of −Σ p ln p."""
    return float(-(belief * np.log(np.maximum(belief, 1e-6))).sum(axis=0).mean())
