"""The pattern language of layer-solve: words, lattices, what is refused."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from layering_documents import random_document
from layering_language import Reading
from layering_oracle import TooLarge

from facade_tools.artifacts.codec import from_json
from facade_tools.artifacts.design import Design
from facade_tools.errors import InvalidInput
from facade_tools.layering.language import PatternError, Substituted, parse, symbol_pair
from facade_tools.layering.lattice import lattices
from facade_tools.layering.stack import stack_of
from facade_tools.layering.words import Expansion, Letter, expand, reflected

SIZES = dict.fromkeys("ABCcexyz", 1.0)


def texts(pattern, **counters):
    node = parse(pattern) if isinstance(pattern, str) else pattern
    words = expand(node, Expansion(counters, SIZES, 40.0)).words
    return ["".join(letter.name for letter in word) for word in words]


@pytest.mark.parametrize("control", ["(A|B)^3|Ac", "(A|B)^3|Acc", "(A|B)^3c^(k-2)"])
def test_lattices_do_without_a_content_that_does_not_fit(control):
    node = Substituted(parse(control), (("c", parse("AAAAAAAA")),))
    how = Expansion({"k": 2}, dict.fromkeys("ABc", 1.0), 5.0)
    family = lattices(node, how, frozenset())
    assert sum(one.size > 0 for one in family.classes) == 4
    assert {frozenset(a.symbol for a in word) for word in family.words} == {
        frozenset(a.symbol for a in word) for word in expand(node, how).words
    }


def spelt_by(lattice):
    """Yield the words of a lattice's paths."""
    leaving = {}
    for edge in lattice.edges:
        leaving.setdefault(edge.start, []).append(edge)
    stack = [(0, ())]
    while stack:
        node, word = stack.pop()
        if node in lattice.finals:
            yield word
        stack += [(edge.end, (*word, edge.letter)) for edge in leaving.get(node, [])]


class TestLanguage:
    @pytest.mark.parametrize(
        ("pattern", "counters", "words"),
        [
            ("A|B", {}, ["A", "B"]),
            ("A(B|C)", {}, ["AB", "AC"]),
            ("A(BA)^k", {"k": 2}, ["ABABA"]),
            ("A(BA)^0", {}, ["A"]),
            ("(AB)^-1", {}, ["~B~A"]),
            ("(AB)^(k-3)", {"k": 1}, ["~B~A~B~A"]),
            ("(A|B)^2", {}, ["AA", "AB", "BA", "BB"]),
            ("((AB)^2C)^(2*k-1)", {"k": 1}, ["ABABC"]),
            (" A · B\n", {}, ["AB"]),
        ],
    )
    def test_words(self, pattern, counters, words):
        assert texts(pattern, **counters) == words

    @pytest.mark.parametrize("first", range(0, 200, 50))
    def test_words_equal_an_independent_reading(self, first):
        """Of random patterns: expanded one by one, and as paths of lattices."""
        for seed in range(first, first + 50):
            rng = random.Random(seed)
            raw = {**random_document(rng), "canvas": {"width": 8.0, "height": 8.0}}
            problem = stack_of(from_json(Design, raw)).direction("x")
            clear = frozenset(name for name, rule in problem.rules.items() if rule.transparent)
            bound = frozenset(name for name, rule in problem.rules.items() if rule.attached)
            reading = Reading(raw, "x", 8.0)
            rows = [row for rows in problem.groups.values() for row in rows]
            values = list(reading.counters(reading.rows))
            for counters in rng.sample(values, min(4, len(values))):
                for row, text in zip(rows, reading.rows, strict=True):
                    try:
                        expected = set(reading.words(text, counters))
                    except TooLarge:
                        continue
                    sizes, limit = problem.least_sizes(), 1.4 * 8.0 * (1.0 + 1e-9)
                    how = Expansion(counters, sizes, limit, row.reflection, clear)
                    found = expand(row.node, how)
                    assert found.complete
                    assert set(found.words) == expected, (seed, text, counters)
                    family = lattices(row.node, how, bound)
                    if family is not None and family.complete:
                        spelt = {word for one in family.classes for word in spelt_by(one)}
                        assert spelt == expected, (seed, text, counters)

    def test_control_letters_are_transparent_and_substitutes_are_one_word(self):
        node = Substituted(parse("xexz^-1"), (("x", parse("A|BC")), ("z", parse("AB"))))
        assert texts(node) == ["AeA~B~A", "BCeBC~B~A"]
        (first, *_) = expand(node, Expansion({}, SIZES, 40.0)).words
        assert [a.transparent for a in first] == [False, True, False, False, False]

    @pytest.mark.parametrize(
        ("mode", "name"), [("reverse", "BA"), ("mirror", "~A~B"), ("reverse-mirror", "~B~A")]
    )
    def test_reflections(self, mode, name):
        word = (Letter("A"), Letter("B"))
        assert "".join(a.name for a in reflected(word, mode)) == name
        assert reflected(reflected(word, mode), mode) == word

    @pytest.mark.parametrize(
        ("text", "column"),
        [("A(B", 4), ("A^", 3), ("{x", 1), ("A|", 3), ("A)", 2), ("3", 1), ("A$", 2), ("", 1)],
    )
    def test_errors_have_a_place(self, text, column):
        with pytest.raises(PatternError) as error:
            parse(text)
        assert (error.value.line, error.value.column) == (1, column)
        assert "‸" in str(error.value)
        assert error.value.picture().split("\n")[1] == " " * (column - 1) + "^"

    @given(st.text(alphabet="ABk123()|^-+*{} x\n·~", max_size=40))
    @settings(max_examples=300, deadline=None)
    def test_any_text_is_parsed_or_refused_with_a_position(self, text):
        try:
            node = parse(text)
        except PatternError as error:
            inside = 0 <= error.offset <= len(text)
        else:
            inside = node == parse(text)
        assert inside

    def test_expansion_is_bounded(self):
        found = expand(parse("(A|B)^16"), Expansion({}, SIZES, 100.0))
        assert len(found.words) <= 4096
        assert not found.complete
        assert expand(parse("((A^999)^999)^999"), Expansion({}, SIZES, 50.0)).words == []

    def test_shape_names(self):
        assert symbol_pair("C1{front door}") == ("C1", "front door")
        assert symbol_pair("*P") == ("*", "P")
        with pytest.raises(PatternError):
            symbol_pair("C")


def test_settings_of_a_content_are_refused():
    """They were read over: a design has one reflection and one look a pattern."""
    raw = {
        "canvas": {"width": 6, "height": 3},
        "symbols": {"A": {"size": 1.0}},
        "patterns": {"P": {"control": "cec", "c": {"pattern": "A^-1", "reflection": "mirror"}}},
        "layers": [{"x": "P", "y": "P"}],
    }
    with pytest.raises(InvalidInput, match="means nothing in a content") as error:
        stack_of(from_json(Design, raw))
    assert error.value.place.pointer == "/patterns/P/c/reflection"


def test_an_unknown_counter_is_refused():
    from facade_tools.artifacts.design import Canvas, DesignLayer, DesignSymbol

    design = Design(Canvas(6, 3), {"A": DesignSymbol(1.0)}, {"P": "A^k"}, (DesignLayer("P", "P"),))
    with pytest.raises(InvalidInput, match="counter 'k'"):
        stack_of(design)
