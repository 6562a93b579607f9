"""`facade learn`: buildings or attributes to a model."""

from __future__ import annotations

from typing import Any

import click

from . import _options


@click.command()
@_options.inputs("BUILDINGS|ATTRIBUTES...")
@_options.output
@_options.seed
@click.option(
    "--prior",
    metavar="BUILDINGS",
    help="Where attributes come from that no input observes; default: the shipped sample houses.",
)
def command(inputs: tuple[str, ...], output: str | None, seed: int, prior: str | None) -> None:
    """Learn the graphical model of building exteriors (FW16 5) from buildings or attributes.

    Inputs are .json, .jsonl and .yaml files, folders of them, or -; null means unobserved.

    \b
    Example: facade learn sample_data/houses -o model.json
    """
    from dataclasses import replace

    from facade_tools.artifacts.provenance import Provenance
    from facade_tools.exteriors.learning import LearnOptions, learn_model
    from facade_tools.randomness import item_generator

    from ._learning import read_attributes
    from ._stream import write_result

    rows, sources = read_attributes(inputs)
    more: Any = None
    if prior is not None:
        more, extra = read_attributes([prior])
        sources += extra
    options = LearnOptions(prior_rows=more)
    model = learn_model(rows, rng=item_generator(seed, "learn"), options=options)
    provenance = Provenance("learn", seed, {}, sources)
    write_result(replace(model, provenance=provenance), output)
