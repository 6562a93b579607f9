"""The storeys of a facade: its scale, the sky above it, the chain of its floors, its roof."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible
from ..geometry.arrays import Floats
from .chains import Chain, ChainProblem, solve
from .evidence import agreement, along_columns, profiles, strength
from .potentials import (
    Weights,
    band_contents,
    best_band,
    boundary_costs,
    boundary_strength,
    diagonal_sums,
    labels,
    line_differences,
)

GROUND = (24, 60)  # cells: sizes of the ground floor, 2.4 to 6 m
FLOOR = (24, 42)  # of the other floors, 2.4 to 4.2 m
ROOF = 60  # cells: the highest roof
STOREY = 3.0  # m: what a storey measures where nobody says
LEAST_BAND = 5  # cells: lower windows are none

PEAK = 0.45  # a peak of the autocorrelation counts from this share of the highest
SKY = 15.0  # CIELAB units between the sky and a building
BUSY = 2.0  # how much windows above a line speak against its being the skyline
UPPER = 0.3  # share of the building where roofs may be, and columns of their own
OWN_ABOVE, OWN = 0.6, 0.4  # weights of what a row holds beside its agreement with the columns
MEAN = 15.0  # cells: standard deviation of the local mean that is taken off
WEIGHTS = Weights(alpha=4.0, beta=0.3, boundary=0.05, content=1.0)
EMPTY = 0.75  # cost of a floor without a row of windows
LINE = 0.3 / 40  # per CIELAB unit: what a difference in colour says for a building line


@dataclass(frozen=True, slots=True)
class Band:
    """Rows of cells y0 to y1 (from the top) of a storey, and those of its windows (low, high).

    kind: ground, floor or roof. score: mean evidence of the windows' rows. Without windows low =
    high.
    """

    kind: str
    y0: int
    y1: int
    low: int
    high: int
    score: float


def period(rows: Floats) -> float:
    """Return the period of a profile of rows, in rows: the first high peak of its autocorrelation.

    A fifth of the rows where there is none.

    >>> period(np.sin(np.arange(200) * 2 * np.pi / 40))
    40.0
    """
    n = len(rows)
    calm = along_columns(rows, 0.006 * n)
    calm = calm - calm.mean()
    lags = np.arange(max(2, int(0.05 * n)), max(3, int(0.6 * n)))
    values = np.array([_correlation(calm[lag:], calm[:-lag]) for lag in lags])
    inner = (values[1:-1] >= values[:-2]) & (values[1:-1] > values[2:])
    peaks = np.flatnonzero(inner) + 1
    if len(peaks) == 0 or values[peaks].max() <= 0:
        return n / 5
    high = peaks[values[peaks] > PEAK * values[peaks].max()]
    return float(lags[high[0]])


def _correlation(one: Floats, two: Floats) -> float:
    norm = np.sqrt((one**2).sum() * (two**2).sum())
    return float((one * two).sum() / (norm + 1e-12))


def skyline(differences: Floats, rows: Floats) -> int:
    """Return the row at which the sky ends; 0 where none is seen.

    differences: of colour across every row's upper border. rows: profile of windows, of which
    hardly any stand above the skyline.
    """
    busy = np.maximum(rows - 0.15, 0.0)
    share = np.concatenate([[0.0], np.cumsum(busy)]) / (busy.sum() + 1e-9)
    score = differences * np.maximum(0.0, 1.0 - BUSY * share)
    score[int(0.45 * len(score)) :] = 0.0
    row = int(np.argmax(score))
    return row if score[row] >= SKY else 0


@dataclass(frozen=True, slots=True)
class Facade:
    """A picture in cells: colours 0..1 (n, m, 3), evidence (n, m), and what was found of it.

    differences: of colour across the rows (n+1,). sky: rows of sky.
    """

    picture: Floats
    plane: NDArray[np.float32]
    differences: Floats
    sky: int


@dataclass(frozen=True, slots=True)
class Rows:
    """Profiles of rows below the sky, from the top, 1 where windows are usual.

    columns: agreement with the columns. evidence: what the chain sees; 0 on average.
    """

    columns: Floats
    evidence: Floats


def row_profiles(facade: Facade) -> Rows:
    """Return the profiles of rows. Roofs need not agree with the columns below them."""
    body = facade.plane[facade.sky :]
    columns = agreement(body, profiles(body)[1], 4.0)
    columns = np.maximum(columns / (np.percentile(columns, 90) + 1e-9), -0.3)
    any_ = strength(body, 4.0)
    any_ = any_ / (np.percentile(any_, 80) + 1e-9)
    own = np.where(np.arange(len(body)) < UPPER * len(body), OWN_ABOVE, OWN)
    mixed = (1 - own) * columns + own * any_
    mean = along_columns(mixed, MEAN)
    return Rows(columns, mixed - mean)


def storeys(facade: Facade) -> tuple[list[Band], float]:
    """Return the storeys from the ground to the roof, and the energy of their chain.

    Floors are the exact minimum of eq. 3 together with the building line, which is where the last
    floor ends: the roof above it costs what its colour and its row of windows say. Raises
    Infeasible where the facade is lower than a ground floor.
    """
    rows = row_profiles(facade)
    up = facade.picture[facade.sky :][::-1]
    evidence = np.ascontiguousarray(rows.evidence[::-1])
    n = len(up)
    contents = band_contents(evidence, ROOF)
    unary = (
        labels(n, GROUND, FLOOR)
        + WEIGHTS.boundary * boundary_costs(boundary_strength(up), ROOF)
        - WEIGHTS.content * contents
        + np.where(contents < EMPTY, EMPTY, 0.0)
    )
    sums = diagonal_sums(line_differences(up))
    ends = _roof_costs(evidence, facade.differences[facade.sky :][::-1])
    problem = ChainProblem(sums, unary, np.zeros((n + 1, 1)), WEIGHTS, ends, grounded=True)
    chain = solve(problem)
    return _bands(chain, evidence, rows.columns[::-1], len(facade.plane)), chain.energy


def _roof_costs(evidence: Floats, differences: Floats) -> Floats:
    """Return what the roof costs for every building line (n+1,), lines from the ground."""
    n = len(evidence)
    costs = np.full(n + 1, np.inf)
    for line in range(max(1, n - ROOF), n + 1):
        low, high = _roof_band(evidence[line:])
        inside = evidence[line:]
        left = np.maximum(inside, 0).sum() - np.maximum(inside[low:high], 0).sum()
        gain = inside[low:high].sum() - left
        colour = LINE * differences[line] if n - line >= 8 else 0.0
        costs[line] = -WEIGHTS.content * gain - colour
    return costs


def _roof_band(evidence: Floats) -> tuple[int, int]:
    low, high = best_band(np.ascontiguousarray(evidence))
    return (low, high) if high - low >= LEAST_BAND else (0, 0)


def _bands(chain: Chain, evidence: Floats, columns: Floats, height: int) -> list[Band]:
    """Return floors and roof from the ground, in rows from the top."""
    edges = [(start, start + size) for start, size in zip(chain.starts, chain.sizes, strict=True)]
    kinds = ["ground"] + ["floor"] * (len(edges) - 1)
    line = edges[-1][1]
    if line < len(evidence):
        edges.append((line, len(evidence)))
        kinds.append("roof")
    out = []
    for kind, (start, stop) in zip(kinds, edges, strict=True):
        find = _roof_band if kind == "roof" else best_band
        low, high = find(np.ascontiguousarray(evidence[start:stop]))
        profile = columns if kind == "ground" else evidence + columns
        score = float(profile[start + low : start + high].mean()) if high > low else 0.0
        place = (height - stop, height - start, height - start - high, height - start - low)
        out.append(Band(kind, *place, score))
    return _kept(out)


GROUND_SCORE, FLOOR_SCORE = 0.8, 0.15  # of the median floor's: what a row of windows must reach
GROUND_HEIGHT, FLOOR_HEIGHT = 0.5, 0.25


def _kept(bands: list[Band]) -> list[Band]:
    """Return bands, windows taken from those where they are faint or low beside the others'."""
    floors = [band for band in bands if band.kind == "floor" and band.high > band.low]
    if not floors:
        return bands
    score = float(np.median([band.score for band in floors]))
    height = float(np.median([band.high - band.low for band in floors]))
    out = []
    for band in bands:
        ground = band.kind == "ground"
        enough = band.score >= (GROUND_SCORE if ground else FLOOR_SCORE) * score
        high = band.high - band.low >= (GROUND_HEIGHT if ground else FLOOR_HEIGHT) * height
        out.append(band if enough and high else replace(band, low=band.y1, high=band.y1))
    return out


def lowest_height() -> int:
    """Return the cells that a facade has at least."""
    return GROUND[0]


def refuse_small(cells: tuple[int, int]) -> None:
    """Raise Infeasible where a picture is too small to hold a floor and a window."""
    if cells[0] < GROUND[0] or cells[1] < 8:
        raise Infeasible("the picture is too small to hold a floor of windows")
