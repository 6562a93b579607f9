"""`facade reconstruct`: textured buildings from parses."""

from __future__ import annotations

import click

from ._options import FiniteRange, StreamOptions, stream_options

SIDES = click.Choice(["front", "back", "left", "right"])


@click.command()
@stream_options("PARSE...")
@click.option(
    "--footprint", metavar="FILE",
    help="GeoJSON, a footprint or a building; of several, each parse takes the one with its "
    "id.  "
    "[default: a rectangle behind the facade]",
)  # fmt: skip
@click.option("--metres", is_flag=True, help="The GeoJSON's coordinates are planar metres.")
@click.option(
    "--image", metavar="PATH",
    help="The picture, or a folder of pictures.  [default: beside the parse]",
)  # fmt: skip
@click.option("--height", type=FiniteRange(2.0, 500.0), metavar="M",
              help="Metres from the ground to the top of the roof in the picture.")  # fmt: skip
@click.option(
    "--storey-height", type=FiniteRange(1.5, 20.0), metavar="M",
    help="Metres from floor to floor.  [default: what the parse says, else 3]",
)  # fmt: skip
@click.option("--depth", type=FiniteRange(1.0, 500.0), default=12.0, show_default=True,
              help="Metres behind the facade, of the default footprint.")  # fmt: skip
@click.option("--roof", type=click.Choice(["auto", "flat", "gable", "hip", "mansard"]),
              default="auto", show_default=True,
              help="auto: a mansard where the parse shows windows in a roof.")  # fmt: skip
@click.option("--party", type=SIDES, multiple=True, help="A blind wall (repeatable).")
@click.option("--tree", metavar="FILE", help="The derivations too: .json, .jsonl or a folder.")
def command(stream: StreamOptions, **values: object) -> None:
    """Build textured buildings from parses and footprints (KSTTP09).

    PATH is a model (.glb, .obj), a folder of GLB files, or buildings (.json, .jsonl; standard
    output without -o).

    \b
    Example: facade reconstruct parse.json --image facade.jpg -o building.glb
    """
    from ._reconstructing import run_reconstruct

    run_reconstruct(stream, values)
