from __future__ import annotations

import json
from contextlib import suppress

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.parse import LABELS
from facade_tools.errors import Infeasible
from facade_tools.imaging.image_io import Photo
from facade_tools.reconstruction.dormers import with_dormers
from facade_tools.reconstruction.evidence import (
    agreement,
    profiles,
    repeated_columns,
    window_evidence,
    with_belief,
)
from facade_tools.reconstruction.lines import differences, earth_movers, segments
from facade_tools.reconstruction.mrf import Scale, read_facade
from facade_tools.reconstruction.periods import period, storey_period, whole_period
from facade_tools.reconstruction.shops import with_shop
from facade_tools.reconstruction.storeys import Band, Facade, _kept, skyline

WALL, GLASS, SKY, SHOP = (206, 190, 160), (50, 60, 74), (180, 205, 240), (90, 40, 36)
FLOOR, STRIPE = 60, 70  # pixels


def drawn(
    rows: int, columns: int, seed: int = 0, sky: int = 40, glass: tuple[int, ...] = GLASS
) -> np.ndarray:
    """A wall of windows over a shop, under the sky; 20 pixels a metre."""
    height, width = sky + rows * FLOOR + 80, columns * STRIPE + 30
    picture = np.empty((height, width, 3), np.float64)
    picture[:] = WALL
    picture[:sky] = SKY
    picture[-70:] = SHOP
    for row in range(rows):
        for column in range(columns):
            y, x = sky + row * FLOOR + 14, 30 + column * STRIPE
            picture[y : y + 36, x : x + 26] = glass
    picture += np.random.default_rng(seed).normal(0, 6, picture.shape)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.8), 0, 255).astype(np.uint8)


def photo_of(pixels: np.ndarray) -> Photo:
    return Photo("facade.png", pixels, "0" * 64)


def read(pixels: np.ndarray, scale: Scale | None = None, **options):
    rng = np.random.default_rng(0)
    return read_facade(scale or Scale(), photo_of(pixels), "facade", rng=rng, **options)


def windows_of(parse) -> np.ndarray:
    return np.array([(r.x0, r.y0, r.x1, r.y1) for r in parse.regions if r.label == "window"])


def assert_tiles(parse) -> None:
    """Every pixel lies in exactly one region."""
    width, height = parse.image.size
    count = np.zeros((height, width), int)
    for region in parse.regions:
        count[region.y0 : region.y1, region.x0 : region.x1] += 1
    assert (count == 1).all()


@pytest.mark.parametrize(("rows", "columns"), [(3, 4), (5, 3), (6, 6), (4, 9)])
def test_a_clean_grid_is_found_window_by_window(rows, columns):
    parse = read(drawn(rows, columns)).parse
    assert_tiles(parse)
    found = windows_of(parse)
    assert len(found) == rows * columns
    for row in range(rows):
        for column in range(columns):
            y, x = 40 + row * FLOOR + 14, 30 + column * STRIPE
            off = np.abs(found - [x, y, x + 26, y + 36]).max(axis=1)
            assert off.min() <= 8


def test_the_same_picture_gives_the_same_parse_and_a_valid_artifact():
    one, two = (read(drawn(4, 4)).parse for _ in range(2))
    assert one == two
    assert one.optimal
    assert one.bound == one.energy
    assert one.method == "mrf"
    assert decode(encode(one), "parse").regions == one.regions


def test_labels_are_the_regions_painted():
    reading = read(drawn(4, 4))
    for region in reading.parse.regions:
        part = reading.labels[region.y0 : region.y1, region.x0 : region.x1]
        assert (part == LABELS.index(region.label)).all()
    assert reading.raw.shape == reading.labels.shape


def test_sky_and_shop_are_no_wall():
    parse = read(drawn(5, 4)).parse
    sky = [r for r in parse.regions if r.label == "sky"]
    assert len(sky) == 1
    assert abs(sky[0].y1 - 40) <= 4
    ground = parse.floors[0]
    assert ground.y1 == parse.image.size[1]
    assert len(ground.columns) == 2


