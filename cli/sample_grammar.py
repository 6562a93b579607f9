"""`facade sample-grammar`: random facades of a split grammar."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("grammar", metavar="GRAMMAR")
@_options.output
@_options.seed
@click.option("-n", "--count", type=click.IntRange(1, 10**6), default=1, show_default=True,
              help="How many facades.")  # fmt: skip
@click.option("--width", type=click.IntRange(16, 4000), default=240, show_default=True,
              help="Pixels.")  # fmt: skip
@click.option("--height", type=click.IntRange(16, 4000), default=360, show_default=True,
              help="Pixels.")  # fmt: skip
@click.option("--pictures", metavar="FOLDER", help="A rendered picture of each, ID.png.")
@click.option("--labels", metavar="FOLDER", help="A label map of each, ID.png.")
def command(grammar: str, output: str | None, seed: int, **values: object) -> None:
    """Draw random facades of a split grammar as parses (TSKP10 Fig. 4).

    GRAMMAR is the name of a shipped grammar (haussmann, haussmann-floors, tskp10, ...) or a YAML
    file. The parses go to PATH as JSON Lines; with --pictures and --labels they are training
    data for train-parser.

    \b
    Example: facade sample-grammar haussmann -n 12 -o facades.jsonl --pictures pictures/
    """
    from ._sampling_grammar import run_sampling

    run_sampling(grammar, output, seed, values)
