"""From a building to its 49 attributes (FW16 appendix A), and the attributes as one flat vector."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ..artifacts.attributes import (
    ROOF_BITS,
    SPECIAL_BITS,
    WINDOW_BITS,
    Attributes,
    Bit,
    Bounds,
    ElementAttributes,
    FacadeAttributes,
    MassAttributes,
    Number,
    Present,
)
from ..artifacts.building import Box, Building
from ..errors import InvalidInput
from ..geometry.arrays import Floats, Integers
from ..geometry.boxes import box_rectangles, union_area_perimeter
from ..geometry.floors import TOLERANCE
from .facade_attributes import facade_vector, pack_facades
from .mass_attributes import ARF, BBOX, GARAGE_AT, KINDS, PORCH_AT, mass_vector
from .physical import LEAST_STOREY
from .relations import states_storeys

_PART = ("x", "y", "w", "d", "h", "exposure")
_SIDES = ("front", "back", "left", "right")

NAMES: tuple[str, ...] = (
    *(f"bbox.{axis}" for axis in "wdh"),
    *("bcr", "bdry", "far"),
    *(f"arf.{floor}" for floor in range(3)),
    *(f"{part}.{name}" for part in ("garage", "porch_front", "porch_back") for name in _PART),
    *(f"{group}.{side}" for group in ("wwr", "sym", "align") for side in _SIDES),
    *(f"roof.{name}" for name in ROOF_BITS),
    *(f"window.{name}" for name in WINDOW_BITS),
    *(f"special.{name}" for name in SPECIAL_BITS),
)
"""Names of the 49 attributes, in the order of the flat vector."""

ROOF_OF_STYLE = {"flat": "flat", "gable": "gable", "shed": "gable", "hip": "hip", "mansard": "hip"}


def building_attributes(building: Building) -> Attributes:
    """Return the 49 attributes of a building, whole or partial.

    Of a partial building the mass attributes are None unless `complete` lists `mass`, with
    `bounds` from the listed boxes; garage and porches are computed where listed; bits are 1 where
    seen, otherwise None. Raises InvalidInput where a whole building has no box that reaches half
    a storey.
    """
    boxes, kinds = packed_boxes(building.boxes)
    values = _numbers(mass_vector(boxes, kinds, float(building.storey_height)))
    if values[BBOX] is None and not building.partial:
        message = "no general or garage box is higher than half a storey; expected one"
        raise InvalidInput(message, pointer="/boxes")
    packed = pack_facades(building.facades)
    sides = _numbers(facade_vector(packed.pieces, packed.elements))
    return Attributes(
        id=building.id,
        mass=_partial_mass(building, values) if building.partial else _mass(values),
        facade=FacadeAttributes(sides[:4], sides[4:8], sides[8:]),
        element=_elements(building),
        storey_height=building.storey_height,
        present=_present(building, values) if building.partial else None,
        bounds=_bounds(building) if building.partial else None,
    )


def packed_boxes(boxes: Iterable[Box]) -> tuple[Floats, Integers]:
    """Return boxes as rows of x, y, width, depth, height (NaN: unknown), and their kinds."""
    rows = [(b.x, b.y, b.width, b.depth, np.nan if b.height is None else b.height) for b in boxes]
    kinds = [KINDS.index(b.kind) for b in boxes]
    return np.array(rows, dtype=np.float64).reshape(-1, 5), np.array(kinds, dtype=np.int64)


def _numbers(vector: Floats) -> tuple[Number, ...]:
    return tuple(None if value != value else value for value in vector.tolist())


def _mass(values: tuple[Number, ...]) -> MassAttributes:
    return MassAttributes(
        bbox=values[:3],
        bcr=values[3],
        bdry=values[4],
        far=values[5],
        arf=values[ARF : ARF + 3],
        garage=values[GARAGE_AT:PORCH_AT],
        porch=(values[PORCH_AT : PORCH_AT + 6], values[PORCH_AT + 6 :]),
    )


# --- partial buildings ----------------------------------------------------------------------------


def _complete(building: Building, part: str) -> bool:
    """Tell whether no more of `part` exists than is listed; garages belong to the mass."""
    names = ("mass", "garage") if part == "garage" else (part,)
    return any(name in building.complete for name in names)


def _part_state(building: Building, kind: str, size: Number) -> bool | None:
    """Return whether a garage or porch exists; None: unknown. `size` is its computed width."""
    if size:
        return True
    if size is None and any(box.kind == kind for box in building.boxes):
        return None  # a porch beside nothing: front and back cannot be told apart
    return False if _complete(building, kind) else None


def _present(building: Building, values: tuple[Number, ...]) -> Present:
    return Present(
        garage=_part_state(building, "garage", values[GARAGE_AT + 2]),
        porch_front=_part_state(building, "porch", values[PORCH_AT + 2]),
        porch_back=_part_state(building, "porch", values[PORCH_AT + 8]),
    )


def _partial_mass(building: Building, values: tuple[Number, ...]) -> MassAttributes:
    present = _present(building, values)
    unknown: tuple[Number, ...] = (None,) * 6
    parts = [
        (0.0,) * 6 if state is False else values[start : start + 6] if state else unknown
        for state, start in (
            (present.garage, GARAGE_AT),
            (present.porch_front, PORCH_AT),
            (present.porch_back, PORCH_AT + 6),
        )
    ]
    garage, porch = parts[0], (parts[1], parts[2])
    if not _complete(building, "mass"):
        return MassAttributes(garage=garage, porch=porch)
    floors = values[5:9] if values[2] is not None else (None,) * 4
    return MassAttributes(values[:3], values[3], values[4], floors[0], floors[1:], garage, porch)


def _bounds(building: Building) -> Bounds | None:
    mass = [box for box in building.boxes if box.kind != "porch"]
    if not mass or _complete(building, "mass"):
        return None
    width = max(b.x + b.width / 2 for b in mass) - min(b.x - b.width / 2 for b in mass)
    depth = max(b.y + b.depth / 2 for b in mass) - min(b.y - b.depth / 2 for b in mass)
    least = (width, depth, max(b.height or 0.0 for b in mass))
    storey = building.storey_height if states_storeys(building) else LEAST_STOREY
    return Bounds(least, (_low_area(mass, 1.5 * storey), _low_area(mass, 2.5 * storey)))


def _low_area(mass: Sequence[Box], reach: float) -> float:
    """Return the plan area (m²) of boxes that do not reach above `reach`; unknown heights may."""
    high = [box for box in mass if not box.height or box.height > reach + TOLERANCE]
    whole, left = (union_area_perimeter(box_rectangles(boxes))[0] for boxes in (mass, high))
    return max(round(whole - left, 6), 0.0)


# --- element bits ---------------------------------------------------------------------------------


def _bits(names: tuple[str, ...], seen: set[str], absent: Bit) -> dict[str, Bit]:
    return {name: 1 if name in seen else absent for name in names}


def _elements(building: Building) -> ElementAttributes:
    roofs = {
        ROOF_OF_STYLE[box.roof.style]
        for box in building.boxes
        if box.kind == "general" and box.roof is not None and box.roof.style in ROOF_OF_STYLE
    }
    windows = {
        element.style
        for facade in building.facades.values()
        for piece in facade.pieces
        for element in piece.elements
        if element.kind == "window"
    }
    absent: Bit = None if building.partial else 0
    return ElementAttributes(
        roof=_bits(ROOF_BITS, roofs, 0 if "roof" in building.complete else absent),
        window=_bits(WINDOW_BITS, windows, absent if building.facades else None),
        special=_bits(SPECIAL_BITS, set(building.features), absent),
    )


# --- flat vectors ---------------------------------------------------------------------------------


def attribute_vector(attributes: Attributes) -> Floats:
    """Return the 49 numbers in the order of `NAMES`; unobserved ones are NaN."""
    mass, facade, element = attributes.mass, attributes.facade, attributes.element
    front, back = mass.porch
    row: list[Number] = [
        *(*mass.bbox, mass.bcr, mass.bdry, mass.far, *mass.arf),
        *(*mass.garage, *front, *back),
        *(*facade.wwr, *facade.sym, *facade.align),
        *(element.roof[name] for name in ROOF_BITS),
        *(element.window[name] for name in WINDOW_BITS),
        *(element.special[name] for name in SPECIAL_BITS),
    ]
    return np.array(row, dtype=np.float64)


def attribute_matrix(rows: Iterable[Attributes]) -> Floats:
    """Return the attributes of many buildings (n, 49); unobserved values are NaN."""
    return np.array([attribute_vector(row) for row in rows]).reshape(-1, len(NAMES))


def attributes_of_vector(identity: str, vector: Floats, storey_height: float = 3.0) -> Attributes:
    """Return the artifact of a flat vector (49,): the inverse of `attribute_vector`."""
    values = _numbers(np.asarray(vector, dtype=np.float64))
    bits = [None if value is None else round(value) for value in values[39:]]
    element = ElementAttributes(
        roof=dict(zip(ROOF_BITS, bits[:3], strict=True)),
        window=dict(zip(WINDOW_BITS, bits[3:8], strict=True)),
        special=dict(zip(SPECIAL_BITS, bits[8:], strict=True)),
    )
    facade = FacadeAttributes(values[27:31], values[31:35], values[35:39])
    return Attributes(identity, _mass(values[:27]), facade, element, storey_height)
