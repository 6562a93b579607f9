"""The standard view of a model: up, along the axes, front towards −y (LNSW13 4.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InvalidInput
from ..formats.textured import TexturedMesh
from ..geometry.arrays import Floats, Points3, Triangles

UPRIGHT = 0.2  # |n_z| of what counts as wall
LEVEL = 0.95  # |n_z| of what counts as flat roof or soffit
ALONG = 0.3  # of the textured area: pictures that stand along y
ALIGNED = math.cos(math.radians(10))
REFUSED = 0.6  # share of area that no Manhattan model can stand for
WORTH_SAYING = 0.05
SAMPLES, CELLS = 20_000, 40  # points and cells by which hidden walls are told
NEAR = 0.15  # of the depth: relief that hides nothing


@dataclass(frozen=True, slots=True)
class Standard:
    """A mesh in its standard view.

    frame: 4×4, from the standard view to the source's coordinates (z up, metres). front: azimuth
    of the front's outward normal in the source, degrees clockwise from +y. oblique, sloped: share
    of the surface that stands off the axes, or neither upright nor level.
    """

    mesh: TexturedMesh
    frame: Floats
    front: float
    oblique: float
    sloped: float


def triangle_areas(vertices: Points3, faces: Triangles) -> Points3:
    """Return area vectors (m, 3): normal times area (m²) of every triangle."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.cross(b - a, c - a))


def standard_view(mesh: TexturedMesh, front: float | None = None, up: str = "auto") -> Standard:
    """Turn a model into the standard view.

    front: azimuth (degrees clockwise from +y) of the front's outward normal; None finds the side
    with the most textured area. up: "y", "z", or "auto" by the way that textures run. Raises
    InvalidInput where more than 60% of the surface fits no Manhattan building.
    """
    mesh = _upright(mesh, up)
    vectors = triangle_areas(mesh.vertices, mesh.faces)
    area = np.linalg.norm(vectors, axis=1)
    if area.sum() <= 0:
        raise InvalidInput("has no surface; expected a building")
    normals = vectors / np.maximum(area, 1e-30)[:, None]
    wall = np.abs(normals[:, 2]) < UPRIGHT
    if not area[wall].sum():
        raise InvalidInput("has no upright walls; expected a building")
    turn = _main_angle(vectors[wall])
    turn += _quarter(mesh, vectors, turn, front)
    view = _rotation(-turn)
    turned = mesh.vertices @ view.T
    shift = _whole_metres(turned)
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = view.T, view.T @ shift
    placed = replace(mesh, vertices=turned - shift)
    azimuth = round(180 - math.degrees(turn), 9) % 360
    oblique, sloped = _shares(normals @ view.T, area)
    _refuse(oblique + sloped)
    return Standard(placed, frame, azimuth, oblique, sloped)


def _upright(mesh: TexturedMesh, up: str) -> TexturedMesh:
    if up != "y" and not (up == "auto" and _stands_along_y(mesh)):
        return mesh
    x, y, z = mesh.vertices.T
    notes = (*mesh.notes, "the file is y up: turned")
    return replace(mesh, vertices=np.column_stack([x, -z, y]), notes=notes)


def _stands_along_y(mesh: TexturedMesh) -> bool:
    """Tell whether y is up: textures run along it, and the walls are no less upright than for z."""
    if not _texture_runs_along_y(mesh):
        return False
    vectors = np.abs(triangle_areas(mesh.vertices, mesh.faces))
    area = np.linalg.norm(vectors, axis=1)
    share = vectors / np.maximum(area, 1e-30)[:, None]
    square = (share < UPRIGHT) | (share > LEVEL)
    along_y, along_z = (float(area @ square[:, axis]) for axis in (1, 2))
    return along_y >= 0.98 * along_z


