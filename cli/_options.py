"""Options that several stages share, declared once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from math import isfinite
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class StreamOptions:
    """What every stage that maps over a stream is asked for."""

    inputs: tuple[str, ...]
    output: str | None
    seed: int | None
    jobs: int
    scheduler: str | None
    on_error: str


def finite(text: str) -> float:
    """Return a number. Raises ValueError where it is none, or not a finite one."""
    number = float(text)
    if not isfinite(number):
        raise ValueError(text)
    return number


class Finite(click.types.FloatParamType):
    """A finite number: `nan` and `inf` are numbers to Python, and to no stage."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number, or fail as usage does."""
        number = super().convert(value, param, ctx)
        if not isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


class FiniteRange(click.FloatRange, Finite):
    """A finite number of a range; NaN would be in every one."""


def inputs(metavar: str, required: bool = True) -> Callable[[F], F]:
    """Positional paths, or `-` for standard input."""
    return click.argument("inputs", nargs=-1, required=required, metavar=metavar)


def _named(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """Refuse the path of a shell variable that is not set: it would mean the current folder."""
    if value == "":
        raise click.BadParameter("is empty; name a file or a folder", ctx, param)
    return value


output = click.option(
    "-o",
    "--output",
    metavar="PATH",
    callback=_named,
    help="Where to write; standard output without it.",
)
seed = click.option(
    "--seed",
    type=click.IntRange(0, 2**63 - 1),
    default=0,
    show_default=True,
    help="Same inputs, options and seed give the same bytes.",
)
jobs = click.option(
    "--jobs",
    type=click.IntRange(0, 1024),
    default=1,
    show_default=True,
    help="Worker processes; 0 takes all cores.",
)
scheduler = click.option(
    "--scheduler", metavar="ADDRESS", help="Run on an existing Dask cluster instead."
)
on_error = click.option(
    "--on-error",
    type=click.Choice(["stop", "skip"]),
    default="stop",
    show_default=True,
    help="What a bad item of a stream does; skip reports it and goes on.",
)


def stream_options(
    metavar: str, *, seeded: bool = True, required: bool = True
) -> Callable[[F], Callable[..., Any]]:
    """All options of a stage that maps over a stream, gathered in one argument `stream`.

    A stage that draws no random numbers is not `seeded`. Inputs may be `required`.
    """

    def decorate(function: F) -> Callable[..., Any]:
        @wraps(function)
        def gather(**values: Any) -> Any:
            names = StreamOptions.__dataclass_fields__
            taken = {name: values.pop(name) for name in names if name in values}
            return function(stream=StreamOptions(**{"seed": None, **taken}), **values)

        options = [
            inputs(metavar, required),
            output,
            *([seed] if seeded else []),
            jobs,
            scheduler,
            on_error,
        ]
        decorated: Callable[..., Any] = gather
        for option in reversed(options):
            decorated = option(decorated)
        return decorated

    return decorate
