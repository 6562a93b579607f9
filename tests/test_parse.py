from __future__ import annotations

import io
import itertools
import json
import struct
import zlib
from dataclasses import replace

import cv2
import numpy as np
import pytest

from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.grammar import Grammar, Node, Rule, Size
from facade_tools.artifacts.parse import LABELS
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.grammar.derivation import leaves, painted
from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.grammar.reading import label_index
from facade_tools.grammar.sampling import sample_derivation
from facade_tools.grammar.segments import Cut
from facade_tools.imaging.image_io import MAX_PIXELS, decoded, read_labels, read_photo
from facade_tools.segmentation import dp, walk
from facade_tools.segmentation.classifier import default, save
from facade_tools.segmentation.deriving import Frame, derivation, floors_of, regions_of
from facade_tools.segmentation.energy import Layout, column_costs, energy, field_of, state_costs
from facade_tools.segmentation.painting import render_facade
from facade_tools.segmentation.random_parse import in_pixels

CLASSES = LABELS[1:]

TOY = Grammar(
    "toy",
    "A",
    {"w": "wall", "o": "window", "s": "sky"},
    {
        "A": Rule("up", "w? (F w)+ s?"),
        "F": Rule("right", "w (o w)+", sizes={"o": Size(0.2, 0.5)}),
    },
)


def beliefs(labels, certainty=0.9):
    other = (1 - certainty) / (len(CLASSES) - 1)
    out = np.full((len(CLASSES), *labels.shape), other, np.float32)
    for k in range(len(CLASSES)):
        out[k][labels == k + 1] = certainty
    return out


def random_beliefs(seed, height, width):
    rng = np.random.default_rng(seed)
    shares = rng.random((len(CLASSES), height, width)).astype(np.float32) ** 4
    return shares / shares.sum(axis=0)


def words(machine, length, limit):
    """All cuttings of a line into words of an automaton."""

    def extend(states, bounds):
        if bounds[-1] == length:
            if states[-1] in machine.last:
                yield Cut(tuple(states), tuple(bounds), 0.0)
            return
        choices = machine.follow[states[-1]] if states else machine.first
        for state in choices:
            for end in range(bounds[-1] + limit[0][state], length + 1):
                if end - bounds[-1] <= limit[1][state]:
                    yield from extend([*states, state], [*bounds, end])

    yield from extend([], [0])


@pytest.mark.parametrize("seed", range(6))
def test_dp_finds_what_brute_force_finds(seed):
    made = plan(TOY)
    field = field_of(random_beliefs(seed, 5, 6), CLASSES, made)
    rows = list(words(made.rows, 5, ([1] * 9, [5] * 9)))
    columns = list(words(made.groups[0].automaton, 6, ([1, 1, 1], [6, 2, 6])))
    best = np.inf
    for row, column in itertools.product(rows, columns):
        owner = tuple(-1 if made.states[s].group is None else 0 for s in row.states)
        best = min(best, energy(field, made, Layout(row, (column,), owner)))
    solution = dp.solve(field, made)
    # alternation is exact in each half; from its starts it reaches the optimum of such pictures
    assert best - 1e-6 <= solution.energy <= best * 1.06
    assert solution.bound <= best + 1e-6


@pytest.mark.parametrize("name", ["haussmann", "haussmann-floors", "plain", "tskp10"])
def test_energies_from_sums_equal_direct_sums(name):
    made = plan(builtin(name))
    field = field_of(random_beliefs(1, 60, 50), CLASSES, made)
    solution = dp.solve(field, made)
    layout = solution.layout
    index = label_index()
    labels = painted(derivation(made, layout, Frame((60, 50), (60, 50))), (60, 50), index)
    direct = 0.0
    for label, plane in field.label.items():
        direct += field.cost[plane][::-1][labels == index[label]].sum()
    assert solution.energy == pytest.approx(direct)
    assert solution.bound <= solution.energy + 1e-6
    states = layout.rows.states
    sets = [None if own < 0 else layout.columns[own] for own in layout.owner]
    table = state_costs(field, made, states, sets)
    spans = list(zip(layout.rows.bounds, layout.rows.bounds[1:], strict=False))
    rows = sum(table[i, a:b].sum() for i, (a, b) in enumerate(spans))
    assert rows == pytest.approx(direct)


def test_column_costs_equal_direct_sums():
    made = plan(builtin("plain"))
    field = field_of(random_beliefs(2, 30, 20), CLASSES, made)
    rows = [(s, 3, 9) for s, state in enumerate(made.states) if state.group == 1]
    costs = column_costs(field, made, rows)
    for kind in range(costs.shape[0]):
        planes = [field.label[made.states[s].labels[kind]] for s, _, _ in rows]
        direct = sum(field.cost[plane, 3:9].sum(axis=0) for plane in planes)
        np.testing.assert_allclose(costs[kind], direct)


def rendered_labels(name, seed, width=180, height=240):
    tree = sample_derivation(builtin(name), width, height, rng=np.random.default_rng(seed))
    turned = in_pixels(tree, height)
    return turned, painted(turned, (height, width), label_index())


