"""The sample houses: enough, small, in several styles, and made again byte for byte."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from facade_tools.artifacts.building import SIDES, Building
from facade_tools.artifacts.store import read

SAMPLES = Path(__file__).parent.parent / "sample_data"


@pytest.fixture(scope="module")
def houses() -> list[Building]:
    return list(read([str(SAMPLES / "houses")], "building"))


def test_enough_houses_of_many_styles(houses):
    styles = Counter(house.tags["style"] for house in houses)
    assert len(houses) >= 240
    assert len(styles) >= 8
    assert len({house.id for house in houses}) == len(houses)


def test_all_say_that_they_are_synthetic(houses):
    assert all(house.tags["synthetic"] for house in houses)


def test_small():
    sizes = [path.stat().st_size for path in SAMPLES.rglob("*.jsonl")]
    assert sum(sizes) < 5_000_000
    assert max(sizes) < 1_000_000


def test_full_facades_with_one_entrance(houses):
    for house in houses:
        assert set(house.facades) == set(SIDES)
        elements = [e for f in house.facades.values() for p in f.pieces for e in p.elements]
        assert sum(e.main for e in elements) == 1
        assert house.colors is not None


def test_every_roof_window_and_feature_occurs(houses):
    roofs = {box.roof.style for house in houses for box in house.boxes}
    assert roofs >= {"flat", "gable", "hip", "shed", "cone"}
    elements = [e for h in houses for f in h.facades.values() for p in f.pieces for e in p.elements]
    styles = {e.style for e in elements if e.kind == "window"}
    assert styles == {"sash", "sliding", "casement", "bay", "fixed"}
    assert {name for house in houses for name in house.features} == {"chimney", "tower"}


def test_sizes_are_those_of_houses(houses):
    for house in houses:
        for box in house.boxes:
            assert 1.0 <= box.width <= 20
            assert 1.0 <= box.depth <= 20
            assert 2.2 <= box.height <= 10
        elements = [e for f in house.facades.values() for p in f.pieces for e in p.elements]
        for e in elements:
            if e.kind == "door":
                assert 0.85 <= e.width <= 2.5
                assert 2.0 <= e.height <= 2.2
            if e.kind == "garage-door":
                assert 2.0 <= e.width <= 5.0


def test_made_again_byte_for_byte(tmp_path):
    script = str(SAMPLES / "make_samples.py")
    subprocess.run([sys.executable, script, "--out", str(tmp_path)], check=True, timeout=120)
    for path in sorted((SAMPLES / "houses").glob("*.jsonl")):
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()
    assert len(list(tmp_path.glob("*.jsonl"))) == len(list((SAMPLES / "houses").glob("*.jsonl")))
