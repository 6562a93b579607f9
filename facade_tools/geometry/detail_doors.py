"""Doors and garage doors: casing, leaf, panels, sections, handle as boxes in the piece's frame."""

from __future__ import annotations

from itertools import pairwise

from ..artifacts.building import Element
from .detail_boxes import Box6, Parts, ring
from .detail_windows import casing, sash_leaf

LEAF = 0.03  # how far a door's leaf stands off the wall, metres
PANEL = 0.018
GLAZED = ("glass", "patio", "sliding", "french")
SECTION = 0.53  # height of a section of a garage door


def door_parts(element: Element) -> Parts:
    """Return the boxes of a door by material (trim, door, glass, metal, stone)."""
    u0, v0 = element.u, element.v
    u1, v1 = u0 + element.width, v0 + element.height
    parts = door_leaf(element.style, u0, v0, u1, v1)
    parts["trim"] = [*casing(u0, v0, u1, v1, floor=True), *parts.get("trim", [])]
    parts["stone"] = [(u0 - 0.1, v0, 0.0, u1 + 0.1, v0 + 0.03, 0.16)]
    return parts


def door_leaf(style: str, u0: float, v0: float, u1: float, v1: float) -> Parts:
    """Return the leaf alone (door, glass, metal, trim), as it stands in an opening."""
    glazed = any(word in style for word in GLAZED)
    return _glazed(u0, v0, u1, v1) if glazed else _panelled(u0, v0, u1, v1)


def _glazed(u0: float, v0: float, u1: float, v1: float) -> Parts:
    count = max(1, round((u1 - u0) / 0.95))
    trim: list[Box6] = []
    glass: list[Box6] = []
    for i in range(count):
        left, right = u0 + (u1 - u0) * i / count, u0 + (u1 - u0) * (i + 1) / count
        frames, panes = sash_leaf(left, v0 + 0.03, right, v1, depth=0.02, grid=(1, 1))
        trim += frames
        glass += panes
    return {"trim": trim, "glass": glass}


def _panelled(u0: float, v0: float, u1: float, v1: float) -> Parts:
    count = 2 if u1 - u0 > 1.45 else 1
    edges = [u0 + (u1 - u0) * i / count for i in range(count + 1)]
    door: list[Box6] = []
    metal: list[Box6] = []
    glass: list[Box6] = []
    for i, (a, b) in enumerate(pairwise(edges)):
        door.append((a + 0.004, v0 + 0.03, 0.0, b - 0.004, v1, LEAF))
        light = v0 + 0.74 * (v1 - v0)
        door += _panels(a + 0.11, v0 + 0.18, b - 0.11, light - 0.06)
        glass.append((a + 0.13, light + 0.02, LEAF, b - 0.13, v1 - 0.14, LEAF + 0.006))
        door += ring(a + 0.11, light, b - 0.11, v1 - 0.12, 0.025, (LEAF, LEAF + 0.022))
        knob = b - 0.07 if i == 0 else a + 0.07
        middle = v0 + 0.47 * (v1 - v0)
        metal.append((knob - 0.025, middle - 0.06, LEAF, knob + 0.025, middle + 0.06, LEAF + 0.05))
    return {"door": door, "glass": glass, "metal": metal}


def _panels(u0: float, v0: float, u1: float, v1: float) -> list[Box6]:
    """Two columns of a tall and a low panel, each a raised field inside a groove."""
    out: list[Box6] = []
    middle, rail = (u0 + u1) / 2, 0.05
    cut = v0 + 0.4 * (v1 - v0)
    for a, b in ((u0, middle - rail), (middle + rail, u1)):
        for low, high in ((v0, cut - rail), (cut + rail, v1)):
            out += ring(a, low, b, high, 0.02, (LEAF, LEAF + PANEL))
            out.append((a + 0.05, low + 0.05, LEAF, b - 0.05, high - 0.05, LEAF + PANEL))
    return out


def garage_door_parts(element: Element) -> Parts:
    """Return the boxes of a sectional garage door; the topmost section but one has lights."""
    u0, v0 = element.u, element.v
    u1, v1 = u0 + element.width, v0 + element.height
    rows = max(2, round((v1 - v0) / SECTION))
    columns = max(2, round((u1 - u0) / 0.62))
    parts: Parts = {"trim": casing(u0, v0, u1, v1, floor=True), "garage-door": [], "glass": []}
    for j in range(rows):
        low, high = v0 + (v1 - v0) * j / rows, v0 + (v1 - v0) * (j + 1) / rows
        parts["garage-door"].append((u0, low + 0.022, 0.0, u1, high, 0.03))
        material = "glass" if j == rows - 1 and rows > 2 else "garage-door"
        for i in range(columns):
            a = u0 + (u1 - u0) * i / columns + 0.06
            b = u0 + (u1 - u0) * (i + 1) / columns - 0.06
            parts[material].append((a, low + 0.09, 0.03, b, high - 0.08, 0.06))
            if material == "glass":
                parts["trim"] += ring(a, low + 0.09, b, high - 0.08, 0.03, (0.03, 0.07))
    parts["shadow"] = [(u0, v0, 0.0, u1, v1, 0.012)]
    return parts