def _texture_runs_along_y(mesh: TexturedMesh) -> bool:
    """Tell whether pictures stand upright along y rather than z: walls are drawn upright."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    v = mesh.uv[:, :, 1]
    e1, e2 = b - a, c - a
    normal = np.cross(e1, e2)
    size = np.einsum("ij,ij->i", normal, normal)
    d1, d2 = v[:, 1] - v[:, 0], v[:, 2] - v[:, 0]
    gradient = (
        np.cross(normal, e1) * d2[:, None] - np.cross(normal, e2) * d1[:, None]
    ) / np.maximum(size, 1e-30)[:, None]
    length = np.linalg.norm(gradient, axis=1)
    known = np.isfinite(length) & (length > 1e-12) & (size > 1e-20)
    unit = gradient[known] / length[known, None]
    area = 0.5 * np.sqrt(size[known])
    score = area @ unit
    # pictures may stand on their head, so either way along z speaks against y
    return bool(known.any() and score[1] > max(2 * abs(float(score[2])), ALONG * area.sum()))


def _main_angle(walls: Points3) -> float:
    """Return the angle (radians, below 90°) of the axes that most wall area agrees with."""
    area: Floats = np.hypot(walls[:, 0], walls[:, 1]).astype(np.float64)
    angle: Floats = np.arctan2(walls[:, 1], walls[:, 0]).astype(np.float64)
    candidates: Floats = np.unique(np.round(np.mod(angle, math.pi / 2), 3)).astype(np.float64)
    if len(candidates) > 512:
        candidates = np.linspace(0, math.pi / 2, 512, endpoint=False)
    fit = [float(area @ np.maximum(np.cos(4 * (angle - c)), 0.0) ** 8) for c in candidates]
    best = float(candidates[int(np.argmax(fit))])
    near = np.abs(np.sin(2 * (angle - best))) < math.sin(math.radians(4))
    phase = np.sum(area[near] * np.exp(4j * (angle[near] - best)))
    refined = best + float(np.angle(phase)) / 4
    return 0.0 if abs(math.remainder(refined, math.pi / 2)) < 1e-9 else refined


def _quarter(mesh: TexturedMesh, vectors: Points3, turn: float, front: float | None) -> float:
    """Return the quarter turn (radians) that brings the front towards −y."""
    turns = [0.0, math.pi / 2, math.pi, -math.pi / 2]
    if front is not None:
        wanted = math.radians(-(front - 180))
        return min(turns, key=lambda q: abs(math.remainder(turn + q - wanted, 2 * math.pi)))
    weights = _texture_weights(mesh)
    scores = []
    for quarter in turns:
        view = _rotation(-(turn + quarter))
        along = -(vectors @ view.T)[:, 1]
        facing = along > ALIGNED * np.linalg.norm(vectors, axis=1)
        corners = (mesh.vertices @ view.T)[mesh.faces[facing]]
        scores.append(_seen(corners, along[facing], weights[facing]))
    best = max(scores)
    return next(q for q, score in zip(turns, scores, strict=True) if score >= 0.97 * best)


def _seen(corners: Floats, areas: Floats, weights: Floats) -> float:
    """Return the weighted area of the triangles (m, 3, 3) that is seen from −y.

    Points spread over the triangles are seen where none lies before them: walls that a wing hides
    (the sides of a court) do not speak for their direction.
    """
    if not len(corners):
        return 0.0
    counts = np.ceil(SAMPLES * areas / areas.sum()).astype(np.int64)
    owner = np.repeat(np.arange(len(corners)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5
    u, v = np.modf(number * 0.7548776662466927)[0], np.modf(number * 0.5698402909980532)[0]
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = (corners[owner, k] for k in range(3))
    points = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    low, size = points.min(axis=0), np.maximum(np.ptp(points, axis=0), 1e-9)
    cells = np.minimum((CELLS * (points - low) / size).astype(np.int64), CELLS - 1)
    cell = cells[:, 0] * CELLS + cells[:, 2]
    nearest = np.full(CELLS * CELLS, math.inf)
    np.minimum.at(nearest, cell, points[:, 1])
    seen = points[:, 1] < nearest[cell] + NEAR * size[1] + 0.1
    return float(((areas * weights / counts)[owner])[seen].sum())


def _texture_weights(mesh: TexturedMesh) -> Floats:
    """Return per triangle how much its picture says: 1 without one, more with contrast."""
    contrast = [0.0 if p.picture is None else float(p.picture.std()) for p in mesh.paints]
    return 1.0 + np.array(contrast)[mesh.paint] / 16.0


def _rotation(angle: float) -> Floats:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _whole_metres(vertices: Points3) -> Floats:
    """Return a shift in whole metres that brings huge coordinates near the origin."""
    low = vertices.min(axis=0)
    return np.where(np.abs(low) > 1000, np.floor(low), 0.0)


def _shares(normals: Points3, area: Floats) -> tuple[float, float]:
    upright = np.abs(normals[:, 2]) < UPRIGHT
    level = np.abs(normals[:, 2]) > LEVEL
    straight = np.abs(normals[:, :2]).max(axis=1) > ALIGNED
    total = area.sum()
    return float(area[upright & ~straight].sum() / total), float(
        area[~upright & ~level].sum() / total
    )


def _refuse(lost: float) -> None:
    if lost > REFUSED:
        raise InvalidInput(
            f"{lost:.0%} of its surface is neither level nor upright along two directions; "
            f"expected a Manhattan-world building (at most {REFUSED:.0%})"
        )
