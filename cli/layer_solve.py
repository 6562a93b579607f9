"""`facade layer-solve`: designs to layouts."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("design")
@_options.output
@_options.seed
@click.option(
    "--width",
    metavar="W|FROM:TO:STEP",
    help="Canvas width in metres, or a sweep; default: the design's.",
)
@click.option(
    "--height",
    metavar="H|FROM:TO:STEP",
    help="Canvas height in metres, or a sweep; default: the design's.",
)
@click.option(
    "--time-limit",
    type=_options.FiniteRange(0.1, 86400),
    default=10.0,
    show_default=True,
    help="Seconds for a layout; then the best so far, optimal: false.",
)
@click.option("--all", "every", is_flag=True, help="Every variation: alternations, counters.")
@click.option("--sheet", metavar="PICTURE", help="Contact sheet of all layouts, .svg or .png.")
@_options.on_error
def command(design: str, output: str | None, seed: int, on_error: str, **options: object) -> None:
    """Solve a facade that is designed as a stack of layers (IMAW15).

    DESIGN is a .yaml or .json file, or - for standard input. The layout of least alignment error
    goes to PATH; several (a sweep, --all) are one a line. --seed other than 0 picks one of the
    variations that --all lists. Of a sweep --on-error skip leaves out the sizes without a layout.

    \b
    Example: facade layer-solve sample_data/designs/residential-9.yaml --width 8:16:4 -o out.jsonl
    """
    from ._layer_solve import run_layer_solve

    _options.refuse_overwriting([design], [output, str(options["sheet"] or "")])
    stream = _options.StreamOptions((design,), output, seed, 1, None, on_error)
    run_layer_solve(design, stream, options)
