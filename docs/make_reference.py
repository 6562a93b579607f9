"""Write docs/cli-reference.md from the help texts and docs/artifacts.md from the schemas."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from facade_tools.artifacts.validation import schema, schema_names
from facade_tools.cli._group import STAGES
from facade_tools.cli.main import facade

DOCS = Path(__file__).parent
WIDTH = 96


def cli_reference() -> str:
    """Return the page of the command line: the group's help, then every stage's."""
    settings: dict[str, Any] = {**facade.context_settings, "max_content_width": WIDTH}
    root = click.Context(facade, info_name="facade", terminal_width=WIDTH, **settings)
    parts = [
        "# Command line reference\n",
        "Written by `make docs` from the help texts.\n",
        _block(facade.get_help(root)),
    ]
    for name in STAGES:
        command = facade.get_command(root, name)
        assert command is not None
        context = click.Context(command, parent=root, info_name=name, terminal_width=WIDTH)
        parts += [f"## facade {name}\n", _block(command.get_help(context))]
    return "\n".join(parts)


def _block(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```\n"


def artifacts() -> str:
    """Return the page of the artifacts: every field of every schema with its meaning."""
    parts = ["# Artifacts\n", "Written by `make docs` from `schemas/`.\n"]
    for name in schema_names():
        document = schema(name)
        parts += [f"## {name}\n", f"{document['description']}.\n"]
        parts += ["| field | type | meaning |", "| --- | --- | --- |"]
        parts += [f"| `{field}` | {kind} | {text} |" for field, kind, text in _rows(document)]
        parts += [""]
    return "\n".join(parts)


def _rows(document: dict[str, Any]) -> Iterator[tuple[str, str, str]]:
    yield from _fields(document, "")
    for name, node in document.get("$defs", {}).items():
        yield name, _type(node), f"*definition* {_text(node)}"
        yield from _fields(node, f"{name}.")


def _fields(node: dict[str, Any], prefix: str) -> Iterator[tuple[str, str, str]]:
    for name, field in node.get("properties", {}).items():
        required = " (required)" if name in node.get("required", ()) else ""
        yield f"{prefix}{name}", _type(field), _text(field) + required
        yield from _fields(field, f"{prefix}{name}.")
        if isinstance(field.get("items"), dict):
            yield from _fields(field["items"], f"{prefix}{name}[].")


def _type(node: dict[str, Any]) -> str:
    if "$ref" in node:
        return str(node["$ref"]).rsplit("/", 1)[-1].removesuffix(".schema.json")
    if "enum" in node:
        return ", ".join(str(value) for value in node["enum"])
    if "const" in node:
        return str(node["const"])
    kind = node.get("type", "any")
    return " or ".join(kind) if isinstance(kind, list) else str(kind)


def _text(node: dict[str, Any]) -> str:
    return str(node.get("description", "")).replace("|", "\\|")


PAGES = {"cli-reference.md": cli_reference, "artifacts.md": artifacts}

if __name__ == "__main__":
    for page, write in PAGES.items():
        (DOCS / page).write_text(write(), encoding="utf-8")
