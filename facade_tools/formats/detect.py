"""Which public format a file is in, told by its content and never by its name."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from ..errors import InvalidInput
from .reading import Build, Records


@dataclass(frozen=True, slots=True)
class Format:
    """One public format: its name, and the module with `detect`, `records` and `build`."""

    name: str
    module: str

    def _load(self) -> Any:
        return import_module(f".{self.module}", __package__)

    def detect(self, head: bytes) -> bool:
        """Tell whether a file that begins with `head` is in this format."""
        return bool(self._load().detect(head))

    @property
    def records(self) -> Records:
        """The function that cuts a file into records."""
        records: Records = self._load().records
        return records

    @property
    def build(self) -> Build:
        """The function that turns a record into artifacts."""
        build: Build = self._load().build
        return build


ARTIFACT_BYTES = 200  # in which an artifact names its schema

# The first that recognises a file reads it.
FORMATS = (
    Format("HOT2000", "hot2000"),
    Format("CityJSON", "cityjson_reader"),
    Format("CityGML", "citygml"),
    Format("GeoJSON", "geojson"),
    Format("HPXML", "hpxml"),
    Format("IFC", "ifc"),
    Format("OBJ with its artifact", "obj_reader"),
    Format("assessor table (CSV)", "assessor"),
)


def detect(head: bytes) -> Format:
    """Return the format of a file by its first bytes; raises InvalidInput for an unknown one."""
    head = head.removeprefix(b"\xef\xbb\xbf")
    for row in FORMATS:
        if row.detect(head):
            return row
    names = ", ".join(row.name for row in FORMATS)
    if not head.strip():
        raise InvalidInput(f"is empty; expected {names}")
    if b'"facade-tools/' in head[:ARTIFACT_BYTES]:
        raise InvalidInput("is an artifact already, which every stage reads; nothing to import")
    raise InvalidInput(f"is in no format that is known by its content; expected {names}")
