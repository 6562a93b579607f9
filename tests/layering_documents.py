"""Random designs that use all of the pattern language, small enough for the brute force."""

from __future__ import annotations

import random
from typing import Any, NamedTuple

from layering_language import MOST_TUPLES, Reading, names_of
from layering_oracle import TooLarge, admitted

from facade_tools.artifacts.codec import from_json
from facade_tools.artifacts.design import Design
from facade_tools.layering.solve import components
from facade_tools.layering.stack import stack_of
from facade_tools.layering.words import Letter

MOST_LETTERS = 9  # of a word that the brute force can take
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


REFLECTIONS = ["reverse", "mirror", "reverse-mirror"]


def random_document(rng: random.Random) -> dict[str, Any]:
    """Return a design of 2 or 3 layers without a canvas: any pattern, any qualifier."""
    symbols = random_symbols(rng)
    patterns: dict[str, Any] = {}
    layers = random_layers(rng, symbols, patterns)
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
        raw["reflection"] = rng.choice(REFLECTIONS)
    return raw


def random_symbols(rng):
    """Return solid letters, a transparent one, those of controls, and perhaps one without size."""
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
    return symbols


def random_layers(rng, symbols, patterns):
    """Return layers, the topmost first; their patterns are added to `patterns`."""
    solid = ["A", "B2", "C", "{front door}"] * 3 + ["t"] + ["x"] * (2 * ("x" in symbols))
    composed = rng.random() < 0.6
    count = rng.choice([3, 3, 2] if composed else [2, 3])
    layers = []
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
                raw["reflection"] = rng.choice(REFLECTIONS)
            layer[axis] = f"{axis}{i}"
            patterns[layer[axis]] = raw
        layers.append(layer)
    return layers


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
