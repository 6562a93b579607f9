"""IMAW15: worked examples, alignment against a brute force, sizing against a reference."""

from __future__ import annotations

import random
import time
from dataclasses import replace

import numpy as np
import pytest
from layering_checks import broken, compared, reference_sizes
from layering_designs import random_direction, words_of
from layering_documents import drawn
from layering_oracle import TooLarge, best, best_of, least_cost
from scipy.optimize import linprog

from facade_tools.errors import Infeasible
from facade_tools.layering.alignment import prepare
from facade_tools.layering.evaluation import evaluate
from facade_tools.layering.language import Substituted, parse
from facade_tools.layering.problem import Candidate, Direction, LayerPattern, Rule, Span
from facade_tools.layering.search import Clock, GroupSearch
from facade_tools.layering.solve import solve_direction
from facade_tools.layering.tasks import full_key
from facade_tools.layering.words import Expansion, expand

WORKED = {"A": Rule(2), "B": Rule(3), "C": Rule(2), "e": Rule(8), "f": Rule(5)}
CEC = Substituted(parse("cec"), (("c", parse("C")),))
FAF = Substituted(parse("faf"), (("a", parse("A")),))


def direction(nodes, canvas, rules=WORKED, counters=None):
    rows = tuple(LayerPattern(f"layer {i}", f"P{i}", node) for i, node in enumerate(nodes))
    return Direction("x", canvas, rules, {"default": rows}, counters or {})


def answer(problem, seconds=60.0, few=6):
    prepare()
    clock = Clock(time.process_time() + seconds, now=time.process_time)  # whatever else runs
    return GroupSearch(problem, ("default",), clock, few=few).answer()


def columns(alignment):
    rows = range(len(alignment.candidate.words))
    return [
        ["".join(a.name for a in alignment.column(i, j)) for j in range(alignment.count)]
        for i in rows
    ]


class TestWorkedExamples:
    @pytest.mark.parametrize(
        ("borders", "error"),
        [
            ([(2, 3), (3, 5)], 6.0),  # Ce|C over ABA|BA
            ([(1, 0), (2, 5), (3, 5)], 4.0),  # C|e|C over ε|ABABA|ε
            ([(1, 1), (2, 4), (3, 5)], 0.0),  # C|e|C over A|BAB|A
        ],
    )
    def test_three_alignments_of_two_words(self, borders, error):
        problem = direction([CEC, parse("ABABA")], 12.0)
        assert self.measured(problem, borders)[1] == pytest.approx(error, abs=1e-12)

    @pytest.mark.parametrize(
        ("borders", "measures"),
        [
            ([(1, 1, 1), (2, 2, 4), (3, 3, 5)], (18.0, 12.0)),
            ([(0, 1, 1), (1, 1, 2), (2, 2, 3), (3, 2, 4), (3, 3, 5)], (22.0, 10.0)),
            ([(0, 1, 1), (3, 2, 4), (3, 3, 5)], (16.0, 4.0)),
        ],
    )
    def test_three_alignments_of_three_words(self, borders, measures):
        problem = direction([FAF, CEC, parse("ABABA")], 12.0)
        assert self.measured(problem, borders) == pytest.approx(measures, abs=1e-12)

    def measured(self, problem, borders):
        how = Expansion({}, problem.least_sizes(), 1e9)
        words = tuple(expand(row.node, how).words[0] for row in problem.groups["default"])
        lines = [(0,) * len(words), *borders]
        spans = tuple(tuple(Span(n) for n in line) for line in lines)
        found = evaluate(problem, Candidate(words, parts=(len(words),)), spans, 0.4, {})
        return found.sigma, found.omega

    def test_two_words(self):
        found = answer(direction([CEC, parse("ABABA")], 12.0))
        assert found.optimal
        assert found.alignment.omega == 0.0
        assert columns(found.alignment) == [["C", "e", "C"], ["A", "BAB", "A"]]

    def test_transparent_splits(self):
        problem = direction([FAF, CEC, parse("ABABA")], 12.0)
        solved = solve_direction(problem, 60.0)
        found = solved.answers["default"]
        assert found.optimal
        assert found.alignment.omega == 0.0
        assert found.alignment.sigma == 12.0
        assert columns(found.alignment) == [
            ["f", "f", "A", "f", "f"], ["C", "e", "e", "e", "C"], ["A", "B", "A", "B", "A"]
        ]  # fmt: skip
        from facade_tools.layering.solve import _boundaries

        assert _boundaries(solved, "default") == pytest.approx([0, 2, 5, 7, 10, 12], abs=1e-9)


