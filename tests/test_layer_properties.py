"""What `layer-solve` promises of any text, any canvas, any design and any time limit (IMAW15)."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from layering_checks import broken
from layering_designs import random_direction

from facade_tools.artifacts.design import Canvas, Design, DesignLayer, DesignSymbol
from facade_tools.artifacts.layout import Layout
from facade_tools.artifacts.store import read_one
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.layering.alignment import prepare
from facade_tools.layering.explain import conflict_of
from facade_tools.layering.language import PatternError, parse
from facade_tools.layering.problem import Direction, LayerPattern, Rule
from facade_tools.layering.search import Clock, GroupSearch
from facade_tools.layering.solve import solve_design
from facade_tools.layering.words import Expansion, expand

DESIGNS = Path(__file__).resolve().parent.parent / "sample_data" / "designs"
MEMORY = 1.5e9  # bytes, of a whole process

symbols = st.sampled_from(["A", "B2", "C", "{front door}", "t"])
exponents = st.sampled_from(["^2", "^k", "^-1", "^(k-1)", "^(2m+k)", "^-(k)", "^0", "^99999"])
patterns = st.recursive(
    symbols,
    lambda inner: st.one_of(
        st.lists(inner, min_size=1, max_size=4).map("".join),
        st.lists(inner, min_size=2, max_size=3).map(lambda parts: f"({'|'.join(parts)})"),
        st.tuples(inner, exponents).map(lambda pair: f"({pair[0]}){pair[1]}"),
    ),
    max_leaves=12,
)


class TestLanguage:
    @given(st.text(max_size=60))
    @settings(max_examples=200, deadline=None)
    def test_any_text_is_parsed_or_refused_with_a_position(self, text):
        try:
            node, refused = parse(text), None
        except PatternError as error:
            node, refused = None, error
        if node is None:
            lines = text.split("\n")
            assert 1 <= refused.line <= len(lines)
            assert 1 <= refused.column <= len(lines[refused.line - 1]) + 1
            assert f"line {refused.line}, column {refused.column}" in str(refused)

    @given(patterns)
    @settings(max_examples=100, deadline=None)
    def test_any_pattern_of_the_grammar_is_expanded_within_bounds(self, text):
        sizes = dict.fromkeys(["A", "B2", "C", "front door", "t"], 1.0)
        for counters in ({"k": 0, "m": 0}, {"k": 7, "m": 3}):
            found = expand(parse(text), Expansion(counters, sizes, 20.0))
            assert len(found.words) <= 4096
            assert all(len(word) <= 20 for word in found.words)


def random_design(rng: random.Random, *, base: bool) -> Design:
    """Several layers with counters, alternations, transparent letters, qualifiers.

    base: the last layer is opaque throughout, in both directions.
    """
    table = {
        name: DesignSymbol(round(rng.uniform(0.3, 2.5), 1), unoccludable=rng.random() < 0.1)
        for name in "ABCDE"
    }
    table["t"] = DesignSymbol(round(rng.uniform(0.5, 2.0), 1), transparent=True)
    shapes = ["A(BA)^k", "(A|B)^kC", "tB(tB)^k", "D(EC)^m", "A^kt^mA", "C(tD)^k", "E^m", "B|A^m"]
    plain = ["A(BA)^k", "(A|B)^k", "E^m", "C(DC)^m", "D^kE^m"]
    texts = rng.sample(shapes, 3) + rng.sample(plain, 2)
    own = [text.replace("k", f"k{i}").replace("m", f"m{i}") for i, text in enumerate(texts)]
    names = dict(zip("abcde", own, strict=True))
    layers = [
        DesignLayer(rng.choice("abcde"), rng.choice("abcde"), name=f"layer {i}")
        for i in range(rng.randint(1, 2))
    ]
    layers.append(DesignLayer("d", "e") if base else DesignLayer("a", "d"))
    counters = {f"{name}{i}": "auto" for name in "km" for i in range(5)}
    return Design(Canvas(6.0, 4.0), table, names, tuple(layers), counters=counters)


def holes(layout: Layout) -> float:
    """The share of the canvas that no visible shape of two opaque letters lies on."""
    clear = {"t", "~t"}
    opaque = [s for s in layout.shapes if s.visible and not clear & set(s.symbols)]
    x = np.unique([0.0, layout.canvas.width, *(v for s in opaque for v in (s.x0, s.x1))])
    y = np.unique([0.0, layout.canvas.height, *(v for s in opaque for v in (s.y0, s.y1))])
    covered = np.zeros((len(y) - 1, len(x) - 1), bool)
    for s in opaque:
        rows = slice(*np.searchsorted(y, [s.y0, s.y1]))
        covered[rows, slice(*np.searchsorted(x, [s.x0, s.x1]))] = True
    area = np.outer(np.diff(y), np.diff(x))
    return float(area[~covered].sum() / area.sum())


def uncovered(layout: Layout, transparent: str = "t") -> float:
    """The greatest length, of both directions, over which no layer has an opaque letter."""
    worst = 0.0
    for axis in (layout.x, layout.y):
        for group in axis.values():
            for j, (start, end) in enumerate(pairwise(group.boundaries)):
                columns = [row[j] for row in group.columns if row[j]]
                if not any(all(n.lstrip("~") != transparent for n in one) for one in columns):
                    worst = max(worst, end - start)
    return worst


def whole(layout: Layout) -> bool:
    """Tell whether the layer at the back has an opaque letter in all columns and rows."""
    return all(
        all(one and "t" not in one for one in group.columns[-1])
        for axis in (layout.x, layout.y)
        for group in axis.values()
    )


class TestAnyCanvas:
    @given(
        seed=st.integers(0, 10_000),
        width=st.one_of(st.floats(0.01, 40.0), st.sampled_from([1e-9, 1e-3, 1e3, 1e6])),
    )
    @settings(max_examples=25, deadline=None)
    def test_is_solved_or_refused(self, seed, width):
        design = random_design(random.Random(seed), base=seed % 2 == 0)
        try:
            layout, refused = solve_design(design, width=width, time_limit=0.6), None
        except Infeasible as error:
            layout, refused = None, error
        if layout is None:
            assert refused.exit_code == 4
            assert " m)" in str(refused)
        else:
            assert layout.canvas.width == width
            assert uncovered(layout) == 0.0

    @pytest.mark.parametrize("width", [0.0, -3.0, float("nan"), float("inf"), 1e7])
    def test_that_is_none_is_invalid(self, width):
        with pytest.raises(InvalidInput, match="canvas"):
            solve_design(random_design(random.Random(1), base=True), width=width)

    @pytest.mark.parametrize("seed", [0, 1, 4, 5, 6, 12])
    def test_growing_leaves_no_holes(self, seed):
        """However large: every column is covered; behind a layer without gaps, every spot."""
        design = random_design(random.Random(seed), base=True)
        solved = 0
        for factor in (1.0, 1.37, 2.1, 3.3):
            try:
                layout = solve_design(
                    design, width=6.0 * factor, height=4.0 * factor, time_limit=20.0
                )
            except Infeasible:
                continue
            solved += 1
            assert uncovered(layout) == 0.0
            assert holes(layout) == 0.0 or not whole(layout)
        assert solved >= 2

    @pytest.mark.parametrize("name", ["residential-9", "terraced-balconies", "haussmann"])
    def test_wider_samples_are_covered_throughout(self, name):
        """Patterns with a counter fill any width: no spot is bare that was not before."""
        path = DESIGNS / f"{name}.yaml"
        design = read_one(str(path), "design")
        for factor in (1.0, 1.5, 3.1):
            width = design.canvas.width * factor
            layout = solve_design(design, width=width, time_limit=20.0)
            assert uncovered(layout) == 0.0
            assert holes(layout) == 0.0


class TestLimits:
    @pytest.mark.parametrize("number", range(4))
    def test_of_time_are_kept(self, number):
        prepare()
        start = time.process_time()
        clock = Clock(start + 1.0, now=time.process_time)
        answer = GroupSearch(monstrous(number), ("default",), clock).answer()
        assert time.process_time() - start < 1.0 * 1.1 + 0.5
        assert answer is None or list(broken(monstrous(number), answer.alignment)) == []

    def test_of_memory_are_kept(self):
        """A process that solves monsters stays small."""
        code = (
            "import resource, time, test_layer_properties as t\n"
            "t.prepare()\n"
            "for number in range(4):\n"
            "    clock = t.Clock(time.monotonic() + 1.0)\n"
            "    t.GroupSearch(t.monstrous(number), ('default',), clock).answer()\n"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=__file__.rpartition("/")[0], capture_output=True
        )
        assert done.returncode == 0, done.stderr
        assert int(done.stdout) < MEMORY


def monstrous(number: int) -> Direction:
    """Problems far beyond what can be searched: free counters, long words, many layers."""
    rules = {name: Rule(0.1 + 0.13 * i) for i, name in enumerate("ABCDEFGH")}
    rules |= {name: Rule(None, transparent=True) for name in "uvw"}
    texts = [
        ["(A|B|C|D)^k(E|F)^m", "(uA|vB)^n(w|C)^k", "((A|B)^m(C|D)^n)^k"],
        ["(uAvB)^k(uA)^m", "(A|BC)^n(vBu)^m", "(ABwC)^k", "(uvw)^nA^m"],
        [
            f"({a}|{b}u)^{c}"
            for a, b, c in zip("ABCDEFGH" * 3, "BCDEFGHA" * 3, "kmn" * 8, strict=True)
        ],
        ["((((A|B)^k|C)^k|D)^k|E)^k", "(A^mB^nC^k)^k", "E^kF^mG^nH^k"],
    ][number]
    rows = tuple(LayerPattern(f"L{i}", text, parse(text)) for i, text in enumerate(texts))
    return Direction("x", 40.0, rules, {"default": rows}, dict.fromkeys("kmn", (0, 300)))


class TestConflict:
    @pytest.mark.parametrize("seed", range(40))
    def test_is_infeasible_and_nothing_can_be_left_out(self, seed):
        """Layers and qualifiers that exit 4 names: as small as can be."""
        problem = random_direction(random.Random(seed), letters=3, layers=3, unsized=0.0)
        if feasible(problem) is not False:
            return
        conflict = conflict_of(problem, "default", 20.0)
        rows = conflict.rows
        kept = replace(problem, groups={"default": rows}, rules=relaxed(problem, conflict))
        assert feasible(kept) is False
        for row in rows:
            fewer = tuple(other for other in rows if other is not row)
            assert not fewer or feasible(replace(kept, groups={"default": fewer}))
        for symbol, name in conflict.qualifiers:
            free = replace(kept.rules[symbol], **{name: name == "opaque"})
            assert feasible(replace(kept, rules={**kept.rules, symbol: free}))


def relaxed(problem, conflict):
    """The rules of a problem without the qualifiers that are not in a conflict."""
    plain = {"unoccludable": False, "attached": False, "opaque": True}
    out = {}
    for symbol, rule in problem.rules.items():
        named = {name for own, name in conflict.qualifiers if own == symbol}
        out[symbol] = replace(rule, **{k: v for k, v in plain.items() if k not in named})
    return out


def feasible(problem):
    """Whether there is a layout; None where that is not known."""
    prepare()
    clock = Clock(time.process_time() + 10.0, now=time.process_time)
    search = GroupSearch(problem, ("default",), clock)
    if search.answer() is not None:
        return True
    return False if search.exhausted else None
