"""`facade parse-image`: photographs read by a shape grammar."""

from __future__ import annotations

from typing import Any

import click

from ._options import FiniteRange, StreamOptions, stream_options
from ._tables import METHODS


@click.command()
@stream_options("IMAGE...")
@click.option("--classifier", metavar="NPZ", help="From train-parser; default: the shipped one.")
@click.option(
    "--grammar", metavar="NAME|FILE",
    help="A shipped grammar (haussmann, haussmann-floors, ...) or a YAML file.  "
    "[default: haussmann-floors]",
)  # fmt: skip
@click.option(
    "--method", type=click.Choice(list(METHODS)),
    help="forest: trees over pixels and a split grammar (TSKP10); mrf: chains of floors and of "
    "window stripes, nothing learned (KSTTP09); both: forest, with the windows of mrf as far as "
    "the trees doubt.  [default: both; with --classifier: forest]",
)  # fmt: skip
@click.option(
    "--solver", type=click.Choice(["dp", "walk"]),
    help="forest, both: dp, exact in turn over rows and columns; walk, the paper's random walk.  "
    "[default: dp]",
)  # fmt: skip
@click.option(
    "--height", type=FiniteRange(1, 1000), metavar="M",
    help="mrf, both: height of the building to the top of its roof, metres.  [default: unknown]",
)  # fmt: skip
@click.option(
    "--storey-height", type=FiniteRange(1, 20), metavar="M",
    help="mrf, both: height of a storey, metres.  [default: unknown; taken to be 3]",
)  # fmt: skip
@click.option(
    "--rectify", metavar="auto|X,Y X,Y X,Y X,Y|REPORT",
    help="Straighten the photograph first: from its own lines, from four corners (pixels, as in "
    "`facade rectify`), or by the report.json that `facade rectify` wrote.  "
    "[default: it is straight]",
)  # fmt: skip
@click.option("--mask", metavar="PNG", help="Not 0 where something hides the facade.")
@click.option("--labels", metavar="PNG", help="Label map of the regions; a folder for many.")
@click.option("--raw-labels", metavar="PNG", help="Label map of the classifier alone.")
@click.option("--overlay", metavar="PNG", help="The photograph with the regions over it.")
def command(stream: StreamOptions, **values: Any) -> None:
    """Read rectified photographs of facades: floors, columns, windows, balconies, doors, roofs.

    IMAGE is a picture (JPEG, PNG, TIFF, BMP, WebP) or a folder of them. Where the facade was
    taken at an angle, --rectify straightens it; regions are then in pixels of the straight
    picture, and the parse holds the homography.

    \b
    Example: facade parse-image sample_data/photos -o parses.jsonl --overlay overlays/
    """
    from ._parsing import ParseOptions, run_parse

    values["method"] = values["method"] or ("forest" if values["classifier"] else "both")
    run_parse(stream, ParseOptions(**values))
