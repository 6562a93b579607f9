"""The paper's classifier: a randomised forest on raw patches (TSKP10 section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Picture
from .autocontext import Labels, sample_pixels
from .trees import Codes, Node, Trees, packed

COMPARED = 600  # pairs of pixels that the trees may compare


@dataclass(frozen=True, slots=True)
class PatchTests:
    """What the tests of a forest look at: (n, 3) dx, dy, channel of single pixels and of pairs."""

    single: NDArray[np.int64]
    first: NDArray[np.int64]
    second: NDArray[np.int64]


def patch_tests(side: int) -> PatchTests:
    """Return all single pixels of a patch, and a fixed random choice of pairs."""
    half = side // 2
    grid = np.mgrid[-half : half + 1, -half : half + 1, 0:3].reshape(3, -1).T
    rng = np.random.Generator(np.random.PCG64(side))
    pairs = rng.choice(len(grid), (2, COMPARED))
    return PatchTests(grid, grid[pairs[0]], grid[pairs[1]])


def patch_codes(picture: Picture, tests: PatchTests, at: NDArray[np.intp] | None = None) -> Codes:
    """Return (pixels, tests): single values, then 255 where the first of a pair is brighter.

    at: flat indices of pixels; all without it. Borders are mirrored.
    """
    height, width = picture.shape[:2]
    half = int(np.abs(tests.single[:, :2]).max())
    padded = np.pad(picture, ((half, half), (half, half), (0, 0)), mode="symmetric")
    where = np.arange(height * width) if at is None else at
    y, x = where // width + half, where % width + half
    out = np.empty((len(where), len(tests.single) + len(tests.first)), np.uint8)
    for i, (dx, dy, channel) in enumerate(tests.single):
        out[:, i] = padded[y + dy, x + dx, channel]
    for i, (one, other) in enumerate(
        zip(tests.first, tests.second, strict=True), len(tests.single)
    ):
        left = padded[y + one[1], x + one[0], one[2]]
        out[:, i] = 255 * (left > padded[y + other[1], x + other[0], other[2]])
    return out


@dataclass(frozen=True, slots=True)
class ForestOptions:
    """How the forest is grown; the paper's choice is 10 trees of depth 18 on 15×15 patches."""

    trees: int = 10
    depth: int = 18
    patch: int = 15


def train_forest(
    pictures: Sequence[tuple[Picture, Labels]],
    classes: int,
    options: ForestOptions,
    pixels: int,
    *,
    rng: np.random.Generator,
) -> Trees:
    """Return a forest whose leaves hold shares of classes; labels are 0 (ignored) or class + 1."""
    from sklearn.ensemble import RandomForestClassifier

    tests = patch_tests(options.patch)
    rows, labels = [], []
    for picture, label in pictures:
        at = sample_pixels(label > 0, pixels, rng)
        rows.append(patch_codes(picture, tests, at))
        labels.append(label.ravel()[at].astype(np.intp) - 1)
    forest = RandomForestClassifier(
        options.trees, max_depth=options.depth, n_jobs=1, random_state=int(rng.integers(2**31))
    )
    forest.fit(np.concatenate(rows), np.concatenate(labels))
    known = forest.classes_.astype(int)
    return packed([_linked(one.tree_, 0, known, classes) for one in forest.estimators_], classes)


def _linked(tree: object, index: int, known: NDArray[np.int64], classes: int) -> Node:
    """Return a node of scikit-learn's tree as ours."""
    left = tree.children_left[index]  # type: ignore[attr-defined]
    if left < 0:
        counts = tree.value[index][0]  # type: ignore[attr-defined]
        shares = np.zeros(classes)
        shares[known] = counts / counts.sum()
        return Node(0, 255, None, tuple(shares.tolist()))
    right = tree.children_right[index]  # type: ignore[attr-defined]
    threshold = int(np.floor(tree.threshold[index]))  # type: ignore[attr-defined]
    feature = int(tree.feature[index])  # type: ignore[attr-defined]
    children = (_linked(tree, left, known, classes), _linked(tree, right, known, classes))
    return Node(feature, min(max(threshold, 0), 255), children, ())
