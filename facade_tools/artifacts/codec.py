"""Between plain JSON data and the artifacts' dataclasses.

Decoders and encoders are derived once from a class's annotations. They trust their input:
the schema has been checked before (`store.py`), so no type is checked twice.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeVar, Union, get_args, get_origin

from ..errors import InvalidInput
from .numbers import Given
from .pointers import escaped

T = TypeVar("T")
Convert = Callable[[Any], Any]

MOST_NESTED = 64  # levels of a free field: deeper ones exhaust the stack of who writes them

_PLAIN = frozenset({float, int, str, bool, Given, type(None)})


def from_json(cls: type[T], document: Mapping[str, Any]) -> T:
    """Build the dataclass `cls` from schema-checked JSON data.

    Keys that are no field are ignored; null stands for the field's default. Raises InvalidInput,
    with the pointer to the document's own field, where a free one is nested too deeply.
    """
    decoder = _object_decoder(typing.cast("Any", cls))
    try:
        return decoder(document)  # type: ignore[no-any-return]
    except _TooDeep:
        nested = {name: item for name, item in document.items() if type(item) in (dict, list)}
        name = next(name for name, item in nested.items() if _deep(item, MOST_NESTED))
        message = f"is nested too deeply; expected at most {MOST_NESTED} levels"
        raise InvalidInput(message, pointer=f"/{escaped(name)}") from None


class _TooDeep(Exception):
    """A free field with too many levels."""


def _deep(items: Any, levels: int) -> bool:
    """Tell whether a list or object of JSON data has more than so many levels, itself counted."""
    for item in items.values() if type(items) is dict else items:
        kind = type(item)
        if (kind is dict or kind is list) and (levels <= 1 or _deep(item, levels - 1)):
            return True
    return False


def to_json(value: Any) -> Any:
    """Return plain JSON data of a dataclass tree; fields equal to their default are left out.

    A field whose metadata holds `keep` is written even then.
    """
    kind: Any = type(value)
    if kind in _PLAIN:
        return value
    if kind is tuple or kind is list:
        return [to_json(item) for item in value]
    if kind is dict:
        return {key: to_json(item) for key, item in value.items()}
    if dataclasses.is_dataclass(value):
        return _object_encoder(kind)(value)
    return value


@cache
def _object_encoder(cls: Any) -> Convert:
    rows = [
        (field.name, _default(field), bool(field.metadata.get("keep")))
        for field in dataclasses.fields(cls)
    ]
    name_of_kind = getattr(cls, "kind", None)  # an artifact, also inside another one
    head = {"schema": f"facade-tools/{name_of_kind}/1"} if isinstance(name_of_kind, str) else {}

    def encode(value: Any) -> dict[str, Any]:
        out: dict[str, Any] = dict(head)
        for name, default, keep in rows:
            item = getattr(value, name)
            if keep or (item is not default and item != default):
                out[name] = item if type(item) in _PLAIN else to_json(item)
        return out

    return encode


def _default(field: dataclasses.Field[Any]) -> Any:
    factory = field.default_factory
    return field.default if factory is dataclasses.MISSING else factory()


@cache
def _object_decoder(cls: Any) -> Convert:
    hints = typing.get_type_hints(cls)
    fields = [field for field in dataclasses.fields(cls) if field.init]
    decoders = {
        field.name: _deferred(hint) if _mentions(hint, cls) else _decoder(hint)
        for field in fields
        for hint in [hints[field.name]]
    }
    plain = frozenset(name for name, decode in decoders.items() if decode is None)
    nested = {name: decode for name, decode in decoders.items() if decode is not None}
    known = frozenset(decoders)

    def decode(document: Mapping[str, Any]) -> Any:
        values = {name: item for name, item in document.items() if name in plain}
        if len(values) < len(document):
            for name, item in document.items():
                if name in nested and item is not None:
                    values[name] = nested[name](item)
        return cls(**values)

    return decode if known else lambda _: cls()


def _mentions(hint: Any, cls: Any) -> bool:
    return hint is cls or any(_mentions(argument, cls) for argument in get_args(hint))


def _deferred(hint: Any) -> Convert:
    """Return the converter of a tree's own kind of node, made when the first node comes."""

    def decode(item: Any) -> Any:
        decoder = _decoder(hint)
        return item if decoder is None else decoder(item)

    return decode


def _decoder(hint: Any) -> Convert | None:
    """Return the converter of one annotation, or None where JSON data passes as it is."""
    origin = get_origin(hint)
    if dataclasses.is_dataclass(hint):
        return _object_decoder(typing.cast("Any", hint))
    if origin in (Union, types.UnionType):
        return _optional_decoder(hint)
    if origin is tuple:
        return _tuple_decoder(get_args(hint))
    if origin in (dict, Mapping) or (isinstance(origin, type) and issubclass(origin, Mapping)):
        return _mapping_decoder(get_args(hint)[1])
    return None


def _optional_decoder(hint: Any) -> Convert | None:
    (inner,) = (arg for arg in get_args(hint) if arg is not type(None))
    decode = _decoder(inner)
    return None if decode is None else lambda item: None if item is None else decode(item)


def _tuple_decoder(arguments: tuple[Any, ...]) -> Convert:
    decode = _decoder(arguments[0])
    return tuple if decode is None else lambda items: tuple(map(decode, items))


def _mapping_decoder(value_hint: Any) -> Convert:
    decode = _decoder(value_hint)
    if value_hint in (Any, object):
        return _free
    if decode is None:
        return dict
    return lambda items: {key: decode(item) for key, item in items.items()}


def _free(items: Mapping[str, Any]) -> dict[str, Any]:
    """Return a free field as it is. Raises _TooDeep."""
    if _deep(items, MOST_NESTED):
        raise _TooDeep
    return dict(items)
