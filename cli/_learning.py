"""What learn and sample read: attributes, or buildings turned into them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import digest, read_all, read_one
from facade_tools.errors import InvalidInput

from ._report import Progress
from ._stream import open_sink, write_result

if TYPE_CHECKING:
    from facade_tools.artifacts.attributes import Attributes
    from facade_tools.artifacts.model import Model


def read_attributes(paths: Sequence[str]) -> tuple[list[Attributes], tuple[Source, ...]]:
    """Return the attribute vectors of mixed streams of buildings and attributes.

    Raises InvalidInput on ids that stand twice.
    """
    from facade_tools.exteriors.attributes import building_attributes

    artifacts, sources = read_all(paths, "attributes", "building")
    rows = [building_attributes(a) if a.kind == "building" else a for a in artifacts]
    seen: set[str] = set()
    for row in rows:
        if row.id in seen:
            raise InvalidInput(f"id {row.id!r} stands twice; expected unique ids")
        seen.add(row.id)
    return rows, sources


def load_model(path: str) -> tuple[Model, Source]:
    """Return a model and its provenance; raises InvalidInput where it is no sound model."""
    from facade_tools.exteriors.serialisation import network_of

    model = read_one(path, "model")
    try:
        network_of(model)
    except InvalidInput as error:
        raise error.at(path) from None
    return model, digest(path)


def write_samples(
    rows: Iterable[Attributes],
    output: str | None,
    seed: int,
    options: Mapping[str, Any],
    sources: tuple[Source, ...],
) -> None:
    """Write samples as a stream, each with its provenance."""
    provenance = Provenance("sample", seed, options, sources)
    progress = Progress("sample")
    with open_sink(output) as write:
        for row in rows:
            write(row.id, dump_line(encode(replace(row, provenance=provenance))))
            progress.advance()
    progress.close()


def read_given(path: str | None) -> tuple[Attributes | None, tuple[Source, ...]]:
    """Return what is known of a building, from partial attributes or a partial building."""
    from facade_tools.exteriors.attributes import building_attributes

    if path is None:
        return None, ()
    artifact = read_one(path, "attributes", "building")
    known = building_attributes(artifact) if artifact.kind == "building" else artifact
    return known, (digest(path),)


def run_learn(
    inputs: Sequence[str],
    output: str | None,
    seed: int,
    variant: Any,
    faithful: bool,
    prior: str | None,
    restarts: int,
    holdout: int | None,
    report: str | None,
    groups: str | None,
) -> None:
    """Learn, compare and report as asked for, and write the model."""
    from facade_tools.exteriors.learning import LearnOptions, learn_model
    from facade_tools.exteriors.table import learn_table
    from facade_tools.randomness import item_generator

    recorded = {"variant": variant, "faithful": faithful, "restarts": restarts}
    rng = item_generator(seed, "learn")
    if groups is not None:
        options = LearnOptions(variant=variant, faithful=faithful, restarts=restarts)
        model = learn_table(inputs, groups, rng=rng, options=options)
        sources = (*map(digest, inputs), digest(groups))
        rows: list[Attributes] = []
    else:
        rows, sources = read_attributes(inputs)
        more, extra = (None, ()) if prior is None else read_attributes([prior])
        options = LearnOptions(variant, faithful, restarts, prior_rows=more)
        model = learn_model(rows, rng=rng, options=options)
        sources += extra
    table = compare(rows, options, holdout, seed) if holdout and rows else ()
    if report is not None:
        write_report(model, rows, table, report, seed)
    provenance = Provenance("learn", seed, recorded, sources)
    write_result(replace(model, provenance=provenance), output)


def compare(rows: list[Attributes], options: Any, splits: int, seed: int) -> Any:
    """Print the held-out table of all variants on standard error and return it."""
    import click

    from facade_tools.exteriors.holdout import compare_variants, table_lines, training_curve

    table = compare_variants(rows, splits, seed=seed, options=options)
    for line in table_lines(table):
        click.echo(line, err=True)
    for size, nll in training_curve(rows, seed=seed, options=options):
        click.echo(f"{size:6d} training rows: {nll:9.3f}", err=True)
    return table


def write_report(model: Model, rows: list[Attributes], table: Any, path: str, seed: int) -> None:
    """Write the HTML report of a model."""
    from facade_tools.artifacts.writing import write_bytes
    from facade_tools.exteriors.report import report_page

    write_bytes(Path(path), report_page(model, rows, table, seed=seed).encode())
