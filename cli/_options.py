"""Options that several stages share, declared once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
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


# Options of stages that name what is written beside the output.
RESULTS = ("report", "sheet", "tree", "raw_labels", "overlay")


def refuse_overwriting(read: Iterable[str | None], written: Iterable[str | None]) -> None:
    """Raise UsageError where a file that is written is one that is read, or is written twice.

    None, `-` and "" are no files.
    """
    sources = {os.path.realpath(path) for path in read if path not in (None, "-") and path}
    seen: set[str] = set()
    for path in written:
        if not path or path == "-":
            continue
        place = os.path.realpath(path)
        if place in sources:
            raise click.UsageError(f"{path}: is an input and would be overwritten; name another")
        if place in seen:
            raise click.UsageError(f"{path}: would be written twice; name another")
        seen.add(place)


def _refuse_own_inputs(stream: StreamOptions, values: Mapping[str, Any]) -> None:
    """Raise UsageError where a stage would overwrite an input, or a file that an option names."""
    named = [value for name, value in values.items() if name not in (*RESULTS, "labels")]
    files = [value for value in named if isinstance(value, str) and os.path.isfile(value)]
    for target in (stream.output, *(values.get(name) for name in RESULTS)):
        refuse_overwriting([*stream.inputs, *files], [target])


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


def output_to(what: str) -> Callable[[F], F]:
    """Return the option -o of a command that does not write without it; what it names."""

    def given(ctx: click.Context, param: click.Parameter, value: str | None) -> str:
        if value is None:
            raise click.UsageError(f"Missing option '-o': name {what}.", ctx)
        return str(_named(ctx, param, value))

    help_text = f"Where to write: {what}."
    return click.option("-o", "--output", metavar="PATH", callback=given, help=help_text)


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
mesh_up = click.option(
    "--up",
    type=click.Choice(["auto", "y", "z"]),
    default="auto",
    show_default=True,
    help="Which axis of an OBJ, PLY, STL or OFF is up; auto asks the textures.",
)
mesh_unit = click.option(
    "--unit",
    type=click.Choice(["m", "cm", "mm", "ft", "in"]),
    default="m",
    show_default=True,
    help="Unit of an OBJ, PLY, STL or OFF; glTF and COLLADA say theirs.",
)


def stream_options(
    metavar: str, *, seeded: bool = True, required: bool = True, to: str | None = None
) -> Callable[[F], Callable[..., Any]]:
    """All options of a stage that maps over a stream, gathered in one argument `stream`.

    A stage that draws no random numbers is not `seeded`. Inputs may be `required`. to: what -o
    names, of a stage that does not write without it.
    """

    def decorate(function: F) -> Callable[..., Any]:
        @wraps(function)
        def gather(**values: Any) -> Any:
            names = StreamOptions.__dataclass_fields__
            taken = {name: values.pop(name) for name in names if name in values}
            stream = StreamOptions(**{"seed": None, **taken})
            _refuse_own_inputs(stream, values)
            return function(stream=stream, **values)

        options = [
            inputs(metavar, required),
            output if to is None else output_to(to),
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
