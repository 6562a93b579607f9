"""A candidate as the integer arrays that the compiled search reads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from .problem import Direction
from .words import Word

Integers = NDArray[np.int64]
MAX_DIGITS = 12
UNITS = 1e12  # least number of units that a canvas has where sizes are no short decimals


@dataclass(frozen=True, slots=True)
class Scale:
    """Metres to integers: sizes that are short decimals become exact, so that ties are."""

    units: float  # a metre

    def of(self, metres: float) -> int:
        """Return a size in units, rounded."""
        return round(metres * self.units)

    def down(self, metres: float) -> int:
        """Return a lower bound in units."""
        return math.floor(metres * self.units + 1e-6)

    def up(self, metres: float) -> int:
        """Return an upper bound in units."""
        return math.ceil(metres * self.units - 1e-6)

    def metres(self, units: int) -> float:
        """Return units in metres."""
        return float(units) / self.units


def scale_of(direction: Direction) -> Scale:
    """Return the scale in which all sizes of a direction are whole, or fine enough."""
    sizes = [rule.size for rule in direction.rules.values() if rule.size is not None]
    for digits in range(MAX_DIGITS):
        scale = 10.0**digits
        if all(
            abs(size * scale - round(size * scale)) < 1e-7 for size in [*sizes, direction.canvas]
        ):
            return Scale(scale)
    return Scale(10.0 ** max(0, math.ceil(math.log10(UNITS / direction.canvas))))


@dataclass(frozen=True, slots=True)
class Rows:
    """The flat arrays of a candidate; see kernels.search.

    layers[row] are the layers whose word the row is: equal words that hold nothing unoccludable
    are one row.
    """

    starts: Integers
    low: Integers
    high: Integers
    flags: Integers
    tally: Integers
    keys: NDArray[np.uint64]
    words: tuple[Word, ...]
    layers: tuple[tuple[int, ...], ...]


class RowMaker:
    """Makes rows of candidates of one direction; words seen before are looked up."""

    def __init__(self, direction: Direction) -> None:
        self.direction = direction
        self.scale = scale_of(direction)
        self.index = {name: i for i, name in enumerate(sorted(direction.rules))}
        self._flags: dict[Word, Integers] = {}

    def rows(
        self, words: Sequence[Word], box: Mapping[str, tuple[float, float]], merge: bool
    ) -> Rows:
        """Return the arrays of the words; `box` holds the range of every unsized symbol (m)."""
        grouped = self._grouped(words, merge)
        distinct = [words[layers[0]] for layers in grouped]
        starts = np.cumsum([0, *map(len, distinct)], dtype=np.int64)
        letters = [letter.symbol for word in distinct for letter in word]
        ranges = {name: self._range(name, box) for name in set(letters)}
        tally = np.zeros((len(letters), len(ranges)), np.int64)
        places = {name: i for i, name in enumerate(sorted(ranges))}
        tally[np.arange(len(letters)), [places[name] for name in letters]] = 1
        flags = [
            self.flags(word) + self._shift(start)
            for word, start in zip(distinct, starts, strict=False)
        ]
        return Rows(
            starts,
            np.array([ranges[name][0] for name in letters], np.int64),
            np.array([ranges[name][1] for name in letters], np.int64),
            np.concatenate(flags) if flags else np.zeros((0, 5), np.int64),
            tally,
            np.array([_key(name) for name in letters], np.uint64),
            tuple(distinct),
            tuple(map(tuple, grouped)),
        )

    def _grouped(self, words: Sequence[Word], merge: bool) -> list[list[int]]:
        groups: list[list[int]] = []
        known: dict[Word, list[int]] = {}
        for layer, word in enumerate(words):
            if merge and word in known:
                known[word].append(layer)
                continue
            groups.append([layer])
            if not any(self.direction.rules[a.symbol].unoccludable for a in word):
                known[word] = groups[-1]
        return groups

    def _range(self, name: str, box: Mapping[str, tuple[float, float]]) -> tuple[int, int]:
        size = self.direction.rules[name].size
        if size is not None:
            return self.scale.of(size), self.scale.of(size)
        return self.scale.down(box[name][0]), self.scale.up(box[name][1])

    def flags(self, word: Word) -> Integers:
        """Return the flags of a word's letters, run ends relative to the word."""
        if word not in self._flags:
            self._flags[word] = self._make_flags(word)
        return self._flags[word]

    def _make_flags(self, word: Word) -> Integers:
        out = np.zeros((len(word), 5), np.int64)
        end = len(word)
        for k in range(len(word) - 1, -1, -1):
            letter, rule = word[k], self.direction.rules[word[k].symbol]
            if k + 1 < len(word) and word[k + 1].transparent != letter.transparent:
                end = k + 1
            opaque = self.direction.is_opaque(letter)
            out[k] = letter.transparent, opaque, rule.unoccludable, rule.attached, end
        return out

    @staticmethod
    def _shift(start: np.int64) -> Integers:
        return np.array([0, 0, 0, 0, start], np.int64)


def _key(name: str) -> int:
    return int.from_bytes(blake2b(name.encode(), digest_size=8).digest(), "little")
