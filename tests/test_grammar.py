from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.grammar import Grammar, Rule, Size
from facade_tools.artifacts.store import read_one
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.grammar.derivation import leaves, nodes, painted
from facade_tools.grammar.expressions import automaton, parse, shape
from facade_tools.grammar.extents import needed_sizes
from facade_tools.grammar.library import builtin, builtin_names, load
from facade_tools.grammar.plan import plan
from facade_tools.grammar.sampling import sample_derivation
from facade_tools.grammar.segments import Bounds, Moves, best_cut

BUILTIN = builtin_names()


def accepted(text: str, word: str) -> bool:
    machine = automaton(parse(text))
    if not word:
        return machine.empty
    states = {s for s in machine.first if machine.symbols[s] == word[0]}
    for letter in word[1:]:
        states = {t for s in states for t in machine.follow[s] if machine.symbols[t] == letter}
    return bool(states & machine.last)


@pytest.mark.parametrize(
    ("text", "pattern"),
    [
        ("a (b a)*", "a(ba)*"),
        ("(a? b c)+", "(a?bc)+"),
        ("a | b c?", "a|bc?"),
        ("(a | b)* c", "(a|b)*c"),
        ("((a? b)* c?)+", "((a?b)*c?)+"),
    ],
)
def test_automata_accept_what_the_expression_says(text, pattern):
    import re

    for length in range(6):
        for letters in itertools.product("abc", repeat=length):
            word = "".join(letters)
            assert accepted(text, word) == bool(re.fullmatch(pattern, word)), word


@pytest.mark.parametrize("text", ["", "(", "a)", "a | ", "*a", "a $ b", "()", "a" * 1001])
def test_bad_expressions_are_refused(text):
    with pytest.raises(InvalidInput):
        parse(text)


def test_shapes_of_expressions_forget_names_only():
    assert shape(parse("Wa (TL Wa)*")) == shape(parse("Rf (TL Rf)*"))
    assert shape(parse("Wa (TL Wa)*")) != shape(parse("Wa (TL Wa)+"))


def random_problem(seed, states=3, length=7, widest=5):
    rng = np.random.default_rng(seed)
    allowed = rng.random((states, states)) < 0.7
    machine = Moves(allowed, rng.random(states) < 0.8, rng.random(states) < 0.8)
    least = rng.integers(1, 3, states)
    most = least + rng.integers(0, widest, states)
    weight = rng.random(states) < rng.choice([0.0, 0.5, 1.0])
    prior = np.column_stack([rng.uniform(1, 4, states), rng.uniform(0, 1, states), weight])
    return rng.random((states, length)), machine, Bounds(least, most, prior)


def size_cost(limits, state, length):
    typical, steep, weight = limits.prior[state]
    return weight * ((length - typical) * steep) ** 2 / 2


def brute_force(costs, machine, limits):
    length = costs.shape[1]
    best = np.inf

    def extend(at, before, total):
        nonlocal best
        if at == length:
            if machine.last[before]:
                best = min(best, total)
            return
        for state in range(len(costs)):
            allowed = machine.first[state] if before < 0 else machine.allowed[before, state]
            for size in range(limits.least[state], limits.most[state] + 1):
                if allowed and at + size <= length:
                    cost = costs[state, at : at + size].sum() + size_cost(limits, state, size)
                    extend(at + size, state, total + cost)

    extend(0, -1, 0.0)
    return best


@pytest.mark.parametrize("seed", range(60))
def test_the_programme_of_one_axis_equals_brute_force(seed):
    problem = random_problem(seed)
    cut = best_cut(*problem)
    expected = brute_force(*problem)
    if cut is None:
        assert expected == np.inf
    else:
        assert cut.cost == pytest.approx(expected, abs=1e-6)
        assert cut.bounds[0] == 0
        assert cut.bounds[-1] == problem[0].shape[1]


