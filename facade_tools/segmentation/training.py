"""Training of the pixel classifier from pictures and label maps."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS
from ..errors import InvalidInput
from ..imaging.features import Picture
from ..imaging.image_io import PICTURES, fitted, read_photo
from .augmentation import varied
from .autocontext import FINE, Example, Labels, example, train_stages
from .boosting import BoostOptions, train_boosted
from .classifier import MAX_PIXELS, Classifier, load
from .conventions import Convention
from .network import Network, scores_for
from .network_training import NetworkOptions, train_network
from .patches import ForestOptions, train_forest
from .trees import Codes, Trees

MAX_PICTURES = 100_000

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class TrainOptions:
    """How a classifier is trained.

    features: `context` or `patch`. stages: of auto-context. height: working resolution, rows.
    coarse: rows at which all stages but the last two look. pixels: sampled a picture, variant and
    stage. inner: folds by picture for the beliefs that later stages train on. augment: varied
    copies a picture. balance: 0 weighs pixels equally, 1 gives each class the same weight.
    early, boost: trees of all stages but the last two, and of these. network: beside the trees.
    start: a classifier of other pictures whose network goes on here, if it has one; its trees
    are not used.
    """

    features: str = "context"
    stages: int = 4
    height: int = 576
    coarse: int = 288
    pixels: int = 2000
    inner: int = 2
    augment: int = 1
    balance: float = 0.0
    early: BoostOptions = field(default_factory=lambda: BoostOptions(rounds=50, rate=0.17))
    boost: BoostOptions = field(default_factory=BoostOptions)
    forest: ForestOptions = field(default_factory=ForestOptions)
    network: NetworkOptions = field(default_factory=NetworkOptions)
    start: Classifier | None = None


@dataclass(frozen=True, slots=True)
class Pair:
    """A picture and its label map (our labels, 0 ignored), of one size."""

    name: str
    picture: Picture
    labels: Labels


def read_pairs(images: str, labels: str, convention: Convention) -> Iterator[Pair]:
    """Yield the pictures of a folder with the label maps of the same stem in another.

    Pictures without a map are left out. Raises InvalidInput where none has one or sizes differ.
    """
    found = sorted(p for p in Path(images).glob("*") if p.suffix.lower() in PICTURES)
    maps = {p.stem: p for p in Path(labels).glob("*") if p.suffix.lower() == ".png"}
    both = [path for path in found if path.stem in maps]
    if not both:
        raise InvalidInput("holds no picture with a label map of the same name").at(images)
    if len(both) < len(found):
        log.warning("%s: %d pictures have no label map", images, len(found) - len(both))
    for path in both[:MAX_PICTURES]:
        photo = read_photo(str(path))
        known = convention.read(str(maps[path.stem]))
        if known.shape != photo.pixels.shape[:2]:
            raise InvalidInput("has another size than its picture").at(str(maps[path.stem]))
        yield Pair(path.stem, photo.pixels, known)


def load_start(path: str) -> Classifier:
    """Return a classifier that training can start from. Raises InvalidInput without a network."""
    classifier = load(path)
    if classifier.network is None:
        raise InvalidInput("holds no network to start from").at(path)
    return classifier


def train(pairs: Iterable[Pair], options: TrainOptions, *, rng: np.random.Generator) -> Classifier:
    """Return a classifier of the labels in `pairs`. Raises InvalidInput on fewer than two.

    Pairs are kept at working size only, so that a generator of them needs less memory.
    """
    present = np.zeros(len(LABELS), np.bool_)
    small = []
    height = options.coarse if options.features == "patch" else options.height
    for pair in pairs:
        small.append(_working(pair, height))
        present[np.unique(small[-1].labels)] = True
    known = [i for i in range(1, len(LABELS)) if present[i]]
    if len(known) < 2 or len(small) < 2:
        raise InvalidInput("needs at least two pictures and two classes to train on")
    index = np.zeros(len(LABELS), np.uint8)
    index[known] = np.arange(1, len(known) + 1)
    small = [replace(pair, labels=index[pair.labels]) for pair in small]
    classes = tuple(LABELS[i] for i in known)
    about = f"{len(small)} pictures, {options.features}"
    if options.features == "patch":
        pictures = [(pair.picture, pair.labels) for pair in small]
        trees = train_forest(pictures, len(classes), options.forest, options.pixels, rng=rng)
        return Classifier("patch", classes, (trees,), height, height, options.forest.patch, about)
    (own,) = rng.spawn(1)
    stages = _stages(small, len(classes), options, rng)
    network = None
    if options.network.steps:
        network = _network(small, classes, options, own)
    fine = min(FINE, options.stages)
    return Classifier("context", classes, stages, height, options.coarse, 0, about, fine, network)


def _stages(
    pairs: Sequence[Pair], classes: int, options: TrainOptions, rng: np.random.Generator
) -> tuple[Trees, ...]:
    """Return the stages of trees of pairs at working size."""
    examples = list(_examples(pairs, options, rng))
    seed = int(rng.integers(2**31))

    def fit(boost: BoostOptions, codes: Sequence[Codes], labels: NDArray[np.intp]) -> Trees:
        weights = class_weights(labels, classes, options.balance)
        return train_boosted(codes, labels, weights, classes, boost, seed=seed)

    fine = min(FINE, options.stages)
    early = [partial(fit, options.early)] * (options.stages - fine)
    fits = early + [partial(fit, options.boost)] * fine
    return train_stages(examples, fits, options.pixels, rng=rng)


def _network(
    pairs: Sequence[Pair], classes: Sequence[str], options: TrainOptions, rng: np.random.Generator
) -> Network:
    """Return the network of pairs at working size, gone on from another where options say so."""
    views = [(pair.picture, pair.labels) for pair in pairs]
    settings, known, start = options.network, options.start, None
    if known is not None and known.network is not None:
        start = scores_for(known.network, known.classes, classes)
        settings = replace(settings, widths=start.widths)
    return train_network(views, classes, settings, rng=rng, start=start)


def _working(pair: Pair, height: int) -> Pair:
    picture = fitted(pair.picture, height, MAX_PIXELS)
    size = (picture.shape[1], picture.shape[0])
    labels = cv2.resize(pair.labels, size, interpolation=cv2.INTER_NEAREST).astype(np.uint8)
    return Pair(pair.name, picture, labels)


def _examples(
    pairs: Sequence[Pair], options: TrainOptions, rng: np.random.Generator
) -> Iterator[Example]:
    for number, pair in enumerate(pairs):
        fold = number % min(options.inner, len(pairs))
        yield example(pair.picture, pair.labels, options.coarse, fold)
        for _ in range(options.augment):
            yield example(*varied(pair.picture, pair.labels, rng=rng), options.coarse, fold)


def class_weights(labels: NDArray[np.intp], classes: int, balance: float) -> NDArray[np.float32]:
    """Return weights of pixels: (mean count / count of the class) ** balance."""
    counts = np.bincount(labels, minlength=classes).astype(np.float64)
    weight = (counts.mean() / np.maximum(counts, 1.0)) ** balance
    chosen: NDArray[np.float32] = weight.astype(np.float32)[labels]
    return chosen
