"""`facade export`: files that other tools open, named and placed as the contract says."""

from __future__ import annotations

import json
import subprocess

import pytest
import trimesh

HOUSE = {
    "schema": "facade-tools/building/1",
    "id": "h1",
    "boxes": [
        {"id": "main", "kind": "general", "x": 5, "y": 4, "width": 10, "depth": 8, "height": 6,
         "roof": {"style": "gable", "pitch": 35, "direction": "x", "overhang": 0.4}},
    ],
    "facades": {"front": {"pieces": [
        {"id": "f1", "box": "main", "origin": [0, 0, 0], "width": 10, "height": 3, "elements": [
            {"kind": "door", "style": "panel", "u": 4.5, "v": 0, "width": 1, "height": 2.1},
            {"kind": "window", "style": "sash", "u": 1, "v": 0.9, "width": 1.2, "height": 1.4},
        ]},
    ]}},
}  # fmt: skip
FOOTPRINT = {
    "schema": "facade-tools/footprint/1",
    "id": "way-1",
    "polygon": [[[0, 0], [9, 0], [9, 6], [0, 6]]],
    "height": 5.0,
    "roof": {"style": "hip", "pitch": 30, "direction": "x"},
}
ENDINGS = ("glb", "obj", "city.json")


def stream(*items):
    return "".join(json.dumps(item) + "\n" for item in items).encode()


@pytest.mark.parametrize("ending", ENDINGS)
def test_one_file_by_its_ending(facade_here, tmp_path, ending):
    out = tmp_path / f"model.{ending}"
    assert facade_here("export", "-", "-o", out, stdin=stream(HOUSE)).returncode == 0
    again = tmp_path / f"again.{ending}"
    facade_here("export", "-", "-o", again, stdin=stream(HOUSE))
    one, two = (path.read_bytes().replace(b"again", b"model") for path in (out, again))
    assert one == two
    left = {path.name for path in tmp_path.iterdir() if path.stem.startswith("model")} - {out.name}
    pictures = {"model-0.png", "model-1.png"}  # boards and shingles
    assert left == ({"model.mtl"} | pictures if ending == "obj" else set())


def test_glb_has_the_closed_mass_and_names_that_carry_meaning(facade_here, tmp_path):
    out = tmp_path / "m.glb"
    facade_here("export", "-", "-o", out, stdin=stream(HOUSE))
    scene = trimesh.load(out)
    mass = scene.geometry["mass"]
    assert mass.is_volume
    assert mass.volume == pytest.approx(480 + 0.5 * 8 * 10 * 2.8008, rel=1e-4)
    assert mass.bounds[1][1] == pytest.approx(8.8008, abs=1e-3)  # y is up
    assert {"mass", "front/piece-1/door-1", "front/piece-1/window-1", "roof"} <= set(scene.geometry)


@pytest.mark.parametrize("form", ["glb", "obj", "cityjson"])
def test_a_folder_gets_a_file_an_item(facade_here, tmp_path, form):
    items = stream(*({**HOUSE, "id": f"a/{k}"} for k in range(3)), FOOTPRINT)
    for jobs in (1, 2) if form == "glb" else (1,):
        folder = tmp_path / str(jobs)
        done = facade_here(
            "export", "-", "-o", f"{folder}/", "--format", form, "--jobs", jobs, stdin=items
        )
        assert done.returncode == 0, done.stderr
    files = sorted(path.name for path in (tmp_path / "1").iterdir())
    end = {"glb": ".glb", "obj": ".obj", "cityjson": ".city.json"}[form]
    assert [name for name in files if name.endswith(end)] == [
        f"a_0{end}", f"a_1{end}", f"a_2{end}", f"way-1{end}"
    ]  # fmt: skip
    for name in files if form == "glb" else ():
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_several_items_in_one_file_stand_apart_and_are_named(facade_here, tmp_path):
    out = tmp_path / "all.glb"
    items = stream(HOUSE, {**HOUSE, "id": "h2"})
    assert facade_here("export", "-", "-o", out, stdin=items).returncode == 0
    geometry = trimesh.load(out).geometry
    one, two = geometry["h1/mass"].bounds, geometry["h2/mass"].bounds
    assert one[1][0] < two[0][0] or two[1][0] < one[0][0]
    facade_here("export", "-", "-o", out, "--arrange", "own", stdin=items)
    geometry = trimesh.load(out).geometry
    assert (geometry["h1/mass"].bounds == geometry["h2/mass"].bounds).all()


