"""The pixel classifier: what it is made of, how it is applied and kept (npz without pickles)."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.store import unreadable
from ..errors import InvalidInput
from ..imaging.features import Picture, blurred
from ..imaging.features_context import Probabilities, repeated
from ..imaging.image_io import fitted
from .autocontext import run_stages
from .network import Network
from .patches import patch_codes, patch_tests
from .trees import Trees

FORMAT = "facade-tools/classifier/1"
MAX_BYTES = 256 << 20
MAX_NODES = 20_000_000
MAX_CLASSES = 100
MAX_PIXELS = 400_000  # at working resolution
KINDS = ("context", "patch")
NETWORK = "network."  # before the names of its arrays
ZOOM = 1.18  # of the picture that the network sees
SURE = np.float32(0.95)  # where the network believes this, the last stages are not asked
TRUST = np.float32(0.7)  # in the network, the rest in the trees
DOUBT = np.float32(1e-4)  # of any belief
ALIKE = np.float32(0.1)  # what alike columns, and alike rows, count in a belief
SMOOTH = 1 / 480  # of the working picture's rows

_ARRAYS = {
    "feature": (np.int16, 1), "threshold": (np.uint8, 1), "child": (np.int32, 1),
    "value": (np.float16, 2), "root": (np.int32, 1), "depth": (np.int16, 1),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Classifier:
    """Stages of trees over pixel features.

    kind: `context` (features of the picture, then of the beliefs too) or `patch` (the paper's
    forest). height: rows of the working resolution. coarse: rows at which all stages but the last
    `fine` ones look at the picture. patch: side of the patches. about: free notes. network: what
    is asked beside the stages of context; its belief counts more than theirs.
    """

    kind: str
    classes: tuple[str, ...]
    stages: tuple[Trees, ...]
    height: int
    coarse: int
    patch: int = 0
    about: str = ""
    fine: int = 1
    network: Network | None = None

    def working(self, picture: Picture) -> Picture:
        """Return a picture at the resolution that the classifier works at."""
        return fitted(picture, self.height, MAX_PIXELS)

    def probabilities(self, working: Picture) -> Probabilities:
        """Return class probabilities (classes, height, width) of a picture at working size.

        Stages of context are asked about the picture and its mirror image: facades have no side.
        Their belief is smoothed a little: single pixels are worth less than their neighbours.
        """
        if self.kind == "context":
            return self._both_ways(working)
        codes = patch_codes(working, patch_tests(self.patch))
        shares = self.stages[0].scores(codes)
        shares /= np.maximum(shares.sum(axis=1, keepdims=True), np.float32(1e-9))
        return np.ascontiguousarray(shares.T).reshape(-1, *working.shape[:2])

    def _both_ways(self, working: Picture) -> Probabilities:
        mirrored = np.ascontiguousarray(working[:, ::-1])
        with ThreadPoolExecutor(2) as pool:  # compiled loops let go of the interpreter
            one, other = pool.map(self._asked, (working, mirrored))
        means = [(a + b[:, :, ::-1]) / np.float32(2) for a, b in zip(one, other, strict=True)]
        belief = means[0] if len(means) == 1 else _agreed(_joined(*means))
        return np.stack([blurred(plane, SMOOTH * len(plane)) for plane in belief])

    def _asked(self, picture: Picture) -> list[Probabilities]:
        """Return the belief of the stages, and that of the network if there is one."""
        if self.network is None:
            return [run_stages(self.stages, picture, self.coarse, self.fine)]
        seen = _zoomed(self.network, picture)
        told = seen.max(axis=0) >= SURE
        return [run_stages(self.stages, picture, self.coarse, self.fine, told), seen]


def _zoomed(network: Network, picture: Picture) -> Probabilities:
    """Return a network's belief about the picture enlarged: borders are found more exactly."""
    height, width = picture.shape[:2]
    large = (round(width * ZOOM), round(height * ZOOM))
    seen = cv2.resize(picture, large, interpolation=cv2.INTER_LINEAR).astype(np.uint8)
    return np.stack([cv2.resize(p, (width, height)) for p in network.probabilities(seen)])


