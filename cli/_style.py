"""The bodies of `facade capture-style` and `facade retarget`."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path

import click

from facade_tools.artifacts.blocks import Blocks
from facade_tools.artifacts.building import Building
from facade_tools.artifacts.layout import Layout
from facade_tools.artifacts.provenance import Provenance
from facade_tools.artifacts.store import digest, read_raw
from facade_tools.artifacts.writing import atomic_folder, write_bytes
from facade_tools.errors import InvalidInput, OutputFailed
from facade_tools.formats.exporting import model_files
from facade_tools.formats.mesh_reader import ENDINGS, read_textured
from facade_tools.formats.style_folder import read_style, write_style
from facade_tools.randomness import item_generator
from facade_tools.stylization.bases import building_blocks, layout_blocks, mesh_blocks, with_ends
from facade_tools.stylization.capture import capture_style
from facade_tools.stylization.model import CaptureOptions
from facade_tools.stylization.pitched import crowned
from facade_tools.stylization.resizing import resized
from facade_tools.stylization.retarget import retarget
from facade_tools.stylization.structure import chosen_style
from facade_tools.stylization.style import Style

from ._report import Progress
from ._stream import file_name, is_folder

log = logging.getLogger("facade_tools.capture_style")

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "in": 0.0254}


def run_capture(model: str, output: str, options: CaptureOptions, unit: str) -> None:
    """Read a model, capture its style and write the sheet's folder."""
    mesh = read_textured(Path(model))
    mesh = replace(mesh, vertices=METRES[unit] * mesh.vertices)
    try:
        capture = capture_style(mesh, file_name(Path(model).parent.name or "model"), options)
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
    sheet = replace(capture.sheet, provenance=provenance)
    blocks = replace(capture.blocks, provenance=provenance)
    for note in sheet.notes:
        log.warning("%s", note)
    with atomic_folder(Path(output)) as folder:
        write_style(folder, sheet, blocks, capture.pictures)


def is_style(path: str) -> bool:
    """Tell whether a path is the folder of a style sheet: `--styles a/ b/ c/` names several."""
    return (Path(path) / "stylesheet.json").is_file()


def run_retarget(
    styles: Sequence[str],
    bases: Sequence[str],
    output: str,
    resize: Sequence[str],
    small: float,
    seed: int,
) -> None:
    """Put styles onto all bases and write their models."""
    sheets = [Style(*read_style(Path(folder))) for folder in styles]
    sizes = dict(_size(text) for text in resize)
    progress = Progress("retarget")
    seen: set[str] = set()
    for base, plain, building in _bases(bases):
        blocks = resized(base, sizes) if sizes else base
        rng = item_generator(seed, "retarget", base.id)
        style = chosen_style([s.sheet.blocks for s in sheets], blocks.blocks, rng=rng)
        chosen = sheets[style]
        if plain:
            blocks = with_ends(blocks, chosen.blocks)
        scene = retarget(chosen, blocks, small)
        if building is not None and not sizes:
            scene = crowned(scene, chosen, building)
        if base.id in seen and is_folder(output):
            raise InvalidInput(f"id {base.id!r} stands twice; expected unique ids in a folder")
        if seen and not is_folder(output):
            raise OutputFailed(f"{output}: several bases; name a folder")
        seen.add(base.id)
        stem, form, folder = _target(output, base.id)
        for name, data in model_files([scene], stem, form).items():
            write_bytes(folder / name, data)
        progress.advance()
    progress.close()


def _size(text: str) -> tuple[str, tuple[float, float, float]]:
    match = re.fullmatch(r"(.+)=([\d.]+)x([\d.]+)x([\d.]+)", text)
    try:
        numbers = [float(part) for part in match.groups()[1:]] if match else []
    except ValueError:
        numbers = []
    if match is None or not numbers or not all(0 < n < inf for n in numbers):
        raise click.UsageError(f"--resize {text!r}: expected BLOCK=WIDTHxDEPTHxHEIGHT in metres")
    return match.group(1), (numbers[0], numbers[1], numbers[2])


def _bases(paths: Sequence[str]) -> Iterator[tuple[Blocks, bool, Building | None]]:
    """Yield every base, whether it may be given a bottom and a top, and the building it is of."""
    for path in paths:
        if Path(path).suffix.lower() in ENDINGS:
            yield (
                mesh_blocks(read_textured(Path(path)), file_name(Path(path).parent.name)),
                True,
                None,
            )
            continue
        for item in read_raw([path]):
            artifact = item.artifact("blocks", "building", "layout")
            if isinstance(artifact, Blocks):
                yield artifact, False, None
            elif isinstance(artifact, Layout):
                yield layout_blocks(artifact), True, None
            else:
                yield building_blocks(artifact), True, artifact


def _target(output: str, identity: str) -> tuple[str, str, Path]:
    """Return stem, format and folder of a base's model."""
    if is_folder(output):
        folder, name = Path(output), f"{file_name(identity)}.glb"
    else:
        folder, name = Path(output).parent, Path(output).name
    form = Path(name).suffix.lower().lstrip(".")
    if form not in ("glb", "obj"):
        raise click.UsageError(f"{output}: expected .glb, .obj or a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFailed(f"{folder}: cannot be made: {error.strerror}") from error
    return Path(name).stem, form, folder
