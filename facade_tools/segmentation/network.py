"""A small convolutional network beside the trees: it sees shapes where they see statistics.

An encoder and a decoder with skips (a U-Net) over four resolutions. Blocks of the coarser ones
also see the means of their rows and columns, because a facade repeats along both. It is trained
from nothing (network_training.py) and applied with NumPy and one compiled loop.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..errors import InvalidInput
from ..imaging.features import Picture
from ..imaging.features_context import Probabilities

Array = Any  # of NumPy, or of the library that trains: both are asked by the same names
Weights = Mapping[str, Array]
Convolve = Callable[[Array, Array], Array]

INPUTS = 14  # four pixels of Lab, height, distance from the middle
MULTIPLE = 16  # pixels: sides of what the network sees
GROUPS = 4  # of channels that are normalised together
MAX_WIDTH = 512
COLOURS = np.float32(64)


@dataclass(frozen=True, slots=True)
class Network:
    """Weights by name, as `shapes` lists them. widths: channels at 1/2, 1/4, 1/8, 1/16."""

    widths: tuple[int, int, int, int]
    classes: int
    weights: Mapping[str, NDArray[np.float32]]

    def __post_init__(self) -> None:
        """Refuse weights of other names or shapes."""
        wanted = shapes(self.widths, self.classes)
        if {name: array.shape for name, array in self.weights.items()} != wanted:
            raise InvalidInput("the network's arrays have other names or shapes")

    def probabilities(self, picture: Picture) -> Probabilities:
        """Return class probabilities, (classes, height, width)."""
        height, width = picture.shape[:2]
        seen = inputs(padded(picture))
        scores = pixels_of(forward(self.weights, seen, np, convolved), np)[:height, :width]
        scores -= scores.max(axis=2, keepdims=True)
        np.exp(scores, out=scores)
        scores /= scores.sum(axis=2, keepdims=True)
        return np.ascontiguousarray(scores.transpose(2, 0, 1))


def scores_for(network: Network, known: Sequence[str], wanted: Sequence[str]) -> Network:
    """Return a network of other classes: those it does not know start without a score."""
    weights = dict(network.weights)
    for name in ("scores.kernel", "scores.bias"):
        array = weights[name]
        parts = array.reshape(*array.shape[:-1], 4, len(known))
        out = np.zeros((*parts.shape[:-1], len(wanted)), np.float32)
        for k, label in enumerate(wanted):
            if label in known:
                out[..., k] = parts[..., known.index(label)]
        weights[name] = out.reshape(*array.shape[:-1], -1)
    return Network(network.widths, len(wanted), weights)


def shapes(widths: tuple[int, int, int, int], classes: int) -> dict[str, tuple[int, ...]]:
    """Return name and shape of all weights. Raises InvalidInput on widths that cannot be."""
    if any(width % GROUPS or not 0 < width <= MAX_WIDTH for width in widths):
        raise InvalidInput(f"widths are multiples of {GROUPS} up to {MAX_WIDTH}")
    a, b, c, d = widths
    return dict(
        [
            *_convolution("in1", 3, INPUTS, a), *_convolution("in1.more", 3, a, a),
            *_convolution("in2", 3, a, b), *_block("in2.block", b),
            *_convolution("in3", 3, b, c), *_block("in3.block", c),
            *_convolution("in4", 3, c, d), *_block("in4.block", d), *_block("in4.again", d),
            *_convolution("out3", 1, d + c, c), *_block("out3.block", c),
            *_convolution("out2", 1, c + b, b), *_block("out2.block", b),
            *_convolution("out1", 1, b + a, a), *_convolution("out1.more", 3, a, a),
            ("scores.kernel", (1, 1, a, 4 * classes)), ("scores.bias", (4 * classes,)),
        ]
    )  # fmt: skip


def _convolution(
    name: str, side: int, into: int, out: int
) -> Iterator[tuple[str, tuple[int, ...]]]:
    yield f"{name}.kernel", (side, side, into, out)
    yield f"{name}.gain", (out,)
    yield f"{name}.bias", (out,)


def _block(name: str, width: int) -> Iterator[tuple[str, tuple[int, ...]]]:
    yield from _convolution(f"{name}.first", 3, width, width)
    yield from _convolution(f"{name}.second", 3, width, width)
    yield f"{name}.rows", (width, width)
    yield f"{name}.columns", (width, width)


def padded(picture: Picture) -> Picture:
    """Return a picture whose sides the network can halve, its last row and column repeated."""
    below, right = (-side % MULTIPLE for side in picture.shape[:2])
    edge = cv2.BORDER_REPLICATE
    return cv2.copyMakeBorder(picture, 0, below, 0, right, edge).astype(np.uint8)


def inputs(picture: Picture) -> NDArray[np.float32]:
    """Return what the network sees, (height / 2, width / 2, INPUTS).

    Colours are relative to the picture's median; height and distance from the middle run to 1.
    """
    lab = cv2.cvtColor(picture, cv2.COLOR_RGB2LAB).astype(np.float32) / COLOURS
    lab -= np.median(lab[::3, ::3].reshape(-1, 3), axis=0).astype(np.float32)
    height, width = picture.shape[0] // 2, picture.shape[1] // 2
    four = lab.reshape(height, 2, width, 2, 3).transpose(0, 2, 4, 1, 3).reshape(height, width, 12)
    y = np.linspace(-1, 1, height, dtype=np.float32)[:, None]
    x = np.abs(np.linspace(-1, 1, width, dtype=np.float32))[None]
    return np.concatenate([four, np.stack(np.broadcast_arrays(y, x), axis=2)], axis=2)


def forward(weights: Weights, seen: Array, xp: Any, convolve: Convolve) -> Array:
    """Return scores of the four pixels of every cell, (height / 2, width / 2, 4 · classes).

    xp: numpy, or a module with its functions. convolve: `convolved`, or what equals it.
    """

    def unit(name: str, x: Array) -> Array:
        out = convolve(x, weights[f"{name}.kernel"])
        out = _normalised(out, weights[f"{name}.gain"], weights[f"{name}.bias"], xp)
        return xp.maximum(out, 0)

    def block(name: str, x: Array) -> Array:
        inner = unit(f"{name}.first", x)
        out = convolve(inner, weights[f"{name}.second.kernel"])
        out = out + inner.mean(axis=1, keepdims=True) @ weights[f"{name}.rows"]
        out = out + inner.mean(axis=0, keepdims=True) @ weights[f"{name}.columns"]
        gain, bias = weights[f"{name}.second.gain"], weights[f"{name}.second.bias"]
        return xp.maximum(x + _normalised(out, gain, bias, xp), 0)

    one = unit("in1.more", unit("in1", seen))
    two = block("in2.block", unit("in2", _halved(one)))
    three = block("in3.block", unit("in3", _halved(two)))
    four = block("in4.again", block("in4.block", unit("in4", _halved(three))))
    three = block("out3.block", unit("out3", _joined(four, three, xp)))
    two = block("out2.block", unit("out2", _joined(three, two, xp)))
    one = unit("out1.more", unit("out1", _joined(two, one, xp)))
    return convolve(one, weights["scores.kernel"]) + weights["scores.bias"]


def _normalised(x: Array, gain: Array, bias: Array, xp: Any) -> Array:
    """Return groups of channels with mean 0 and variance 1, scaled (Wu and He 2018)."""
    each = len(gain) // GROUPS
    mean, square = (
        xp.repeat(part.mean(axis=(0, 1)).reshape(GROUPS, each).mean(axis=1), each)
        for part in (x, x * x)
    )
    scale = gain / xp.sqrt(xp.maximum(square - mean * mean, 0) + np.float32(1e-5))
    return x * scale + (bias - mean * scale)


def _halved(x: Array) -> Array:
    height, width, channels = x.shape
    return x.reshape(height // 2, 2, width // 2, 2, channels).mean(axis=(1, 3))


def _joined(low: Array, high: Array, xp: Any) -> Array:
    return xp.concatenate([xp.repeat(xp.repeat(low, 2, axis=0), 2, axis=1), high], axis=2)


def pixels_of(scores: Array, xp: Any) -> Array:
    """Return the scores of single pixels, (height, width, classes)."""
    height, width, channels = scores.shape
    four = scores.reshape(height, width, 2, 2, channels // 4)
    return xp.transpose(four, (0, 2, 1, 3, 4)).reshape(2 * height, 2 * width, channels // 4)


def convolved(x: NDArray[np.float32], kernel: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return x, (height, width, into), convolved with (side, side, into, out); zeros around.

    side: 1 or 3.
    """
    if kernel.shape[0] == 1:
        single: NDArray[np.float32] = x @ kernel[0, 0]
        return single
    height, width = x.shape[:2]
    around = np.zeros((x.shape[2], height + 2, width + 2), np.float32)
    around[:, 1:-1, 1:-1] = x.transpose(2, 0, 1)
    taps = np.ascontiguousarray(kernel.transpose(3, 2, 0, 1).reshape(*kernel.shape[:1:-1], 9))
    out = np.zeros((kernel.shape[3], height, width), np.float32)
    convolve_planes(around, taps, out)
    return np.ascontiguousarray(out.transpose(1, 2, 0))


@compiled
def convolve_planes(
    around: NDArray[np.float32], taps: NDArray[np.float32], out: NDArray[np.float32]
) -> None:
    """Add to `out` (out, height, width) the planes (into, height + 2, width + 2) convolved.

    taps: (out, into, 9), row by row. A row of each plane stays in the first cache while it is
    used, and lies in one piece, so that the inner loop runs over vectors.
    """
    for y in range(out.shape[1]):
        for k in range(out.shape[0]):
            row = out[k, y]
            for i in range(around.shape[0]):
                a, b, c = around[i, y], around[i, y + 1], around[i, y + 2]
                t = taps[k, i]
                t0, t1, t2, t3, t4, t5, t6, t7, t8 = (
                    t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[7], t[8],
                )  # fmt: skip
                for x in range(len(row)):
                    row[x] += (
                        (t0 * a[x] + t1 * a[x + 1] + t2 * a[x + 2])
                        + (t3 * b[x] + t4 * b[x + 1] + t5 * b[x + 2])
                        + (t6 * c[x] + t7 * c[x + 1] + t8 * c[x + 2])
                    )
