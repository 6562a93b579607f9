"""What learn and sample read: attributes, or buildings turned into them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import digest, read_all, read_one
from facade_tools.errors import InvalidInput

from ._report import Progress
from ._stream import open_sink

if TYPE_CHECKING:
    from facade_tools.artifacts.attributes import Attributes
    from facade_tools.artifacts.model import Model


def read_attributes(paths: Sequence[str]) -> tuple[list[Attributes], tuple[Source, ...]]:
    """Return the attribute vectors of mixed streams of buildings and attributes.

    Raises InvalidInput on ids that stand twice.
    """
    from facade_tools.exteriors.attributes import building_attributes

    artifacts, sources = read_all(paths, "attributes", "building")
    rows = [building_attributes(a) if a.kind == "building" else a for a in artifacts]
    seen: set[str] = set()
    for row in rows:
        if row.id in seen:
            raise InvalidInput(f"id {row.id!r} stands twice; expected unique ids")
        seen.add(row.id)
    return rows, sources


def load_model(path: str) -> tuple[Model, Source]:
    """Return a model and its provenance; raises InvalidInput where it is no sound model."""
    from facade_tools.exteriors.serialisation import network_of

    model = read_one(path, "model")
    try:
        network_of(model)
    except InvalidInput as error:
        raise error.at(path) from None
    return model, digest(path)


def write_samples(
    rows: Iterable[Attributes],
    output: str | None,
    seed: int,
    options: Mapping[str, Any],
    sources: tuple[Source, ...],
) -> None:
    """Write samples as a stream, each with its provenance."""
    provenance = Provenance("sample", seed, options, sources)
    progress = Progress("sample")
    with open_sink(output) as write:
        for row in rows:
            write(row.id, dump_line(encode(replace(row, provenance=provenance))))
            progress.advance()
    progress.close()