def plain_programme(costs, machine, limits):
    """Return the cheapest cost of the whole line: every end, state, size and word before tried."""
    states, length = costs.shape
    end = np.full((states, length + 1), np.inf)
    for at in range(1, length + 1):
        for state in range(states):
            for size in range(limits.least[state], min(at, limits.most[state]) + 1):
                befores = end[machine.allowed[:, state], at - size]
                entered = befores.min(initial=np.inf)
                if size == at and machine.first[state]:
                    entered = 0.0
                cost = costs[state, at - size : at].sum() + size_cost(limits, state, size)
                end[state, at] = min(end[state, at], entered + cost)
    return end[machine.last, length].min(initial=np.inf)


@given(st.integers(0, 10**6), st.integers(1, 70), st.integers(1, 90))
@settings(max_examples=60, deadline=None)
def test_long_lines_cost_what_the_plain_programme_says(seed, length, widest):
    problem = random_problem(seed, states=4, length=length, widest=widest)
    cut = best_cut(*problem)
    expected = plain_programme(*problem)
    assert (np.inf if cut is None else cut.cost) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", BUILTIN)
def test_shipped_grammars_round_trip_and_compile(name):
    grammar = builtin(name)
    assert decode(encode(grammar), "grammar") == grammar
    made = plan(grammar)
    assert set(made.labels) <= set(grammar.terminals.values())
    assert load(name) == grammar


@given(st.sampled_from(BUILTIN), st.integers(0, 10**6), st.integers(60, 400))
@settings(max_examples=40, deadline=None)
def test_random_derivations_tile_the_canvas(name, seed, width):
    grammar = builtin(name)
    tree = sample_derivation(grammar, width, 300.0, rng=np.random.default_rng(seed))
    area = sum((n.scope[2] - n.scope[0]) * (n.scope[3] - n.scope[1]) for n in leaves(tree))
    assert area == pytest.approx(width * 300.0)
    for node in nodes(tree):
        for child in node.children:
            assert node.scope[0] - 1e-6 <= child.scope[0] <= child.scope[2] <= node.scope[2] + 1e-6
            assert node.scope[1] - 1e-6 <= child.scope[1] <= child.scope[3] <= node.scope[3] + 1e-6
        if node.children:
            word = [child.symbol for child in node.children]
            assert derivable(grammar.rules[node.symbol].into, word)


def derivable(text, word):
    machine = automaton(parse(text))
    states = {s for s in machine.first if machine.symbols[s] == word[0]}
    for name in word[1:]:
        states = {t for s in states for t in machine.follow[s] if machine.symbols[t] == name}
    return bool(states & machine.last)


def column_borders(tree, symbol):
    floors = [n for n in nodes(tree) if n.symbol == symbol]
    return {tuple(round(c.scope[2], 6) for c in floor.children) for floor in floors}


def test_factorised_floors_are_derived_alike_and_others_each():
    rng = np.random.default_rng(5)
    alike = sample_derivation(builtin("haussmann"), 200, 300, rng=rng)
    assert len(column_borders(alike, "FL")) == 1
    each = sample_derivation(builtin("haussmann-floors"), 200, 300, rng=rng)
    assert len(column_borders(each, "FL")) > 1


def test_painted_trees_hold_every_leaf():
    grammar = builtin("plain")
    tree = sample_derivation(grammar, 120, 200, rng=np.random.default_rng(0))
    index = {"wall": 2, "window": 1, "balcony": 3, "door": 4}
    assert set(np.unique(painted(tree, (200, 120), index))) <= set(index.values())


def toy(**rules):
    return Grammar("toy", "A", {"a": "wall", "b": "window"}, rules)


