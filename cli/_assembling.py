"""The body of `facade assemble`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

import click

from facade_tools.artifacts.building import SIDES, Box, Building, Roof, RoofStyle, Side
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.footprint import Footprint
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import RawItem, digest, read_raw
from facade_tools.errors import InvalidInput
from facade_tools.formats.geojson import building_of
from facade_tools.reconstruction.assemble import Assembly, assemble
from facade_tools.reconstruction.sides import SideView, view_of_labels, view_of_parse
from facade_tools.segmentation.conventions import Convention, convention

from ._lots import artifacts_of, by_id, ground_of
from ._options import StreamOptions
from ._report import collected_log
from ._stream import ItemResult, open_sink, run_items, side_input

NAME = "assemble"
SIZE = re.compile(r"(\d+(?:\.\d+)?)[x×](\d+(?:\.\d+)?)")
SIDE_LIMITS = (2.0, 1000.0)  # m
RECORDED = ("side", "roof", "storey_height", "windows", "no_door")
CLASSES = "ecp"
PITCH = 35.0  # degrees of a roof whose pitch nobody says

Item = RawItem | str  # of a stream of artifacts, or the path of a label map


@dataclass(frozen=True)
class Seen:
    """A view with file, line, name and digest of what it was read from."""

    id: str
    view: SideView
    source: Source
    place: tuple[str, int | None]


@dataclass(frozen=True)
class Assemble:
    """Makes a building of one view in any process. masses: what stands on footprints, by id."""

    known: Assembly
    masses: Mapping[str, Building]
    side: Side
    classes: Convention
    recorded: Mapping[str, Any]
    sources: tuple[Source, ...]
    indented: bool

    def __call__(self, item: Item) -> ItemResult:
        """Return the building of one view."""
        with collected_log() as messages:
            seen = _seen(item, self.classes)
            return ItemResult((self.made({self.side: seen}),), messages)

    def made(self, seen: Mapping[Side, Seen]) -> tuple[str, bytes]:
        """Return id and bytes of the building that the views show, named after the first."""
        first = next(iter(seen.values()))
        identity = first.id
        try:
            mass = ground_of(self.masses, identity)
        except InvalidInput as error:
            raise error.at(*first.place) from None
        views = {side: one.view for side, one in seen.items()}
        inputs = (*(one.source for one in seen.values()), *self.sources)
        building = assemble(identity, views, replace(self.known, mass=mass))
        provenance = Provenance(NAME, None, self.recorded, inputs)
        document = encode(replace(building, provenance=provenance))
        return identity, dump_document(document) if self.indented else dump_line(document)


def run_assemble(stream: StreamOptions, values: Mapping[str, Any]) -> None:
    """Make one building of the named sides, or one of every parse."""
    given = {side: values[side] for side in SIDES if values[side] is not None}
    if bool(given) == bool(stream.inputs):
        raise click.UsageError("name parses, or sides with --front, --back, --left, --right")
    footprint = values["footprint"]
    if footprint is not None and values["depth"] is not None:
        raise click.UsageError("a footprint has its depth; expected --footprint or --depth")
    masses = {} if footprint is None else _masses(footprint, values["metres"])
    measured = footprint if footprint and SIZE.fullmatch(footprint) else None
    recorded = {key: values[key] for key in RECORDED} | _told(values, measured)
    stage = Assemble(
        Assembly(
            storey=values["storey_height"],
            roof=None if values["roof"] is None else _roof(values["roof"]),
            style=values["windows"],
            door=not values["no_door"],
            depth=values["depth"],
            porch=not values["no_porch"],
        ),
        masses,
        values["side"],
        convention(values["classes"]),
        recorded,
        side_input(None if measured else footprint),
        stream.output is not None and stream.output.lower().endswith(".json"),
    )
    if not given:
        run_items(NAME, stage, _items(stream.inputs), stream)
        return
    with open_sink(stream.output) as write:
        write(*stage.made({side: _only(path, stage.classes) for side, path in given.items()}))


def _told(values: Mapping[str, Any], measured: str | None) -> dict[str, Any]:
    """Return the options that are recorded only where they are given."""
    classes = Path(values["classes"]).name
    given = {
        "footprint": measured, "metres": values["metres"], "depth": values["depth"],
        "no_porch": values["no_porch"],
        "classes": None if classes == CLASSES else classes,
    }  # fmt: skip
    return {name: value for name, value in given.items() if value}


def _items(paths: tuple[str, ...]) -> Iterator[Item]:
    for path in paths:
        maps = sorted(Path(path).glob("*.png")) if Path(path).is_dir() else []
        if maps:
            yield from map(str, maps)
        elif path.lower().endswith(".png"):
            yield path
        else:
            yield from read_raw([path])


def _only(path: str, classes: Convention) -> Seen:
    items = list(_items((path,)))
    if len(items) != 1:
        raise InvalidInput(f"holds {len(items)} parses; expected one").at(path)
    return _seen(items[0], classes)


def _seen(item: Item, classes: Convention) -> Seen:
    if isinstance(item, str):
        source = digest(item)
        try:
            return Seen(Path(item).stem, view_of_labels(classes.read(item)), source, (item, None))
        except InvalidInput as error:
            raise error.at(item) from None
    parse = item.artifact("parse")
    try:
        place = (item.source, item.line)
        return Seen(parse.id, view_of_parse(parse), item.provenance(), place)
    except InvalidInput as error:
        raise error.at(item.source, item.line) from None


def _masses(text: str, metres: bool) -> dict[str, Building]:
    """Return the masses that footprints give, by id; boxes of unknown height have none."""
    sizes = SIZE.fullmatch(text)
    if sizes:
        width, depth = float(sizes[1]), float(sizes[2])
        if not all(SIDE_LIMITS[0] <= side <= SIDE_LIMITS[1] for side in (width, depth)):
            raise click.UsageError(f"--footprint {text}: expected 2 to 1000 m a side")
        box = Box("main", "general", width / 2, depth / 2, width, depth)
        return {"footprint": Building("footprint", (box,), partial=True)}
    return by_id(map(_mass, artifacts_of(text, metres)), text)


def _mass(artifact: Footprint | Building) -> Building:
    if isinstance(artifact, Building):
        return replace(artifact, facades={})
    mass = building_of(artifact)
    return mass if artifact.roof else _without_roofs(mass)


def _without_roofs(mass: Building) -> Building:
    boxes = tuple(replace(box, roof=None) for box in mass.boxes)
    return replace(mass, boxes=boxes, complete=("mass",))


def _roof(text: str) -> Roof:
    style, pitch, direction, *rest = [*text.split(":"), "", ""][:3] + text.split(":")[3:]
    styles = get_args(RoofStyle)
    try:
        degrees = float(pitch) if pitch else (0.0 if style == "flat" else PITCH)
    except ValueError:
        degrees = -1.0
    if style not in styles or not 0 <= degrees < 80 or direction not in ("", "x", "y") or rest:
        message = f"--roof {text!r}: expected STYLE[:PITCH[:x|y]], STYLE one of {', '.join(styles)}"
        raise click.UsageError(message)
    return Roof(style, degrees, "y" if direction == "y" else "x")  # type: ignore[arg-type]
