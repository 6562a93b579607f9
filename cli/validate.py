"""facade validate."""

from __future__ import annotations

import click

from ._options import StreamOptions, stream_options


@click.command()
@stream_options("FILE...", seeded=False)
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="json: one object a finding, for CI.",
)
def command(stream: StreamOptions, form: str) -> None:
    """Check schema and geometry of any artifact; exit 0 if all is well, 3 if not.

    Findings go to standard output, one a line. A bad item never stops the check.

    \b
    Example:
      facade validate houses/ --format json
    """
    from ._validation import run_validation

    run_validation(stream, form)
