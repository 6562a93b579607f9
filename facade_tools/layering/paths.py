"""From the codes of the compiled search to words and borders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import kernels_labels
from .evaluation import Borders
from .problem import Span
from .rows import Rows
from .words import Word


@dataclass(frozen=True, slots=True)
class Path:
    """What a search has found for one group: the word of every layer, and the borders."""

    words: tuple[Word, ...]
    borders: Borders


def decoded(rows: Rows, codes: Any) -> Path:
    """Return the words and borders that the search's codes (columns + 1, rows) stand for."""
    owner = {layer: row for row, layers in enumerate(rows.layers) for layer in layers}
    depths = rows.places[codes >> 2, kernels_labels.DEPTH].tolist()
    spans = [[Span(depth >> 1, bool(depth & 1)) for depth in line] for line in depths]
    words = [_word_of(rows, codes, row) for row in range(len(rows.lattices))]
    layers = sorted(owner)
    return Path(
        tuple(words[owner[layer]] for layer in layers),
        tuple(tuple(line[owner[layer]] for layer in layers) for line in spans),
    )


def _word_of(rows: Rows, codes: Any, row: int) -> Word:
    lattice = rows.lattices[row]
    if lattice.single:
        return lattice.word
    offset = sum(len(other.edges) for other in rows.lattices[:row])
    edges = kernels_labels.spelt(
        np.arange(len(codes)), row, codes, rows.places, rows.first, rows.steps, rows.spelling
    )
    return tuple(lattice.edges[edge - offset].letter for edge in edges)


def joined_borders(parts: list[Borders]) -> Borders:
    """Put the columns of groups one after another: the rows of the others stand still."""
    ends = [part[-1] for part in parts]
    begins = [part[0] for part in parts]
    out: list[tuple[Span, ...]] = []
    for i, part in enumerate(parts):
        head = [span for end in ends[:i] for span in end]
        tail = [span for begin in begins[i + 1 :] for span in begin]
        out += [(*head, *line, *tail) for line in (part if i == 0 else part[1:])]
    return tuple(out)
