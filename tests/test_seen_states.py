"""What samples have of the training rows: their states of atoms, the values that they share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn import assert_possible, draw

from facade_tools.artifacts.attributes import Attributes, Present
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.prior import shipped_prior


def block(number):
    """A block of five storeys: attributes know the lowest three."""
    rng = np.random.default_rng(number)
    w, d, h = rng.uniform((10, 9, 15), (18, 14, 18)).tolist()
    bdry = 2 * (w + d) / (w * d) ** 0.5
    mass = replace(Attributes("").mass, bbox=(w, d, h), bcr=1.0, bdry=bdry, far=3.0,
                   arf=(1 / 3, 1 / 3, 1 / 3), garage=(0.0,) * 6)  # fmt: skip
    glass = tuple(rng.uniform(0.1, 0.3, 4).tolist())
    facade = replace(Attributes("").facade, wwr=glass)
    return replace(Attributes(f"block-{number}", mass=mass, facade=facade), storey_height=3.5)


@pytest.fixture(scope="module")
def blocks():
    """A model of blocks that are rectangles of three floors or more, without garage and porch."""
    rows = [block(k) for k in range(60)]
    return learn_model(rows, rng=np.random.default_rng(0), options=LearnOptions(largest=3))


def test_high_houses_have_the_floors_for_it(blocks):
    """No row lacks an upper floor, but one draw of 60 did: its storeys were 7 to 12 m high."""
    for smooth in (False, True):
        drawn = draw(blocks, 2000, smooth=smooth)
        assert max(sample.storey_height for sample in drawn) <= 5.0
        for sample in drawn:
            assert_possible(sample)
    low = replace(Attributes("").mass, bbox=(None, None, 8.0), arf=(1.0, 0.0, 0.0))
    for sample in draw(blocks, 20, given=Attributes("hall", mass=low)):
        assert sample.mass.arf == (1.0, 0.0, 0.0)  # what is given stays


def test_what_no_training_row_shows_is_not_drawn(blocks):
    """Pseudo-counts alone put garages beside blocks and left fronts without windows."""
    for sample in draw(blocks, 2000):
        assert sample.mass.bcr == 1.0
        assert set(sample.mass.garage) == {0.0}
        assert min(sample.facade.wwr) > 0.0
    assert {0.0} != {a.mass.garage[2] for a in draw(blocks, 2000, smooth=True)}
    # What is given may be what nobody has seen.
    given = Attributes("g", mass=replace(Attributes("").mass, garage=(0.5, 0.5, 3, 5, 2.5, 0.5)))
    assert next(iter(draw(blocks, 1, given=given))).mass.garage[2] == 3


def test_what_no_row_observes_may_be_drawn():
    """Rows that say of garages only that they are there have none of their measures."""
    there = Present(garage=True, porch_front=None, porch_back=None)
    rows = [
        replace(block(k), present=there, mass=replace(block(k).mass, garage=(None,) * 6))
        if k % 3
        else block(k)
        for k in range(60)
    ]
    learned = learn_model(rows, rng=np.random.default_rng(0), options=LearnOptions(largest=3))
    share = np.mean([a.mass.garage[2] > 0 for a in draw(learned, 2000)])
    assert share == pytest.approx(2 / 3, abs=0.08)


def test_shared_values_come_back():
    """Eaves at exactly 2.4384 or 5.1816 m in three of four houses."""
    rng = np.random.default_rng(0)
    rows = []
    for house in shipped_prior()[:160]:
        w, d, h = house.mass.bbox
        h = (2.4384 if h < 4 else 5.1816) + (0.0 if rng.random() < 0.75 else rng.normal(0, 0.05))
        rows.append(replace(house, mass=replace(house.mass, bbox=(w, d, h))))
    options = LearnOptions(variant="no-lateral", largest=3)
    model = learn_model(rows, rng=rng, options=options)
    heights = [a.mass.bbox[2] for a in draw(model, 400)]
    exact = [h in (2.4384, 5.1816) for h in heights if min(abs(h - 2.44), abs(h - 5.18)) < 0.2]
    assert 0.3 < np.mean(exact) < 0.95
    assert not any(a.mass.bbox[2] in (2.4384, 5.1816) for a in draw(model, 400, smooth=True))
    given = Attributes("g", mass=replace(Attributes("x").mass, bbox=(9.0, None, 2.44)))
    assert {a.mass.bbox[2] for a in draw(model, 20, given=given)} == {2.44}
