"""`sample --given`: conditioned exactly, what is given stays, contradictions are named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn import assert_possible, draw, house_model
from scipy.stats import norm

from facade_tools.artifacts.attributes import Attributes, Bounds, ElementAttributes, Present
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import Given, dump_line
from facade_tools.errors import Infeasible
from facade_tools.exteriors.conditioning import draw_given
from facade_tools.exteriors.coordinates import read_attributes
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.relations import contradictions
from facade_tools.exteriors.serialisation import network_of
from facade_tools.exteriors.transforms import forward


@pytest.fixture(scope="module")
def houses():
    return shipped_prior()


@pytest.fixture(scope="module")
def model():
    return house_model()


@pytest.fixture(scope="module")
def plain():
    """Without lateral edges: every conditional is exact."""
    return house_model("no-lateral")


def test_exact_conditioning_agrees_with_rejection(plain, houses):
    """P(garage, hip | one-storey, gable) by conditioning and by throwing away other draws."""
    bits = ElementAttributes(roof={"flat": None, "gable": 1, "hip": None})
    given = Attributes("g", mass=replace(houses[0].mass.__class__(), bcr=1.0), element=bits)
    drawn = draw(plain, 1500, given=given, neighbours=False)
    assert all(a.sample.effective is None for a in drawn)
    free = [
        a
        for a in draw(plain, 8000, seed=1, neighbours=False)
        if a.mass.bcr == 1.0 and a.element.roof["gable"] == 1
    ]
    for measure in (
        lambda a: bool(a.mass.garage[2]),
        lambda a: a.element.roof["hip"],
        lambda a: a.mass.arf[1] == 0,
        lambda a: a.mass.bbox[2] > 5,
    ):
        ours, theirs = np.mean([measure(a) for a in drawn]), np.mean([measure(a) for a in free])
        assert ours == pytest.approx(theirs, abs=4.5 * np.sqrt(0.25 / len(free)) + 0.03)


def test_conditionals_equal_enumeration(plain):
    """P(S | width) and E[depth | width] by summing over every S and H, and by drawing."""
    network = network_of(plain)
    group, scaling, family = network.layout.groups[0], network.scalings[0], network.families[0]
    given = Attributes("g", mass=replace(Attributes("x").mass, bbox=(9.0, None, None)))
    row = read_attributes([given], network.layout)
    x = (forward(group.coordinates[0].transform, np.array([9.0]))[0][0] - scaling.center[0]) / (
        scaling.scale[0]
    )
    mean, cov = family.coef[:, :, 0], family.cov
    likelihood = norm.pdf(x, mean[:, 0], np.sqrt(cov[:, 0, 0]))
    joint = network.style[:, None] * family.hidden * likelihood
    expected = mean[:, 1] + cov[:, 1, 0] / cov[:, 0, 0] * (x - mean[:, 0])
    drawn = draw_given(network, row, 40_000, rng=np.random.default_rng(0)).draws
    share = np.bincount(drawn.style, minlength=len(joint)) / len(drawn.style)
    assert share == pytest.approx(joint.sum(axis=1) / joint.sum(), abs=0.012)
    depth = forward(group.coordinates[1].transform, drawn.readings.values[0][:, 1])[0]
    found = (depth - scaling.center[1]) / scaling.scale[1]
    assert found.mean() == pytest.approx((joint @ expected).sum() / joint.sum(), abs=0.03)


def test_weighted_draws_average_to_the_density(model, plain, houses):
    """Where lateral parents are unobserved the weights' mean is the density; elsewhere each is."""
    network = network_of(plain)
    row = read_attributes([houses[0]], network.layout)
    particles = draw_given(network, row, 50, rng=np.random.default_rng(0))
    assert particles.exact
    exact = -negative_log_density(plain, [houses[0]])[0]
    assert particles.log_weight == pytest.approx(np.full(50, exact), abs=1e-6)
    network = network_of(model)
    hidden = replace(houses[0], facade=replace(houses[0].facade, wwr=(None,) * 4))
    row = read_attributes([hidden], network.layout)
    means = [
        np.logaddexp.reduce(
            draw_given(network, row, 4000, rng=np.random.default_rng(seed)).log_weight
        )
        for seed in (1, 2)
    ]
    assert means[0] == pytest.approx(means[1], abs=0.3)


