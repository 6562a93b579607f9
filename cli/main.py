"""The `facade` command: global options, errors to one line and an exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

import click

from ._group import StageGroup

# One thread per process: results must not depend on how a linear algebra library splits its
# sums, and parallelism is over items (--jobs).
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")


def _print_version(ctx: click.Context, _: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from facade_tools import __version__

        click.echo(f"facade {__version__}")
        ctx.exit()


@click.group(cls=StageGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("-v", "--verbose", count=True, help="Say more on standard error; twice: everything.")
@click.option("-q", "--quiet", is_flag=True, help="No progress and no warnings.")
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Show the version and exit.",
)
def facade(verbose: int, quiet: bool, debug: bool) -> None:
    """Learn, generate, parse and restyle building exteriors.

    Stages read and write JSON and OBJ/glTF artifacts, '-' is standard input and output, so that
    they chain in pipes and Makefiles:

    \b
      facade sample model.json -n 5 | facade massgen - | facade facadegen - \\
        | facade export - -o out/
    """
    from ._report import start_logging

    start_logging(verbose, quiet)


def main(arguments: Sequence[str]) -> int:
    """Run the command line and return its exit code."""
    try:
        result = facade.main(list(arguments), prog_name="facade", standalone_mode=False)
    except (Exception, KeyboardInterrupt) as error:
        from ._report import explain

        return explain(error, arguments)
    return result if isinstance(result, int) else 0


def run() -> None:
    """Entry point of the `facade` script."""
    import signal

    from ._interrupts import install

    install()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    sys.exit(main(sys.argv[1:]))
