"""Draws: physically possible, repeatable, named, apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn import assert_possible, draw, house_model

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.exteriors.coordinates import read_attributes
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.physical import Columns, settle, storey_heights, storey_ranges
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.relations import contradictions
from facade_tools.exteriors.sampling import draw_bits
from facade_tools.exteriors.serialisation import network_of


@pytest.fixture(scope="module")
def houses():
    return shipped_prior()


@pytest.fixture(scope="module")
def model():
    return house_model()


def test_roof_bits_are_as_frequent_as_their_style_has_them(model):
    network = network_of(model)
    roofs = [i for i, name in enumerate(network.layout.bits) if name.startswith("roof.")]
    for shares in ([0.2, 0.6, 0.4], [0.05, 0.7, 0.25], [0.1, 1.0, 0.1]):
        bits = network.bits.copy()
        bits[:, roofs] = shares
        styles = np.zeros(20_000, dtype=np.int64)
        drawn = draw_bits(replace(network, bits=bits), styles, np.random.default_rng(1))[:, roofs]
        assert drawn.any(axis=1).all()
        assert drawn.mean(axis=0) == pytest.approx(shares, abs=0.012)


@pytest.mark.parametrize("variant", ["full", "flat", "gmm", "no-middle", "faithful"])
def test_every_sample_is_possible(houses, model, variant):
    if variant != "full":
        faithful = variant == "faithful"
        options = LearnOptions(
            variant="full" if faithful else variant, faithful=faithful, largest=2
        )
        model = learn_model(houses[::6], rng=np.random.default_rng(0), options=options)
    for sample in draw(model, 300):
        assert_possible(sample)


def test_sample_i_does_not_depend_on_how_many(model):
    few, many = draw(model, 5), draw(model, 2000)
    assert [dump_line(encode(a)) for a in few] == [dump_line(encode(a)) for a in many[:5]]
    assert [a.id for a in many[:2]] == ["0-0", "0-1"]
    assert draw(model, 0) == []


def test_log_density_of_a_sample_is_what_evaluate_says(model):
    samples = draw(model, 50)
    found = -negative_log_density(model, samples)
    assert [a.sample.log_density for a in samples] == pytest.approx(found.tolist(), abs=1e-6)


def test_neighbours_name_training_buildings(model, houses):
    ids = {h.id for h in houses[::3]}
    for sample in draw(model, 20):
        assert set(sample.sample.neighbours.values()) <= ids
        assert "bbox" in sample.sample.neighbours


def test_style_is_fixed(model):
    assert {a.sample.style for a in draw(model, 50, style=1)} == {1}
    with pytest.raises(InvalidInput, match="expected one of"):
        draw(model, 1, style=99)


def test_samples_and_houses_contradict_nothing(model, houses):
    for row in (*houses, *draw(model, 500)):
        assert not list(contradictions(row))


def test_a_second_floor_of_almost_nothing_is_none(model):
    """As small as an atom's tolerance: the storeys count it out, so no share may be written."""
    network = network_of(model)
    low = [row for row in draw(model, 40) if row.mass.bbox[2] < 7]
    given = read_attributes(low, network.layout)
    (r1,) = (v for v, g in zip(given.values, network.layout.groups, strict=True) if g.name == "far")
    r1[:] = 5e-7
    settle(given.values, network.layout)
    assert len(r1) >= 3
    assert (r1 == 0).all()


@pytest.mark.parametrize(
    ("height", "r1", "r2", "storey"),
    [
        (2.44, 0.0, 0.0, 3.0),
        (4.88, 1.0, 0.0, 2.44),  # of 3 m the upper one would be 1.88 m high
        (5.4, 1.0, 0.0, 3.0),
        (4.4, 1.0, 0.0, 2.933),  # eaves of a storey and a half: there is no better
        (17.0, 1.0, 1.0, 17.0 / 6),
        (18.0, 1.0, 1.0, 3.0),
        (7.2, 1.0, 1.0, 2.4),
    ],
)
def test_the_uppermost_storey_is_as_high_as_a_person_needs(model, height, r1, r2, storey):
    network = network_of(model)
    rows = read_attributes(draw(model, 1), network.layout)
    columns = Columns(rows.values, network.layout)
    for name, value in (("height", height), ("r1", r1), ("r2", r2 if r1 else np.inf)):
        columns.get(name)[0][:] = value
    found = storey_heights(rows.values, network.layout, 3.0)[0]
    assert found == pytest.approx(storey, abs=1e-3)
    floors, least, most = storey_ranges(rows.values, network.layout)
    assert floors[0] == 1 + (r1 > 0) + (r2 > 0)
    assert least[0] <= found <= most[0]


def test_porch_before_the_house_is_no_wider_than_the_house(model):
    for sample in draw(model, 500):
        width = sample.mass.bbox[0]
        for (px, py, size, *_), front in zip(sample.mass.porch, (True, False), strict=True):
            if size and (py < 0 if front else py > 1) and abs(px - 0.5) < 0.5:
                assert size <= width * (1 + 1e-9)
                assert sample.mass.garage[2] or abs(px - 0.5) + size / width / 2 <= 0.5 + 1e-9


def test_top_is_sorted_and_distinct(model):
    samples = draw(model, 10, top=True)
    density = [a.sample.log_density for a in samples]
    assert density == sorted(density, reverse=True)
    assert len({a.mass.bbox for a in samples}) == 10
    assert min(density) > np.median([a.sample.log_density for a in draw(model, 200)])


def test_min_distance_keeps_samples_apart(model):
    from facade_tools.exteriors.completion import distances
    from facade_tools.exteriors.neighbours import Neighbours

    samples = draw(model, 20, min_distance=0.5)
    network = network_of(model)
    finder = Neighbours(model, network)
    points = finder.whole(read_attributes(samples, network.layout))
    gaps = distances(points, points) + 9 * np.eye(20)
    assert gaps.min() >= 0.49
    assert distances(points, finder.training()).min() >= 0.49
    with pytest.raises(Infeasible):
        draw(model, 5, min_distance=50.0)