def _joined(trees: Probabilities, network: Probabilities) -> Probabilities:
    """Return the geometric mean of two beliefs: what either excludes is not believed in."""
    logs = (1 - TRUST) * np.log(trees + DOUBT) + TRUST * np.log(network + DOUBT)
    mean: Probabilities = np.exp(logs)
    mean /= mean.sum(axis=0)
    return mean


def _agreed(belief: Probabilities) -> Probabilities:
    """Return a belief drawn a little towards those of alike columns and of alike rows."""
    columns, rows, _ = repeated(belief)
    drawn: Probabilities = (1 - 2 * ALIKE) * belief + ALIKE * (columns + rows)
    return drawn


def save(classifier: Classifier) -> bytes:
    """Return the bytes of a classifier's file; the same classifier always gives the same."""
    arrays: dict[str, NDArray[Any]] = {
        "format": np.array(FORMAT),
        "kind": np.array(classifier.kind),
        "classes": np.array(classifier.classes),
        "height": np.array(classifier.height),
        "coarse": np.array(classifier.coarse),
        "patch": np.array(classifier.patch),
        "fine": np.array(classifier.fine),
        "about": np.array(classifier.about),
    }
    for number, trees in enumerate(classifier.stages):
        for name, (kind, _) in _ARRAYS.items():
            arrays[f"{name}{number}"] = getattr(trees, name).astype(kind)
    if classifier.network is not None:
        arrays["widths"] = np.array(classifier.network.widths)
        for name, weights in classifier.network.weights.items():
            arrays[NETWORK + name] = weights.astype(np.float16)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, array in arrays.items():
            body = io.BytesIO()
            np.lib.format.write_array(body, array, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0)), body.getvalue(),
                             zipfile.ZIP_DEFLATED)  # fmt: skip
    return out.getvalue()


def load(path: str) -> Classifier:
    """Return the classifier of a file. Raises InvalidInput on what is none."""
    try:
        data = Path(path).read_bytes() if Path(path).stat().st_size <= MAX_BYTES else None
    except OSError as error:
        raise unreadable(path, error) from None
    if data is None:
        raise InvalidInput(f"is larger than {MAX_BYTES >> 20} MiB; expected a classifier").at(path)
    try:
        return decoded(data)
    except InvalidInput as error:
        raise error.at(path) from None


def default() -> Classifier:
    """Return the classifier that ships with the tool, trained on rendered facades only."""
    path = resources.files("facade_tools.segmentation").joinpath("default.npz")
    return decoded(path.read_bytes())


def decoded(data: bytes) -> Classifier:
    """Return the classifier of a file's bytes, every array checked.

    Raises InvalidInput on what is none.
    """
    arrays = _arrays(data)
    try:
        if str(arrays["format"]) != FORMAT:
            raise InvalidInput(f"is {str(arrays['format'])[:40]!r}; expected {FORMAT}")
        kind = str(arrays["kind"])
        numbers = ("height", "coarse", "patch", "fine")
        height, coarse, patch, fine = (int(arrays[name]) for name in numbers)
        classes = tuple(str(name) for name in np.atleast_1d(arrays["classes"]))
        about = str(arrays["about"])
        count = sum(name.startswith("feature") for name in arrays)
        stages = tuple(_stage(arrays, i, len(classes)) for i in range(count))
        network = _network(arrays, len(classes)) if "widths" in arrays else None
    except KeyError as error:
        raise InvalidInput(f"has no array {error}; expected a classifier") from None
    except (TypeError, ValueError):
        raise InvalidInput("holds arrays of other types; expected a classifier") from None
    if kind not in KINDS or not stages or not 1 < len(classes) <= MAX_CLASSES:
        raise InvalidInput("is no classifier of a known kind")
    if not 16 <= coarse <= height <= 4096 or not 0 <= patch <= 101:
        raise InvalidInput("has a working resolution out of range")
    if not 1 <= fine <= min(2, len(stages)):
        raise InvalidInput("has a number of fine stages out of range")
    return Classifier(kind, classes, stages, height, coarse, patch, about, fine, network)


