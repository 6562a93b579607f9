"""Trees of at most 32 leaves, asked for many pixels at once without walking down them.

QuickScorer (Lucchese et al. 2015): every node that sends a pixel to the right strikes the leaves
under its left child from a word of bits; the lowest bit left is the leaf that the pixel reaches.
All nodes of a tree are asked for a block of pixels in loops without branches.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

MOST_LEAVES = 32
BLOCK = 64  # pixels whose codes stay in the nearest cache, feature by feature
_BRUIJN = (
    0x077CB531  # every word of five bits occurs once: the top bits tell the lowest bit's place
)


def lowest_bits() -> NDArray[np.int64]:
    """Return the place of the lowest bit for each top of (bit · _BRUIJN)."""
    table = np.zeros(MOST_LEAVES, np.int64)
    for place in range(MOST_LEAVES):
        table[((_BRUIJN << place) & 0xFFFFFFFF) >> 27] = place
    return table


@compiled
def struck(
    child: NDArray[np.int32], first: NDArray[np.int64]
) -> tuple[NDArray[np.uint32], NDArray[np.int64]]:
    """Return of each node the word that its left leaves are struck with, and its first leaf.

    first: (trees + 1,) where the nodes of each tree begin; children follow their parents.
    Leaves are counted from the left, from 0 in each tree.
    """
    count = child.shape[0]
    under = np.ones(count, np.int64)  # leaves below the node
    leaf = np.zeros(count, np.int64)
    word = np.full(count, np.uint32(0xFFFFFFFF), np.uint32)
    for node in range(count - 1, -1, -1):
        if child[node] != node:
            under[node] = under[child[node]] + under[child[node] + 1]
    for tree in range(first.shape[0] - 1):
        for node in range(first[tree], first[tree + 1]):
            left = child[node]
            if left != node:
                leaf[left] = leaf[node]
                leaf[left + 1] = leaf[node] + under[left]
                bits = ((np.int64(1) << under[left]) - 1) << leaf[node]
                word[node] = np.uint32(0xFFFFFFFF ^ (bits & 0xFFFFFFFF))
    return word, leaf


@compiled
def add_masked_scores(
    codes: NDArray[np.uint8],
    feature: NDArray[np.int16],
    threshold: NDArray[np.uint8],
    child: NDArray[np.int32],
    value: NDArray[np.float32],
    first: NDArray[np.int64],
    lowest: NDArray[np.int64],
    out: NDArray[np.float32],
) -> None:
    """Add every tree's leaf values to `out` (pixels, classes); tree t scores class t % classes.

    codes: (pixels, features). first: (trees + 1,) where the nodes of each tree begin.
    """
    word, leaf = struck(child, first)
    classes = out.shape[1]
    full = np.uint32(0xFFFFFFFF)
    planes = np.zeros((codes.shape[1], BLOCK), np.uint8)
    mask = np.empty(BLOCK, np.uint32)
    reached = np.zeros(MOST_LEAVES, np.float32)
    for start in range(0, codes.shape[0], BLOCK):
        size = min(BLOCK, codes.shape[0] - start)
        for j in range(size):
            for plane in range(codes.shape[1]):
                planes[plane, j] = codes[start + j, plane]
        for tree in range(first.shape[0] - 1):
            mask[:] = full
            for node in range(first[tree], first[tree + 1]):
                if child[node] == node:
                    reached[leaf[node]] = value[node, 0]
                    continue
                row, limit, kept = planes[feature[node]], threshold[node], word[node]
                for j in range(BLOCK):
                    mask[j] = mask[j] & (kept if row[j] > limit else full)
            own = tree % classes
            for j in range(size):
                lone = np.uint32(mask[j] & np.uint32(~mask[j] + np.uint32(1)))
                place = lowest[np.uint32(lone * np.uint32(_BRUIJN)) >> np.uint32(27)]
                out[start + j, own] += reached[place]
