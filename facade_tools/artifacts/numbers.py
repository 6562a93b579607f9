"""Canonical JSON: the same values always become the same bytes."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

SIGNIFICANT_DIGITS = 12
_AS_IT_IS = frozenset({str, int, bool, type(None)})


class Given(float):
    """A number read from a file with more than 12 digits; it is written back as it came."""

    __slots__ = ()


def parse_float(text: str) -> float:
    """Read a JSON number; numbers that rounding would change become `Given`.

    Raises ValueError on what no float holds (1e999).
    """
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"{text} is out of range")
    if len(text) <= SIGNIFICANT_DIGITS or float(f"{value:.12g}") == value:
        return value
    return Given(value)


def plain(value: Any) -> Any:
    """Return a copy of JSON data in which every `Given` is an ordinary float."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return float(value) if isinstance(value, Given) else value


def canonical(value: Any) -> Any:
    """Return `value` as plain JSON data, computed floats rounded to 12 significant digits.

    Negative zero becomes zero. Raises ValueError on NaN and infinities: JSON has no word for
    them, and an artifact that holds one is a bug.

    >>> canonical({"x": 0.1 + 0.2, "n": None})
    {'x': 0.3, 'n': None}
    """
    kind = type(value)
    if kind is float:
        return _rounded(value)
    if kind in _AS_IT_IS:
        return value
    if kind is dict:
        return {
            key: item if type(item) in _AS_IT_IS else canonical(item) for key, item in value.items()
        }
    if kind is list or kind is tuple:
        return [item if type(item) in _AS_IT_IS else canonical(item) for item in value]
    return _canonical_special(value)


def _canonical_special(value: Any) -> Any:
    if isinstance(value, Given):
        return value
    if isinstance(value, np.ndarray):
        return canonical(value.tolist())
    if isinstance(value, np.generic):
        return canonical(value.item())
    if isinstance(value, str):
        return str(value)
    raise TypeError(f"{type(value).__name__} has no JSON form")


def _rounded(value: float) -> float:
    if value.is_integer() and abs(value) < 1e12:
        return value + 0.0
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot be written as JSON")
    return float(f"{value:.12g}") + 0.0


def dump_line(document: Any) -> bytes:
    """Return `document` as one line of JSON with its line feed."""
    text = json.dumps(canonical(document), ensure_ascii=False, separators=(",", ":"))
    return text.encode() + b"\n"


def dump_document(document: Any) -> bytes:
    """Return `document` as indented JSON, for a file that holds a single artifact.

    Arrays of plain numbers stay on one line, so that a diff shows what changed.
    """
    return (_indented(canonical(document), "") + "\n").encode()


def _indented(value: Any, margin: str) -> str:
    if isinstance(value, dict) and value:
        inner = margin + "  "
        rows = (f"{inner}{_compact(key)}: {_indented(item, inner)}" for key, item in value.items())
        return "{\n" + ",\n".join(rows) + f"\n{margin}}}"
    if isinstance(value, list) and any(isinstance(item, dict | list) for item in value):
        inner = margin + "  "
        return "[\n" + ",\n".join(inner + _indented(item, inner) for item in value) + f"\n{margin}]"
    return _compact(value)


def _compact(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
