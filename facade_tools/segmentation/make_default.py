"""How the shipped classifier is made: trained on rendered facades only."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..grammar.library import builtin
from ..randomness import item_generator
from .classifier import Classifier
from .network_training import NetworkOptions
from .painting import render_facade
from .training import Pair, TrainOptions, train

GRAMMARS = ("haussmann", "haussmann-floors", "haussmann-floors", "plain")
HEIGHTS = (300, 640)  # pixels
OPTIONS = TrainOptions(pixels=800, augment=0, network=NetworkOptions(steps=0))  # trees alone


def rendered_pairs(count: int, seed: int) -> Iterator[Pair]:
    """Yield random rendered facades with their labels."""
    grammars = [builtin(name) for name in GRAMMARS]
    for number in range(count):
        rng = item_generator(seed, "render", number)
        height = int(rng.integers(*HEIGHTS))
        width = int(height * rng.uniform(0.35, 1.1))
        _, picture, labels = render_facade(grammars[number % len(grammars)], width, height, rng=rng)
        yield Pair(f"rendered-{number}", picture, labels)


def make_default(count: int = 150, seed: int = 0, options: TrainOptions = OPTIONS) -> Classifier:
    """Return the classifier trained on `count` rendered facades."""
    rng: np.random.Generator = item_generator(seed, "default-classifier")
    return train(rendered_pairs(count, seed), options, rng=rng)
