"""`facade evaluate`: held-out negative log density."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("model", metavar="MODEL")
@_options.stream_options("ATTRIBUTES|BUILDINGS|TABLE.csv...", seeded=False)
def command(model: str, stream: _options.StreamOptions) -> None:
    """Print the negative log density of buildings under a model: {"n", "nll", "per_building"}.

    nll is the mean; nats, over what each building observes: density per metre or per unit in
    original units, probability mass at atoms (docs/model.md). Lower is better. A model of a table
    reads tables with its columns.

    \b
    Example: facade evaluate model.json held-out.jsonl
    """
    from ._evaluating import run_evaluate

    run_evaluate(model, stream)
