"""Where the windows are, without having learned what a window looks like.

Windows stand in rows and columns and differ from the wall beside them, so what a picture holds
beside the wall is nearly a product of a profile of rows and a profile of columns.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from ..imaging.image_io import Picture
from ..imaging.rims import rim

Plane = NDArray[np.float32]  # (height, width)

SOFT = 8.0  # CIELAB units at which a difference from the wall counts half
EDGE = 3.0  # CIELAB units a pixel at which a vertical edge counts half
EDGES = 1.2  # weight of vertical edges beside colour
BELIEF = 1.0  # weight of what another method believes of windows beside both
SPREAD = 2.5  # pixels over which an edge speaks for its surroundings
REACH = 0.07  # standard deviation of the local mean that is taken off, shares of the height
ROUNDS = 30


@dataclass(frozen=True, slots=True)
class Evidence:
    """plane: how much a pixel differs from its wall, less the mean along its row.

    seen: 0 where the picture shows nothing (the black or grey rim of a rectified picture).
    """

    plane: Plane
    seen: Plane


def window_evidence(picture: Picture, hidden: NDArray[np.bool_] | None = None) -> Evidence:
    """Return the evidence of windows in a picture at working resolution.

    The wall's colour is the median of its row. `hidden` pixels say nothing.
    """
    seen = ~rim(picture)
    if hidden is not None:
        seen &= ~hidden
    lab = cv2.cvtColor(picture.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    smooth = cv2.GaussianBlur(lab, (0, 0), 0.7).astype(np.float32)
    away = np.sqrt(((smooth - _row_medians(smooth, seen)) ** 2).sum(axis=2))
    edges = np.abs(cv2.Sobel(smooth[..., 0], cv2.CV_32F, 1, 0, ksize=3)) / 8
    known = seen.astype(np.float32)
    near = cv2.GaussianBlur(edges / (edges + EDGE) * known, (0, 0), SPREAD)
    raw = (away / (away + SOFT) + EDGES * near) * known
    return Evidence(_less_mean(raw, known), known)


def with_belief(evidence: Evidence, windows: Plane) -> Plane:
    """Return the plane of evidence, another method's belief in windows (0..1, any size) added."""
    known = evidence.seen
    told = cv2.resize(windows, known.shape[::-1], interpolation=cv2.INTER_AREA) * known
    return (evidence.plane + BELIEF * _less_mean(told, known)).astype(np.float32)


def _less_mean(raw: Plane, known: Plane) -> Plane:
    """Return a plane less the mean along its rows around a pixel; 0 where nothing is known."""
    reach = REACH * len(raw)
    mean = _along_rows(raw, reach) / np.maximum(_along_rows(known, reach), 0.05)
    return ((raw - mean) * known).astype(np.float32)


