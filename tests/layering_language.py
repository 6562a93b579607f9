"""An independent, slow reading of the pattern language, and random designs that use all of it.

Words are read off the text of a pattern, as CONTRACT.md and the paper (3.2, 3.3) say; nothing here
is shared with the solver but the class of a letter.
"""

from __future__ import annotations

import itertools
import random
import re
from typing import Any, NamedTuple

from layering_oracle import TooLarge, admitted

from facade_tools.artifacts.codec import from_json
from facade_tools.artifacts.design import Design
from facade_tools.layering.solve import components
from facade_tools.layering.stack import stack_of
from facade_tools.layering.words import Letter

SETTINGS = ("pattern", "control", "reflection", "visible", "shapes")
TOKEN = re.compile(r"\s*(?:\{([^}]*)\}|([^\W\d_]\d*)|(\d+)|([|()^*+-]))")
MOST_WORDS = 300
MOST_TUPLES = 60
MOST_LETTERS = 9  # of a word that the brute force can take


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


EXPONENTS = ["k"] * 5 + ["(k-1)", "(k-1)", "-k", "-1", "-1", "-2", "2", "3", "(1-k)", "(2k-1)"]
EXPONENTS += ["m", "m", "(k-m)", "(k+1)", "n", "-n", "-(k-1)", "(m-2)", "0"]


BASES = [
    "A(B2A)^k",
    "(AB2)^k",
    "A^kC",
    "(AB2C)^2",
    "(AB2)^2C",
    "A(CB2)^2",
    "CA(B2C)^m",
    "(A|B2)^3C",
    "C(AB2)^(k-1)A",
    "{front door}^2B2^m",
    "A^k",
]
BASES += ["(AB2)^-kC", "A{front door}B2C", "(A^-1B2)^k", "CA^(2k-1)C", "(A|B2C)^m(AC)^(k-m)"]
CONTROLS = [
    "eced",
    "ece",
    "cec",
    "ecf",
    "cecfc",
    "(ec)^ke",
    "ecd^-1e",
    "(ec)^-2f",
    "(e|f)cd",
    "ecfc",
]
CONTROLS += ["cf(ec)^(k-1)", "ced", "e^2ce", "efc", "(ecf)^-1", "ecAf", "(c|d)e(c|f)", "c^-nef"]
CONTENTS = [
    "A",
    "B2",
    "C",
    "AB2",
    "A|C",
    "B2A^-1",
    "A^m",
    "{front door}",
    "(AB2)^-1",
    "A^k|B2",
    "AtB2",
]


def composed_pattern(rng, back):
    """Return a plain pattern for the back, or a control whose letters stay beside its contents."""
    if back:
        return rng.choice(BASES)
    control = rng.choice(CONTROLS)
    if rng.random() < 0.5:
        control = control.translate({ord("e"): "f", ord("f"): "e"})
    return {"control": control} | {
        name: rng.choice(CONTENTS) for name in "cd" if name in names_of(control)
    }


def random_document(rng: random.Random) -> dict[str, Any]:  # noqa: C901
    """Return a design of 2 or 3 layers without a canvas: any pattern, any qualifier."""
    symbols: dict[str, Any] = {}
    pool = rng.choice([[1, 2, 3, 4], [1, 1.5, 2, 2.5, 3], [0.9, 1.2, 2, 3.1]])
    for name in ("A", "B2", "C", "front door"):
        symbols[name] = {"size": float(rng.choice(pool))}
        for key, share in (("attached", 0.08), ("unoccludable", 0.08)):
            if rng.random() < share:
                symbols[name][key] = True
        if rng.random() < 0.06:
            symbols[name]["opaque"] = False
    symbols["t"] = {"size": float(rng.choice([1, 2, 3, 5])), "transparent": True}
    if rng.random() < 0.08:
        symbols["t"]["attached"] = True
    for name in "ef":  # of control patterns, where they stay
        if rng.random() < 0.6:
            symbols[name] = {"size": float(rng.choice([2, 3, 4, 5]))}
    if rng.random() < 0.35:
        symbols["x"] = {"transparent": True}  # unsized, in any pattern
        if rng.random() < 0.15:
            symbols["x"]["attached"] = True
    solid = ["A", "B2", "C", "{front door}"] * 3 + ["t"] + ["x"] * (2 * ("x" in symbols))
    layers, patterns = [], {}
    composed = rng.random() < 0.6
    count = rng.choice([3, 3, 2] if composed else [2, 3])
    for i in range(count):
        free = rng.choice([["ef"[i % 2]], ["ef"[i % 2]], ["e", "f"]])
        layer: dict[str, Any] = {"name": f"L{i}"}
        for axis in "xy":
            if patterns and rng.random() < 0.12:
                layer[axis] = rng.choice(list(patterns))
                continue
            back = i == count - 1 and rng.random() < 0.7
            if composed:
                raw: Any = composed_pattern(rng, i == count - 1)
            elif back:
                raw = random_text(rng, solid[:4], 2)
            else:
                raw = random_pattern(rng, solid, free, 1)
            if rng.random() < 0.15:
                raw = raw if isinstance(raw, dict) else {"pattern": raw}
                raw["reflection"] = rng.choice(["reverse", "mirror", "reverse-mirror"])
            layer[axis] = f"{axis}{i}"
            patterns[layer[axis]] = raw
        layers.append(layer)
    if rng.random() < 0.15:  # a group of its own for the topmost layer and another back
        layers[0]["group"] = rng.choice(["upper", {"x": "upper", "y": "upper"}])
        layers.append({"name": "back", "x": "back", "y": "back", "group": "upper"})
        patterns["back"] = rng.choice(BASES)
    counters = {
        "k": rng.choice(["auto", "auto", {"min": -1, "max": 3}, 2]),
        "m": rng.choice(["auto", {"min": 0, "max": 2}, {"min": -2, "max": 1}, 1]),
        "n": rng.choice([-2, -1, 1, 2]),
    }
    raw = {"symbols": symbols, "counters": counters, "patterns": patterns, "layers": layers}
    if rng.random() < 0.3:
        raw["reflection"] = rng.choice(["reverse", "mirror", "reverse-mirror"])
    return raw


