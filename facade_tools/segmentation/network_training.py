"""Training of the network: JAX differentiates `network.forward`, AdamW descends."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Picture
from .autocontext import Labels
from .network import Array, Convolve, Network, forward, inputs, pixels_of, shapes
from .rebuilding import rebuilt
from .views import Sizes, random_view

State = tuple[dict[str, Array], ...]  # weights, both moments of their gradients, mean of weights

WARM = 0.05  # of the steps, while the rate rises
FIRST, SECOND, TINY = 0.9, 0.999, 1e-8  # Adam's constants
REPORT = 200  # steps

log = logging.getLogger(__name__)


class Pace(NamedTuple):
    """What changes from step to step.

    rate: step length. number: of the step, from 1 on. memory: of the mean of weights.
    """

    rate: float
    number: float
    memory: float


Step = Callable[[State, Array, Array, Pace], tuple[State, Array]]


@dataclass(frozen=True, slots=True)
class NetworkOptions:
    """How the network is trained.

    steps: views seen; 0 for no network. widths: channels at 1/2, 1/4, 1/8, 1/16. rate: highest
    step length. decay: of weights. longest: norm to which gradients are cut. memory: of the mean
    of weights over the steps, which is what is kept. sizes: of the views, (height, width), pixels,
    multiples of 16; few, because each is compiled for itself.
    """

    steps: int = 7000
    widths: tuple[int, int, int, int] = (16, 40, 72, 104)
    rate: float = 3e-3
    decay: float = 1e-2
    longest: float = 1.0
    memory: float = 0.998
    sizes: Sizes = ((672, 288), (576, 336), (496, 384), (432, 448), (352, 544))


def train_network(
    pairs: Sequence[tuple[Picture, Labels]],
    classes: Sequence[str],
    options: NetworkOptions,
    *,
    rng: np.random.Generator,
    start: Network | None = None,
) -> Network:
    """Return a network of these classes; labels are 0 (ignored) or class + 1.

    start: a network of these classes and widths to go on from; None: from random weights.
    """
    step = _compiled_step(len(classes), options)
    if start is None:
        weights = _start(shapes(options.widths, len(classes)), rng)
    else:
        weights = {name: array.copy() for name, array in start.weights.items()}
    nothing = {name: np.zeros_like(array) for name, array in weights.items()}
    state: State = (weights, nothing, dict(nothing), dict(weights))
    losses: list[Array] = []
    for number, (picture, labels) in enumerate(_views(pairs, classes, options, rng)):
        state, loss = step(state, inputs(picture), labels.astype(np.int32), _pace(options, number))
        losses.append(loss)
        if (number + 1) % REPORT == 0:
            log.info("step %d: loss %.3f", number + 1, np.mean([float(v) for v in losses]))
            losses.clear()
    half = {name: np.asarray(array, np.float16) for name, array in state[3].items()}
    kept = {name: array.astype(np.float32) for name, array in half.items()}  # as the file keeps it
    return Network(options.widths, len(classes), kept)


def _views(
    pairs: Sequence[tuple[Picture, Labels]],
    classes: Sequence[str],
    options: NetworkOptions,
    rng: np.random.Generator,
) -> Iterator[tuple[Picture, Labels]]:
    """Yield views of the pictures in random order, each as often as the others, some rebuilt."""
    order: list[int] = []
    for _ in range(options.steps):
        if not order:
            order = rng.permutation(len(pairs)).tolist()
        whole = rebuilt(*pairs[order.pop()], classes, rng=rng)
        yield random_view(*whole, options.sizes, rng=rng)


def _start(
    wanted: Mapping[str, tuple[int, ...]], rng: np.random.Generator
) -> dict[str, NDArray[np.float32]]:
    """Return random weights that keep the variance of what passes (He 2015)."""
    weights = {}
    for name, shape in wanted.items():
        if name.endswith(("gain", "bias")):
            weights[name] = np.full(shape, float(name.endswith("gain")), np.float32)
        else:
            scale = np.sqrt(2 / np.prod(shape[:-1]))
            weights[name] = rng.normal(0, scale, shape).astype(np.float32)
    return weights


def _pace(options: NetworkOptions, number: int) -> Pace:
    """Return the pace of a step: a short rise of the rate, then half a cosine down."""
    share, count = number / options.steps, number + 1.0
    high = 0.5 + 0.5 * float(np.cos(np.pi * (share - WARM) / (1 - WARM)))
    if share < WARM:
        high = 0.04 + 0.96 * share / WARM
    return Pace(options.rate * high, count, min(options.memory, count / (9 + count)))


def _compiled_step(classes: int, options: NetworkOptions) -> Step:
    import jax
    import jax.numpy as jnp

    convolve = _convolution()

    def loss(weights: dict[str, Array], seen: Array, labels: Array) -> Array:
        logs = jax.nn.log_softmax(pixels_of(forward(weights, seen, jnp, convolve), jnp))
        picked = logs * (labels[..., None] == jnp.arange(1, classes + 1))
        return -picked.sum() / jnp.maximum((labels > 0).sum(), 1)

    def step(state: State, seen: Array, labels: Array, pace: Pace) -> tuple[State, Array]:
        value, gradients = jax.value_and_grad(loss)(state[0], seen, labels)
        length = jnp.sqrt(sum((g**2).sum() for g in gradients.values()))
        cut = jnp.minimum(1.0, options.longest / jnp.maximum(length, TINY))
        shorter = {name: cut * gradient for name, gradient in gradients.items()}
        return _descended(state, shorter, pace, options.decay), value

    return jax.jit(step, donate_argnums=0)


def _convolution() -> Convolve:
    """Return what equals `network.convolved`; the kernel's gradient is a product for each tap.

    That product takes a quarter of the time of the library's own gradient where there are few
    channels.
    """
    import jax
    import jax.numpy as jnp
    from jax import lax

    layout = ("NHWC", "HWIO", "NHWC")

    def plain(x: Array, kernel: Array) -> Array:
        out = lax.conv_general_dilated(x[None], kernel, (1, 1), "SAME", dimension_numbers=layout)
        return out[0]

    def gradients(seen: tuple[Array, Array], above: Array) -> tuple[Array, Array]:
        x, kernel = seen
        height, width, into = x.shape
        around = jnp.pad(x, ((1, 1), (1, 1), (0, 0)))
        flat = above.reshape(height * width, -1)
        taps = [
            around[i : i + height, j : j + width].reshape(-1, into).T @ flat
            for i in range(3)
            for j in range(3)
        ]
        turned = kernel[::-1, ::-1].transpose(0, 1, 3, 2)
        return plain(above, turned), jnp.stack(taps).reshape(kernel.shape)

    three = jax.custom_vjp(plain)
    three.defvjp(lambda x, kernel: (plain(x, kernel), (x, kernel)), gradients)

    def convolve(x: Array, kernel: Array) -> Array:
        return x @ kernel[0, 0] if kernel.shape[0] == 1 else three(x, kernel)

    return convolve


def _descended(state: State, gradients: Mapping[str, Array], pace: Pace, decay: float) -> State:
    """Return the state after a step of AdamW (Loshchilov and Hutter 2019)."""
    after: State = ({}, {}, {}, {})
    for name, gradient in gradients.items():
        weight, first, second, mean = (part[name] for part in state)
        first = FIRST * first + (1 - FIRST) * gradient
        second = SECOND * second + (1 - SECOND) * gradient**2
        even = (second / (1 - SECOND**pace.number)) ** 0.5
        way = first / (1 - FIRST**pace.number) / (even + TINY)
        weight = weight - pace.rate * (way + decay * weight)
        mean = pace.memory * mean + (1 - pace.memory) * weight
        for part, value in zip(after, (weight, first, second, mean), strict=True):
            part[name] = value
    return after
