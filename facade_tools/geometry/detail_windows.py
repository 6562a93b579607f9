"""Windows: casing, sill, sashes, muntins and panes as boxes in the piece's frame.

The mass stays a closed solid, so a window stands on the wall: its casing is proud, its pane lies
back between the casing's reveals.
"""

from __future__ import annotations

from itertools import pairwise

from ..artifacts.building import Element
from .detail_boxes import Box6, Parts, ring

CASING = 0.09  # width of the boards around an opening, metres
CASING_DEPTH = 0.075
PANE = 0.02  # how far the glass stands off the wall
SASH = 0.055
MUNTIN = 0.025


def window_parts(element: Element) -> Parts:
    """Return the boxes of a window by material (trim, glass)."""
    u0, v0 = element.u, element.v
    u1, v1 = u0 + element.width, v0 + element.height
    build = _STYLES.get(element.style, _fixed)
    frames, panes = build(u0, v0, u1, v1)
    return {"trim": [*casing(u0, v0, u1, v1), *_sill(u0, v0, u1), *frames], "glass": panes}


def casing(u0: float, v0: float, u1: float, v1: float, floor: bool = False) -> list[Box6]:
    """Return the boards around an opening, with a head board; `floor`: open at the bottom."""
    low = v0 if floor else v0 - CASING
    head = (
        u0 - CASING - 0.03,
        v1,
        0.0,
        u1 + CASING + 0.03,
        v1 + CASING + 0.03,
        CASING_DEPTH + 0.025,
    )
    sides: list[Box6] = [
        (u0 - CASING, low, 0.0, u0, v1, CASING_DEPTH),
        (u1, low, 0.0, u1 + CASING, v1, CASING_DEPTH),
    ]
    return [head, *sides]


def _sill(u0: float, v0: float, u1: float) -> list[Box6]:
    reach = CASING + 0.05
    return [
        (u0 - reach, v0 - 0.055, 0.0, u1 + reach, v0, CASING_DEPTH + 0.05),
        (u0 - CASING, v0 - CASING - 0.02, 0.0, u1 + CASING, v0 - 0.055, CASING_DEPTH - 0.02),
    ]


Built = tuple[list[Box6], list[Box6]]


def glazing(style: str, u0: float, v0: float, u1: float, v1: float) -> Parts:
    """Return the sashes and panes alone (trim, glass), as they stand in an opening."""
    frames, panes = _STYLES.get(style, _fixed)(u0, v0, u1, v1)
    return {"trim": frames, "glass": panes}


def sash_leaf(
    u0: float, v0: float, u1: float, v1: float, *, depth: float, grid: tuple[int, int]
) -> Built:
    """Return frame and pane of one leaf; grid: panes across and up, divided by muntins."""
    width = min(SASH, 0.2 * (u1 - u0), 0.2 * (v1 - v0))
    front = depth + 0.035
    frames = ring(u0, v0, u1, v1, width, (depth - 0.01, front))
    for i in range(1, grid[0]):
        at = u0 + (u1 - u0) * i / grid[0]
        frames.append(
            (at - MUNTIN / 2, v0 + width, depth, at + MUNTIN / 2, v1 - width, depth + 0.02)
        )
    for j in range(1, grid[1]):
        at = v0 + (v1 - v0) * j / grid[1]
        frames.append(
            (u0 + width, at - MUNTIN / 2, depth, u1 - width, at + MUNTIN / 2, depth + 0.02)
        )
    return frames, [(u0 + width, v0 + width, 0.002, u1 - width, v1 - width, depth)]


def _joined(*leaves: Built) -> Built:
    return [box for frames, _ in leaves for box in frames], [
        box for _, panes in leaves for box in panes
    ]


def _fixed(u0: float, v0: float, u1: float, v1: float) -> Built:
    return sash_leaf(u0, v0, u1, v1, depth=PANE, grid=(1, 1))


def _sash(u0: float, v0: float, u1: float, v1: float) -> Built:
    middle = (v0 + v1) / 2
    columns = 2 if u1 - u0 > 0.6 else 1
    lower = sash_leaf(u0, v0, u1, middle + SASH / 2, depth=PANE, grid=(1, 1))
    upper = sash_leaf(u0, middle - SASH / 2, u1, v1, depth=PANE + 0.02, grid=(columns, 1))
    return _joined(lower, upper)


def _sliding(u0: float, v0: float, u1: float, v1: float) -> Built:
    middle = (u0 + u1) / 2
    left = sash_leaf(u0, v0, middle + SASH / 2, v1, depth=PANE, grid=(1, 1))
    right = sash_leaf(middle - SASH / 2, v0, u1, v1, depth=PANE + 0.02, grid=(1, 1))
    return _joined(left, right)


def _casement(u0: float, v0: float, u1: float, v1: float) -> Built:
    rows = 3 if v1 - v0 > 1.3 else 2
    leaves = 2 if u1 - u0 > 0.7 else 1
    edges = [u0 + (u1 - u0) * i / leaves for i in range(leaves + 1)]
    return _joined(
        *(sash_leaf(a, v0, b, v1, depth=PANE + 0.01, grid=(1, rows)) for a, b in pairwise(edges))
    )


_STYLES = {"fixed": _fixed, "sash": _sash, "sliding": _sliding, "casement": _casement}