def rendered_picture(width, height):
    rng = np.random.default_rng(0)
    return render_facade(builtin("haussmann"), width, height, rng=rng)[1]


def without_priors(grammar):
    """Sizes that only bound: priors of sizes would trade clean pixels for usual sizes."""
    rules = {
        name: replace(rule, sizes={k: replace(s, weight=0.0) for k, s in rule.sizes.items()})
        for name, rule in grammar.rules.items()
    }
    return replace(grammar, rules=rules)


def solved(name, belief):
    made = plan(without_priors(builtin(name)))
    shape = belief.shape[1:]
    solution = dp.solve(field_of(belief, CLASSES, made), made)
    tree = derivation(made, solution.layout, Frame(shape, shape))
    return tree, painted(tree, shape, label_index()), solution


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["plain", "tskp10", "haussmann"])
def test_a_known_facade_is_recovered_exactly_from_clean_beliefs(name, seed):
    _, truth = rendered_labels(name, seed)
    _, found, solution = solved(name, beliefs(truth))
    assert (found == truth).mean() == 1.0
    assert solution.optimal


@pytest.mark.parametrize("seed", range(3))
def test_a_known_facade_is_recovered_within_a_pixel_from_noisy_beliefs(seed):
    _, truth = rendered_labels("plain", seed)
    rng = np.random.default_rng(seed)
    noisy = truth.copy()
    wrong = rng.random(truth.shape) < 0.3
    noisy[wrong] = rng.choice([1, 2, 3, 4], wrong.sum())
    _, found, _ = solved("plain", beliefs(noisy, 0.6))
    near = np.zeros(truth.shape, bool)
    for dy, dx in itertools.product((-1, 0, 1), repeat=2):
        near |= np.roll(truth, (dy, dx), (0, 1)) == found
    assert near.mean() > 0.999


def test_regions_tile_and_floors_are_storeys():
    tree, truth = rendered_labels("haussmann-floors", 4)
    tree, found, _ = solved("haussmann-floors", beliefs(truth))
    regions = regions_of(tree)
    canvas = np.zeros(truth.shape, int)
    for r in regions:
        canvas[r.y0 : r.y1, r.x0 : r.x1] += 1
    assert (canvas == 1).all()
    assert (found == truth).mean() > 0.98
    floors = floors_of(tree)
    assert all(f.y0 < f.y1 and list(f.columns) == sorted(f.columns) for f in floors)
    assert [f.y1 for f in floors] == sorted((f.y1 for f in floors), reverse=True)
    assert all(leaf.label for leaf in leaves(tree))


def test_parts_of_a_tile_with_one_label_are_one_region():
    def leaf(label, *scope):
        return Node(label, scope, label=label)

    door = Node("D", (0, 2, 4, 9), "up", None, (
        leaf("door", 0, 6, 4, 9), leaf("wall", 0, 6, 4, 6), leaf("door", 0, 4, 4, 6),
        leaf("wall", 0, 2, 4, 4)))  # fmt: skip
    shop = Node("S", (4, 2, 9, 9), "up", None, (leaf("door", 4, 2, 9, 9),))
    row = Node("R", (0, 2, 9, 9), "right", None, (door, shop))
    tree = Node("I", (0, 0, 9, 9), "up", None, (row, leaf("wall", 0, 0, 9, 2)))
    assert [(r.label, r.x0, r.y0, r.x1, r.y1) for r in regions_of(tree)] == [
        ("door", 0, 4, 4, 9), ("wall", 0, 2, 4, 4), ("door", 4, 2, 9, 9), ("wall", 0, 0, 9, 2)
    ]  # fmt: skip


def test_the_walk_falls_and_never_beats_dp():
    _, truth = rendered_labels("plain", 1, 90, 120)
    for name in ("plain", "haussmann-floors"):
        made = plan(builtin(name))
        field = field_of(beliefs(truth, 0.7), CLASSES, made)
        walked = walk.solve(field, made, rng=np.random.default_rng(0))
        assert list(walked.trace) == sorted(walked.trace, reverse=True)
        assert walked.energy == pytest.approx(walked.trace[-1])
        assert dp.solve(field, made).energy <= walked.energy + 1e-6
        again = walk.solve(field, made, rng=np.random.default_rng(0))
        assert again.layout == walked.layout


def test_the_compiled_energy_of_the_walk_equals_its_plain_version():
    made = plan(builtin("plain"))
    field = field_of(random_beliefs(3, 40, 30), CLASSES, made)
    solution = dp.solve(field, made)
    rng = np.random.default_rng(0)
    axes = walk._axes(field, made, list(range(len(made.groups))))
    images = walk._images(field, made)
    policy = walk._seeded(field, made, axes, images, rng)
    for i, cut in enumerate((solution.layout.rows, *solution.layout.columns)):
        walk._store(policy, i, cut)
    arrays = walk._arrays(policy, axes, images)
    assert walk.evaluate(*arrays) == pytest.approx(solution.energy)
    assert walk.evaluate.py_func(*arrays) == pytest.approx(solution.energy)


