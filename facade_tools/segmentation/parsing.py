"""A photograph to its parse: beliefs of pixels, search of the grammar, regions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS, ImageInfo, Parse
from ..errors import Infeasible, InvalidInput
from ..grammar.derivation import painted
from ..grammar.library import DEFAULT
from ..grammar.library import load as load_grammar
from ..grammar.plan import Plan
from ..grammar.plan import plan as make_plan
from ..grammar.reading import Informed, Method, Reading, ReadOptions, label_index, shrunk_mask
from ..imaging.features_context import Probabilities
from ..imaging.image_io import Photo
from . import dp, walk
from .bare_roofs import Seen
from .classifier import Classifier, default
from .classifier import load as load_classifier
from .deriving import Frame, floors_of, regions_of, with_confidence
from .energy import check_labels, field_of
from .finishing import finished
from .railings import WINDOW
from .second_opinion import agreement, doubt, exposed, moved

PLAIN = "plain"  # the shipped grammar of the fewest labels
PROBE = 32  # pixels a side
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class Reader:
    """Everything that reading a picture needs, the same for all pictures.

    second: another method, which is told the belief in windows; its own count as far as the
    classifier doubts.
    """

    classifier: Classifier
    plan: Plan
    solver: str = "dp"
    name: str = "default"
    second: Informed | None = None


Solver = Callable[..., dp.Solution]  # of a field and a plan, with rng

SOLVERS: Mapping[str, Solver] = {
    "dp": lambda field, plan, rng: dp.solve(field, plan),
    "walk": lambda field, plan, rng: walk.solve(field, plan, rng=rng),
}


def forest_method(options: ReadOptions, second: Informed | None = None) -> Method:
    """Return the method of TSKP10: a classifier believes, a grammar explains.

    second: another method, whose windows count as far as the classifier doubts.
    """
    classifier = default() if options.classifier is None else load_classifier(options.classifier)
    name = "default" if options.classifier is None else Path(options.classifier).name
    plan = compiled_plan(options.grammar or DEFAULT)
    _check_fit(classifier, plan, options)
    return partial(read_facade, Reader(classifier, plan, options.solver, name, second))


def _check_fit(classifier: Classifier, plan: Plan, options: ReadOptions) -> None:
    """Raise InvalidInput, before any picture, where classifier and grammar do not fit together.

    A classifier from a file is asked about a small picture too: it may want other features.
    """
    place = options.classifier or options.grammar or DEFAULT
    try:
        for name in classifier.classes:
            _index(name)
        if options.classifier is not None:
            classifier.probabilities(np.zeros((PROBE, PROBE, 3), np.uint8))
    except InvalidInput as error:
        raise error.at(place) from None
    try:
        check_labels(classifier.classes, plan)
    except InvalidInput as error:
        fits = set(compiled_plan(PLAIN).labels) <= set(classifier.classes)
        hint = f"; --grammar {PLAIN} fits" if fits else ""
        raise InvalidInput(error.message + hint).at(place) from None


def compiled_plan(name: str) -> Plan:
    """Return the plan of a shipped grammar or of a grammar's file."""
    try:
        return make_plan(load_grammar(name))
    except InvalidInput as error:
        raise error.at(name) from None


def read_facade(
    reader: Reader,
    photo: Photo,
    identity: str,
    *,
    rng: np.random.Generator,
    mask: NDArray[np.bool_] | None = None,
) -> Reading:
    """Return the parse of a rectified photograph.

    mask: (height, width), true where an occluder hides the facade; there every label is as good.
    Raises Infeasible where the picture is too small for the grammar.
    """
    working = reader.classifier.working(photo.pixels)
    belief = reader.classifier.probabilities(working)
    shape = photo.pixels.shape[:2]
    raw = raw_labels(belief, reader.classifier.classes, shape)
    tags: Mapping[str, object] = {}
    if reader.second is not None:
        weight = doubt(belief)
        belief = exposed(belief, reader.classifier.classes, working)
        second = reader.second(_windows(belief, reader.classifier.classes))
        other = _second_reading(second, photo, identity, rng, mask)
        if other is not None:
            classes = reader.classifier.classes
            tags = {
                **_scale(other),
                "agreement": round(agreement(belief, classes, other.labels), 3),
            }
            belief = moved(belief, classes, other.labels, weight)
    hidden = _hidden(mask, working.shape[:2], shape)
    belief = np.where(hidden, np.float32(1), belief)
    field = field_of(belief, reader.classifier.classes, reader.plan)
    solve = partial(SOLVERS[reader.solver], rng=rng)
    solution = solve(field, reader.plan)
    frame = Frame(working.shape[:2], shape)
    planes = dict(zip(reader.classifier.classes, belief, strict=True))
    seen = Seen(belief, reader.classifier.classes, hidden)
    tree = finished(reader.plan, solution.layout, seen, frame, solve)
    regions = with_confidence(regions_of(tree), planes, frame)
    floors = floors_of(tree)
    parse = Parse(
        id=identity,
        image=ImageInfo(photo.name, (shape[1], shape[0]), photo.sha256),
        rectification=IDENTITY,
        method="forest" if reader.second is None else "both",
        solver=reader.solver,
        grammar=reader.plan.grammar.id,
        classifier=reader.name,
        energy=solution.energy,
        working=(working.shape[1], working.shape[0]),
        regions=regions,
        floors=floors,
        columns=max((floor.columns for floor in floors), key=len, default=()),
        bound=solution.bound,
        optimal=solution.optimal,
        trace=solution.trace,
        derivation=tree,
        tags=tags,
    )
    return Reading(parse, painted(tree, shape, label_index()), raw)


def _windows(belief: Probabilities, classes: tuple[str, ...]) -> NDArray[np.float32] | None:
    """Return the belief in windows, None where the classifier knows none."""
    return belief[classes.index(WINDOW)] if WINDOW in classes else None


def _second_reading(
    second: Method,
    photo: Photo,
    identity: str,
    rng: np.random.Generator,
    mask: NDArray[np.bool_] | None,
) -> Reading | None:
    """Return what another method reads, None where it has no solution of its own."""
    try:
        return second(photo, identity, rng=rng, mask=mask)
    except Infeasible:
        return None


def _scale(other: Reading) -> Mapping[str, object]:
    """Return the scale that another reading was told. One that it guessed says less than floors."""
    return {} if other.parse.tags.get("scale") == "relative" else other.parse.tags


def raw_labels(
    belief: Probabilities, classes: tuple[str, ...], shape: tuple[int, int]
) -> NDArray[np.uint8]:
    """Return the label map of the likeliest classes, beliefs interpolated to `shape`."""
    index = np.array([_index(name) for name in classes], np.uint8)
    size = (shape[1], shape[0])
    best = np.full(shape, -1.0, np.float32)
    out = np.zeros(shape, np.uint8)
    for name, plane in zip(index, belief, strict=True):
        larger = cv2.resize(plane, size, interpolation=cv2.INTER_LINEAR)
        better = larger > best
        best[better] = larger[better]
        out[better] = name
    return out


def _index(name: str) -> int:
    if name not in LABELS:
        raise InvalidInput(f"class {name!r} is no label of parses ({', '.join(LABELS[1:])})")
    return LABELS.index(name)


def _hidden(
    mask: NDArray[np.bool_] | None, working: tuple[int, ...], shape: tuple[int, ...]
) -> NDArray[np.bool_]:
    """Return where an occluder hides the facade at working size: nowhere without a mask."""
    if mask is None:
        return np.zeros(working, np.bool_)
    return shrunk_mask(mask, shape, working)
