"""What stands once in its row: signs and odd sections are told, and not inserted twice."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from facade_tools.stylization.likeness import in_line, standing_once, standing_out
from facade_tools.stylization.splitting import SplitRule, split
from facade_tools.stylization.synthesis import positions, synthesised

ROW = SplitRule((1.0, 1.0, 1.0, 1.0), (2.0, 2.0, 2.0))  # 10 m, at 20 pixels a metre


def wall(width=10.0):
    return np.full((60, round(20 * width), 3), 160, np.uint8)


def window(picture, place, width=2.0):
    a, b = round(20 * place), round(20 * (place + width))
    picture[15:45, a:b] = 250
    picture[18:42, a + 4 : b - 4] = (40, 60, 90)
    return picture


def door(picture, place):
    a = round(20 * place)
    picture[5:60, a + 8 : a + 18] = (120, 20, 20)
    picture[5:60, a + 25 : a + 30] = (240, 220, 60)
    return picture


def sign(width=10.0, text="Fish & Chips", size=1.0, x=50):
    board = np.full((60, round(20 * width), 3), (20, 70, 40), np.uint8)
    board[:4] = board[-4:] = 240
    cv2.putText(board, text, (x, 38), cv2.FONT_HERSHEY_SIMPLEX, size, (255, 255, 255), 2)
    return board


def test_like_windows_are_all_repeated():
    row = window(window(window(wall(), 1), 4), 7)
    assert standing_once(ROW, row).once == ()


def test_windows_in_changing_light_are_alike():
    row = window(window(window(wall(), 1), 4), 7).astype(np.float64)
    row *= np.linspace(0.6, 1.0, row.shape[1])[None, :, None]
    row += np.random.default_rng(1).normal(0, 6, row.shape)
    assert standing_once(ROW, np.clip(row, 0, 255).astype(np.uint8)).once == ()


@pytest.mark.parametrize("odd", [0, 1, 2])
def test_a_door_among_windows_stands_once(odd):
    row = wall()
    for k in range(3):
        (door if k == odd else window)(row, 1 + 3 * k)
    assert standing_once(ROW, row).once == (odd,)


def test_letters_become_one_section_that_stands_once():
    rule = SplitRule((2.4, 0.3, 3.2), (1.9, 2.2))
    found = standing_once(rule, sign(text="Law Office"))
    assert found.once == (0,)
    assert found.insertable == pytest.approx((4.4,))
    assert found.size == pytest.approx(rule.size)


def test_a_window_is_like_its_mirror_image_and_a_word_is_not():
    rule = SplitRule((2.0, 2.0), (6.0,))
    assert standing_out(rule, sign()) == {0}
    assert standing_out(rule, window(wall(), 2, 6.0)) == set()


def test_a_common_rule_knows_what_is_odd_in_one_row():
    plain = window(window(window(wall(), 1), 4), 7)
    odd = door(window(window(wall(), 1), 7), 4)
    assert in_line(ROW, [plain, odd]).once == (1,)
    assert in_line(ROW, [plain, plain]).once == ()


@pytest.mark.parametrize("size", [10.5, 12.0, 13.0, 15.0, 20.0, 37.0])
def test_what_stands_once_is_inserted_once_and_keeps_its_place(size):
    for odd in range(3):
        done = split(replace(ROW, once=(odd,)), size)
        assert done.sources.count(2 * odd + 1) == 1
        assert sum(done.sizes) == pytest.approx(size)
        assert done.windows >= 3
        assert abs(done.windows - split(ROW, size).windows) <= 1
        centre = sum(done.sizes[: done.sources.index(2 * odd + 1)]) + 1.0
        assert abs(centre / size - (2 + 3 * odd) / 10) < 0.2
        for source, width in zip(done.sources, done.sizes, strict=True):
            assert source % 2 == 0 or width == pytest.approx(2.0)


def test_a_rule_of_its_own_size_stays():
    done = split(replace(ROW, once=(1,)), ROW.size)
    assert done.sources == (0, 1, 2, 3, 4, 5, 6)
    assert done.sizes == pytest.approx((1, 2, 1, 2, 1, 2, 1))


def test_a_lone_sign_is_not_repeated_however_wide_its_board():
    rule = SplitRule((2.0, 2.0), (2.0,), (0,))
    for size in (6.0, 9.0, 18.0, 60.0):
        done = split(rule, size)
        assert done.windows == 1
        assert done.sizes[1] == pytest.approx(2.0)


def test_frames_of_a_single_ornament_are_not_inserted():
    rule = SplitRule((0.1, 0.3, 0.3, 0.1), (0.2, 1.3, 0.2), (1,))
    assert split(rule, 5.0).windows == 3


def test_lettering_is_read_once_on_a_wider_board():
    rule = standing_once(SplitRule((2.3, 3.0), (4.7,)), sign())
    assert rule.once == (0,)
    places = positions(rule, 10.0, 17.0, 680)
    inside = (places > 0.25) & (places < 0.68)  # the middle of the word
    runs = np.flatnonzero(np.diff(inside.astype(int)) == 1)
    assert len(runs) == 1
    assert np.ptp(np.flatnonzero(inside)) == pytest.approx(0.43 * 10.0 * 40, abs=12)


def test_layers_are_stretched_and_plain_walls_go_on():
    layers = wall()
    layers[:20] = (180, 40, 40)  # an awning above
    plain = (SplitRule((10.0,)), SplitRule((3.0,)))
    high = synthesised(layers, plain, (10.0, 3.0), (10.0, 5.0), 20)
    assert (high[-10:] == 160).all()  # no second awning at the foot
    bricks = wall()
    bricks[::4] = 140
    same = synthesised(bricks, plain, (10.0, 3.0), (10.0, 5.0), 20)
    assert (same[:60:4, 0] == 140).all()
