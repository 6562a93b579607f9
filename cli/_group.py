"""The table of stages and the lazy group: `--help` loads no stage."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from typing import NamedTuple

import click


class Stage(NamedTuple):
    """One row of the table: module inside this package, section and one-line help."""

    module: str
    section: str
    help: str


CHAIN = "Stages"
SUPPORT = "Support"

STAGES: dict[str, Stage] = {
    "learn": Stage("learn", CHAIN, "Learn a model of buildings from examples."),
    "sample": Stage("sample", CHAIN, "Draw attribute vectors of new buildings from a model."),
    "massgen": Stage("massgen", CHAIN, "Attributes to mass models with roofs."),
    "facadegen": Stage("facadegen", CHAIN, "Put windows and doors on buildings."),
    "layer-solve": Stage("layer_solve", CHAIN, "Facades as a stack of layers of patterns."),
    "parse-image": Stage("parse_image", CHAIN, "Read photographs of facades by a grammar."),
    "reconstruct": Stage("reconstruct", CHAIN, "Textured buildings from parses and footprints."),
    "capture-style": Stage("capture_style", CHAIN, "The look of a textured building as a sheet."),
    "retarget": Stage("retarget", CHAIN, "Put a captured look onto another structure."),
    "attributes": Stage("attributes", SUPPORT, "Compute the 49 attributes of buildings."),
    "train-parser": Stage("train_parser", SUPPORT, "Train the pixel classifier of parse-image."),
    "sample-grammar": Stage("sample_grammar", SUPPORT, "Draw random facades of a split grammar."),
    "assemble": Stage("assemble", SUPPORT, "Parses of a building's sides to one building."),
    "derive": Stage("derive", SUPPORT, "Turn footprints into buildings by a shape grammar."),
    "rectify": Stage("rectify", SUPPORT, "Turn a photograph of a facade straight."),
    "evaluate": Stage("evaluate", SUPPORT, "Negative log density of buildings under a model."),
    "import": Stage("import_", SUPPORT, "Read buildings from public formats."),
    "export": Stage("export", SUPPORT, "Write OBJ, GLB or CityJSON."),
    "view": Stage("view", SUPPORT, "Draw any artifact of the chain."),
    "validate": Stage("validate", SUPPORT, "Check schema and geometry of any artifact."),
}


class StageGroup(click.Group):
    """A group whose commands are imported when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all stages, in the order of the table."""
        return list(STAGES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the stage's module and return its command."""
        if cmd_name not in STAGES:
            return None
        module = import_module(f".{STAGES[cmd_name].module}", __package__)
        command: click.Command = module.command
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return name, command and arguments of a stage; of a mistyped one tell the nearest."""
        if args[0] not in STAGES and not ctx.resilient_parsing:
            near = get_close_matches(args[0], STAGES, 1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            ctx.fail(f"No such stage {args[0]!r}.{hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the table of stages by section."""
        for section in (CHAIN, SUPPORT):
            rows = [(name, row.help) for name, row in STAGES.items() if row.section == section]
            with formatter.section(section):
                formatter.write_dl(rows)
