"""The storeys of a facade: the sky above it, the chain of its floors, its roof."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..errors import Infeasible
from ..geometry.arrays import Floats, Integers
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
ROOF = 30  # cells: the highest roof, a storey; more is a floor and a roof
STOREY = 3.0  # m: what a storey measures where nobody says
LEAST_BAND = 3  # cells: lower windows are none
HALF = 8  # cells: the least part of a roof
SECOND = 2.0  # cost of a second row of windows in a roof

SKY = 8.0  # CIELAB units between the sky and a building
BUSY = 4.0  # how much windows above a line speak against its being the skyline
UPPER = 0.4  # share of the building where roofs may be, and columns of their own
OWN_ABOVE, OWN = 0.5, 0.2  # weights of what a row holds beside its agreement with the columns
SKYWARD = 0.0
MEAN = 12.0  # cells: standard deviation of the local mean that is taken off
WEIGHTS = Weights(alpha=6.0, beta=0.1, boundary=0.3, content=1.0)
EMPTY = 0.75  # cost of a floor without a row of windows
LINE = 0.1  # per CIELAB unit: what a difference in colour says for a building line


@dataclass(frozen=True, slots=True)
class Band:
    """Rows of cells y0 to y1 (from the top) of a storey, and those of its windows (low, high).

    kind: ground, floor or roof. columns, evidence: means of the profiles over the windows' rows.
    Without windows low = high.
    """

    kind: str
    y0: int
    y1: int
    low: int
    high: int
    columns: float
    evidence: float


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

    shown: the evidence of the picture alone, by which roofs are read; `plane` may hold what
    another method believes too. differences: of colour across the rows (n+1,). sky: rows of sky.
    storey: rows after which windows repeat.
    """

    picture: Floats
    plane: NDArray[np.float32]
    shown: NDArray[np.float32]
    differences: Floats
    sky: int
    storey: int


@dataclass(frozen=True, slots=True)
class Rows:
    """Profiles of rows below the sky, from the top, 1 where windows are usual.

    columns: agreement with the columns. evidence: what the chain sees; 0 on average.
    """

    columns: Floats
    evidence: Floats


def row_profiles(body: NDArray[np.float32]) -> Rows:
    """Return the profiles of rows of evidence. Roofs need not agree with the columns below."""
    columns = agreement(body, profiles(body)[1], 4.0)
    columns = np.maximum(columns / (np.percentile(columns, 90) + 1e-9), -0.3)
    any_ = strength(body, 4.0)
    any_ = any_ / (np.percentile(any_, 80) + 1e-9)
    above = np.arange(len(body)) < UPPER * len(body)
    own = np.where(above, OWN_ABOVE, OWN)
    mixed = (1 - own) * columns + own * any_
    sky = np.full(round(3 * MEAN), SKYWARD)  # what lies above the roof holds no window
    mean = along_columns(np.concatenate([sky, mixed]), MEAN)[len(sky) :]
    return Rows(columns, mixed - mean)


def storeys(facade: Facade) -> tuple[list[Band], float]:
    """Return the storeys from the ground to the roof, and the energy of their chain.

    Floors are the exact minimum of eq. 3 together with the building line, which is where the last
    floor ends: the roof above it costs what its colour and its row of windows say. Raises
    Infeasible where the facade is lower than a ground floor.
    """
    rows = row_profiles(facade.plane[facade.sky :])
    up = facade.picture[facade.sky :][::-1]
    evidence = np.ascontiguousarray(rows.evidence[::-1])
    n = len(up)
    contents = band_contents(evidence, GROUND[1])
    unary = (
        labels(n, GROUND, FLOOR)
        + WEIGHTS.boundary * boundary_costs(boundary_strength(up), GROUND[1])
        - WEIGHTS.content * contents
        + np.where(contents < EMPTY, EMPTY, 0.0)
    )
    sums = diagonal_sums(line_differences(up))
    roofs = _roofs(contents)
    ends = _roof_costs(roofs, facade.differences[facade.sky :][::-1])
    problem = ChainProblem(sums, unary, np.zeros((n + 1, 1)), WEIGHTS, ends, grounded=True)
    chain = solve(problem)
    edges = _edges(chain, roofs)
    bands = _bands(edges, rows, len(facade.plane))
    if facade.shown is not facade.plane:
        alone = _bands(edges, row_profiles(facade.shown[facade.sky :]), len(facade.plane))
        bands = [a if a.kind == "roof" else b for a, b in zip(alone, bands, strict=True)]
    return bands, chain.energy


