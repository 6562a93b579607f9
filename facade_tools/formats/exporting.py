"""The table of model formats, and several models in one file."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ..artifacts.building import Frame
from ..geometry.arrays import Floats
from ..geometry.mesh import Scene
from ..geometry.scenes import bounds, moved, shifts
from . import cityjson, gltf, obj
from .cityjson import CityModel

log = logging.getLogger("facade_tools.export")

FAR = 10_000.0  # m from the origin; beyond it 32-bit floats round to more than a millimetre
ENDINGS = {"glb": ".glb", "obj": ".obj", "cityjson": ".city.json"}

Part = TypeVar("Part", Scene, CityModel)


def model_files(
    parts: Sequence[Scene] | Sequence[CityModel], stem: str, form: str
) -> dict[str, bytes]:
    """Return the files of a model by name, the main one last.

    parts: Scenes, of the format `cityjson` CityModels. stem: the main file's name without ending.
    """
    if form == "cityjson":
        cities = [part for part in parts if isinstance(part, CityModel)]
        return {f"{stem}{ENDINGS[form]}": cityjson.write(cities, stem)}
    scenes = [part for part in parts if isinstance(part, Scene)]
    if form == "obj":
        return obj.write(scenes, stem)
    return {f"{stem}{ENDINGS[form]}": gltf.write(scenes, stem)}


def placed(parts: Sequence[Part], arrange: str, frames: Sequence[Frame | None] = ()) -> list[Part]:
    """Return the parts where they shall stand in one file.

    arrange: `own` leaves them; `auto` puts them back on the map where each has a frame (see
    `mapped`), else shifts them apart if any two overlap; `side-by-side` always does. Scenes that
    then stand over 10 km from the origin are moved to it, all by one step, with a warning.
    """
    return _near(_arranged(parts, arrange, frames))


def _arranged(parts: Sequence[Part], arrange: str, frames: Sequence[Frame | None]) -> list[Part]:
    if arrange == "own":
        return list(parts)
    known = [frame for frame in frames if frame is not None]
    if arrange == "auto" and len(known) == len(parts) and _is_map(known):
        return mapped(parts, known)
    steps = shifts([_bounds(part) for part in parts], always=arrange != "auto")
    return [_moved(part, np.eye(3), step) for part, step in zip(parts, steps, strict=True)]


def _near(parts: list[Part]) -> list[Part]:
    """Return scenes relative to the first one's low corner where 32-bit floats would round them."""
    boxes = np.array([_bounds(part) for part in parts if isinstance(part, Scene)])
    if np.abs(boxes).max(initial=0.0) <= FAR:
        return parts
    origin = _origin(boxes[0, 0])
    if np.abs(boxes - origin).max() > FAR:
        log.warning("models over 10 km apart: 32-bit floats round them; try side-by-side")
    if origin.any():
        place = ", ".join(f"{value:.0f}" for value in origin)
        name = parts[0].name
        log.warning("%s: too far from 0 for 32-bit floats; the model's origin is %s", name, place)
    return [_moved(part, np.eye(3), -origin) for part in parts]


def _origin(low: Floats) -> Floats:
    """Return the whole metres that bring a low corner to 0; heights mostly stay."""
    origin: Floats = np.floor(low) * (np.abs(low) > FAR)
    return origin


def near_origin(scene: Scene, step: Floats, origin: Floats | None) -> tuple[Scene, Floats]:
    """Return a scene shifted by `step` (m) as seen from an origin, and that origin.

    origin: of the scenes before it, that files of one folder fit together; None is 0. Where the
    scene stands over 10 km from it, it is a new one, with a warning.
    """
    origin = np.zeros(3) if origin is None else origin
    box = bounds(scene) + step
    if np.abs(box - origin).max() > FAR and (_origin(box[0]) != origin).any():
        origin = _origin(box[0])
        place = ", ".join(f"{value:.0f}" for value in origin)
        log.warning(
            "%s: too far from 0 for 32-bit floats; the origin of this and what follows is %s",
            scene.name,
            place,
        )
    return (moved(scene, np.eye(3), step - origin) if (step != origin).any() else scene), origin


def _is_map(frames: Sequence[Frame]) -> bool:
    """Tell places on one map from variants of one house, which all stand in one place."""
    places = len({frame.shift for frame in frames})
    return len({frame.crs for frame in frames}) == 1 and 2 * places > len(frames)


def mapped(parts: Sequence[Part], frames: Sequence[Frame]) -> list[Part]:
    """Return the parts turned and shifted from their local frames to the map that they came from.

    CityModels get the map's own coordinates and reference system. Scenes, which end in 32-bit
    floats, stand relative to the first one's place, and a single one stays as it is.
    """
    out: list[Part] = []
    origin = np.floor(frames[0].shift)
    for part, frame in zip(parts, frames, strict=True):
        if isinstance(part, CityModel):
            moved_part = _moved(part, _turn(frame.rotation), np.array(frame.shift))
            out.append(replace(moved_part, crs=frame.crs))
        elif len(parts) > 1:
            out.append(_moved(part, _turn(frame.rotation), np.array(frame.shift) - origin))
        else:
            out.append(part)
    return out


def _turn(degrees: float) -> Floats:
    angle = math.radians(degrees)
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def vertex_count(part: Scene | CityModel) -> int:
    """Return how many vertices a part holds, by which memory is bounded."""
    if isinstance(part, Scene):
        return sum(len(mesh.vertices) for mesh in part.meshes)
    return len(part.vertices)


def _bounds(part: Scene | CityModel) -> Floats:
    return bounds(part) if isinstance(part, Scene) else part.bounds()


def _moved(part: Part, turn: Floats, step: Floats) -> Part:
    if isinstance(part, Scene):
        return moved(part, turn, step)
    return replace(part, vertices=part.vertices @ turn.T + step)
