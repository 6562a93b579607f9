"""The body of `facade reconstruct`."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from facade_tools.artifacts.parse import Parse
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import RawItem
from facade_tools.errors import FacadeError, InvalidInput
from facade_tools.imaging.image_io import Photo, read_photo
from facade_tools.randomness import item_generator
from facade_tools.reconstruction.lots import Plot
from facade_tools.reconstruction.reconstruct import Ask, reconstruct

from ._items import each
from ._lots import by_id, ground_of, plots
from ._models import Made, Wanted, wanted, write_models
from ._options import StreamOptions, refuse_overwriting
from ._stream import Faults, side_input

NAME = "reconstruct"

log = logging.getLogger("facade_tools.reconstruct")


@dataclass(frozen=True)
class Maker:
    """Reconstructs one parse in any process. grounds: what parses stand on, by id."""

    ask: Ask
    grounds: Mapping[str, Plot]
    image: str | None
    seed: int
    recorded: Mapping[str, Any]
    sources: tuple[Source, ...]
    wanted: Wanted

    def __call__(self, item: RawItem) -> Made:
        """Return what is wanted of one parse; raises InvalidInput with its place."""
        parse = item.artifact(Parse)
        photo = self._photo(item, parse)
        rng = item_generator(self.seed, NAME, parse.id)
        ask = self.ask
        try:
            plot = ground_of(self.grounds, parse.id)
            lots = () if plot is None else plot.lots
            if plot is not None and plot.roof is not None:
                ask = replace(ask, hint=_known(plot.roof.style))
            made = reconstruct(parse, photo.pixels, lots, ask, rng=rng)
            inputs = (item.provenance(), Source(photo.name, photo.sha256), *self.sources)
            provenance = Provenance(NAME, self.seed, self.recorded, inputs)
            frame = None if plot is None else plot.frame
            more: dict[str, Any] = {"frame": frame, "provenance": provenance}
            return Made(
                parse.id,
                replace(made.building(), **more) if self.wanted.building else None,
                made.scene() if self.wanted.scene else None,
                replace(made.tree(), **more) if self.wanted.tree else None,
                frame,
            )
        except InvalidInput as error:
            raise error.at(item.source, item.line) from None
        except FacadeError as error:
            raise type(error)(f"{item.source}: {parse.id}: {error}") from None

    def _photo(self, item: RawItem, parse: Parse) -> Photo:
        """Return the picture of a parse, from --image or from beside the parse."""
        name = Path(parse.image.name).name
        beside = Path() if item.source == "-" else Path(item.source).parent
        path = beside / name if self.image is None else Path(self.image)
        if path.is_dir():
            path /= name
        if not path.is_file():
            message = f"its picture {str(path)!r} is not there; name it with --image"
            raise InvalidInput(message, pointer="/image/name").at(item.source, item.line)
        photo = read_photo(str(path))
        if photo.sha256 != parse.image.sha256:
            log.warning("%s: %s is not the file that was parsed", parse.id, path.name)
        return photo


def _known(style: str) -> str:
    return style if style in ("flat", "gable", "hip", "mansard") else "hip"


def run_reconstruct(stream: StreamOptions, values: Mapping[str, Any]) -> None:
    """Reconstruct all parses and write them."""
    footprint, tree = values["footprint"], values["tree"]
    refuse_overwriting([*stream.inputs, footprint], [stream.output, tree])
    ask = Ask(
        values["storey_height"], values["height"], values["depth"], values["roof"],
        frozenset(values["party"]),
    )  # fmt: skip
    recorded = {
        name: values[name] for name in ("storey_height", "height", "depth", "roof", "metres")
    }
    recorded["party"] = sorted(values["party"])
    sources = side_input(footprint)
    grounds = {} if footprint is None else by_id(plots(footprint, values["metres"]), footprint)
    maker = Maker(
        ask, grounds, values["image"], stream.seed or 0, recorded, sources,
        wanted(stream.output, tree),
    )  # fmt: skip
    faults = Faults(NAME, stream.on_error)
    write_models(each(maker, stream, faults), (stream.output, tree), faults)
    faults.complain()
