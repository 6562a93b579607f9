"""Gradient-boosted trees: trained by LightGBM, kept as our own arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .trees import Codes, Node, Trees, packed

BATCH = 4096  # pixels


@dataclass(frozen=True, slots=True)
class BoostOptions:
    """How trees are grown.

    rounds: trees a class. leaves, depth: of one tree. rate: shrinkage. least: pixels a leaf.
    share, most_features: of all features, how many a tree may look at.
    """

    rounds: int = 80
    leaves: int = 32
    depth: int = 8
    rate: float = 0.13
    least: int = 40
    share: float = 0.25
    most_features: int = 40


def train_boosted(
    codes: Sequence[Codes],
    labels: NDArray[np.intp],
    weights: NDArray[np.float32],
    classes: int,
    options: BoostOptions,
    *,
    seed: int,
) -> Trees:
    """Return trees that score `classes` classes, trained on coded pixels.

    codes: of each picture, (pixels, features). labels: 0..classes-1. weights: of the pixels.
    """
    import lightgbm

    share = min(options.share, options.most_features / codes[0].shape[1])
    settings = {
        "objective": "multiclass", "num_class": classes, "num_leaves": options.leaves,
        "max_depth": options.depth, "learning_rate": options.rate,
        "min_data_in_leaf": options.least, "feature_fraction": share,
        "lambda_l2": 2.0, "max_bin": 63, "num_threads": 1, "verbosity": -1, "seed": seed,
        "deterministic": True, "force_col_wise": True, "bin_construct_sample_cnt": 10_000,
    }  # fmt: skip
    data = dataset(codes, labels, weights, settings)
    booster = lightgbm.train(settings, data, options.rounds)
    dumped = booster.dump_model()["tree_info"]
    return packed([_linked(tree["tree_structure"]) for tree in dumped], classes)


def dataset(
    codes: Sequence[Codes],
    labels: NDArray[np.intp],
    weights: NDArray[np.float32],
    settings: Mapping[str, Any],
) -> Any:
    """Return codes as LightGBM bins them, few of them as its floats in memory at once."""
    import lightgbm

    class Batches(lightgbm.Sequence):
        batch_size = BATCH

        def __init__(self, rows: Codes) -> None:
            self.rows = rows

        def __getitem__(self, index: Any) -> NDArray[np.float64]:
            floats: NDArray[np.float64] = self.rows[index].astype(np.float64)
            return floats

        def __len__(self) -> int:
            return len(self.rows)

    class Dataset(lightgbm.Dataset):
        def get_params(self) -> dict[str, Any]:
            # its own leaves seed and verbosity out, and with them the sample that arrays get
            return dict(settings)

    data = Dataset([Batches(part) for part in codes], labels, weight=weights, params=dict(settings))
    return data.construct()


def _linked(node: Mapping[str, Any]) -> Node:
    if "leaf_value" in node:
        return Node(0, 255, None, (float(node["leaf_value"]),))
    # codes are whole numbers, so "code <= 12.5" is "not code > 12"
    threshold = min(max(math.floor(node["threshold"]), 0), 255)
    children = (_linked(node["left_child"]), _linked(node["right_child"]))
    return Node(int(node["split_feature"]), threshold, children, ())
