"""Models that wait on disk, and the bounding boxes that find them: few bytes of memory each."""

from __future__ import annotations

import json
import tempfile
import weakref
from array import array
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..geometry.arrays import Floats, Integers, Points3
from .surfaces import Model, Surface, bounds

PlanBox = tuple[float, float, float, float]  # x0, y0, x1, y1


class ModelStore:
    """Models in a temporary file, by the order in which they came."""

    def __init__(self) -> None:
        """Open an empty store."""
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 (lives as long as the store)
        weakref.finalize(self, self._file.close)
        self._starts = array("Q")
        self._heads = array("L")

    def __len__(self) -> int:
        """Return how many models wait."""
        return len(self._starts)

    def add(self, model: Model) -> None:
        """Append a model, without an artifact stored with it."""
        points: list[Points3] = []
        head = json.dumps([_facts(model), *(_shape(p, points) for p in _lists(model))]).encode()
        self._starts.append(self._file.seek(0, 2))
        self._heads.append(len(head))
        self._file.write(head)
        self._file.write(np.int64(sum(map(len, points))).tobytes())
        for ring in points:
            self._file.write(np.ascontiguousarray(ring, dtype=np.float64).tobytes())

    def __getitem__(self, number: int) -> Model:
        """Return a model as it was added."""
        self._file.seek(self._starts[number])
        facts, parts, outside = json.loads(self._file.read(self._heads[number]))
        count = int(np.frombuffer(self._file.read(8), dtype=np.int64)[0])
        points = np.frombuffer(self._file.read(24 * count)).reshape(-1, 3)
        name, origin, crs, function, roof_types, storeys = facts
        reader = _Reader(points)
        return Model(
            name,
            reader.surfaces(parts),
            tuple(origin),
            crs,
            function,
            tuple(roof_types),
            storeys,
            reader.surfaces(outside),
        )


def _facts(model: Model) -> list[Any]:
    facts = [model.id, model.origin, model.crs, model.function, model.roof_types, model.storeys]
    return facts


def _lists(model: Model) -> tuple[Sequence[Sequence[Surface]], ...]:
    return model.parts, model.outside


def _shape(lists: Sequence[Sequence[Surface]], points: list[Points3]) -> list[Any]:
    """Return meaning, group and ring lengths of surfaces; their points go to `points`."""
    for surface in (surface for row in lists for surface in row):
        points += surface.rings
    return [[[s.meaning, s.group, [len(ring) for ring in s.rings]] for s in row] for row in lists]


class _Reader:
    """Takes rings off an array of points, in order."""

    def __init__(self, points: Points3) -> None:
        self.points = points
        self.place = 0

    def surfaces(self, lists: list[Any]) -> tuple[tuple[Surface, ...], ...]:
        return tuple(
            tuple(Surface(kind, tuple(map(self.ring, sizes)), group) for kind, group, sizes in row)
            for row in lists
        )

    def ring(self, size: int) -> Points3:
        self.place += size
        return self.points[self.place - size : self.place]


class PlanBoxes:
    """Bounding boxes in plan (x0, y0, x1, y1; metres), by reference system, for the search."""

    def __init__(self) -> None:
        """Start without boxes."""
        self._rows: dict[str, tuple[array[int], array[float]]] = {}
        self._sorted: dict[str, tuple[Integers, Floats, float]] = {}

    def add(self, number: int, crs: str, box: PlanBox) -> None:
        """Note a box under a number."""
        numbers, rows = self._rows.setdefault(crs, (array("q"), array("d")))
        numbers.append(number)
        rows.extend(box)

    def near(self, crs: str, box: PlanBox, distance: float) -> list[int]:
        """Return the numbers, ascending, of the boxes within a distance of a box."""
        if crs not in self._rows:
            return []
        if crs not in self._sorted:
            self._sorted[crs] = self._by_x(crs)
        numbers, rows, widest = self._sorted[crs]
        x0, y0, x1, y1 = box
        first, last = np.searchsorted(rows[:, 0], [x0 - distance - widest, x1 + distance])
        some = rows[first : last + 1]
        close = (some[:, 2] >= x0 - distance) & (some[:, 0] <= x1 + distance)
        close &= (some[:, 3] >= y0 - distance) & (some[:, 1] <= y1 + distance)
        return sorted(numbers[first : last + 1][close].tolist())

    def _by_x(self, crs: str) -> tuple[Integers, Floats, float]:
        numbers, flat = (np.array(values) for values in self._rows[crs])
        self._rows[crs] = (array("q"), array("d"))
        rows = flat.reshape(-1, 4)
        order = np.argsort(rows[:, 0], kind="stable")
        return numbers[order], rows[order], float(np.max(rows[:, 2] - rows[:, 0]))


def plan_box(model: Model) -> PlanBox:
    """Return x0, y0, x1, y1 of a model in its source's coordinates, metres."""
    low, high = bounds(model.surfaces)
    x, y = model.origin[:2]
    return float(low[0]) + x, float(low[1]) + y, float(high[0]) + x, float(high[1]) + y


class Numbers:
    """A set of small whole numbers, a bit each."""

    def __init__(self) -> None:
        """Start empty."""
        self._bits = bytearray()

    def add(self, number: int) -> None:
        """Put a number in."""
        self._bits.extend(bytes(max(number // 8 + 1 - len(self._bits), 0)))
        self._bits[number // 8] |= 1 << number % 8

    def __contains__(self, number: int) -> bool:
        """Tell whether a number is in."""
        return number // 8 < len(self._bits) and bool(self._bits[number // 8] >> number % 8 & 1)
