"""`facade evaluate`: held-out negative log density."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("model", metavar="MODEL")
@_options.stream_options("ATTRIBUTES|BUILDINGS...", seeded=False)
def command(model: str, stream: _options.StreamOptions) -> None:
    """Print the negative log density of buildings under a model: {"n", "nll", "per_building"}.

    nll is the mean; nats, over what each building observes: density per metre or per unit in
    original units, probability mass at atoms (docs/model.md). Lower is better.

    \b
    Example: facade evaluate model.json held-out.jsonl
    """
    from facade_tools.artifacts.numbers import dump_line
    from facade_tools.exteriors.evaluation import negative_log_density

    from ._learning import load_model, read_attributes
    from ._stream import open_sink

    loaded, _ = load_model(model)
    read = read_attributes("evaluate", stream)
    values = negative_log_density(loaded, read.attributes).tolist()
    mean = sum(values) / len(values) if values else None
    with open_sink(stream.output) as write:
        write("evaluation", dump_line({"n": len(values), "nll": mean, "per_building": values}))
    read.complain()
