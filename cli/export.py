"""`facade export`: artifacts to files that other tools open."""

from __future__ import annotations

import click

from ._options import StreamOptions, stream_options

FORMATS = {"glb": ".glb", "obj": ".obj", "cityjson": ".city.json"}


@click.command()
@stream_options("ITEM...", seeded=False, to="a file or a folder")
@click.option(
    "--format",
    "form",
    type=click.Choice(list(FORMATS)),
    help="Default: by the ending of PATH (.glb, .obj, .city.json); glb in a folder.",
)
@click.option(
    "--arrange",
    type=click.Choice(["auto", "own", "side-by-side"]),
    default="auto",
    show_default=True,
    help="Where items stand: auto puts imported ones back on their map, and others side by side "
    "if they stand on one another.",
)
def command(stream: StreamOptions, form: str | None, arrange: str) -> None:
    """Write buildings, footprints and layouts as GLB, OBJ or CityJSON.

    PATH is one file for all items, or a folder that gets a file an item, named by its id.

    \b
    Example: facade export buildings.jsonl -o models/ --format glb
    """
    from ._export import run_export

    run_export(stream, form, arrange)
