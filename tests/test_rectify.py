from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.errors import InvalidInput
from facade_tools.grammar.library import builtin
from facade_tools.imaging.homography import applied, fitted_homography, warped
from facade_tools.imaging.image_io import decoded
from facade_tools.imaging.rectify import automatic, from_corners, from_report, view_of
from facade_tools.segmentation.painting import render_facade

PHOTOS = Path(__file__).parent.parent / "sample_data" / "photos"
WIDTH, HEIGHT = 330, 440
CORNERS = np.array([[0, 0], [WIDTH, 0], [WIDTH, HEIGHT], [0, HEIGHT]], np.float64)


@pytest.fixture(scope="module")
def front():
    return render_facade(builtin("haussmann"), WIDTH, HEIGHT, rng=np.random.default_rng(3))[1]


def photographed(turn, focal=700.0, size=(640, 700)):
    """The facade's corners in a synthetic camera's picture, and the homography to it."""
    rotation = cv2.Rodrigues(np.array(turn, np.float64))[0]
    camera = np.array([[focal, 0, size[0] / 2], [0, focal, size[1] / 2], [0, 0, 1.0]])
    plane = np.column_stack([CORNERS - [WIDTH / 2, HEIGHT / 2], np.zeros(4)])
    seen = (plane @ rotation.T + [0, 0, 1.05 * focal]) @ camera.T
    corners = seen[:, :2] / seen[:, 2:]
    return corners, fitted_homography(CORNERS, corners)


@given(st.lists(st.floats(-0.15, 0.15), min_size=8, max_size=8))
@settings(max_examples=60, deadline=None)
def test_homographies_are_recovered(offsets):
    source = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.3, 0.6]]) * 100
    wanted = np.eye(3) + np.array([*offsets, 0.0]).reshape(3, 3) * [
        [1, 1, 50], [1, 1, 50], [1e-2, 1e-2, 0],
    ]  # fmt: skip
    found = fitted_homography(source, applied(wanted, source))
    np.testing.assert_allclose(found, wanted / wanted[2, 2], atol=1e-6)


def test_points_on_a_line_fix_no_homography():
    line = np.array([[0, 0], [1, 1], [2, 2], [3, 0]], np.float64)
    with pytest.raises(InvalidInput):
        fitted_homography(line, CORNERS)


def test_warping_moves_pixels_by_their_corners():
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[2:4, 2:4] = 255
    double = warped(picture, np.diag([2.0, 2.0, 1.0]), (16, 16))
    assert (double[5:7, 5:7] == 255).all()
    assert double[:3].max() == 0
    np.testing.assert_array_equal(warped(picture, np.eye(3), (8, 8)), picture)


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.1, 0.4, 0.0), (-0.2, -0.3, 0.05), (0.3, 0, 0)])
def test_corners_give_back_the_true_proportions(turn):
    corners, _ = photographed(turn)
    found = from_corners((700, 640, 3), corners)
    assert found.size[0] / found.size[1] == pytest.approx(WIDTH / HEIGHT, rel=0.05)
    target = applied(found.homography, corners)
    width, height = found.size
    expected = [[0, 0], [width, 0], [width, height], [0, height]]
    np.testing.assert_allclose(target, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("turn", "guessed"),
    [((0, 0, 0), False), ((0, 0.4, 0), True), ((0.3, 0, 0), True), ((0.1, 0.4, 0.0), False)],
)
def test_proportions_that_hang_on_the_focal_length_are_called_a_guess(turn, guessed):
    assert from_corners((700, 640, 3), photographed(turn)[0]).guessed is guessed


@pytest.mark.parametrize("turn", [(0.12, 0.35, 0.03), (-0.15, -0.25, -0.04), (0.2, 0.2, 0)])
def test_lines_alone_make_a_facade_straight(front, turn):
    corners, homography = photographed(turn)
    photo = warped(front, homography, (640, 700))
    found = automatic(photo)
    assert found.confidence > 0.5
    straight = applied(found.homography, corners)
    sides = np.roll(straight, -1, axis=0) - straight
    angles = np.degrees(np.arctan2(sides[:, 1], sides[:, 0]))
    np.testing.assert_allclose(angles % 90 - 90 * (angles % 90 > 45), 0, atol=1.0)
    ratio = np.linalg.norm(sides[0]) / np.linalg.norm(sides[1])
    assert ratio == pytest.approx(WIDTH / HEIGHT, rel=0.06)
    assert found.picture(photo).shape[:2] == found.size[::-1]


