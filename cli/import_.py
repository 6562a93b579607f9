"""facade import: buildings, footprints and attributes from public formats."""

from __future__ import annotations

from typing import Any

import click

from ._options import StreamOptions, stream_options


@click.command("import")
@stream_options("FILE...", seeded=False)
@click.option(
    "--as",
    "kind",
    type=click.Choice(["buildings", "attributes", "footprints"]),
    help="What to make; by default what the source gives best.",
)
@click.option(
    "--metres",
    is_flag=True,
    help="GeoJSON coordinates are planar metres; by default they are degrees and get projected.",
)
@click.option(
    "--front",
    type=click.Choice(["long", "short", "unknown"]),
    default="long",
    show_default=True,
    help="Street side of a rectangular plan of which only area and perimeter are known.",
)
@click.option(
    "--columns",
    metavar="MAPPING.yaml",
    help="Which column of an assessor's table holds what; by default the Ames table's.",
)
def command(
    stream: StreamOptions, kind: Any, metres: bool, front: Any, columns: str | None
) -> None:
    """Read real buildings from the formats that people have.

    The format is told by content, not by file ending: CityJSON, CityJSONSeq, CityGML, GeoJSON,
    IFC, HOT2000, HPXML, assessors' tables. Implausible entries are clipped or left out by stated
    rules and counted on standard error.

    \b
    Example:
      facade import houses.jsonl -o attributes.jsonl
    """
    from facade_tools.formats.reading import ReadOptions

    from ._import import read_columns, run_import

    mapping = read_columns(columns)
    run_import(ReadOptions(kind, metres, front, mapping), stream)
