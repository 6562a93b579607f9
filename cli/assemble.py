"""`facade assemble`: parses of a building's sides to one building."""

from __future__ import annotations

from collections.abc import Callable

import click

from ._options import F, FiniteRange, StreamOptions, stream_options


def _side(name: str) -> Callable[[F], F]:
    return click.option(f"--{name}", metavar="PARSE", help=f"Parse or label map of the {name}.")


@click.command()
@stream_options("[PARSE...]", seeded=False, required=False)
@_side("front")
@_side("back")
@_side("left")
@_side("right")
@click.option("--side", type=click.Choice(["front", "back", "left", "right"]), default="front",
              show_default=True, help="Which side each PARSE shows.")  # fmt: skip
@click.option(
    "--footprint", metavar="FILE|WxD",
    help="GeoJSON, a footprint or a building (of several, each PARSE takes the one with its id);"
         " or width and depth, metres.  [default: as seen]",
)  # fmt: skip
@click.option(
    "--depth",
    type=FiniteRange(2, 1000),
    metavar="M",
    help="Metres behind a side, where there is no footprint.  [default: unknown]",
)
@click.option("--metres", is_flag=True, help="The GeoJSON's coordinates are planar metres.")
@click.option("--roof", metavar="STYLE[:PITCH[:x|y]]",
              help="Roof as seen from above; pitch in degrees, ridge along x or y.")  # fmt: skip
@click.option("--storey-height", type=FiniteRange(2, 10), metavar="M",
              help="Height of a storey, metres.  [default: the parses' scale, or 3]")  # fmt: skip
@click.option("--windows", type=click.Choice(["unknown", "sash", "sliding", "casement", "fixed"]),
              default="unknown", show_default=True, help="Style of the windows.")  # fmt: skip
@click.option("--classes", default="ecp", show_default=True, metavar="NAME|JSON",
              help="Convention of label maps: ecp, cmp, labelmefacade, a JSON file.")  # fmt: skip
@click.option("--no-porch", is_flag=True, help="There is no porch; else that stays open.")
@click.option("--no-door", is_flag=True, help="Put no main door where none is seen.")
def command(stream: StreamOptions, **values: object) -> None:
    """Turn parses of facades into (partial) buildings that learn and the generators read.

    Each PARSE (.json, .jsonl, a label map, or a folder of them) becomes a building of which one
    side is known. With --front, --back, --left, --right up to four parses become one building.

    \b
    Example: facade assemble --front front.json --left left.json --footprint 12x9 -o house.json
    """
    from ._assembling import run_assemble

    run_assemble(stream, values)