def test_completion_keeps_what_is_given_to_the_last_bit(model, houses):
    width = Given("11.123456789012344")
    mass = replace(houses[30].mass, bbox=(width, None, 5.5), far=None, arf=(None,) * 3, bdry=None)
    there = Present(garage=any(mass.garage))
    given = Attributes("p", mass=mass, storey_height=2.75, present=there)
    for sample in draw(model, 5, given=given, top=True):
        assert sample.mass.bbox[0] is width
        assert sample.mass.bbox[2] == 5.5
        assert sample.mass.garage == mass.garage
        assert sample.mass.porch == mass.porch
        assert sample.storey_height == 2.75
        text = dump_line(encode(sample)).decode()
        assert "11.123456789012344" in text
        assert "null" not in text
        assert sample.present is None


def test_bounds_are_hard(model):
    given = Attributes("b", bounds=Bounds((9.0, 9.0, 4.0)))
    for sample in draw(model, 30, given=given):
        assert all(x >= least for x, least in zip(sample.mass.bbox, (9, 9, 4), strict=True))
    with pytest.raises(Infeasible):
        draw(model, 1, given=Attributes("b", bounds=Bounds((900.0, 9.0, 4.0))))


def test_nothing_stands_on_what_is_low(model):
    """A kept garage carries no upper floor: houses that are all of two floors do not suit it."""
    upper = Attributes("g", mass=replace(Attributes("x").mass, bbox=(12.0, 10.0, 5.6)))
    free = draw(model, 200, given=upper)
    assert np.mean([a.mass.arf[1] == 0.5 for a in free]) > 0.1
    low = replace(upper, bounds=Bounds((12.0, 10.0, 5.6), (36.0, 60.0)))
    for a in draw(model, 200, given=low):
        ground = a.mass.bcr * 120.0
        assert ground * (1 - a.mass.arf[1] / a.mass.arf[0]) >= 36.0 * 0.999
        assert ground * (1 - a.mass.arf[2] / a.mass.arf[0]) >= 60.0 * 0.999
        assert a.bounds == low.bounds
    with pytest.raises(Infeasible):
        draw(model, 1, given=replace(upper, bounds=Bounds((12.0, 10.0, 5.6), (130.0, 130.0))))


def test_present_with_unknown_measures(model):
    given = Attributes("g", present=Present(garage=True, porch_front=False))
    for sample in draw(model, 20, given=given):
        assert sample.mass.garage[2] > 0
        assert sample.mass.porch[0] == (0.0,) * 6


def test_floors_suit_low_eaves(model):
    """Where the eaves are too low for two floors there is one, unless the second is given."""
    low = replace(Attributes("x").mass, bbox=(None, None, 3.0))
    assert {a.mass.arf[1] for a in draw(model, 100, given=Attributes("g", mass=low))} == {0.0}
    two = replace(Attributes("x").mass, arf=(0.5, 0.5, 0.0))
    for sample in draw(model, 100, given=Attributes("g", mass=two)):
        assert sample.mass.arf == (0.5, 0.5, 0.0)
        assert sample.mass.bbox[2] >= 3.45


def test_far_without_floors_is_met(model):
    mass = replace(Attributes("x").mass, bcr=0.8, far=1.4)
    for sample in draw(model, 20, given=Attributes("f", mass=mass)):
        assert sample.mass.far == 1.4
        assert 1.4 * sample.mass.arf[0] == pytest.approx(0.8)


