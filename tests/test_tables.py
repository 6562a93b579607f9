"""The tables by which stages find the function of a kind of artifact."""

from __future__ import annotations

import inspect

import pytest

from facade_tools.artifacts.documents import KINDS, artifact_class
from facade_tools.cli._tables import CITY, DRAWINGS, METHODS, RULES, SCENES, WITH_FILES, load
from facade_tools.grammar.reading import ReadOptions

BY_KIND = {"view": DRAWINGS, "export": SCENES, "CityJSON": CITY, "validate": RULES}
ROWS = [
    pytest.param(kind, target, id=f"{stage}-{kind}")
    for stage, table in BY_KIND.items()
    for kind, target in table.items()
]


def first_annotation(target: str) -> object:
    return next(iter(inspect.signature(load(target), eval_str=True).parameters.values())).annotation


@pytest.mark.parametrize(("kind", "target"), ROWS)
def test_a_row_names_a_function_of_its_kind(kind, target):
    assert kind in KINDS
    assert first_annotation(target) is artifact_class(kind)


@pytest.mark.parametrize("target", METHODS.values(), ids=list(METHODS))
def test_methods_are_made_from_the_same_options(target):
    assert first_annotation(target) is ReadOptions


def test_what_can_be_exported_can_be_seen_and_checked():
    assert set(SCENES) | set(CITY) <= set(DRAWINGS) & set(RULES)
    assert set(WITH_FILES) <= set(DRAWINGS)
