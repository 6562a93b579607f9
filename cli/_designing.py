"""Designs as the facades of `facade facadegen --design`: the two methods meet in the layout."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from facade_tools.artifacts.building import SIDES, Element, Side
from facade_tools.artifacts.design import Design
from facade_tools.artifacts.store import read_one
from facade_tools.errors import InvalidInput
from facade_tools.layering.elements import facade_elements
from facade_tools.layering.solve import solve_design


@dataclass(frozen=True)
class SolvedWall:
    """A design that is solved for a wall of any size (m)."""

    design: Design

    def __call__(self, width: float, height: float) -> Sequence[Element]:
        """Return the windows and doors of the layout, in the frame of the wall."""
        layout = solve_design(self.design, width=width, height=height)
        return facade_elements(layout)


def designers(pairs: Sequence[str]) -> dict[Side, SolvedWall]:
    """Return what makes each designed side; `pairs` are SIDE:DESIGN."""
    found: dict[Side, SolvedWall] = {}
    for pair in pairs:
        name, _, path = pair.partition(":")
        side = next((side for side in SIDES if side == name), None)
        if side is None or not path:
            expected = "expected SIDE:DESIGN with front, back, left or right"
            raise InvalidInput(f"--design {pair}: {expected}")
        found[side] = SolvedWall(read_one(path, Design))
    return found
