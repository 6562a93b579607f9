"""The command parse-image: streams of pictures, what they write, what is refused first."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from test_pictures import gradient, png

from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.parse import LABELS
from facade_tools.grammar.library import builtin
from facade_tools.segmentation.classifier import default, save
from facade_tools.segmentation.painting import render_facade

CLASSES = LABELS[1:]


def rendered_picture(width, height):
    rng = np.random.default_rng(0)
    return render_facade(builtin("haussmann"), width, height, rng=rng)[1]


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    rng = np.random.default_rng(0)
    (folder / "noise.png").write_bytes(png(rng.integers(0, 255, (120, 90, 3)).astype(np.uint8)))
    (folder / "flat.png").write_bytes(png(np.full((80, 60, 3), 99, np.uint8)))
    return folder


def test_parse_image_is_the_same_for_any_number_of_jobs(facade, photos, tmp_path):
    one = facade("parse-image", photos, "--labels", tmp_path / "labels")
    two = facade("parse-image", photos, "--jobs", 2)
    assert one.returncode == two.returncode == 0, one.stderr
    assert one.stdout == two.stdout
    lines = [json.loads(line) for line in one.stdout.splitlines()]
    assert [line["id"] for line in lines] == ["flat", "noise"]
    for line in lines:
        parse = decode(line, "parse")
        assert encode(parse)["regions"]
        labels = cv2.imread(str(tmp_path / "labels" / f"{parse.id}.png"), cv2.IMREAD_UNCHANGED)
        expected = np.zeros(labels.shape, np.uint8)
        for r in parse.regions:
            expected[r.y0 : r.y1, r.x0 : r.x1] = LABELS.index(r.label)
        np.testing.assert_array_equal(labels, expected)


def test_a_bad_picture_stops_or_is_skipped(facade, photos, tmp_path):
    bad = tmp_path / "bad.png"
    bad.write_bytes(b"not a picture")
    stopped = facade("parse-image", bad, "-o", tmp_path / "out.json")
    assert stopped.returncode == 3
    assert not (tmp_path / "out.json").exists()
    assert len(stopped.stderr.splitlines()) == 1
    skipped = facade("parse-image", bad, photos / "flat.png", "--on-error", "skip")
    assert skipped.returncode == 3
    assert len(skipped.stdout.splitlines()) == 1
    tiny = tmp_path / "tiny.png"
    tiny.write_bytes(png(np.zeros((1, 1, 3), np.uint8)))
    one = facade("parse-image", tiny)
    assert one.returncode == 0
    assert len(json.loads(one.stdout)["regions"]) == 1
    assert facade("parse-image", tiny, "--grammar", "tskp10").returncode == 4


def test_a_rectified_photograph_keeps_its_name_and_homography(facade_here, tmp_path):
    photo, straight, report = (tmp_path / name for name in ("a.png", "b.png", "report.json"))
    corners = "8,12 100,4 96,140 12,128"
    photo.write_bytes(png(rendered_picture(112, 144)))
    facade_here("rectify", photo, "--corners", corners, "-o", straight, "--report", report)
    by_hand = json.loads(facade_here("parse-image", straight).stdout)
    for asked in (corners, report):
        done = facade_here("parse-image", photo, "--rectify", asked)
        assert done.returncode == 0, done.stderr
        parse = json.loads(done.stdout)
        assert parse["image"]["name"] == "a.png"
        assert parse["image"]["size"] == by_hand["image"]["size"]
        assert parse["regions"] == by_hand["regions"]
        wanted = json.loads(report.read_text())["homography"]
        np.testing.assert_allclose(parse["rectification"], wanted)
    other = facade_here("parse-image", straight, "--rectify", report)
    assert other.returncode == 3
    assert b"another picture" in other.stderr


@pytest.mark.parametrize("method", ["forest", "mrf"])
def test_a_mask_of_another_size_is_refused(method, facade_here, photos, tmp_path):
    mask = tmp_path / "mask.png"
    mask.write_bytes(png(np.zeros((10, 12), np.uint8)))
    for more in ((), ("--rectify", "1,1 88,1 88,118 1,118")):
        words = ("parse-image", photos / "noise.png", "--method", method, "--mask", mask, *more)
        done = facade_here(*words)
        assert (done.returncode, done.stdout) == (3, b"")
        message = "noise.png: the mask has 12×10 pixels, the picture 90×120; expected the same"
        assert message.encode() in done.stderr


@pytest.mark.parametrize("option", ["--labels", "--raw-labels", "--overlay", "-o"])
def test_pictures_of_one_name_do_not_overwrite_each_other(option, facade_here, photos, tmp_path):
    other = tmp_path / "flat.bmp"
    other.write_bytes(cv2.imencode(".bmp", gradient())[1].tobytes())
    done = facade_here("parse-image", photos / "flat.png", other, option, tmp_path / "out/")
    assert (done.returncode, done.stdout) == (3, b"")
    assert b"id 'flat' stands twice" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("words", [
    ("flat.png", "--overlay", "flat.png"), ("flat.png", "-o", "flat.png"),
    ("flat.png", "noise.png", "--labels", "."), (".", "--raw-labels", "../photos/"),
    ("flat.png", "--mask", "mask.png", "--labels", "mask.png"),
    ("flat.png", "--labels", "x.png", "--overlay", "./x.png"),
])  # fmt: skip
def test_no_result_overwrites_an_input_or_another_result(words, facade_here, photos, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for path in photos.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    (folder / "mask.png").write_bytes(png(np.zeros((80, 60), np.uint8)))
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    done = facade_here("parse-image", *words, cwd=folder)
    assert (done.returncode, done.stdout) == (2, b"")
    assert b"would be" in done.stderr
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("words", [
    ("flat.png", "--rectify", "1,2"), ("flat.png", "--rectify", "Auto"),
    ("flat.png", "noise.png", "-o", "two.json"),
])  # fmt: skip
def test_mistakes_of_usage_come_before_any_picture(words, facade_here, photos):
    done = facade_here("parse-image", *words, cwd=photos)
    assert (done.returncode, done.stdout) == (2, b"")
    assert not (photos / "two.json").exists()


def test_a_classifier_that_does_not_fit_is_refused_once(facade_here, photos, tmp_path):
    few, other = tmp_path / "few.npz", tmp_path / "other.npz"
    shipped = default()
    stage = shipped.stages[0]
    kept = replace(stage, value=stage.value[:, :1], classes=5)
    alone = replace(shipped, classes=CLASSES[:5], stages=(kept,), fine=1, network=None)
    few.write_bytes(save(alone))
    far = replace(kept, feature=np.full_like(kept.feature, 30_000))
    other.write_bytes(save(replace(alone, stages=(far,))))
    words = ("parse-image", photos, "--on-error", "skip", "--classifier")
    done = facade_here(*words, few)
    assert (done.returncode, done.stdout) == (3, b"")
    lines = done.stderr.decode().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith(f"facade parse-image: error: {few}: the classifier knows")
    assert lines[0].endswith("needs shop, sky, chimney too; --grammar plain fits")
    assert facade_here(*words, few, "--grammar", "plain").returncode == 0
    done = facade_here(*words, other, "--grammar", "plain")
    message = f"facade parse-image: error: {other}: the classifier was trained on other features"
    assert done.stderr.decode().splitlines() == [f"{message} than these"]


def test_a_label_that_no_classifier_knows_is_the_grammars_fault(facade_here, photos, tmp_path):
    path = tmp_path / "own.yaml"
    path.write_text(
        "schema: facade-tools/grammar/1\nid: own\naxiom: A\nterminals: {a: wall, b: stairs}\n"
        "rules: {A: {split: up, into: a b}}\n"
    )
    done = facade_here("parse-image", photos, "--on-error", "skip", "--grammar", path)
    assert done.returncode == 3
    assert done.stderr.decode().count("\n") == 1
    assert f"{path}: the classifier knows".encode() in done.stderr
    assert b"grammar 'own' needs stairs too" in done.stderr
