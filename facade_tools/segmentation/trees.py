"""Decision trees as flat arrays, and the compiled loop that applies them to many pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..errors import InvalidInput
from .masks import MOST_LEAVES, add_masked_scores, lowest_bits

Codes = NDArray[np.uint8]  # (pixels, features), C order

BLOCK = 64  # pixels that stay in the first cache while all trees pass over them


@dataclass(frozen=True, slots=True)
class Trees:
    """An ensemble whose scores add up; all arrays run over the nodes of all trees.

    A node sends a pixel to `child` or, where its code of `feature` is above `threshold`, to
    `child + 1`. A leaf is its own child with threshold 255, so that a fixed number of steps
    (`depth` of the tree) ends in it. value: (nodes, values) what a leaf adds; with one value a
    leaf, tree t scores class t % classes, otherwise all classes at once.
    """

    feature: NDArray[np.int16]
    threshold: NDArray[np.uint8]
    child: NDArray[np.int32]
    value: NDArray[np.float32]
    root: NDArray[np.int32]
    depth: NDArray[np.int16]
    classes: int

    def scores(self, codes: Codes) -> NDArray[np.float32]:
        """Return the summed scores, (pixels, classes). Raises InvalidInput on too few features."""
        if int(self.feature.max()) >= codes.shape[1]:
            raise InvalidInput("the classifier was trained on other features than these")
        out = np.zeros((len(codes), self.classes), np.float32)
        arrays = (self.feature, self.threshold, self.child, self.value)
        if self.small:
            first = np.append(self.root, len(self.child)).astype(np.int64)
            add_masked_scores(codes, *arrays, first, lowest_bits(), out)
        else:
            add_scores(codes, *arrays, self.root, self.depth, out)
        return out

    @property
    def small(self) -> bool:
        """Whether the faster loop serves: few leaves a tree, and one value a leaf."""
        leaves = np.add.reduceat(self.child == np.arange(len(self.child)), self.root)
        return self.value.shape[1] == 1 and int(leaves.max()) <= MOST_LEAVES


@compiled
def add_scores(
    codes: Codes,
    feature: NDArray[np.int16],
    threshold: NDArray[np.uint8],
    child: NDArray[np.int32],
    value: NDArray[np.float32],
    root: NDArray[np.int32],
    depth: NDArray[np.int16],
    out: NDArray[np.float32],
) -> None:
    """Add every tree's leaf values to `out` (pixels, classes); blocks of pixels outermost."""
    classes = out.shape[1]
    wide = value.shape[1] > 1
    for start in range(0, codes.shape[0], BLOCK):
        stop = min(start + BLOCK, codes.shape[0])
        for tree in range(root.shape[0]):
            own = tree % classes
            for pixel in range(start, stop):
                node = root[tree]
                for _ in range(depth[tree]):
                    node = child[node] + (codes[pixel, feature[node]] > threshold[node])
                if wide:
                    for k in range(classes):
                        out[pixel, k] += value[node, k]
                else:
                    out[pixel, own] += value[node, 0]


@dataclass(frozen=True, slots=True)
class Node:
    """A node while a tree is built: a split with two children, or a leaf with its values."""

    feature: int
    threshold: int
    children: tuple[Node, Node] | None
    value: tuple[float, ...]


def packed(trees: Sequence[Node], classes: int) -> Trees:
    """Return linked trees as flat arrays, children of a node side by side."""
    rows: list[Node] = []
    child: list[int] = []
    roots, depths = [], []
    for tree in trees:
        roots.append(len(rows))
        depths.append(_append(tree, rows, child))
    width = max(len(node.value) for node in rows)
    value = [node.value or (0.0,) * width for node in rows]
    return Trees(
        np.array([node.feature for node in rows], np.int16),
        np.array([node.threshold for node in rows], np.uint8),
        np.array(child, np.int32),
        np.array(value, np.float32),
        np.array(roots, np.int32),
        np.array(depths, np.int16),
        classes,
    )


def _append(tree: Node, rows: list[Node], child: list[int]) -> int:
    """Append a tree breadth first; returns its depth."""
    level = [len(rows)]
    rows.append(tree)
    child.append(0)
    depth = 0
    while level:
        deeper: list[int] = []
        for index in level:
            children = rows[index].children
            child[index] = index if children is None else len(rows)
            for node in children or ():
                deeper.append(len(rows))
                rows.append(node)
                child.append(0)
        level = deeper
        depth += bool(level)
    return depth


def softmax(scores: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return class probabilities of scores along the last axis."""
    powers = np.exp(scores - scores.max(axis=-1, keepdims=True))
    shares: NDArray[np.float32] = powers / powers.sum(axis=-1, keepdims=True)
    return shares
