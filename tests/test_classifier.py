from __future__ import annotations

import io
import zipfile
from dataclasses import replace

import cv2
import numpy as np
import pytest

from facade_tools.artifacts.parse import LABELS
from facade_tools.errors import InvalidInput
from facade_tools.grammar.library import builtin
from facade_tools.imaging.features import pixel_features, shifted
from facade_tools.imaging.features_context import context_features
from facade_tools.segmentation.augmentation import varied
from facade_tools.segmentation.autocontext import EARLY_STRIDE, Belief, run_stages
from facade_tools.segmentation.boosting import BoostOptions, train_boosted
from facade_tools.segmentation.boosting import dataset as boosting_dataset
from facade_tools.segmentation.classifier import Classifier, decoded, default, save
from facade_tools.segmentation.conventions import CONVENTIONS, convention
from facade_tools.segmentation.evaluation import Tally, boxes_of_labels, groups, matched
from facade_tools.segmentation.make_default import OPTIONS, make_default
from facade_tools.segmentation.network_training import NetworkOptions
from facade_tools.segmentation.painting import render_facade
from facade_tools.segmentation.patches import ForestOptions, patch_codes, patch_tests
from facade_tools.segmentation.training import Pair, TrainOptions, class_weights, train
from facade_tools.segmentation.trees import Node, add_scores, packed

SMALL = BoostOptions(rounds=6, leaves=8, depth=5, least=5)
TREES = NetworkOptions(steps=0)


def rendered(seed, width=110, height=160):
    rng = np.random.default_rng(seed)
    _, picture, labels = render_facade(builtin("haussmann"), width, height, rng=rng)
    return Pair(f"p{seed}", picture, labels)


@pytest.fixture(scope="module")
def pairs():
    return [rendered(seed) for seed in range(4)]


@pytest.fixture(scope="module")
def trained(pairs):
    options = TrainOptions(
        stages=2, height=160, coarse=96, pixels=1500, early=SMALL, boost=SMALL, network=TREES
    )
    return train(pairs, options, rng=np.random.default_rng(0))


@pytest.fixture(scope="module")
def forest(pairs):
    options = TrainOptions("patch", coarse=160, pixels=1000, forest=ForestOptions(3, 10, 7))
    return train(pairs, options, rng=np.random.default_rng(0))


def random_tree(rng, depth, classes):
    if depth == 0 or rng.random() < 0.2:
        return Node(0, 255, None, tuple(rng.normal(size=classes).tolist()))
    children = (random_tree(rng, depth - 1, classes), random_tree(rng, depth - 1, classes))
    return Node(int(rng.integers(9)), int(rng.integers(255)), children, ())


def followed(node, row):
    while node.children is not None:
        node = node.children[int(row[node.feature] > node.threshold)]
    return node.value


@pytest.mark.parametrize(("classes", "depth"), [(1, 4), (1, 7), (3, 6)])
def test_packed_trees_score_as_the_linked_ones(classes, depth):
    rng = np.random.default_rng(classes)
    linked = [random_tree(rng, depth, classes) for _ in range(9)]
    trees = packed(linked, 3)
    assert trees.small == (depth == 4)
    codes = rng.integers(0, 256, (150, 9)).astype(np.uint8)
    expected = np.zeros((150, 3))
    for number, tree in enumerate(linked):
        for i, row in enumerate(codes):
            value = followed(tree, row)
            expected[i] += value if classes > 1 else np.eye(3)[number % 3] * value[0]
    np.testing.assert_allclose(trees.scores(codes), expected, atol=1e-5)
    plain = np.zeros((150, 3), np.float32)
    arrays = (trees.feature, trees.threshold, trees.child, trees.value, trees.root, trees.depth)
    add_scores.py_func(codes, *arrays, plain)
    np.testing.assert_allclose(plain, trees.scores(codes), atol=1e-5)


