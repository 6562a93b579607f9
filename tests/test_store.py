from __future__ import annotations

import copy
import io
import json
import os
import resource
import signal
import subprocess
import sys
import tracemalloc
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from facade_tools.artifacts import store
from facade_tools.artifacts.attributes import Attributes
from facade_tools.artifacts.building import Box, Building, Element, Facade, Piece, Roof
from facade_tools.artifacts.documents import KINDS, artifact_class, decode, encode, kind_of
from facade_tools.artifacts.model import Model
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import read, read_one, read_raw
from facade_tools.artifacts.validation import schema, schema_names
from facade_tools.artifacts.writing import (
    atomic_file,
    atomic_folder,
    write_artifact,
    write_artifacts,
)
from facade_tools.errors import InvalidInput, OutputFailed

HOUSE = {
    "schema": "facade-tools/building/1",
    "id": "house",
    "boxes": [
        {"id": "a", "kind": "general", "x": 0, "y": 0, "width": 8.5, "depth": 6, "height": 3,
         "roof": {"style": "gable", "pitch": 30, "direction": "x"}}
    ],
}  # fmt: skip

lengths = st.floats(0.01, 100)
names = st.text("abcdefgh-1", min_size=1, max_size=6)
roofs = st.builds(
    Roof,
    style=st.sampled_from(["flat", "gable", "hip", "shed", "cone", "mansard"]),
    pitch=st.floats(0, 80),
    direction=st.sampled_from(["x", "y"]),
)
boxes = st.builds(
    Box, id=names, kind=st.sampled_from(["general", "garage", "porch"]), x=lengths, y=lengths,
    width=lengths, depth=lengths, height=lengths, roof=roofs,
)  # fmt: skip
elements = st.builds(
    Element, kind=st.just("window"), style=st.sampled_from(["sash", "bay"]), u=lengths, v=lengths,
    width=lengths, height=lengths, main=st.booleans(), known=st.booleans(),
)  # fmt: skip
pieces = st.builds(
    Piece, id=names, box=names, origin=st.tuples(lengths, lengths, lengths), width=lengths,
    height=lengths, elements=st.lists(elements, max_size=2).map(tuple),
)  # fmt: skip
buildings = st.builds(
    Building, id=names, boxes=st.lists(boxes, min_size=1, max_size=3).map(tuple),
    facades=st.dictionaries(
        st.sampled_from(["front", "left"]),
        st.builds(Facade, st.lists(pieces, max_size=2).map(tuple)),
        max_size=2,
    ),
    features=st.sampled_from([(), ("tower",), ("chimney", "tower")]),
)  # fmt: skip


@given(buildings)
def test_a_building_survives_its_file(building):
    line = dump_line(encode(building))
    again = decode(json.loads(line), "building")
    assert dump_line(encode(again)) == line


def test_missing_and_null_fields_take_the_default():
    document = {
        "schema": "facade-tools/attributes/1",
        "id": "x",
        "mass": {"garage": None, "bbox": [8, None, 3]},
    }
    attributes = decode(document)
    assert attributes == Attributes("x", mass=attributes.mass)
    assert attributes.mass.bbox == (8, None, 3)
    assert attributes.mass.garage == (None,) * 6


def test_decoding_leaves_the_document_alone():
    document = copy.deepcopy(HOUSE)
    decode(document)
    assert document == HOUSE


def test_every_kind_has_a_class_and_a_schema():
    assert set(KINDS) <= set(schema_names())
    for kind in KINDS:
        assert artifact_class(kind).kind == kind


@pytest.mark.parametrize("name", schema_names())
def test_schemas_are_valid_and_describe_every_field(name):
    from jsonschema import Draft202012Validator

    Draft202012Validator.check_schema(schema(name))
    assert schema(name)["$schema"].endswith("2020-12/schema")
    for pointer, node in _fields(schema(name), ""):
        assert "description" in node or "$ref" in node or "const" in node, pointer


def _fields(node, pointer):
    for key in ("properties", "$defs"):
        for name, field in node.get(key, {}).items():
            yield f"{pointer}/{name}", field
            yield from _fields(field, f"{pointer}/{name}")
    if isinstance(node.get("items"), dict):
        yield from _fields(node["items"], f"{pointer}/items")


