"""From a derivation to a scene: the closed mass, and its leaves as parts around it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from ..artifacts.shape_grammar import Terminal
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Points2, Points3
from ..geometry.detail_boxes import Box6, LocalFrame, meshes_of
from ..geometry.detail_doors import door_leaf
from ..geometry.detail_windows import glazing
from ..geometry.details import SCHEMES, mass_mesh, materials
from ..geometry.mesh import Material, Mesh, Scene
from ..geometry.openings import Opening, pierced
from ..geometry.patterns import pattern_uv
from ..geometry.polygons import shape_of
from ..geometry.solids import Solid
from .engine import Derived, Leaf
from .scopes import FLAT, UP, Shape
from .skins import Skins, unit_normal
from .volumes import inside_mass, mass_solid, standing

OPEN = ("window", "door", "garage-door")
COLORS = {
    "wall": "#d8caa8", "window": "#3c4a58", "door": "#6a4630", "garage-door": "#8c8a86",
    "balcony": "#3a3c42", "roof": "#5c6474", "shop": "#4a3e38", "chimney": "#97503e",
    "trim": "#efeae0", "stone": "#b5ad9c", "glass": "#2c3a45",
}  # fmt: skip
SLAB = 0.14  # metres, thickness of a balcony
WALL = 0.1  # of its parapet
PROBE = 0.02  # metres before a face where it is looked whether something hides it
BAR, GAP, RAIL = 0.02, 0.13, 0.05  # metres: bars of a railing, their distance, its hand rail

Painted = tuple[str, Points2 | None]
Paint = Callable[[Leaf, Points3, Floats], Painted | None]


@dataclass(frozen=True, slots=True)
class Look:
    """How faces are covered.

    paint: function of a leaf, points (n, 3) of one of its faces and their normal (3,); returns the
    name of a material and texture coordinates, or None for the plain colour of the leaf.
    materials: that `paint` names.
    """

    paint: Paint = field(default=lambda leaf, points, normal: None)
    materials: Mapping[str, Material] = field(default_factory=dict)


def derived_scene(derived: Derived, name: str, look: Look | None = None) -> Scene:
    """Return the scene of a derivation: `mass` is its closed solid, openings recessed.

    Raises InvalidInput where the grammar makes no volume.
    """
    look = look or Look()
    solid = mass_of(derived)
    derived = replace(derived, leaves=_shown(derived))
    openings = [opening for opening in map(opening_of, derived.leaves) if opening is not None]
    held = [opening for opening in openings if _on_wall(solid, opening)]
    recessed, closes = pierced(solid, held)
    drawn = {opening.name for opening in closes if opening is not None}
    skins, details = Skins(), list(_closings(recessed, closes, derived, look))
    for leaf in derived.leaves:
        if leaf.name in drawn:
            continue
        if leaf.terminal.label == "balcony" and leaf.shape.thickness > FLAT:
            details += balcony(leaf, look)
        else:
            _cover(skins, leaf, look)
    painted = {
        leaf.name for leaf in derived.leaves
        if leaf.terminal.label in OPEN and look.paint(leaf, leaf.faces.points, UP) is not None
    }  # fmt: skip
    details += [mesh for opening in openings if opening.name not in drawn | painted
                for mesh in _inserted(opening, opening.frame)]  # fmt: skip
    meshes = [mass_mesh(recessed), *skins.meshes(), *details]
    return Scene(name, tuple(meshes), _materials(derived, look, meshes))


def _shown(derived: Derived) -> tuple[Leaf, ...]:
    """Return the leaves without the flat ones that another volume hides."""
    flat = [leaf for leaf in derived.leaves if leaf.shape.thickness <= FLAT]
    probes = [_probes(leaf) for leaf in flat]
    if not probes:
        return derived.leaves
    inside = inside_mass(np.concatenate(probes), standing(derived.volumes))
    ends = np.cumsum([len(points) for points in probes])[:-1]
    hidden = {
        leaf.name for leaf, rows in zip(flat, np.split(inside, ends), strict=True) if rows.all()
    }
    return tuple(leaf for leaf in derived.leaves if leaf.name not in hidden)


def _probes(leaf: Leaf) -> Points3:
    """Return points (n, 3) just before a flat leaf: near its corners, and in their middle."""
    ring = leaf.faces.points[list(leaf.faces.faces[0][0])]
    normal = unit_normal(ring)
    middle = ring.mean(axis=0)
    before = np.zeros(3) if normal is None else PROBE * normal
    return np.asarray(np.vstack([middle + 0.98 * (ring - middle), middle]) + before)


def mass_of(derived: Derived) -> Solid:
    """Return the closed solid of a derivation. Raises InvalidInput where there is none."""
    solid = mass_solid(standing(derived.volumes))
    if solid is None:
        raise InvalidInput("the derivation has no volume; expected an extruded footprint")
    return solid


# --- faces ----------------------------------------------------------------------------------------
def _cover(skins: Skins, leaf: Leaf, look: Look) -> None:
    """Draw the faces of a leaf."""
    part = leaf.name if leaf.terminal.label in OPEN else leaf.name.rpartition("-")[0]
    for face in leaf.faces.faces:
        ring = leaf.faces.points[list(face[0])]
        normal = unit_normal(ring)
        if normal is None:
            continue
        material, uv = _paint(leaf, leaf.faces.points, normal, look)
        skins.add(part, material, leaf.faces.points, face, uv)


def _paint(leaf: Leaf, points: Points3, normal: Floats, look: Look) -> Painted:
    painted = look.paint(leaf, points, normal)
    if painted is not None:
        return painted
    if leaf.terminal.label == "roof" and normal[2] < 0.999:
        return leaf.shape.symbol, pattern_uv("shingle", points, normal)
    return leaf.shape.symbol, None


def _materials(derived: Derived, look: Look, meshes: Iterable[Mesh]) -> dict[str, Material]:
    """Return the materials that the meshes use."""
    walls: dict[str, float] = defaultdict(float)
    known = materials(SCHEMES[0], "")
    for leaf in derived.leaves:
        color = color_of(leaf.terminal)
        pattern = "shingle" if leaf.terminal.label == "roof" else ""
        known[leaf.shape.symbol] = Material(leaf.shape.symbol, color, pattern=pattern)
        if leaf.terminal.label == "wall":
            walls[color] += float(np.prod(leaf.shape.scope.size[[0, 2]]))
    main = max(walls, key=lambda color: walls[color], default=COLORS["wall"])
    known |= {"wall": Material("wall", main), **look.materials}
    return {mesh.material: known[mesh.material] for mesh in meshes}


def color_of(terminal: Terminal) -> str:
    """Return the colour of a leaf's plain faces."""
    return terminal.color or COLORS.get(terminal.label, COLORS["stone"])


