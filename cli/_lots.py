"""Files of grounds for derive, reconstruct and assemble: GeoJSON, footprints, buildings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TypeVar

from facade_tools.artifacts.building import Building
from facade_tools.artifacts.footprint import Footprint
from facade_tools.artifacts.store import RawItem, read_raw
from facade_tools.errors import InvalidInput
from facade_tools.formats.importing import built, items
from facade_tools.formats.osm import states_height
from facade_tools.formats.reading import ReadOptions
from facade_tools.reconstruction.lots import Plot, plot_of

GEOJSON = (".geojson", ".geojsonl")
NAMED = 5  # ids of a file that an error lists

G = TypeVar("G", Plot, Building)


def plots(path: str, metres: bool = False) -> Iterator[Plot]:
    """Yield the plots of a file. Raises InvalidInput where it holds none."""
    for ground in grounds(path, metres):
        yield ground.taken()


@dataclass(frozen=True)
class Ground:
    """A plot, or why it is none."""

    plot: Plot | None = None
    error: InvalidInput | None = None

    def taken(self) -> Plot:
        """Return the plot; raises the error."""
        if self.error is not None:
            raise self.error
        assert self.plot is not None
        return self.plot


def grounds(path: str, metres: bool = False) -> Iterator[Ground]:
    """Yield the plots of a file and, in their places, what is wrong with the bad ones.

    Raises InvalidInput where it holds none.
    """
    found = False
    for artifact in _records(path, metres):
        found = True
        try:
            yield Ground(_plot(artifact))
        except InvalidInput as error:
            yield Ground(error=error.at(path))
    if not found:
        raise InvalidInput("holds no polygon of a building").at(path)


def by_id(found: Iterable[G], path: str) -> dict[str, G]:
    """Return what stands in a file of grounds by its ids.

    Raises InvalidInput where it holds none, and where two have one id.
    """
    out: dict[str, G] = {}
    for ground in found:
        if ground.id in out:
            raise InvalidInput(f"two footprints have the id {ground.id!r}; expected one").at(path)
        out[ground.id] = ground
    if not out:
        raise InvalidInput("holds no footprint; expected at least one").at(path)
    return out


def ground_of(grounds: Mapping[str, G], identity: str) -> G | None:
    """Return what a parse stands on: the only ground, of several the one with the parse's id.

    None where there are no grounds. Raises InvalidInput where none of several has that id.
    """
    if len(grounds) < 2:
        return next(iter(grounds.values()), None)
    if identity not in grounds:
        names = ", ".join(map(repr, islice(grounds, NAMED)))
        more = ", …" if len(grounds) > NAMED else ""
        message = f"none of {len(grounds)} footprints has the parse's id {identity!r}"
        raise InvalidInput(f"{message}; expected it among {names}{more}")
    return grounds[identity]


def _plot(artifact: Footprint | Building | RawItem | InvalidInput) -> Plot:
    if isinstance(artifact, InvalidInput):
        raise artifact
    if isinstance(artifact, RawItem):
        return plot_of(artifact.artifact(Footprint, Building))
    return plot_of(artifact)


def artifacts_of(path: str, metres: bool) -> Iterator[Footprint | Building]:
    """Yield the footprints and buildings of a file, GeoJSON or artifacts.

    The height of a footprint is 0 where its map states none.
    """
    for record in _records(path, metres):
        if isinstance(record, InvalidInput):
            raise record
        yield (record.artifact(Footprint, Building) if isinstance(record, RawItem) else record)


def _records(path: str, metres: bool) -> Iterator[Footprint | RawItem | InvalidInput]:
    if Path(path).suffix.lower() not in GEOJSON and not _is_geojson(path):
        yield from read_raw([path])
        return
    options = ReadOptions(kind="footprints", metres=metres)
    for item in items([path], options):
        try:
            found = built(item, options).artifacts
        except InvalidInput as error:
            yield error
            continue
        yield from (_stated(row) for row in found if isinstance(row, Footprint))


def _stated(artifact: Footprint) -> Footprint:
    """Return a footprint of a map with the height 0 where the map states none."""
    return artifact if states_height(artifact.tags) else replace(artifact, height=0.0)


def _is_geojson(path: str) -> bool:
    try:
        with Path(path).open("rb") as file:
            head = file.read(4096)
    except OSError:
        return False
    return b'"Feature' in head and b"facade-tools/" not in head
