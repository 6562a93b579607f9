from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from facade_tools.artifacts.grammar import Grammar, Node, Rule, Size
from facade_tools.artifacts.parse import LABELS
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.grammar.derivation import leaves, painted
from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.grammar.reading import label_index
from facade_tools.grammar.sampling import sample_derivation
from facade_tools.grammar.segments import Cut
from facade_tools.segmentation import dp, walk
from facade_tools.segmentation.deriving import Frame, derivation, floors_of, regions_of
from facade_tools.segmentation.energy import Layout, column_costs, energy, field_of, state_costs
from facade_tools.segmentation.random_parse import in_pixels

CLASSES = LABELS[1:]

TOY = Grammar(
    "toy",
    "A",
    {"w": "wall", "o": "window", "s": "sky"},
    {
        "A": Rule("up", "w? (F w)+ s?"),
        "F": Rule("right", "w (o w)+", sizes={"o": Size(0.2, 0.5)}),
    },
)


def beliefs(labels, certainty=0.9):
    other = (1 - certainty) / (len(CLASSES) - 1)
    out = np.full((len(CLASSES), *labels.shape), other, np.float32)
    for k in range(len(CLASSES)):
        out[k][labels == k + 1] = certainty
    return out


def random_beliefs(seed, height, width):
    rng = np.random.default_rng(seed)
    shares = rng.random((len(CLASSES), height, width)).astype(np.float32) ** 4
    return shares / shares.sum(axis=0)


def words(machine, length, limit):
    """All cuttings of a line into words of an automaton."""

    def extend(states, bounds):
        if bounds[-1] == length:
            if states[-1] in machine.last:
                yield Cut(tuple(states), tuple(bounds), 0.0)
            return
        choices = machine.follow[states[-1]] if states else machine.first
        for state in choices:
            for end in range(bounds[-1] + limit[0][state], length + 1):
                if end - bounds[-1] <= limit[1][state]:
                    yield from extend([*states, state], [*bounds, end])

    yield from extend([], [0])


@pytest.mark.parametrize("seed", range(6))
def test_dp_finds_what_brute_force_finds(seed):
    made = plan(TOY)
    field = field_of(random_beliefs(seed, 5, 6), CLASSES, made)
    rows = list(words(made.rows, 5, ([1] * 9, [5] * 9)))
    columns = list(words(made.groups[0].automaton, 6, ([1, 1, 1], [6, 2, 6])))
    best = np.inf
    for row, column in itertools.product(rows, columns):
        owner = tuple(-1 if made.states[s].group is None else 0 for s in row.states)
        best = min(best, energy(field, made, Layout(row, (column,), owner)))
    solution = dp.solve(field, made)
    # alternation is exact in each half; from its starts it reaches the optimum of such pictures
    assert best - 1e-6 <= solution.energy <= best * 1.06
    assert solution.bound <= best + 1e-6


@pytest.mark.parametrize("name", ["haussmann", "haussmann-floors", "plain", "tskp10"])
def test_energies_from_sums_equal_direct_sums(name):
    made = plan(builtin(name))
    field = field_of(random_beliefs(1, 60, 50), CLASSES, made)
    solution = dp.solve(field, made)
    layout = solution.layout
    index = label_index()
    labels = painted(derivation(made, layout, Frame((60, 50), (60, 50))), (60, 50), index)
    direct = 0.0
    for label, plane in field.label.items():
        direct += field.cost[plane][::-1][labels == index[label]].sum()
    assert solution.energy == pytest.approx(direct)
    assert solution.bound <= solution.energy + 1e-6
    states = layout.rows.states
    sets = [None if own < 0 else layout.columns[own] for own in layout.owner]
    table = state_costs(field, made, states, sets)
    spans = list(zip(layout.rows.bounds, layout.rows.bounds[1:], strict=False))
    rows = sum(table[i, a:b].sum() for i, (a, b) in enumerate(spans))
    assert rows == pytest.approx(direct)


def test_column_costs_equal_direct_sums():
    made = plan(builtin("plain"))
    field = field_of(random_beliefs(2, 30, 20), CLASSES, made)
    rows = [(s, 3, 9) for s, state in enumerate(made.states) if state.group == 1]
    costs = column_costs(field, made, rows)
    for kind in range(costs.shape[0]):
        planes = [field.label[made.states[s].labels[kind]] for s, _, _ in rows]
        direct = sum(field.cost[plane, 3:9].sum(axis=0) for plane in planes)
        np.testing.assert_allclose(costs[kind], direct)


def rendered_labels(name, seed, width=180, height=240):
    tree = sample_derivation(builtin(name), width, height, rng=np.random.default_rng(seed))
    turned = in_pixels(tree, height)
    return turned, painted(turned, (height, width), label_index())


def without_priors(grammar):
    """Sizes that only bound: priors of sizes would trade clean pixels for usual sizes."""
    rules = {
        name: replace(rule, sizes={k: replace(s, weight=0.0) for k, s in rule.sizes.items()})
        for name, rule in grammar.rules.items()
    }
    return replace(grammar, rules=rules)