def test_a_map_keeps_its_coordinates(facade_here, tmp_path):
    far = {**FOOTPRINT, "id": "way-2", "polygon": [[[50, 0], [59, 0], [59, 6], [50, 6]]]}
    out = tmp_path / "map.city.json"
    assert facade_here("export", "-", "-o", out, stdin=stream(FOOTPRINT, far)).returncode == 0
    extent = json.loads(out.read_bytes())["metadata"]["geographicalExtent"]
    assert (extent[0], extent[3]) == (0.0, 59.0)


def framed(identity, x, rotation=0.0):
    frame = {"rotation": rotation, "shift": [500000.0 + x, 5600000.0, 40.0], "crs": "EPSG:25832"}
    return {**FOOTPRINT, "id": identity, "frame": frame}


def test_imported_items_go_back_to_their_map(facade_here, tmp_path):
    items = stream(framed("a", 0.25), framed("b", 30.0, 90.0))
    out = tmp_path / "town.city.json"
    assert facade_here("export", "-", "-o", out, stdin=items).returncode == 0
    city = json.loads(out.read_bytes())
    assert city["metadata"]["referenceSystem"].endswith("/EPSG/0/25832")
    low_x, low_y, low_z, high_x, high_y, _ = city["metadata"]["geographicalExtent"]
    assert (low_x, low_z) == (500000.25, 40.0)
    assert (high_x, low_y, high_y) == (500030.0, 5600000.0, 5600009.0)  # b, turned, is 6 wide
    glb = tmp_path / "town.glb"
    assert facade_here("export", "-", "-o", glb, stdin=items).returncode == 0
    geometry = trimesh.load(glb).geometry
    assert geometry["a/mass"].bounds[0].tolist() == [0.25, 0.0, -6.0]
    assert geometry["b/mass"].bounds[0] == pytest.approx([24.0, 0.0, -9.0])


@pytest.mark.parametrize("arrange", ["auto", "own"])
def test_national_coordinates_without_a_frame_are_not_rounded_away(facade_here, tmp_path, arrange):
    ring = [[4500000.25 + x, 5600000.5 + y] for x, y in ((0, 0), (8, 0), (8, 6), (0, 6))]
    next_to_it = [[x + 20.125, y] for x, y in ring]
    items = [
        {**FOOTPRINT, "id": name, "polygon": [r]} for name, r in (("a", ring), ("b", next_to_it))
    ]
    done = facade_here(
        "export", "-", "--arrange", arrange, "-o", tmp_path / "x.glb", stdin=stream(*items)
    )
    assert done.returncode == 0, done.stderr
    assert (
        b"a: too far from 0 for 32-bit floats; the model's origin is 4500000, 5600000, 0"
        in done.stderr
    )
    scene = trimesh.load(tmp_path / "x.glb")
    masses = [scene.geometry[f"{name}/mass"].bounds for name in "ab"]
    assert masses[0][0][[0, 2]] == pytest.approx([0.25, -6.5], abs=1e-5)
    assert masses[1][0][0] == pytest.approx(20.375, abs=1e-5)


def test_models_too_far_apart_for_one_file_are_warned_of(facade_here, tmp_path):
    far = {**FOOTPRINT, "id": "far", "polygon": [[[5e5, 0], [500009, 0], [500009, 6], [5e5, 6]]]}
    done = facade_here("export", "-", "-o", tmp_path / "x.glb", stdin=stream(FOOTPRINT, far))
    assert done.returncode == 0
    assert b"over 10 km apart" in done.stderr


