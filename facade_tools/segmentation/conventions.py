"""How public data sets name their classes, and their label maps in our labels."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..artifacts.parse import LABELS
from ..artifacts.store import unreadable
from ..errors import InvalidInput
from ..imaging.image_io import read_label_picture

MAX_BYTES = 1 << 20

Row = tuple[int, tuple[int, int, int], str]  # index, colour in the original maps, our label

CONVENTIONS: dict[str, tuple[Row, ...]] = {
    "ecp": (
        (0, (0, 0, 0), "void"), (1, (255, 0, 0), "window"), (2, (255, 255, 0), "wall"),
        (3, (128, 0, 255), "balcony"), (4, (255, 128, 0), "door"), (5, (0, 0, 255), "roof"),
        (6, (128, 255, 255), "sky"), (7, (0, 255, 0), "shop"), (8, (128, 128, 128), "chimney"),
    ),
    "cmp": (
        (0, (0, 0, 0), "void"), (1, (0, 0, 170), "void"), (2, (0, 0, 255), "wall"),
        (3, (0, 85, 255), "window"), (4, (0, 170, 255), "door"), (5, (0, 255, 255), "wall"),
        (6, (85, 255, 170), "wall"), (7, (170, 255, 85), "balcony"), (8, (255, 255, 0), "window"),
        (9, (255, 170, 0), "wall"), (10, (255, 85, 0), "wall"), (11, (255, 0, 0), "wall"),
        (12, (170, 0, 0), "shop"),
    ),
    "labelmefacade": (
        (0, (0, 0, 0), "void"), (1, (128, 0, 0), "wall"), (2, (128, 0, 128), "void"),
        (3, (128, 128, 0), "door"), (4, (128, 128, 128), "void"), (5, (128, 64, 0), "void"),
        (6, (0, 128, 128), "sky"), (7, (0, 128, 0), "void"), (8, (0, 0, 128), "window"),
    ),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Convention:
    """label[index] is our label's index (0: ignored); colors (n, 3) of the same indices."""

    label: NDArray[np.uint8]
    colors: NDArray[np.uint8]
    indices: NDArray[np.int64]

    def read(self, path: str) -> NDArray[np.uint8]:
        """Return a label map, of indices or colours, in our labels. Raises on unknown classes."""
        picture = read_label_picture(path)
        index = self._indexed(picture, path) if picture.ndim == 3 else picture.astype(np.int64)
        if int(index.max()) >= len(self.label):
            raise InvalidInput(f"holds index {int(index.max())}, which has no class").at(path)
        mapped: NDArray[np.uint8] = self.label[index]
        return mapped

    def _indexed(self, picture: NDArray[np.uint8], path: str) -> NDArray[np.int64]:
        keys = _key(picture)
        known = _key(self.colors)
        order = np.argsort(known)
        place = np.clip(np.searchsorted(known[order], keys), 0, len(known) - 1)
        if (known[order][place] != keys).any():
            y, x = np.argwhere(known[order][place] != keys)[0]
            color = tuple(int(v) for v in picture[y, x])
            raise InvalidInput(f"colour {color} at ({x}, {y}) belongs to no class").at(path)
        return self.indices[order][place]


def _key(colors: NDArray[np.uint8]) -> NDArray[np.int64]:
    wide = colors.astype(np.int64)
    return (wide[..., 0] << 16) | (wide[..., 1] << 8) | wide[..., 2]


def convention(name: str) -> Convention:
    """Return a named convention, or the one that a classes.json describes.

    Such a file holds `classes`: `{index, colour, common}`, where `common` is one of our labels or
    `void`. Raises InvalidInput on anything else.
    """
    if name in CONVENTIONS:
        return _made(CONVENTIONS[name])
    try:
        with Path(name).open("rb") as file:
            document = json.loads(file.read(MAX_BYTES))
        rows = [_row(entry) for entry in document["classes"]]
    except OSError as error:
        raise unreadable(name, error) from None
    except (ValueError, KeyError, TypeError, IndexError, OverflowError, RecursionError):
        rows = []
    if not rows:
        known = ", ".join(CONVENTIONS)
        message = f'expected {{"classes": [{{"index", "colour", "common"}}]}} or one of {known}'
        raise InvalidInput(message).at(name)
    for index, _, label in rows:
        if label not in (*LABELS[1:], "void") or not 0 <= index < 256:
            raise InvalidInput(f"index {index}: {label!r} is no label").at(name)
    return _made(tuple(rows))


def _row(entry: Any) -> Row:
    red, green, blue = (int(v) & 255 for v in entry["colour"])
    return int(entry["index"]), (red, green, blue), str(entry["common"])


def _made(rows: tuple[Row, ...]) -> Convention:
    label = np.zeros(max(row[0] for row in rows) + 1, np.uint8)
    for index, _, name in rows:
        label[index] = 0 if name == "void" else LABELS.index(name)
    colors = np.array([row[1] for row in rows], np.uint8)
    return Convention(label, colors, np.array([row[0] for row in rows], np.int64))
