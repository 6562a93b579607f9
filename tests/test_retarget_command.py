"""The command retarget: bases checked, named and skipped."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.style_folder import write_style
from facade_tools.stylization.capture import capture_style

SAMPLES = Path(__file__).parent.parent / "sample_data" / "textured"

BLOCK = {
    "id": "a", "role": "body", "x": 0, "y": 0, "z": 0, "width": 18, "depth": 9, "height": 9,
    "floors": 3,
}  # fmt: skip


def base_file(path, identity="b", blocks=(BLOCK,), **more):
    document = {"schema": "facade-tools/blocks/1", "id": identity, "blocks": list(blocks), **more}
    path.write_text(json.dumps(document))
    return path


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("style")
    mesh = read_textured(SAMPLES / "l-block" / "model.obj")
    style = capture_style(mesh, "l-block")
    write_style(folder, style.sheet, style.blocks, style.pictures)
    return folder


def test_several_bases_into_one_file_are_refused_before_any_work(facade_here, sheet, tmp_path):
    bases = [base_file(tmp_path / f"{name}.json", name) for name in "ab"]
    done = facade_here("retarget", sheet, *bases, "-o", tmp_path / "x" / "one.glb")
    assert done.returncode == 2
    assert "several bases; name a folder" in done.stderr.decode()
    assert not (tmp_path / "x").exists()


def test_the_view_of_a_styles_folder_is_its_sheet(facade_here, sheet, tmp_path):
    for name, shown in (("folder", sheet), ("file", sheet / "stylesheet.json")):
        done = facade_here("view", shown, "-o", tmp_path / f"{name}.png")
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "folder.png").read_bytes() == (tmp_path / "file.png").read_bytes()


def lying_in_inches(path):
    """Write the sample house as a drawing in inches that is y up."""
    lines = (SAMPLES / "l-block" / "model.obj").read_text().splitlines()
    for k, line in enumerate(lines):
        if line.startswith("v "):
            x, y, z = (float(v) / 0.0254 for v in line.split()[1:4])
            lines[k] = f"v {x} {z} {-y}"
    path.write_text("\n".join(lines))
    return path


def test_a_mesh_as_base_has_its_unit_and_its_axis(facade_here, sheet, tmp_path):
    base = lying_in_inches(tmp_path / "house.obj")
    out = tmp_path / "house.glb"
    done = facade_here("retarget", sheet, base, "--unit", "in", "--up", "y", "-o", out)
    assert done.returncode == 0, done.stderr
    found = read_textured(out).vertices
    own = read_textured(SAMPLES / "l-block" / "model.obj").vertices
    assert np.allclose(np.ptp(found, axis=0), np.ptp(own, axis=0), atol=0.05)


def test_a_base_that_states_its_unit_takes_none(facade_here, sheet, tmp_path):
    trimesh.creation.box((20, 10, 9)).export(tmp_path / "box.glb")
    for options in (("--unit", "in"), ("--up", "y")):
        done = facade_here(
            "retarget", sheet, tmp_path / "box.glb", *options, "-o", tmp_path / "new.glb"
        )
        assert done.returncode == 3
        assert "box.glb: states its unit and its axis" in done.stderr.decode()


def test_ids_that_are_one_file_name_are_refused(facade_here, sheet, tmp_path):
    bases = [base_file(tmp_path / f"{k}.json", name) for k, name in enumerate(["a/b", "a_b"])]
    done = facade_here("retarget", sheet, *bases, "-o", tmp_path / "out")
    assert done.returncode == 3
    assert "ids 'a/b' and 'a_b' have one file name, a_b" in done.stderr.decode()


def test_meshes_of_one_folder_are_named_by_their_files(facade_here, sheet, tmp_path):
    for name in ("d/one.obj", "d/two.obj", "e/model.obj", "here.obj"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes((SAMPLES / "l-block" / "model.obj").read_bytes())
    words = ("retarget", sheet, "d/one.obj", "d/two.obj", "e/model.obj", "here.obj")
    done = facade_here(*words, "-o", tmp_path / "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    made = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert made == ["e.glb", "here.glb", "one.glb", "two.glb"]


SINGULAR = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1]]
PROJECTIVE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0.1, 0, 0, 1]]


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ({"frame": SINGULAR}, "/frame: is singular"),
        ({"frame": PROJECTIVE}, "/frame: is singular or projective"),
        ({"blocks": [BLOCK, BLOCK | {"x": 20}]}, "/blocks/1/id: id 'a' stands twice"),
    ],
)
def test_bases_are_checked(facade_here, sheet, tmp_path, more, expected):
    base = base_file(tmp_path / "b.json", **more)
    done = facade_here("retarget", sheet, base, "-o", tmp_path / "x.glb")
    assert done.returncode == 3
    assert f"{base}: {expected}" in done.stderr.decode()
    assert not (tmp_path / "x.glb").exists()
    assert expected in facade_here("validate", base).stdout.decode()


def test_bad_bases_are_skipped_if_asked(facade_here, sheet, tmp_path):
    bases = [
        base_file(tmp_path / "bad.json", "bad", frame=SINGULAR),
        base_file(tmp_path / "good.json", "good"),
    ]
    out = tmp_path / "out"
    assert facade_here("retarget", sheet, *bases, "-o", out).returncode == 3
    assert not out.exists()
    done = facade_here("retarget", sheet, *bases, "-o", out, "--on-error", "skip")
    assert done.returncode == 3
    assert "1 bad items were skipped" in done.stderr.decode()
    assert [path.name for path in out.iterdir()] == ["good.glb"]


TURN = [[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]


def frame(x, y, z):
    return [[*row, step] for row, step in zip(TURN, (x, y, z), strict=True)] + [[0, 0, 0, 1]]


def scene_of(path):
    return trimesh.load_scene(path, process=False)


def test_bases_on_a_map_keep_their_shape_and_their_distance(facade_here, sheet, tmp_path):
    """In single precision, walls at such places would stand half a metre off the solid."""
    places = {"a": (0, 0, 0), "b": (4468000.25, 5333000.5, 520), "c": (4468100.25, 5333000.5, 520)}
    bases = [base_file(tmp_path / f"{n}.json", n, frame=frame(*p)) for n, p in places.items()]
    done = facade_here("retarget", sheet, *bases, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count(b"too far from 0") == 1
    assert b"b: too far from 0 for 32-bit floats; the origin of this and what follows is 44" in (
        done.stderr
    )
    near, far, beside = (scene_of(tmp_path / "out" / f"{name}.glb") for name in places)
    steps = [far.bounds[0] - near.bounds[0], beside.bounds[0] - far.bounds[0]]
    assert np.allclose(steps[1], [100, 0, 0], atol=1e-3)
    for name, mesh in near.geometry.items():
        moved = far.geometry[name].vertices - steps[0]
        assert np.allclose(moved, mesh.vertices, atol=1e-4), name


def test_a_house_on_a_map_has_its_roof_on_its_walls(facade_here, sheet, tmp_path):
    roof = {"style": "gable", "pitch": 40, "direction": "x"}
    box = {"id": "m", "kind": "general", "x": 6, "y": 4, "width": 12, "depth": 8, "height": 6}
    house = {"schema": "facade-tools/building/1", "id": "h", "boxes": [{**box, "roof": roof}]}
    volumes = []
    for shift in ([0, 0, 0], [468000.25, 5333000.5, 520]):
        place = {"shift": shift, "rotation": 30, "crs": "EPSG:25832"}
        (tmp_path / "h.json").write_text(json.dumps({**house, "facades": {}, "frame": place}))
        done = facade_here("retarget", sheet, tmp_path / "h.json", "-o", tmp_path / "h.glb")
        assert done.returncode == 0, done.stderr
        mass = scene_of(tmp_path / "h.glb").geometry["mass"]
        assert mass.is_watertight
        volumes.append(mass.volume)
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-5)
    assert volumes[0] > 12 * 8 * 6


def test_jobs_change_no_byte(facade_here, sheet, tmp_path):
    bases = [base_file(tmp_path / f"{k}.json", f"b{k}") for k in range(3)]
    for jobs in (1, 2):
        out = tmp_path / str(jobs)
        assert facade_here("retarget", sheet, *bases, "-o", out, "--jobs", jobs).returncode == 0
    for path in (tmp_path / "1").iterdir():
        assert path.read_bytes() == (tmp_path / "2" / path.name).read_bytes()


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda d: d.update(walls=[]), "/walls: expected one front wall of block 'block-0'"),
        (lambda d: d["walls"][0]["faces"][0].update(floor=99), "/walls/0/faces/0/floor: no floor"),
        (lambda d: d["walls"][0]["faces"][0].update(vertical="h0"), "no such vertical group: 'h0'"),
        (lambda d: d["walls"][0]["faces"][0].update(top=-1), "/walls/0/faces/0: expected a width"),
        (lambda d: d["floors"][0].update(cells=["11"]), "/floors/0/cells: expected a cell"),
        (lambda d: d["floors"][0]["xs"].reverse(), "/floors/0/xs: expected numbers that increase"),
        (lambda d: d["floors"][0].update(bottom=9e3), "/floors/0: expected its top above"),
        (lambda d: d["rules"][0].update(a=[0.0], b=[]), "/rules/0: expected one scalable"),
    ],
)
def test_sheets_that_contradict_themselves_are_refused(
    facade_here, sheet, tmp_path, change, expected
):
    style = tmp_path / "style"
    shutil.copytree(sheet, style)
    document = json.loads((style / "stylesheet.json").read_text())
    change(document)
    (style / "stylesheet.json").write_text(json.dumps(document))
    for words in (
        ("retarget", style, style / "blocks.json", "-o", tmp_path / "x.glb"),
        ("validate", style / "stylesheet.json"),
    ):
        done = facade_here(*words)
        assert done.returncode == 3
        assert expected in done.stdout.decode() + done.stderr.decode()


def test_a_sheet_beside_blocks_of_another_model_is_refused(facade_here, sheet, tmp_path):
    style = tmp_path / "style"
    shutil.copytree(sheet, style)
    base_file(style / "blocks.json")
    done = facade_here("retarget", style, style / "blocks.json", "-o", tmp_path / "x.glb")
    assert done.returncode == 3
    assert b"blocks.json: /blocks: no block 'block-0', which stylesheet.json has" in done.stderr
