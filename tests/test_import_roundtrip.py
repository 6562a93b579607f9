"""What `export` writes comes back; streams stay bounded; other people's files are refused."""

from __future__ import annotations

import io
import json
import re
import resource
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.errors import InvalidInput
from facade_tools.formats import cityjson_reader, geojson
from facade_tools.formats.reading import ReadOptions

from .city_sources import City, flat_box, gable_house

SAMPLES = Path(__file__).resolve().parent.parent / "sample_data" / "houses"


def rows(data: bytes) -> dict[str, dict]:
    found = {row["id"]: row for row in map(json.loads, data.splitlines())}
    for row in found.values():
        row.pop("provenance", None)
    return found


@pytest.mark.parametrize("ending", [".city.json", ".obj"])
def test_exported_houses_come_back_as_they_were(facade, tmp_path, ending: str) -> None:
    houses = b"".join(
        path.read_bytes().splitlines(keepends=True)[0] for path in sorted(SAMPLES.glob("*.jsonl"))
    )
    out = tmp_path / f"houses{ending}"
    assert facade("export", "-", "-o", out, stdin=houses).returncode == 0
    back = facade("import", out)
    assert back.returncode == 0, back.stderr
    assert rows(back.stdout) == rows(houses)


def test_an_imported_building_goes_back_onto_the_map_and_returns(facade, tmp_path) -> None:
    city = City().add("h", gable_house(12.0, 8.0, 5.5, 35.0), 31.0, (321.5, 45.25, 12.0))
    city.add("g", flat_box(80.0, 0.0, 83.0, 6.0, 2.6), 31.0)
    first = facade("import", "-", stdin=json.dumps(city.document()).encode())
    out = tmp_path / "map.city.json"
    facade("export", "-", "-o", out, stdin=first.stdout)
    assert rows(facade("import", out).stdout) == rows(first.stdout)


def test_a_model_edited_elsewhere_is_read_by_its_geometry(facade, tmp_path) -> None:
    house = (SAMPLES / "bungalow.jsonl").read_bytes().splitlines()[0]
    out = tmp_path / "house.city.json"
    facade("export", "-", "-o", out, stdin=house)
    document = json.loads(out.read_text())
    document["transform"]["scale"][0] *= 1.5
    out.write_text(json.dumps(document))
    back = facade("import", out)
    (row,) = rows(back.stdout).values()
    assert b"geometry differs" in back.stderr
    assert row["partial"] is True


def test_an_artifact_needs_no_import(facade, tmp_path) -> None:
    path = tmp_path / "house.json"
    path.write_text('{"schema": "facade-tools/building/1", "id": "a"}')
    run = facade("import", path)
    assert run.returncode == 3
    assert b"house.json: is an artifact already" in run.stderr


def test_a_foreign_mesh_is_refused_by_name(facade, tmp_path) -> None:
    mesh = tmp_path / "cube.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    run = facade("import", mesh)
    assert run.returncode == 3
    assert b"another program" in run.stderr


def test_standard_input_and_folders_are_read(facade, tmp_path) -> None:
    document = json.dumps(City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)).document())
    (tmp_path / "one").write_text(document)
    piped = facade("import", "-", stdin=document.encode())
    foldered = facade("import", tmp_path)
    assert rows(piped.stdout) == rows(foldered.stdout)
    assert list(rows(piped.stdout)) == ["h"]


def test_a_folder_of_folders_is_an_error_not_nothing(facade, tmp_path) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "below" / "one").write_text("{}")
    (tmp_path / "README.md").write_text("# Houses")
    run = facade("import", tmp_path)
    assert run.returncode == 3
    assert f"error: {tmp_path}: holds no file to import".encode() in run.stderr


def test_an_id_that_stands_twice_is_refused(facade, tmp_path) -> None:
    document = json.dumps(City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)).document())
    for name in ("one", "two"):
        (tmp_path / name).write_text(document)
    run = facade("import", tmp_path)
    assert run.returncode == 3
    assert f"error: {tmp_path / 'two'}: ".encode() in run.stderr
    assert b"'h' stands twice" in run.stderr


def test_memory_does_not_grow_with_the_stream(tmp_path) -> None:
    """Ten times the buildings take little more memory: only their vertices' and ids' share."""

    def peak(count: int) -> int:
        city = City()
        box = flat_box(0.0, 0.0, 10.0, 8.0, 6.0)
        for k in range(count):
            city.add(f"b{k}", box, 0.0, (20.0 * k, 0.0, 0.0))
        path = tmp_path / f"{count}.json"
        path.write_text(json.dumps(city.document()))
        del city
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with path.open("rb") as stream:
            assert sum(1 for _ in cityjson_reader.records(stream, ReadOptions())) == count
        scale = 1024 if sys.platform == "darwin" else 1
        return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) // scale

    peak(100)
    assert peak(1500) < 20_000  # KiB


MODEL = json.dumps(City().add("h", gable_house(12.0, 8.0, 5.5, 35.0)).document())
MAP = json.dumps(
    {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "properties": {"building": "yes", "height": "7"},
                "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 0]]]},
            }
        ],
    }
)
WORDS = re.compile(r"-?\d+(\.\d+)?|\"[^\"]*\"|\[|\]|\{|\}")
BROKEN = ("null", "-1", "1e400", "[]", "{}", '"x"', "999999999999", "", "true", "[[[]]]")


@given(st.sampled_from([MODEL, MAP]), st.integers(0, 10**6), st.sampled_from(BROKEN))
@settings(max_examples=150, deadline=None)
def test_a_broken_file_is_refused_and_never_crashes(text: str, place: int, word: str) -> None:
    found = list(WORDS.finditer(text))
    spot = found[place % len(found)]
    data = (text[: spot.start()] + word + text[spot.end() :]).encode()
    reader = cityjson_reader if text == MODEL else geojson
    options = ReadOptions(metres=True)
    with suppress(InvalidInput):
        for record in reader.records(io.BytesIO(data), options):
            reader.build(record, options)