def test_exported_trees_predict_what_lightgbm_does():
    import lightgbm

    rng = np.random.default_rng(0)
    codes = rng.integers(0, 256, (600, 7)).astype(np.uint8)
    labels = (codes[:, 0] > 90).astype(np.intp) + (codes[:, 3] > 200)
    trees = train_boosted([codes], labels, np.ones(600, np.float32), 3, SMALL, seed=1)
    settings = {
        "objective": "multiclass", "num_class": 3, "num_leaves": 8, "max_depth": 5,
        "learning_rate": SMALL.rate, "min_data_in_leaf": 5, "feature_fraction": SMALL.share,
        "lambda_l2": 2.0, "max_bin": 63, "num_threads": 1, "verbosity": -1, "seed": 1,
        "deterministic": True, "force_col_wise": True, "bin_construct_sample_cnt": 10_000,
    }  # fmt: skip
    data = lightgbm.Dataset(codes, labels, weight=np.ones(600))
    raw = lightgbm.train(settings, data, SMALL.rounds).predict(codes, raw_score=True)
    np.testing.assert_allclose(trees.scores(codes), raw, atol=1e-4)


def test_batches_of_codes_are_binned_as_one_array_is():
    import lightgbm

    rng = np.random.default_rng(1)
    codes = [rng.integers(0, 256, (size, 5)).astype(np.uint8) for size in (9000, 40, 4000)]
    rows = np.concatenate(codes)
    labels = (rows[:, 0] > 90).astype(np.intp) + (rows[:, 3] > 200)
    settings = {"objective": "multiclass", "num_class": 3, "num_leaves": 8, "max_bin": 63,
                "num_threads": 1, "verbosity": -1, "seed": 5, "deterministic": True,
                "bin_construct_sample_cnt": 1000}  # fmt: skip
    weights = np.ones(len(rows), np.float32)
    parts = boosting_dataset(codes, labels, weights, settings)
    whole = lightgbm.Dataset(rows.astype(np.float32), labels, weight=weights, params=settings)
    one, other = (lightgbm.train(settings, data, 3) for data in (parts, whole))
    assert one.dump_model()["tree_info"] == other.dump_model()["tree_info"]


