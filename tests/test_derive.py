"""Shape grammars in three dimensions: expressions, operators, derivations, and `facade derive`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.documents import decode, parse_yaml
from facade_tools.artifacts.pointers import line_of
from facade_tools.errors import InvalidInput
from facade_tools.formats import gltf
from facade_tools.geometry.checks import building_problems
from facade_tools.randomness import item_generator
from facade_tools.reconstruction import operators
from facade_tools.reconstruction.boxed import derived_building
from facade_tools.reconstruction.drawing import derived_scene, mass_of
from facade_tools.reconstruction.engine import Lot, derive
from facade_tools.reconstruction.expressions import evaluated, number
from facade_tools.reconstruction.library import builtin_names, load
from facade_tools.reconstruction.operators import Measure
from facade_tools.reconstruction.records import derivation_of, derivation_problems, derivation_scene
from facade_tools.reconstruction.roofing import RoofPlan, roof_over
from facade_tools.reconstruction.scopes import Scope, Shape, faces_of
from facade_tools.reconstruction.volumes import standing

from .conftest import ROOT
from .judges import khronos_issues

SMALL = {"haussmann": {"floors": 2.0}, "modern": {"floors": 4.0}, "victorian": {"houses": 2.0}}
SAMPLES = ROOT / "sample_data" / "shape-grammars"

BOX = """
id: box
axiom: Lot
lot: {width: 8, depth: 6}
rules:
  - {symbol: Lot, do: [{extrude: 3, into: Body}]}
  - {symbol: Body, do: [{faces: {front: Front, side: Wall, top: Wall}}]}
  - {symbol: Front, do: [{split: x, into: [{Wall: 2}, {Window: 25%}, {Wall: ~1}, {Window: ~1}]}]}