FLOORS = [
    {"arf": (0.6, None, None)},
    {"arf": (0.4, None, None)},
    {"arf": (1.0, None, None)},
    {"arf": (None, 0.3, None)},
    {"arf": (None, 0.5, None)},
    {"arf": (None, None, 0.3)},
    {"arf": (None, None, 0.0)},
    {"arf": (0.6, 0.4, None)},
    {"arf": (None, 0.4, 0.2)},
    {"far": 1.2, "arf": (0.6, 0.4, 0.0)},
    {"far": 1.2, "arf": (0.6, None, None)},
    {"far": 1.2, "arf": (None, 0.4, None)},
    {"far": 1.5, "arf": (None, None, 0.2)},
    {"far": 1.2, "bcr": 0.7},
    {"far": 1.2, "bcr": 0.7, "arf": (None, 0.4, None)},
    {"bcr": 0.7, "arf": (0.6, None, None)},
    {"far": 1.8},
    {"bdry": 4.6},
    {"bbox": (30.0, None, None), "bdry": 5.2},
    {"bcr": 1.0, "bdry": 4.3},
    {"bbox": (9.0, 9.0, None), "bcr": 0.8, "bdry": 5.0},
]


@pytest.mark.parametrize("known", FLOORS)
def test_floors_and_boundary_follow_what_is_given(model, known):
    given = Attributes("partial", mass=replace(Attributes("").mass, **known))
    for sample in draw(model, 60, given=given):
        assert_possible(sample)
        for name, value in known.items():
            found = getattr(sample.mass, name)
            pairs = zip(value, found, strict=True) if isinstance(value, tuple) else [(value, found)]
            assert all(stated is None or stated == drawn for stated, drawn in pairs)


@pytest.mark.parametrize("storey", [2.4, 2.7, 3.3])
def test_a_stated_storey_height_is_kept_and_suits_the_floors(model, storey):
    given = replace(Attributes("partial", storey_height=storey), mass=replace(WIDE, far=1.8))
    for sample in draw(model, 60, given=given):
        assert_possible(sample)
        assert sample.storey_height == storey


WIDE = replace(Attributes("").mass, bbox=(11.0, 9.0, None))
GARAGE = (0.5, 0.5, 4.0, 5.0, 2.5, 0.6)
IMPOSSIBLE = {
    "/mass/arf": replace(WIDE, arf=(0.5, 0.4, 0.0)),
    "/mass/arf/1": replace(WIDE, arf=(None, 0.7, None)),
    "/mass/far": replace(WIDE, far=0.5, bcr=0.8),
    "/mass/bdry": replace(WIDE, bdry=3.9),
    "/mass/garage/2": replace(WIDE, garage=(0.5, 0.5, 12.0, 5.0, 2.5, 0.6)),
    "/mass/garage/0": replace(WIDE, garage=(0.05, *GARAGE[1:])),
    "/mass/porch/0/1": replace(WIDE, porch=((0.5, 0.9, 2.0, 1.0, 2.5, 0.6), (None,) * 6)),
    "/element/roof": WIDE,
    "/present/garage": replace(WIDE, garage=GARAGE),
}


@pytest.mark.parametrize("pointer", IMPOSSIBLE)
def test_contradictions_are_infeasible_and_named(model, pointer):
    given = Attributes("odd", mass=IMPOSSIBLE[pointer])
    if pointer == "/element/roof":
        given = replace(given, element=ElementAttributes(roof={"flat": 0, "gable": 0, "hip": 0}))
    if pointer == "/present/garage":
        given = replace(given, present=Present(garage=False))
    assert [found.pointer for found in contradictions(given)] == [pointer]
    with pytest.raises(Infeasible, match=f"odd: {pointer}: "):
        draw(model, 1, given=given)


def test_a_part_with_a_size_of_0_is_absent(model):
    given = Attributes("none", mass=replace(WIDE, garage=(None, 0.0, 0.0, None, None, 0.0)))
    for sample in draw(model, 20, given=given):
        assert sample.mass.garage == (0.0,) * 6