# --- openings -------------------------------------------------------------------------------------
def frame_of(shape: Shape) -> LocalFrame:
    """Return the frame of a face: u to the right seen from outside, v up, w outward."""
    scope = shape.scope
    if not scope.mirrored:
        return LocalFrame(scope.origin, np.array([scope.axes[0], scope.axes[2], -scope.axes[1]]))
    origin = scope.origin + scope.size[0] * scope.axes[0]
    return LocalFrame(origin, np.array([-scope.axes[0], scope.axes[2], -scope.axes[1]]))


def opening_of(leaf: Leaf) -> Opening | None:
    """Return an upright rectangular window or door as an opening of its wall, others as None."""
    shape, label = leaf.shape, leaf.terminal.label
    level = abs(float(shape.scope.axes[2] @ UP) - 1.0) < 1e-9
    if label not in OPEN or shape.plane != "y" or shape.outline is not None or not level:
        return None
    if shape.thickness > FLAT:
        return None
    width, _, height = (float(v) for v in shape.scope.size)
    return Opening(
        leaf.name, label, leaf.terminal.style, frame_of(shape), (0.0, 0.0, width, height)
    )


def _on_wall(solid: Solid, opening: Opening) -> bool:
    """Return whether the middle of an opening lies on a wall of the solid."""
    u0, v0, u1, v1 = opening.rectangle
    middle = opening.frame.world(np.array([[(u0 + u1) / 2, (v0 + v1) / 2, 0.0]]))[0]
    for face, label in zip(solid.faces, solid.labels, strict=True):
        if label.semantic != "wall":
            continue
        rings = [(solid.vertices[list(ring)] - middle) @ opening.frame.axes.T for ring in face]
        if np.abs(rings[0][:, 2]).max() < 1e-5 and shapely.intersects_xy(
            shape_of([ring[:, :2] for ring in rings]), 0.0, 0.0
        ):
            return True
    return False


