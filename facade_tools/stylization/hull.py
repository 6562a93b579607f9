"""The slabs of all placed blocks as one closed solid, and the roofs that can be seen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..geometry.arrays import Booleans, Floats
from ..geometry.mesh import Mesh
from ..geometry.solids_merge import Piece, merged
from ..geometry.solids_pinch import unpinched
from ..geometry.solids_surface import Label, Solid, triangulated
from .outline import SEEN
from .panels import rectangles
from .remesh import Slab, on_grid

TOUCH = 1e-6  # m
TENTH = 1e-4  # m


def layers(slabs: Sequence[Slab]) -> list[Slab]:
    """Return the union of slabs as a stack of disjoint plans, from the ground up.

    Places nearer than a tenth of a millimetre are one; between two layers there may be a gap.
    """
    levels = np.unique(np.round([v for slab in slabs for v in (slab.bottom, slab.top)], 4))
    found = []
    for bottom, top in zip(levels[:-1].tolist(), levels[1:].tolist(), strict=True):
        middle = 0.5 * (bottom + top)
        own = [slab for slab in slabs if slab.bottom < middle < slab.top]
        if own:
            xs = np.unique(np.round(np.concatenate([slab.xs for slab in own]), 4))
            ys = np.unique(np.round(np.concatenate([slab.ys for slab in own]), 4))
            cells = np.any([on_grid(slab, xs, ys) for slab in own], axis=0)
            found.append(Slab(bottom, top, xs, ys, cells))
    return found


def mass(stack: Sequence[Slab], material: str) -> Mesh:
    """Return a stack of layers as one watertight mesh called `mass`, outward oriented."""
    vertices: dict[tuple[float, float, float], int] = {}
    pieces: list[Piece] = []
    for level, below, above in _borders(stack):
        _add_level(vertices, pieces, level, below, above)
    for below, layer, above in zip([None, *stack[:-1]], stack, [*stack[1:], None], strict=True):
        _add_walls(vertices, pieces, layer, (below, above))
    points = np.array(list(vertices), dtype=np.float64)
    solid = unpinched(_with_midpoints(merged(points, pieces)))
    found, triangles, _ = triangulated(solid)
    return Mesh("mass", found, triangles, material)


def _with_midpoints(solid: Solid) -> Solid:
    """Return the solid with a vertex in the middle of every edge at which four faces meet.

    Where the faces on both sides hang together around both ends of such an edge, neither end
    alone can be doubled to open it.
    """
    half_edges = Counter(
        (ring[k - 1], vertex)
        for face in solid.faces
        for ring in face
        for k, vertex in enumerate(ring)
    )
    pinched = {frozenset(edge) for edge, count in half_edges.items() if count > 1}
    if not pinched:
        return solid
    first = len(solid.vertices)
    middle = {edge: first + k for k, edge in enumerate(sorted(pinched, key=sorted))}
    ends = np.array([sorted(edge) for edge in middle])
    vertices = np.concatenate([solid.vertices, solid.vertices[ends].mean(axis=1)])
    faces = tuple(tuple(_divided(ring, middle) for ring in face) for face in solid.faces)
    return Solid(vertices, faces, solid.labels)


def _divided(ring: tuple[int, ...], middle: Mapping[frozenset[int], int]) -> tuple[int, ...]:
    divided = []
    for k, vertex in enumerate(ring):
        between = middle.get(frozenset((ring[k - 1], vertex)))
        divided += [vertex] if between is None else [between, vertex]
    return tuple(divided)


def roofs(stack: Sequence[Slab], slabs: Sequence[Sequence[Slab]]) -> Iterator[tuple[int, Floats]]:
    """Yield the block and the corners (4, 3) of every rectangle that is open to the sky.

    slabs: the plans of every block's storeys.
    """
    for level, below, above in _borders(stack):
        if below is None:
            continue
        xs, ys = _joint((below, above))
        bare = _filled(below, xs, ys) & ~_filled(above, xs, ys)
        for block, own in enumerate(slabs):
            for slab in own:
                if bare.any() and abs(slab.top - level) < 2 * TENTH:
                    mask = bare & on_grid(slab, xs, ys)
                    bare &= ~mask
                    for row, end, a, b in rectangles(mask):
                        yield block, _corners(xs[a], ys[row], xs[b], ys[end], level)


def _corners(x0: float, y0: float, x1: float, y1: float, z: float) -> Floats:
    return np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])


def _borders(stack: Sequence[Slab]) -> Iterator[tuple[float, Slab | None, Slab | None]]:
    """Yield every height at which layers begin or end, with the layer below and above it."""
    before: Slab | None = None
    for layer in stack:
        if before is not None and before.top < layer.bottom - TOUCH:
            yield before.top, before, None
            before = None
        yield layer.bottom, before, layer
        before = layer
    if before is not None:
        yield before.top, before, None


def _joint(layers_: Sequence[Slab | None]) -> tuple[Floats, Floats]:
    known = [layer for layer in layers_ if layer is not None]
    xs = np.unique(np.concatenate([layer.xs for layer in known]))
    ys = np.unique(np.concatenate([layer.ys for layer in known]))
    return xs, ys


def _filled(layer: Slab | None, xs: Floats, ys: Floats) -> Booleans:
    if layer is None:
        return np.zeros((len(ys) - 1, len(xs) - 1), dtype=bool)
    return on_grid(layer, xs, ys)


def _add_level(
    vertices: dict[tuple[float, float, float], int],
    pieces: list[Piece],
    z: float,
    below: Slab | None,
    above: Slab | None,
) -> None:
    """Add the level faces at a height: roofs where only below is filled, soffits the other way."""
    xs, ys = _joint((below, above))
    under, over = _filled(below, xs, ys), _filled(above, xs, ys)
    for name, mask in (("roof", under & ~over), ("ground", over & ~under)):
        for row, end, a, b in rectangles(mask):
            near = [(float(xs[k]), float(ys[row])) for k in range(a, b + 1)]
            right = [(float(xs[b]), float(ys[k])) for k in range(row + 1, end)]
            far = [(float(xs[k]), float(ys[end])) for k in range(b, a - 1, -1)]
            left = [(float(xs[a]), float(ys[k])) for k in range(end - 1, row, -1)]
            ring = [_vertex(vertices, x, y, z) for x, y in (*near, *right, *far, *left)]
            ring = ring if name == "roof" else ring[::-1]
            label = Label("roof" if name == "roof" else "ground")
            pieces.append(Piece([ring], (name, z), label))


def _add_walls(
    vertices: dict[tuple[float, float, float], int],
    pieces: list[Piece],
    layer: Slab,
    around: tuple[Slab | None, Slab | None],
) -> None:
    """Add a layer's walls; their edges hold every vertex that the level faces there may have."""
    for side, (axis, _) in SEEN.items():
        lines = _ends(layer, around, 1 - axis)
        for place, start, end in _walls(layer, side):
            bottom, top = (_chain(line, start, end) for line in lines)
            low = [_at(vertices, axis, place, v, layer.bottom) for v in bottom]
            high = [_at(vertices, axis, place, v, layer.top) for v in top]
            ring = low + high[::-1]
            ring = ring if side in ("front", "right") else ring[::-1]
            pieces.append(Piece([ring], (side, place), Label("wall")))