def test_metres_come_from_a_height_or_a_storey():
    pixels = drawn(5, 4)
    assert read(pixels).parse.tags["scale"] == "relative"
    storey = read(pixels, Scale(storey=4.2)).parse
    assert storey.tags["scale"] == "storey-height"
    assert storey.tags["metres_per_pixel"] == pytest.approx(4.2 / FLOOR, rel=0.03)
    tall = read(pixels, Scale(height=17.0)).parse
    assert tall.tags["metres_per_pixel"] == pytest.approx(17.0 / (len(pixels) - 40), rel=0.03)
    assert len(windows_of(tall)) == 20


def test_what_is_hidden_says_nothing():
    pixels = drawn(5, 4)
    spoilt = pixels.copy()
    mask = np.zeros(pixels.shape[:2], bool)
    mask[150:260, 40:160] = True
    spoilt[mask] = np.random.default_rng(1).integers(0, 255, (int(mask.sum()), 3))
    assert len(windows_of(read(spoilt, mask=mask).parse)) == 20


@pytest.mark.parametrize("pixels", [
    np.full((300, 200, 3), 128, np.uint8), np.zeros((90, 900, 3), np.uint8),
    np.random.default_rng(0).integers(0, 255, (400, 300, 3)).astype(np.uint8),
])  # fmt: skip
def test_a_picture_of_nothing_is_read_without_harm(pixels):
    assert_tiles(read(pixels).parse)


@pytest.mark.parametrize("line", [slice(0, 0), slice(150, 151)])
def test_hardly_any_evidence_is_no_endless_evidence(line):
    pixels = np.full((400, 300, 3), 200, np.uint8)
    pixels[:, line] = 90
    assert abs(read(pixels).parse.energy) < 20


@settings(deadline=None, max_examples=8)
@given(st.integers(30, 400), st.integers(30, 400), st.integers(0, 99))
def test_regions_always_tile(height, width, seed):
    small = np.random.default_rng(seed).integers(0, 255, (5, 4, 3)).astype(np.uint8)
    pixels = cv2.resize(small, (width, height), interpolation=cv2.INTER_NEAREST)
    with suppress(Infeasible):  # too small, or lower than a floor
        assert_tiles(read(pixels).parse)


@pytest.mark.parametrize("shape", [(1, 1), (5, 3), (900, 20), (20, 4000)])
def test_a_picture_too_small_is_refused(shape):
    with pytest.raises(Infeasible, match="too small"):
        read(np.zeros((*shape, 3), np.uint8), Scale(height=2.0))


def test_a_narrow_picture_is_too_small_where_it_is_read():
    with pytest.raises(Infeasible, match="3×320 pixels at working size; expected 24 a side"):
        read(np.zeros((6000, 60, 3), np.uint8), Scale(height=20.0))


def test_a_strip_whose_facade_is_lower_than_a_floor_is_too_small():
    """Cells are as wide as 1,500 of them fill a picture: a long street has few rows of them."""
    street = np.tile(drawn(2, 3), (1, 60, 1))
    assert street.shape[1] > 40 * street.shape[0]
    with pytest.raises(Infeasible, match="too small to hold a floor of windows"):
        read(street)


def test_profiles_are_those_of_a_product():
    down, across = np.zeros(40), np.zeros(50)
    down[5:15] = down[25:35] = 1.0
    across[4:10] = across[20:26] = across[40:46] = 1.0
    plane = np.outer(down, across - across.mean()).astype(np.float32)
    rows, columns = profiles(plane)
    assert (rows[down > 0] > 0.5).all()
    assert np.allclose(rows[down == 0], 0)
    assert columns[across > 0].min() > columns[across == 0].max()
    assert (agreement(plane, columns, 1.0)[down > 0] > 0.4).all()


