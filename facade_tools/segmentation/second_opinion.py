"""Beliefs of windows and walls moved towards another reading, as far as the classifier doubts.

A classifier that meets pictures unlike those it has seen doubts, and is wrong where it does not;
what repeats in rows and columns is seen without any training, and so is what shows no building:
the rim of a rectified photograph, and a sky that is burnt out.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS
from ..imaging.features_context import Probabilities
from ..imaging.image_io import Picture
from ..imaging.rims import burnt_sky, rim

WEIGHT = 1.5  # of the second reading at most: log odds of a window, and of a wall
SKY = 5.0  # log odds that a burnt out sky gains
ELEMENT = 0.05  # odds of an element that nobody sees, beside wall, roof or sky
BLANK = ("wall", "roof", "sky")
SURE, LOST = 0.3, 0.5  # mean entropies in nats: below, it counts nothing; above, all of its weight


def exposed(belief: Probabilities, classes: tuple[str, ...], picture: Picture) -> Probabilities:
    """Return beliefs (classes, height, width) with burnt out sky as sky, and nothing in rims.

    picture: the one that was classified, (height, width, 3). Outside the photograph windows and
    all other elements are unlikely.
    """
    outside = rim(picture)
    white = burnt_sky(picture, outside)
    out = belief.copy()
    if "sky" in classes:
        out[classes.index("sky")][white] *= np.exp(np.float32(SKY))
    for plane, name in zip(out, classes, strict=True):
        plane[outside] = 1.0 if name in BLANK else ELEMENT
    changed = outside | white
    out[:, changed] /= out[:, changed].sum(axis=0)
    return out


def moved(
    belief: Probabilities, classes: tuple[str, ...], labels: NDArray[np.uint8]
) -> Probabilities:
    """Return beliefs (classes, height, width) that sum to 1, seen together with other labels.

    labels: another reading's label map, of any size. Where it has a window, windows gain and walls
    lose; elsewhere the other way round. Other classes only follow the sum.
    """
    weight = WEIGHT * _doubt(belief)
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


def _doubt(belief: Probabilities) -> float:
    """Return 0 to 1: how far the mean over pixels of −Σ p ln p is from sure to lost."""
    entropy = float(-(belief * np.log(np.maximum(belief, 1e-6))).sum(axis=0).mean())
    return min(max((entropy - SURE) / (LOST - SURE), 0.0), 1.0)
