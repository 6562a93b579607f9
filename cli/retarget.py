"""`facade retarget`: a style sheet onto another structure."""

from __future__ import annotations

from typing import Any

import click

from ._options import (
    FiniteRange,
    StreamOptions,
    jobs,
    mesh_unit,
    mesh_up,
    on_error,
    output_to,
    scheduler,
    seed,
)


@click.command()
@click.argument("style", metavar="STYLE_DIR")
@click.argument("bases", nargs=-1, required=True, metavar="BASE...")
@output_to("a .glb, an .obj or a folder")
@click.option(
    "--styles",
    multiple=True,
    metavar="STYLE_DIR",
    help="Further style sheets (repeatable; with it, folders of style sheets may also stand among "
    "the bases): each base takes one of all by similarity and seed.",
)
@click.option(
    "--resize",
    multiple=True,
    metavar="BLOCK=WxDxH",
    help="New width, depth and height of a block, metres (repeatable).",
)
@click.option(
    "--reassign",
    type=FiniteRange(0, 1),
    default=0.05,
    show_default=True,
    help="Share of a side's area below which a group of faces, on blocks that stand together "
    "otherwise than in the source, takes the texture of a larger group; 0 never.",
)
@mesh_up
@mesh_unit
@seed
@jobs
@scheduler
@on_error
def command(
    style: str,
    bases: tuple[str, ...],
    output: str,
    styles: tuple[str, ...],
    resize: tuple[str, ...],
    reassign: float,
    up: str,
    unit: str,
    **values: Any,
) -> None:
    """Put the look of a style sheet onto buildings of another structure (LNSW13).

    BASE is blocks.json (of a style sheet, or hand-written), buildings or layouts (.json, .jsonl,
    -), or a mesh (--up and --unit tell how it was drawn). PATH is a .glb or .obj file, or a folder
    that gets a GLB a base. Buildings, layouts and meshes get a bottom and a top as high as the
    style's where there is room.

    \b
    Example:
      facade retarget tower-style houses.jsonl -o styled/
    """
    from ._style import MeshOptions, is_style, run_retarget

    more = [base for base in bases if styles and is_style(base)]
    rest = [base for base in bases if base not in more]
    if not rest:
        raise click.UsageError("Missing argument 'BASE...'.")
    stream = StreamOptions(inputs=tuple(rest), output=output, **values)
    run_retarget((style, *styles, *more), stream, resize, reassign, MeshOptions(up, unit))
