"""After how many rows a facade repeats itself: its storeys, before anything is known of them."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..geometry.arrays import Floats
from .evidence import along_columns

SHORTEST, LONGEST = 0.05, 0.6  # shares of the height
CALM = 0.006  # of the height: over which a profile is smoothed
PEAK = 0.45  # a peak of the profile's autocorrelation counts from this share of the highest
HALF_PEAK = 0.2  # and one at half its lag from this share: two storeys were taken for one
SPREAD = (2.0, 1.5)  # pixels along and across rows: windows of two storeys are not alike to a pixel
FAINT = 0.5  # of the median row's length: rows of a plain wall agree less
CLEAR = 0.7  # a peak of the whole rows' correlation counts from this share of the highest
LEAST = 0.12  # correlation; with less, windows of the storeys do not stand over one another
ALIKE = 0.15  # logarithm of the ratio of two periods that are the same


def storey_period(rows: Floats, plane: NDArray[np.float32]) -> float:
    """Return the rows after which windows repeat.

    rows: the profile of `plane`'s rows (n,), which says it finely; but where the correlation of
    whole rows, columns and all, has another period, that one is right more often.
    """
    fine, whole = period(rows), whole_period(plane)
    if whole is None or abs(np.log(whole / fine)) < ALIKE:
        return fine
    return whole


def period(rows: Floats) -> float:
    """Return the period of a profile of rows, in rows: the first high peak of its autocorrelation.

    A fifth of the rows where there is none.

    >>> period(np.sin(np.arange(200) * 2 * np.pi / 40))
    40.0
    """
    n = len(rows)
    calm = along_columns(rows, CALM * n)
    calm = calm - calm.mean()
    lags = _lags(n)
    values = np.array([_correlation(calm[lag:], calm[:-lag]) for lag in lags])
    peaks = _peaks(values)
    if len(peaks) == 0:
        return n / 5
    best = values[peaks].max()
    first = peaks[values[peaks] > PEAK * best][0]
    half = peaks[np.abs(lags[peaks] / lags[first] - 0.5) < 0.1]
    if len(half) and values[half].max() > HALF_PEAK * best:
        first = half[int(np.argmax(values[half]))]
    return float(lags[first])


def whole_period(plane: NDArray[np.float32]) -> float | None:
    """Return the first clear lag at which whole rows of a plane correlate best.

    None where they hardly do at any.
    """
    calm = cv2.GaussianBlur(plane, (0, 0), sigmaX=SPREAD[0], sigmaY=SPREAD[1]).astype(np.float64)
    length = np.sqrt((calm**2).sum(axis=1, keepdims=True))
    scaled = calm / (length + FAINT * float(np.median(length)) + 1e-9)
    products = scaled @ scaled.T
    n = len(products)
    sums = np.concatenate([[0.0], np.cumsum(np.diag(products))])
    lags = _lags(n)
    norms = np.sqrt((sums[n] - sums[lags]) * sums[n - lags])
    values = np.array([np.trace(products, lag) for lag in lags]) / (norms + 1e-9)
    peaks = _peaks(values)
    best = values[peaks].max(initial=0.0)
    if best < LEAST:
        return None
    return float(lags[peaks[values[peaks] > CLEAR * best][0]])


def _lags(n: int) -> NDArray[np.int64]:
    return np.arange(max(2, int(SHORTEST * n)), max(3, int(LONGEST * n)))


def _peaks(values: Floats) -> NDArray[np.int64]:
    """Return where values are higher than around; nowhere if none of these is positive."""
    inner = (values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:])
    peaks: NDArray[np.int64] = np.flatnonzero(inner) + 1
    return peaks if len(peaks) and values[peaks].max() > 0 else peaks[:0]


def _correlation(one: Floats, two: Floats) -> float:
    norm = np.sqrt((one**2).sum() * (two**2).sum())
    return float((one * two).sum() / (norm + 1e-12))
