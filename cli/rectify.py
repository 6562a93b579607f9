"""`facade rectify`: a photograph taken at an angle made fronto-parallel."""

from __future__ import annotations

import click

from . import _options


@click.command()
@click.argument("image", metavar="IMAGE")
@_options.output_to("a .png or .jpg file")
@click.option(
    "--corners", default="auto", show_default=True, metavar="X,Y X,Y X,Y X,Y|auto",
    help="Corners of a rectangle on the facade in pixels: top left, top right, bottom right, "
    "bottom left. auto finds the directions from lines and keeps the whole picture.",
)  # fmt: skip
@click.option("--report", metavar="JSON", help="Homography, confidence and size.")
def command(image: str, output: str, corners: str, report: str | None) -> None:
    """Turn a photograph of a facade straight.

    Refuses (exit code 3) pictures without enough lines in two directions. Standard error tells
    the confidence with -v; --report writes it with the 3×3 homography, pixels of the photograph
    to pixels of the result.

    \b
    Example: facade rectify street.jpg --corners "80,60 510,20 530,700 60,640" -o facade.png
    """
    from ._rectifying import run_rectify

    run_rectify(image, output, corners, report)