def solved(name, belief):
    made = plan(without_priors(builtin(name)))
    shape = belief.shape[1:]
    solution = dp.solve(field_of(belief, CLASSES, made), made)
    tree = derivation(made, solution.layout, Frame(shape, shape))
    return tree, painted(tree, shape, label_index()), solution


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["plain", "tskp10", "haussmann"])
def test_a_known_facade_is_recovered_exactly_from_clean_beliefs(name, seed):
    _, truth = rendered_labels(name, seed)
    _, found, solution = solved(name, beliefs(truth))
    assert (found == truth).mean() == 1.0
    assert solution.optimal


@pytest.mark.parametrize("seed", range(3))
def test_a_known_facade_is_recovered_within_a_pixel_from_noisy_beliefs(seed):
    _, truth = rendered_labels("plain", seed)
    rng = np.random.default_rng(seed)
    noisy = truth.copy()
    wrong = rng.random(truth.shape) < 0.3
    noisy[wrong] = rng.choice([1, 2, 3, 4], wrong.sum())
    _, found, _ = solved("plain", beliefs(noisy, 0.6))
    near = np.zeros(truth.shape, bool)
    for dy, dx in itertools.product((-1, 0, 1), repeat=2):
        near |= np.roll(truth, (dy, dx), (0, 1)) == found
    assert near.mean() > 0.999


def test_regions_tile_and_floors_are_storeys():
    tree, truth = rendered_labels("haussmann-floors", 4)
    tree, found, _ = solved("haussmann-floors", beliefs(truth))
    regions = regions_of(tree)
    canvas = np.zeros(truth.shape, int)
    for r in regions:
        canvas[r.y0 : r.y1, r.x0 : r.x1] += 1
    assert (canvas == 1).all()
    assert (found == truth).mean() > 0.98
    floors = floors_of(tree)
    assert all(f.y0 < f.y1 and list(f.columns) == sorted(f.columns) for f in floors)
    assert [f.y1 for f in floors] == sorted((f.y1 for f in floors), reverse=True)
    assert all(leaf.label for leaf in leaves(tree))


def test_parts_of_a_tile_with_one_label_are_one_region():
    def leaf(label, *scope):
        return Node(label, scope, label=label)

    door = Node("D", (0, 2, 4, 9), "up", None, (
        leaf("door", 0, 6, 4, 9), leaf("wall", 0, 6, 4, 6), leaf("door", 0, 4, 4, 6),
        leaf("wall", 0, 2, 4, 4)))  # fmt: skip
    shop = Node("S", (4, 2, 9, 9), "up", None, (leaf("door", 4, 2, 9, 9),))
    row = Node("R", (0, 2, 9, 9), "right", None, (door, shop))
    tree = Node("I", (0, 0, 9, 9), "up", None, (row, leaf("wall", 0, 0, 9, 2)))
    assert [(r.label, r.x0, r.y0, r.x1, r.y1) for r in regions_of(tree)] == [
        ("door", 0, 4, 4, 9), ("wall", 0, 2, 4, 4), ("door", 4, 2, 9, 9), ("wall", 0, 0, 9, 2)
    ]  # fmt: skip


def test_the_walk_falls_and_never_beats_dp():
    _, truth = rendered_labels("plain", 1, 90, 120)
    for name in ("plain", "haussmann-floors"):
        made = plan(builtin(name))
        field = field_of(beliefs(truth, 0.7), CLASSES, made)
        walked = walk.solve(field, made, rng=np.random.default_rng(0))
        assert list(walked.trace) == sorted(walked.trace, reverse=True)
        assert walked.energy == pytest.approx(walked.trace[-1])
        assert dp.solve(field, made).energy <= walked.energy + 1e-6
        again = walk.solve(field, made, rng=np.random.default_rng(0))
        assert again.layout == walked.layout


def test_the_compiled_energy_of_the_walk_equals_its_plain_version():
    made = plan(builtin("plain"))
    field = field_of(random_beliefs(3, 40, 30), CLASSES, made)
    solution = dp.solve(field, made)
    rng = np.random.default_rng(0)
    axes = walk._axes(field, made, list(range(len(made.groups))))
    images = walk._images(field, made)
    policy = walk._seeded(field, made, axes, images, rng)
    for i, cut in enumerate((solution.layout.rows, *solution.layout.columns)):
        walk._store(policy, i, cut)
    arrays = walk._arrays(policy, axes, images)
    assert walk.evaluate(*arrays) == pytest.approx(solution.energy)
    assert walk.evaluate.py_func(*arrays) == pytest.approx(solution.energy)


def test_pictures_too_small_for_the_grammar_are_infeasible():
    made = plan(builtin("tskp10"))
    with pytest.raises(Infeasible):
        dp.solve(field_of(random_beliefs(0, 2, 2), CLASSES, made), made)


def test_labels_that_the_classifier_lacks_are_named():
    made = plan(builtin("haussmann"))
    with pytest.raises(InvalidInput, match="chimney"):
        field_of(random_beliefs(0, 9, 9)[:7], CLASSES[:7], made)
