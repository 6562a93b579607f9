"""The body of `facade layer-solve`."""

from __future__ import annotations

import base64
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.design import Design
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.layout import Layout
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.artifacts.provenance import Provenance
from facade_tools.artifacts.store import RawItem, read_raw
from facade_tools.errors import InvalidInput
from facade_tools.layering.assets import MEDIA, MESH, check_asset, named_assets
from facade_tools.layering.solve import solve_design, variations
from facade_tools.randomness import item_generator

from ._options import StreamOptions
from ._stream import Faults, ItemResult, is_single, refuse_single, write_items

MAX_SWEEP = 1000
MAX_ASSET = 16 << 20
SHEETS = (".svg", ".png")
Canvas = tuple[float | None, float | None]


@dataclass(frozen=True)
class CanvasSolver:
    """Makes the layouts of a design on one canvas, their assets and provenance included."""

    design: Design
    assets: Mapping[str, Any]
    provenance: Provenance
    options: Mapping[str, Any]
    seed: int
    sweep: bool = False
    indented: bool = False
    drawn: list[Layout] = field(default_factory=list)

    def __call__(self, canvas: Canvas) -> ItemResult:
        """Return the layouts, which are also added to `drawn`."""
        dump = dump_document if self.indented else dump_line
        rows = []
        design = self.design
        if self.sweep:
            width, height = canvas[0] or design.canvas.width, canvas[1] or design.canvas.height
            design = replace(design, id=f"{design.id}-{width:.12g}x{height:.12g}")
        for found in _layouts(design, canvas, self.seed, self.options):
            assets = _used(self.assets, found)
            full = replace(found, assets=assets, provenance=self.provenance)
            rows.append((full.id, dump(encode(full))))
            self.drawn.append(full)
        return ItemResult(tuple(rows), [])


def run_layer_solve(path: str, stream: StreamOptions, options: Mapping[str, Any]) -> None:
    """Solve a design on every canvas that the options ask for, and write the layouts."""
    canvases = _canvases(options["width"], options["height"])
    refuse_single(stream.output, len(canvases), "layouts")
    _check_sheet(options["sheet"])
    item = _only(path)
    drawn: list[Layout] = []
    faults = Faults("layer-solve", stream.on_error)
    try:
        solver = _solver(path, item, stream.seed or 0, options)
        indented = is_single(stream.output)
        solver = replace(solver, sweep=len(canvases) > 1, indented=indented, drawn=drawn)
        write_items(solver, canvases, stream, faults)
    except InvalidInput as error:
        raise item.located(error) from None
    if options["sheet"] and drawn:
        _write_sheet(str(options["sheet"]), drawn)
    faults.complain()


def _solver(path: str, item: RawItem, seed: int, options: Mapping[str, Any]) -> CanvasSolver:
    design = item.artifact(Design)
    design = design if design.id else replace(design, id=_stem(path))
    recorded = {k: v for k, v in options.items() if k != "sheet" and v not in (None, False)}
    provenance = Provenance("layer-solve", seed, recorded, (item.provenance(),))
    return CanvasSolver(design, _assets(path, design), provenance, options, seed)


def _check_sheet(path: Any) -> None:
    if path and Path(path).suffix.lower() not in SHEETS:
        raise click.UsageError(f"--sheet {path}: expected a sheet that ends in .svg or .png")


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
    design: Design, canvas: Canvas, seed: int, options: Mapping[str, Any]
) -> Iterator[Layout]:
    how: dict[str, Any] = {
        "width": canvas[0],
        "height": canvas[1],
        "time_limit": options["time_limit"],
    }
    if not options["every"] and seed == 0:
        yield solve_design(design, **how)
        return
    found = variations(design, **how)
    if options["every"]:
        yield from found
    else:
        listed = list(found)
        picked = int(item_generator(seed, "layer-solve", design.id).integers(len(listed)))
        yield replace(listed[picked], id=design.id)


def _assets(path: str, design: Design) -> dict[str, Any]:
    """Return the files that the design's shapes name, checked, so that layouts hold them."""
    folder = Path() if path == "-" else Path(path).parent
    found: dict[str, Any] = {}
    for pointer, name in named_assets(design):
        if name in found:
            continue
        try:
            found[name] = _asset(folder / name)
        except InvalidInput as error:
            raise InvalidInput(f"{name} {error.message}", pointer=pointer) from None
    return found


def _asset(path: Path) -> dict[str, str]:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_ASSET + 1)
    except OSError as error:
        raise InvalidInput(f"cannot be read: {error.strerror}") from None
    if len(data) > MAX_ASSET:
        raise InvalidInput(f"is larger than {MAX_ASSET >> 20} MiB")
    media = MEDIA[path.suffix.lower()]
    check_asset(media, data)
    text = data.decode(errors="replace") if media == MESH else base64.b64encode(data).decode()
    return {"media": media, "data": text}


def _used(assets: Mapping[str, Any], layout: Layout) -> dict[str, Any]:
    """Return what visible shapes name, so that the layout stands on its own."""
    names = {n for s in layout.shapes if s.visible for n in (s.mesh, s.texture) if n}
    return {name: assets[name] for name in sorted(names)}


def _write_sheet(path: str, layouts: list[Layout]) -> None:
    from facade_tools.artifacts.writing import write_bytes
    from facade_tools.layering.drawing import sheet_bytes

    write_bytes(Path(path), sheet_bytes(layouts, Path(path).suffix.lower()))
