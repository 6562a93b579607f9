"""Retargeting: overhangs, snapping, re-assignment, and relief that keeps its size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_retarget import NAMES, closed, wall_area
from test_stylization import BOX, style_of, textured_box

from facade_tools.artifacts.blocks import Block, Blocks
from facade_tools.formats.textured import joined
from facade_tools.stylization.bays import with_bays
from facade_tools.stylization.panels import panels, reassigned
from facade_tools.stylization.placed import placed_slabs
from facade_tools.stylization.placing import matched_blocks, outset_blocks, placed_blocks
from facade_tools.stylization.resizing import resized
from facade_tools.stylization.retarget import retarget
from facade_tools.stylization.splitting import SplitRule, split
from facade_tools.stylization.stacking import foreign_blocks


# --- overhangs, snapping, re-assignment -----------------------------------------------------------
def recessed():
    """A block with a recess 2 m deep in the middle of its front, under nothing."""
    return joined(
        [textured_box((0, 2, 0), (20, 12, 9)), textured_box((0, 0, 0), (7, 2, 9)),
         textured_box((13, 0, 0), (20, 2, 9))]
    )  # fmt: skip


def stacked(inset):
    return Blocks(
        "two",
        (
            Block("low", "body", 0, 0, 0, 20, 12, 9, 3),
            Block("high", "body", 2, inset, 9, 16, 12 - 2 * inset, 9, 3),
        ),
    )


@pytest.mark.parametrize(("inset", "depth"), [(1.0, 0.9), (3.0, 2.0), (0.0, 2.0)])
def test_walls_under_an_overhang_are_thinned(monkeypatch, inset, depth):
    """Upper outer boundary 1 m behind the lower's: the recess goes from 2 m to 0.9 of that."""
    monkeypatch.setattr("facade_tools.stylization.wings.COMPACT", 0.0)
    style = style_of(recessed(), front=180.0)
    assert len(style.blocks.blocks) == 1
    low = placed_blocks(style.sheet, style.blocks, stacked(inset))[0]
    slab = placed_slabs(style.sheet, low)[0]
    back = [y for y in slab.ys if 1e-6 < y < 6]
    assert back == pytest.approx([depth])


def test_walls_below_a_closed_floor_keep_their_relief(monkeypatch):
    """Under a cornice that covers the recess nothing overhangs, wherever the upper wall stands."""
    monkeypatch.setattr("facade_tools.stylization.wings.COMPACT", 0.0)
    sides = [textured_box((0, 0, 0), (8, 2, 9)), textured_box((12, 0, 0), (20, 2, 9))]
    lid = textured_box((8, 0, 6), (12, 2, 9))
    style = style_of(joined([textured_box((0, 2, 0), (20, 12, 9)), *sides, lid]), front=180.0)
    assert len(style.blocks.blocks) == 1
    low = placed_blocks(style.sheet, style.blocks, stacked(1.0))[0]
    slab = placed_slabs(style.sheet, low)[0]
    assert [y for y in slab.ys if 1e-6 < y < 6] == pytest.approx([2.0])


def test_edges_snap_to_those_below(monkeypatch):
    """A recess of other proportions on the block above moves onto the one below."""
    monkeypatch.setattr("facade_tools.stylization.wings.COMPACT", 0.0)
    style = style_of(recessed(), front=180.0)
    base = Blocks(
        "two",
        (
            Block("low", "body", 0, 0, 0, 20, 12, 9, 3),
            Block("high", "body", 1, 0, 9, 19, 12, 9, 3),
        ),
    )
    low, high = placed_blocks(style.sheet, style.blocks, base)
    below, above = (placed_slabs(style.sheet, p)[0] for p in (low, high))
    assert below.xs == pytest.approx([0, 7, 13, 20])
    assert above.xs == pytest.approx([1, 7, 13, 20])