def test_columns_repeat_with_storeys_a_drain_does_not():
    plane = np.zeros((150, 60), np.float32)
    for storey in range(5):
        plane[30 * storey + 8 : 30 * storey + 22, 10:16] = 1.0
        plane[30 * storey + 8 : 30 * storey + 22, 40:46] = 1.0
    plane[:, 28] = 3.0
    plane -= plane.mean(axis=1, keepdims=True)
    columns = repeated_columns(plane, 30)
    assert np.linalg.norm(columns) == pytest.approx(1)
    assert columns[10:16].min() > 0.1
    assert columns[28] < 0.5 * columns[10:16].min()
    assert profiles(plane)[1][28] > columns[28]
    assert len(repeated_columns(plane[:40], 30)) == 60  # lower than a storey and a half


@pytest.mark.parametrize(
    ("height", "columns", "kept"), [(10, 0.2, False), (10, 0.9, True), (20, 0.2, True)]
)
def test_a_cornice_under_the_sky_is_no_row_of_windows(height, columns, kept):
    floors = [Band("floor", y, y + 30, y + 8, y + 24, 1.0, 0.4) for y in (90, 60, 30)]
    roof = Band("roof", 30 - height, 30, 30 - height, 28, columns, 0.4)
    last = _kept([*floors, roof])[-1]
    assert (last.high > last.low) == kept


def test_the_profiles_of_a_wide_and_a_high_plane_are_found_alike():
    plane = np.random.default_rng(2).normal(size=(30, 50)).astype(np.float32)
    plane += 3 * np.outer(np.hanning(30), np.cos(np.arange(50)))
    for part in (plane, plane[:, :20]):
        rows, columns = profiles(part)
        assert np.linalg.norm(columns) == pytest.approx(1)
        assert rows[15] > 0.5


def test_the_rim_of_a_rectified_picture_says_nothing():
    pixels = drawn(4, 4)
    pixels[:, :25] = 0
    evidence = window_evidence(pixels)
    assert (evidence.seen[:, :25] == 0).all()
    assert (evidence.plane[:, :25] == 0).all()
    assert evidence.seen[:, 40:].mean() > 0.99