terminals: {Wall: {label: wall}, Window: {label: window}}
"""


def rng(seed=0):
    return item_generator(seed, "test")


def grammar(text):
    return decode({"schema": "facade-tools/shape-grammar/1", **parse_yaml(text.encode())})


def derived(text, seed=0, lots=()):
    return derive(grammar(text), lots, rng=rng(seed))


def solid_of(made):
    mass = derived_scene(made, "x").meshes[0]
    assert mass.name == "mass"
    return trimesh.Trimesh(mass.vertices, mass.faces, process=False)


def shape(width=4.0, depth=3.0, height=0.0, outline=None, normal="z"):
    scope = Scope(np.zeros(3), np.eye(3), np.array([width, depth, height]))
    return Shape("A", scope, outline, normal)


MEASURE = Measure({"w": 2.0}, rng())


# --- expressions ----------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3", 7.0), ("-(w - 5) / 2", 1.5), ("min(3, w) + max(1, 4)", 6.0),
        ("7 // 2 + 7 % 4", 6.0), ("3 if w > 1 else 4", 3.0), ("round(2.5)", 3.0),
        ("floor(2.7) + ceil(0.2)", 3.0), ("1 < w <= 2", 1.0), ("not w == 2 or w != 3", 1.0),
    ],
)  # fmt: skip
def test_expressions(text, value):
    assert number(text, {"w": 2.0}, rng()) == value


def test_conditions_read_the_side():
    assert evaluated("side == 'front' and index > 0", {"side": "front", "index": 1.0}, rng())


def test_draws_depend_on_the_generator_alone():
    text = "uniform(1, 2) + normal(0, 1) + choice(10, 20)"
    assert number(text, {}, rng()) == number(text, {}, rng())
    assert number(text, {}, rng()) != number(text, {}, rng(1))


@pytest.mark.parametrize(
    "text",
    ["__import__('os')", "w.real", "[1]", "lambda: 1", "w ** 9", "f'{w}'", "1 +", "unknown", "1/0",
     "'a' * 3", "open(1)", "-" * 80 + "1", "1e999", "'a' < 1",
     "uniform(1)", "sqrt(-1)", "floor(1e308 * 10)", "min('a', 1)", "choice(1)(2)", "w if"],
)  # fmt: skip
def test_what_is_no_expression_is_refused(text):
    with pytest.raises(InvalidInput):
        number(text, {"w": 2.0}, rng())


# --- operators ------------------------------------------------------------------------------------
def test_split_takes_metres_shares_and_what_is_left():
    parts = [{"A": 1}, {"B": "25%"}, {"C": "~1"}, {"D": "~3"}]
    made = list(operators.split(shape(8.0), "x", parts, MEASURE))
    assert [piece.symbol for piece in made] == ["A", "B", "C", "D"]
    assert [round(float(piece.scope.size[0]), 9) for piece in made] == [1.0, 2.0, 1.25, 3.75]
    assert made[-1].scope.origin.tolist() == [4.25, 0.0, 0.0]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0.05, 3.0), min_size=1, max_size=6), st.floats(1.0, 30.0))
def test_flexible_parts_fill_the_scope(weights, length):
    parts = [{f"S{k}": f"~{weight!r}"} for k, weight in enumerate(weights)]
    made = list(operators.split(shape(length), "x", parts, MEASURE))
    sizes = np.array([piece.scope.size[0] for piece in made])
    assert sizes.sum() == pytest.approx(length)
    np.testing.assert_allclose(sizes / length, np.array(weights) / sum(weights), rtol=1e-9)


def test_parts_that_need_too_much_are_refused():
    with pytest.raises(InvalidInput, match=r"need 9 m and the scope has 4 m"):
        list(operators.split(shape(), "x", [{"A": 5}, {"B": 4}], MEASURE))
    with pytest.raises(InvalidInput, match="size of -1 m"):
        list(operators.split(shape(), "x", [{"A": "w - 3"}, {"B": "~1"}], MEASURE))


def test_a_split_outline_keeps_its_area():
    triangle = [np.array([[0.0, 0.0], [4.0, 0.0], [2.0, 3.0]])]
    made = list(operators.split(shape(outline=triangle), "x", [{"A": 1}, {"B": "~1"}], MEASURE))
    areas = [piece.names()["area"] for piece in made]
    assert sum(areas) == pytest.approx(6.0)
    assert areas[0] == pytest.approx(0.75)


def test_repeat_takes_the_nearest_number():
    for length, count in ((10.0, 4), (11.2, 4), (11.3, 5), (0.4, 1)):
        made = list(operators.repeat(shape(length), "x", 2.5, "T"))
        assert [piece.index for piece in made] == list(range(count))
        assert all(piece.count == count for piece in made)


def test_the_mirrored_half_is_mirrored():
    left, right = operators.mirror(shape(8.0), "x", "H")
    a = next(iter(operators.split(left, "x", [{"A": 1}, {"B": "~1"}], MEASURE)))
    b = next(iter(operators.split(right, "x", [{"A": 1}, {"B": "~1"}], MEASURE)))
    assert a.scope.bounds()[0] == 0.0
    assert b.scope.bounds()[3] == 8.0
    assert right.scope.mirrored
    solid = operators.extruded(b, 2.0)
    faces = faces_of(solid)
    triangles = [
        (f[0][0], f[0][k], f[0][k + 1]) for f in faces.faces for k in range(1, len(f[0]) - 1)
    ]
    mesh = trimesh.Trimesh(faces.points, triangles)
    assert mesh.is_volume
    assert mesh.volume == pytest.approx(1.0 * 3.0 * 2.0)


def test_transformations_move_the_scope_alone():
    operation = grammar("""
