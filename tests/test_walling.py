"""Retargeted buildings: windows are whole, or walled up."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from facade_tools.artifacts.building import Box, Building, Roof
from facade_tools.artifacts.store import read
from facade_tools.stylization import retarget as module
from facade_tools.stylization.bases import building_blocks
from facade_tools.stylization.doors import door_covers
from facade_tools.stylization.panels import Panel
from facade_tools.stylization.projection import SIDES
from facade_tools.stylization.retarget import retarget
from facade_tools.stylization.splitting import SplitRule, split
from facade_tools.stylization.synthesis import resized_rule
from facade_tools.stylization.walling import Cover, roof_covers, walled

SAMPLES = Path(__file__).parent.parent / "sample_data"
WIDTH, HEIGHT = 9.0, 6.0
NAMES = [field.name for field in fields(Panel)]
RULES = SplitRule((1.0,) * 4, (5 / 3,) * 3), SplitRule((1.0,) * 3, (1.5,) * 2)


def panel(side="front"):
    """A wall of 3 × 2 windows, 9 m wide and 6 m high."""
    along, direction, depth, _ = SIDES[side]
    corners = np.zeros((4, 3))
    corners[[1, 2], along] = direction * WIDTH
    corners[2:, 2] = HEIGHT
    corners[:, depth] = 4.0
    size, whole = (WIDTH, HEIGHT), np.array([[0.0, 0.0, 1.0, 1.0]])
    return Panel(0, side, corners, "wall.png", "g", size, size, RULES, whole, np.zeros(1))


def windows(found):
    """The windows of a panel (k, 4): left, bottom, right, top in shares."""
    spans = []
    for k in (0, 1):
        done = split(resized_rule(found.rules[k], found.source[k]), found.target[k])
        ends = np.concatenate([[0.0], np.cumsum(done.sizes)]) / found.target[k]
        pairs = zip(ends[:-1], ends[1:], done.sources, strict=True)
        spans.append([(a, b) for a, b, source in pairs if source % 2 and done.windows])
    upright = [(1 - b, 1 - a) for a, b in spans[1]] or [(0.0, 1.0)]
    return np.array([(u[0], v[0], u[1], v[1]) for u in spans[0] for v in upright]).reshape(-1, 4)


def area(boxes, window=(0.0, 0.0, 1.0, 1.0)):
    """How much of a window lies in boxes (k, 4) that do not overlap."""
    low, high = np.maximum(boxes[:, :2], window[:2]), np.minimum(boxes[:, 2:], window[2:])
    return float(np.maximum(high - low, 0).prod(axis=1).sum())


def as_pictured(found):
    """The parts of a panel in its picture."""
    return found.seen + np.outer(found.shift, [1, 0, 1, 0])


@pytest.mark.parametrize("side", SIDES)
def test_a_window_that_a_roof_cuts_shows_the_wall_beside_it(side):
    whole = panel(side)
    start = SIDES[side][1] * 4.0  # in the middle window, 4 m from the left
    ends = sorted((start, start + SIDES[side][1] * 0.5))
    done = walled(whole, [Cover(side, 4.0, (ends[0], 0.0, ends[1], 1.5))])
    assert area(done.seen) == pytest.approx(1.0)
    untouched = done.seen[done.shift == 0]
    shown = [area(untouched, window) / area(window[None], window) for window in windows(whole)]
    assert sorted(shown) == pytest.approx([0.0] + [1.0] * 5)
    assert shown[3] == 0.0  # the lower one of the middle column
    moved = as_pictured(done)[done.shift != 0]
    assert len(moved)
    assert all(area(box[None], window) == 0 for box in moved for window in windows(whole))


def test_what_another_block_hides_in_part_is_walled_up_and_what_it_hides_is_gone():
    whole = panel()
    hidden = np.array([[0.0, 0.0, 0.45, 1.0]])  # through the windows of the middle
    seen = np.array([[hidden[0, 2], 0.0, 1.0, 1.0]])
    done = walled(Panel(*(getattr(whole, k) for k in NAMES[:-2]), seen, np.zeros(1)), [])
    assert area(done.seen) == pytest.approx(0.55)
    untouched = done.seen[done.shift == 0]
    shown = [area(untouched, window) for window in windows(whole)]
    assert [value > 0 for value in shown] == [False] * 4 + [True] * 2


def test_a_porch_hides_heads_of_windows_but_cuts_what_stands_out_above_it():
    whole = panel()
    low, high = (Cover("front", 4.0, (0, z, 9, z + 0.2), porch=True) for z in (1.8, 2.4))
    assert walled(whole, [high]) is whole  # windows from 1 to 2.5 m
    done = walled(whole, [low])
    assert area(done.seen[done.shift == 0], windows(whole)[1]) == 0


def test_faces_without_walls_between_windows_stay():
    rules = SplitRule((0.0, 0.0), (9.0,)), RULES[1]
    whole = panel()
    glass = Panel(*(getattr(whole, k) for k in NAMES[:7]), rules, whole.seen, whole.shift)
    assert walled(glass, [Cover("front", 4.0, (4, 0, 5, 6))]) is glass


def test_sections_need_not_take_turns():
    """A rule without a wall at its end, in a face that shows its first window only."""
    rules = SplitRule((1.0, 1.0, 0.0), (2.0, 5.0)), RULES[1]
    whole = panel()
    ends = Panel(*(getattr(whole, k) for k in NAMES[:7]), rules, whole.seen, whole.shift)
    for width in (3.0, 4.0, 7.0, 9.0, 12.0):
        corners = whole.corners * (width / WIDTH, 1, 1)
        done = walled(
            replace(ends, corners=corners, target=(width, HEIGHT)),
            [Cover("front", 4.0, (0, 0, width, 6))],
        )
        assert area(done.seen) == pytest.approx(1.0)


WING = Building(
    "wing",
    (
        Box("main", "general", 8, 10, 16, 8, 6.0, Roof("gable", 35, "x")),
        Box("wing", "general", 5, 4, 8, 6, 3.0, Roof("gable", 40, "y")),
        Box("porch", "porch", 13, 5, 5, 2, 2.4, Roof("shed", 14, "y")),
    ),
)


@pytest.mark.parametrize("name", ["wing", "ranch_l", "split_garage", "victorian"])
def test_every_window_of_a_dressed_house_is_whole_or_gone(name, styles, monkeypatch):
    houses = [WING]
    if name != "wing":
        houses = list(read([str(SAMPLES / "houses" / f"{name}.jsonl")], "building"))[:4]
    made = []

    def kept(found, covers):
        done = walled(found, covers)
        if walled(found, [everywhere(found)]) is not found:  # or it has no wall to show
            made.append((done, covers))
        return done

    monkeypatch.setattr(module, "walled", kept)
    for house in houses:
        for style in (styles["corner-house"], styles["l-block"]):
            covers = [*roof_covers(house), *door_covers(house)]
            retarget(style, building_blocks(house), flush=True, covers=covers)
    cut = 0
    for found, covers in made:
        untouched = found.seen[found.shift == 0]
        cut += int((found.shift != 0).any())
        for window in windows(found):
            shown = area(untouched, window) / area(window[None], window)
            assert shown == pytest.approx(0.0, abs=1e-6) or shown == pytest.approx(1.0, abs=1e-6)
            if shown > 0.5:
                assert not any(roofed(found, window, cover) for cover in covers)
    assert cut or name != "wing"


def everywhere(found):
    along, _, depth, _ = SIDES[found.side]
    low, high = sorted(found.corners[:2, along])
    return Cover(found.side, found.corners[0, depth], (low, -99.0, high, 99.0))


def roofed(found, window, cover):
    """Whether a door, or a roof that is not a porch's, lies in a window by more than 6 cm."""
    if cover.porch or cover.side != found.side:
        return False
    along, _, depth, _ = SIDES[found.side]
    (left, right), bottom = found.corners[:2, along], found.corners[0, 2]
    if abs(cover.place - found.corners[0, depth]) > 0.2:
        return False
    us = sorted(left + u * (right - left) for u in window[[0, 2]])
    vs = bottom + window[[1, 3]] * found.target[1]
    u0, v0, u1, v1 = cover.rectangle
    return min(us[1], u1) - max(us[0], u0) > 0.06 and min(vs[1], v1) - max(vs[0], v0) > 0.06