@dataclass(frozen=True, slots=True)
class _Roofs:
    """For every building line (n+1,): what the best roof above it explains, and where it is cut.

    A roof has one row of windows, or two: a set-back floor under an attic.
    """

    gain: Floats
    cut: Integers


def _roofs(contents: Floats) -> _Roofs:
    n = len(contents) - 1
    gain, cut = np.full(n + 1, -np.inf), np.full(n + 1, n)
    for line in range(max(1, n - ROOF), n + 1):
        gain[line] = contents[line, n - line]
        for at in range(line + HALF, n - HALF + 1):
            both = contents[line, at - line] + contents[at, n - at] - SECOND
            if both > gain[line]:
                gain[line], cut[line] = both, at
    return _Roofs(gain, cut)


def _roof_costs(roofs: _Roofs, differences: Floats) -> Floats:
    """Return what the roof costs for every building line (n+1,), lines from the ground."""
    n = len(roofs.gain) - 1
    high = n - np.arange(n + 1) >= HALF
    costs: Floats = -WEIGHTS.content * roofs.gain - np.where(high, LINE * differences, 0.0)
    return costs


def _edges(chain: Chain, roofs: _Roofs) -> list[tuple[str, int, int]]:
    """Return kind, first and last line of the storeys from the ground."""
    out = [
        ("floor" if start else "ground", start, start + size)
        for start, size in zip(chain.starts, chain.sizes, strict=True)
    ]
    line, n = out[-1][2], len(roofs.gain) - 1
    cuts = [line, int(roofs.cut[line]), n] if roofs.cut[line] < n else [line, n]
    return out + [("roof", low, high) for low, high in pairwise(cuts) if high > low]


def _bands(edges: list[tuple[str, int, int]], profiles_: Rows, height: int) -> list[Band]:
    """Return floors and roof from the ground, in rows from the top."""
    columns, evidence = profiles_.columns[::-1], profiles_.evidence[::-1]
    out = []
    for kind, start, stop in edges:
        low, high = best_band(np.ascontiguousarray(evidence[start:stop]))
        if high - low < LEAST_BAND:
            low = high = 0
        rows = slice(start + low, start + high)
        scores = [float(p[rows].mean()) if high > low else 0.0 for p in (columns, evidence)]
        place = (height - stop, height - start, height - start - high, height - start - low)
        out.append(Band(kind, *place, *scores))
    return _kept(out)


# What a row of windows must reach: shares of the median floor's agreement with the columns (of a
# roof: of its evidence) and of its height.
LEAST_SCORE = {"ground": 0.7, "floor": 0.15, "roof": 0.3}
LEAST_HEIGHT = {"ground": 0.5, "floor": 0.25, "roof": 0.2}
# A roof lower than this share of a storey is a cornice or a balustrade, unless what it shows
# stands in the columns below as much as this share of the median floor's windows.
LOW_ROOF, IN_COLUMNS = 0.45, 0.6


def _kept(bands: list[Band]) -> list[Band]:
    """Return bands, windows taken from those where they are faint or low beside the others'."""
    floors = [band for band in bands if band.kind == "floor" and band.high > band.low]
    if not floors:
        return bands
    usual = {kind: float(np.median([_score(b, kind) for b in floors])) for kind in LEAST_SCORE}
    height = float(np.median([band.high - band.low for band in floors]))
    low_roof = LOW_ROOF * float(np.median([band.y1 - band.y0 for band in floors]))
    out = []
    for band in bands:
        kind = band.kind
        enough = _score(band, kind) >= LEAST_SCORE[kind] * usual[kind]
        high = band.high - band.low >= LEAST_HEIGHT[kind] * height
        cornice = kind == "roof" and band.y1 - band.y0 < low_roof
        if cornice and band.columns < IN_COLUMNS * usual["floor"]:
            enough = False
        out.append(band if enough and high else replace(band, low=band.y1, high=band.y1))
    return out


def _score(band: Band, kind: str) -> float:
    return band.evidence if kind == "roof" else band.columns


def refuse_small(cells: tuple[int, int]) -> None:
    """Raise Infeasible where a picture is too small to hold a floor and a window."""
    if cells[0] < GROUND[0] or cells[1] < 8:
        raise Infeasible("the picture is too small to hold a floor of windows")
