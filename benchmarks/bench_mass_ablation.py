"""Leave-one-out ablation of the seven mass attributes (FW16 Fig. 9), with a picture.

    python benchmarks/bench_mass_ablation.py [-o ablation.png] [--per-style 3]

For each attribute the masses are generated without it; the table shows how far the result is
from the building that the attributes were taken from. The picture shows one building a row:
the original, all seven attributes, then without each of them.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from bench_massgen import footprint_iou, unseen_houses

from facade_tools.artifacts.building import Building
from facade_tools.exteriors.attributes import (
    attribute_vector,
    attributes_of_vector,
    building_attributes,
)
from facade_tools.exteriors.mass_energy import GROUPS, mass_energy, target_of
from facade_tools.exteriors.massgen import generate_mass
from facade_tools.formats.png import write as write_png
from facade_tools.geometry.details import building_sketch
from facade_tools.imaging.camera import View
from facade_tools.imaging.contact_sheet import contact_sheet
from facade_tools.imaging.render import render
from facade_tools.randomness import item_generator

SHOWN = ("victorian", "ranch_l", "split_garage", "colonial")


def generated_without(house: Building, group: str | None) -> Building:
    """Generate from the house's attributes, one group unknown."""
    attributes = building_attributes(house)
    vector = attribute_vector(attributes)
    if group is not None:
        vector[GROUPS[group]] = np.nan
    free = attributes_of_vector(house.id, vector, attributes.storey_height)
    rng = item_generator(3, house.id, group or "all")
    return next(iter(generate_mass(replace(free, element=attributes.element), rng=rng)))


def row(houses: Sequence[Building], group: str | None) -> tuple[list[Building], str]:
    made = [generated_without(house, group) for house in houses]
    pairs = list(zip(houses, made, strict=True))
    own = [mass_energy(b.boxes, target_of(building_attributes(h)))[0] for h, b in pairs]
    iou = [footprint_iou(h, b) for h, b in pairs]
    boxes = np.mean([len(b.boxes) for b in made])
    name = "all seven" if group is None else f"without {group}"
    mean = f"{np.mean(own):12.2g}{np.median(own):12.2g}"
    return made, f"{name:18s}{mean}{np.mean(iou):10.3f}{boxes:8.2f}"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("-o", "--output", default="build/mass-ablation.png")
    parser.add_argument("--per-style", type=int, default=3)
    options = parser.parse_args()
    houses = unseen_houses(options.per_style)
    shown = [next(h for h in houses if h.id.startswith(style)) for style in SHOWN]
    columns = [houses]
    print("energy of all seven attributes that the result reaches, footprint IoU, boxes")
    print(f"{'':18s}{'mean E':>12s}{'median E':>12s}{'IoU':>10s}{'boxes':>8s}")
    for group in (None, *GROUPS):
        made, line = row(houses, group)
        columns.append(made)
        print(line)
    view = View(-30.0, 12.0, (240, 180))
    pictures, labels = [], []
    for house in shown:
        k = houses.index(house)
        for name, column in zip(("original", "all seven", *GROUPS), columns, strict=True):
            bare = replace(column[k], facades={})
            pictures.append(render(building_sketch(bare), view))
            labels.append(name if name in ("original", "all seven") else f"without {name}")
    output = Path(options.output)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_bytes(write_png(contact_sheet(pictures, labels, len(columns))))


if __name__ == "__main__":
    main()
