"""The body of `facade derive`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.provenance import Provenance
from facade_tools.errors import InvalidInput
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.boxed import derived_building
from facade_tools.reconstruction.drawing import derived_scene
from facade_tools.reconstruction.engine import Lot, derive
from facade_tools.reconstruction.expressions import number
from facade_tools.reconstruction.library import Loaded, builtin_names, load
from facade_tools.reconstruction.records import derivation_of

from ._lots import Plot, plots
from ._models import Made, Wanted, wanted, write_models
from ._stream import side_input

NAME = "derive"


def run_derive(grammar: str, output: str | None, seed: int, values: Mapping[str, Any]) -> None:
    """Derive all buildings and write them."""
    footprint, given = values["footprint"], dict(map(_value, values["given"]))
    sources = (
        *(side_input(grammar) if grammar not in builtin_names() else ()),
        *side_input(footprint),
    )
    recorded = {"grammar": Path(grammar).name, "set": given, "n": values["count"]}
    if footprint is not None:
        recorded["metres"] = values["metres"]
    provenance = Provenance(NAME, seed, recorded, sources)
    maker = _Maker(load(grammar), given, seed, provenance, wanted(output, values["tree"]))
    grounds: list[Plot | None] = [None]
    if footprint is not None:
        grounds = list(plots(footprint, values["metres"]))
    write_models(maker.all(grounds, values["count"]), output, values["tree"])


def _value(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise click.UsageError(f"--set {text!r}: expected NAME=NUMBER") from None


@dataclass(frozen=True)
class _Maker:
    """Derives buildings, each with a generator of its own."""

    loaded: Loaded
    given: Mapping[str, float]
    seed: int
    provenance: Provenance
    wanted: Wanted

    def all(self, grounds: list[Plot | None], count: int) -> Iterator[Made]:
        for plot in grounds:
            stem = f"{self.loaded.grammar.id}-{self.seed}" if plot is None else plot.id
            for index in range(count):
                yield self.one(plot, stem if count == 1 else f"{stem}-{index}")

    def one(self, plot: Plot | None, identity: str) -> Made:
        grammar, rng = self.loaded.grammar, item_generator(self.seed, NAME, identity)
        lots = [] if plot is None else [Lot(rings, height) for rings, height in plot.lots]
        frame = None if plot is None else plot.frame
        building = scene = tree = None
        try:
            derived = derive(grammar, lots, rng=rng, given=self.given)
            if self.wanted.building:
                storey = number(grammar.storey_height, derived.parameters, rng)
                building = derived_building(derived, identity, storey)
                building = replace(building, frame=frame, provenance=self.provenance)
            if self.wanted.scene:
                scene = derived_scene(derived, identity)
            if self.wanted.tree:
                tree = derivation_of(derived, grammar, identity)
                tree = replace(tree, frame=frame, provenance=self.provenance)
        except InvalidInput as error:
            raise self.loaded.located(error) from None
        return Made(identity, building, scene, tree, frame)
