"""Which cells of a plan lie inside a model that may be open, doubled or of several bodies."""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..geometry.arrays import Booleans, Floats, Integers, Points3, Triangles

WELD = 1e-5  # of the size: vertices nearer than that are one
LIKELY = 3  # of four rays


def bodies(vertices: Points3, faces: Triangles) -> Integers:
    """Return for every triangle the number of its body: what hangs together by edges.

    Vertices at one place count as one, so that unwelded polygons still form a body.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    size = float(np.ptp(vertices, axis=0).max()) or 1.0
    keys = np.round(vertices / (WELD * size)).astype(np.int64)
    _, welded = np.unique(keys, axis=0, return_inverse=True)
    corners = welded.ravel()[faces]
    edges = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge = np.unique(edges[:, 0] * len(vertices) + edges[:, 1], return_inverse=True)
    owner = np.repeat(np.arange(len(faces)), 3)
    # triangles and edges as the two sides of a bipartite graph
    count = len(faces) + int(edge.max(initial=-1)) + 1
    ones = np.ones(len(owner), dtype=np.int8)
    graph = coo_array((ones, (owner, len(faces) + edge.ravel())), shape=(count, count))
    _, labels = connected_components(graph, directed=False)
    return np.asarray(labels[: len(faces)], dtype=np.int64)


def inside_cells(segments: Floats, owners: Integers, xs: Floats, ys: Floats) -> Booleans:
    """Return whether the points of a grid lie inside a section, and where that is undecided.

    segments (n, 2, 2), owners (n,): the body of each. Returns two masks (len(ys), len(xs)).

    Each point asks four axis-parallel rays for the parity of their crossings; three of four that
    agree decide, two leave it open. Walls may be there twice (two-sided models) or touch
    (adjoining boxes): coincident crossings are counted once or each, whichever makes the rays
    agree at more points, and the larger plan where both do. What three rays find inside a single
    body is inside: bodies that overlap add up instead of cancelling out.
    """
    size = float(np.ptp(segments)) if len(segments) else 0.0
    options = []
    for gap in (0.0, 1e-4 * size):
        votes = _votes(segments, xs, ys, gap)
        agreed = int(((votes == 0) | (votes == 4)).sum())
        options.append((agreed, int((votes >= LIKELY).sum()), votes))
    votes = max(options, key=lambda option: option[:2])[2]
    order = np.argsort(owners, kind="stable")
    starts = np.flatnonzero(np.diff(owners[order], prepend=-1))
    borders = np.append(starts, len(owners)).astype(np.int64)
    found = (votes >= LIKELY).copy()
    if len(starts) > 1:
        _inside_bodies(segments[order], borders, xs, ys, 1e-4 * size, found)
    return np.stack([found, (votes == 2) & ~found])


@compiled
def _votes(segments: Floats, xs: Floats, ys: Floats, gap: float) -> Integers:
    """Count the odd crossings in the four directions from every grid point, (len(ys), len(xs)).

    Crossings nearer than `gap` to the one before are one crossing.
    """
    votes = np.zeros((len(ys), len(xs)), dtype=np.int64)
    _add_parities(segments, 0, xs, ys, gap, votes)
    _add_parities(segments, 1, ys, xs, gap, votes.T)
    return votes


@compiled
def _add_parities(
    segments: Floats, axis: int, along: Floats, across: Floats, gap: float, votes: Integers
) -> None:
    """Add the parities of crossings on either side along an axis; votes (across, along)."""
    crossings = np.empty(len(segments))
    for row in range(len(across)):
        place = across[row]
        count = 0
        for k in range(len(segments)):
            a0, a1 = segments[k, 0, 1 - axis], segments[k, 1, 1 - axis]
            if (a0 > place) != (a1 > place):
                share = (place - a0) / (a1 - a0)
                start = segments[k, 0, axis]
                crossings[count] = start + share * (segments[k, 1, axis] - start)
                count += 1
        found = np.sort(crossings[:count])
        kept = 0
        for k in range(count):
            if kept == 0 or found[k] - found[kept - 1] >= gap:
                found[kept] = found[k]
                kept += 1
        for column in range(len(along)):
            left = np.searchsorted(found[:kept], along[column])
            votes[row, column] += left % 2 + (kept - left) % 2


@compiled
def _inside_bodies(
    segments: Floats, borders: Integers, xs: Floats, ys: Floats, gap: float, found: Booleans
) -> None:
    """Mark what three rays find inside one of the bodies; segments are in the order of bodies."""
    for body in range(len(borders) - 1):
        own = segments[borders[body] : borders[body + 1]]
        if len(own) < 3:
            continue
        left = np.searchsorted(xs, own[:, :, 0].min())
        right = np.searchsorted(xs, own[:, :, 0].max())
        low = np.searchsorted(ys, own[:, :, 1].min())
        high = np.searchsorted(ys, own[:, :, 1].max())
        if left == right or low == high:
            continue
        votes = _votes(own, xs[left:right], ys[low:high], gap)
        for row in range(high - low):
            for column in range(right - left):
                if votes[row, column] >= LIKELY:
                    found[low + row, left + column] = True


def covered_points(points: Floats, triangles: Floats, height: float) -> Booleans:
    """Return whether some surface that is not upright lies above the points (n, 2)."""
    above = triangles[triangles[:, :, 2].min(axis=1) > height]
    return _under_triangles(points, above)


@compiled
def _under_triangles(points: Floats, triangles: Floats) -> Booleans:
    found = np.zeros(len(points), dtype=np.bool_)
    for p in range(len(points)):
        x, y = points[p, 0], points[p, 1]
        for t in range(len(triangles)):
            inside = False
            for k in range(3):
                x0, y0 = triangles[t, k, 0], triangles[t, k, 1]
                x1, y1 = triangles[t, (k + 1) % 3, 0], triangles[t, (k + 1) % 3, 1]
                if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
                    inside = not inside
            if inside:
                found[p] = True
                break
    return found