def test_a_belief_is_interpolated_from_every_third_pixel():
    for shape in ((1, 1), (7, 4), (12, 9)):
        ramp = np.add.outer(np.arange(shape[0]), np.arange(shape[1])).astype(np.float32)
        belief = Belief(ramp[None, ::EARLY_STRIDE, ::EARLY_STRIDE], shape)
        whole = belief.whole()
        assert whole.shape == (1, *shape)
        last = [(side - 1) // EARLY_STRIDE * EARLY_STRIDE + 1 for side in shape]
        np.testing.assert_allclose(
            whole[0, : last[0], : last[1]], ramp[: last[0], : last[1]], atol=0.05
        )


def test_training_keeps_pairs_only_as_it_reads_them(pairs):
    options = TrainOptions(
        stages=3, height=96, coarse=48, pixels=200, early=SMALL, boost=SMALL, network=TREES
    )
    listed = train(pairs[:3], options, rng=np.random.default_rng(3))
    streamed = train(iter(pairs[:3]), options, rng=np.random.default_rng(3))
    assert save(listed) == save(streamed)


def test_features_are_bytes_of_any_picture_and_do_not_change_it():
    rng = np.random.default_rng(0)
    for shape in ((1, 1), (1, 9), (9, 1), (40, 30)):
        picture = rng.integers(0, 256, (*shape, 3)).astype(np.uint8)
        before = picture.copy()
        planes = pixel_features(picture)
        assert planes.dtype == np.uint8
        assert planes.shape[1:] == shape
        belief = np.full((3, *shape), 1 / 3, np.float32)
        assert context_features(belief).shape[1:] == shape
        np.testing.assert_array_equal(picture, before)


def test_shifted_planes_repeat_their_edges():
    plane = np.arange(12, dtype=np.float32).reshape(3, 4)
    np.testing.assert_array_equal(shifted(plane, 1, 0)[:, :3], plane[:, 1:])
    np.testing.assert_array_equal(shifted(plane, 0, -1)[1:], plane[:2])
    np.testing.assert_array_equal(shifted(plane, 9, 0), np.repeat(plane[:, 3:], 4, axis=1))


def test_patch_codes_look_at_the_patch():
    picture = np.random.default_rng(0).integers(0, 256, (9, 8, 3)).astype(np.uint8)
    tests = patch_tests(3)
    codes = patch_codes(picture, tests)
    y, x = 4, 5
    row = codes[y * 8 + x]
    for value, (dx, dy, channel) in zip(row, tests.single, strict=False):
        assert value == picture[y + dy, x + dx, channel]
    one, other = tests.first[0], tests.second[0]
    brighter = (
        picture[y + one[1], x + one[0], one[2]] > picture[y + other[1], x + other[0], other[2]]
    )
    assert row[len(tests.single)] == 255 * brighter
    np.testing.assert_array_equal(patch_codes(picture, tests, np.array([37])), codes[37:38])


@pytest.mark.parametrize("kind", ["trained", "forest"])
def test_classifiers_learn_round_trip_and_are_the_same_again(kind, request, pairs):
    classifier = request.getfixturevalue(kind)
    data = save(classifier)
    again = decoded(data)
    assert save(again) == data
    labels, shares = np.array([LABELS.index(name) for name in again.classes]), []
    for pair in pairs:
        belief = again.probabilities(again.working(pair.picture))
        assert belief.shape[0] == len(classifier.classes)
        np.testing.assert_allclose(belief.sum(axis=0), 1, atol=1e-3)
        known = pair.labels > 0
        shares.append((labels[belief.argmax(axis=0)] == pair.labels)[known].mean())
    assert np.mean(shares) > 0.6


def test_training_is_deterministic(pairs):
    options = TrainOptions(
        stages=2,
        height=96,
        coarse=48,
        pixels=200,
        augment=1,
        balance=0.5,
        boost=SMALL,
        network=TREES,
    )
    one = train(pairs[:2], options, rng=np.random.default_rng(3))
    assert save(one) == save(train(pairs[:2], options, rng=np.random.default_rng(3)))


def test_class_weights_balance():
    labels = np.array([0, 0, 0, 1])
    np.testing.assert_allclose(class_weights(labels, 2, 0.0), 1)
    weights = class_weights(labels, 2, 1.0)
    assert weights[:3].sum() == pytest.approx(weights[3])


def test_varied_pictures_keep_pixels_and_labels_together():
    labels = np.full((60, 50), 2, np.uint8)
    labels[20:40, 10:30] = 1
    picture = np.repeat((labels == 1)[:, :, None] * 200, 3, axis=2).astype(np.uint8)
    for seed in range(5):
        moved, known = varied(picture, labels, rng=np.random.default_rng(seed))
        inside = cv2.erode((known == 1).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
        outside = cv2.erode((known == 2).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0
        assert moved[inside].mean() > moved[outside].mean() + 60


def tampered(classifier, **arrays):
    out = io.BytesIO()
    with np.load(io.BytesIO(save(classifier))) as loaded:
        np.savez(out, **{**dict(loaded), **arrays})
    return out.getvalue()


@pytest.mark.parametrize(
    "arrays",
    [
        {"child0": np.array([10**6], np.int32)},
        {"root0": np.array([-1], np.int32)},
        {"feature0": np.array([1.5])},
        {"format": np.array("other")},
        {"height": np.array(10**7)},
        {"classes": np.array(["wall"])},
        {"kind": np.array("magic")},
        {"depth0": np.array([999], np.int16)},
    ],
)
def test_tampered_classifiers_are_refused(trained, arrays):
    with pytest.raises(InvalidInput):
        decoded(tampered(trained, **arrays))


def test_pickles_and_rubbish_are_refused():
    out = io.BytesIO()
    np.savez(out, format=np.array([{}], dtype=object))
    empty = io.BytesIO()
    zipfile.ZipFile(empty, "w").close()
    for data in (b"rubbish", b"", out.getvalue(), empty.getvalue()):
        with pytest.raises(InvalidInput):
            decoded(data)


def test_a_classifier_of_other_features_is_refused(trained):
    wide = np.full_like(trained.stages[0].feature, 30000)
    data = tampered(trained, feature0=wide)
    with pytest.raises(InvalidInput, match="other features"):
        decoded(data).probabilities(np.zeros((20, 20, 3), np.uint8))


def test_the_last_stage_is_not_asked_about_what_is_told():
    shipped = default()
    picture = shipped.working(rendered(3).picture)
    told = np.zeros(picture.shape[:2], bool)
    told[:, : told.shape[1] // 2] = True

    def belief(told):
        return run_stages(shipped.stages, picture, shipped.coarse, shipped.fine, told)

    asked, taken = belief(None), belief(np.ones_like(told))
    assert np.abs(asked - taken)[:, told].max() > 0.1
    assert np.array_equal(belief(told), np.where(told, taken, asked))


def test_the_shipped_classifier_reads_rendered_facades():
    classifier = default()
    assert set(classifier.classes) == set(LABELS[1:])
    pair = rendered(77, 160, 288)
    belief = classifier.probabilities(classifier.working(pair.picture))
    found = np.array([LABELS.index(name) for name in classifier.classes])[belief.argmax(axis=0)]
    assert (found == pair.labels)[pair.labels > 0].mean() > 0.7


def test_the_script_of_the_shipped_classifier_makes_one_that_reads_facades():
    small = replace(OPTIONS, stages=2, height=160, coarse=96, early=SMALL, boost=SMALL)
    made = decoded(save(make_default(6, options=small)))
    assert set(made.classes) == set(default().classes)
    assert made.network is None
    pair = rendered(77, 160, 288)
    belief = made.probabilities(made.working(pair.picture))
    labels = cv2.resize(pair.labels, belief.shape[:0:-1], interpolation=cv2.INTER_NEAREST)
    found = np.array([LABELS.index(name) for name in made.classes])[belief.argmax(axis=0)]
    seen = labels > 0
    commonest = max((labels[seen] == k).mean() for k in range(1, len(LABELS)))
    assert (found == labels)[seen].mean() > commonest + 0.1


@pytest.mark.parametrize("name", list(CONVENTIONS))
def test_conventions_read_indices_and_colours_alike(name, tmp_path):
    rows = CONVENTIONS[name]
    indices = np.array([[row[0] for row in rows]], np.uint8)
    colors = np.array([[row[1][::-1] for row in rows]], np.uint8)
    for stem, picture in (("indices", indices), ("colors", colors)):
        cv2.imwrite(str(tmp_path / f"{stem}.png"), picture)
    known = convention(name)
    expected = [0 if row[2] == "void" else LABELS.index(row[2]) for row in rows]
    for stem in ("indices", "colors"):
        assert known.read(str(tmp_path / f"{stem}.png"))[0].tolist() == expected
    cv2.imwrite(str(tmp_path / "bad.png"), np.full((2, 2, 3), 77, np.uint8))
    with pytest.raises(InvalidInput, match="belongs to no class"):
        known.read(str(tmp_path / "bad.png"))


def test_conventions_match_the_files_of_the_data_sets(shared_data):
    for name in CONVENTIONS:
        path = shared_data / "facades" / name / "classes.json"
        one, other = convention(name), convention(str(path))
        np.testing.assert_array_equal(one.label, other.label)
        np.testing.assert_array_equal(one.colors, other.colors)


def test_bad_conventions_are_refused(tmp_path):
    path = tmp_path / "classes.json"
    for text in (
        "{",
        '{"classes": [{"index": 1}]}',
        '{"classes": [{"index": 1, "colour": [1, 2, 3], "common": "moat"}]}',
        '{"classes": []}',
        "[" * 100_000,
        '{"classes": [{"index": 1, "colour": [1e999, 0, 0], "common": "wall"}]}',
    ):
        path.write_text(text)
        with pytest.raises(InvalidInput):
            convention(str(path))
    with pytest.raises(InvalidInput):
        convention(str(tmp_path / "none.json"))


def test_scores_of_a_known_confusion():
    truth = np.array([[1, 1, 2, 2], [8, 8, 6, 0]], np.uint8)
    found = np.array([[1, 2, 2, 2], [6, 8, 6, 5]], np.uint8)
    tally = Tally()
    tally.add(truth, found, np.empty((0, 4)), np.empty((0, 4)))
    assert tally.accuracy() == pytest.approx(5 / 7)
    assert tally.accuracy(fold_chimney=True) == pytest.approx(6 / 7)
    assert tally.mean_iou() == pytest.approx(np.mean([1 / 2, 2 / 3, 1 / 2, 1 / 2]))


def test_boxes_groups_and_matches():
    labels = np.full((60, 90), 2, np.uint8)
    for y in (5, 35):
        for x in (5, 35, 65):
            labels[y : y + 15, x : x + 12] = 1
    boxes = boxes_of_labels(labels)
    assert len(boxes) == 6
    assert (groups(boxes, 1), groups(boxes, 0)) == (2, 3)
    assert matched(boxes, boxes + 1) == 6
    assert matched(boxes, boxes + 9) == 0
    assert matched(boxes, boxes[:0]) == groups(boxes[:0], 0) == 0


def test_lines_one_pixel_high_are_no_windows():
    labels = np.full((60, 90), 2, np.uint8)
    labels[5:20, 5:17] = 1
    labels[24, 5:34] = 1  # left between two annotated railings
    labels[40:43, 5:17] = 1
    assert boxes_of_labels(labels).tolist() == [[5, 5, 17, 20], [5, 40, 17, 43]]
    assert boxes_of_labels(np.zeros((4, 4), np.uint8)).shape == (0, 4)


def test_train_parser_end_to_end(facade, pairs, tmp_path):
    for folder in ("images", "labels"):
        (tmp_path / folder).mkdir()
    for pair in pairs[:2]:
        cv2.imwrite(str(tmp_path / "images" / f"{pair.name}.png"), pair.picture[:, :, ::-1])
        cv2.imwrite(str(tmp_path / "labels" / f"{pair.name}.png"), pair.labels)
    out = tmp_path / "model.npz"
    options = ("--stages", 1, "--rounds", 3, "--height", 96, "--pixels", 100, "--steps", 0)
    done = facade("train-parser", tmp_path / "images", tmp_path / "labels", *options, "-o", out)
    assert done.returncode == 0, done.stderr
    assert isinstance(decoded(out.read_bytes()), Classifier)
    missing = facade("train-parser", tmp_path, tmp_path / "labels", "-o", out)
    assert missing.returncode == 3
    folders = (tmp_path / "images", tmp_path / "labels")
    assert facade("train-parser", *folders, "-o", folders[0] / "p0.png").returncode == 2
    (folders[1] / "p0.png").rename(folders[1] / "p0.PNG")
    assert facade("train-parser", *folders, *options, "-o", out).returncode == 0
    (folders[1] / "p0.PNG").unlink()
    alone = facade("train-parser", *folders, *options, "-o", tmp_path / "none.npz")
    assert alone.returncode == 3
    assert b"1 pictures have no label map" in alone.stderr
    assert b"images: needs at least two pictures" in alone.stderr
    high = facade("train-parser", *folders, "--height", 96, "--coarse", 97, "-o", out)
    assert high.returncode == 2
    assert b"--coarse 97 is above --height 96" in high.stderr
    start = ("--start", out)
    bare = facade(
        "train-parser", tmp_path / "images", tmp_path / "labels", *start, "-o", tmp_path / "b.npz"
    )
    assert bare.returncode == 3
    assert b"model.npz: holds no network to start from" in bare.stderr
