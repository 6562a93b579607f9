"""HOT2000 surveys become attributes by the stated rules; what is not observed is null."""

from __future__ import annotations

import io
import json
import math
from collections import Counter

import pytest

from facade_tools.artifacts.attributes import Attributes
from facade_tools.errors import InvalidInput
from facade_tools.formats import xmltree
from facade_tools.formats.hot2000 import attributes_of, build, detect, eaves_height
from facade_tools.formats.hot2000_files import house_from_json, house_from_xml
from facade_tools.formats.reading import ReadOptions, Record


def wall(
    label: str, height: float, perimeter: float, adjacent: object = False
) -> dict[str, object]:
    return {"label": label, "height": height, "perimeter": perimeter, "adjacent": adjacent}


def window(facing: str, width: float, height: float, **other: object) -> dict[str, object]:
    row = {"parent": "Wall", "n": 1, "h": height, "w": width, "tilt": 90.0, "facing": facing}
    return {**row, "style": "Picture", **other}


def survey(**changes: object) -> dict[str, object]:
    """A house of 10 m × 8 m with two storeys, front to the south."""
    house = {
        "id": "h",
        "plan_shape": "Rectangular",
        "storeys": "Two storeys",
        "front": "S",
        "area_above": 140.0,
        "ceilings": [{"type": "Attic/gable"}],
        "walls": [wall("Main floor", 2.5, 36.0), wall("Second level", 2.4, 36.0)],
        "windows": [window("S", 2.0, 1.5), window("N", 1.0, 1.0, style="Hinged")],
        "foundations": [
            {
                "isRectangular": "true",
                "length": "10",
                "width": "8",
                "exposed_perimeter": "36",
            }
        ],
    }
    return {**house, **changes}


def imported(front: str = "long", **changes: object) -> tuple[Attributes, Counter[str]]:
    built = attributes_of(house_from_json(survey(**changes)), front)
    return built.artifacts[0], built.notes


def test_the_plain_house_gives_every_number_that_the_survey_observes() -> None:
    house, notes = imported()
    assert not notes
    assert house.mass.bbox == pytest.approx((10.0, 8.0, 4.9))
    assert house.mass.bcr == 1.0
    assert house.mass.bdry == pytest.approx(36.0 / math.sqrt(80.0))
    assert house.mass.far == pytest.approx(1.75)
    assert house.mass.arf == pytest.approx((80.0 / 140.0, 60.0 / 140.0, 0.0))
    quarter = 36.0 * 4.9 / 4.0
    assert house.facade.wwr == pytest.approx((3.0 / quarter, 1.0 / quarter, 0.0, 0.0))
    assert house.facade.sym == house.facade.align == (None,) * 4
    assert house.element.roof == {"flat": 0, "gable": 1, "hip": 0}
    assert house.element.window == {
        "sash": 0,
        "sliding": None,
        "casement": 1,
        "bay": None,
        "fixed": 1,
    }
    assert house.element.special == {"chimney": None, "tower": None}
    assert house.storey_height == pytest.approx(2.45)


@pytest.mark.parametrize(
    ("front", "size"), [("long", (10.0, 8.0)), ("short", (8.0, 10.0)), ("unknown", (None, None))]
)
def test_the_front_of_a_rectangle_is_what_the_user_says(front: str, size: tuple[object]) -> None:
    assert imported(front)[0].mass.bbox[:2] == pytest.approx(size)


def test_a_plan_that_is_no_rectangle_leaves_size_coverage_and_ratio_open() -> None:
    mass = imported(plan_shape="L-shape")[0].mass
    assert mass.bbox[:2] == (None, None)
    assert mass.bcr is None
    assert mass.far is None
    assert mass.bdry is not None
    assert mass.arf[0] is not None


@pytest.mark.parametrize(
    ("facing", "side"),
    [("S", 0), ("SE", 0), ("SW", 0), ("N", 1), ("NE", 1), ("NW", 1), ("W", 2), ("E", 3)],
)
def test_each_direction_belongs_to_a_side_seen_from_the_street(facing: str, side: int) -> None:
    # The front looks south: west is on the left-hand side of who stands in the street.
    wwr = imported(windows=[window(facing, 1.0, 1.0)])[0].facade.wwr
    assert [index for index in range(4) if wwr[index]] == [side]


def test_glass_below_grade_and_in_the_roof_does_not_count() -> None:
    other = [window("S", 1, 1, parent="Basement"), window("S", 1, 1, parent="Ceiling", tilt=30)]
    assert imported(windows=other)[0].facade.wwr == (0.0,) * 4


def test_walls_of_one_level_count_once_and_gables_not_at_all() -> None:
    walls = [
        wall("Main floor brick", 2.4, 12.0),
        wall("Main floor siding", 2.6, 12.0),
        wall("Garage wall", 2.5, 6.0, adjacent=True),
        wall("2e étage", 2.3, 24.0),
        wall("CathGable04", 1.5, 7.0),
    ]
    house, _ = imported(walls=walls)
    assert house.mass.bbox[2] == pytest.approx(4.8)
    assert house.present is not None
    assert house.present.garage is True
    assert house.mass.garage == (None,) * 6


def test_without_an_enclosed_space_there_is_no_attached_garage() -> None:
    house, _ = imported()
    assert house.present is not None
    assert house.present.garage is False
    assert house.mass.garage == (0.0,) * 6


def test_a_storey_without_walls_leaves_the_height_open() -> None:
    house, notes = imported(walls=[wall("Main floor", 2.5, 36.0)])
    assert house.mass.bbox[2] is None
    assert sum(notes.values()) == 1