def _closings(
    solid: Solid, closes: Sequence[Opening | None], derived: Derived, look: Look
) -> Iterator[Mesh]:
    """Yield what closes the recesses: a painted face, or a window or door."""
    leaves = {leaf.name: leaf for leaf in derived.leaves}
    skins = Skins()
    for face, opening in zip(solid.faces, closes, strict=True):
        if opening is None:
            continue
        leaf = leaves[opening.name]
        points = solid.vertices[list(face[0])]
        painted = look.paint(leaf, points, opening.frame.axes[2])
        if painted is None:
            depth = float(((points[0] - opening.frame.origin) @ opening.frame.axes.T)[2])
            origin = opening.frame.origin + depth * opening.frame.axes[2]
            yield from _inserted(opening, LocalFrame(origin, opening.frame.axes))
        else:
            skins.add(opening.name, painted[0], points, (tuple(range(len(points))),), painted[1])
    yield from skins.meshes()


def _inserted(opening: Opening, frame: LocalFrame) -> list[Mesh]:
    """Return the sashes or the leaf of an opening, standing in a frame."""
    ring = np.array(opening.ring or [opening.rectangle[:2], opening.rectangle[2:]])
    (u0, v0), (u1, v1) = ring.min(axis=0), ring.max(axis=0)
    where = (float(u0), float(v0), float(u1), float(v1))
    if opening.kind == "window":
        return meshes_of(opening.name, glazing(opening.style or "casement", *where), frame)
    return meshes_of(opening.name, door_leaf(opening.style, *where), frame)


# --- balconies ------------------------------------------------------------------------------------
def balcony(leaf: Leaf, look: Look) -> list[Mesh]:
    """Return a balcony inside its scope: slab and railing, or a solid parapet (style `solid`).

    Its front is painted as one face where the look paints it.
    """
    shape = leaf.shape
    frame = frame_of(shape)
    width, depth, height = (float(v) for v in shape.scope.size)
    # The scope's y runs into the wall: the front of the balcony lies at w = 0, its back at -depth.
    slab: list[Box6] = [(0.0, 0.0, -depth, width, min(SLAB, height / 2), 0.0)]
    corners = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], float)
    points = frame.world(corners)
    painted = look.paint(leaf, points, frame.axes[2])
    if painted is not None:
        skins = Skins()
        skins.add(f"{leaf.name}/front", painted[0], points, ((0, 1, 2, 3),), painted[1])
        boxes = [*slab, *_parapet(width, depth, height, BAR)]
        return [*skins.meshes(), *meshes_of(leaf.name, {shape.symbol: boxes}, frame)]
    solid = leaf.terminal.style == "solid"
    rails = _parapet(width, depth, height, WALL) if solid else list(_railing(width, depth, height))
    return meshes_of(leaf.name, {"stone": slab, shape.symbol: rails}, frame)


def _parapet(width: float, depth: float, height: float, thick: float) -> list[Box6]:
    """Return front and both ends of a closed railing."""
    return [
        (0.0, 0.0, -thick, width, height, 0.0),
        (0.0, 0.0, -depth, thick, height, 0.0),
        (width - thick, 0.0, -depth, width, height, 0.0),
    ]


def _railing(width: float, depth: float, height: float) -> Iterator[Box6]:
    """Yield the bars and rails of the front and both ends."""
    top = height - RAIL
    for low, high in ((top, height), (SLAB + 0.06, SLAB + 0.06 + BAR)):
        yield (0.0, low, -RAIL, width, high, 0.0)
        yield (0.0, low, -depth, RAIL, high, 0.0)
        yield (width - RAIL, low, -depth, width, high, 0.0)
    for u in np.linspace(0.0, width - BAR, max(2, round(width / GAP) + 1)).tolist():
        yield (u, SLAB / 2, -BAR, u + BAR, top, 0.0)
    for w in np.linspace(-depth, -BAR, max(2, round(depth / GAP) + 1)).tolist():
        yield (0.0, SLAB / 2, w, BAR, top, w + BAR)
        yield (width - BAR, SLAB / 2, w, width, top, w + BAR)
