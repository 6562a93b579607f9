"""Beliefs of windows and walls moved towards another reading, as far as the classifier doubts.

A classifier that meets pictures unlike those it has seen doubts, and is wrong where it does not;
what repeats in rows and columns is seen without any training, and so is what shows no building:
the rim of a rectified photograph, and a sky that is burnt out. The other reading is told the
beliefs first, so that it finds the grid of what both see.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS
from ..imaging.features_context import Probabilities
from ..imaging.image_io import Picture
from ..imaging.rims import burnt_sky, rim
from .railings import WINDOW

Plane = NDArray[np.float32]  # (height, width)

# What the second reading moves at most, in nats of log belief: where it has a window, windows gain
# and walls lose; elsewhere windows lose and walls gain. (What windows gain, what they lose, walls.)
FIRM, MILD = (2.5, 5.0, 1.0), (1.5, 1.5, 1.5)
SKY = 5.0  # log odds that a burnt out sky gains
ELEMENT = 0.05  # odds of an element that nobody sees, beside wall, roof or sky
BLANK = ("wall", "roof", "sky")
SURE, LOST = 0.38, 0.48  # mean entropies in nats: below, it counts nothing; above, fully
ALIKE = 0.3  # correlation of both readings' windows: with less, the grid may be missed: mild


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
    belief: Probabilities, classes: tuple[str, ...], labels: NDArray[np.uint8], weight: float
) -> Probabilities:
    """Return beliefs (classes, height, width) that sum to 1, seen together with other labels.

    labels: another reading's label map, of any size. Where it has a window, windows gain and walls
    lose; elsewhere the other way round. Other classes only follow the sum. weight: 0 to 1. A
    reading whose windows are elsewhere than those believed in moves them less.
    """
    share = _window_share(labels, belief.shape[1:])
    gain, loss, walls = FIRM if agreement(belief, classes, labels) >= ALIKE else MILD
    gains = {WINDOW: (gain + loss) * share - loss, "wall": walls * (1 - 2 * share)}
    out = belief.copy()
    for name, more in gains.items():
        if name in classes:
            out[classes.index(name)] *= np.exp(np.float32(weight) * more)
    out /= out.sum(axis=0)
    return out


def agreement(belief: Probabilities, classes: tuple[str, ...], labels: NDArray[np.uint8]) -> float:
    """Return how windows believed in and another reading's correlate, -1..1, 0 without any.

    labels: the other reading's label map, of any size.
    """
    if WINDOW not in classes:
        return 0.0
    return _correlation(belief[classes.index(WINDOW)], _window_share(labels, belief.shape[1:]))


def _window_share(labels: NDArray[np.uint8], shape: tuple[int, ...]) -> Plane:
    """Return how much of every pixel of (height, width) is window in a label map of any size."""
    windows = (labels == LABELS.index(WINDOW)).astype(np.float32)
    share: Plane = cv2.resize(windows, shape[::-1], interpolation=cv2.INTER_AREA).astype(np.float32)
    return share


def doubt(belief: Probabilities) -> float:
    """Return the weight of a second reading, 0 to 1: how much the classifier doubts.

    The mean over pixels of −Σ p ln p stands between sure and lost.
    """
    entropy = float(-(belief * np.log(np.maximum(belief, 1e-6))).sum(axis=0).mean())
    return min(max((entropy - SURE) / (LOST - SURE), 0.0), 1.0)


def _correlation(one: Plane, two: Plane) -> float:
    """Return the correlation of two planes, 0 where one of them is flat."""
    a, b = one - one.mean(), two - two.mean()
    return float((a * b).sum() / (np.sqrt(float((a**2).sum()) * float((b**2).sum())) + 1e-9))