@pytest.mark.parametrize("kind", KINDS)
def test_schema_and_class_name_the_same_fields(kind):
    cls = artifact_class(kind)
    assert set(schema(kind)["properties"]) - {"schema"} == {field.name for field in fields(cls)}


def test_kind_of_says_what_was_expected():
    with pytest.raises(InvalidInput, match="expected facade-tools/building/1"):
        kind_of({"schema": "facade-tools/attributes/1"}, ("building",))
    with pytest.raises(InvalidInput, match='has no "schema"'):
        kind_of({}, ("building",))


def test_mixed_inputs_come_in_order(tmp_path):
    def house(name):
        return {**HOUSE, "id": name}

    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "2.json").write_text(json.dumps(house("3"), indent=1))
    (tmp_path / "b" / "1.yaml").write_text(
        json.dumps({k: v for k, v in house("2").items() if k != "schema"})
    )
    (tmp_path / "b" / ".hidden.json").write_text("no")
    (tmp_path / "a.jsonl").write_text(f"{json.dumps(house('0'))}\n\n{json.dumps(house('1'))}\n")
    for kind in ("building", Building):
        found = read([tmp_path / "a.jsonl", str(tmp_path / "b")], kind)
        assert [building.id for building in found] == ["0", "1", "2", "3"]
    assert [building.id for building in read(tmp_path / "b", Building)] == ["2", "3"]
    with pytest.raises(InvalidInput, match=r"a\.jsonl:1: /schema: .* facade-tools/model/1"):
        next(read(tmp_path / "a.jsonl", Model))


def _stdin(text: str) -> list:
    return list(read_raw(["-"], io.BufferedReader(io.BytesIO(text.encode()))))


def test_standard_input_holds_lines_or_one_document():
    line = json.dumps(HOUSE)
    assert len(_stdin(f"{line}\n{line}\n")) == 2
    assert len(_stdin(json.dumps(HOUSE, indent=2))) == 1
    assert _stdin(json.dumps(HOUSE, indent=2))[0].artifact("building").id == "house"
    assert _stdin("") == []
    assert [item.line for item in _stdin(f"{{broken}}\n{line}\n")] == [1, 2]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("x.json", "", "is empty"),
        ("x.json", "{", "x.json.*not valid JSON"),
        ("x.json", '{"schema": "facade-tools/building/1"}', "x.json: /: 'id' is a required"),
        ("x.jsonl", f"{json.dumps(HOUSE)}\n{{]\n", "x.jsonl:2: not valid JSON"),
        ("x.yaml", "boxes: [", "x.yaml:1: not valid YAML"),
        (
            "x.json",
            json.dumps({**HOUSE, "boxes": [{**HOUSE["boxes"][0], "width": -1}]}),
            "/boxes/0/width: -1",
        ),
        ("x.json", json.dumps({**HOUSE, "colour": 1}), "/colour: .*'colour' was unexpected"),
        (
            "x.yaml",
            "id: a\nboxes:\n  - id: b\n    kind: general\n    dept: 3",
            r"x\.yaml:3: /boxes/0: 'height'",
        ),
        ("x.json", "[1]", r"is a JSON list; expected .*building/1 \(several: one a line"),
        (
            "x.json",
            f"{json.dumps(HOUSE)}\n{json.dumps(HOUSE)}\n",
            "a document a line; .* ending .jsonl",
        ),
        ("x.json", f"{json.dumps(HOUSE)} {{}}\n", "not valid JSON: Extra data"),
    ],
)
def test_errors_name_file_line_and_pointer(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InvalidInput, match=message) as caught:
        list(read([str(path)], "building"))
    assert str(path) in str(caught.value)


def test_missing_files_and_empty_folders_are_invalid(tmp_path):
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(InvalidInput):
            list(read_raw([str(path)]))
    (tmp_path / "empty.jsonl").touch()
    assert list(read_raw([str(tmp_path / "empty.jsonl")])) == []
    with pytest.raises(InvalidInput, match="holds none"):
        read_one(str(tmp_path / "empty.jsonl"), "building")