@pytest.mark.parametrize("name", NAMES)
def test_a_model_on_its_own_blocks_is_neither_thinned_nor_snapped(styles, name):
    style = styles[name]
    for factor in (1.0, 1.5):
        sizes = {b.id: (factor * b.width, factor * b.depth, b.height) for b in style.blocks.blocks}
        placed = placed_blocks(style.sheet, style.blocks, resized(style.blocks, sizes))
        assert foreign_blocks(style.blocks, placed) == []
        assert all(len(knots[0]) == 2 for p in placed for knots in p.maps)


def test_small_groups_take_the_texture_of_large_ones():
    style = style_of(BOX, front=180.0)
    own = style.blocks.blocks[0]
    base = Blocks(
        "x",
        (
            replace(own, id="low", x=0, y=0, z=0),
            replace(own, id="high", x=0, y=1.0, z=own.height, height=0.5, depth=own.depth - 1),
        ),
    )
    placed = placed_blocks(style.sheet, style.blocks, base)
    slabs = [placed_slabs(style.sheet, p) for p in placed]
    found = panels(style.sheet, placed, slabs)
    tops = [k for k, p in enumerate(found) if p.block == 1]
    changed = [replace(p, group="tiny", texture="other") if p.block == 1 else p for p in found]
    done = reassigned(changed, [1], 0.2)
    assert all(done[k].texture != "other" for k in tops if done[k].side in ("front", "back"))
    assert reassigned(changed, [1], 0.0) == changed
    assert reassigned(changed, [], 0.2) == changed


# --- relief ---------------------------------------------------------------------------------------
def niched():
    """A wall of 18 m with three niches 2 m wide and 0.3 m deep, 2 m from its corners."""
    parts = [textured_box((0, 0.3, 0), (18, 8, 6)), textured_box((0, 0, 4.5), (18, 0.3, 6))]
    edges = [0.0, 2, 4, 8, 10, 14, 16, 18]
    parts += [
        textured_box((a, 0, 0), (b, 0.3, 4.5)) for a, b in zip(edges[::2], edges[1::2], strict=True)
    ]
    return style_of(joined(parts), front=180.0)


def niches(style, blocks):
    """Left and right ends (m) of the niches in the plan of the lowest slab."""
    chosen = matched_blocks(style.sheet, style.blocks, blocks)
    style, chosen = with_bays(style, chosen, blocks, {})
    placed = placed_blocks(style.sheet, style.blocks, blocks, chosen)
    slab = placed_slabs(style.sheet, placed[0])[0]
    open_ = ~slab.cells[int(np.searchsorted(slab.ys, slab.ys[0] + 0.15)) - 1]
    return [(a, b) for a, b, o in zip(slab.xs[:-1], slab.xs[1:], open_, strict=True) if o]


@pytest.mark.parametrize(("factor", "count"), [(1.0, 3), (1.5, 5), (2.0, 6), (0.5, 1)])
def test_niches_in_the_plan_are_repeated_and_keep_their_width(factor, count):
    style = niched()
    block = style.blocks.blocks[0]
    blocks = resized(style.blocks, {block.id: (18 * factor, block.depth, block.height)})
    found = niches(style, blocks)
    assert len(found) == count
    assert [b - a for a, b in found] == pytest.approx([2.0] * count, abs=0.05)
    scene = retarget(style, blocks)
    assert closed(scene.meshes[0])
    front = next(m for m in scene.meshes if m.name == f"{block.id}/front")
    assert wall_area(front) == pytest.approx(18 * factor * 6, rel=0.01)


def test_shops_of_a_bottom_block_stand_once_however_high_it_grows(styles):
    style = styles["stepped-tower"]
    ground = next(b for b in style.sheet.blocks if b.role == "bottom")
    face = next(f for w in style.sheet.walls if w.block == ground.id for f in w.faces)
    rows = next(g for g in style.sheet.groups if g.id == face.horizontal).rule
    rule = next(SplitRule(r.a, r.b) for r in style.sheet.rules if r.id == rows)
    assert rule.insertable
    block = next(b for b in style.blocks.blocks if b.id == ground.id)
    taller = resized(style.blocks, {block.id: (block.width, block.depth, 2.2 * block.height)})
    placed = placed_blocks(style.sheet, style.blocks, taller)
    slabs = [placed_slabs(style.sheet, item) for item in placed]
    index = next(i for i, item in enumerate(placed) if item.source.id == ground.id)
    for panel in panels(style.sheet, placed, slabs):
        if panel.block == index:
            done = split(panel.rules[1], panel.target[1])
            assert done.sources.count(2 * len(rule.insertable) - 1) == 1


