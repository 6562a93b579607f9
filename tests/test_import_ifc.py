"""IFC models become buildings where the optional reader is installed; else the remedy is named."""

from __future__ import annotations

import io
import sys

import pytest

from facade_tools.errors import InvalidInput
from facade_tools.formats import ifc
from facade_tools.formats.reading import ReadOptions
from facade_tools.geometry.checks import building_problems

HEAD = b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA (('IFC4'));\nENDSEC;\n"


def test_the_format_is_told_by_its_schema() -> None:
    assert ifc.detect(HEAD)
    assert not ifc.detect(HEAD.replace(b"IFC4", b"AP203"))


def test_without_the_extra_the_remedy_is_named(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)
    with pytest.raises(InvalidInput, match=r"facade-tools\[ifc\]"):
        next(iter(ifc.records(io.BytesIO(HEAD), ReadOptions())))


@pytest.mark.parametrize(
    ("name", "size", "roof", "openings"),
    [
        ("Ifc4_SampleHouse.ifc", (14.1, 6.1), "gable", 4),
        ("Ifc2x3_Duplex_Architecture.ifc", (18.0, 8.0), "flat", 20),
    ],
)
def test_the_sample_houses_are_read(shared_data, name, size, roof, openings) -> None:
    pytest.importorskip("ifcopenshell")
    options = ReadOptions()
    data = (shared_data / "buildings" / "ifc-sample-houses" / name).read_bytes()
    (record,) = ifc.records(io.BytesIO(data), options)
    (building,) = ifc.build(record, options).artifacts
    assert not list(building_problems(building))
    largest = max(building.boxes, key=lambda box: box.width * box.depth)
    assert sorted((largest.width, largest.depth)) == pytest.approx(sorted(size), abs=1.0)
    assert largest.roof.style == roof
    placed = [e for f in building.facades.values() for p in f.pieces for e in p.elements]
    assert len(placed) >= openings
