"""`facade sample`: a model to attribute vectors of new buildings."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("model", metavar="MODEL")
@click.option("-n", "count", type=click.IntRange(0), default=1, show_default=True, help="How many.")
@click.option("--style", type=click.IntRange(0), help="Draw only from this style (from 0).")
@_options.output
@_options.seed
def command(model: str, count: int, style: int | None, output: str | None, seed: int) -> None:
    """Draw attribute vectors of new buildings from a model (FW16 5, 7).

    \b
    Example: facade sample model.json -n 20 --seed 7 -o attributes.jsonl
    """
    from facade_tools.exteriors.drawing import SampleOptions, sample_attributes
    from facade_tools.randomness import item_generator

    from ._learning import load_model, write_samples

    loaded, source = load_model(model)
    options = SampleOptions(style=style, prefix=str(seed))
    rows = sample_attributes(loaded, count, rng=item_generator(seed, "sample"), options=options)
    recorded = {} if style is None else {"style": style}
    write_samples(rows, output, seed, recorded, (source,))
