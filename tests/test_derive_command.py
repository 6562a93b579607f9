"""`facade derive`: files, footprints, parameters, streams."""

from __future__ import annotations

import json

import pytest


def test_the_command_writes_buildings_models_and_trees(facade_here, tmp_path):
    out = tmp_path / "two.jsonl"
    run = facade_here("derive", "victorian", "-n", 2, "-o", out, "--tree", tmp_path / "tree.jsonl")
    assert run.returncode == 0, run.stderr
    ids = [json.loads(line)["id"] for line in out.read_text().splitlines()]
    assert ids == ["victorian-0-0", "victorian-0-1"]
    for name in ("two.jsonl", "tree.jsonl"):
        assert facade_here("validate", tmp_path / name).returncode == 0
    again = facade_here("derive", "victorian", "-n", 2)
    assert again.stdout.count(b"\n") == 2
    model = facade_here("derive", "ksttp09", "-o", tmp_path / "k.obj")
    assert model.returncode == 0
    assert (tmp_path / "k.mtl").exists()
    drawn = facade_here("export", tmp_path / "tree.jsonl", "-o", tmp_path / "t.glb")
    assert drawn.returncode == 0, drawn.stderr


def test_footprints_of_all_kinds(facade_here, tmp_path):
    ring = [[0, 0], [12, 0], [12, 5], [7, 5], [7, 9], [0, 9], [0, 0]]
    feature = {"type": "Feature", "properties": {"building": "yes"},
               "geometry": {"type": "Polygon", "coordinates": [ring]}}  # fmt: skip
    collection = {"type": "FeatureCollection", "features": [feature]}
    (tmp_path / "lot.geojson").write_text(json.dumps(collection))
    arguments = ("--footprint", tmp_path / "lot.geojson", "--metres")
    first = facade_here("derive", "ksttp09", *arguments, "-o", tmp_path / "a.json")
    assert first.returncode == 0, first.stderr
    building = json.loads((tmp_path / "a.json").read_text())
    assert sum(b["width"] * b["depth"] for b in building["boxes"]) >= 88.0 - 1e-6
    assert "frame" in building
    second = facade_here("derive", "modern", "--footprint", tmp_path / "a.json", "-o", tmp_path / "b.glb")  # fmt: skip  # noqa: E501
    assert second.returncode == 0, second.stderr
    degrees = facade_here("derive", "ksttp09", "--footprint", tmp_path / "lot.geojson")
    assert degrees.returncode in (0, 3)


def test_parameters_are_set(facade_here, tmp_path):
    done = facade_here("derive", "ksttp09", "--set", "h=4", "-o", tmp_path / "k.json")
    assert done.returncode == 0
    building = json.loads((tmp_path / "k.json").read_text())
    assert building["boxes"][0]["height"] == pytest.approx(3.9 + 4 * 4)
    wrong = facade_here("derive", "ksttp09", "--set", "q=4")
    assert wrong.returncode == 3
    assert b"has h0, h, hb" in wrong.stderr
    assert facade_here("derive", "nowhere").returncode == 3
    assert facade_here("derive", "ksttp09", "-o", tmp_path / "k.stl").returncode == 2


def test_bad_footprints_are_skipped_and_jobs_change_nothing(facade_here, tmp_path):
    def square(name, side):
        ring = [[0, 0], [side, 0], [side, 9], [0, 9]]
        return {"schema": "facade-tools/footprint/1", "id": name, "height": 9, "polygon": [ring]}

    rows = [square("one", 12), square("thin", 0.2), square("two", 14)]
    rows.append({**square("line", 5), "polygon": [[[0, 0], [5, 0], [5, 0]]]})
    lots = tmp_path / "lots.jsonl"
    lots.write_text("".join(json.dumps(row) + "\n" for row in rows))
    base = ("derive", "haussmann", "--footprint", lots)
    stopped = facade_here(*base, "-o", tmp_path / "none.jsonl")
    assert stopped.returncode == 3
    assert not (tmp_path / "none.jsonl").exists()
    one = facade_here(*base, "-n", 2, "--on-error", "skip", "--jobs", 1)
    many = facade_here(*base, "-n", 2, "--on-error", "skip", "--jobs", 2)
    assert one.returncode == many.returncode == 3
    assert one.stdout == many.stdout
    ids = [json.loads(line)["id"] for line in one.stdout.splitlines()]
    assert ids == ["one-0", "one-1", "two-0", "two-1"]
    assert b"skipped" in one.stderr
    for name in ("some.jsonl", "some.glb"):  # what waits for all items holds the good ones
        done = facade_here(*base, "--on-error", "skip", "-o", tmp_path / name)
        assert (done.returncode, (tmp_path / name).exists()) == (3, True)
    assert len((tmp_path / "some.jsonl").read_bytes().splitlines()) == 2


def test_footprints_whose_ids_are_one_file_name_do_not_overwrite_one_another(facade_here, tmp_path):
    ring = [[0, 0], [12, 0], [12, 9], [0, 9]]
    rows = [
        {"schema": "facade-tools/footprint/1", "id": name, "height": 9, "polygon": [ring]}
        for name in ("way/1", "way:1")
    ]
    lots = tmp_path / "lots.jsonl"
    lots.write_text("".join(json.dumps(row) + "\n" for row in rows))
    done = facade_here("derive", "modern", "--footprint", lots, "-o", f"{tmp_path}/out/")
    assert done.returncode == 3
    assert b"have one file name" in done.stderr


def test_several_buildings_do_not_go_into_one_json_file(facade_here, tmp_path):
    for words in (("-o", "x.json"), ("-o", "x.glb", "--tree", "x.json")):
        done = facade_here("derive", "haussmann", "-n", 2, *words, cwd=tmp_path)
        assert done.returncode == 2
        assert b"x.json: several buildings" in done.stderr
    assert not list(tmp_path.iterdir())
    name = tmp_path / "lot.json"
    name.write_text("{}")
    done = facade_here("derive", "haussmann", "--footprint", name, "-o", name)
    assert done.returncode == 2
    assert b"is an input and would be overwritten" in done.stderr


def test_a_mistyped_grammar_gets_the_list_of_shipped_ones(facade_here, tmp_path):
    done = facade_here("derive", "hausmann", "-o", tmp_path / "a.jsonl")
    assert done.returncode == 3
    assert b"is neither a file nor a shipped grammar (haussmann, " in done.stderr
