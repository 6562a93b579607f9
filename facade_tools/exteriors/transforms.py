"""Between a coordinate's own unit and the unbounded scale on which it is modelled."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

EDGE = 1e-7  # closest approach to the end of an open interval
LARGEST = 1e6
# Without it a value just above 1 has an endless slope, and the least standard deviation in its own
# unit becomes one of many powers of e on the logarithmic scale.
STEP = 0.05


class Transform(NamedTuple):
    """forward and inverse map; log |dt/dx|; the interval on which they are defined."""

    forward: Callable[[Floats], Floats]
    inverse: Callable[[Floats], Floats]
    log_slope: Callable[[Floats], Floats]
    lowest: float
    highest: float


def _logistic(t: Floats) -> Floats:
    return np.asarray(1.0 / (1.0 + np.exp(-np.clip(t, -40.0, 40.0))))


def _exp(t: Floats) -> Floats:
    return np.exp(np.clip(t, -40.0, 14.0))


TRANSFORMS: dict[str, Transform] = {
    "identity": Transform(
        lambda x: x.copy(), lambda t: t.copy(), lambda x: np.zeros_like(x), -LARGEST, LARGEST
    ),
    "log": Transform(np.log, _exp, lambda x: -np.log(x), EDGE, LARGEST),
    "logit": Transform(
        lambda x: np.log(x / (1.0 - x)),
        _logistic,
        lambda x: -np.log(x * (1.0 - x)),
        EDGE,
        1.0 - EDGE,
    ),
    "log-above-1": Transform(
        lambda x: np.log(x - 1.0 + STEP),
        lambda t: 1.0 - STEP + _exp(t),
        lambda x: -np.log(x - 1.0 + STEP),
        1.0 + EDGE,
        LARGEST,
    ),
}


def forward(name: str, x: Floats) -> tuple[Floats, Floats]:
    """Return (t, log |dt/dx|) of coordinates in their own unit; what lies outside is clipped.

    >>> t, slope = forward("log", np.array([1.0, 2.0]))
    >>> t.round(3).tolist(), slope.round(3).tolist()
    ([0.0, 0.693], [-0.0, -0.693])
    """
    transform = TRANSFORMS[name]
    inside = np.clip(x, transform.lowest, transform.highest)
    return transform.forward(inside), transform.log_slope(inside)


def inverse(name: str, t: Floats) -> Floats:
    """Return coordinates in their own unit from the unbounded scale."""
    transform = TRANSFORMS[name]
    return np.clip(transform.inverse(t), transform.lowest, transform.highest)