def _arrays(data: bytes) -> dict[str, NDArray[Any]]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > MAX_BYTES:
                raise InvalidInput(f"unpacks to more than {MAX_BYTES >> 20} MiB")
        with np.load(io.BytesIO(data), allow_pickle=False) as loaded:
            return {name: loaded[name] for name in loaded.files}
    except (zipfile.BadZipFile, OSError, ValueError, EOFError, AttributeError):
        raise InvalidInput("is no npz archive of plain arrays; expected a classifier") from None


def _stage(arrays: Mapping[str, NDArray[Any]], number: int, classes: int) -> Trees:
    parts: dict[str, NDArray[Any]] = {}
    for name, (kind, dimensions) in _ARRAYS.items():
        array = arrays[f"{name}{number}"]
        if array.dtype != kind or array.ndim != dimensions or len(array) > MAX_NODES:
            raise InvalidInput(f"array {name}{number} has another type or shape")
        parts[name] = array
    _check(parts, number, classes)
    parts["value"] = parts["value"].astype(np.float32)
    return Trees(**parts, classes=classes)


def _network(arrays: Mapping[str, NDArray[Any]], classes: int) -> Network:
    """Return the network in a file. Raises InvalidInput on arrays of other names or shapes."""
    found = {
        name.removeprefix(NETWORK): a for name, a in arrays.items() if name.startswith(NETWORK)
    }
    for name, array in found.items():
        if array.dtype != np.float16 or not np.isfinite(array).all():
            raise InvalidInput(f"array {NETWORK}{name} does not hold finite half floats")
    widths = arrays["widths"].astype(np.int64)
    if widths.shape != (4,):
        raise InvalidInput("array widths does not hold four numbers")
    a, b, c, d = (int(width) for width in widths)
    weights = {name: array.astype(np.float32) for name, array in found.items()}
    return Network((a, b, c, d), classes, weights)


def _check(parts: Mapping[str, NDArray[Any]], number: int, classes: int) -> None:
    """Refuse arrays whose indices lead out of them: the compiled loop does not look."""
    count = len(parts["feature"])
    lengths = {len(parts[name]) for name in ("feature", "threshold", "child", "value")}
    inside = count > 0 and lengths == {count} and len(parts["root"]) == len(parts["depth"]) > 0
    if not inside or parts["value"].shape[1] not in (1, classes):
        raise InvalidInput(f"arrays of stage {number} have different lengths")
    child, leaf = parts["child"], parts["child"] == np.arange(count)
    top = np.where(leaf, child, child + 1)
    roots = parts["root"].astype(np.int64)
    ends = np.append(roots[1:], count)
    if roots[0] != 0 or (ends <= roots).any() or parts["feature"].min() < 0:
        raise InvalidInput(f"trees of stage {number} are out of order")
    last = np.repeat(ends, ends - roots)  # of the own tree
    bad = (child < np.arange(count) + ~leaf).any() or (top >= last).any()
    inner = child[~leaf]
    once = len(np.unique([inner, inner + 1])) == 2 * len(inner) == count - len(roots)
    if bad or not once or (parts["threshold"][leaf] != 255).any():
        raise InvalidInput(f"indices of stage {number} lead out of its arrays")
    if parts["depth"].min() < 0 or parts["depth"].max() > 64:
        raise InvalidInput(f"depths of stage {number} are out of range")
    if not np.isfinite(parts["value"]).all():
        raise InvalidInput(f"values of stage {number} are not finite")
