"""Sample houses for the tests of facadegen, with and without their facades."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from facade_tools.artifacts.building import Building
from facade_tools.artifacts.store import read
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.exteriors.facadegen import FacadeOptions, generate_facades

ROOT = Path(__file__).parent.parent
HOUSES = ROOT / "sample_data" / "houses"


def sample(style: str, number: int = 0) -> Building:
    return list(read([str(HOUSES / f"{style}.jsonl")], "building"))[number]


def bare(building: Building) -> Building:
    """The mass of a house with its own attributes as targets."""
    targets = building_attributes(building)
    return replace(building, facades={}, targets=targets, colors=None, energy=None)


def made(building: Building, seed: int = 0, **options) -> list[Building]:
    rng = np.random.default_rng(seed)
    return list(generate_facades(building, FacadeOptions(**options), rng=rng))


def elements(building: Building):
    return [
        (side, piece, element)
        for side, facade in building.facades.items()
        for piece in facade.pieces
        for element in piece.elements
    ]
