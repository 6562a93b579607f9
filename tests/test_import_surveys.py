"""HPXML surveys and assessors' tables become attributes; what is not observed is null."""

from __future__ import annotations

import io
import json
import math
from typing import Any

import pytest

from facade_tools.artifacts.attributes import Attributes
from facade_tools.errors import InvalidInput
from facade_tools.formats import assessor, hpxml
from facade_tools.formats.reading import ReadOptions

FOOT = 0.3048


def home(
    floors: str = "1.0",
    facility: str = "single-family detached",
    site: str = "<AzimuthOfFrontOfHome>180</AzimuthOfFrontOfHome>",
    slabs: str = "",
    pitch: str = "6.0",
) -> bytes:
    return f"""<HPXML xmlns='http://hpxmlonline.com/2023/09'><Building><BuildingDetails>
    <BuildingSummary><Site>{site}</Site><BuildingConstruction>
      <ResidentialFacilityType>{facility}</ResidentialFacilityType>
      <NumberofConditionedFloorsAboveGrade>{floors}</NumberofConditionedFloorsAboveGrade>
      <ConditionedFloorArea>1500</ConditionedFloorArea>
      <ConditionedBuildingVolume>12000</ConditionedBuildingVolume>
    </BuildingConstruction></BuildingSummary>
    <Enclosure>
      <Roofs><Roof><Pitch>{pitch}</Pitch></Roof></Roofs>
      <Walls><Wall><ExteriorAdjacentTo>outside</ExteriorAdjacentTo>
        <InteriorAdjacentTo>living space</InteriorAdjacentTo><Area>1000</Area></Wall></Walls>
      <Windows>
        <Window><Area>50</Area><Orientation>south</Orientation></Window>
        <Window><Area>25</Area><Azimuth>90</Azimuth></Window>
      </Windows>
      <Slabs><Slab><InteriorAdjacentTo>living space</InteriorAdjacentTo>
        <Area>1000</Area><ExposedPerimeter>130</ExposedPerimeter></Slab>{slabs}</Slabs>
    </Enclosure></BuildingDetails></Building></HPXML>""".encode()


def survey(data: bytes) -> Attributes:
    (record,) = hpxml.records(io.BytesIO(data), ReadOptions())
    (attributes,) = hpxml.build(record, ReadOptions()).artifacts
    assert isinstance(attributes, Attributes)
    return attributes


def test_a_home_gives_what_its_survey_observes() -> None:
    found = survey(home())
    assert found.mass.bbox == (None, None, pytest.approx(8 * FOOT))
    assert found.mass.bdry == pytest.approx(130 / math.sqrt(1000))
    assert found.mass.arf == (1.0, 0.0, 0.0)
    # The front looks south: east is at the right hand of who stands in the street.
    assert found.facade.wwr == pytest.approx((0.2, 0.0, 0.0, 0.1))
    assert found.element.roof == {"flat": 0, "gable": None, "hip": None}
    assert found.present is not None
    assert found.present.garage is False


def test_two_floors_share_the_floor_area() -> None:
    assert survey(home(floors="2.0")).mass.arf == pytest.approx((2 / 3, 1 / 3, 0.0))


@pytest.mark.parametrize(("area", "garage"), [("400", True), ("17", None)])
def test_a_garage_is_a_slab_of_a_garages_size(area: str, garage: bool | None) -> None:
    slab = f"<Slab><InteriorAdjacentTo>garage</InteriorAdjacentTo><Area>{area}</Area></Slab>"
    found = survey(home(slabs=slab))
    assert (found.present and found.present.garage) is garage
    assert found.mass.garage == (None,) * 6


def test_without_a_front_there_is_no_glazing() -> None:
    assert survey(home(site="")).facade.wwr == (None,) * 4


def test_a_flat_roof_is_told_by_its_pitch() -> None:
    assert survey(home(pitch="0")).element.roof == {"flat": 1, "gable": 0, "hip": 0}


def test_only_detached_houses_are_read() -> None:
    with pytest.raises(InvalidInput, match="apartment"):
        survey(home(facility="apartment unit"))


TABLE = """PID,1st Flr SF,2nd Flr SF,Roof Style,Garage Type,Open Porch SF,Enclosed Porch,\
3Ssn Porch,Screen Porch,Fireplaces,House Style,Year Built,Lot Area,Garage Cars,Garage Area
1,1000,500,Hip,Attchd,0,0,0,0,1,2Story,1990,9000,2,400
2,1000,1500,Odd,,20,0,0,0,0,2Story,1990,9000,0,0
"""


def rows(text: str, columns: dict[str, Any] | None = None) -> list[Any]:
    options = ReadOptions(columns=columns)
    return [
        assessor.build(record, options)
        for record in assessor.records(io.BytesIO(text.encode()), options)
    ]


def test_the_ames_table_needs_no_mapping() -> None:
    first, second = rows(TABLE)
    (house,) = first.artifacts
    assert house.mass.arf == pytest.approx((2 / 3, 1 / 3, 0.0))
    assert house.present.garage is True
    assert house.mass.porch == ((0.0,) * 6,) * 2
    assert house.element.roof == {"flat": 0, "gable": 0, "hip": 1}
    assert house.element.special == {"chimney": 1, "tower": None}
    assert house.tags["House Style"] == "2Story"
    (other,) = second.artifacts
    assert other.mass.arf == (0.5, 0.5, 0.0)
    assert other.mass.garage == (0.0,) * 6
    assert other.present.porch_front is None
    assert other.element.roof == dict.fromkeys(("flat", "gable", "hip"))
    assert len(second.notes) == 2


def test_another_table_needs_its_mapping(facade, tmp_path) -> None:
    table, mapping = tmp_path / "table", tmp_path / "columns.yaml"
    table.write_text("nr,ground,upper,kind\n7,80,40,Sattel\n")
    refused = facade("import", table)
    assert refused.returncode == 3
    assert b"--columns" in refused.stderr
    mapping.write_text(
        "id: nr\narea_unit: m2\nmain_area: ground\nupper_areas: [upper]\n"
        "roof: {column: kind, values: {Sattel: gable}}\n"
    )
    house = json.loads(facade("import", table, "--columns", mapping).stdout)
    assert house["mass"]["arf"] == pytest.approx([2 / 3, 1 / 3, 0.0])
    assert house["element"]["roof"] == {"flat": 0, "gable": 1, "hip": 0}


@pytest.mark.parametrize(
    ("mapping", "message"),
    [
        ({"main_area": "a"}, "id"),
        ({"id": "a", "colour": "b"}, "colour"),
        ({"id": "a", "area_unit": "acre"}, "ft2"),
        ({"id": "a", "roof": {"column": "b", "values": {"x": "round"}}}, "gable"),
        ({"id": "nobody"}, "nobody"),
    ],
)
def test_a_wrong_mapping_is_refused_where_it_is_wrong(
    mapping: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidInput, match=message):
        rows(TABLE, mapping)


def test_a_short_row_is_refused() -> None:
    with pytest.raises(InvalidInput, match="columns"):
        rows(TABLE + "3,1\n")


def test_broken_utf_16_is_refused() -> None:
    table = "PID,Order\n1,2\n".encode("utf-16") + b"\x00\xdc\x00\xdc\n\x00"
    with pytest.raises(InvalidInput, match="UTF-16"):
        list(assessor.records(io.BytesIO(table), ReadOptions()))