def test_the_brute_forces_simplex_equals_highs():
    rng = np.random.default_rng(0)
    for _ in range(100):
        n, k = rng.integers(2, 6, 2)
        upper = [(line, float(line.sum())) for line in rng.integers(-3, 4, (k, n)).astype(float)]
        upper += [(line, 9.0) for line in np.eye(n)]
        equal = [(rng.integers(-2, 3, n).astype(float), float(rng.integers(-3, 4)))]
        cost, least = rng.normal(size=n), rng.uniform(0, 1, n)
        status, x = least_cost(cost, upper, equal, least)
        other = linprog(
            cost, *(np.array(part) for part in zip(*upper, strict=True)),
            *(np.array(part) for part in zip(*equal, strict=True)),
            bounds=[(low, None) for low in least],
        )  # fmt: skip
        assert (status == 0) == (other.status == 0)
        if status == 0:
            assert cost @ x == pytest.approx(other.fun, abs=1e-8)


class TestAlignment:
    @pytest.mark.parametrize(
        ("letters", "seed"), [*((4, seed) for seed in range(100)), *((7, s) for s in range(48))]
    )
    def test_equals_the_brute_force(self, seed, letters):
        """µ, Ω, pieces, columns (and |Σ − canvas| without unsized symbols) on random designs."""
        problem = random_direction(random.Random(seed), letters=letters, layers=3, unsized=0.1)
        try:
            expected = best(problem, [words_of(problem, row) for row in problem.groups["default"]])
        except TooLarge:
            pytest.skip("the brute force would take too long")
        found = answer(problem, few=0 if seed % 2 else 6)
        assert (found is None) == (expected is None)
        if found is not None:
            one = found.alignment
            assert found.optimal
            assert found.gap == 0.0
            assert list(broken(problem, one)) == []
            assert one.tolerance == expected[0]
            assert one.omega == pytest.approx(expected[1], abs=2e-6)
            assert (one.pieces, one.count) == expected[2:4]
            if not one.candidate.unsized:
                assert abs(one.sigma - problem.canvas) == pytest.approx(expected[4], abs=2e-6)

    @pytest.mark.parametrize("seed", range(60))
    def test_of_the_whole_language_equals_the_brute_force(self, seed):
        """Also |Σ − canvas| and all names where sizes are known; see layering_language."""
        design = drawn(seed)
        for groups, tuples, layers in design.searches():
            try:
                expected = best_of(design.problem, tuples, 0.2, layers)
            except TooLarge:
                pytest.skip("the brute force would take too long")
            prepare()
            clock = Clock(time.process_time() + 30.0, now=time.process_time)
            search = GroupSearch(design.problem, groups, clock, few=0 if seed % 2 else 6)
            found = search.answer()
            assert compared(design.problem, expected, found, search.exhausted) == "equal"

    @pytest.mark.parametrize("size", [1.8, None])
    def test_a_piece_may_stand_alone_above_what_other_layers_are_empty_for(self, size):
        """The bounds of two layers know columns that only a third one covers."""
        rules = {"A": Rule(0.9), "B": Rule(0.9, attached=True), "C": Rule(3.1), "D": Rule(0.9)}
        rules["f"] = Rule(size, transparent=True)
        problem = direction([parse("CfA"), parse("AB"), parse("D")], 5.8, rules)
        found = answer(problem)
        assert found.alignment.tolerance == 0.02
        assert columns(found.alignment)[0] == ["C", "f", "f", "A"]

    def test_the_slack_of_eq_7_breaks_no_tie(self):
        """An unsized size smaller by the slack is no better: fewer pieces go first."""
        rules = {"A": Rule(2), "B": Rule(2), "C": Rule(2), "D": Rule(1, unoccludable=True)}
        rules |= {name: Rule(None, transparent=True) for name in "ef"}
        problem = direction([parse("e"), parse("ffAA"), parse("BACCDD")], 10.0, rules)
        expected = best(problem, [words_of(problem, row) for row in problem.groups["default"]])
        found = answer(problem)
        assert compared(problem, expected, found, False) == "equal"
        assert found.alignment.pieces == 2

    def test_of_ties_the_sum_of_the_columns_that_is_nearer_the_canvas_goes_first(self):
        """Also where it is the greater one, and a part of the layout shows too little of it."""
        rules = {"A": Rule(2.5), "B": Rule(3.0), "C": Rule(2.0), "D": Rule(1.0)}
        rules["e"] = Rule(3.0, transparent=True)
        found = answer(direction([parse("eCADe"), parse("ADB")], 11.8, rules))
        assert columns(found.alignment)[1] == ["AD", "", "", "", "B"]
        assert found.alignment.sigma == pytest.approx(12.0)

    def test_each_of_groups_that_are_solved_together_may_err_by_the_tolerance(self):
        rules = {name: Rule(size) for name, size in zip("ABCD", [4.0, 3.2, 4.0, 3.2], strict=True)}
        texts = ["A^k", "B^k", "C^k", "D^k"]
        rows = [LayerPattern(t, t, parse(t)) for t in texts]
        groups = {"one": tuple(rows[:2]), "two": tuple(rows[2:])}
        problem = Direction("x", 8.0, rules, groups, {"k": (2, 2)})
        apart = GroupSearch(problem, ("one",), Clock()).answer()
        together = GroupSearch(replace(problem, counters={"k": (0, 4)}), ("one", "two"), Clock())
        found = together.answer()
        assert found.optimal
        assert found.alignment.tolerance == apart.alignment.tolerance == 0.2
        assert found.alignment.omega == pytest.approx(2 * apart.alignment.omega)

    def test_groups_without_a_common_sizing_are_told_from_their_columns(self):
        """What the groups' sums exclude takes all columns; others may have some of them."""
        sizes = {"A": 3.0, "B": 1.5, "C": 2.5, "D": 3.0}
        rules = {n: Rule(z, attached=n == "A", unoccludable=n == "D") for n, z in sizes.items()}
        rules |= {name: Rule(None, transparent=True) for name in "ef"}
        rows = [LayerPattern(t, t, parse(t)) for t in ["CeC", "CABC", "AefA", "ADBC"]]
        groups = {"one": tuple(rows[:2]), "two": tuple(rows[2:])}
        problem = Direction("x", 10.0, rules, groups)
        words = tuple(words_of(problem, row)[0] for row in rows)
        found = GroupSearch(problem, ("one", "two"), Clock()).answer()
        expected = best_of(problem, [words], parts=(2, 2))
        assert compared(problem, expected, found, False) == "equal"
        assert found.alignment.tolerance == 0.1

    @pytest.mark.parametrize("seed", range(12))
    def test_lattices_equal_word_by_word(self, seed):
        """Words and columns to the last name, with alternations under powers and counters."""
        rng = random.Random(seed)
        shapes = ["(A|BC)^k", "A(B|C)^2D", "((A|B)C)^m", "(tA|B)^kt", "D(C|t)^2", "(AB)^mA^k"]
        sizes = {name: Rule(rng.choice([0.7, 1.0, 1.5, 2.0])) for name in "ABCD"}
        rules = {**sizes, "t": Rule(1.2, transparent=True)}
        nodes = [parse(text) for text in rng.sample(shapes, 2)]
        problem = direction(nodes, 6.0, rules, {"k": (0, 5), "m": (0, 4)})
        mixed, single = answer(problem, few=0), answer(problem, few=float("inf"))
        assert (mixed is None) == (single is None)
        if mixed is not None:
            assert mixed.optimal
            assert single.optimal
            keys = [full_key(one.alignment, 6.0) for one in (mixed, single)]
            assert keys[0] == keys[1]

    @pytest.mark.parametrize("texts", [["AB"] * 6, ["AB"] * 5 + ["BA"], ["BAB"] * 3 + ["AB"] * 3])
    def test_ties_of_many_equal_layers_are_proved(self, texts):
        """A narrow letter leaves room to pull equal layers apart: more columns go first."""
        rules = {"A": Rule(2.0), "B": Rule(0.3)}
        problem = direction([parse(text) for text in texts], 2.4, rules)
        expected = best(problem, [words_of(problem, row) for row in problem.groups["default"]])
        found = answer(problem)
        assert found.optimal
        one = found.alignment
        assert (one.tolerance, one.pieces, one.count) == (expected[0], *expected[2:4])
        assert one.omega == pytest.approx(expected[1], abs=2e-6)

    def test_whole_sizes_and_an_unsized_symbol(self):
        """A range that is rounded to whole metres would make four columns look as good."""
        rules = {"A": Rule(2), "B": Rule(2), "C": Rule(1, opaque=False), "e": Rule(None)}
        found = answer(direction([CEC, parse("ABBA")], 8.0, rules))
        assert found.alignment.omega == pytest.approx(2.0, abs=1e-8)
        assert columns(found.alignment) == [["C", "e", "C"], ["A", "BB", "A"]]

    def test_unoccludable_lets_nothing_above(self):
        rules = {"A": Rule(2), "B": Rule(2, unoccludable=True), "C": Rule(2), "t": Rule(2)}
        nodes = [Substituted(parse("ctc"), (("c", parse("C")),)), parse("ABA")]
        assert columns(answer(direction(nodes, 6.0, rules)).alignment)[0] == ["C", "t", "C"]
        with pytest.raises(Infeasible, match=r"layer.*unoccludable"):
            solve_direction(direction([parse("CCC"), parse("BBB")], 6.0, rules), 30.0)

    def test_an_infeasible_layer_is_named(self):
        with pytest.raises(Infeasible, match=r"layer 'layer 1' \(pattern 'P1'\) has no word"):
            solve_direction(direction([parse("AA"), parse("AAA")], 100.0), 30.0)

    def test_the_time_limit_is_kept_and_says_so(self):
        rules = {**WORKED, "u": Rule(None, transparent=True), "v": Rule(None, transparent=True)}
        nodes = [parse("(uAvB)^k(uA)^m"), parse("(A|BC)^n(vBu)^m"), parse("(ABC)^k")]
        ranges = dict.fromkeys("kmn", (0, 60))
        problem = direction(nodes, 60.0, rules, ranges)
        start = time.process_time()
        found = answer(problem, 2.0)
        assert time.process_time() - start < 8.0
        assert found is None or not found.optimal or found.gap == 0.0

    def test_the_gap_is_a_bound(self):
        """What a short search may have missed is at most the gap better than its answer."""
        nodes = [parse("t(Dt)^n"), parse("D(C|E)^m"), parse("(tB)^mt"), parse("A^kB^m")]
        sizes = {"A": 8.0, "B": 1.9, "C": 8.0, "D": 1.9, "E": 0.3}
        rules = {**{n: Rule(z) for n, z in sizes.items()}, "t": Rule(1.9, transparent=True)}
        problem = direction(nodes, 20.0, rules, dict.fromkeys("kmn", (0, 60)))
        found = answer(problem, 3.0)
        assert found is not None
        assert 0.0 <= found.gap <= found.alignment.omega

    def test_many_words_of_a_symbol_that_stands_twice(self):
        """Contents with 2^k words: some are tried, and nothing is claimed of the rest."""
        sizes = {"A": 1.3, "B": 0.7, "C": 1.1}
        control = Substituted(parse("xyx"), (("x", parse("(A|B)^k")), ("y", parse("C^m"))))
        problem = direction(
            [parse("(A|B|C)^k"), control], 30.0, {n: Rule(z) for n, z in sizes.items()},
            dict.fromkeys("km", (0, 60)),
        )  # fmt: skip
        try:
            solved = solve_direction(problem, 6.0)
        except Infeasible as error:
            solved, message = None, str(error)
        if solved is None:
            assert "not proved" in message
        else:
            assert list(broken(problem, solved.answers["default"].alignment)) == []


class TestSizing:
    @pytest.mark.parametrize("seed", range(200))
    def test_equals_a_reference_programme(self, seed):
        """All designs together: splits, unsized symbols, two groups that share their symbols."""
        problem = random_direction(random.Random(seed), letters=5, layers=3, unsized=0.2)
        rows = problem.groups["default"]
        if seed % 3 == 0 and len(rows) > 2:
            problem = replace(problem, groups={"one": rows[:2], "two": rows[2:]})
        try:
            solved = solve_direction(problem, 4.0)
        except Infeasible:
            return
        alignments = [found.alignment for found in solved.answers.values()]
        reference = reference_sizes(problem, alignments)
        for name, size in reference.items():
            assert solved.sizing.sizes[name] == pytest.approx(size, abs=1e-8 * problem.canvas)

    def test_no_sizing_is_refused(self):
        problem = direction([parse("A"), parse("AB")], 5.0)
        found = answer(problem)
        assert found is None or columns(found.alignment) != [["A"], ["AB"]]