def _ends(
    layer: Slab, around: tuple[Slab | None, Slab | None], along: int
) -> tuple[Floats, Floats]:
    """Return the lines along a wall at its lower and its upper edge."""
    below, above = around
    below = below if below is not None and below.top > layer.bottom - TOUCH else None
    above = above if above is not None and above.bottom < layer.top + TOUCH else None
    # `along` 1: the wall runs along x, its lines are the grid's xs
    pick = 0 if along == 1 else 1
    return _joint((below, layer))[pick], _joint((layer, above))[pick]


def _walls(layer: Slab, side: str) -> Iterator[tuple[float, float, float]]:
    """Yield place, least and greatest end of the walls of a layer on one side."""
    axis, step = SEEN[side]
    own = np.pad(layer.cells, 1)
    places, along = (layer.ys, layer.xs) if axis == 0 else (layer.xs, layer.ys)
    own = own if axis == 0 else own.T
    low, high = (~own[:-1], own[1:]) if step < 0 else (own[:-1], ~own[1:])
    walls = (low & high)[:, 1:-1]
    for line in np.flatnonzero(walls.any(axis=1)):
        padded = np.concatenate([[False], walls[line], [False]])
        for a, b in np.flatnonzero(padded[1:] != padded[:-1]).reshape(-1, 2):
            yield float(places[line]), float(along[a]), float(along[b])


def _chain(lines: Floats, start: float, end: float) -> list[float]:
    return [float(v) for v in lines[(lines >= start) & (lines <= end)]]


def _at(
    vertices: dict[tuple[float, float, float], int], axis: int, place: float, v: float, z: float
) -> int:
    return _vertex(vertices, v, place, z) if axis == 0 else _vertex(vertices, place, v, z)


def _vertex(vertices: dict[tuple[float, float, float], int], x: float, y: float, z: float) -> int:
    return vertices.setdefault((x, y, z), len(vertices))
