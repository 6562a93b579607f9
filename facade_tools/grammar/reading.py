"""What every method of reading a photograph takes and gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS, Parse
from ..errors import InvalidInput
from ..imaging.image_io import Photo


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """What a method is built from: a classifier's file, a grammar's name or file, the solver.

    height, storey_height: metres, of the building to the top of its roof and of a storey.
    """

    classifier: str | None = None
    grammar: str | None = None
    solver: str = "dp"
    height: float | None = None
    storey_height: float | None = None


@dataclass(frozen=True, slots=True)
class Reading:
    """A parse, the label map of its regions, and the beliefs' own, in pixels of the picture."""

    parse: Parse
    labels: NDArray[np.uint8]
    raw: NDArray[np.uint8]


class Method(Protocol):
    """Reads one rectified photograph; `mask` is true where something hides the facade."""

    def __call__(
        self,
        photo: Photo,
        identity: str,
        *,
        rng: np.random.Generator,
        mask: NDArray[np.bool_] | None = None,
    ) -> Reading:
        """Return the reading. Raises Infeasible where no derivation fits the picture."""
        ...


# A method that can be told what another one believes of windows, 0..1, of any size, None: nothing
Informed = Callable[[NDArray[np.float32] | None], Method]


def check_mask(mask: NDArray[np.bool_], shape: tuple[int, ...]) -> None:
    """Raise InvalidInput unless a mask is as large as its picture: (height, width, ...)."""
    if mask.shape != shape[:2]:
        (height, width), (rows, columns) = mask.shape, shape[:2]
        message = f"the mask has {width}×{height} pixels, the picture {columns}×{rows}"
        raise InvalidInput(f"{message}; expected the same")


def shrunk_mask(
    mask: NDArray[np.bool_], shape: tuple[int, ...], working: tuple[int, ...]
) -> NDArray[np.bool_]:
    """Return a mask of a picture of `shape` at working size: true where it hides more than half.

    Raises InvalidInput where the mask has another size than the picture.
    """
    check_mask(mask, shape)
    area = cv2.resize(mask.astype(np.float32), working[1::-1], interpolation=cv2.INTER_AREA)
    hidden: NDArray[np.bool_] = area > 0.5
    return hidden


def label_index() -> dict[str, int]:
    """Return the index of each label in label maps."""
    return {name: i for i, name in enumerate(LABELS)}
