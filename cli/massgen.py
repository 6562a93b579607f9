"""`facade massgen`: attributes to mass models with roofs."""

from __future__ import annotations

from typing import Any

import click

from facade_tools.errors import InvalidInput

from ._options import FiniteRange, StreamOptions, stream_options
from ._stream import ItemStage, run_stream, side_input


@click.command()
@stream_options("ATTRIBUTES...")
@click.option("--keep", metavar="PARTIAL", help="Building whose boxes stay exactly as they are.")
@click.option(
    "--candidates",
    type=click.IntRange(1, 100),
    default=1,
    show_default=True,
    help="How many different masses an item, in order of energy.",
)
@click.option(
    "--model",
    "model_path",
    metavar="MODEL",
    help="Model of which attributes that PARTIAL contradicts are drawn anew.",
)
@click.option(
    "--library",
    metavar="BUILDINGS",
    help="Buildings whose roofs these get: mansards, pitch, overhang.",
)
@click.option(
    "--require",
    type=FiniteRange(0),
    metavar="E",
    help="Exit 4 where the mass energy stays above E; default: only report it.",
)
def command(
    stream: StreamOptions,
    keep: str | None,
    candidates: int,
    model_path: str | None,
    library: str | None,
    require: float | None,
) -> None:
    """Make mass models with roofs from attributes (FW16 6.1).

    ATTRIBUTES are .json or .jsonl files, folders of them, or - for standard input. Known boxes
    of a partial building stay; the rest is generated around them.

    \b
    Example: facade sample model.json -n 5 | facade massgen - -o masses.jsonl
    """
    from facade_tools.exteriors.massgen import generate_mass
    from facade_tools.exteriors.roof_library import read_roof_library

    from ._learning import load_model

    known = None if keep is None else _known(keep)
    model = None if model_path is None else load_model(model_path)[0]
    recorded = {"candidates": candidates, "require": require}
    options = {"keep": known, "candidates": candidates, "require": require, "model": model}
    options["library"] = None if library is None else read_roof_library(library)
    stage = ItemStage(
        "massgen",
        ("attributes",),
        generate_mass,
        options,
        recorded,
        side_input(keep) + side_input(model_path) + side_input(library),
    )
    run_stream(stage, stream)


def _known(path: str) -> Any:
    """Return a partial building; raises InvalidInput where its boxes break a rule of geometry."""
    from facade_tools.artifacts.store import read_one
    from facade_tools.exteriors.kept import check_kept

    known = read_one(path, "building")
    try:
        check_kept(known)
    except InvalidInput as error:
        raise error.at(path) from None
    return known
