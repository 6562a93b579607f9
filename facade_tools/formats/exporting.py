"""The table of model formats, and several models in one file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from ..geometry.arrays import Floats
from ..geometry.mesh import Scene
from ..geometry.scenes import bounds, moved, shifts
from . import cityjson, gltf, obj
from .cityjson import CityModel

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


def placed(parts: Sequence[Part], arrange: str) -> list[Part]:
    """Return the parts where they shall stand: `own`, `side-by-side`, or `auto` (see shifts)."""
    if arrange == "own":
        return list(parts)
    steps = shifts([_bounds(part) for part in parts], always=arrange != "auto")
    return [_moved(part, step) for part, step in zip(parts, steps, strict=True)]


def _bounds(part: Scene | CityModel) -> Floats:
    return bounds(part) if isinstance(part, Scene) else part.bounds()


def _moved(part: Part, step: Floats) -> Part:
    if isinstance(part, Scene):
        return moved(part, step.tolist())
    return replace(part, vertices=part.vertices + step)
