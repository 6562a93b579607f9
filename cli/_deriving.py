"""The body of `facade derive`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.provenance import Provenance
from facade_tools.errors import InvalidInput
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.boxed import derived_building
from facade_tools.reconstruction.drawing import derived_scene
from facade_tools.reconstruction.engine import Derived, Lot, derive
from facade_tools.reconstruction.expressions import number
from facade_tools.reconstruction.library import Loaded, builtin_names, load
from facade_tools.reconstruction.records import derivation_of

from ._lots import Plot, plots
from ._models import Made, write_models
from ._stream import side_input

NAME = "derive"


def run_derive(grammar: str, output: str | None, seed: int, values: Mapping[str, Any]) -> None:
    """Derive all buildings and write them."""
    loaded = load(grammar)
    given = dict(map(_value, values["given"]))
    footprint = values["footprint"]
    sources = (
        *(side_input(grammar) if grammar not in builtin_names() else ()),
        *side_input(footprint),
    )
    recorded = {"grammar": Path(grammar).name, "set": given, "n": values["count"]}
    provenance = Provenance(NAME, seed, recorded, sources)
    grounds: list[Plot | None] = (
        [None] if footprint is None else list(plots(footprint, values["metres"]))
    )
    rows = _made(loaded, grounds, given, (seed, values["count"]), provenance)
    write_models(rows, output, values["tree"])


def _value(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        message = f"--set {text!r}: expected NAME=NUMBER"
        raise click.UsageError(message if equals else f"{message}, with a =") from None


def _made(
    loaded: Loaded,
    grounds: list[Plot | None],
    given: Mapping[str, float],
    draws: tuple[int, int],
    provenance: Provenance,
) -> Iterator[Made]:
    seed, count = draws
    for plot in grounds:
        for index in range(count):
            stem = f"{loaded.grammar.id}-{seed}" if plot is None else plot.id
            identity = stem if count == 1 else f"{stem}-{index}"
            yield _one(loaded, plot, identity, given, seed, provenance)


def _one(
    loaded: Loaded,
    plot: Plot | None,
    identity: str,
    given: Mapping[str, float],
    seed: int,
    provenance: Provenance,
) -> Made:
    rng = item_generator(seed, NAME, identity)
    grammar = loaded.grammar
    lots = [] if plot is None else [Lot(rings, height) for rings, height in plot.lots]
    frame = None if plot is None else plot.frame
    try:
        derived: Derived = derive(grammar, lots, rng=rng, given=given)
        storey = number(grammar.storey_height, derived.parameters, rng)
        building = derived_building(derived, identity, storey)
    except InvalidInput as error:
        raise loaded.located(error) from None
    return Made(
        replace(building, frame=frame, provenance=provenance),
        lambda: derived_scene(derived, identity),
        lambda: replace(
            derivation_of(derived, grammar, identity), frame=frame, provenance=provenance
        ),
        frame,
    )
