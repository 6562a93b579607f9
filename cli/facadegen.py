"""`facade facadegen`: windows, doors and colours on mass models."""

from __future__ import annotations

import click

from ._options import StreamOptions, stream_options
from ._stream import ItemStage, run_stream, side_input


@click.command()
@stream_options("BUILDINGS...")
@click.option(
    "--library",
    metavar="BUILDINGS",
    help="Where windows, doors, colours come from: buildings or library.json; default: shipped.",
)
@click.option("--keep", metavar="PARTIAL", help="Building whose listed sides stay as they are.")
@click.option(
    "--candidates",
    type=click.IntRange(1, 100),
    default=1,
    show_default=True,
    help="How many different facades a building.",
)
@click.option(
    "--design",
    "designs",
    metavar="SIDE:DESIGN",
    multiple=True,
    help="A design (see layer-solve) for the largest wall of front, back, left or right.",
)
def command(
    stream: StreamOptions,
    library: str | None,
    keep: str | None,
    candidates: int,
    designs: tuple[str, ...],
) -> None:
    """Put windows and doors on buildings (FW16 6.2).

    BUILDINGS are .json or .jsonl files, folders of them, or - for standard input. Each is made for
    its own `targets`; one without takes those of the most similar building of the library.

    \b
    Example: facade massgen attributes.jsonl | facade facadegen - -o buildings.jsonl
    """
    from facade_tools.artifacts.store import read_one
    from facade_tools.exteriors.facadegen import FacadeOptions, generate_facades
    from facade_tools.exteriors.library import read_library

    from ._designing import designers

    known = None if keep is None else read_one(keep, "building")
    shelf = None if library is None else read_library(library)
    made = FacadeOptions(shelf, known, candidates, designs=designers(designs))
    paths = [library, keep, *(pair.partition(":")[2] for pair in designs)]
    sources = tuple(source for path in paths for source in side_input(path))
    sides = [pair.partition(":")[0] for pair in designs]
    recorded = {"candidates": candidates} | ({"design": sides} if designs else {})
    stage = ItemStage(
        "facadegen", ("building",), generate_facades, {"options": made}, recorded, sources
    )
    run_stream(stage, stream)
