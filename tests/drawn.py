"""Models of the sample houses, draws from them, and what every draw must keep."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest

from facade_tools.artifacts.attributes import Attributes
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.model import Model
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.validation import check
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.samples import SampleOptions, sample_attributes


@cache
def house_model(variant: str = "full") -> Model:
    """The model of every third sample house."""
    options = LearnOptions(variant=variant, largest=4)
    return learn_model(shipped_prior()[::3], rng=np.random.default_rng(0), options=options)


def draw(model, n, seed=0, given=None, **options):
    rng = np.random.default_rng(seed)
    return list(sample_attributes(model, n, rng=rng, given=given, options=SampleOptions(**options)))


def assert_possible(a: Attributes) -> None:
    (w, d, h), m = a.mass.bbox, a.mass
    assert min(w, d, h) > 0
    assert 0 < m.bcr <= 1
    assert m.far * m.arf[0] == pytest.approx(m.bcr)
    assert m.arf[0] >= m.arf[1] >= m.arf[2] >= 0
    assert sum(m.arf) == pytest.approx(1)
    assert m.bdry * np.sqrt(m.bcr * w * d) >= 2 * (w + d) * (1 - 1e-9)
    floors = 1 + (m.arf[1] > 0) + (m.arf[2] > 0)
    assert h > (floors - 0.5) * a.storey_height
    assert floors == 3 or h <= (floors + 0.5) * a.storey_height
    px, py, gw, gd, gh, exposure = m.garage
    if gw:
        assert gw / w / 2 - 1e-9 <= px <= 1 - gw / w / 2 + 1e-9
        assert gd / d / 2 - 1e-9 <= py <= 1 - gd / d / 2 + 1e-9
        assert gh <= h * (1 + 1e-9)
        assert 0 <= exposure <= 1
    for porch, back in zip(m.porch, (False, True), strict=True):
        assert not any(porch) or (porch[1] >= 0.5) == back
        assert not any(porch) or porch[5] >= min(porch[2:4]) / (2 * sum(porch[2:4])) - 1e-9
        if porch[2]:
            apart = [
                abs(porch[i] - 0.5) * size - (porch[2 + i] + size) / 2
                for i, size in ((0, w), (1, d))
            ]
            assert max(apart) <= 1e-6
        if gw and porch[2]:
            gaps = [
                abs(m.garage[i] - porch[i]) * size - (m.garage[2 + i] + porch[2 + i]) / 2
                for i, size in ((0, w), (1, d))
            ]
            assert max(gaps) >= -1e-6
    assert all(0 <= x < 1 for x in a.facade.wwr)
    assert all(0 <= x <= 1 for x in (*a.facade.sym, *a.facade.align))
    assert any(a.element.roof.values())
    check(json.loads(dump_line(encode(a))), "attributes")
