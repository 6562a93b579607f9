from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.documents import parse_json, parse_yaml
from facade_tools.artifacts.number_bytes import plain_size, text_of, write_number
from facade_tools.artifacts.numbers import Given, canonical, dump_document, dump_line, parse_float
from facade_tools.errors import InvalidInput

finite = st.floats(allow_nan=False, allow_infinity=False)
trees = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | finite | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4)
    ),
    max_leaves=20,
)


@given(finite)
def test_computed_numbers_keep_twelve_digits(value):
    written = json.loads(dump_line(value))
    assert written == pytest.approx(value, rel=1e-11, abs=0)
    assert dump_line(written) == dump_line(value)


@given(finite)
def test_read_numbers_are_written_as_they_came(value):
    text = repr(value).encode()
    assert json.loads(dump_line(parse_json(text))) == value


@given(trees)
def test_one_line_and_document_hold_the_same_value(tree):
    line, document = dump_line(tree), dump_document(tree)
    assert json.loads(line) == json.loads(document)
    assert line.count(b"\n") == 1


@given(trees)
def test_canonical_is_idempotent_and_keeps_its_input(tree):
    before = json.dumps(tree)
    once = canonical(tree)
    assert canonical(once) == once
    assert json.dumps(tree) == before


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, np.float64("nan")])
def test_what_json_cannot_say_is_a_bug(value):
    with pytest.raises(ValueError, match="cannot be written"):
        dump_line({"x": value})


def test_numpy_values_become_plain_json():
    data = {
        "a": np.float64(1.5),
        "b": np.arange(3),
        "c": np.int64(2),
        "d": np.bool_(True),
        "e": (1, 2),
    }
    assert json.loads(dump_line(data)) == {"a": 1.5, "b": [0, 1, 2], "c": 2, "d": True, "e": [1, 2]}


halves = st.builds(lambda odd, shift: (2 * odd + 1) / 2**shift, st.integers(0, 10**12),
                   st.integers(1, 20))  # fmt: skip
decimals = st.builds(lambda whole, places: whole / 10**places, st.integers(-(10**13), 10**13),
                     st.integers(0, 20))  # fmt: skip


@settings(deadline=None)  # the first call may compile
@given(finite | halves | decimals | st.floats(-1e13, 1e13) | st.floats(-1e-3, 1e-3))
@example(-0.0)
@example(1e-05)
@example(-1e-11)
@example(9.9999999999995)
@example(99999.9999999995)
@example(999999999998.5)
@example(999999999999.5)
@example(123456789012.0)
@example(1e12)
@example(0.000123456789012501)
def test_compiled_numbers_are_the_same_bytes(value):
    """`write_number` where it says that it can; `text_of` writes every number."""
    text = dump_line(value)[:-1]
    assert text_of(value) == text
    if plain_size(np.array(value)):
        out = np.zeros(40, dtype=np.uint8)
        end = write_number(value, out, 3)
        assert out[3:end].tobytes() == text


def test_compiled_numbers_of_every_size():
    rng = np.random.default_rng(0)
    sizes = 10.0 ** rng.uniform(-11, 12, 20_000) * rng.choice([-1, 1], 20_000)
    values = np.concatenate([sizes, sizes.round(3), 10.0 ** np.arange(-11, 12), np.arange(200.0)])
    out = np.zeros(40, dtype=np.uint8)
    for value in values[plain_size(values)].tolist():
        assert out[: write_number(value, out, 0)].tobytes() == text_of(value)


def test_negative_zero_is_zero():
    assert dump_line(-0.0) == b"0.0\n"
    assert dump_line(-1e-320 * 1e-10) == b"0.0\n"


def test_only_numbers_that_rounding_would_change_are_marked():
    assert type(parse_float("0.123456789012")) is float
    assert type(parse_float("-0.0123456789012")) is float
    assert type(parse_float("0.1234567890123")) is Given


@pytest.mark.parametrize(
    "text", [b"NaN", b"[Infinity]", b"1e999", b"{", b"\xff", b"[" * 100_000, b""]
)
def test_bad_json_is_refused(text):
    with pytest.raises(InvalidInput):
        parse_json(text)


@pytest.mark.parametrize(
    "text", [b"a: &x 1\nb: *x", b"a: 1\na: 2", b"a: [", b"!!python/object:os.system {}", b"\x00"]
)
def test_bad_yaml_is_refused(text):
    with pytest.raises(InvalidInput):
        parse_yaml(text)


def test_a_yaml_error_has_its_line():
    with pytest.raises(InvalidInput) as caught:
        parse_yaml(b"a: 1\nb: 2\na: 3\n")
    assert caught.value.place.line == 3