def test_a_line_or_file_beyond_the_limit_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(store, "MAX_LINE_BYTES", 100)
    monkeypatch.setattr(store, "MAX_DOCUMENT_BYTES", 100)
    for name in ("x.jsonl", "x.json"):
        (tmp_path / name).write_text(json.dumps(HOUSE))
        with pytest.raises(InvalidInput, match=r"longer|larger"):
            list(read_raw([str(tmp_path / name)]))


def test_a_long_stream_takes_constant_memory(tmp_path):
    path = tmp_path / "many.jsonl"
    line = json.dumps(HOUSE) + "\n"
    with path.open("w") as file:
        for _ in range(20_000):
            file.write(line)
    tracemalloc.start()
    count = sum(1 for _ in read_raw([str(path)]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count == 20_000
    assert peak < 1_000_000


def test_hostile_names_stay_names():
    source = store.RawItem("../../etc/passwd", None, b"{}").provenance()
    assert source.name == "passwd"


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "out.json"
    path.write_text("old")
    with pytest.raises(RuntimeError), atomic_file(path) as file:
        file.write(b"half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.json"]
    write_artifact(path, decode(HOUSE))
    assert json.loads(path.read_text())["id"] == "house"
    write_artifacts(tmp_path / "two.jsonl", [decode(HOUSE)] * 2)
    assert list(read(tmp_path / "two.jsonl", Building)) == [decode(HOUSE)] * 2


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    target = tmp_path / "style"
    with pytest.raises(RuntimeError), atomic_folder(target) as folder:
        (folder / "a").touch()
        raise RuntimeError
    assert not target.exists()
    for _ in range(2):
        with atomic_folder(target) as folder:
            (folder / "a").touch()
    (target / "somebody's").touch()
    with pytest.raises(OutputFailed, match="other files"), atomic_folder(target) as folder:
        (folder / "a").touch()
    assert os.listdir(tmp_path) == ["style"]


def test_a_missing_folder_or_full_disk_is_an_output_error(tmp_path):
    with pytest.raises(OutputFailed), atomic_file(tmp_path / "no" / "x.json") as file:
        file.write(b"x")
    if os.path.exists("/dev/full"):
        from pathlib import Path

        with pytest.raises(OutputFailed), atomic_file(Path("/dev/full")) as file:
            file.write(b"x")
            file.flush()


def test_a_file_too_large_for_the_disk_leaves_nothing(tmp_path):
    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    code = (
        "from pathlib import Path; from facade_tools.artifacts.writing import write_bytes;"
        "write_bytes(Path('big.json'), b'x' * 100_000)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, preexec_fn=limited, capture_output=True
    )
    assert b"OutputFailed" in done.stderr
    assert os.listdir(tmp_path) == []


def test_killed_while_writing_leaves_the_old_file(tmp_path):
    (tmp_path / "x.json").write_text("old")
    code = (
        "import os, signal; from pathlib import Path;"
        "from facade_tools.artifacts.writing import atomic_file\n"
        "with atomic_file(Path('x.json')) as f:\n f.write(b'half'); f.flush()\n"
        " os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path)
    assert done.returncode == -signal.SIGKILL
    assert (tmp_path / "x.json").read_text() == "old"


def test_provenance_has_no_clock_and_no_path():
    building = decode(HOUSE)
    provenance = Provenance("massgen", 1, {"candidates": 2}, (Source("a.jsonl", "0" * 64),))
    document = encode(Building(building.id, building.boxes, provenance=provenance))
    assert set(document["provenance"]) == {"stage", "seed", "options", "inputs", "tool", "version"}
    decode(json.loads(json.dumps(document)))


@pytest.mark.parametrize("shape", ["list", "object"])
def test_free_fields_are_read_up_to_a_depth_and_refused_beyond(shape):
    def nested(levels):
        value = {}
        for _ in range(levels - 2):
            value = [value] if shape == "list" else {"a": value}
        return {"x": value}

    house = {"schema": "facade-tools/footprint/1", "id": "f", "height": 5,
             "polygon": [[[0, 0], [8, 0], [8, 6], [0, 6]]]}  # fmt: skip
    assert decode({**house, "tags": nested(64)}, "footprint").tags == nested(64)
    for levels in (65, 480, 900):
        with pytest.raises(InvalidInput, match="nested too deeply") as caught:
            decode({**house, "tags": nested(levels)}, "footprint")
        assert caught.value.place.pointer == "/tags"
