"""Samples of each style as whole buildings, for the report: masses, facades, pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..artifacts.attributes import Attributes
from ..artifacts.model import Model
from ..errors import FacadeError
from ..formats.png import write as write_png
from ..geometry.details import building_scene
from ..imaging.camera import View
from ..imaging.render import render
from ..randomness import item_generator
from .facadegen import generate_facades
from .massgen import generate_mass
from .samples import SampleOptions, sample_attributes

EACH = 2
SIZE = (300, 225)  # pixels
AZIMUTH, ELEVATION = 30.0, 16.0  # degrees


@dataclass(frozen=True, slots=True)
class StylePicture:
    """A sample of a style; png: its building rendered, None where no building was found for it."""

    style: int
    sample: Attributes
    png: bytes | None = None


def style_samples(model: Model, *, seed: int = 0) -> Iterator[StylePicture]:
    """Yield the first samples of every style."""
    for style in range(len(model.style)):
        options = SampleOptions(style=style, prefix=f"style {style}", neighbours=False)
        rng = item_generator(seed, "report", style)
        for sample in sample_attributes(model, EACH, rng=rng, options=options):
            yield StylePicture(style, sample)


def style_pictures(model: Model, *, seed: int = 0) -> Iterator[StylePicture]:
    """Yield them with their buildings: mass and facades as `massgen` and `facadegen` make them."""
    for one in style_samples(model, seed=seed):
        try:
            yield StylePicture(one.style, one.sample, building_png(one.sample, seed=seed))
        except FacadeError:
            yield one


def building_png(sample: Attributes, *, seed: int = 0) -> bytes:
    """Return the picture of a building made for an attribute vector, as PNG."""
    mass = next(generate_mass(sample, rng=item_generator(seed, "massgen", sample.id)))
    rng = item_generator(seed, "facadegen", sample.id)
    building = next(generate_facades(mass, rng=rng))
    view = View(azimuth=AZIMUTH, elevation=ELEVATION, size=SIZE)
    return write_png(render(building_scene(building), view))
