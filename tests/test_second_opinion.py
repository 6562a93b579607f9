"""A second reading of a photograph: it moves windows as far as the classifier doubts."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

from facade_tools.artifacts.parse import LABELS
from facade_tools.errors import Infeasible
from facade_tools.grammar.library import builtin
from facade_tools.grammar.reading import ReadOptions
from facade_tools.imaging.image_io import Photo
from facade_tools.imaging.rims import burnt_sky, rim
from facade_tools.reconstruction.mrf import mrf_method
from facade_tools.segmentation.classifier import default, save
from facade_tools.segmentation.painting import render_facade
from facade_tools.segmentation.parsing import forest_method
from facade_tools.segmentation.second_opinion import (
    FIRM,
    MILD,
    agreement,
    doubt,
    exposed,
    moved,
)

CLASSES = ("window", "wall", "sky")
WINDOW, WALL = LABELS.index("window"), LABELS.index("wall")


def beliefs(window, wall, sky, shape=(4, 6)):
    each = np.array([window, wall, sky], np.float32)
    return np.tile(each[:, None, None], (1, *shape))


def half(shape=(4, 6)):
    labels = np.full(shape, WALL, np.uint8)
    labels[:, : shape[1] // 2] = WINDOW
    return labels


def leaning(shape=(4, 6)):
    """Beliefs that lean towards windows where `half` has them."""
    out = beliefs(0.4, 0.4, 0.2, shape)
    out[0, :, : shape[1] // 2] += 0.02
    out[1, :, : shape[1] // 2] -= 0.02
    return out


def odds(belief):
    return np.log(belief[0] / belief[1])


def test_readings_agree_as_far_as_their_windows_do():
    other = np.where(half() == WINDOW, WALL, WINDOW).astype(np.uint8)
    assert agreement(leaning(), CLASSES, half()) == pytest.approx(1)
    assert agreement(leaning(), CLASSES, other) == pytest.approx(-1)
    assert agreement(leaning((8, 12)), CLASSES, half()) == pytest.approx(1)
    across = leaning()
    across[0, ::2] += 0.1
    assert 0.1 < agreement(across, CLASSES, half()) < 0.5
    assert agreement(leaning(), CLASSES, np.full((4, 6), WALL, np.uint8)) == 0
    assert agreement(leaning()[1:], CLASSES[1:], half()) == 0


def test_a_second_reading_moves_windows_and_walls():
    before = leaning()
    out = moved(before, CLASSES, half(), 1.0)
    shift = odds(out) - odds(before)
    gain, loss, walls = FIRM
    np.testing.assert_allclose(shift[:, :3], gain + walls, rtol=1e-4)
    np.testing.assert_allclose(shift[:, 3:], -loss - walls, rtol=1e-4)
    np.testing.assert_allclose(out.sum(axis=0), 1, rtol=1e-5)
    less = odds(moved(before, CLASSES, half(), 0.5)) - odds(before)
    np.testing.assert_allclose(less, shift / 2, rtol=1e-4)
    np.testing.assert_allclose(moved(before, CLASSES, half(), 0.0), before, rtol=1e-6)


def test_a_reading_whose_windows_are_elsewhere_moves_less():
    gain, loss, walls = MILD
    shift = odds(moved(leaning(), CLASSES, half()[:, ::-1], 1.0)) - odds(leaning())
    np.testing.assert_allclose(shift[:, 3:], gain + walls, rtol=1e-4)
    np.testing.assert_allclose(shift[:, :3], -loss - walls, rtol=1e-4)
    nothing = np.full((4, 6), WALL, np.uint8)
    shift = odds(moved(leaning(), CLASSES, nothing, 1.0)) - odds(leaning())
    np.testing.assert_allclose(shift, -loss - walls, rtol=1e-4)


def test_the_weight_grows_with_doubt():
    """Mean entropies of 0.15, 0.40, 0.44 and 1.05 nats."""
    weights = [doubt(beliefs(p, 0.99 - p, 0.01)) for p in (0.97, 0.885, 0.87, 0.5)]
    assert weights[0] == 0 < weights[1] < weights[2] < weights[3]
    assert doubt(beliefs(0.4, 0.4, 0.2)) == 1


def test_labels_of_another_size_and_a_missing_class():
    out = moved(leaning()[:2], ("window", "sky"), half((40, 60)), 1.0)
    assert (out[0, :, :3] > 0.5).all()
    assert (out[0, :, 3:] < 0.5).all()
    np.testing.assert_allclose(out.sum(axis=0), 1, rtol=1e-5)


def photo_of(seed):
    rng = np.random.default_rng(seed)
    _, pixels, labels = render_facade(builtin("haussmann"), 200, 280, rng=rng)
    return Photo("a.png", pixels, "0" * 64), labels


def test_without_a_solution_of_its_own_the_second_says_nothing():
    def none(photo, identity, *, rng, mask=None):
        raise Infeasible("nothing")

    photo, _ = photo_of(0)
    alone = forest_method(ReadOptions())(photo, "a", rng=np.random.default_rng(0))
    never = forest_method(ReadOptions(), second=lambda windows: none)
    beside = never(photo, "a", rng=np.random.default_rng(0))
    assert beside.parse.regions == alone.parse.regions
    assert (alone.parse.method, beside.parse.method) == ("forest", "both")


def test_the_classifiers_own_labels_stay_its_own():
    photo, _ = photo_of(1)
    alone, beside = (
        forest_method(ReadOptions(), second=second)(photo, "a", rng=np.random.default_rng(0))
        for second in (None, partial(mrf_method, ReadOptions()))
    )
    np.testing.assert_array_equal(alone.raw, beside.raw)


def test_the_second_is_told_the_belief_in_windows():
    told = []

    def listening(windows):
        told.append(windows)
        return mrf_method(ReadOptions(), windows)

    photo, labels = photo_of(4)
    forest_method(ReadOptions(), second=listening)(photo, "a", rng=np.random.default_rng(0))
    (windows,) = told
    assert windows.shape == labels.shape
    assert windows[labels == WINDOW].mean() > 0.5 > 0.2 > windows[labels == WALL].mean()


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    from test_pictures import png

    path = tmp_path_factory.mktemp("photo") / "a.png"
    path.write_bytes(png(photo_of(2)[0].pixels))
    return path


def test_the_default_depends_on_the_classifier(facade_here, picture, tmp_path):
    npz = tmp_path / "own.npz"
    npz.write_bytes(save(default()))
    methods = {
        "both": (),
        "forest": ("--classifier", npz),
        "mrf": ("--method", "mrf"),
    }
    for method, words in methods.items():
        done = facade_here("parse-image", picture, *words)
        assert done.returncode == 0, done.stderr
        parse = json.loads(done.stdout)
        assert parse["method"] == parse["provenance"]["options"]["method"] == method


def test_both_take_metres(facade_here, picture):
    done = facade_here("parse-image", picture, "--height", 18)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["tags"]["scale"] == "height"
    tags = json.loads(facade_here("parse-image", picture).stdout)["tags"]
    assert tags.keys() == {"structure", "agreement"}  # a scale that was guessed is not told
    assert tags["structure"] > 0.5
    assert -1 <= tags["agreement"] <= 1
    assert facade_here("parse-image", picture, "--method", "forest", "--height", 18).returncode == 2


# --- what shows no building -----------------------------------------------------------------------
def rectified_street():
    """A mid-grey picture: black to the right, burnt out on top and in a pane further down."""
    picture = np.full((60, 80, 3), (150, 120, 90), np.uint8)
    picture[:10] = 245
    picture[30:40, 20:30] = 245
    picture[:, 60:] = 0
    return picture


def test_burnt_sky_reaches_down_from_the_top():
    picture = rectified_street()
    outside = rim(picture)
    assert outside[:, 62:].all()
    assert not outside[:, :57].any()
    sky = burnt_sky(picture, outside)
    assert sky[:10, :57].all()
    assert not sky[10:].any()


def test_sky_below_what_lies_outside_is_sky():
    picture = rectified_street()
    picture[:5] = 128  # the rim's other colour
    assert burnt_sky(picture, rim(picture))[8:10, :50].all()


def test_nothing_stands_in_a_rim():
    picture = rectified_street()
    before = beliefs(0.5, 0.4, 0.1, picture.shape[:2])
    after = exposed(before, CLASSES, picture)
    np.testing.assert_allclose(after.sum(axis=0), 1, rtol=1e-5)
    assert (after[0, :, 62:] < 0.1 * after[1, :, 62:]).all()
    assert (after[2, :10, :57] > 0.9).all()
    np.testing.assert_allclose(after[:, 12:, :57], before[:, 12:, :57], rtol=1e-6)


def test_a_rim_gets_no_windows_and_a_classifier_asked_alone_is_not_told():
    photo, _ = photo_of(3)
    pixels = photo.pixels.copy()
    height, width = pixels.shape[:2]
    share = np.linspace(0.35, 0, height)[:, None]
    wedge = np.arange(width) / width > 1 - share
    pixels[wedge] = 0
    photo = Photo("a.png", pixels, "0" * 64)
    alone, beside = (
        forest_method(ReadOptions(), second=second)(photo, "a", rng=np.random.default_rng(0))
        for second in (None, partial(mrf_method, ReadOptions()))
    )
    assert (alone.parse.method, beside.parse.method) == ("forest", "both")
    inside = [(reading.labels[wedge] == WINDOW).mean() for reading in (alone, beside)]
    assert inside[1] < 0.03
    assert inside[1] <= inside[0]


def test_shade_at_the_border_is_no_rim():
    """What lies outside a photograph, a convex quadrilateral, holds a corner of the picture."""
    picture = rectified_street()
    picture[45:, 20:50] = 5  # the mouth of a shop
    outside = rim(picture)
    assert outside[:, 62:].all()
    assert not outside[:, :57].any()
