"""Fill the walls of a sample house with windows and doors, by hand-written rules."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from samples_draw import Draw, Dress

from facade_tools.artifacts.building import Building, Element, Facade, Piece, Side
from facade_tools.geometry.blocked import blocked_walls
from facade_tools.geometry.pieces import facade_pieces

EDGE = 0.2  # least wall between an element and the border of its piece (m)
GAP = 0.15  # least wall between two elements (m)
HEAD = 0.2  # least wall over a window (m)
SHIFTS = (0.0, 0.15, -0.15, 0.3, -0.3, 0.45, -0.45)  # tried in turn, outwards first (m)


@dataclass
class Spot:
    """One piece while it is being filled."""

    side: Side
    piece: Piece
    storey: int
    base: float  # v of the storey's floor in the piece's frame
    blocked: np.ndarray
    elements: list[Element]

    def fits(self, e: Element) -> bool:
        """Tell whether an element keeps clear of borders, obstacles and other elements."""
        p = self.piece
        inside = e.u >= EDGE - 1e-9 and e.u + e.width <= p.width - EDGE + 1e-9
        if not inside or e.v < 0 or e.v + e.height > p.height - 0.12 + 1e-9:
            return False
        taken = [(o.u - GAP, o.v, o.u + o.width + GAP, o.v + o.height) for o in self.elements]
        return not any(_hits(e, row) for row in [*self.blocked.tolist(), *taken])

    def put(self, e: Element, towards: float = 0.0) -> bool:
        """Place an element, moved a little sideways (first outwards) or up if it must."""
        window = e.kind == "window"
        for lift in (0.0, 0.2, 0.4) if window else (0.0,):
            for shift in SHIFTS if window else (*SHIFTS, 0.6, -0.6, 0.8, -0.8, 1.0, -1.0):
                u = e.u + shift * (1.0 if towards >= 0 else -1.0)
                moved = Element(
                    e.kind, e.style, round(u, 2), round(e.v + lift, 2), e.width, e.height, e.main
                )
                if self.fits(moved):
                    self.elements.append(moved)
                    return True
        return False


def _hits(e: Element, row: list[float] | tuple[float, ...]) -> bool:
    u0, v0, u1, v1 = row
    return e.u < u1 and e.u + e.width > u0 and e.v < v1 and e.v + e.height > v0


def dressed(building: Building, dress: Dress, d: Draw) -> dict[Side, Facade]:
    """Return the facades of a house."""
    walls = facade_pieces(building)
    blocked = blocked_walls(building, walls)
    spots = [
        _spot(building, side, piece, blocked[piece.id])
        for side, pieces in walls.items()
        for piece in pieces
    ]
    kinds = {box.id: box.kind for box in building.boxes}
    garages = [s for s in spots if kinds[s.piece.box] == "garage"]
    homes = [s for s in spots if kinds[s.piece.box] == "general"]
    _place_garage_doors(garages, dress, d)
    _place_main_door(homes, dress)
    _place_patio(homes, dress, d)
    for plane in _planes(homes):
        _fill_plane(plane, dress, d)
    for spot in garages:
        if spot.side != "front" and spot.storey == 0 and d.chance(0.35):
            _window(spot, spot.piece.width / 2, dress.second, (0.8, 0.8), 1.2)
    return {side: _facade(spots, side) for side in ("front", "back", "left", "right")}


def _facade(spots: list[Spot], side: Side) -> Facade:
    pieces = []
    for s in (s for s in spots if s.side == side):
        elements = tuple(sorted(s.elements, key=lambda e: (e.u, e.v)))
        p = s.piece
        pieces.append(Piece(p.id, p.box, p.origin, p.width, p.height, elements))
    return Facade(tuple(pieces))


def _spot(building: Building, side: Side, piece: Piece, blocked: np.ndarray) -> Spot:
    storey = int((piece.origin[2] + 1e-6) // building.storey_height)
    base = storey * building.storey_height - piece.origin[2]
    return Spot(side, piece, storey, base, blocked, [])


def _place_garage_doors(spots: list[Spot], dress: Dress, d: Draw) -> None:
    fronts = [
        s for s in spots if s.side == dress.garage_side and s.storey == 0 and s.piece.width > 2.6
    ]
    for spot in fronts[:1] if fronts else []:
        w = spot.piece.width
        height = min(2.1, spot.piece.height - 0.3)
        widths = [min(2.4, w - 0.6)] if w < 5.3 else [2.4, 2.4] if d.chance(0.4) else [4.8]
        free = (w - sum(widths)) / (len(widths) + 1)
        u = free
        for width in widths:
            spot.put(
                Element(
                    "garage-door", "sectional", round(u, 2), 0.0, round(width, 2), round(height, 2)
                )
            )
            u += width + free


def _position(spot: Spot, x: float) -> float:
    """Return the place along the piece (m) of a world position along the wall."""
    p = spot.piece
    axis = 0 if spot.side in ("front", "back") else 1
    sign = -1.0 if spot.side in ("back", "left") else 1.0
    return sign * (x - p.origin[axis])


def _place_main_door(spots: list[Spot], dress: Dress) -> None:
    fronts = [s for s in spots if s.side == "front" and s.storey == 0 and s.piece.height > 2.2]
    wanted = dress.door_x if dress.door_x is not None else 0.0

    def rank(s: Spot) -> tuple[bool, float]:
        u = _position(s, wanted)
        return not 0.7 <= u <= s.piece.width - 0.7, s.piece.origin[1] - 0.01 * s.piece.width

    for spot in sorted(fronts, key=rank):
        u = float(np.clip(_position(spot, wanted), 0.75, max(spot.piece.width - 0.75, 0.75)))
        door = Element("door", dress.door, round(u - 0.475, 2), 0.0, 0.95, 2.1, True)
        if spot.put(door, u - spot.piece.width / 2):
            if dress.sidelights:
                left, right = spot.elements[-1].u, spot.elements[-1].u + 0.95
                for at in (left - GAP - 0.35, right + GAP):
                    spot.put(Element("window", "fixed", round(at, 2), 0.2, 0.35, 1.8))
            return


def _place_patio(spots: list[Spot], dress: Dress, d: Draw) -> None:
    backs = [s for s in spots if s.side == "back" and s.storey == 0 and s.piece.width > 2.4]
    if not backs:
        return
    spot = max(backs, key=lambda s: s.piece.width)
    width = d.pick([1.5, 1.8, 2.4]) if dress.patio else 0.9
    u = spot.piece.width * d.pick([0.3, 0.5, 0.7]) - width / 2
    spot.put(Element("door", "patio" if dress.patio else "panel", round(u, 2), 0.0, width, 2.1))


def _planes(spots: list[Spot]) -> Iterator[list[Spot]]:
    """Yield the pieces of one side and one depth, bottom to top."""
    groups: dict[tuple[str, float], list[Spot]] = {}
    for s in spots:
        depth = s.piece.origin[1] if s.side in ("front", "back") else s.piece.origin[0]
        groups.setdefault((s.side, round(depth, 4)), []).append(s)
    for group in groups.values():
        yield sorted(group, key=lambda s: s.piece.origin[2])


def _fill_plane(spots: list[Spot], dress: Dress, d: Draw) -> None:
    """Fill pieces of one plane from one grid of slots, unless the house is irregular here."""
    row = {"front": 0, "back": 1, "left": 2, "right": 2}[spots[0].side]
    widest = max(spots, key=lambda s: s.piece.width)
    reference = _slots(widest.piece.width, dress, dress.spacing[row])
    axis = 0 if widest.side in ("front", "back") else 1
    sign = -1.0 if widest.side in ("back", "left") else 1.0
    world = [widest.piece.origin[axis] + sign * u for u in reference]
    blank = [d.chance(dress.blank[row]) for _ in world]
    for spot in spots:
        if spot.piece.height < 1.9 or spot.piece.width < 0.9:
            continue
        if d.chance(dress.regular):
            at = [_position(spot, x) for x, empty in zip(world, blank, strict=True) if not empty]
            inside = [u for u in at if 0.6 < u < spot.piece.width - 0.6]
            slots = inside or _slots(spot.piece.width, dress, dress.spacing[row])
        else:
            slots = _slots(spot.piece.width, dress, dress.spacing[row] * d.between(0.8, 1.5))
        _fill_spot(spot, slots, dress, d)


def _slots(width: float, dress: Dress, spacing: float) -> list[float]:
    count = max(int(width / spacing + 0.5), 1)
    while count > 1 and width / count < dress.width + 0.5:
        count -= 1
    return [width * (k + 0.5) / count for k in range(count)]


def _fill_spot(spot: Spot, slots: list[float], dress: Dress, d: Draw) -> None:
    front, ground = spot.side == "front", spot.storey == 0
    style = dress.window if front else dress.second
    room = spot.piece.width / max(len(slots), 1)
    upper = 1.0 if ground else 0.9
    special = -1
    if front and ground and (dress.picture or dress.bays) and spot.piece.width > 2.6:
        special = int(np.argmax([_free_room(spot, u) for u in slots]))
    small = not front and d.chance(0.3)
    for k, u in enumerate(slots):
        if k == special:
            wide = min(2.2 if dress.bays else 2.0, room + 0.2)
            kind = "bay" if dress.bays else "fixed"
            if _window(spot, u, kind, (round(wide, 1), dress.height), dress.sill - 0.15):
                continue
        if small and k == len(slots) - 1:
            _window(spot, u, style, (0.6, 0.6), 1.5)
        elif dress.paired and room > 2 * dress.width + 0.7:
            half = dress.width / 2 + GAP / 2 + 0.01
            for at in (u - half, u + half):
                _window(spot, at, style, (dress.width, dress.height * upper), dress.sill)
        else:
            _window(
                spot,
                u,
                style,
                (min(dress.width, spot.piece.width - 0.5), dress.height * upper),
                dress.sill,
            )


def _free_room(spot: Spot, u: float) -> float:
    gaps = [max(e.u - u, u - e.u - e.width) for e in spot.elements]
    return min([u, spot.piece.width - u, *gaps])


def _window(spot: Spot, u: float, style: str, size: tuple[float, float], sill: float) -> bool:
    width = round(max(size[0], 0.4), 2)
    room = spot.piece.height - spot.base - sill - HEAD
    height = round(min(size[1], room), 2)
    if height < 0.45:
        return False
    left = round(u - width / 2, 2)
    element = Element("window", style, left, round(spot.base + sill, 2), width, height)
    return spot.put(element, u - spot.piece.width / 2)
