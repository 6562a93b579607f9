"""`facade learn`: buildings, attributes or a table to a model."""

from __future__ import annotations

from typing import Any

import click

from . import _options

VARIANTS = ("full", "no-lateral", "no-middle", "flat", "gmm")


@click.command()
@_options.stream_options("BUILDINGS|ATTRIBUTES|TABLE.csv...")
@click.option(
    "--variant",
    type=click.Choice(VARIANTS),
    default="full",
    show_default=True,
    help="The whole model, or one of the paper's alternatives.",
)
@click.option("--faithful", is_flag=True, help="The paper's plain model: no transforms.")
@click.option(
    "--prior",
    metavar="BUILDINGS",
    help="Where attributes come from that no input observes; default: the shipped sample houses.",
)
@click.option(
    "--restarts",
    type=click.IntRange(1, 100),
    default=1,
    show_default=True,
    help="Structure searches; all but the first begin at random.",
)
@click.option(
    "--holdout",
    type=click.IntRange(1, 100),
    metavar="K",
    help="Also compare all variants on K random 80/20 splits, on standard error.",
)
@click.option("--report", metavar="PATH.html", help="Write a self-contained report.")
@click.option("--groups", metavar="GROUPS.yaml", help="Which columns of a table form groups.")
def command(**options: Any) -> None:
    """Learn the graphical model of building exteriors (FW16 5) from buildings or attributes.

    Inputs are .json, .jsonl and .yaml files, folders of them, or -; null means unobserved. A table
    is any .csv whose columns --groups assigns; an empty cell means unobserved.

    \b
    Example:
      facade learn sample_data/houses -o model.json --report report.html
      facade learn table.csv --groups groups.yaml -o model.json
    """
    from ._learning import run_learn

    run_learn(**options)