def test_doors_of_a_building_without_a_bottom_stay_on_the_ground():
    """The lowest storey of a wall stands once, at its foot, whether it grows or shrinks."""
    style = style_of(BOX, front=180.0, bottom=0, top=0)
    (own,) = style.blocks.blocks
    count = len(_row_panels(style, style.blocks)[0].rules[1].insertable)
    assert count > 1
    twice = replace(style.blocks, blocks=(replace(own, height=2 * own.height),))
    half = replace(style.blocks, blocks=(replace(own, height=0.5 * own.height),))
    for blocks in (twice, half):
        for panel in _row_panels(style, blocks):
            sources = split(panel.rules[1], panel.target[1]).sources
            assert sources.count(2 * count - 1) == 1
            assert sources[-2:] == (2 * count - 1, 2 * count)
    hung = replace(own, id="hung", z=own.height, height=0.5 * own.height)
    above = replace(style.blocks, blocks=(own, hung))
    assert all(not p.rules[1].once for p in _row_panels(style, above) if p.block == 1)


@pytest.mark.parametrize("width", [14.0, 20.0, 33.0])
def test_niches_keep_their_width_where_walls_stand_flush_with_roofs(width):
    """The plinth stands before the walls; that walls go to the block's sides widens no niche."""
    piers = [textured_box((a, 0, 1.5), (b, 0.4, 9)) for a, b in ((0, 4), (7, 13), (16, 20))]
    plinth = textured_box((-0.1, -0.1, 0), (20.1, 12.1, 1.5))
    body = [plinth, textured_box((0, 0.4, 1.5), (20, 12, 9))]
    style = style_of(joined([*body, *piers]), front=180.0, bottom=0, top=0)
    assert len(style.blocks.blocks) == 1
    target = Blocks("one", (Block("one", "body", 0, 0, 0, width, 12, 9, 3),))
    chosen = matched_blocks(style.sheet, style.blocks, target)
    sized = outset_blocks(style.sheet, target, chosen)
    style, chosen = with_bays(style, chosen, sized, {})
    (placed,) = placed_blocks(style.sheet, style.blocks, target, chosen, flush=True)
    slab = placed_slabs(style.sheet, placed)[-2]  # below the lintel
    front = slab.cells[0]
    niches = np.diff(slab.xs)[~front]
    assert len(niches) >= 1
    assert niches == pytest.approx([3.0] * len(niches), abs=0.02)
    assert (slab.xs[0], slab.xs[-1]) == pytest.approx((0.0, width), abs=0.01)


def _row_panels(style, blocks):
    placed = placed_blocks(style.sheet, style.blocks, blocks)
    slabs = [placed_slabs(style.sheet, item) for item in placed]
    return panels(style.sheet, placed, slabs, None, {style.blocks.blocks[0].id})


@pytest.mark.parametrize("flush", [False, True])
def test_niches_of_a_deeper_building_are_as_deep_as_in_the_source(monkeypatch, flush):
    monkeypatch.setattr("facade_tools.stylization.wings.COMPACT", 0.0)
    style = style_of(recessed(), front=180.0)
    deep = Blocks("deep", (Block("deep", "body", 0, 0, 0, 20, 30, 9, 3),))
    (placed,) = placed_blocks(style.sheet, style.blocks, deep, flush=flush)
    slab = placed_slabs(style.sheet, placed)[0]
    assert [y for y in slab.ys if 1e-6 < y < 29] == pytest.approx([2.0])