def test_a_belief_is_evidence_beside_the_pictures():
    pixels = drawn(4, 4)
    pixels[:, :25] = 0
    evidence = window_evidence(pixels)
    told = np.zeros((len(pixels) // 2, pixels.shape[1] // 2), np.float32)
    np.testing.assert_array_equal(with_belief(evidence, told), evidence.plane)
    told[:, 40:44] = 1.0
    more = with_belief(evidence, told) - evidence.plane
    assert (more[:, :25] == 0).all()
    assert more[:, 81:87].min() > 0.5
    assert more[:, 92:96].max() < 0


def window_share(one: np.ndarray, other: np.ndarray) -> float:
    """Return the intersection over union of the windows of two label maps."""
    a, b = (labels == LABELS.index("window") for labels in (one, other))
    return (a & b).sum() / (a | b).sum()


def test_windows_that_hardly_show_are_found_where_another_believes_in_them():
    """The scale stays as it was told or as the picture alone shows it."""
    true = read(drawn(4, 4)).labels
    windows = (true == LABELS.index("window")).astype(np.float32)
    bare = drawn(4, 4, glass=WALL)
    told = Scale(height=16.0)
    assert window_share(read(bare, told).labels, true) < 0.4
    assert window_share(read(bare, told, windows=windows).labels, true) > 0.7
    scales = [read(bare, windows=w).parse.tags for w in (None, windows)]
    assert scales[0] == scales[1]


def test_the_period_of_a_rhythm():
    assert period(np.sin(np.arange(240) * 2 * np.pi / 30)) == pytest.approx(30, abs=1)
    assert period(np.zeros(100)) == 20


def pattern(storeys: int, high: int, windows: int = 5) -> np.ndarray:
    """Evidence of windows that stand over one another, 60 columns wide, mean 0 along rows."""
    plane = np.zeros((storeys * high, 60), np.float32)
    for storey, x in np.ndindex(storeys, windows):
        y = storey * high + high // 3
        plane[y : y + high // 2, 12 * x + 3 : 12 * x + 9] = 1.0
    return plane - plane.mean(axis=1, keepdims=True)


def test_whole_rows_say_the_period_where_their_profile_misleads():
    plane = pattern(7, 30)
    assert whole_period(plane) == pytest.approx(30, abs=1)
    assert whole_period(np.zeros((100, 60), np.float32)) is None
    halved, fine = (np.sin(np.arange(210) * 2 * np.pi / lag) for lag in (15, 29))
    assert storey_period(halved, plane) == pytest.approx(30, abs=1)
    assert storey_period(fine, plane) == pytest.approx(29, abs=1)
    assert storey_period(halved, np.zeros((210, 60), np.float32)) == pytest.approx(15, abs=1)


def test_rows_that_hardly_agree_say_no_period():
    faint = np.random.default_rng(0).normal(size=(210, 400)).astype(np.float32)
    assert whole_period(faint) is None
    rows = np.sin(np.arange(210) * 2 * np.pi / 29)
    assert storey_period(rows, faint) == pytest.approx(29, abs=1)


def over_a_shop(shop: np.ndarray, ground: int) -> tuple[np.ndarray, list[Band]]:
    """Four floors of 30 cells over a shop (rows of evidence, 60 columns) cut at `ground`."""
    plane = np.concatenate([pattern(4, 30), shop])
    n = len(plane)
    bands = [Band("ground", n - ground, n, n - ground + 4, n - 4, 1.0, 0.4)]
    if ground < len(shop):
        bands.append(Band("floor", 120, n - ground, 126, n - ground - 4, 1.0, 0.4))
    floors = [Band("floor", y, y + 30, y + 10, y + 25, 1.0, 0.4) for y in (90, 60, 30, 0)]
    return plane, bands + floors


def pillars(rows: int) -> np.ndarray:
    across = np.zeros(60, np.float32)
    across[[0, 1, 2, 28, 29, 30, 57, 58, 59]] = 2.0
    return np.tile(across - across.mean(), (rows, 1))


def test_a_ground_floor_has_windows_where_it_looks_like_the_floors_above():
    plane, bands = over_a_shop(pattern(1, 40), 40)
    assert with_shop(plane, bands) == bands
    plane, bands = over_a_shop(pillars(40), 40)
    shop, *others = with_shop(plane, bands)
    assert shop.high == shop.low
    assert (shop.y0, shop.y1) == (120, 160)
    assert others == bands[1:]


def test_a_high_shop_cut_in_two_is_one():
    plane, bands = over_a_shop(pillars(56), 28)
    shop, *others = with_shop(plane, bands)
    assert (shop.kind, shop.y0, shop.y1) == ("ground", 120, 176)
    assert others == bands[2:]
    plane, bands = over_a_shop(pillars(90), 45)  # too high for a ground floor
    assert with_shop(plane, bands)[1:] == bands[1:]


def test_few_floors_do_not_say_what_a_floor_looks_like():
    plane, bands = over_a_shop(pillars(40), 40)
    assert with_shop(plane, bands[:3]) == bands[:3]


def thin_roof(sky: int, height: int, relief: float) -> tuple[Facade, list[Band]]:
    """A roof of so many cells over two floors; its dormers show so much of what windows do."""
    n = sky + height + 60
    plane = np.zeros((n, 60), np.float32)
    wave = np.sign(np.sin(np.arange(60) * 2 * np.pi / 20)).astype(np.float32)
    plane[sky : sky + height] = relief * wave
    bands = []
    for y1 in (n, n - 30):
        plane[y1 - 22 : y1 - 6] = wave
        bands.append(Band("floor", y1 - 30, y1, y1 - 22, y1 - 6, 1.0, 0.3))
    foot = sky + height
    bands.append(Band("roof", sky, foot, foot, foot, 0.0, 0.0))
    facade = Facade(np.zeros((n, 60, 3)), plane, plane, np.zeros(n + 1), sky, 30)
    return facade, bands


@pytest.mark.parametrize(("sky", "height", "relief", "found"), [
    (20, 14, 0.8, True), (20, 14, 0.2, False), (20, 9, 0.8, False), (20, 28, 0.8, False),
    (2, 14, 0.8, False), (60, 14, 0.8, False),
])  # fmt: skip
def test_a_thin_roof_under_the_sky_has_dormers_where_it_holds_as_much(sky, height, relief, found):
    facade, bands = thin_roof(sky, height, relief)
    roof = with_dormers(facade, bands)[-1]
    assert roof.kind == "roof"
    assert (roof.y0, roof.y1) == (sky, sky + height)
    assert (roof.high > roof.low) == found
    assert sky <= roof.low <= roof.high <= sky + height


def test_a_roof_that_has_its_row_and_a_facade_without_rows_stay_as_they_are():
    facade, bands = thin_roof(20, 14, 0.8)
    seen = [*bands[:-1], Band("roof", 20, 34, 22, 30, 0.5, 0.2)]
    assert with_dormers(facade, seen) == seen
    assert with_dormers(facade, bands[-1:]) == bands[-1:]


def transport(one: np.ndarray, two: np.ndarray, palette: np.ndarray) -> float:
    """The earth mover's distance as a linear programme."""
    from scipy.optimize import linprog

    k = len(one)
    cost = np.linalg.norm(palette[:, None] - palette[None], axis=2).ravel()
    sums = np.vstack([np.kron(np.eye(k), np.ones(k)), np.kron(np.ones(k), np.eye(k))])
    given = np.concatenate([one / one.sum(), two / two.sum()])
    return float(linprog(cost, A_eq=sums, b_eq=given).fun)


def test_the_earth_movers_distance_is_the_cheapest_transport():
    rng = np.random.default_rng(0)
    palette = rng.uniform(0, 100, (5, 3)).astype(np.float32)
    for _ in range(5):
        one, two = rng.integers(0, 9, (2, 5)) + np.array([[1], [0]])
        two[0] += 1
        expected = transport(one.astype(float), two.astype(float), palette)
        assert earth_movers(one.astype(float), two.astype(float), palette) == pytest.approx(
            expected, rel=1e-3, abs=1e-3
        )
    assert earth_movers(one.astype(float), np.zeros(5), palette) == 0.0


def test_the_skyline_is_where_the_colours_change():
    pixels = drawn(5, 4)
    found = segments(pixels, np.ones(pixels.shape[:2], np.float32))
    rows = np.zeros(len(pixels))
    rows[50:300] = 0.8
    assert abs(skyline(differences(found, 30), rows) - 40) <= 3
    below = differences(found, 30, top=200)
    assert (below[:201] == 0).all()
    assert below[201:].any()


def test_the_command_writes_a_parse_and_its_pictures(tmp_path, facade_here):
    source = tmp_path / "front.png"
    cv2.imwrite(str(source), drawn(3, 4)[:, :, ::-1])
    target = tmp_path / "parse.json"
    options = ["--method", "mrf", "--storey-height", "3.2", "-o", target]
    done = facade_here("parse-image", source, *options, "--overlay", tmp_path / "overlay.png")
    assert done.returncode == 0, done.stderr
    document = json.loads(target.read_text())
    assert document["tags"]["scale"] == "storey-height"
    assert document["provenance"]["options"]["storey_height"] == 3.2
    assert (tmp_path / "overlay.png").stat().st_size > 0


@pytest.mark.parametrize("options", [
    ("--method", "mrf", "--grammar", "plain"), ("--method", "forest", "--height", "12"),
    ("--method", "mrf", "--solver", "walk"),
])  # fmt: skip
def test_options_of_another_method_are_refused(options, facade_here):
    done = facade_here("parse-image", "front.png", *options)
    assert done.returncode == 2
    assert b"means nothing" in done.stderr
