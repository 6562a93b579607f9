"""Running `facade import`: records in order through the importer, rules counted at the end."""

from __future__ import annotations

import hashlib
import logging
from array import array
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from facade_tools.artifacts.documents import parse_yaml
from facade_tools.artifacts.store import unreadable
from facade_tools.errors import InvalidInput
from facade_tools.formats.assessor import parse_columns
from facade_tools.formats.importing import Importer, Written, items
from facade_tools.formats.reading import ReadOptions
from facade_tools.parallel import Outcome, map_ordered

from ._options import StreamOptions
from ._report import Progress
from ._stream import Faults, Write, open_sink

logger = logging.getLogger("facade_tools.import")


def run_import(options: ReadOptions, stream: StreamOptions) -> None:
    """Import all inputs; raises the first error, or after --on-error skip the last."""
    importer = Importer(options, _recorded(options), _converter(options))
    outcomes = map_ordered(
        importer, items(stream.inputs, options), jobs=stream.jobs, scheduler=stream.scheduler
    )
    faults = Faults("import", stream.on_error)
    tally = _Tally(faults)
    progress = Progress("import")
    with open_sink(stream.output) as write:
        for outcome in outcomes:
            tally.take(outcome, write)
            progress.advance()
        progress.close()
    tally.report()
    faults.complain()


def read_columns(path: str | None) -> dict[str, Any] | None:
    """Return the column mapping of a YAML or JSON file; raises InvalidInput unless it is one."""
    if path is None:
        return None
    try:
        mapping = parse_yaml(Path(path).read_bytes())
        if not isinstance(mapping, dict):
            raise InvalidInput("is no mapping; expected the names of columns")
        parse_columns(mapping)
    except OSError as error:
        raise unreadable(path, error) from None
    except InvalidInput as error:
        raise error.at(path) from None
    return mapping


def _recorded(options: ReadOptions) -> dict[str, Any]:
    said = {"as": options.kind, "metres": options.metres, "columns": options.columns}
    return {"front": options.front, **{name: value for name, value in said.items() if value}}


def _converter(options: ReadOptions) -> Callable[[Any], Any] | None:
    if options.kind != "attributes":
        return None
    from facade_tools.exteriors.attributes import building_attributes

    return building_attributes


class _Tally:
    """Writes what was read, and counts it, what was refused and which rules were applied."""

    def __init__(self, faults: Faults) -> None:
        """Start at nothing."""
        self.faults = faults
        self.kinds: Counter[str] = Counter()
        self.notes: Counter[str] = Counter()
        self.seen = _Ids()

    def take(self, outcome: Outcome[Written], write: Write) -> None:
        """Write one item's artifacts, or report its error."""
        if outcome.value is None:
            self.faults(outcome.error or InvalidInput("cannot be read"))
            return
        for identity, data in outcome.value.rows:
            if not self.seen.add(identity):
                message = f"id {identity!r} stands twice; expected unique ids"
                self.faults(InvalidInput(message, outcome.value.place))
                continue
            self.faults.guard(write, identity, data)
        self.kinds += outcome.value.kinds
        self.notes += outcome.value.notes

    def report(self) -> None:
        """Log what was read and every rule that was applied, with its count."""
        read = ", ".join(f"{count} {kind}" for kind, count in sorted(self.kinds.items()))
        level = logging.WARNING if self.notes or self.faults.count else logging.INFO
        logger.log(level, "import: read %s; refused %d", read or "nothing", self.faults.count)
        for note, count in sorted(self.notes.items()):
            logger.warning("import: %d × %s", count, note)


class _Ids:
    """The ids seen so far, as digests of 8 bytes: a million of them clash once in 10⁷ runs."""

    def __init__(self) -> None:
        """Start with none."""
        self._slots = array("Q", bytes(8 << 10))
        self._count = 0

    def add(self, identity: str) -> bool:
        """Put an id in; tell whether it is new."""
        digest = hashlib.blake2b(identity.encode(), digest_size=8).digest()
        if not self._put(int.from_bytes(digest) or 1):
            return False
        self._count += 1
        if 2 * self._count > len(self._slots):
            old, self._slots = self._slots, array("Q", bytes(16 * len(self._slots)))
            for key in filter(None, old):
                self._put(key)
        return True

    def _put(self, key: int) -> bool:
        last = len(self._slots) - 1  # their number is a power of two
        place = key & last
        while self._slots[place]:
            if self._slots[place] == key:
                return False
            place = (place + 1) & last
        self._slots[place] = key
        return True
