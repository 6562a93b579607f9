"""`facade view`: pictures and pages of any artifact."""

from __future__ import annotations

import re

import click

from ._options import Finite, FiniteRange, StreamOptions, stream_options

MOST_PIXELS = 16_000_000


def _size(ctx: click.Context, param: click.Parameter, value: str | None) -> tuple[int, int] | None:
    """Read WxH in pixels."""
    match = re.fullmatch(r"(\d{2,4})x(\d{2,4})", value or "")
    if value is not None and match is None:
        raise click.BadParameter(f"{value!r} is not WxH in pixels, like 640x480", ctx, param)
    if match is None:
        return None
    width, height = int(match[1]), int(match[2])
    if width * height > MOST_PIXELS:
        raise click.BadParameter(f"{value} is more than {MOST_PIXELS:,} pixels", ctx, param)
    return width, height


@click.command()
@stream_options("ARTIFACT...", seeded=False, to="a .png or .html file")
@click.option(
    "--azimuth", type=Finite(), default=-30.0, show_default=True,
    help="Where the viewer stands, degrees: 0 in front, 90 at the right side.",
)  # fmt: skip
@click.option(
    "--elevation", type=FiniteRange(-10, 89), default=6.0, show_default=True,
    help="How high the viewer stands, degrees above the horizon.",
)  # fmt: skip
@click.option(
    "--size", metavar="WxH", callback=_size,
    help="Pixels of one picture.  [default: 960x720; 400x300 when there are several]",
)  # fmt: skip
@click.option("--columns", type=click.IntRange(1, 100), help="Pictures side by side in a sheet.")
@click.option("--sides", is_flag=True, help="Four pictures of each: front, right, back, left.")
@click.option("--mass", is_flag=True, help="Beside each building its box plan and energy curve.")
@click.option("--no-labels", is_flag=True, help="Leave the ids out of a sheet.")
def command(stream: StreamOptions, **values: object) -> None:
    """Draw any artifact: a picture (.png) or a page that turns in a browser (.html).

    Several artifacts make a contact sheet, or a page with a list to pick from. Pages need no
    network. Layouts are drawn as vectors, too (.svg).

    \b
    Example: facade view buildings.jsonl -o sheet.png --columns 6
    """
    from ._view import ViewOptions, run_view

    run_view(stream, ViewOptions(**values))  # type: ignore[arg-type]
