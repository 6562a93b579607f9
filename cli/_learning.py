"""What learn and sample read: attributes, or buildings turned into them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.store import RawItem, digest, read_one, read_raw, read_whole
from facade_tools.artifacts.writing import check_target, write_bytes
from facade_tools.errors import InvalidInput, Place
from facade_tools.parallel import map_ordered

from ._options import StreamOptions
from ._report import Progress
from ._stream import Faults, is_folder, one_by_one, open_sink, write_result

if TYPE_CHECKING:
    from facade_tools.artifacts.attributes import Attributes
    from facade_tools.artifacts.model import Model
    from facade_tools.exteriors.holdout import BuildingRows
    from facade_tools.exteriors.holdout import Rows as LearningRows
    from facade_tools.exteriors.sample_lines import Lines
    from facade_tools.exteriors.table import TableRows

RUN = 4096  # samples that one generator draws


def item_attributes(item: RawItem) -> Attributes:
    """Return the attribute vector of an item: attributes, or a building turned into them."""
    from facade_tools.exteriors.attributes import building_attributes

    artifact = item.artifact("attributes", "building")
    return building_attributes(artifact) if artifact.kind == "building" else artifact


@dataclass(frozen=True)
class Rows:
    """The attribute vectors of all inputs, where each stands, and a provenance entry an input."""

    attributes: list[Attributes]
    places: list[Place]
    sources: tuple[Source, ...]


def placed_attributes(item: RawItem) -> tuple[Attributes, Place]:
    """Return the attribute vector of an item and where it stands."""
    return item_attributes(item), Place(item.source, item.line)


def read_attributes(stream: StreamOptions, faults: Faults) -> Rows:
    """Return the attribute vectors of mixed streams.

    Bad items, and ids that stand twice, go to `faults`.
    """
    rows: dict[str, tuple[Attributes, Place]] = {}
    sources = []
    for path in stream.inputs:
        running = hashlib.sha256()
        items = _hashed(read_raw([path]), running)
        outcomes = map_ordered(
            placed_attributes, items, jobs=stream.jobs, scheduler=stream.scheduler
        )
        with closing(outcomes):
            for outcome in outcomes:
                error = outcome.error or _add(rows, outcome.value)
                if error is not None:
                    faults(error)
        sources.append(Source(RawItem(path, None, b"").provenance().name, running.hexdigest()))
    attributes = [row for row, _ in rows.values()]
    return Rows(attributes, [place for _, place in rows.values()], tuple(sources))


def _add(
    rows: dict[str, tuple[Attributes, Place]], read: tuple[Attributes, Place] | None
) -> Exception | None:
    if read is None:
        return None
    row, place = read
    if row.id in rows:
        return InvalidInput(f"id {row.id!r} stands twice; expected unique ids", place)
    rows[row.id] = read
    return None


def _hashed(items: Iterator[RawItem], running: Any) -> Iterator[RawItem]:
    for item in items:
        running.update(item.data)
        yield item


def read_tables(stream: StreamOptions) -> list[RawItem]:
    """Return the bytes of tables: files, or standard input."""
    return [read_whole(path) for path in stream.inputs]


def table_source(item: RawItem) -> Source:
    """Return name and digest of a table."""
    return item.provenance() if item.source == "-" else digest(item.source)


def load_model(path: str, *, tables: bool = False) -> tuple[Model, Source]:
    """Return a model and its provenance; raises InvalidInput where it is no sound model.

    tables: whether it may also be one of a table, which knows nothing of buildings.
    """
    from facade_tools.exteriors.declared import check_declared
    from facade_tools.exteriors.serialisation import layout_of, network_of

    model = read_one(path, "model")
    try:
        layout = layout_of(model)
        if not layout.is_table:
            check_declared(layout)
        elif not tables:
            raise InvalidInput("is a model of a table; expected one of buildings")
        network_of(model)
    except InvalidInput as error:
        raise error.at(path) from None
    return model, digest(path)


@dataclass(frozen=True)
class Drawing:
    """Draws a run of samples in any process; a run has a generator of its own."""

    model: Model
    given: Attributes | None
    provenance: Provenance
    seed: int
    style: int | None
    top: bool
    min_distance: float
    smooth: bool

    def runs(self, count: int) -> list[tuple[int, int]]:
        """Return first index and number of the runs; what looks at all samples is one run."""
        if self.top or self.min_distance > 0:
            return [(0, count)]
        return [(at, min(RUN, count - at)) for at in range(0, count, RUN)] or [(0, 0)]

    def __call__(self, run: tuple[int, int]) -> list[Lines]:
        """Return the samples of a run."""
        from facade_tools.exteriors.sample_lines import sample_lines
        from facade_tools.exteriors.samples import SampleOptions
        from facade_tools.randomness import item_generator

        start, count = run
        options = SampleOptions(
            self.style, self.top, self.min_distance, str(self.seed), start, smooth=self.smooth
        )
        rows = sample_lines(
            self.model,
            count,
            rng=item_generator(self.seed, "sample", start),
            given=self.given,
            options=options,
            provenance=self.provenance,
        )
        return list(rows)


def write_samples(
    drawing: Drawing, count: int, output: str | None, *, jobs: int, scheduler: str | None
) -> None:
    """Write `count` samples as a stream, each with its provenance; of a table's model, as CSV."""
    progress = Progress("sample")
    head = _head(drawing, output)
    outcomes = map_ordered(drawing, drawing.runs(count), jobs=jobs, scheduler=scheduler)
    with open_sink(output) as write, closing(outcomes):
        if head:
            write("", head)
        for outcome in outcomes:
            if outcome.error is not None:
                raise outcome.error
            for lines in outcome.value or []:
                for identity, data in lines.apart() if one_by_one(output) else [("", lines.data)]:
                    write(identity, data)
                progress.advance(lines.count)
    progress.close()


