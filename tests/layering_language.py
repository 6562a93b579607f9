"""An independent, slow reading of the pattern language.

Words are read off the text of a pattern, as CONTRACT.md and the paper (3.2, 3.3) say; nothing here
is shared with the solver but the class of a letter.
"""

from __future__ import annotations

import itertools
import re
from typing import Any, NamedTuple

from layering_oracle import TooLarge

from facade_tools.layering.words import Letter

SETTINGS = ("pattern", "control", "reflection", "visible", "shapes")
TOKEN = re.compile(r"\s*(?:\{([^}]*)\}|([^\W\d_]\d*)|(\d+)|([|()^*+-]))")
MOST_WORDS = 300
MOST_TUPLES = 60


class Setting(NamedTuple):
    """What words depend on besides the text; sizes: the least of every symbol (m)."""

    counters: dict[str, int]
    sizes: dict[str, float]
    transparent: frozenset[str]
    limit: float
    reflection: str


def words_of_pattern(raw: Any, how: Setting) -> list[tuple[Letter, ...]]:
    """Return all words no wider than the limit of a pattern as a design writes it."""
    if isinstance(raw, str):
        return _Reader(raw, how, None).words()
    if "pattern" in raw:
        return _Reader(raw["pattern"], how, None).words()
    names = [key for key in raw if key not in SETTINGS]
    contents = [words_of_pattern(raw[name], how) or [None] for name in names]
    out = {}
    for picked in itertools.product(*contents):
        bound = {name: [] if w is None else [w] for name, w in zip(names, picked, strict=True)}
        out.update(dict.fromkeys(_Reader(raw["control"], how, bound).words()))
    return list(out)


class _Reader:
    """Reads a text and spells at the same time; `bound`: contents, None outside of controls."""

    def __init__(self, text, how, bound):
        self.tokens = [m.lastindex and (m.lastindex, m[m.lastindex]) for m in TOKEN.finditer(text)]
        self.how, self.bound, self.at = how, bound, 0

    def words(self):
        return list(dict.fromkeys(self.alternation()))

    def now(self):
        return self.tokens[self.at] if self.at < len(self.tokens) else (0, "")

    def take(self):
        self.at += 1
        return self.tokens[self.at - 1]

    def alternation(self):
        out = self.sequence()
        while self.now() == (4, "|"):
            self.take()
            out = out + self.sequence()
        return out

    def sequence(self):
        out = [()]
        while self.now()[0] in (1, 2) or self.now() == (4, "("):
            out = self.joined(out, self.power())
        return out

    def power(self):
        out = self.atom()
        while self.now() == (4, "^"):
            self.take()
            out = self.repeated(out, self.exponent())
        return out

    def atom(self):
        kind, name = self.take()
        if (kind, name) == (4, "("):
            out = self.alternation()
            self.take()
            return out
        if self.bound is not None and name in self.bound:
            return self.bound[name]
        clear = self.bound is not None or name in self.how.transparent
        return self.joined([()], [(Letter(name, False, clear),)])

    def joined(self, heads, tails):
        out = dict.fromkeys(
            head + tail for head in heads for tail in tails if self.size(head + tail)
        )
        if len(out) > MOST_WORDS:
            raise TooLarge
        return list(out)

    def size(self, word):
        return sum(self.how.sizes[a.symbol] for a in word) <= self.how.limit

    def repeated(self, base, count):
        if count < 0:
            base = [self.reflected(word) for word in base]
        out = [()]
        for _ in range(abs(count)):
            before, out = out, self.joined(out, base)
            if out == before:
                break
        return out

    def reflected(self, word):
        if self.how.reflection != "reverse":
            word = tuple(Letter(a.symbol, not a.mirrored, a.transparent) for a in word)
        return word if self.how.reflection == "mirror" else word[::-1]

    def exponent(self):
        """A number or counter, negative or not, or a sum of them and of multiples in brackets."""
        sign = self.sign()
        if self.now() != (4, "("):
            return sign * self.factor()
        self.take()
        total = self.sign() * self.term()
        while self.now() != (4, ")"):
            total += self.sign() * self.term()
        self.take()
        return sign * total

    def sign(self):
        if self.now() in ((4, "+"), (4, "-")):
            return 1 if self.take()[1] == "+" else -1
        return 1

    def term(self):
        value = self.factor()
        if self.now() == (4, "*"):
            self.take()
        return value * self.factor() if self.now()[0] in (1, 2) else value

    def factor(self):
        kind, text = self.take()
        return int(text) if kind == 3 else self.how.counters[text]


def names_of(raw: Any) -> set[str]:
    """Return the symbols and counters that stand in a pattern's texts."""
    if isinstance(raw, str):
        return {m[1] or m[2] for m in TOKEN.finditer(raw) if m[1] or m[2]}
    parts = [raw[key] for key in raw if key not in SETTINGS[2:]]
    return set().union(*map(names_of, parts))


class Reading:
    """The words of a design in one direction: of all layers, group by group, the topmost first.

    canvas (m), instead of the design's, may be less than what it was read for.
    """

    def __init__(self, raw: dict[str, Any], axis: str, canvas: float) -> None:
        self.raw, self.axis = raw, axis
        groups = {}
        for layer in raw["layers"]:
            name = layer.get("group", "default")
            name = name if isinstance(name, str) else name.get(axis, "default")
            groups.setdefault(name, []).append(raw["patterns"][layer[axis]])
        self.groups = groups
        self.rows = [row for rows in groups.values() for row in rows]
        self.parts = tuple(map(len, groups.values()))
        self._known = {}
        self.canvas = canvas

    def counters(self, rows):
        """Yield the values of the counters in some patterns, `auto` a little beyond its end."""
        sizes = [s["size"] for s in self.raw["symbols"].values() if "size" in s]
        most = int(1.4 * self.canvas / min(sizes)) + 8
        used = set().union(*map(names_of, rows)) & set(self.raw["counters"])
        ranges = []
        for name in sorted(used):
            value = self.raw["counters"][name]
            if value == "auto":
                value = {"min": 0, "max": most}
            if isinstance(value, int):
                value = {"min": value, "max": value}
            ranges.append(range(value["min"], value["max"] + 1))
        for values in itertools.product(*ranges):
            yield dict(zip(sorted(used), values, strict=True))

    def words(self, raw, counters):
        """Return the words of one pattern."""
        used = names_of(raw)
        own = {name: value for name, value in counters.items() if name in used}
        key = id(raw), tuple(own.items())
        if key not in self._known:
            symbols = self.raw["symbols"]
            least = 0.01 * self.canvas
            sizes = {name: symbols.get(name, {}).get("size", least) for name in used}
            clear = frozenset(n for n in used if symbols.get(n, {}).get("transparent"))
            mode = self.raw.get("reflection", "reverse-mirror")
            mode = raw.get("reflection", mode) if isinstance(raw, dict) else mode
            how = Setting(own, sizes, clear, 1.4 * self.canvas * (1 + 1e-9), mode)
            self._known[key] = words_of_pattern(raw, how)
        return self._known[key]

    def tuples(self, rows):
        """Return all tuples of one word a pattern, under the same counters, each once."""
        out = {}
        for counters in self.counters(rows):
            lists = [self.words(raw, counters) for raw in rows]
            for words in itertools.product(*lists):
                out[words] = None
                if len(out) > 20 * MOST_TUPLES:
                    raise TooLarge
        return list(out)
