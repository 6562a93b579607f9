"""The network beside the trees: its convolution, its gradients, its file, and that it learns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.parse import LABELS
from facade_tools.errors import InvalidInput
from facade_tools.grammar.library import builtin
from facade_tools.segmentation import network_training
from facade_tools.segmentation.classifier import _arrays, _joined, decoded, default, save
from facade_tools.segmentation.network import (
    MULTIPLE,
    Network,
    convolve_planes,
    convolved,
    forward,
    inputs,
    padded,
    pixels_of,
    scores_for,
    shapes,
)
from facade_tools.segmentation.network_training import NetworkOptions, train_network
from facade_tools.segmentation.painting import render_facade
from facade_tools.segmentation.views import _uneven, random_view

WIDTHS = (4, 4, 8, 8)
CLASSES = LABELS[1:]
TINY = NetworkOptions(steps=500, widths=WIDTHS, rate=1e-2, memory=0.9, sizes=((96, 64),))


@pytest.fixture(scope="module")
def pairs():
    made = []
    for seed in range(3):
        rng = np.random.default_rng(seed)
        _, picture, labels = render_facade(builtin("haussmann"), 80, 120, rng=rng)
        made.append((picture, labels))
    return made


@pytest.fixture(scope="module")
def trained(pairs):
    return train_network(pairs, CLASSES, TINY, rng=np.random.default_rng(0))


def random_weights(classes=3, seed=0):
    rng = np.random.default_rng(seed)
    wanted = shapes(WIDTHS, classes)
    return {name: rng.normal(0, 0.3, shape).astype(np.float32) for name, shape in wanted.items()}


def direct(x, kernel):
    """Sum over taps and channels, pixel by pixel."""
    height, width, _ = x.shape
    reach = kernel.shape[0] // 2
    out = np.zeros((height, width, kernel.shape[3]))
    for y in range(height):
        for at in range(width):
            for i in range(-reach, reach + 1):
                for j in range(-reach, reach + 1):
                    if 0 <= y + i < height and 0 <= at + j < width:
                        tap = kernel[i + reach, j + reach].astype(np.float64)
                        out[y, at] += x[y + i, at + j] @ tap
    return out


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 7), st.integers(1, 7), st.sampled_from([1, 3]))
def test_convolution_equals_direct_sums(seed, height, width, side):
    rng = np.random.default_rng(seed)
    into, out = rng.integers(1, 5, 2)
    x = rng.normal(size=(height, width, into)).astype(np.float32)
    kernel = rng.normal(size=(side, side, into, out)).astype(np.float32)
    np.testing.assert_allclose(convolved(x, kernel), direct(x, kernel), atol=1e-5)


def test_compiled_convolution_equals_its_plain_version():
    rng = np.random.default_rng(1)
    around = rng.normal(size=(3, 7, 8)).astype(np.float32)
    taps = rng.normal(size=(2, 3, 9)).astype(np.float32)
    one, other = np.zeros((2, 5, 6), np.float32), np.zeros((2, 5, 6), np.float32)
    convolve_planes(around, taps, one)
    convolve_planes.py_func(around, taps, other)
    np.testing.assert_allclose(one, other, rtol=1e-5)


def test_the_trained_function_is_the_applied_one():
    import jax
    import jax.numpy as jnp

    seen = np.random.default_rng(2).normal(size=(16, 8, 14)).astype(np.float32)
    weights = random_weights()
    applied = forward(weights, seen, np, convolved)
    convolve = network_training._convolution()
    differentiated = jax.jit(lambda weights: forward(weights, seen, jnp, convolve))(weights)
    np.testing.assert_allclose(applied, np.asarray(differentiated), atol=1e-4)


def test_gradients_equal_those_of_the_library():
    import jax
    from jax import lax

    rng = np.random.default_rng(3)
    x = rng.normal(size=(6, 5, 3)).astype(np.float32)
    kernel = rng.normal(size=(3, 3, 3, 2)).astype(np.float32)
    ours = network_training._convolution()

    def theirs(x, kernel):
        layout = ("NHWC", "HWIO", "NHWC")
        out = lax.conv_general_dilated(x[None], kernel, (1, 1), "SAME", dimension_numbers=layout)
        return out[0]

    def gradients(function):
        return jax.grad(lambda *given: (function(*given) ** 3).sum(), (0, 1))(x, kernel)

    for mine, other in zip(gradients(ours), gradients(theirs), strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-4, atol=1e-3)


def test_scores_of_cells_become_pixels_in_place():
    picture = np.arange(4 * 6 * 2).reshape(4, 6, 2)
    cells = np.zeros((2, 3, 8), picture.dtype)
    for y in range(4):
        for x in range(6):
            part = 2 * (2 * (y % 2) + x % 2)
            cells[y // 2, x // 2, part : part + 2] = picture[y, x]
    np.testing.assert_array_equal(pixels_of(cells, np), picture)


@pytest.mark.parametrize("shape", [(1, 1), (16, 16), (37, 50), (64, 17)])
def test_any_picture_gets_shares(shape):
    picture = np.random.default_rng(4).integers(0, 255, (*shape, 3)).astype(np.uint8)
    belief = Network(WIDTHS, 3, random_weights()).probabilities(picture)
    assert belief.shape == (3, *shape)
    assert belief.dtype == np.float32
    np.testing.assert_allclose(belief.sum(axis=0), 1, atol=1e-5)
    assert not any(side % MULTIPLE for side in padded(picture).shape[:2])


def test_a_network_learns_rendered_facades(pairs, trained):
    shares = []
    for picture, labels in pairs:
        found = trained.probabilities(picture).argmax(axis=0) + 1
        shares.append((found == labels)[labels > 0].mean())
    assert np.mean(shares) > 0.6


def test_training_is_deterministic(pairs, trained):
    again = train_network(pairs, CLASSES, TINY, rng=np.random.default_rng(0))
    for name, array in trained.weights.items():
        np.testing.assert_array_equal(array, again.weights[name])


def test_training_goes_on_from_another_network(pairs, trained):
    few = replace(TINY, steps=10, rate=1e-4)  # from random weights these teach nothing
    network = train_network(pairs, CLASSES, few, rng=np.random.default_rng(1), start=trained)
    assert any((network.weights[name] != array).any() for name, array in trained.weights.items())
    found = [network.probabilities(picture).argmax(axis=0) + 1 for picture, _ in pairs]
    right = [(f == known)[known > 0].mean() for f, (_, known) in zip(found, pairs, strict=True)]
    assert np.mean(right) > 0.6


def test_what_trees_or_network_exclude_is_not_believed_in():
    one = np.array([0.5, 0.5, 0.0], np.float32).reshape(3, 1, 1)
    other = np.array([0.0, 0.8, 0.2], np.float32).reshape(3, 1, 1)
    joined = _joined(one, other).ravel()
    assert joined.sum() == pytest.approx(1, abs=1e-6)
    expected = np.array([0.5, 0.5, 1e-4]) ** 0.3 * np.array([1e-4, 0.8, 0.2]) ** 0.7
    np.testing.assert_allclose(joined, expected / expected.sum(), rtol=2e-3)
    np.testing.assert_allclose(_joined(other, other), other, atol=2e-4)


def test_scores_follow_their_classes():
    picture = np.random.default_rng(3).integers(0, 255, (48, 64, 3)).astype(np.uint8)
    known = ("window", "wall", "door")
    network = Network(WIDTHS, 3, random_weights())
    before = dict(zip(known, network.probabilities(picture), strict=True))
    again = scores_for(network, known, ("door", "roof", "window", "wall"))
    assert again.weights["in1.kernel"] is network.weights["in1.kernel"]
    after = again.probabilities(picture)
    assert after.shape[0] == 4
    kept = after[[2, 3, 0]] / (1 - after[1])
    np.testing.assert_allclose(kept, [before[name] for name in known], atol=1e-5)


def test_views_keep_pixels_and_labels_together():
    labels = np.full((120, 90), 2, np.uint8)
    labels[30:80, 20:60] = 1
    picture = np.where((labels == 1)[:, :, None], 220, 30).repeat(3, axis=2).astype(np.uint8)
    for seed in range(12):
        seen, known = random_view(
            picture, labels, ((96, 64), (64, 96)), rng=np.random.default_rng(seed)
        )
        assert known.shape in {(96, 64), (64, 96)}
        assert seen.shape == (*known.shape, 3)
        bright = seen.mean(axis=2) > 110
        assert (bright == (known == 1))[known > 0].mean() > 0.9


@given(st.integers(0, 2**32 - 1), st.integers(8, 300), st.floats(0, 0.5))
def test_uneven_positions_rise_and_stay_inside(seed, length, spread):
    at = _uneven(length, spread, np.random.default_rng(seed))
    assert at.shape == (length,)
    assert (np.diff(at) > 0).all()
    assert at[0] > -0.5
    assert at[-1] < length - 0.5
    steps = np.diff(at)
    assert steps.max() / steps.min() < np.exp(12 * spread) + 1e-6


def test_views_stretch_storeys_unevenly():
    stripes = np.zeros((160, 96), np.uint8)
    stripes[::16] = 1  # a line every sixteen rows
    picture = stripes[:, :, None].repeat(3, axis=2) * np.uint8(200)
    seen, known = random_view(picture, stripes + 1, ((160, 96),), rng=np.random.default_rng(4))
    assert seen.shape == (160, 96, 3)
    lines = np.flatnonzero(np.diff((known[:, 48] == 2).astype(int)) == 1)
    gaps = np.diff(lines)
    assert gaps.max() > 1.3 * gaps.min()


def test_a_classifier_keeps_its_network(trained):
    classifier = replace(default(), network=trained)
    again = decoded(save(classifier))
    assert again.network is not None
    assert save(again) == save(classifier)
    picture = np.random.default_rng(6).integers(0, 255, (64, 48, 3)).astype(np.uint8)
    np.testing.assert_array_equal(
        again.network.probabilities(picture), trained.probabilities(picture)
    )
    working = again.working(picture)
    np.testing.assert_allclose(again.probabilities(working).sum(axis=0), 1, atol=1e-4)
    assert (again.probabilities(working) != default().probabilities(working)).any()


@pytest.mark.parametrize("fault", ["shape", "name", "kind", "infinite", "widths", "many"])
def test_hostile_networks_are_refused(trained, fault):
    import io

    arrays = dict(_arrays(save(replace(default(), network=trained))))
    name = "network.in1.kernel"
    changed = {
        "shape": {name: arrays[name][:, :, :-1]},
        "name": {"network.other": arrays[name]},
        "kind": {name: arrays[name].astype(np.float64)},
        "infinite": {name: np.full_like(arrays[name], np.inf)},
        "widths": {"widths": np.array([4, 4, 8])},
        "many": {"widths": np.array([4, 4, 8, 2**40])},
    }[fault]
    out = io.BytesIO()
    np.savez(out, **{**arrays, **changed})
    with pytest.raises(InvalidInput):
        decoded(out.getvalue())


def test_inputs_do_not_depend_on_light_of_the_whole():
    rng = np.random.default_rng(7)
    picture = rng.integers(60, 120, (32, 32, 3)).astype(np.uint8)
    assert inputs(picture).shape == (16, 16, 14)
    assert abs(np.median(inputs(picture)[..., :12])) < 0.1
