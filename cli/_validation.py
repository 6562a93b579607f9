"""The body of `facade validate`: schema first, then the rules of the kind."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from contextlib import closing
from typing import Any, NamedTuple

import click

from facade_tools.artifacts.documents import KINDS, decode, kind_of
from facade_tools.artifacts.store import RawItem, read_raw
from facade_tools.errors import InvalidInput
from facade_tools.parallel import map_ordered

from ._options import StreamOptions
from ._report import Progress
from ._stream import is_single, open_sink
from ._tables import RULES, load


class Finding(NamedTuple):
    """One line of the report."""

    file: str
    line: int | None
    id: str
    pointer: str
    message: str

    def text(self) -> str:
        """Return the finding as people read it."""
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        return ": ".join(part for part in (place, self.pointer, self.message) if part)


def run_validation(stream: StreamOptions, form: str) -> None:
    """Check all inputs and write the findings; raises InvalidInput if there is any."""
    if is_single(stream.output):
        text = f"{stream.output}: findings are one a line; name a .txt or .jsonl file"
        raise click.UsageError(text)
    items = read_raw(stream.inputs)
    outcomes = map_ordered(findings, items, jobs=stream.jobs, scheduler=stream.scheduler)
    progress = Progress("validate")
    count = bad = 0
    with open_sink(stream.output, ".txt") as write, closing(outcomes):
        for outcome in outcomes:
            if outcome.error is not None:
                raise outcome.error
            count += 1
            bad += bool(outcome.value)
            for finding in outcome.value or []:
                write("findings", _line(finding, form))
            progress.advance()
        progress.close()
    if bad:
        raise InvalidInput(f"{bad} of {count} artifacts break a rule")


def _line(finding: Finding, form: str) -> bytes:
    row = json.dumps(finding._asdict(), ensure_ascii=False) if form == "json" else finding.text()
    return f"{row}\n".encode()


def findings(item: RawItem) -> list[Finding]:
    """Return all that is wrong with one item."""
    identity = ""
    try:
        document = item.document(unique=True)
        identity = str(document.get("id", "")) if isinstance(document, dict) else ""
        kind = kind_of(document, tuple(KINDS))
        artifact = decode(document, kind)
        problems: Iterable[tuple[str, str]] = _rules(kind)(artifact)
        return [Finding(item.source, item.line, identity, *problem) for problem in problems]
    except InvalidInput as error:
        place = error.at(item.source, item.line).place
        return [Finding(place.source, place.line, identity, place.pointer, error.message)]


def _rules(kind: str) -> Callable[[Any], Iterable[tuple[str, str]]]:
    if kind not in RULES:
        return lambda _: ()
    return load(RULES[kind])