id: t
axiom: A
rules: [{symbol: A, do: [{translate: {x: 1, z: 50%}, rotate: {z: 90}, scale: {y: 200%}, into: W}]}]
terminals: {W: {label: wall}}
""").rules[0].do[0]  # fmt: skip
    moved = operators.transformed(shape(4.0, 2.0, 3.0), operation, MEASURE)
    np.testing.assert_allclose(moved.scope.axes[0], [0.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(moved.scope.size, [4.0, 4.0, 3.0])
    np.testing.assert_allclose(moved.scope.origin, [5.0, 0.0, 1.5], atol=1e-12)


def test_component_split_of_an_l_shaped_volume():
    ring = np.array([[0, 0], [6, 0], [6, 3], [3, 3], [3, 6], [0, 6]], float)
    solid = operators.extruded(shape(6.0, 6.0, outline=[ring]), 4.0)
    faces = list(operators.component_split(solid, {"side": "S", "top": "T", "bottom": "B"}))
    sides = [face.side for face in faces if face.symbol == "S"]
    assert sorted(sides) == ["back", "back", "front", "left", "right", "right"]
    for face in faces:
        normal = trimesh.Trimesh(*_triangles(faces_of(face))).face_normals[0]
        outward = {"front": [0, -1, 0], "back": [0, 1, 0], "left": [-1, 0, 0],
                   "right": [1, 0, 0], "top": [0, 0, 1], "bottom": [0, 0, -1]}  # fmt: skip
        np.testing.assert_allclose(normal, outward[face.side], atol=1e-9)


def _triangles(faces):
    from facade_tools.geometry.triangulate import triangulate_face

    parts = [triangulate_face(faces.points, [np.array(r) for r in face]) for face in faces.faces]
    return faces.points, np.concatenate(parts)


# --- roofs ----------------------------------------------------------------------------------------
RECTANGLE = [np.array([[0, 0], [10, 0], [10, 6], [0, 6]], float)]


def test_a_mansard_has_the_heights_that_were_asked_for():
    roof = roof_over(RECTANGLE, RoofPlan("mansard", rise=(2.6, 1.1)))
    lower = [face for face in roof.faces if face.kind == "lower"]
    upper = [face for face in roof.faces if face.kind == "upper"]
    assert (len(lower), len(upper)) == (4, 4)
    assert max(ring[:, 2].max() for face in lower for ring in face.rings) == pytest.approx(2.6)
    assert max(ring[:, 2].max() for face in upper for ring in face.rings) == pytest.approx(3.7)


def test_edges_of_weight_zero_are_gables():
    plan = RoofPlan("mansard", rise=(2.0, 1.0), weights={"left": 0.0, "right": 0.0})
    roof = roof_over(RECTANGLE, plan)
    gables = [face for face in roof.faces if face.kind == "gable"]
    assert sorted(face.side for face in gables) == ["left", "right"]
    assert all(len(face.rings[0]) == 5 for face in gables)
    slow = roof_over(RECTANGLE, RoofPlan("hip", pitch=(30.0, None), weights={"left": 0.5}))
    steep = max(abs(patch.plane[0]) for patch in slow.patches)
    assert steep == pytest.approx(2 * np.tan(np.radians(30.0)))


@pytest.mark.parametrize("style", ["flat", "gable", "hip", "mansard"])
@pytest.mark.parametrize("seed", range(3))
def test_roofs_over_any_outline_close(style, seed):
    angles = np.sort(rng(seed).uniform(0, 2 * np.pi, 7))
    ring = np.column_stack([8 * np.cos(angles), 5 * np.sin(angles)])
    text = BOX.replace("{extrude: 3, into: Body}", f"""{{extrude: 3, into: Body}},
      {{translate: {{z: 3}}, roof: {style}, into: {{all: Wall}}}}""")  # fmt: skip
    text = text.replace("{split: x, into: [{Wall: 2}", "{split: x, into: [{Wall: 5%}")
    text = text.replace("[{extrude", "[\n      {extrude")
    made = derived(text, lots=[Lot([ring])])
    assert solid_of(made).is_volume
    heights = mass_of(made).vertices[:, 2]
    assert heights.max() > 3.5 or style == "flat"


# --- derivations ----------------------------------------------------------------------------------
def test_inner_nodes_keep_the_history_and_leaves_the_geometry():
    made = derived(BOX)
    root = made.root
    assert (root.symbol, root.split, root.rule) == ("Lot", "extrude", 0)
    body = root.children[0]
    assert body.split == "faces"
    front = next(child for child in body.children if child.symbol == "Front")
    assert [child.symbol for child in front.children] == ["Wall", "Window", "Wall", "Window"]
    assert front.geometry is None
    assert all(child.geometry is not None and child.label for child in front.children)
    assert solid_of(made).volume < 8 * 6 * 3  # recessed windows
    assert mass_of(made).vertices[:, 2].max() == 3.0


def test_dormers_are_a_part_of_the_mass():
    text = """
id: dormer
axiom: Lot
lot: {width: 8, depth: 6}
rules:
  - symbol: Lot
    do: [{extrude: 3, into: Body}, {translate: {z: 3}, roof: mansard, into: {lower: L, upper: R}}]
  - {symbol: Body, do: [{faces: {side: W}}]}
  - {symbol: L, when: side == 'front', do: [{split: x, into: [{R: ~1}, {T: 1.2}, {R: ~1}]}]}
  - {symbol: L, when: otherwise, do: [{split: x, into: [{R: ~1}]}]}
  - {symbol: T, do: [{split: z, into: [{R: 0.4}, {D: 1.4}, {R: ~1}]}]}
  - {symbol: D, do: [{upright: true, faces: {front: Win, top: R, side: W}}]}
