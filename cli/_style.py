"""The bodies of `facade capture-style` and `facade retarget`."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from math import inf
from pathlib import Path

import click

from facade_tools.artifacts.blocks import Blocks
from facade_tools.artifacts.building import Building
from facade_tools.artifacts.layout import Layout
from facade_tools.artifacts.provenance import Provenance
from facade_tools.artifacts.store import RawItem, digest, read_raw
from facade_tools.artifacts.writing import atomic_folder
from facade_tools.errors import InvalidInput
from facade_tools.formats.exporting import model_files, near_origin
from facade_tools.formats.mesh_reader import ENDINGS, STATED, read_textured
from facade_tools.formats.style_folder import read_style, write_style
from facade_tools.formats.textured import TexturedMesh
from facade_tools.geometry.arrays import Floats
from facade_tools.randomness import item_generator
from facade_tools.stylization.bases import check_blocks, mesh_blocks
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.dressing import Base, Dressed, DressOptions, dressed
from facade_tools.stylization.model import CaptureOptions
from facade_tools.stylization.style import Style

from ._export import write_files
from ._items import each
from ._options import StreamOptions, refuse_overwriting
from ._stream import Faults, file_name, is_folder, new_file_name

log = logging.getLogger("facade_tools.capture_style")

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}


@dataclass(frozen=True)
class MeshOptions:
    """How a mesh was drawn whose format does not say it: its upward axis and its unit."""

    up: str
    unit: str

    def read(self, path: Path) -> TexturedMesh:
        """Return a mesh in metres. Raises InvalidInput for what the format says otherwise."""
        if (self.up, self.unit) != ("auto", "m") and path.suffix.lower() in STATED:
            raise InvalidInput("states its unit and its axis; expected no --unit and no --up").at(
                str(path)
            )
        mesh = read_textured(path)
        return replace(mesh, vertices=METRES[self.unit] * mesh.vertices)


def run_capture(model: str, output: str, options: CaptureOptions, unit: str) -> None:
    """Read a model, capture its style and write the sheet's folder."""
    mesh = MeshOptions(options.up, unit).read(Path(model))
    try:
        style = capture_style(mesh, file_name(Path(model).parent.name or "model"), options)
    except InvalidInput as error:
        raise error.at(model) from None
    recorded = {
        "front": options.front,
        "up": options.up,
        "bottom": options.bottom,
        "top": options.top,
        "window_size": options.window,
        "thickness": options.thickness,
        "unit": unit,
    }
    provenance = Provenance("capture-style", None, recorded, (digest(model),))
    sheet = replace(style.sheet, provenance=provenance)
    blocks = replace(style.blocks, provenance=provenance)
    for note in sheet.notes:
        log.warning("%s", note)
    with atomic_folder(Path(output)) as folder:
        write_style(folder, sheet, blocks, style.pictures)


def is_style(path: str) -> bool:
    """Tell whether a path is the folder of a style sheet: `--styles a/ b/ c/` names several."""
    return (Path(path) / "stylesheet.json").is_file()


@dataclass(frozen=True)
class Dresser:
    """Makes the model of a base in one of the styles, in any process."""

    styles: Sequence[Style]
    options: DressOptions
    seed: int
    meshes: MeshOptions

    def __call__(self, source: Source) -> tuple[str, Dressed]:
        """Return the base's id and its model; raises InvalidInput with the place of what is wrong.

        A mesh gets a bottom and a top as buildings do.
        """
        try:
            base, options = _base(source, self.meshes), self.options
            if isinstance(source, MeshFile):
                options = replace(options, ends=True)
            rng = item_generator(self.seed, "retarget", base.id)
            return base.id, dressed(base, self.styles, options, rng=rng)
        except InvalidInput as error:
            raise error.at(*_place(source)) from None


def run_retarget(
    styles: Sequence[str],
    stream: StreamOptions,
    resize: Sequence[str],
    small: float,
    meshes: MeshOptions,
) -> None:
    """Put styles onto all bases and write their models."""
    output = str(stream.output)
    refuse_overwriting([*styles, *stream.inputs], [output])
    sizes = dict(_size(text) for text in resize)
    form = _form(output)
    sources = _sources(stream.inputs)
    if not is_folder(output):
        sources = _single(sources, output)
    sheets = [_style(Path(folder)) for folder in styles]
    dresser = Dresser(sheets, DressOptions(sizes, small), stream.seed or 0, meshes)
    faults = Faults("retarget", stream.on_error)
    seen: dict[str, str] = {}
    origin: Floats | None = None
    for identity, made in each(dresser, stream, faults, sources):
        name = faults.guard(new_file_name, identity, seen)
        if name is None:
            continue
        scene, origin = near_origin(made.scene, made.shift, origin)
        folder, stem = (
            (Path(output), name) if is_folder(output) else (Path(output).parent, Path(output).stem)
        )
        write_files(folder, model_files([scene], stem, form))
    faults.complain()


def _style(folder: Path) -> Style:
    sheet, blocks, pictures = read_style(folder)
    try:
        check_blocks(blocks)
    except InvalidInput as error:
        raise error.at(str(folder / "blocks.json")) from None
    return Style(sheet, blocks, pictures)


def _form(output: str) -> str:
    form = "glb" if is_folder(output) else Path(output).suffix.lower().lstrip(".")
    if form not in ("glb", "obj"):
        raise click.UsageError(f"{output}: expected .glb, .obj or a folder")
    return form


def _size(text: str) -> tuple[str, tuple[float, float, float]]:
    match = re.fullmatch(r"(.+)=([\d.]+)x([\d.]+)x([\d.]+)", text)
    try:
        numbers = [float(part) for part in match.groups()[1:]] if match else []
    except ValueError:
        numbers = []
    if match is None or not numbers or not all(0 < n < inf for n in numbers):
        raise click.UsageError(f"--resize {text!r}: expected BLOCK=WIDTHxDEPTHxHEIGHT in metres")
    return match.group(1), (numbers[0], numbers[1], numbers[2])


@dataclass(frozen=True)
class MeshFile:
    """A mesh as a base, and its id."""

    path: Path
    id: str


Source = RawItem | MeshFile


def _sources(paths: Sequence[str]) -> Iterator[Source]:
    """Yield every base, unread; a mesh is named by its folder, or itself if others lie there."""
    meshes = [Path(path) for path in paths if Path(path).suffix.lower() in ENDINGS]
    folders = [path.parent.name for path in meshes]
    for path in paths:
        mesh = Path(path)
        if mesh not in meshes:
            yield from read_raw([path])
        elif folders.count(mesh.parent.name) > 1 or not mesh.parent.name:
            yield MeshFile(mesh, file_name(mesh.stem))
        else:
            yield MeshFile(mesh, file_name(mesh.parent.name))


def _single(sources: Iterator[Source], output: str) -> Iterator[Source]:
    """Return the sources; raises UsageError where there are several."""
    first = list(islice(sources, 2))
    if len(first) > 1:
        raise click.UsageError(f"{output}: several bases; name a folder")
    return iter(first)


def _place(source: Source) -> tuple[str, int | None]:
    if isinstance(source, MeshFile):
        return str(source.path), None
    return source.source, source.line


def _base(source: Source, meshes: MeshOptions) -> Base:
    if isinstance(source, MeshFile):
        return mesh_blocks(meshes.read(source.path), source.id, meshes.up)
    base: Base = source.artifact(Blocks, Building, Layout)
    return base