def test_pictures_too_small_for_the_grammar_are_infeasible():
    made = plan(builtin("tskp10"))
    with pytest.raises(Infeasible):
        dp.solve(field_of(random_beliefs(0, 2, 2), CLASSES, made), made)


def test_labels_that_the_classifier_lacks_are_named():
    made = plan(builtin("haussmann"))
    with pytest.raises(InvalidInput, match="chimney"):
        field_of(random_beliefs(0, 9, 9)[:7], CLASSES[:7], made)


# --- pictures from strangers ----------------------------------------------------------------------


def png(array):
    return cv2.imencode(".png", array)[1].tobytes()


def jpeg(array):
    return cv2.imencode(".jpg", array)[1].tobytes()


def gradient(height=40, width=60, kind=np.uint8):
    top = np.iinfo(kind).max
    row = np.linspace(0, top, width).astype(kind)
    return np.repeat(np.repeat(row[None, :, None], height, 0), 3, 2)


def with_orientation(data, orientation):
    tiff = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01" + struct.pack(">HHI", orientation, 0, 0)
    body = b"Exif\0\0" + tiff
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[2:]


def test_sixteen_bits_grey_and_orientation_become_eight_bit_rgb_upright():
    deep = decoded(png(gradient(kind=np.uint16)), "x")
    assert deep.dtype == np.uint8
    np.testing.assert_array_equal(deep, gradient(kind=np.uint16)[..., ::-1] >> 8)
    assert decoded(png(gradient()[:, :, 0]), "x").shape == (40, 60, 3)
    assert decoded(with_orientation(jpeg(gradient()), 6), "x").shape == (60, 40, 3)


def test_cmyk_becomes_rgb():
    image = pytest.importorskip("PIL.Image")
    picture = np.zeros((16, 32, 3), np.uint8)
    picture[:, :16], picture[:, 16:] = (200, 40, 40), (40, 60, 200)
    data = io.BytesIO()
    image.fromarray(picture).convert("CMYK").save(data, "JPEG", quality=95)
    found = decoded(data.getvalue(), "x").astype(int)
    assert abs(found - picture)[:, [4, 28]].max() < 12


@pytest.mark.parametrize("ending", [".tif", ".bmp", ".webp", ".png", ".jpg"])
def test_every_format_is_read_whole_and_refused_in_part(ending):
    data = cv2.imencode(ending, gradient())[1].tobytes()
    assert decoded(data, "x").shape == (40, 60, 3)
    for part in (data[: len(data) // 2], data[:-5], data[:30]):
        with pytest.raises(InvalidInput, match=r"truncated|header|decoded"):
            decoded(part, "x")


def animated_png():
    data, body = png(gradient()), b"acTL" + struct.pack(">II", 3, 0)
    chunk = struct.pack(">I", 8) + body + struct.pack(">I", zlib.crc32(body))
    return data[:33] + chunk + data[33:]


def gif(frames, control=b"\x21\xf9\x04\0\0\0\0\0"):
    head = b"GIF89a" + struct.pack("<HH", 2, 2) + b"\xf0\0\0" + b"\0\0\0\xff\xff\xff"
    place = b"\x2c" + struct.pack("<HHHH", 0, 0, 2, 2)
    frame = control + place + b"\0\x02\x03\x44\x02\x05\0"
    return head + frame * frames + b"\x3b"


def huge_png():
    data = bytearray(png(np.zeros((1, 1, 3), np.uint8)))
    data[16:24] = struct.pack(">II", 20_000, 20_000)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"hello, I am text", "no picture"),
        (b"", "no picture"),
        (png(gradient())[:20], "header"),
        (png(gradient())[:-30], "truncated"),
        (jpeg(gradient())[:-200], "truncated"),
        (huge_png(), "20000×20000"),
        (gif(3), "animated"),
        (gif(2, control=b""), "animated"),
        (gif(1)[:-1], "truncated"),
        (animated_png(), "animated"),
        (cv2.imencodemulti(".tif", [gradient(), gradient()])[1].tobytes(), "several pages"),
        (b"RIFF\0\0\0\0WAVEfmt ", "no pixels|header"),
        (b"\xff\xd8\xff", "header"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(data, words):
    with pytest.raises(InvalidInput, match=words) as error:
        decoded(data, "photo")
    assert "\n" not in str(error.value)
    assert MAX_PIXELS < 20_000**2


def test_a_still_gif_is_read():
    assert decoded(gif(1), "x").shape == (2, 2, 3)
    coloured = gif(1).replace(b"\0\x02\x03", b"\x80" + bytes(6) + b"\x02\x03")  # own colours
    assert decoded(coloured, "x").shape == (2, 2, 3)


def test_truncated_label_maps_are_named_so(tmp_path):
    path = tmp_path / "mask.png"
    path.write_bytes(png(np.eye(64, dtype=np.uint8))[:-20])
    with pytest.raises(InvalidInput, match=r"mask.png: is a truncated PNG; expected a whole file"):
        read_labels(str(path))


def test_missing_files_are_invalid_input(tmp_path):
    with pytest.raises(InvalidInput, match="cannot be read"):
        read_photo(str(tmp_path / "none.jpg"))


# --- the command ----------------------------------------------------------------------------------


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
