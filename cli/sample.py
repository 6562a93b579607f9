"""`facade sample`: a model to attribute vectors of new buildings."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("model", metavar="MODEL")
@click.option("-n", "count", type=click.IntRange(0), default=1, show_default=True, help="How many.")
@click.option("--given", metavar="PARTIAL", help="Partial building or attributes to complete.")
@click.option("--style", type=click.IntRange(0), help="Draw only from this style (from 0).")
@click.option("--top", is_flag=True, help="Keep the most probable of at least 2,000 draws.")
@click.option(
    "--min-distance",
    metavar="D",
    type=_options.FiniteRange(0),
    default=0.0,
    show_default=True,
    help="Root mean square distance, in standard deviations a coordinate, that samples keep from "
    "training buildings and from each other.",
)
@click.option(
    "--smooth",
    is_flag=True,
    help="Draw from the density alone: not the exact values that buildings share, and what none "
    "of them shows.",
)
@_options.output
@_options.seed
@_options.jobs
@_options.scheduler
def command(
    model: str,
    count: int,
    given: str | None,
    style: int | None,
    top: bool,
    min_distance: float,
    smooth: bool,
    output: str | None,
    seed: int,
    jobs: int,
    scheduler: str | None,
) -> None:
    """Draw attribute vectors of new buildings from a model (FW16 5, 7), or complete a partial one.

    A model of a table (learn --groups) gives rows of that table, as CSV.

    \b
    Example:
      facade sample model.json -n 20 --seed 7 -o attributes.jsonl
      facade sample model.json --given partial.yaml --top -n 5
    """
    from facade_tools.artifacts.provenance import Provenance

    from ._learning import Drawing, load_model, read_given, write_samples

    _options.refuse_overwriting([model, given], [output])
    loaded, source = load_model(model, tables=given is None)
    known, sources = read_given(given)
    recorded = {"style": style, "top": top, "min_distance": min_distance, "smooth": smooth}
    provenance = Provenance("sample", seed, recorded, (source, *sources))
    drawing = Drawing(loaded, known, provenance, seed, style, top, min_distance, smooth)
    write_samples(drawing, count, output, jobs=jobs, scheduler=scheduler)