def _row_medians(lab: NDArray[np.float32], seen: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the median colour of what is seen of every row, (height, 1, 3)."""
    out = np.zeros((len(lab), 1, 3), np.float32)
    for y, (row, known) in enumerate(zip(lab, seen, strict=True)):
        if known.any():
            out[y, 0] = np.median(row[known], axis=0)
    return out


def _along_rows(plane: Plane, sigma: float) -> Plane:
    return cv2.GaussianBlur(
        plane, (0, 0), sigmaX=sigma, sigmaY=0.01, borderType=cv2.BORDER_REFLECT
    ).astype(np.float32)


def along_columns(signal: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """Return a signal smoothed by a Gaussian of `sigma` samples, its ends held."""
    if sigma <= 0 or len(signal) == 0:
        return signal
    column = np.ascontiguousarray(signal, np.float64).reshape(-1, 1)
    smooth = cv2.GaussianBlur(
        column, (0, 0), sigmaX=0.01, sigmaY=sigma, borderType=cv2.BORDER_REPLICATE
    )
    return np.asarray(smooth[:, 0], np.float64)


def agreement(
    plane: Plane, across: NDArray[np.float64], blur: float, faint: float = 1.0
) -> NDArray[np.float64]:
    """Return how much every row agrees with a profile of columns, −1..1; faint rows agree less.

    blur: standard deviation in pixels along the row, of both: a window's frame and its pane are
    one then. faint: the share of the median row's length at which a row counts half.
    """
    rows = _along_rows(plane, blur).astype(np.float64)
    length = np.sqrt((rows**2).sum(axis=1))
    pattern = along_columns(across, blur)
    return np.asarray(rows @ pattern / (length + faint * float(np.median(length)) + 1e-9))


def strength(plane: Plane, blur: float) -> NDArray[np.float64]:
    """Return how much every row holds beside its wall, whatever its columns.

    Upright things only: the plane is blurred up and down first, so that noise goes.
    """
    calm = cv2.GaussianBlur(plane, (0, 0), sigmaX=0.6 * blur, sigmaY=blur).astype(np.float64)
    return np.asarray(np.sqrt((calm**2).mean(axis=1)))


def profiles(plane: Plane) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a profile of rows and one of columns whose product explains the plane best.

    Rows, then columns, are scaled to about equal length before, so that shade counts as much as
    sun and a neighbour's edge no more than a window. The rows' profile is a correlation, −1..1;
    the columns' has length 1; both are positive at windows.
    """
    rows = _balanced(plane)
    across = _leading(rows)
    for _ in range(ROUNDS):  # a row cannot hold the opposite of windows
        down = np.maximum(rows @ across, 0.0)
        across = down @ rows
        across /= np.linalg.norm(across) + 1e-12
    return rows @ across, across


def repeated_columns(plane: Plane, storey: int) -> NDArray[np.float64]:
    """Return the profile of columns that comes again a storey above, and not half a storey above.

    storey: rows of the plane. So a drain, a pilaster or a neighbour's wall is no column of
    windows. Has length 1 (0 where the plane is blank) and is positive at windows. A plane of
    hardly more than a storey repeats nothing; its leading profile is returned.
    """
    rows = _balanced(plane)
    if not rows.any():
        return np.zeros(rows.shape[1])
    n, half = len(rows), storey // 2
    if half < 1 or n < storey + half:
        return _leading(rows)
    calm = cv2.GaussianBlur(rows, (0, 0), sigmaX=0.6, sigmaY=0.1 * storey).astype(np.float64)
    alike = rows.T @ rows / n + _apart(calm, storey) - _apart(calm, half)
    last = [len(alike) - 1] * 2
    across: NDArray[np.float64] = eigh(alike, subset_by_index=last)[1][:, 0]
    return across if (rows @ across).sum() >= 0 else -across


def _apart(rows: NDArray[np.float64], lag: int) -> NDArray[np.float64]:
    """Return the mean product of columns in rows that lie `lag` apart, symmetric."""
    products = rows[:-lag].T @ rows[lag:] / (len(rows) - lag)
    return np.asarray((products + products.T) / 2)


def _balanced(plane: Plane) -> NDArray[np.float64]:
    """Return the plane, its rows and then its columns scaled to about equal length."""
    table = plane.astype(np.float64)
    rows = table / (_lengths(table, 1, 0.5) + 1e-9)
    return np.asarray(rows / (_lengths(rows, 0, 0.3) + 1e-9))


def _lengths(table: NDArray[np.float64], axis: int, floor: float) -> NDArray[np.float64]:
    """Return the lengths of rows (axis 1) or columns (0), and `floor` of the median one more."""
    length = np.sqrt((table**2).sum(axis=axis, keepdims=True))
    return np.asarray(length + floor * float(np.median(length)))


def _leading(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the leading right singular vector, turned to agree with most rows."""
    wide = rows.shape[1] > rows.shape[0]  # the smaller of the two products is enough
    values, vectors = np.linalg.eigh(rows @ rows.T if wide else rows.T @ rows)
    leading = vectors[:, int(np.argmax(values))]
    across: NDArray[np.float64] = rows.T @ leading if wide else leading
    across = across / (np.linalg.norm(across) + 1e-12)
    return across if (rows @ across).sum() >= 0 else -across
