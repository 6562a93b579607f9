"""Metres to the integers that the search counts in."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .problem import Direction

MAX_DIGITS = 12
UNITS = 1e12  # least number of units that a canvas has where sizes are no short decimals


@dataclass(frozen=True, slots=True)
class Scale:
    """Metres to integers: sizes that are short decimals become exact, so that ties are."""

    units: float  # a metre

    def of(self, metres: float) -> int:
        """Return a size in units, rounded."""
        return round(metres * self.units)

    def down(self, metres: float) -> int:
        """Return a lower bound in units."""
        return math.floor(metres * self.units + 1e-6)

    def up(self, metres: float) -> int:
        """Return an upper bound in units."""
        return math.ceil(metres * self.units - 1e-6)


def scale_of(direction: Direction) -> Scale:
    """Return the scale in which all sizes of a direction are whole, or fine enough.

    The ranges of unsized symbols are rounded outwards: there the scale has to be fine in any case,
    or what is worse within a unit would pass for as good.
    """
    fine = math.ceil(math.log10(UNITS / direction.canvas))
    first = max(0, fine) if any(r.size is None for r in direction.rules.values()) else 0
    sizes = [rule.size for rule in direction.rules.values() if rule.size is not None]
    for digits in range(first, max(MAX_DIGITS, first + 1)):
        scale = 10.0**digits
        if all(
            abs(size * scale - round(size * scale)) < 1e-7 for size in [*sizes, direction.canvas]
        ):
            return Scale(scale)
    return Scale(10.0 ** max(0, fine))
