"""The body of `facade view`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any

import click
import numpy as np

from facade_tools.artifacts.store import RawItem, read_raw
from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import FacadeError, InvalidInput
from facade_tools.formats.gltf import write as write_glb
from facade_tools.formats.meshes import MESH_ENDINGS, read_scene
from facade_tools.formats.png import write as write_png
from facade_tools.geometry.mesh import Scene
from facade_tools.imaging.camera import View
from facade_tools.imaging.contact_sheet import SIDE_VIEWS, contact_sheet
from facade_tools.imaging.mass_views import mass_pictures
from facade_tools.imaging.page import Exhibit, page
from facade_tools.imaging.render import Picture, render

from ._items import each
from ._options import StreamOptions
from ._stream import Faults, to_stdout
from ._tables import DRAWINGS, WITH_FILES, load

MOST_PICTURES = 2000
LARGEST_PAGE = 256 << 20  # bytes of the items of a page
LARGE = (960, 720)  # pixels of the only picture
SMALL = (400, 300)  # of one of several


@dataclass(frozen=True)
class ViewOptions:
    """What the command line asks for."""

    azimuth: float
    elevation: float
    size: tuple[int, int] | None
    columns: int | None
    sides: bool
    mass: bool
    no_labels: bool


@dataclass(frozen=True)
class Drawing:
    """Makes what an item looks like: its name and a Scene or picture; pictures where asked for."""

    views: tuple[View, ...] = ()
    mass: bool = False

    def __call__(self, item: RawItem) -> tuple[str, Any]:
        """Return the item's id and its drawing, or its pictures from all views."""
        if Path(item.source).suffix.lower() in MESH_ENDINGS:
            name, drawn = Path(item.source).stem, read_scene(Path(item.source))
            return name, self.seen(drawn)
        artifact = item.artifact(*DRAWINGS)
        try:
            files = (Path(item.source).parent,) if artifact.kind in WITH_FILES else ()
            drawn = self.seen(load(DRAWINGS[artifact.kind])(artifact, *files))
            beside = self.beside(artifact)
            return artifact.id, drawn + beside if beside else drawn
        except InvalidInput as error:
            raise error.at(item.source, item.line) from None
        except FacadeError as error:
            raise type(error)(f"{artifact.id}: {error}") from None

    def beside(self, artifact: Any) -> list[Picture]:
        """Return what --mass adds to the picture of a building."""
        if not (self.mass and self.views and artifact.kind == "building"):
            return []
        return mass_pictures(artifact, self.views[0].size)

    def seen(self, drawing: Any) -> Any:
        """Return pictures of a drawing from the views; without views the drawing itself."""
        if not self.views:
            return drawing
        if not isinstance(drawing, Scene):
            return [drawing]
        return [render(drawing, view) for view in self.views]


def run_view(stream: StreamOptions, options: ViewOptions) -> None:
    """Draw all inputs to the output."""
    output = str(stream.output)
    ending = Path(output).suffix.lower()
    faults = Faults("view", stream.on_error)
    if ending in (".html", ".htm"):
        _emit(output, _page(stream, Path(output).stem, faults))
    elif ending == ".svg":
        _emit(output, _vectors(stream))
    elif ending == ".png" or output == "-":
        _emit(output, write_png(_sheet(stream, options, faults)))
    else:
        raise click.UsageError(f"{output}: unknown ending; expected .png, .html or .svg (layouts).")
    faults.complain()


def _vectors(stream: StreamOptions) -> bytes:
    """Return the drawing of one layout, or of several on one sheet, as SVG."""
    from facade_tools.layering.drawing import sheet_bytes

    layouts = []
    for item in islice(read_raw(stream.inputs), MOST_PICTURES + 1):
        layouts.append(item.artifact("layout"))
    if not 0 < len(layouts) <= MOST_PICTURES:
        raise InvalidInput(f"expected 1 to {MOST_PICTURES} layouts for a .svg drawing")
    return sheet_bytes(layouts, ".svg")


def _emit(output: str, data: bytes) -> None:
    if output == "-":
        to_stdout("", data)
    else:
        write_bytes(Path(output), data)


def _shown(path: str) -> str:
    """Return the sheet of a style's folder, which shows its blocks too; any other path itself."""
    sheet = Path(path) / "stylesheet.json"
    return str(sheet) if sheet.is_file() else path


def _sheet(stream: StreamOptions, options: ViewOptions, faults: Faults) -> Picture:
    stream = replace(stream, inputs=tuple(map(_shown, stream.inputs)))
    pictures: list[Picture] = []
    labels: list[str] = []
    for name, seen in _rendered(stream, options, faults):
        pictures += seen
        labels += _labels(name, len(seen), options)
        if len(pictures) > MOST_PICTURES:
            raise InvalidInput(f"more than {MOST_PICTURES} pictures; draw fewer items at a time")
    if len(pictures) == 1:
        return pictures[0]
    columns = options.columns or (4 if options.sides else 3 if options.mass else None)
    return contact_sheet(pictures, [] if options.no_labels else labels, columns)


def _labels(name: str, count: int, options: ViewOptions) -> list[str]:
    """Return the labels of one item's pictures."""
    sides = [f"{name} {side}" for side in SIDE_VIEWS] if options.sides else [name]
    return [*sides, "boxes", "mass energy"][:count] if count > 1 else [name]


def _rendered(stream: StreamOptions, options: ViewOptions, faults: Faults) -> Any:
    """Yield id and pictures of each item; a single item gets the larger picture."""
    items = read_raw(stream.inputs)
    first = list(islice(items, 2))
    alone = len(first) == 1 and not (options.sides or options.mass)
    views = _views(options, options.size or (LARGE if alone else SMALL))
    return each(Drawing(views, options.mass), stream, faults, chain(first, items))


def _views(options: ViewOptions, size: tuple[int, int]) -> tuple[View, ...]:
    azimuths = list(SIDE_VIEWS.values()) if options.sides else [options.azimuth]
    return tuple(View(azimuth, options.elevation, size) for azimuth in azimuths)


def _page(stream: StreamOptions, title: str, faults: Faults) -> bytes:
    exhibits: list[Exhibit] = []
    size = 0
    for name, drawn in each(Drawing(), stream, faults):
        if isinstance(drawn, Scene):
            exhibits.append(Exhibit(name, "model", write_glb([drawn], name)))
        else:
            exhibits.append(Exhibit(name, "picture", write_png(np.asarray(drawn))))
        size += len(exhibits[-1].data)
        if size > LARGEST_PAGE:
            raise InvalidInput(f"a page of more than {LARGEST_PAGE >> 20} MiB; draw fewer items")
    return page(exhibits, title)
