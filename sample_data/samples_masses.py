"""The twelve house styles and the rule that makes the mass of each."""

from __future__ import annotations

from collections.abc import Callable

import samples_low as low
import samples_tall as tall
from samples_draw import Draw, Mass

STYLES: dict[str, Callable[[Draw], Mass]] = {
    "bungalow": low.bungalow,
    "ranch_l": low.ranch_l,
    "cape": low.cape,
    "craftsman": low.craftsman,
    "two_storey_gable": tall.two_storey_gable,
    "hip_porches": tall.hip_porches,
    "townhouse": tall.townhouse,
    "victorian": tall.victorian,
    "modern_flat": low.modern_flat,
    "colonial": tall.colonial,
    "farmhouse": tall.farmhouse,
    "split_garage": low.split_garage,
}
