"""groups.yaml: which columns of a table form groups of continuous values, which are bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..artifacts.documents import parse_yaml
from ..artifacts.store import unreadable
from ..errors import InvalidInput
from .layout import UNBOUNDED
from .transforms import TRANSFORMS

KEYS = {"columns", "transform", "floor", "atoms"}
LONGEST_NAME = 200  # characters, as the schema of models says
ID = "id"  # the column that names the rows


@dataclass(frozen=True, slots=True)
class ColumnGroup:
    """Continuous columns under one hidden variable; floor None follows each column's spread."""

    columns: tuple[str, ...]
    transform: str = "identity"
    floor: float | None = None
    atoms: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Declaration:
    """groups.yaml.

    `groups: {name: [columns] or {columns, transform, floor, atoms}}, bits: {name: [columns]}`.
    """

    groups: Mapping[str, ColumnGroup]
    bits: Mapping[str, tuple[str, ...]]

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns that it names: of numbers, then of bits."""
        numbers = [name for group in self.groups.values() for name in group.columns]
        return (*numbers, *(name for names in self.bits.values() for name in names))


def read_declaration(path: str) -> Declaration:
    """Return groups.yaml. Raises InvalidInput with the pointer of what is wrong."""
    try:
        return _declaration(parse_yaml(Path(path).read_bytes()))
    except OSError as error:
        raise unreadable(path, error) from None
    except InvalidInput as error:
        raise error.at(path) from None


def _declaration(document: Any) -> Declaration:
    if not isinstance(document, dict) or set(document) - {"groups", "bits"}:
        raise InvalidInput("expected an object with groups and bits", pointer="/")
    groups, bits = document.get("groups") or {}, document.get("bits") or {}
    if not isinstance(groups, dict) or not isinstance(bits, dict):
        raise InvalidInput("expected names with lists of columns", pointer="/groups")
    if not groups:
        raise InvalidInput("holds no group; expected one with columns", pointer="/groups")
    declaration = Declaration(
        {_name(name, "/groups"): _group(f"/groups/{name}", row) for name, row in groups.items()},
        {_name(name, "/bits"): _columns(f"/bits/{name}", row) for name, row in bits.items()},
    )
    _refuse_repeated(declaration)
    return declaration


def _group(pointer: str, value: Any) -> ColumnGroup:
    row = {"columns": value} if isinstance(value, list) else value
    if not isinstance(row, dict) or set(row) - KEYS:
        raise InvalidInput(f"expected columns, or an object of {sorted(KEYS)}", pointer=pointer)
    transform = row.get("transform", "identity")
    if not isinstance(transform, str) or transform not in TRANSFORMS:
        raise InvalidInput(f"expected one of {sorted(TRANSFORMS)}", pointer=f"{pointer}/transform")
    floor: Any = row.get("floor")
    atoms = row.get("atoms", [])
    if "floor" in row and not (_is_number(floor) and floor > 0):
        raise InvalidInput(f"{floor!r}; expected a number above 0", pointer=f"{pointer}/floor")
    if not isinstance(atoms, list) or not all(map(_is_number, atoms)):
        raise InvalidInput(f"{atoms!r}; expected a list of numbers", pointer=f"{pointer}/atoms")
    if len({f"{atom:g}" for atom in atoms}) < len(atoms):
        raise InvalidInput(f"{atoms!r}; expected different numbers", pointer=f"{pointer}/atoms")
    columns = _columns(pointer, row.get("columns"))
    return ColumnGroup(columns, transform, floor, tuple(map(float, atoms)))


def _columns(pointer: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not value:
        raise InvalidInput("expected a list of at least one column", pointer=pointer)
    return tuple(_name(name, pointer) for name in value)


def _name(value: Any, pointer: str) -> str:
    name = str(value)
    if isinstance(value, list | dict) or len(name) > LONGEST_NAME:
        expected = f"expected a name of at most {LONGEST_NAME} characters"
        raise InvalidInput(f"{name[:40]!r}; {expected}", pointer=pointer)
    return name


def _is_number(value: Any) -> bool:
    return type(value) is not bool and isinstance(value, int | float) and abs(value) < UNBOUNDED


def _refuse_repeated(declaration: Declaration) -> None:
    """Raise InvalidInput where a column stands in two places."""
    groups = {f"/groups/{name}": group.columns for name, group in declaration.groups.items()}
    bits = {f"/bits/{name}": columns for name, columns in declaration.bits.items()}
    taken: set[str] = set()
    for pointer, columns in {**groups, **bits}.items():
        for column in columns:
            if column in taken or column == ID:
                message = f"{column!r} names the rows" if column == ID else f"{column!r} is taken"
                raise InvalidInput(f"{message}; expected a column of its own", pointer=pointer)
            taken.add(column)
