"""`facade attributes`: buildings to their 49 attributes."""

from __future__ import annotations

import click

from ._options import StreamOptions, stream_options
from ._stream import ItemStage, run_stream


@click.command()
@stream_options("BUILDINGS...", seeded=False)
def command(stream: StreamOptions) -> None:
    """Compute the 49 attributes (FW16 appendix A) of buildings, whole or partial.

    BUILDINGS are .json, .jsonl or .yaml files, folders of them, or - for standard input. What a
    partial building leaves open is null.

    \b
    Example: facade attributes sample_data/houses -o attributes.jsonl
    """
    from facade_tools.exteriors.attributes import building_attributes

    run_stream(ItemStage("attributes", ("building",), building_attributes), stream)
