"""Draws that hand-written house rules need: ranges on a grid, weighted picks, a size that pulls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from facade_tools.artifacts.building import Box, BoxKind, Chimney, Colors, Roof

T = TypeVar("T")


@dataclass
class Draw:
    """One house's random choices; `size` in [0, 1] says how grand the house is.

    What `scaled` returns follows `size`, so that wide houses are also deep, with more windows and
    larger garages: the correlations that a learned model has to find.
    """

    rng: np.random.Generator
    size: float = 0.0

    def __post_init__(self) -> None:
        self.size = float(self.rng.beta(2.0, 2.0))

    def between(self, low: float, high: float, step: float = 0.1) -> float:
        """Draw evenly from a range, on the grid of `step`."""
        return self._on_grid(float(self.rng.uniform(low, high)), step)

    def scaled(self, low: float, high: float, step: float = 0.1) -> float:
        """Draw from a range, following the house's size."""
        share = float(np.clip(self.size + self.rng.normal(0.0, 0.15), 0.0, 1.0))
        return self._on_grid(low + (high - low) * share, step)

    def chance(self, probability: float) -> bool:
        """Tell whether something with this probability happens."""
        return bool(self.rng.random() < probability)

    def pick(self, options: Sequence[T], weights: Sequence[float] | None = None) -> T:
        """Choose one of the options, evenly or by weight."""
        share = None if weights is None else np.asarray(weights) / np.sum(weights)
        return options[int(self.rng.choice(len(options), p=share))]

    @staticmethod
    def _on_grid(value: float, step: float) -> float:
        return round(round(value / step) * step, 6)


@dataclass(frozen=True)
class Dress:
    """How a house's walls are filled: window styles and sizes (m), spacing, habits.

    spacing: wanted distance between window centres on front, back and the two ends.
    blank: chance that a slot stays wall on front, back and the two ends.
    """

    window: str
    second: str
    width: float = 1.1
    height: float = 1.4
    sill: float = 0.9
    spacing: tuple[float, float, float] = (2.4, 2.6, 3.4)
    blank: tuple[float, float, float] = (0.0, 0.1, 0.3)
    paired: bool = False
    picture: bool = False
    bays: bool = False
    sidelights: bool = False
    regular: float = 0.9
    door: str = "panel"
    door_x: float | None = None
    garage_side: str = "front"
    patio: bool = True


@dataclass(frozen=True)
class Mass:
    """The undressed house: boxes, chimneys, special features, colours, and how to dress it."""

    boxes: tuple[Box, ...]
    dress: Dress
    colors: Colors
    storey: float = 3.0
    chimneys: tuple[Chimney, ...] = ()
    features: tuple[str, ...] = field(default=())


def box(
    name: str,
    kind: BoxKind,
    xs: tuple[float, float],
    ys: tuple[float, float],
    top: tuple[float, Roof],
) -> Box:
    """Return the box over xs × ys; `top` is eaves height and roof."""
    (x0, x1), (y0, y1) = xs, ys
    centre = round((x0 + x1) / 2, 6), round((y0 + y1) / 2, 6)
    size = round(x1 - x0, 6), round(y1 - y0, 6)
    return Box(name, kind, *centre, *size, round(top[0], 6), top[1])


def gable(pitch: float, direction: str = "x", overhang: float = 0.4) -> Roof:
    """Return a gable roof: pitch in degrees, overhang in metres."""
    return Roof("gable", pitch, "x" if direction == "x" else "y", overhang)


def hip(pitch: float, direction: str = "x", overhang: float = 0.45) -> Roof:
    """Return a hip roof: pitch in degrees, overhang in metres."""
    return Roof("hip", pitch, "x" if direction == "x" else "y", overhang)


def shed(pitch: float, overhang: float = 0.25) -> Roof:
    """Return a shed roof: pitch in degrees, overhang in metres."""
    return Roof("shed", pitch, "y", overhang)


def flat(overhang: float = 0.0) -> Roof:
    """Return a flat roof: pitch in degrees, overhang in metres."""
    return Roof("flat", 0.0, "x", overhang)


def features(chimneys: tuple[Chimney, ...], *others: str) -> tuple[str, ...]:
    """Return the names of a house's features."""
    return (("chimney",) if chimneys else ()) + others


def cone(pitch: float, overhang: float = 0.2) -> Roof:
    """Return a cone roof: pitch in degrees, overhang in metres."""
    return Roof("cone", pitch, "x", overhang)


def ridge_height(b: Box) -> float:
    """Height of the ridge of a gable or hip box."""
    assert b.roof is not None
    assert b.height is not None
    span = b.depth if b.roof.direction == "x" else b.width
    if b.roof.style == "hip":
        span = min(b.width, b.depth)
    return float(b.height + span / 2 * np.tan(np.radians(b.roof.pitch)))


def chimney(b: Box, across: float, along: float, size: float = 0.7) -> Chimney:
    """Return a chimney at shares of a box's width and depth, 0.6 m over its ridge."""
    x = b.x + (across - 0.5) * b.width
    y = b.y + (along - 0.5) * b.depth
    return Chimney(round(x, 3), round(y, 3), size, size, round(ridge_height(b) + 0.6, 2))


def palette(d: Draw, names: str) -> Colors:
    """Pick one of the named templates; `names` is a string of keys of TEMPLATES."""
    return Colors(*TEMPLATES[d.pick(names)])


# wall, trim, roof, door
TEMPLATES = {
    "a": ("#e9e2d0", "#ffffff", "#5a4a42", "#7a2f24"),
    "b": ("#c9d3d8", "#ffffff", "#4a4e54", "#20364f"),
    "c": ("#a9583f", "#f1ebe0", "#3f3a38", "#23402f"),
    "d": ("#d8c9a3", "#6b4a2f", "#6e5a48", "#4d2c1a"),
    "e": ("#f4f1ea", "#3a3d40", "#2f3235", "#c8642b"),
    "f": ("#7f947c", "#f3efe2", "#4d4640", "#8c2f2b"),
    "g": ("#8fa5b8", "#fbfaf6", "#54585e", "#f0c24b"),
    "h": ("#b7b2a8", "#2c2c2c", "#3a3a3a", "#6b3f22"),
    "i": ("#e8c9a8", "#fffaf0", "#8b4a35", "#38572f"),
    "j": ("#6d4b5e", "#f0e6d8", "#3d3b46", "#caa45a"),
    "k": ("#ffffff", "#e8e8e8", "#5f6468", "#1f1f1f"),
    "l": ("#96705a", "#efe6d6", "#443a35", "#2f4a5c"),
}
