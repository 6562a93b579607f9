"""The body of `facade layer-solve`."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.design import Design
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.layout import Layout
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.artifacts.provenance import Provenance
from facade_tools.artifacts.store import RawItem, read_raw
from facade_tools.errors import InvalidInput, Place
from facade_tools.layering.solve import solve_design, variations
from facade_tools.randomness import item_generator

from ._stream import open_sink

MAX_SWEEP = 1000
MAX_ASSET = 16 << 20
MEDIA = {".obj": "model/obj", ".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg"}


def run_layer_solve(path: str, output: str | None, seed: int, options: Mapping[str, Any]) -> None:
    """Solve a design on every canvas that the options ask for, and write the layouts."""
    canvases = _canvases(options["width"], options["height"])
    item = _only(path)
    drawn: list[Layout] = []
    try:
        design: Design = item.artifact("design")
        design = design if design.id else replace(design, id=_stem(path))
        recorded = {k: v for k, v in options.items() if k != "sheet" and v not in (None, False)}
        provenance = Provenance("layer-solve", seed, recorded, (item.provenance(),))
        with open_sink(output) as write:
            for layout in _layouts(design, canvases, seed, options):
                full = replace(layout, assets=_assets(path, layout), provenance=provenance)
                single = output is not None and Path(output).suffix == ".json"
                document = encode(full)
                write(full.id, dump_document(document) if single else dump_line(document))
                drawn.append(full)
    except InvalidInput as error:
        raise _with_line(error, item) from None
    if options["sheet"]:
        _write_sheet(str(options["sheet"]), drawn)


def _only(path: str) -> RawItem:
    items = list(read_raw([path]))
    if len(items) != 1:
        raise InvalidInput(f"holds {len(items)} documents; expected one design").at(path)
    item = items[0]
    return (
        replace(item, yaml=True)
        if path == "-" and not item.data.lstrip().startswith(b"{")
        else item
    )


def _stem(path: str) -> str:
    return "design" if path == "-" else Path(path).resolve().stem


Canvas = tuple[float | None, float | None]


def _canvases(width: Any, height: Any) -> list[Canvas]:
    widths, heights = _sweep(width, "--width"), _sweep(height, "--height")
    if len(widths) * len(heights) > MAX_SWEEP:
        raise click.UsageError(f"a sweep of more than {MAX_SWEEP} canvases")
    return [(w, h) for h in heights for w in widths]


def _sweep(text: str | None, option: str) -> list[float | None]:
    if text is None:
        return [None]
    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not all(0 < n <= 1e6 for n in numbers):
        raise click.UsageError(f"{option}: expected W or FROM:TO:STEP in metres, found {text!r}")
    if len(numbers) == 1:
        return [numbers[0]]
    start, stop, step = numbers
    count = int(max(-2.0, min((stop - start) / step, 1e9)) + 1e-9) + 1
    if count < 1 or count > MAX_SWEEP:
        raise click.UsageError(
            f"{option}: {text!r} is {max(count, 0)} canvases; expected 1 to {MAX_SWEEP}"
        )
    return [start + i * step for i in range(count)]


def _layouts(
    design: Design, canvases: list[Canvas], seed: int, options: Mapping[str, Any]
) -> Iterator[Layout]:
    for width, height in canvases:
        name = design.id
        if len(canvases) > 1:
            own = design.canvas
            name += f"-{width or own.width:g}x{height or own.height:g}"
        how: dict[str, Any] = {
            "width": width,
            "height": height,
            "time_limit": options["time_limit"],
        }
        named = replace(design, id=name)
        if not options["every"] and seed == 0:
            yield solve_design(named, **how)
            continue
        found = variations(named, **how)
        if options["every"]:
            yield from found
        else:
            listed = list(found)
            picked = int(item_generator(seed, "layer-solve", name).integers(len(listed)))
            yield replace(listed[picked], id=name)


def _assets(path: str, layout: Layout) -> dict[str, Any]:
    """Return the files that visible shapes name, so that the layout stands on its own."""
    names = {n for s in layout.shapes if s.visible for n in (s.mesh, s.texture) if n}
    folder = Path() if path == "-" else Path(path).parent
    return {name: _asset(folder, name) for name in sorted(names)}


def _asset(folder: Path, name: str) -> dict[str, str]:
    media = MEDIA.get(Path(name).suffix.lower())
    if media is None:
        raise InvalidInput(f"{name}: expected .obj, .png or .jpg", pointer="/shapes")
    try:
        data = (folder / name).read_bytes()
    except OSError as error:
        raise InvalidInput(f"{name} cannot be read: {error.strerror}", pointer="/shapes") from None
    if len(data) > MAX_ASSET:
        raise InvalidInput(f"{name} is larger than {MAX_ASSET >> 20} MiB", pointer="/shapes")
    if media == "model/obj":
        return {"media": media, "data": data.decode(errors="replace")}
    return {"media": media, "data": base64.b64encode(data).decode()}


def _with_line(error: InvalidInput, item: RawItem) -> InvalidInput:
    """Add the line that the error's pointer leads to in hand-written YAML."""
    line = error.place.line or _line_of(item, error.place.pointer)
    place = Place(error.place.source or item.source, line, error.place.pointer)
    message = error.message
    unknown = re.search(r"\('([^']+)' (?:was|were) unexpected\)", message)
    if unknown:
        below = _line_of(item, f"{error.place.pointer.rstrip('/')}/{unknown.group(1)}")
        place = replace(place, line=below or line)
    return InvalidInput(message, place)


def _line_of(item: RawItem, pointer: str) -> int | None:
    import yaml

    if not item.yaml or not pointer:
        return None
    try:
        node: Any = yaml.compose(item.data, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None
    line: int = node.start_mark.line + 1
    for part in pointer.split("/")[1:]:
        key = part.replace("~1", "/").replace("~0", "~")
        if isinstance(node, yaml.MappingNode):
            found = [(k, v) for k, v in node.value if str(k.value) == key]
            if not found:
                break
            line, node = found[0][0].start_mark.line + 1, found[0][1]
        elif isinstance(node, yaml.SequenceNode) and key.isdigit() and int(key) < len(node.value):
            node = node.value[int(key)]
            line = node.start_mark.line + 1
    return line


def _write_sheet(path: str, layouts: list[Layout]) -> None:
    from facade_tools.artifacts.writing import write_bytes
    from facade_tools.layering.drawing import sheet_bytes

    write_bytes(Path(path), sheet_bytes(layouts, Path(path).suffix.lower()))
