"""The measure of how far windows stand apart, on facades that are drawn to be known."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from facade_tools.imaging.image_io import Picture
from facade_tools.stylization.groups import splitting_rule
from facade_tools.stylization.splitting import SplitRule
from facade_tools.stylization.synthesis import synthesised

RAYS = 4
DENSITY = 16  # rays a metre
WALL = SplitRule((8.0,))


def benchmark(name):
    path = Path(__file__).parent.parent / "benchmarks" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


periods = benchmark("periods")


def facade(middles, width, window=1.2, floors=2, colours=(60,), height=8.0) -> Picture:
    """A wall (m) with windows around the middles (m) on every floor, of colours in turn."""
    picture = np.full((round(height * DENSITY), round(width * DENSITY), 3), 190, dtype=np.uint8)
    for floor in range(floors):
        top = round((0.2 + floor * height / floors) * DENSITY) + DENSITY
        for k, middle in enumerate(middles):
            left = round((middle - window / 2) * DENSITY)
            picture[top : top + round(1.5 * DENSITY), left : left + round(window * DENSITY)] = (
                colours[(k + 3 * floor) % len(colours)]
            )
    return picture


def metres(picture, near=None):
    found = periods.period(picture, RAYS, None if near is None else near * DENSITY / RAYS)
    return found * RAYS / DENSITY


@pytest.mark.parametrize(
    ("pitch", "count", "margin"),
    [(2.5, 12, 1.25), (2.5, 12, 3.0), (3.7, 5, 1.0), (4.0, 3, 2.5), (1.9, 20, 0.9)],
)
def test_the_distance_of_windows_is_found(pitch, count, margin):
    middles = margin + 0.6 + pitch * np.arange(count)
    drawn = facade(middles, middles[-1] + 0.6 + margin)
    assert metres(drawn) == pytest.approx(pitch, abs=1 / DENSITY)


def test_light_dirt_and_colours_do_not_hide_it():
    middles = 1.5 + 2.8 * np.arange(9)
    drawn = facade(middles, 25.4, colours=(40, 110, 75)).astype(float)
    drawn += np.linspace(-60, 30, drawn.shape[1])[None, :, None]  # a shadow across the facade
    drawn += np.random.default_rng(5).normal(0, 12, drawn.shape)
    drawn = np.clip(drawn, 0, 254).astype(np.uint8)
    assert metres(drawn) in (pytest.approx(2.8, abs=0.07), pytest.approx(8.4, abs=0.07))


def test_windows_in_pairs_repeat_pair_by_pair():
    middles = np.add.outer(5.0 * np.arange(6), [1.5, 3.3]).ravel()
    assert metres(facade(middles, 30.0), near=5.0) == pytest.approx(5.0, abs=1 / DENSITY)


def test_a_wall_without_rhythm_has_no_period():
    assert np.isnan(metres(facade([], 20.0)))
    assert np.isnan(metres(facade([9.0], 20.0)))
    assert np.isnan(metres(np.full((64, 64, 3), 255, dtype=np.uint8)))


# widths that hold no whole number of bays, few bays, wide and narrow margins, two kinds of bays
AWKWARD = {
    "few": (3.7 * np.arange(3) + 2.2, 12.0),
    "wide margins": (2.5 * np.arange(7) + 3.0, 21.0),
    "narrow margins": (3.0 * np.arange(6) + 0.9, 16.8),
    "many": (2.1 * np.arange(16) + 1.2, 33.9),
}


@pytest.mark.parametrize("name", AWKWARD)
@pytest.mark.parametrize("factor", [1.3, 1.5, 1.8, 2.0])
def test_resized_facades_keep_the_distance_of_windows(name, factor):
    middles, width = AWKWARD[name]
    drawn = facade(middles, width)
    rule = splitting_rule([drawn], width, 0)
    assert len(rule.insertable) == len(middles)
    source, target = (width, 8.0), (factor * width, 8.0)
    wide = synthesised(drawn, (rule, WALL), source, target, DENSITY)
    pitch = metres(drawn)
    assert pitch == pytest.approx(middles[1] - middles[0], abs=1 / DENSITY)
    assert metres(wide, near=pitch) == pytest.approx(pitch, abs=max(width / 160, 0.045 * pitch))
