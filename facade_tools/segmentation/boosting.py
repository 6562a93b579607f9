"""Gradient-boosted trees: trained by LightGBM, kept as our own arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .trees import Codes, Node, Trees, packed


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
    # LightGBM turns bytes into floats; made here and given away, they are in memory only once
    rows = np.concatenate(codes, dtype=np.float32)
    data = lightgbm.Dataset(rows, labels, weight=weights, params=settings).construct()
    del rows
    booster = lightgbm.train(settings, data, options.rounds)
    dumped = booster.dump_model()["tree_info"]
    return packed([_linked(tree["tree_structure"]) for tree in dumped], classes)


def _linked(node: Mapping[str, Any]) -> Node:
    if "leaf_value" in node:
        return Node(0, 255, None, (float(node["leaf_value"]),))
    # codes are whole numbers, so "code <= 12.5" is "not code > 12"
    threshold = min(max(math.floor(node["threshold"]), 0), 255)
    children = (_linked(node["left_child"]), _linked(node["right_child"]))
    return Node(int(node["split_feature"]), threshold, children, ())
