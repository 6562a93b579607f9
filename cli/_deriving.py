"""The body of `facade derive`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.provenance import Provenance
from facade_tools.errors import InvalidInput
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.boxed import derived_building
from facade_tools.reconstruction.drawing import derived_scene
from facade_tools.reconstruction.engine import derive
from facade_tools.reconstruction.expressions import number
from facade_tools.reconstruction.library import Loaded, builtin_names, load
from facade_tools.reconstruction.records import derivation_of

from ._items import each
from ._lots import Ground, grounds
from ._models import Made, Wanted, wanted, write_models
from ._options import StreamOptions, finite, refuse_overwriting
from ._stream import Faults, refuse_single, side_input

NAME = "derive"


def run_derive(grammar: str, stream: StreamOptions, values: Mapping[str, Any]) -> None:
    """Derive all buildings and write them."""
    footprint, given = values["footprint"], dict(map(_value, values["given"]))
    outputs = (stream.output, values["tree"])
    for output in outputs:
        refuse_single(output, values["count"], "buildings")
    refuse_overwriting([grammar, footprint], outputs)
    loaded = load(grammar)
    sources = (
        *(side_input(grammar) if grammar not in builtin_names() else ()),
        *(side_input(footprint) if footprint != "-" else ()),
    )
    recorded = {"grammar": Path(grammar).name, "set": given, "n": values["count"]}
    if footprint is not None:
        recorded["metres"] = values["metres"]
    seed = stream.seed or 0
    provenance = Provenance(NAME, seed, recorded, sources)
    made = wanted(stream.output, values["tree"])
    maker = Maker(loaded, given, seed, provenance, made)
    tasks = _tasks(maker, values)
    faults = Faults(NAME, stream.on_error)
    write_models(each(maker, stream, faults, tasks), (stream.output, values["tree"]), faults)
    faults.complain()


def _value(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name.strip(), finite(value)
    except ValueError:
        raise click.UsageError(f"--set {text!r}: expected NAME=NUMBER") from None


@dataclass(frozen=True)
class Task:
    """A building to derive: its id, and the ground that it stands on unless it is the lot."""

    id: str
    ground: Ground | None


@dataclass(frozen=True)
class Maker:
    """Derives buildings in any process, each with a generator of its own."""

    loaded: Loaded
    given: Mapping[str, float]
    seed: int
    provenance: Provenance
    wanted: Wanted

    def __call__(self, task: Task) -> Made:
        """Return what is wanted of one building; raises InvalidInput with the rule's line."""
        plot = None if task.ground is None else task.ground.taken()
        grammar, rng = self.loaded.grammar, item_generator(self.seed, NAME, task.id)
        lots = () if plot is None else plot.lots
        frame = None if plot is None else plot.frame
        building = scene = tree = None
        try:
            derived = derive(grammar, lots, rng=rng, given=self.given)
            if self.wanted.building:
                storey = number(grammar.storey_height, derived.parameters, rng)
                building = derived_building(derived, task.id, storey)
                building = replace(building, frame=frame, provenance=self.provenance)
            if self.wanted.scene:
                scene = derived_scene(derived, task.id)
            if self.wanted.tree:
                tree = derivation_of(derived, grammar, task.id)
                tree = replace(tree, frame=frame, provenance=self.provenance)
        except InvalidInput as error:
            raise self.loaded.located(error) from None
        return Made(task.id, building, scene, tree, frame)


def _tasks(maker: Maker, values: Mapping[str, Any]) -> Iterator[Task]:
    """Yield every building of every ground; a ground that is none once, for its error."""
    path, count = values["footprint"], values["count"]
    found: Iterable[Ground | None] = [None] if path is None else grounds(path, values["metres"])
    for ground in found:
        if ground is not None and ground.plot is None:
            yield Task("", ground)
            continue
        lot = f"{maker.loaded.grammar.id}-{maker.seed}"
        stem = lot if ground is None else ground.taken().id
        for index in range(count):
            yield Task(stem if count == 1 else f"{stem}-{index}", ground)
