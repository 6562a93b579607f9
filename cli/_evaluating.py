"""The body of `facade evaluate`: rows of buildings or of a table, and their density."""

from __future__ import annotations

from typing import TYPE_CHECKING

from facade_tools.errors import InvalidInput

from ._learning import load_model, read_attributes, read_tables
from ._options import StreamOptions
from ._stream import Faults, open_sink

if TYPE_CHECKING:
    from facade_tools.exteriors.coordinates import Readings
    from facade_tools.exteriors.layout import Layout


def run_evaluate(path: str, stream: StreamOptions) -> None:
    """Write the negative log density of all rows in which the model sees anything."""
    from facade_tools.artifacts.numbers import dump_line
    from facade_tools.exteriors.evaluation import row_log_density
    from facade_tools.exteriors.serialisation import network_of

    network = network_of(load_model(path, tables=True)[0])
    faults = Faults("evaluate", stream.on_error)
    read = _table if network.layout.is_table else _buildings
    values = (-row_log_density(network, read(network.layout, stream, faults))).tolist()
    mean = sum(values) / len(values) if values else None
    with open_sink(stream.output) as write:
        write("evaluation", dump_line({"n": len(values), "nll": mean, "per_building": values}))
    faults.complain()


def _buildings(layout: Layout, stream: StreamOptions, faults: Faults) -> Readings:
    """Return what the model sees of buildings; those of which it sees nothing are faults."""
    from facade_tools.exteriors.coordinates import read_attributes as readings_of
    from facade_tools.exteriors.evaluation import nothing_observed, unseen

    read = read_attributes(stream, faults)
    readings = readings_of(read.attributes, layout)
    empty = nothing_observed(readings)
    for i in empty.nonzero()[0]:
        faults(InvalidInput(unseen(read.attributes[i]).message, read.places[i]))
    return readings.take(~empty)


def _table(layout: Layout, stream: StreamOptions, faults: Faults) -> Readings:
    """Return the rows of tables with the model's columns; empty ones are faults."""
    from facade_tools.exteriors.evaluation import nothing_observed
    from facade_tools.exteriors.table import (
        columns_of,
        layout_limits,
        read_table,
        readings_of,
        within,
    )

    table = read_table(read_tables(stream), columns_of(layout), faults, needed=True)
    table = within(table, layout_limits(layout), faults)
    readings = readings_of(table, layout)
    empty = nothing_observed(readings)
    for i in empty.nonzero()[0]:
        faults(InvalidInput("nothing is observed; expected a number", table.places[i]))
    return readings.take(~empty)
