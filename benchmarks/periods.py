"""At which distance a rendered facade repeats: its autocorrelation, along the rows."""

from __future__ import annotations

import cv2
import numpy as np
import scipy.signal

PROMINENT = 0.1  # of the likeness of equal pictures: what a maximum has, and stands out by
BAND = 31  # pixels: light and dark parts that are wider are no rhythm
LEAST = 2  # pixels
SHARE = 1 / 3  # of the greatest likeness, for the first distance that counts


def peaks(view: np.ndarray, rays: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the distances (rays) at which a facade resembles itself, and how much (0..1).

    view (h, w, 3): what every ray of an orthographic view sees, `rays` × `rays` of them a pixel;
    white where there is nothing. The rows of a pixel are averaged, the mean of the BAND around it
    is taken from every place, and all rows together are correlated with themselves shifted, up to
    half of the width.
    """
    columns = np.flatnonzero((view < 255).any(axis=(0, 2)))
    if not len(columns) or columns[-1] - columns[0] < 16 * rays:
        return np.empty(0), np.empty(0)
    grey = view[:, columns[0] : columns[-1] + 1].mean(axis=2) / 255
    rows = cv2.resize(grey, (grey.shape[1], len(view) // rays), interpolation=cv2.INTER_AREA)
    rows = rows - cv2.blur(rows, (BAND * rays, 1), borderType=cv2.BORDER_REFLECT)
    power = likeness(rows)[: rows.shape[1] // 2 + 1]
    lags, _ = scipy.signal.find_peaks(power, height=PROMINENT, prominence=PROMINENT)
    lags = lags[lags >= LEAST * rays]
    return lags, power[lags]


def likeness(rows: np.ndarray) -> np.ndarray:
    """Return the correlation (w,) of rows (h, w) with themselves shifted by 0 … w − 1 places."""
    n = rows.shape[1]
    spectrum = np.abs(np.fft.rfft(rows, 2 * n, axis=1)) ** 2
    product = np.fft.irfft(spectrum.sum(axis=0), 2 * n)[:n]
    energy = np.concatenate([[0.0], np.cumsum((rows**2).sum(axis=0))])
    both = energy[n - np.arange(n)] * (energy[n] - energy[np.arange(n)])
    return product / np.sqrt(np.maximum(both, 1e-12))


def period(view: np.ndarray, rays: int, near: float | None = None) -> float:
    """Return the first distance (pixels) of at least a third of the greatest likeness.

    near: return the distance nearest to this one (pixels) instead. nan without any.
    """
    lags, power = peaks(view, rays)
    if not len(lags):
        return float("nan")
    known = lags[power >= SHARE * power.max()] / rays
    first = near is None or np.isnan(near)
    return float(known[0] if first else known[np.abs(known - near).argmin()])