@pytest.mark.parametrize(
    ("grammar", "pointer"),
    [
        (Grammar("toy", "B", {"a": "wall"}, {"A": Rule("up", "a")}), "/axiom"),
        (toy(A=Rule("up", "a C")), "/rules/A/into"),
        (toy(A=Rule("up", "a (")), "/rules/A/into"),
        (toy(A=Rule("up", "a", sizes={"b": Size()})), "/rules/A/sizes/b"),
        (toy(A=Rule("up", "a", sizes={"a": Size(min=0.2, max=0.1)})), "/rules/A/sizes/a"),
        (toy(A=Rule("up", "a", sizes={"a": Size(weight=1.0)})), "/rules/A/sizes/a"),
        (toy(A=Rule("up", "a", like="Z")), "/rules/A/like"),
        (toy(A=Rule("up", "A a")), "/rules/A/into"),
        (toy(A=Rule("up", "B"), B=Rule("right", "C"), C=Rule("right", "a")), "/rules/C/into"),
        (toy(A=Rule("up", "B"), B=Rule("right", "a*")), "/rules/B/into"),
        (
            toy(
                A=Rule("up", "B"),
                B=Rule("right", "C D"),
                C=Rule("up", "a b"),
                D=Rule("up", "a b?"),
            ),
            "/rules/D/into",
        ),
    ],
)
def test_grammars_that_do_not_fit_are_refused_with_the_place(grammar, pointer):
    with pytest.raises(InvalidInput) as error:
        plan(grammar)
    assert error.value.place.pointer == pointer


def test_derivations_that_do_not_end_are_refused():
    grammar = toy(A=Rule("up", "A a"))
    with pytest.raises(InvalidInput, match="/rules/A/into: A never ends"):
        sample_derivation(grammar, 10, 10, rng=np.random.default_rng(0))
    grammar = toy(A=Rule("up", "A (A | a) | a"))
    with pytest.raises(Infeasible, match=r"does not end: .* at 'A'"):
        for seed in range(40):
            sample_derivation(grammar, 10, 10, rng=np.random.default_rng(seed))


def rows_of(tile, **more):
    """Floors of tiles that are nothing but a window, of a height that only the window bounds."""
    return toy(
        A=Rule("up", "a (B a)+", **more),
        B=Rule("right", "a (C a)+"),
        C=Rule("up", "b", sizes={"b": tile}),
    )


SIZES = [(0.2, 0.25), (0.9, 0.95), (0.05, 0.06)]


@pytest.mark.parametrize("bounds", SIZES)
@pytest.mark.parametrize("seed", range(4))
def test_random_sizes_lie_within_their_bounds(bounds, seed):
    grammar = rows_of(Size(*bounds))
    tree = sample_derivation(grammar, 240, 360, rng=np.random.default_rng(seed))
    windows = [n.scope[3] - n.scope[1] for n in nodes(tree) if n.symbol == "b"]
    assert windows
    assert 360 * bounds[0] - 1 <= min(windows) <= max(windows) <= 360 * bounds[1] + 1


@pytest.mark.parametrize("name", BUILTIN)
def test_random_facades_of_shipped_grammars_keep_their_bounds(name):
    grammar = builtin(name)
    for seed in range(40):
        tree = sample_derivation(grammar, 240, 360, rng=np.random.default_rng(seed))
        for node in nodes(tree):
            axis = 0 if node.split == "right" else 1
            for part in node.children:
                size = grammar.rules[node.symbol].sizes.get(part.symbol, Size())
                length = part.scope[axis + 2] - part.scope[axis]
                assert 360 * size.min - 1 <= length <= 360 * size.max + 1


def test_sizes_that_fit_no_facade_are_infeasible():
    grammar = toy(A=Rule("up", "a b a b a", sizes={"b": Size(min=0.6)}))
    with pytest.raises(Infeasible, match="/rules/A: no parts fill"):
        sample_derivation(grammar, 240, 360, rng=np.random.default_rng(0))


