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
    """forward and inverse map; log |dt/dx| as a function of t; the interval of x."""

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
        lambda x: np.array(x), lambda t: t.copy(), lambda t: np.zeros_like(t), -LARGEST, LARGEST
    ),
    "log": Transform(np.log, _exp, np.negative, EDGE, LARGEST),
    "logit": Transform(
        lambda x: np.log(x / (1.0 - x)),
        _logistic,
        lambda t: np.abs(t) + 2.0 * np.log1p(np.exp(-np.abs(t))),
        EDGE,
        1.0 - EDGE,
    ),
    "log-above-1": Transform(
        lambda x: np.log(x - 1.0 + STEP),
        lambda t: 1.0 - STEP + _exp(t),
        np.negative,
        1.0 + EDGE,
        LARGEST,
    ),
}

ENDS = {
    name: (
        transform.forward(np.array(transform.lowest)),
        transform.forward(np.array(transform.highest)),
    )
    for name, transform in TRANSFORMS.items()
}


def forward(name: str, x: Floats) -> tuple[Floats, Floats]:
    """Return (t, log |dt/dx|) of coordinates in their own unit; what lies outside is clipped.

    >>> t, slope = forward("log", np.array([1.0, 2.0]))
    >>> t.round(3).tolist(), slope.round(3).tolist()
    ([0.0, 0.693], [-0.0, -0.693])
    """
    transform = TRANSFORMS[name]
    inside = np.clip(x, transform.lowest, transform.highest)
    t = transform.forward(inside)
    return t, transform.log_slope(t)


def slope_at(name: str, t: Floats) -> Floats:
    """Return log |dt/dx| at points of the unbounded scale; at the nearest end where outside."""
    lowest, highest = ENDS[name]
    return TRANSFORMS[name].log_slope(np.minimum(np.maximum(t, lowest), highest))


def inverse(name: str, t: Floats) -> Floats:
    """Return coordinates in their own unit from the unbounded scale."""
    transform = TRANSFORMS[name]
    return np.clip(transform.inverse(t), transform.lowest, transform.highest)
