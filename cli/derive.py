"""`facade derive`: buildings of a shape grammar."""

from __future__ import annotations

from typing import Any

import click

from . import _options


@click.command()
@click.argument("grammar", metavar="GRAMMAR")
@_options.output
@click.option(
    "--footprint", metavar="FILE",
    help="GeoJSON, a footprint or a building; each polygon gets a building.  "
    "[default: the grammar's own lot]",
)  # fmt: skip
@click.option("--metres", is_flag=True, help="The GeoJSON's coordinates are planar metres.")
@click.option("-n", "--count", type=click.IntRange(1, 10**6), default=1, show_default=True,
              help="Buildings on each footprint.")  # fmt: skip
@click.option("--set", "given", multiple=True, metavar="NAME=VALUE",
              help="A parameter's value instead of the grammar's own (repeatable).")  # fmt: skip
@click.option("--tree", metavar="FILE", help="The derivations too: .json, .jsonl or a folder.")
@_options.seed
@_options.jobs
@_options.scheduler
@_options.on_error
def command(grammar: str, **values: Any) -> None:
    """Turn footprints into buildings by a shape grammar (KSTTP09 section 2).

    GRAMMAR is the name of a shipped grammar (ksttp09, haussmann, victorian, modern) or a YAML
    file. PATH is a model (.glb, .obj), a folder of GLB files, or buildings (.json, .jsonl; standard
    output without -o).

    \b
    Example: facade derive haussmann -n 4 --seed 7 -o street.glb
    """
    from ._deriving import run_derive

    names = ("output", "seed", "jobs", "scheduler", "on_error")
    stream = _options.StreamOptions(inputs=(), **{name: values.pop(name) for name in names})
    run_derive(grammar, stream, values)
