"""`facade layer-solve`: designs to layouts, pictures, meshes, errors."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.numbers import canonical, dump_document
from facade_tools.artifacts.store import read_one
from facade_tools.errors import Infeasible
from facade_tools.layering.drawing import layout_picture, sheet_bytes
from facade_tools.layering.elements import facade_elements
from facade_tools.layering.scene import layout_scene
from facade_tools.layering.solve import solve_design, variations

ROOT = Path(__file__).resolve().parent.parent
DESIGNS = sorted((ROOT / "sample_data" / "designs").glob("*.yaml"))
RESIDENTIAL = ROOT / "sample_data" / "designs" / "residential-9.yaml"
GOLDEN = ROOT / "tests" / "golden" / "layouts"


def design(path=RESIDENTIAL):
    return replace(read_one(str(path), "design"), id=path.stem)


def check(layout):
    """What every layout promises."""
    for axis, length in (("x", layout.canvas.width), ("y", layout.canvas.height)):
        for group in getattr(layout, axis).values():
            assert group.boundaries[0] == 0.0
            assert group.boundaries[-1] == length
            assert np.all(np.diff(group.boundaries) > 0)
            for word, columns, borders in zip(
                group.words, group.columns, group.borders, strict=True
            ):
                flat = [name for column in columns for name in column]
                assert group.pieces or tuple(flat) == word
                assert np.all(np.diff(borders) >= -1e-9)
            for j in range(len(group.boundaries) - 1):
                assert any(row[j] for row in group.columns)
                width = group.boundaries[j + 1] - group.boundaries[j]
                for row in group.columns:
                    if row[j] and group.pieces == 0:
                        total = sum(group.sizes[name.lstrip("~")] for name in row[j])
                        assert total == pytest.approx(width, abs=1e-8)
    for shape in layout.shapes:
        assert shape.x1 >= shape.x0
        assert shape.y1 >= shape.y0


@pytest.mark.parametrize("path", DESIGNS, ids=lambda path: path.stem)
def test_every_sample_design_is_solved_and_proved(path):
    layout = solve_design(design(path), time_limit=60.0)
    check(layout)
    groups = [*layout.x.values(), *layout.y.values()]
    assert all(group.optimal and group.gap == 0.0 for group in groups)
    again = decode(json.loads(json.dumps(canonical(encode(layout)))), "layout")
    assert encode(again) == canonical(encode(layout))


@pytest.mark.parametrize("name", ["residential-9", "terraced-balconies"])
def test_golden(name, update_golden):
    data = dump_document(encode(solve_design(design(RESIDENTIAL.with_stem(name)), time_limit=60)))
    path = GOLDEN / f"{name}.json"
    if update_golden:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    assert path.read_bytes() == data


@given(width=st.floats(0.5, 20.0), height=st.floats(0.5, 8.0))
@settings(max_examples=15, deadline=None)
def test_any_canvas_is_solved_without_holes_or_refused(width, height):
    try:
        layout = solve_design(design(), width=width, height=height)
    except Infeasible as error:
        layout, message = None, str(error)
    if layout is None:
        assert " m)" in message
    else:
        check(layout)


def test_masks_looks_and_occlusion():
    layout = solve_design(design())
    columns = [s for s in layout.shapes if s.layer == "columns"]
    assert {s.symbols for s in columns if s.visible} == {("C", "P")}
    assert all(s.depth == 0.3 and s.mesh == "column.obj" for s in columns if s.visible)
    assert all(s.visible for s in layout.shapes if s.layer == "base")


def test_scene_of_a_layout():
    layout = solve_design(design())
    text = (RESIDENTIAL.parent / "column.obj").read_text()
    layout = replace(layout, assets={"column.obj": {"media": "model/obj", "data": text}})
    scene = layout_scene(layout)
    names = {mesh.name for mesh in scene.meshes}
    assert "columns/CP" in names
    for mesh in scene.meshes:
        corners = mesh.vertices[mesh.faces]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        assert volume.sum() > 0  # outward
        assert mesh.vertices[:, 0].min() >= -1e-9
        assert mesh.vertices[:, 0].max() <= 6 + 1e-9


def test_mirrored_shapes_keep_their_orientation():
    source = design()
    flipped = replace(source, patterns={**source.patterns, "Cx": {"control": "cec^-1", "c": "C"}})
    layout = solve_design(flipped)
    assert ("~C", "P") in {s.symbols for s in layout.shapes}
    for mesh in layout_scene(layout).meshes:
        corners = mesh.vertices[mesh.faces]
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        assert volume.sum() > 0


def test_drawings():
    layout = solve_design(design())
    picture = layout_picture(layout)
    assert picture.ndim == 3
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 5
    svg = sheet_bytes([layout, layout], ".svg")
    assert svg.startswith(b"<svg")
    assert svg.count(b">CP<") == 4


def test_facade_elements():
    elements = facade_elements(solve_design(design(RESIDENTIAL.with_stem("haussmann"))))
    assert {element.kind for element in elements} == {"window", "door"}
    assert all(element.width > 0 and element.height > 0 for element in elements)


def test_variations_differ_and_start_with_the_best():
    source = design(RESIDENTIAL.with_stem("modern"))
    source = replace(source, layers=source.layers[2:])
    found = list(variations(source, time_limit=20.0))
    assert len({layout.id for layout in found}) == len(found) > 1
    assert encode(found[0]) == encode(solve_design(source))


def test_command(facade, tmp_path):
    out = tmp_path / "layout.json"
    done = facade("layer-solve", RESIDENTIAL, "-o", out, "--sheet", tmp_path / "sheet.png")
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")
    layout = json.loads(out.read_bytes())
    assert layout["provenance"]["inputs"][0]["name"] == "residential-9.yaml"
    assert layout["assets"]["column.obj"]["media"] == "model/obj"
    assert (tmp_path / "sheet.png").read_bytes()[:4] == b"\x89PNG"
    done = facade("view", out, "-o", tmp_path / "drawing.svg")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "drawing.svg").read_bytes().startswith(b"<svg")
    done = facade("export", out, "-o", tmp_path / "model.glb")
    assert done.returncode == 0, done.stderr
    sweep = facade("layer-solve", RESIDENTIAL, "--width", "6:8:2")
    assert [json.loads(line)["id"] for line in sweep.stdout.splitlines()] == [
        "residential-9-6x3", "residential-9-8x3"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "code", "expected"),
    [
        ('"A(BA)^k"', '"A(BA^k"', 3, ":5: /patterns/Bx: pattern, line 1, column 7"),
        ("opaque: false", "opak: false", 3, ":3: /symbols/C/opak: Additional properties"),
        ("counters: {k: auto}", "counters: {}", 3, "counter 'k'"),
        ("x: Cx", "x: Cy", 3, ":7: /layers/0/x: pattern 'Cy' does not exist"),
        ("width: 6", "width: 0.1", 4, "x (0.1 m): layer"),
    ],
)
def test_command_refuses(facade, tmp_path, old, new, code, expected):
    text = RESIDENTIAL.read_text()
    assert old in text
    path = tmp_path / "bad.yaml"
    path.write_text(text.replace(old, new))
    (tmp_path / "column.obj").write_bytes(RESIDENTIAL.with_name("column.obj").read_bytes())
    done = facade("layer-solve", path)
    message = done.stderr.decode()
    assert done.returncode == code, message
    assert expected in message
    assert message.count("\n") == 1
    assert done.stdout == b""


# --- assets, sweeps, sheets -----------------------------------------------------------------------
TILES = """\
canvas: {width: 6, height: 3}
symbols: {A: {size: 1.0}, P: {size: 1.5}}
counters: {k: auto}
patterns: {X: "A^k", Y: "P^k"}
layers: [{name: base, x: X, y: Y, shapes: {}}]
"""


@pytest.mark.parametrize(
    ("pattern", "counters"),
    [
        ("A^(k-100)", "{k: auto}"),
        ("A^(2k-90)", "{k: auto}"),
        ("A^(k-m)", "{k: auto, m: 200}"),
        ("A^(m-2k)", "{k: auto, m: 206}"),
        ("A^(k-m)A^(m-92)", "{k: auto, m: {min: 94, max: 95}}"),
    ],
)
def test_a_counter_reaches_what_its_exponent_needs(tmp_path, pattern, counters):
    text = TILES.replace("A^k", pattern).replace("{k: auto}", counters).replace("P^k", "PP")
    (tmp_path / "d.yaml").write_text(text)
    (found,) = solve_design(design(tmp_path / "d.yaml")).x.values()
    assert found.words == (("A",) * 6,)


@pytest.mark.parametrize("control", ["xc|x", "xcc|x", "x(cc)^(k-4)"])
def test_a_content_that_does_not_fit_leaves_the_words_without_it(tmp_path, control):
    text = TILES.replace('X: "A^k"', f'X: "A^k", T: {{control: "{control}", c: "L"}}')
    text = text.replace("A: {", "L: {size: 9}, A: {").replace("[{", "[{name: top, x: T, y: Y}, {")
    (tmp_path / "d.yaml").write_text(text.replace("width: 6", "width: 4").replace("P^k", "PP"))
    (found,) = solve_design(design(tmp_path / "d.yaml")).x.values()
    assert found.words == (("x",), ("A",) * 4)


def test_many_layers_have_at_least_the_layout_of_whole_words(tmp_path):
    names = [f"S{i}" for i in range(14)]
    document = {
        "canvas": {"width": 10, "height": 3},
        "symbols": {"P": {"size": 3}, **{n: {"size": 1 + 0.04 * i} for i, n in enumerate(names)}},
        "counters": {"k": "auto"},
        "patterns": {"Y": "P", **{f"X{n}": f"{n}^k" for n in names}},
        "layers": [{"name": n, "x": f"X{n}", "y": "Y"} for n in names],
    }
    (tmp_path / "d.yaml").write_text(json.dumps(document))
    layout = solve_design(design(tmp_path / "d.yaml"), time_limit=1.5)
    check(layout)
    (found,) = layout.x.values()
    assert found.alignment_error <= found.tolerance * 10 * (1 + 1e-9)
    above = replace(design(tmp_path / "d.yaml").symbols["S13"], unoccludable=True)
    kept = design(tmp_path / "d.yaml")
    kept = replace(kept, symbols={**kept.symbols, "S13": above})
    with pytest.raises(Infeasible):
        solve_design(kept, time_limit=1.5)


def png(width, height, data=b"\0\0"):
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(data)),
        (b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in chunks
    )


@pytest.mark.parametrize(
    ("shapes", "data", "expected"),
    [
        ("shapes: {AP: {mesh: a.obj}}", b"hello\n", ":6: /shapes/AP/mesh: a.obj has no faces"),
        ("shapes: {AP: {mesh: a.obj}}", b"v 0 0 0\nv nan 0 1\nf 1 2 1\n", "a.obj OBJ line 2 is"),
        ("shapes: {AP: {mesh: a.obj}}", b"v 0 0 0\nv 1 0\nf 1 2 1\n", "a.obj OBJ line 2 is"),
        ("shapes: {AP: {mesh: a.png}}", png(1, 1), "/shapes/AP/mesh: a.png: expected .obj"),
        ("shapes: {AP: {mesh: a.obj}}", None, "/shapes/AP/mesh: a.obj cannot be read"),
        ("shapes: {AP: {texture: a.png}}", b"bad\n", "/shapes/AP/texture: a.png is no picture"),
        ("shapes: {A*: {texture: a.png}}", png(30000, 30000), "/A*/texture: a.png has 30000×30000"),
        ("layers/0", b"hello\n", ":5: /layers/0/shapes/AP/mesh: a.obj has no faces"),
    ],
)
def test_assets_are_checked_before_anything_is_solved(
    facade_here, monkeypatch, tmp_path, shapes, data, expected
):
    monkeypatch.setattr("facade_tools.layering.solve.prepare", lambda: pytest.fail("solved"))
    text = TILES + shapes + "\n"
    if shapes == "layers/0":
        text = TILES.replace("shapes: {}", "shapes: {AP: {mesh: a.obj}}")
    (tmp_path / "d.yaml").write_text(text)
    if data is not None:
        (tmp_path / ("a.png" if "a.png" in shapes else "a.obj")).write_bytes(data)
    done = facade_here("layer-solve", tmp_path / "d.yaml", "-o", tmp_path / "out.json")
    assert done.returncode == 3, done.stderr
    assert expected in done.stderr.decode()
    assert not (tmp_path / "out.json").exists()


@pytest.mark.parametrize(
    ("look", "media", "data"),
    [
        ("mesh", "model/obj", "hello"),
        ("mesh", "model/obj", "v 0 0 0\nv inf 0 1\nf 1 2 1"),
        ("texture", "image/png", "YmFkCg=="),
        ("texture", "image/png", "no base64"),
    ],
)
def test_assets_of_a_layout_are_checked_on_the_way_out(facade_here, tmp_path, look, media, data):
    shapes = (replace(solve_design(design()).shapes[0], visible=True, **{look: "a/b"}),)
    layout = replace(solve_design(design()), shapes=shapes)
    layout = replace(layout, assets={"a/b": {"media": media, "data": data}})
    (tmp_path / "l.json").write_bytes(dump_document(encode(layout)))
    for command in (("export", "-o", tmp_path / "l.glb"), ("validate",)):
        done = facade_here(command[0], tmp_path / "l.json", *command[1:])
        assert done.returncode == 3, done.stderr
        assert b"/assets/a~1b/data" in done.stderr + done.stdout


def test_a_sweep_leaves_out_what_has_no_layout_if_asked(facade_here, tmp_path):
    (tmp_path / "d.yaml").write_text(TILES)
    sweep = ("layer-solve", tmp_path / "d.yaml", "--width", "0.2:4.2:1", "-o", tmp_path / "o.jsonl")
    sheet = tmp_path / "sheet.svg"
    assert facade_here(*sweep, "--sheet", sheet).returncode == 4
    assert not (tmp_path / "o.jsonl").exists()
    done = facade_here(*sweep, "--sheet", sheet, "--on-error", "skip")
    assert done.returncode == 3
    assert [line.split(b":")[2] for line in done.stderr.splitlines()] == [
        b" x (0.2 m)", b" 1 bad items were skipped",
    ]  # fmt: skip
    widths = [json.loads(line)["id"] for line in (tmp_path / "o.jsonl").read_bytes().splitlines()]
    assert widths == [f"d-{width}.2x3" for width in (1, 2, 3, 4)]
    assert sheet.exists()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--sheet", "s.gif"), "--sheet s.gif: expected"),
        (("--width", "2:4:1", "-o", "sweep.json"), "sweep.json: several layouts"),
    ],
)
def test_outputs_that_cannot_be_are_refused_first(
    facade_here, monkeypatch, tmp_path, words, expected
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("facade_tools.layering.solve.prepare", lambda: pytest.fail("solved"))
    done = facade_here("layer-solve", RESIDENTIAL, *words)
    assert done.returncode == 2
    assert expected in done.stderr.decode()
    assert list(tmp_path.iterdir()) == []