def random_pattern(rng, solid, free, nested):
    """Return a text, or a control with contents, which may be such patterns themselves."""
    if rng.random() < 0.3:
        return random_text(rng, solid, 2)
    letters = ["c"] * 3 + ["d"] + free * 3 + ["A"]
    control = "".join(random_text(rng, letters, 1) for _ in range(rng.randint(1, 2)))
    if rng.random() < 0.4:
        control = rng.choice(["ece", "cec", "eced", "(ec)^ke", "c(ec)^(k-1)", "ecd^-1e"])
        control = control.replace("e", rng.choice(free))
    known = names_of(control)
    raw: dict[str, Any] = {"control": control}
    for name in ("c", "d"):
        if name in known:
            deep = nested and rng.random() < 0.15
            raw[name] = random_pattern(rng, solid, free, 0) if deep else random_text(rng, solid, 1)
    return raw


def random_text(rng, letters, depth):
    """Return a sequence of letters, powers and alternations, nested so deep."""
    parts = []
    for _ in range(rng.randint(1, 3)):
        draw = rng.random()
        inner = random_text(rng, letters, depth - 1) if depth else rng.choice(letters)
        if draw < 0.5:
            parts.append(rng.choice(letters))
        elif draw < 0.85:
            parts.append(f"({inner})^{random_exponent(rng, inner)}")
        else:
            parts.append(f"({inner}|{random_text(rng, letters, 0)})")
    return "".join(parts)


def random_exponent(rng, base):
    """Return an exponent; what may have no size is repeated a fixed number of times."""
    if names_of(base) <= {"e", "f", "x"}:
        return rng.choice(["2", "-1", "-2", "n"])
    return rng.choice(EXPONENTS)


def fitted(rng, raw, axis):
    """Choose a canvas, and sizes of transparent symbols, so that some words fill it.

    Without a word that fits anything, any canvas.
    """
    reading = Reading(raw, axis, 10.0)
    symbols = raw["symbols"]
    draws = [rng.choice(reading.tuples(reading.rows) or [((),)]) for _ in range(5)]
    words = max(draws, key=lambda each: sum(any(a.transparent for a in word) for word in each))
    sizes = [sum(symbols.get(a.symbol, {}).get("size", 1.5) for a in word) for word in words]
    canvas = next((z for z in reversed(sizes) if 4.0 <= z <= 12.0), rng.choice([6.0, 8.0, 10.0]))
    if rng.random() < 0.8:
        for word in words:
            clear = sorted(
                {a.symbol for a in word if "size" in symbols.get(a.symbol, {})} & set("tef")
            )
            if clear:
                name = rng.choice(clear)
                times = sum(a.symbol == name for a in word)
                rest = sum(
                    symbols.get(a.symbol, {}).get("size", 1.5) for a in word if a.symbol != name
                )
                size = round((canvas - rest) / times, 3)
                if size > 0.5:
                    symbols[name]["size"] = size
    return canvas + rng.choice([0] * 6 + [0.1, 0.3, -0.25])


class Drawn(NamedTuple):
    """A design's document and what it says of one direction; problem: the solver's reading."""

    raw: dict[str, Any]
    axis: str
    reading: Reading
    tuples: list[tuple[tuple[Letter, ...], ...]]
    problem: Any

    def searches(self):
        """Yield (alignment groups, tuples of words, layers of each) of what is solved together."""
        together = components(self.problem)
        if len(together) == 1:
            yield together[0], self.tuples, self.reading.parts
            return
        for (name,) in together:
            rows = self.reading.groups[name]
            yield (name,), self.reading.tuples(rows), (len(rows),)


def drawn(seed: int) -> Drawn:
    """Return a random design, small enough for the brute force, and one of its directions.

    One in ten may have no word that fits.
    """
    rng = random.Random(seed)
    share = rng.choice([0.02, 0.02, 0.05, 0.4])  # at which some words have to fit
    bare = rng.random() < 0.05
    while True:
        raw, axis = random_document(rng), rng.choice("xy")
        try:
            canvas = fitted(rng, raw, axis)
            raw["canvas"] = {"width": canvas, "height": canvas}
            reading = Reading(raw, axis, canvas)
            tuples = reading.tuples(reading.rows)
        except TooLarge:
            continue
        problem = stack_of(from_json(Design, raw)).direction(axis)
        tuples = [
            words for words in tuples if admitted(problem, words, 0.4 * canvas, reading.parts)
        ]
        longest = max((len(word) for words in tuples for word in words), default=0)
        if len(tuples) > MOST_TUPLES or longest > MOST_LETTERS:
            continue
        fits = (admitted(problem, words, share * canvas, reading.parts) for words in tuples)
        if bare or any(fits):
            return Drawn(raw, axis, reading, tuples, problem)