def test_needed_sizes_follow_from_the_parts():
    sizes = needed_sizes(rows_of(Size(0.2, 0.25)))
    assert (sizes["A"]["B"].min, sizes["A"]["B"].max) == (0.2, 0.25)
    assert sizes["A"]["a"] == sizes["B"]["C"] == Size()
    stacked = toy(A=Rule("up", "B"), B=Rule("up", "(a b?)+", sizes={"a": Size(0.1, 0.3)}))
    assert needed_sizes(stacked)["A"]["B"] == Size(0.1, 10.0)
    kept = rows_of(Size(0.2, 0.25), sizes={"B": Size(max=0.1)})
    assert needed_sizes(kept)["A"]["B"] == Size(max=0.1)


def test_sample_grammar_writes_parses_that_validate(facade, tmp_path):
    out = tmp_path / "facades.jsonl"
    done = facade("sample-grammar", "tskp10", "-n", 3, "-o", out, "--pictures", tmp_path / "p")
    assert done.returncode == 0, done.stderr
    assert len(list((tmp_path / "p").iterdir())) == 3
    assert facade("validate", out).returncode == 0
    again = facade("sample-grammar", "tskp10", "-n", 3)
    assert again.stdout == out.read_bytes()


def test_sizes_that_cannot_be_kept_name_the_file_and_the_rule(facade_here, tmp_path):
    path = tmp_path / "tight.yaml"
    path.write_text(
        "schema: facade-tools/grammar/1\nid: tight\naxiom: A\nterminals: {a: wall, b: window}\n"
        "rules: {A: {split: up, into: a b a b a, sizes: {b: {min: 0.6}}}}\n"
    )
    done = facade_here("sample-grammar", path)
    assert (done.returncode, done.stdout) == (4, b"")
    assert f"{path}: no facade of 240 × 360 pixels".encode() in done.stderr
    assert b"/rules/A" in done.stderr


def test_several_facades_do_not_go_into_one_json_file(facade_here, tmp_path):
    out = tmp_path / "two.json"
    done = facade_here("sample-grammar", "plain", "-n", 2, "-o", out)
    assert done.returncode == 2
    assert b"several facades" in done.stderr
    assert not out.exists()


def test_rules_that_do_not_fit_are_named_with_their_line(facade_here, tmp_path):
    path = tmp_path / "bad.yaml"
    text = "id: bad\naxiom: A\nterminals: {a: wall}\nrules:\n  A: {split: up, into: a b}\n"
    for bad, place in ((text, ":5: /rules/A/into: "), (f"{text}rulez: {{}}\n", ":6: /rulez: ")):
        path.write_text(bad)
        done = facade_here("sample-grammar", path)
        assert (done.returncode, done.stdout) == (3, b"")
        assert f"{path}{place}".encode() in done.stderr


def test_unknown_grammars_are_named(facade):
    done = facade("sample-grammar", "nowhere.yaml")
    assert done.returncode == 3
    assert b"neither a file nor a shipped grammar" in done.stderr


def test_the_sample_grammar_file_works(facade, tmp_path):
    from pathlib import Path

    path = Path(__file__).resolve().parent.parent / "sample_data" / "grammars" / "row-house.yaml"
    grammar = read_one(str(path), "grammar")
    assert plan(replace(grammar, title="")).labels


def test_a_parse_becomes_a_closed_slab_with_parts_in_relief(facade, tmp_path):
    from facade_tools.grammar.relief import metres_per_pixel, parse_scene

    out = tmp_path / "facade.json"
    assert facade("sample-grammar", "haussmann", "-o", out).returncode == 0
    parse = read_one(str(out), "parse")
    scene = parse_scene(parse)
    for mesh in scene.meshes:
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        assert volume > 0
        assert np.ptp(mesh.vertices, axis=0).min() > 0
    names = [mesh.name for mesh in scene.meshes]
    assert names[0] == "mass"
    assert len(set(names)) == len(names)
    gaps = np.diff(sorted({floor.y1 for floor in parse.floors}))
    assert np.median(gaps) * metres_per_pixel(parse) == pytest.approx(3.0)
    assert facade("view", out, "-o", tmp_path / "facade.png").returncode == 0
    assert facade("export", out, "-o", tmp_path / "facade.glb").returncode == 0