def _head(drawing: Drawing, output: str | None) -> bytes:
    """Return what stands before the samples: the header of a table, which must be one file."""
    from facade_tools.exteriors.serialisation import network_of
    from facade_tools.exteriors.table_samples import table_header

    layout = network_of(drawing.model).layout
    if not layout.is_table:
        return b""
    if output not in (None, "-") and Path(str(output)).suffix.lower() != ".csv":
        raise click.UsageError(f"{output}: samples of a table are a table; expected a .csv file")
    return table_header(layout)


def read_given(path: str | None) -> tuple[Attributes | None, tuple[Source, ...]]:
    """Return what is known of a building, from partial attributes or a partial building."""
    from facade_tools.exteriors.attributes import building_attributes

    if path is None:
        return None, ()
    artifact = read_one(path, "attributes", "building")
    known = building_attributes(artifact) if artifact.kind == "building" else artifact
    return known, (digest(path),)


def run_learn(
    stream: StreamOptions,
    variant: Any,
    faithful: bool,
    prior: str | None,
    restarts: int,
    holdout: int | None,
    report: str | None,
    groups: str | None,
) -> None:
    """Learn, compare and report as asked for, and write the model."""
    from facade_tools.exteriors.learning import LearnOptions
    from facade_tools.randomness import item_generator

    check_inputs(stream.inputs, prior, groups)
    check_outputs(stream.output, report)
    recorded = {"variant": variant, "faithful": faithful, "restarts": restarts}
    seed = stream.seed or 0
    faults = Faults("learn", stream.on_error)
    options = LearnOptions(variant, faithful, restarts)
    rows: LearningRows
    if groups is not None:
        rows, sources = table_to_learn(stream, groups, faults)
    else:
        rows, sources = buildings_to_learn(stream, faults)
    if prior is not None:
        more, origin = buildings_to_learn(replace(stream, inputs=(prior,)), faults)
        options = replace(options, prior_rows=more.attributes)
        sources += origin
    model = rows.learn(range(len(rows)), options, rng=item_generator(seed, "learn"))
    table = compare(rows, options, holdout, seed) if holdout else ()
    if report is not None:
        write_report(model, rows, table, report, seed)
    provenance = Provenance("learn", seed, recorded, sources)
    write_result(replace(model, provenance=provenance), stream.output)
    faults.complain()


def buildings_to_learn(
    stream: StreamOptions, faults: Faults
) -> tuple[BuildingRows, tuple[Source, ...]]:
    """Return buildings or attributes as rows to learn from, and their provenance."""
    from facade_tools.exteriors.holdout import BuildingRows

    read = read_attributes(stream, faults)
    return BuildingRows(read.attributes), read.sources


def table_to_learn(
    stream: StreamOptions, groups: str, faults: Faults
) -> tuple[TableRows, tuple[Source, ...]]:
    """Return tables as rows to learn from, and their provenance."""
    from facade_tools.exteriors.table import table_rows

    items = read_tables(stream)
    return table_rows(items, groups, faults), (*map(table_source, items), digest(groups))


def check_inputs(inputs: Sequence[str], prior: str | None, groups: str | None) -> None:
    """Raise UsageError on a table without groups, and on groups with a prior of buildings."""
    tables = [path for path in inputs if path.lower().endswith(".csv")]
    if groups is None and tables:
        raise click.UsageError(f"{tables[0]}: a table needs --groups, which columns form groups")
    if groups is not None and prior is not None:
        raise click.UsageError("--prior is of buildings; a table (--groups) has none")


def check_outputs(output: str | None, report: str | None) -> None:
    """Raise UsageError or OutputFailed, before anything is learned, where no output could be."""
    files = [] if output in (None, "-") or is_folder(str(output)) else [Path(str(output))]
    if report is not None:
        files.append(Path(report))
    if len({path.resolve() for path in files}) < len(files):
        raise click.UsageError(f"{report}: expected another file for the report than for the model")
    for path in files:
        check_target(path)


def compare(rows: LearningRows, options: Any, splits: int, seed: int) -> Any:
    """Print the held-out table of all variants on standard error and return it."""
    from facade_tools.exteriors.holdout import compare_variants, table_lines, training_curve

    table = compare_variants(rows, splits, seed=seed, options=options)
    for line in table_lines(table):
        click.echo(line, err=True)
    for size, nll in training_curve(rows, seed=seed, options=options):
        click.echo(f"{size:6d} training rows: {nll:9.3f}", err=True)
    return table


def write_report(model: Model, rows: LearningRows, table: Any, path: str, seed: int) -> None:
    """Write the HTML report of a model; of buildings, with two of each style."""
    from facade_tools.exteriors.report import report_page
    from facade_tools.exteriors.serialisation import network_of
    from facade_tools.exteriors.style_pictures import style_pictures

    layout = network_of(model).layout
    pictures = [] if layout.is_table else list(style_pictures(model, seed=seed))
    page = report_page(model, rows.under(layout), table, seed=seed, pictures=pictures)
    write_bytes(Path(path), page.encode())
