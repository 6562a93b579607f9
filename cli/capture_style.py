"""`facade capture-style`: a textured model to its style sheet."""

from __future__ import annotations

import click

from ._options import FiniteRange, finite, mesh_unit, mesh_up, output_to


def _count(_: click.Context, parameter: click.Parameter, value: str) -> int | None:
    if value == "auto":
        return None
    if not value.isdecimal():
        raise click.BadParameter("expected a number of blocks, or auto", param=parameter)
    return int(value)


def _azimuth(_: click.Context, parameter: click.Parameter, value: str) -> float | None:
    try:
        return None if value == "auto" else finite(value)
    except ValueError:
        raise click.BadParameter("expected degrees, or auto", param=parameter) from None


@click.command()
@click.argument("model", metavar="MODEL")
@output_to("the style sheet's folder")
@click.option(
    "--front",
    default="auto",
    show_default=True,
    callback=_azimuth,
    help="Azimuth of the front's outward normal, degrees clockwise from +y; auto takes the side "
    "with the most textured area.",
)
@click.option(
    "--bottom", default="auto", show_default=True, callback=_count, help="Blocks of the bottom."
)
@click.option(
    "--top", default="auto", show_default=True, callback=_count, help="Blocks of the top."
)
@click.option(
    "--window-size",
    type=FiniteRange(0, min_open=True),
    help="Objective window size, metres: shorter sections are merged. Default: the median found.",
)
@click.option(
    "--thickness",
    type=FiniteRange(0),
    help="Depth of walls from their outer to their inner boundary, metres: how much of them an "
    "overhang may thin. Default: the depth of their relief.",
)
@mesh_up
@mesh_unit
def command(
    model: str,
    output: str,
    front: float | None,
    bottom: int | None,
    top: int | None,
    window_size: float | None,
    thickness: float | None,
    up: str,
    unit: str,
) -> None:
    """Capture the look of a textured Manhattan-world building as a style sheet (LNSW13).

    MODEL is an .obj, .glb, .gltf, .ply or .dae file. PATH is the folder of the style sheet.

    \b
    Example:
      facade capture-style tower.obj -o tower-style
    """
    from facade_tools.stylization.model import CaptureOptions

    from ._style import run_capture

    options = CaptureOptions(front, up, bottom, top, window_size, thickness)
    run_capture(model, output, options, unit)
