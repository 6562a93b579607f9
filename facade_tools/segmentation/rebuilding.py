"""Training pictures rebuilt: windows in ground floors, attics moved against the floors.

Where shops are the rule, a few ground floors with windows do not outweigh what lies there in all
other pictures; where dormers stand above the windows of the floors, so they are expected. Rebuilt
pictures show that what a thing looks like tells more than where it lies.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ..imaging.features import Picture
from .autocontext import Labels
from .evaluation import LEAST_AREA, boxes_of_mask

GROUND, ATTIC = 0.35, 0.6  # shares of pictures whose ground floor, whose attic is rebuilt
SHOPS = 0.5  # share of the shops of such a ground floor that become wall with windows
SHOP_LEAST = 200  # pixels of a shop
ALIKE = (0.6, 2.0)  # areas of windows that are copied, median areas
PURE = 0.97  # share of wall in a column of pixels of a sample of wall
NARROW = 5  # pixels, the least width of such a sample
TRIES = 12  # windows beside which it is looked for
ASIDE, WIDER = 0.15, (0.8, 1.25)  # attics are moved by widths, stretched by factors
RAISED = 0.7  # share of moved attics that are made lower or higher
TALLER = (-1.1, 0.3)  # logarithm of the factor of their height


class Box(NamedTuple):
    """Pixels x0 to x1 and y0 to y1, half-open."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width(self) -> int:
        """Columns."""
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        """Rows."""
        return self.y1 - self.y0

    def of(self, plane: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the part of a picture or label map."""
        return plane[self.y0 : self.y1, self.x0 : self.x1]


def rebuilt(
    picture: Picture, labels: Labels, classes: Sequence[str], *, rng: np.random.Generator
) -> tuple[Picture, Labels]:
    """Return a picture and its labels (0 ignored, or class + 1), a share of them rebuilt.

    Without shops, windows and walls, or without roofs, the parts that need them stay as they are.
    """
    number = {name: place for place, name in enumerate(classes, 1)}
    if rng.random() < GROUND and {"window", "wall", "shop"} <= number.keys():
        glass, wall, shop = (number[name] for name in ("window", "wall", "shop"))
        picture, labels = with_ground_windows(picture, labels, (glass, wall, shop), rng=rng)
    if rng.random() < ATTIC and "roof" in number:
        picture, labels = with_attic_moved(picture, labels, number["roof"], rng=rng)
    return picture, labels


def with_ground_windows(
    picture: Picture, labels: Labels, numbers: tuple[int, int, int], *, rng: np.random.Generator
) -> tuple[Picture, Labels]:
    """Return a picture some of whose shops are wall with windows of the floors above.

    numbers: of windows, walls and shops in the labels. What stays of a shop below is ignored (0).
    """
    glass, wall, shop = numbers
    windows = _usual(_boxes(labels == glass, LEAST_AREA))
    shops = [box for box in _boxes(labels == shop, SHOP_LEAST) if rng.random() < SHOPS]
    if not windows or not shops:
        return picture, labels
    site = _Site(picture.copy(), labels.copy(), glass, wall, shop)
    for box in shops:
        sample = _wall_sample(site.labels == wall, windows, rng)
        if sample is not None:
            standing = site.walled(box, sample, rng)
            for place in _row(standing, windows, rng):
                site.glaze(place, windows[int(rng.integers(len(windows)))], rng)
    return site.picture, site.labels


def _boxes(mask: NDArray[np.bool_], least: int) -> list[Box]:
    """Return the boxes of the connected parts of a mask of at least so many pixels."""
    return [Box(*(int(side) for side in box)) for box in boxes_of_mask(mask, least)]


def _usual(windows: Sequence[Box]) -> list[Box]:
    """Return the windows of about the median area."""
    areas = np.array([box.width * box.height for box in windows], float)
    low, high = ALIKE
    middle = np.median(areas) if len(areas) else 0.0
    return [w for w, area in zip(windows, areas, strict=True) if low < area / middle < high]


def _wall_sample(
    wall: NDArray[np.bool_], windows: Sequence[Box], rng: np.random.Generator
) -> Box | None:
    """Return a piece of wall beside a window, as high as it; None where there is none."""
    for place in rng.permutation(len(windows))[:TRIES]:
        window = windows[place]
        pure = wall[window.y0 : window.y1].mean(axis=0) > PURE
        right = _first_false(pure[window.x1 + 2 :])
        left = _first_false(pure[: max(window.x0 - 2, 0)][::-1])
        if max(left, right) >= NARROW:
            start = window.x1 + 2 if right >= left else window.x0 - 2 - left
            return Box(start, window.y0, start + max(left, right), window.y1)
    return None


def _first_false(row: NDArray[np.bool_]) -> int:
    return int(np.argmin(row)) if not row.all() else len(row)


@dataclass(frozen=True, slots=True)
class _Site:
    """A picture and its labels, which change in place. glass, wall, shop: numbers in the labels."""

    picture: Picture
    labels: Labels
    glass: int
    wall: int
    shop: int

    def walled(self, box: Box, sample: Box, rng: np.random.Generator) -> Box:
        """Lay wall over a shop but for its foot (cars, passers-by); return the wall's box."""
        hidden = int(box.height * rng.uniform(0, 0.3)) if rng.random() < 0.7 else 0
        over = box._replace(y1=box.y1 - hidden)
        stones = sample.of(self.picture)
        more = (max(over.height - sample.height, 0), max(over.width - sample.width, 0))
        laid = np.pad(stones, ((0, more[0]), (0, more[1]), (0, 0)), mode="symmetric")
        laid = laid[: over.height, : over.width]
        if rng.random() < 0.6:
            paint = rng.uniform(0.75, 1.3) + rng.uniform(-0.05, 0.05, 3)
            laid = np.clip(laid * paint, 0, 255).astype(np.uint8)
        inside = over.of(self.labels) == self.shop
        over.of(self.picture)[inside] = laid[inside]
        over.of(self.labels)[inside] = self.wall
        rest = box._replace(y0=over.y1).of(self.labels)
        rest[rest == self.shop] = 0
        return over

    def glaze(self, place: Box, donor: Box, rng: np.random.Generator) -> None:
        """Copy a window with its frame to a place, and lay a sill below."""
        frame, sill = int(rng.integers(1, 4)), int(rng.integers(1, 4))
        height, width = self.labels.shape
        framed = Box(
            max(donor.x0 - frame, 0),
            max(donor.y0 - frame, 0),
            min(donor.x1 + frame, width),
            donor.y1,
        )
        wide, high = place.width / donor.width, place.height / donor.height
        aside, above = round(frame * wide), round(frame * high)
        onto = Box(place.x0 - aside, place.y0 - above, place.x1 + aside, place.y1)
        if onto.x0 < 0 or onto.y0 < 0 or onto.x1 > width or onto.y1 > height:
            return
        seen = framed.of(self.picture)
        if rng.random() < 0.5:
            seen = seen[:, ::-1]
        size = (onto.width, onto.height)
        onto.of(self.picture)[:] = cv2.resize(seen, size, interpolation=cv2.INTER_AREA)
        place.of(self.labels)[:] = self.glass
        ledge = onto._replace(y0=place.y1, y1=min(place.y1 + sill, height)).of(self.picture)
        ledge[:] = np.clip(ledge.astype(np.int64) + rng.integers(-30, 60), 0, 255)


def _row(wall: Box, windows: Sequence[Box], rng: np.random.Generator) -> Iterator[Box]:
    """Yield the places of a row of windows in a wall, some left out."""
    usual_width, usual_height = np.median([(box.width, box.height) for box in windows], axis=0)
    zoom = rng.uniform(0.9, 1.25)
    width = int(usual_width * zoom * rng.uniform(0.9, 1.2))
    height = int(min(usual_height * zoom * rng.uniform(0.8, 1.2), 0.75 * wall.height))
    pitch = width * rng.uniform(1.25, 2.5)
    count = int((wall.width - 0.2 * width) // max(pitch, 1))
    below = max(0.9 * wall.height - height, 0)
    top = wall.y0 + int(0.04 * wall.height + 0.6 * rng.uniform() * below)
    left = wall.x0 + (wall.width - (count - 1) * pitch - width) / 2
    for place in range(count):
        x = int(left + place * pitch)
        window = Box(x, top, x + width, min(top + height, wall.y1))
        if rng.random() > 0.1 and window.width > 1 and window.height > 1:
            yield window


def with_attic_moved(
    picture: Picture, labels: Labels, roof: int, *, rng: np.random.Generator
) -> tuple[Picture, Labels]:
    """Return a picture whose roof, and what is above it, is another part of its own.

    The attic is mirrored or not, stretched and moved across, often pressed or raised; the floors
    below stay. roof: its number in the labels.
    """
    rows = np.flatnonzero((labels == roof).any(axis=1))
    height, width = labels.shape
    eaves = int(rows[-1]) + 1 if len(rows) else 0
    if not 8 <= eaves <= height / 2:
        return picture, labels
    stretch = rng.uniform(*WIDER) * rng.choice([-1.0, 1.0])
    shift = rng.uniform(-ASIDE, ASIDE) * width
    taller = np.exp(rng.uniform(*TALLER)) if rng.random() < RAISED else 1.0
    x = np.abs((np.arange(width) - width / 2) * stretch + width / 2 + shift)
    x = np.clip(np.where(x > width - 1, 2 * (width - 1) - x, x), 0, width - 1)
    y = np.clip(eaves - 0.5 - (eaves - 0.5 - np.arange(eaves)) / taller, 0, eaves - 1)
    across, down = (grid.astype(np.float32) for grid in np.meshgrid(x, y))
    picture, labels = picture.copy(), labels.copy()
    picture[:eaves] = cv2.remap(picture[:eaves], across, down, cv2.INTER_LINEAR)
    labels[:eaves] = cv2.remap(labels[:eaves], across, down, cv2.INTER_NEAREST)
    return picture, labels