@pytest.mark.parametrize("kind", ["flat", "noise", "dot", "circles"])
def test_pictures_without_structure_are_refused(kind):
    rng = np.random.default_rng(0)
    picture = np.full((300, 300, 3), 128, np.uint8)
    if kind == "noise":
        picture = rng.integers(0, 255, picture.shape).astype(np.uint8)
    if kind == "dot":
        picture = picture[:1, :1]
    if kind == "circles":
        for x, y, r in rng.integers(20, 250, (30, 3)):
            cv2.circle(picture, (int(x), int(y)), int(r // 4), (0, 0, 0), 2)
    with pytest.raises(InvalidInput, match="corners"):
        automatic(picture)


@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0], [10, 10], [10, 0], [0, 10]],
        [[0, 0], [5, 0], [10, 0], [0, 10]],
        [[0, 0], [0, 10], [10, 10], [10, 0]],
        [[11, 0], [10, 10], [0, 10], [0, 0]],
        [[10, 11], [0, 10], [0, 0], [10, 0]],
        [[0, 10], [0, 0], [9, 0], [10, 11]],
        [[0, 0], [np.nan, 0], [10, 10], [0, 10]],
        [[30, 0], [40, 0], [40, 10], [30, 10]],
        [[45, -35], [75, -5], [55, 15], [25, -15]],
    ],
)
def test_corners_that_are_no_quadrilateral_are_refused(corners):
    with pytest.raises(InvalidInput):
        from_corners((20, 20, 3), np.array(corners, np.float64))


def test_reports_of_numbers_without_bounds_are_refused():
    for entry in (1e308, np.inf, np.nan):
        with pytest.raises(ValueError, match="no homography"):
            from_report([[entry, 0, 0], [0, entry, 0], [0, 0, 1]], [40, 30], 1.0)
    assert from_report(np.eye(3).tolist(), [40, 30], 1.0).size == (40, 30)


def test_the_command(facade, front, tmp_path):
    corners, homography = photographed((0.1, 0.3, 0.0))
    photo = tmp_path / "photo.png"
    cv2.imwrite(str(photo), warped(front, homography, (640, 700))[:, :, ::-1])
    text = " ".join(f"{x:.3f},{y:.3f}" for x, y in corners)
    out, report = tmp_path / "front.png", tmp_path / "report.json"
    done = facade("rectify", photo, "--corners", text, "-o", out, "--report", report)
    assert done.returncode == 0, done.stderr
    told = json.loads(report.read_text())
    picture = decoded(out.read_bytes(), "front")
    assert list(picture.shape[1::-1]) == told["size"]
    assert told["guessed"] is False
    assert b"guess" not in done.stderr
    near = cv2.resize(front, told["size"]).astype(float) - picture
    assert np.abs(near).mean() < 12
    level = "90,40 400,110 400,560 90,630"
    done = facade("rectify", photo, "--corners", level, "-o", out)
    assert done.returncode == 0
    assert b"width to height is a guess" in done.stderr
    assert facade("rectify", photo, "--corners", "1,2 3,4", "-o", out).returncode == 2
    before = photo.read_bytes()
    for words in (("-o", photo), ("-o", tmp_path / "a.png", "--report", photo)):
        over = facade("rectify", photo, "--corners", text, *words)
        assert over.returncode == 2
        assert b"is an input and would be overwritten" in over.stderr
        assert photo.read_bytes() == before
    assert facade("rectify", tmp_path / "none.png", "-o", out).returncode == 3


@pytest.mark.parametrize("turn", [(0, 0.27, 0), (0, -0.45, 0), (0.3, 0, 0), (0.17, 0.26, 0)])
def test_photographs_taken_at_an_angle_are_told(front, turn):
    _, homography = photographed(turn)
    angle = view_of(warped(front, homography, (640, 700))).angle
    assert angle == pytest.approx(np.degrees(np.linalg.norm(turn)), abs=6)


@pytest.mark.parametrize("turn", [(0, 0, 0), (0, 0.05, 0), (0, 0, 0.05)])
def test_photographs_taken_from_the_front_are_not(front, turn):
    assert view_of(front).angle is None
    _, homography = photographed(turn)
    assert view_of(warped(front, homography, (640, 700))).angle is None