def test_a_single_model_stays_local_but_its_cityjson_knows_the_map(facade_here, tmp_path):
    for end in ("glb", "city.json"):
        done = facade_here(
            "export", "-", "-o", tmp_path / f"x.{end}", stdin=stream(framed("a", 5.0))
        )
        assert done.returncode == 0
    assert trimesh.load(tmp_path / "x.glb").geometry["mass"].bounds[0][0] == 0.0
    city = json.loads((tmp_path / "x.city.json").read_bytes())
    assert city["metadata"]["geographicalExtent"][0] == 500005.0


def test_standard_output_takes_a_single_file(facade_here):
    done = facade_here("export", "-", "-o", "-", stdin=stream(HOUSE))
    assert done.stdout.startswith(b"glTF")
    assert (
        facade_here("export", "-", "-o", "-", "--format", "obj", stdin=stream(HOUSE)).returncode
        == 2
    )


@pytest.mark.parametrize(
    ("arguments", "items", "code", "text"),
    [
        (["-o", "x.dae"], [HOUSE], 2, "unknown ending"),
        ([], [HOUSE], 2, "-o"),
        (["-o", "x.glb"], [HOUSE, HOUSE], 3, "'h1' stands twice"),
        (["-o", "x/"], [HOUSE, HOUSE], 3, "'h1' stands twice"),
        (["-o", "x.glb"], [{**HOUSE, "boxes": []}], 3, "/boxes"),
        (["-o", "x.glb"], [{"schema": "facade-tools/attributes/1"}], 3, "/schema"),
    ],
)
def test_errors_are_one_line_and_leave_no_file(facade_here, tmp_path, arguments, items, code, text):
    done = facade_here("export", "-", *arguments, stdin=stream(*items), cwd=tmp_path)
    assert done.returncode == code
    assert text in done.stderr.decode()
    assert not list(tmp_path.glob("*.glb"))


def test_skip_writes_the_good_ones_and_exits_3(facade_here, tmp_path):
    bad = {**HOUSE, "id": "bad", "boxes": []}
    out = tmp_path / "out"
    done = facade_here(
        "export", "-", "-o", f"{out}/", "--on-error", "skip", stdin=stream(bad, HOUSE)
    )
    assert done.returncode == 3
    assert [path.name for path in out.iterdir()] == ["h1.glb"]


@pytest.mark.parametrize("ending", ["glb", "obj", "city.json"])
def test_skip_writes_the_good_ones_of_one_file(facade_here, tmp_path, ending):
    bad = {**HOUSE, "id": "bad", "boxes": []}
    skip = ("--on-error", "skip")
    out, want = (tmp_path / name / f"model.{ending}" for name in ("skipped", "good"))
    done = facade_here("export", "-", "-o", out, *skip, stdin=stream(bad, HOUSE, HOUSE))
    assert done.returncode == 3
    assert "2 bad items were skipped" in done.stderr.decode()
    facade_here("export", "-", "-o", want, stdin=stream(HOUSE))
    assert out.read_bytes() == want.read_bytes()


def test_ids_that_would_share_a_file_are_told_apart_or_refused(facade_here, tmp_path):
    long = "屋" * 200
    names = ["way/1", "way:1", "A", "a", long, f"{long[:-1]}b"]
    items = stream(*({**HOUSE, "id": name} for name in names))
    done = facade_here("export", "-", "-o", f"{tmp_path}/o/", "--on-error", "skip", stdin=items)
    assert done.returncode == 3
    assert "ids 'way/1' and 'way:1' have one file name, way_1" in done.stderr.decode()
    assert "ids 'A' and 'a' have one file name" in done.stderr.decode()
    written = sorted(path.name for path in (tmp_path / "o").iterdir())
    assert written == ["A.glb", "way_1.glb", f"{'屋' * 66}.glb"]


def test_standard_output_that_is_full_is_no_bug(facade_script):
    command = [facade_script, "export", "-", "-o", "-"]
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            command, input=stream(HOUSE), stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 1
    assert b"export: error: standard output cannot be written: No space left" in done.stderr


def test_an_empty_stream_is_an_empty_model(facade_here, tmp_path):
    (tmp_path / "none.jsonl").write_bytes(b"")
    out = tmp_path / "none.glb"
    assert facade_here("export", tmp_path / "none.jsonl", "-o", out).returncode == 0
    assert out.read_bytes().startswith(b"glTF")
