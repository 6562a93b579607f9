"""Decision trees as flat arrays, and the compiled loop that applies them to many pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..errors import InvalidInput

Codes = NDArray[np.uint8]  # (pixels, features), C order

BLOCK = 64  # pixels that stay in the first cache while all trees pass over them
ROUNDS = 8  # trees a class between two looks at the lead
LEAD = 5.0  # nats: a lead that more trees do not turn


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

    def scores(self, codes: Codes, margin: float = np.inf) -> NDArray[np.float32]:
        """Return the summed scores, (pixels, classes). Raises InvalidInput on too few features.

        A pixel whose best class leads by more than `margin` is asked no further.
        """
        if int(self.feature.max()) >= codes.shape[1]:
            raise InvalidInput("the classifier was trained on other features than these")
        out = np.zeros((len(codes), self.classes), np.float32)
        arrays = (self.feature, self.threshold, self.child, self.value)
        add_scores(codes, *arrays, self.root, self.depth, margin, out)
        return out


@compiled
def add_scores(
    codes: Codes,
    feature: NDArray[np.int16],
    threshold: NDArray[np.uint8],
    child: NDArray[np.int32],
    value: NDArray[np.float32],
    root: NDArray[np.int32],
    depth: NDArray[np.int16],
    margin: float,
    out: NDArray[np.float32],
) -> None:
    """Add every tree's leaf values to `out` (pixels, classes); blocks of pixels outermost."""
    classes = out.shape[1]
    wide = value.shape[1] > 1
    every = ROUNDS * classes
    active = np.empty(BLOCK, np.int64)
    for start in range(0, codes.shape[0], BLOCK):
        left = min(BLOCK, codes.shape[0] - start)
        for i in range(left):
            active[i] = start + i
        for tree in range(root.shape[0]):
            if tree % every == 0 and tree > 0:
                left = _undecided(active, left, out, margin)
            own = tree % classes
            for i in range(left):
                pixel = active[i]
                node = root[tree]
                for _ in range(depth[tree]):
                    node = child[node] + (codes[pixel, feature[node]] > threshold[node])
                if wide:
                    for k in range(classes):
                        out[pixel, k] += value[node, k]
                else:
                    out[pixel, own] += value[node, 0]


@compiled
def _undecided(
    active: NDArray[np.int64], left: int, out: NDArray[np.float32], margin: float
) -> int:
    """Keep the pixels whose best class leads by at most `margin`; returns how many."""
    kept = 0
    for i in range(left):
        first = second = -np.inf
        for score in out[active[i]]:
            if score > first:
                first, second = score, first
            elif score > second:
                second = score
        if first - second <= margin:
            active[kept] = active[i]
            kept += 1
    return kept


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
