"""Draws: physically possible, repeatable, conditioned exactly; completion keeps what is given."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from facade_tools.artifacts.attributes import Attributes, Bounds, ElementAttributes, Present
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import Given, dump_line
from facade_tools.artifacts.provenance import Provenance
from facade_tools.artifacts.validation import check
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.exteriors.conditioning import draw_given
from facade_tools.exteriors.coordinates import read_attributes
from facade_tools.exteriors.evaluation import negative_log_density
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.physical import settle
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.relations import contradictions
from facade_tools.exteriors.row_bytes import Row, joined, text_column
from facade_tools.exteriors.sample_lines import sample_lines
from facade_tools.exteriors.samples import SampleOptions, sample_attributes
from facade_tools.exteriors.sampling import draw_bits
from facade_tools.exteriors.serialisation import network_of
from facade_tools.exteriors.transforms import forward


@pytest.fixture(scope="module")
def houses():
    return shipped_prior()


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


@pytest.fixture(scope="module")
def model(houses):
    return learn_model(houses[::3], rng=np.random.default_rng(0), options=LearnOptions(largest=4))


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


@pytest.fixture(scope="module")
def plain(houses):
    """Without lateral edges: every conditional is exact."""
    options = LearnOptions(variant="no-lateral", largest=4)
    return learn_model(houses[::3], rng=np.random.default_rng(0), options=options)


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


# --- lines and shared values --------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"neighbours": False, "style": 1}, {"top": True}])
def test_columns_write_the_same_bytes_as_artifacts(model, options):
    provenance = Provenance("sample", 3, {"odd": 'per cent % "quoted" \x00'}, ())
    chosen = SampleOptions(**options, prefix="%", first=7)
    wanted = [
        dump_line(encode(replace(row, provenance=provenance)))
        for row in sample_attributes(model, 40, rng=np.random.default_rng(2), options=chosen)
    ]
    found = sample_lines(
        model, 40, rng=np.random.default_rng(2), given=None, options=chosen, provenance=provenance
    )
    found = [apart for lines in found for apart in lines.apart()]
    assert [line for _, line in found] == wanted
    assert [identity for identity, _ in found] == [f"%-{i}" for i in range(7, 47)]


def test_rows_with_numbers_of_any_size_are_the_same_bytes():
    """Of numbers, texts and pieces, also numbers that the compiled loop leaves to Python."""
    rng = np.random.default_rng(0)
    numbers = 10.0 ** rng.uniform(-30, 30, (50, 3))
    numbers[:5] = [[0.0, -0.0, 1e-12], [1e12, 1e16, 1e22], [1.0, 0.5, 3e-320], [2, 3, 4], [5, 6, 7]]
    words = ("é", "", '"q"')
    index = rng.integers(0, 3, 50)
    row = Row(
        (b"[", b",", b",", b",", b"]\n"), (*numbers.T[:2], text_column(words, index), numbers.T[2])
    )
    found = joined(row, 50).decode().splitlines()
    for line, three, word in zip(found, numbers.tolist(), index, strict=True):
        texts = [dump_line(x).decode()[:-1] for x in three]
        assert line == f"[{texts[0]},{texts[1]},{words[word]},{texts[2]}]"
    with pytest.raises(ValueError, match="cannot be written"):
        joined(Row((b"", b""), (np.array([np.nan]),)), 1)
    assert joined(Row((b"", b""), (np.empty(0),)), 0) == b""


def test_shared_values_come_back(houses):
    """Eaves at exactly 2.4384 or 5.1816 m in three of four houses."""
    rng = np.random.default_rng(0)
    rows = []
    for house in houses[:160]:
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