def test_unlabelled_walls_are_as_many_levels_as_there_are_storeys() -> None:
    walls = [wall("w1", 2.5, 30.0), wall("w2", 2.4, 20.0)]
    height, levels = eaves_height(house_from_json(survey(walls=walls)), Counter())
    assert (height, levels) == (pytest.approx(4.9), 2)


def test_entry_errors_are_clipped_or_refused_and_counted() -> None:
    huge = imported(windows=[window("S", 46.0, 1.0)])
    assert huge[0].facade.wwr[0] == pytest.approx(6.0 / 44.1)
    assert sum(huge[1].values()) == 1
    flat = {"isRectangular": "false", "area": "100", "perimeter": "20"}
    house, notes = imported(foundations=[flat])
    assert house.mass.bdry is None
    assert house.mass.bbox[0] is None
    assert sum(notes.values()) == 1


def test_an_area_of_about_one_floor_says_nothing_of_the_second() -> None:
    house, notes = imported(area_above=84.0)
    assert (house.mass.far, house.mass.arf) == (None, (None, None, None))
    assert list(notes) == ["upper floor area does not fit the main floor's: far and arf refused"]


@pytest.mark.parametrize(
    ("ceilings", "roof"),
    [
        (["Attic/hip", "Cathedral"], {"flat": 0, "gable": 0, "hip": 1}),
        (["Cathedral", "Scissor"], {"flat": 0, "gable": None, "hip": None}),
        (["Flat", "Cathedral"], {"flat": 1, "gable": None, "hip": None}),
        (["Attic/gable", "Thatched"], {"flat": None, "gable": 1, "hip": None}),
        ([], {"flat": None, "gable": None, "hip": None}),
    ],
)
def test_a_sloping_ceiling_lies_under_the_roof_of_an_attic_beside_it(ceilings, roof) -> None:
    house = imported(ceilings=[{"type": ceiling} for ceiling in ceilings])[0]
    assert house.element.roof == roof


def test_a_line_that_is_no_house_is_refused_with_its_reason() -> None:
    with pytest.raises(InvalidInput, match="storeys"):
        house_from_json({"id": "a", "plan_shape": "x"})
    with pytest.raises(InvalidInput, match="no object"):
        build(Record(None, line=1, data=b"[1]"), ReadOptions())


def test_an_entity_bomb_is_refused() -> None:
    bomb = b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><HouseFile>&b;</HouseFile>'
    with pytest.raises(InvalidInput, match="document type"):
        house_from_xml(bomb)


@pytest.mark.parametrize("encoding", ["klingon", "shift_jis", "utf-32", "rot13"])
def test_xml_in_an_encoding_that_cannot_be_read_is_refused(encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?><HouseFile/>'.encode()
    with pytest.raises(InvalidInput, match="cannot be decoded"):
        house_from_xml(text)
    with pytest.raises(InvalidInput, match="cannot be decoded"):
        list(xmltree.iterate(io.BytesIO(text), ["House"]))


def test_windows_are_found_however_deep_they_are_nested() -> None:
    deep = "<Wall>" * 3000 + '<Window number="2"/>' + "</Wall>" * 3000
    text = f"<HouseFile><House><Specifications/><Components>{deep}</Components></House></HouseFile>"
    assert [w.parent for w in house_from_xml(text.encode()).windows] == ["Wall"]


def test_values_of_another_type_are_unknown_and_no_bug() -> None:
    row = survey(windows=[window("S", 2.0, 1.5, style=["Picture"])])
    found = attributes_of(house_from_json(row), "long").artifacts[0]
    assert found.element.window["fixed"] is None
    tiny = imported(walls=[wall("Main floor", 2.5, 5e-324), wall("Second level", 2.4, 0.0)])
    assert tiny[0].facade.wwr == (None,) * 4
    assert not house_from_json(survey(walls=[wall("a", 2.5, 36.0, "false")])).walls[0].adjacent


def test_the_format_is_told_by_content() -> None:
    assert detect(json.dumps(survey()).encode())
    assert detect(b'<?xml version="1.0"?><HouseFile>')
    assert not detect(b'{"type": "CityJSON"}')


def test_the_command_streams_and_skips(facade, tmp_path) -> None:
    source = tmp_path / "surveys"
    lines = [json.dumps(survey()), '{"id": "x"', json.dumps(survey(id="i"))]
    source.write_text("\n".join(lines) + "\n")
    run = facade("import", source, "--on-error", "skip")
    rows = [json.loads(line) for line in run.stdout.splitlines()]
    assert run.returncode == 3
    assert [row["id"] for row in rows] == ["h", "i"]
    assert f"{source.name}:2" in run.stderr.decode()
    assert rows[0]["provenance"]["stage"] == "import"
    assert rows[0]["provenance"]["options"] == {"front": "long"}
    assert facade("import", source, "--jobs", 2, "--on-error", "skip").stdout == run.stdout


def test_house_file_and_extract_agree(shared_data) -> None:
    folder = shared_data / "buildings" / "nrcan-energuide-h2k"
    paths = sorted((folder / "h2k").glob("*.h2k"))[:8]
    wanted = {path.stem for path in paths}
    with (folder / "houses.jsonl").open() as file:
        rows = {row["id"]: row for row in map(json.loads, file) if row["id"] in wanted}
    for path in paths:
        direct = attributes_of(house_from_xml(path.read_bytes()), "long").artifacts[0]
        extract = attributes_of(house_from_json(rows[path.stem]), "long").artifacts[0]
        assert direct.mass == extract.mass
        assert direct.facade.wwr == pytest.approx(extract.facade.wwr, abs=1e-4)