@pytest.mark.parametrize("shape", [(4, 4, 3), (200, 300, 3)])
def test_a_picture_without_lines_looks_straight(shape):
    assert view_of(np.full(shape, 90, np.uint8)).angle is None
    noise = np.random.default_rng(1).integers(0, 255, shape, np.uint8)
    assert view_of(noise).angle is None


def test_the_structure_of_facades_and_of_what_is_none(front):
    """Facades have lines in two directions, whatever their light; noise and clouds have not."""
    noise = np.random.default_rng(1).integers(0, 256, (300, 260, 3)).astype(np.uint8)
    clouds = cv2.GaussianBlur(noise.astype(np.float32), (0, 0), 6.0)
    clouds = np.clip((clouds - clouds.mean()) * 12 + 128, 0, 255).astype(np.uint8)
    told = view_of(front).structure
    assert told > 0.6
    assert view_of((front * 0.15).astype(np.uint8)).structure == pytest.approx(told, abs=0.1)
    for picture in (noise, clouds, np.full_like(noise, 140), np.zeros_like(noise)):
        assert view_of(picture).structure < 0.2
    assert view_of(front[:150, :150]).structure is None
    assert view_of(np.tile(front[:200], (1, 30, 1))).structure is None  # 1,000 pixels of 101 rows


def test_parse_image_refuses_what_is_no_facade_but_not_a_blurred_one(facade, tmp_path):
    """Two readings agree about the windows of a facade without lines, of clouds they do not."""
    sharp = cv2.imread(str(PHOTOS / "facade-3.jpg"))
    rng = np.random.default_rng(0)
    clouds = cv2.GaussianBlur(rng.normal(0, 1, (500, 400, 3)), (0, 0), 12)
    clouds = 255 * (clouds - clouds.min()) / np.ptp(clouds)
    blurred = cv2.GaussianBlur(sharp, (0, 0), sharp.shape[0] / 150)
    flat = np.full((500, 400, 3), 90, np.uint8)
    for name, picture in (("a", flat), ("b", clouds.astype(np.uint8)), ("c", blurred)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), picture)
    out = tmp_path / "out.jsonl"
    done = facade("parse-image", tmp_path, "--method", "both", "-o", out, "--on-error", "skip")
    assert done.returncode == 3
    lines = done.stderr.decode().splitlines()
    for name in "ab":
        assert [line for line in lines if f"{name}.png: shows no facade (structure" in line]
    assert [line for line in lines if "hardly looks like a facade" in line and "c.png" in line]
    (parse,) = [json.loads(line) for line in out.read_text().splitlines()]
    assert parse["id"] == "c"
    assert parse["tags"]["structure"] < 0.2
    assert parse["tags"]["agreement"] > 0.4


def test_one_reading_only_warns_of_what_hardly_looks_like_a_facade(facade, front, tmp_path):
    """The second picture shows a facade behind wires in all directions."""
    rng = np.random.default_rng(0)
    wires = front.copy()
    for _ in range(60):
        ends = rng.integers(0, (WIDTH, HEIGHT), (2, 2))
        cv2.line(wires, *map(tuple, ends.tolist()), tuple(rng.integers(0, 255, 3).tolist()), 2)
    for name, picture in (("a", front), ("b", wires)):
        cv2.imwrite(str(tmp_path / f"{name}.png"), picture[:, :, ::-1])
    out = tmp_path / "out.jsonl"
    done = facade("parse-image", tmp_path, "--method", "mrf", "-o", out)
    assert done.returncode == 0
    lines = done.stderr.decode().splitlines()
    (told,) = [line for line in lines if "hardly looks like a facade" in line]
    assert "b.png" in told
    parses = [json.loads(line) for line in out.read_text().splitlines()]
    structures = [parse["tags"]["structure"] for parse in parses]
    assert structures[0] > 0.6
    assert structures[1] < 0.35


def test_parse_image_says_what_was_taken_at_an_angle(facade, tmp_path):
    photo = PHOTOS / "at-an-angle.jpg"
    done = facade("parse-image", photo, PHOTOS / "facade-1.jpg", "-o", tmp_path / "a.jsonl")
    told = [line for line in done.stderr.decode().splitlines() if "angle of" in line]
    assert done.returncode == 0
    assert len(told) == 1
    assert told[0].endswith(
        "at-an-angle.jpg: looks taken at an angle of 34 degrees: --rectify auto"
    )
    straight = facade("parse-image", photo, "--rectify", "auto", "-o", tmp_path / "b.json")
    assert b"looks taken" not in straight.stderr