terminals: {W: {label: wall}, R: {label: roof}, Win: {label: window}}
"""
    made = derived(text)
    without = derived(text.replace("upright: true, faces: {front: Win, top: R, side: W}", "into: R")
                      .replace("{D: 1.4}", "{D: 1.4}"))  # fmt: skip
    assert len(standing(made.volumes)) == len(standing(without.volumes)) + 1
    assert solid_of(made).is_volume
    assert mass_of(made).vertices[:, 1].min() == pytest.approx(-3.0)
    assert solid_of(made).volume > solid_of(without).volume


def test_volumes_that_stand_on_nothing_are_no_mass():
    text = BOX.replace("{extrude: 3, into: Body}", """{extrude: 3, into: Body},
      {translate: {x: 20, z: 9}, box: true, scale: {x: 1, y: 1, z: 1}, into: Body2}""")  # fmt: skip
    text = text.replace("[{extrude", "[\n      {extrude")
    text = text.replace("rules:", "rules:\n  - {symbol: Body2, do: [{faces: {side: Wall}}]}")
    made = derived(text)
    assert (len(made.volumes), len(standing(made.volumes))) == (2, 1)


def test_several_rules_are_drawn_by_weight():
    text = BOX.replace("terminals:", "  - {symbol: Front, weight: 3, do: [{split: z, into: [{Wall: ~1}]}]}\nterminals:")  # fmt: skip  # noqa: E501
    picked = [len(derived(text, seed).leaves) for seed in range(60)]
    share = picked.count(min(picked)) / 60
    assert 0.55 < share < 0.95


def test_a_condition_chooses_and_otherwise_stands_in():
    text = BOX.replace("  - {symbol: Front, do", "  - {symbol: Front, when: width > 9, do")
    with pytest.raises(InvalidInput, match="no rule of 'Front' applies"):
        derived(text)
    text = text.replace("terminals:", "  - {symbol: Front, when: otherwise, do: [{split: z, into: [{Wall: ~1}]}]}\nterminals:")  # fmt: skip  # noqa: E501
    assert len(derived(text).leaves) == 5


@pytest.mark.parametrize("name", ["ksttp09", "haussmann", "victorian", "modern"])
def test_shipped_grammars_make_valid_buildings(name):
    loaded = load(name)
    for seed in range(2 if name == "ksttp09" else 1):
        made = derive(loaded.grammar, rng=rng(seed), given=SMALL.get(name))
        assert solid_of(made).is_volume
        storey = number(loaded.grammar.storey_height, made.parameters, rng())
        building = derived_building(made, "x", storey)
        assert list(building_problems(building)) == []
        assert building.partial == (name == "ksttp09")


def test_the_khronos_validator_finds_nothing():
    scenes = []
    for name in builtin_names():
        made = derive(load(name).grammar, rng=rng(5), given=SMALL.get(name))
        scenes.append(derived_scene(made, name))
    issues = khronos_issues(gltf.write(scenes, "all"))
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"][:3]


def test_sample_grammars_make_valid_buildings():
    for path in sorted(SAMPLES.glob("*.yaml")):
        made = derive(load(str(path)).grammar, rng=rng(), given={"levels": 4.0})
        assert solid_of(made).is_volume, path
        assert len(standing(made.volumes)) == 5


def test_the_grammar_of_the_docs_is_whole(tmp_path):
    text = (SAMPLES.parent.parent / "docs" / "derive.md").read_text()
    whole = tmp_path / "docs.yaml"
    whole.write_text(text.split("```yaml\n")[1].split("```")[0])
    made = derive(load(str(whole)).grammar, rng=rng())
    assert solid_of(made).is_volume


def test_every_shipped_grammar_is_tested():
    assert builtin_names() == ["haussmann", "ksttp09", "modern", "victorian"]


def test_the_papers_grammar_has_its_five_rules():
    loaded = load("ksttp09").grammar
    assert [rule.symbol for rule in loaded.rules] == ["axiom", "Vl", "Rf", "Fc", "Fl"]


def test_a_derivation_is_an_artifact_that_draws():
    made = derived(BOX)
    artifact = derivation_of(made, grammar(BOX), "b")
    scene = derivation_scene(artifact)
    mass = scene.meshes[0]
    assert trimesh.Trimesh(mass.vertices, mass.faces).volume == pytest.approx(144.0)
    assert {mesh.material for mesh in scene.meshes} == {"mass", "Wall", "Window"}


def test_problems_of_grammars_and_derivations(facade_here, tmp_path):
    sample = SAMPLES / "twisted-tower.yaml"
    assert facade_here("validate", sample).returncode == 0
    box = tmp_path / "box.yaml"
    box.write_text(f"schema: facade-tools/shape-grammar/1{BOX}")
    assert facade_here("view", box, "-o", tmp_path / "x.png", "--size", "80x60").returncode == 0
    (tmp_path / "bad.yaml").write_text(sample.read_text().replace("into: Entrance", "into: Hall"))
    found = facade_here("validate", tmp_path / "bad.yaml")
    assert found.returncode == 3
    assert b"'Hall' is neither a rule nor a terminal" in found.stdout
    artifact = derivation_of(derived(BOX), grammar(BOX), "b")
    assert list(derivation_problems(artifact)) == []
    open_ = replace(artifact, mass=replace(artifact.mass, faces=artifact.mass.faces[1:]))
    assert "not closed" in next(iter(derivation_problems(open_)))[1]
    assert next(iter(derivation_problems(replace(artifact, terminals={}))))[0] == "/terminals"


# --- refusals -------------------------------------------------------------------------------------
BAD = [
    ("{faces: {front: Front,", "{faces: {front: Nowhere,", "neither a rule nor a terminal", 7),
    ("{Wall: 2}", "{Wall: 12}", "the parts need", 8),
    ("{Wall: 2}", "{Wall: depth - 5}", "gets a size of -5 m", 8),
    ("{Wall: 2}", "{Wall: nothing}", "is no parameter", 8),
    (
        "[{Wall: 2}, {Window: 25%}, {Wall: ~1}, {Window: ~1}]", "[{Front: ~1}]",
        "does not end", 8,
    ),
    ("extrude: 3,", "extrude: 3, scale: {x: -1},", "size of -1 m", 6),
    ("split: x,", "split: x, repeat: x, each: 2,", "at once", 8),
    ("axiom: Lot", "axiom: Wall", "has no rule", 3),
    ("extrude: 3,", "extrude: .nan,", "nan is no finite number", 6),
    ("extrude: 3,", "extrude: 1e7,", "has a size of 1e+07 m", 6),
    ("extrude: 3,", "translate: {x: 1e15}, extrude: 3,", "lies 1e+15 m away", 6),
    ("{width: 8,", "{width: 1e9,", "expected at most 1e+06 m", 4),
    ("extrude: 3,", "extrude: 1e5,", "more than 1000 storeys of 3 m", 2),
    ("{label: window}", "{label: window, style: pig}", "'pig' is no style of a window", 9),
    (
        "faces: {front: Front, side: Wall, top: Wall}", "roof: gable, pitch: 89, into: {all: Wall}",
        "89 is no pitch from 0 to 88°", 7,
    ),
    (
        "faces: {front: Front, side: Wall, top: Wall}",
        "roof: mansard, rise: [2, -1], into: {all: Wall}", "-1 is no rise of at least 0 m", 7,
    ),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "message", "line"), BAD)
def test_refusals_name_the_rules_line(facade_here, tmp_path, old, new, message, line):
    path = tmp_path / "bad.yaml"
    assert old in BOX
    path.write_text(BOX.replace(old, new))
    done = facade_here("derive", path, "-o", tmp_path / "x.json")
    assert done.returncode == 3, done.stderr
    text = done.stderr.decode()
    assert message in text
    assert f"bad.yaml:{line}: /" in text, text
    assert not (tmp_path / "x.json").exists()


def test_towers_of_too_many_pieces_are_refused_before_they_are_made():
    towers = BOX.replace(
        "{symbol: Lot, do: [{extrude: 3, into: Body}]}",
        "{symbol: Lot, do: [{repeat: x, each: 0.8, into: Strip}]}\n"
        "  - {symbol: Strip, do: [{extrude: 2000 + index, into: Wall}]}",
    ).replace("width: 8", "width: 80")
    made = derived(towers)
    with pytest.raises(InvalidInput, match=r"100 boxes have some .* pieces of wall") as error:
        derived_building(made, "x", 3.0)
    assert error.value.place.pointer == "/storey_height"


def test_lines_of_pointers():
    text = b"a:\n  - x: 1\n  - {y: 2}\nb: 3\n"
    places = ("/a", "/a/0/x", "/a/1", "/b", "/a/7/z", "")
    assert [line_of(text, place) for place in places] == [1, 2, 3, 4, 1, 1]
