"""Rules made regular, put in line above one another, and pictures of what is no upright wall."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facade_tools.artifacts.stylesheet import StyleFloor
from facade_tools.formats.mesh_reader import read_textured
from facade_tools.formats.textured import GREY, Paint, TexturedMesh
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.columns import aligned_rules, common_rule
from facade_tools.stylization.groups import splitting_rule
from facade_tools.stylization.outline import WallFace
from facade_tools.stylization.projection import face_pictures
from facade_tools.stylization.relief import relief_bays
from facade_tools.stylization.rhythm import regular_labels
from facade_tools.stylization.splitting import SplitRule
from facade_tools.stylization.synthesis import resized_rule

SAMPLES = Path(__file__).parent.parent / "sample_data" / "textured"


def test_windows_over_shops_get_one_rule():
    shops = SplitRule((0.3, 0.6, 0.6, 0.3), (3.4, 3.4, 3.4))
    windows = SplitRule((0.7, 0.8, 1.2, 0.8, 1.2, 0.8, 0.7), (1.0,) * 6)
    windows = resized_rule(windows, shops.size)
    common = common_rule(shops, windows)
    assert len(common.insertable) == 3
    assert common.size == pytest.approx(shops.size)
    assert common_rule(windows, shops).scalable == pytest.approx(common.scalable)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (SplitRule((1, 1, 1), (4, 4)), SplitRule((5, 5), (1,))),  # a door between two shops
        (SplitRule((0.1, 0.1), (9.8,)), SplitRule((1,) * 5, (1.25,) * 4)),  # one shop of glass
        (SplitRule((0.5,) * 4, (2,) * 3), SplitRule((0.5,) * 8, (0.5,) * 7)),  # seven over three
    ],
)
def test_windows_out_of_line_keep_their_own_rules(a, b):
    assert common_rule(a, b) is None


def test_groups_in_line_share_a_rule_and_others_do_not():
    mesh = read_textured(SAMPLES / "corner-house" / "model.obj")
    style = capture_style(mesh, "corner-house")
    rules = {rule.id: SplitRule(rule.a, rule.b) for rule in style.sheet.rules}
    known = {group.id: rules[group.rule] for group in style.sheet.groups}
    found = aligned_rules(style.sheet, style.blocks, style.pictures)
    assert set(found) == set(known)
    front = {f.vertical for w in style.sheet.walls if w.side == "front" for f in w.faces}
    assert len({found[group] for group in front}) < len({known[group] for group in front})


def test_an_odd_bay_is_cut_like_the_others():
    one = np.array([0] * 2 + [1] * 16 + [0] * 2, dtype=bool)
    labels = np.tile(one, 8)
    labels[60:80] = np.array([0] * 8 + [1] * 4 + [0] * 8)  # a shop of which only the door was found
    assert np.array_equal(regular_labels(labels, 20.0), np.tile(one, 8))
    assert np.array_equal(regular_labels(labels, 20.4), np.tile(one, 8))
    assert np.array_equal(regular_labels(labels, 31.0), labels)  # nothing repeats at that
    assert not regular_labels(np.zeros(50, dtype=bool), 10.0).any()


def test_a_face_without_any_wall_has_no_windows():
    picture = np.full((40, 60, 3), 200, dtype=np.uint8)
    picture[:, ::6] = 30
    picture[10:30] = 255 - picture[10:30]
    rule = splitting_rule([picture], 1.0, 0)
    assert rule.insertable == () or sum(rule.scalable) > 0


def test_a_slope_that_becomes_a_step_keeps_its_texture():
    points = np.array([[0, 0, 0], [9, 0, 0], [9, 6, 1.5], [0, 6, 1.5]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=float)
    green = np.full((8, 8, 3), (40, 120, 80), dtype=np.uint8)
    slope = TexturedMesh(points, faces, uv, np.zeros(2, np.int64), (Paint("tin", GREY, green),))
    step = WallFace("front", 0, 3.0, 0.0, 9.0, 0.0, 1.5)
    (picture,) = face_pictures(slope, [step], 8.0)
    assert picture.shape == (12, 72, 3)
    assert (picture == (40, 120, 80)).all()


def test_relief_at_a_corner_is_no_bay():
    cut = StyleFloor("b", 0.0, 9.0, (0.0, 3.0, 10.0), (0.0, 1.0, 6.0), ("01", "11"))
    niche = StyleFloor("b", 0.0, 9.0, (0.0, 4.0, 6.0, 10.0), (0.0, 1.0, 6.0), ("101", "111"))
    assert relief_bays([cut], 0, 10.0) is None
    assert relief_bays([niche], 0, 10.0).rule.insertable == pytest.approx((2.0,), abs=0.05)
