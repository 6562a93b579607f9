"""What is solved in one direction: layers with patterns, symbols, counters, the canvas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from .language import Node, counters_of
from .lattice import Lattice
from .words import Letter, Reflection, Word

TOLERANCES = (0.02, 0.05, 0.1, 0.2, 0.4)  # of the canvas, in the order in which they are tried
SLACK = 1e-9  # of the canvas: what every comparison with a tolerance or the canvas allows
LEAST_UNSIZED = 0.01  # of the canvas
LEAST_SIZE = 0.01  # of the preferred size


@dataclass(frozen=True, slots=True)
class Rule:
    """A symbol's preferred size (m, None where unsized) and its alignment qualifiers."""

    size: float | None = None
    opaque: bool = True
    attached: bool = False
    unoccludable: bool = False
    transparent: bool = False


@dataclass(frozen=True, slots=True)
class LayerPattern:
    """One layer's pattern in one direction; `pattern` is the name that the user gave it."""

    layer: str
    pattern: str
    node: Node
    reflection: Reflection = "reverse-mirror"


@dataclass(frozen=True, slots=True)
class Direction:
    """All that one direction is solved from.

    canvas: its length (m). groups: alignment group -> its layers, the topmost first.
    counters: name -> its value, or the least and greatest that the solver may choose.
    """

    axis: str
    canvas: float
    rules: Mapping[str, Rule]
    groups: Mapping[str, tuple[LayerPattern, ...]]
    counters: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def least_sizes(self) -> dict[str, float]:
        """Return the least size of every symbol (m) for fitting words."""
        least = LEAST_UNSIZED * self.canvas
        return {
            name: least if rule.size is None else rule.size for name, rule in self.rules.items()
        }

    def counters_of(self, group: str) -> set[str]:
        """Return the counters of a group that the solver chooses."""
        used = set[str]().union(*(counters_of(row.node) for row in self.groups[group]))
        return {name for name in used if self.counters[name][0] != self.counters[name][1]}

    def opaque_size(self, word: Word) -> float:
        """Return the summed size (m) of a word's opaque letters."""
        return sum(self.rules[a.symbol].size or 0.0 for a in word if self.is_opaque(a))

    def is_opaque(self, letter: Letter) -> bool:
        """Tell whether a letter covers its cell; transparent letters never do."""
        return self.rules[letter.symbol].opaque and not letter.transparent


@dataclass(frozen=True, slots=True)
class Candidate:
    """One word a layer, the topmost first, and the counters that made them (IMAW15 5.1).

    lattices: what each layer may have instead of its word, words with the same letters.
    unsized: ranges of the unsized symbols' sizes (m) that eq. 7 leaves, a bounding box.
    parts: numbers of layers of the alignment groups that stand in it one after another.
    """

    words: tuple[Word, ...]
    counters: tuple[tuple[str, int], ...] = ()
    unsized: tuple[tuple[str, float, float], ...] = ()
    parts: tuple[int, ...] = ()
    lattices: tuple[Lattice, ...] = ()

    def split(self) -> list[tuple[int, int]]:
        """Return first and end layer of every group."""
        ends = [sum(self.parts[: i + 1]) for i in range(len(self.parts))]
        return list(zip([0, *ends], ends, strict=False))


@dataclass(frozen=True, slots=True)
class Span:
    """A row's border: letters consumed, and whether it lies inside the next letter."""

    letters: int
    inside: bool = False


@dataclass(frozen=True, slots=True)
class Alignment:
    """A partition of every word into as many substrings as there are columns (IMAW15 5.2).

    borders[column][row], from the start (all zero) to the end; of several groups, the columns of
    one come before those of the next. omega: the alignment error Ω, sigma: the sum of column
    sizes (m). sizes: of the unsized symbols (m).
    """

    candidate: Candidate
    borders: tuple[tuple[Span, ...], ...]
    omega: float
    sigma: float
    pieces: int
    tolerance: float
    sizes: tuple[tuple[str, float], ...] = ()

    def part(self, index: int) -> Alignment:
        """Return the alignment of one of its groups; Ω and Σ stay those of the whole."""
        first, end = self.candidate.split()[index]
        candidate = replace(
            self.candidate,
            words=self.candidate.words[first:end],
            lattices=self.candidate.lattices[first:end],
            parts=(end - first,),
        )
        lines = dict.fromkeys(line[first:end] for line in self.borders)
        return replace(self, candidate=candidate, borders=tuple(lines))

    @property
    def count(self) -> int:
        """Return the number of columns."""
        return len(self.borders) - 1

    def letters(self, row: int, column: int) -> tuple[int, int]:
        """Return first and end letter that a row has in a column, whole or in pieces."""
        start, end = self.borders[column][row], self.borders[column + 1][row]
        return start.letters, end.letters + int(end.inside)

    def column(self, row: int, column: int) -> Word:
        """Return the letters that a row has in a column; none is ε."""
        first, end = self.letters(row, column)
        return self.candidate.words[row][first:end]
