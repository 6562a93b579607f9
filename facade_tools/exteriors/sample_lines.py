"""Samples as lines of JSON, whole columns at a time: the same bytes as one artifact at a time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from json import dumps
from typing import Any

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.documents import encode
from ..artifacts.model import Model
from ..artifacts.numbers import dump_line
from ..artifacts.provenance import Provenance
from .coordinates import Floats, columns_of
from .drawing import Block, SampleOptions, Source, annotated, block_ids, source_of, taken_blocks
from .physical import storey_heights

SLOT = "\x00"  # stands in a template where a row puts its own text; JSON escapes it
MARK = dumps(SLOT)
Template = tuple[str, ...]


def sample_lines(
    model: Model,
    n: int,
    *,
    rng: np.random.Generator,
    given: Attributes | None,
    options: SampleOptions,
    provenance: Provenance | None,
) -> Iterator[tuple[str, bytes]]:
    """Yield id and line of JSON of what `drawing.sample_attributes` yields, with a provenance."""
    source = source_of(model, given, options)
    for first, block in taken_blocks(source, n, rng=rng):
        if given is None:
            yield from lines(source, block, first, provenance)
        else:
            for row in annotated(source, block, first):
                yield row.id, dump_line(encode(replace(row, provenance=provenance)))


def lines(
    source: Source, block: Block, first: int, provenance: Provenance | None
) -> Iterator[tuple[str, bytes]]:
    """Yield id and line of each row of a block that nothing was given for."""
    if not len(block.style):
        return
    example = next(annotated(source, block.take(np.array([0])), first))
    document = encode(replace(example, provenance=provenance))
    columns = columns_of(block.readings, source.network.layout, source.options.groups)
    heights = storey_heights(
        block.readings.values, source.network.layout, source.model.storey_height
    )
    texts = _Texts(columns | {"storey_height": heights, "log_density": block.density})
    texts.add("id", [_text(i) for i in block_ids(source, block, first)])
    texts.add("style", list(map(str, block.style.tolist())))
    near = source.finder.nearest(block.readings) if source.options.neighbours else ()
    known = [_text(name) for name in source.finder.ids]
    for name, index, _ in near:
        if index[0] >= 0:  # a group without training rows has no neighbour in any row
            texts.add(f"neighbours/{name}", [known[i] for i in index.tolist()])
    for name, bits in zip(source.network.layout.bits, block.readings.bits.T, strict=True):
        texts.add(name.replace(".", "/"), list(map(str, bits.tolist())))
    template, slots = _template(document, texts.cells)
    text = template.__mod__
    for identity, row in zip(
        block_ids(source, block, first),
        zip(*(texts.cells[slot] for slot in slots), strict=True),
        strict=True,
    ):
        yield identity, text(row).encode()


class _Texts:
    """JSON texts of all cells, a list of rows for each place in the document."""

    def __init__(self, columns: Mapping[str, Floats]) -> None:
        """Take columns (n, …); a column (n, 2) has the places name/0 and name/1."""
        flat = {
            "/".join((name, *map(str, index))): column[(slice(None), *index)]
            for name, column in columns.items()
            for index in np.ndindex(column.shape[1:])
        }
        table = np.stack(list(flat.values()), axis=1)
        self.cells: dict[str, Sequence[str]] = dict(zip(flat, number_texts(table), strict=True))

    def add(self, place: str, texts: list[str]) -> None:
        """Take the texts of one more place."""
        self.cells[place] = texts


def number_texts(table: Floats) -> list[list[str]]:
    """Return the canonical JSON of a table (n, m) of finite numbers, one list a column.

    >>> number_texts(np.array([[0.1 + 0.2, -0.0, 2.0, 1e-5]]))
    [['0.3'], ['0.0'], ['2.0'], ['1e-05']]
    """
    if not np.isfinite(table).all():
        raise ValueError("NaN or infinity cannot be written as JSON")
    cells = (table.T.ravel() + 0.0).tolist()
    texts = ("%.12g " * len(cells) % tuple(cells)).split()
    whole = [t if "." in t or "e" in t else t + ".0" for t in texts]
    return [whole[at : at + len(table)] for at in range(0, len(cells), max(len(table), 1))]


def _text(value: str) -> str:
    return dumps(value, ensure_ascii=False)


def _template(document: Any, cells: Mapping[str, Sequence[str]]) -> tuple[str, list[str]]:
    """Return a document as a % template, and the places of its slots in order."""
    slots: list[str] = []

    def opened(value: Any, path: str) -> Any:
        if isinstance(value, dict):
            return {key: opened(item, f"{path}/{key}") for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [opened(item, f"{path}/{i}") for i, item in enumerate(value)]
        place = _place(path, cells)
        if place is None:
            return value
        slots.append(place)
        return SLOT

    text = dump_line(opened(document, "")).decode()
    return text.replace("%", "%%").replace(MARK, "%s"), slots


def _place(path: str, cells: Mapping[str, Sequence[str]]) -> str | None:
    """Return the place whose cells belong at a path of the document, None where all agree."""
    parts = path.split("/")[1:]
    if parts[0] in ("mass", "facade", "element", "sample", "tags"):
        parts = parts[1:]
    place = "/".join(parts)
    return place if place in cells else None
