"""Random small designs for the oracle, and their words."""

from __future__ import annotations

import itertools
import random

from facade_tools.layering.language import Alternation, Sequence, Symbol, parse
from facade_tools.layering.problem import Direction, LayerPattern, Rule
from facade_tools.layering.words import Letter


def words_of(direction, row):
    """Words of a pattern of letters and alternations, without the solver's expansion."""

    def texts(node):
        match node:
            case Symbol(name):
                return [name]
            case Sequence(parts):
                return ["".join(word) for word in itertools.product(*map(texts, parts))]
            case Alternation(options):
                return [word for part in options for word in texts(part)]

    rules = direction.rules
    return [
        tuple(Letter(name, False, rules[name].transparent) for name in text)
        for text in dict.fromkeys(texts(row.node))
    ]


def random_direction(rng: random.Random, *, letters=5, layers=3, unsized=0.3, splits=True):
    """A small random problem: sizes that nearly fit, all qualifiers, transparent and unsized."""
    canvas = 12.0
    rules = {}
    pool = rng.choice([[1, 2, 3, 4, 5, 6], [1, 1.5, 2, 2.5, 3]]) if letters > 5 else range(1, 7)
    for name in "ABCDE":
        rules[name] = Rule(
            size=float(rng.choice(list(pool))) + rng.choice([0, 0, 0, 0.1, -0.25]),
            opaque=rng.random() < 0.85,
            attached=rng.random() < 0.12,
            unoccludable=rng.random() < 0.12,
        )
    for name in "tu":
        free = rng.random() < unsized
        size = None if free else float(rng.choice([2, 3, 4, 5, 8]))
        rules[name] = Rule(size=size, transparent=True, attached=rng.random() < 0.08)
    rows = []
    for i in range(rng.randint(2, layers)):
        text = random_word(rng, rules, canvas, letters)
        if rng.random() < 0.25:
            text += "|" + random_word(rng, rules, canvas, letters)
        rows.append(LayerPattern(f"L{i}", f"P{i}", parse(text)))
    return Direction("x", canvas, rules, {"default": tuple(rows)})


def random_word(rng, rules, canvas, letters):
    """A word of about the canvas's size."""
    word = ""
    size = 0.0
    while len(word) < letters and size < canvas - 1:
        pool = "ABCDE" if rng.random() < 0.75 else "tu"
        name = rng.choice(pool)
        word += name
        size += rules[name].size or 3.0
    return word
