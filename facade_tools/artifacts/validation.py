"""JSON Schema checks: a compiled validator gives the verdict, jsonschema words the error."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

import jsonschema_rs

from ..errors import InvalidInput
from .numbers import plain
from .pointers import escaped

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError

LONGEST_VALUE = 60


def schema_names() -> list[str]:
    """Return the names of all shipped schemas, `common` included."""
    suffix = ".schema.json"
    names = (entry.name for entry in resources.files("facade_tools.schemas").iterdir())
    return sorted(name.removesuffix(suffix) for name in names if name.endswith(suffix))


@cache
def schema(name: str) -> dict[str, Any]:
    """Return the schema called `name`, e.g. `building`."""
    path = resources.files("facade_tools.schemas") / f"{name}.schema.json"
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return document


def check(document: Any, kind: str) -> None:
    """Raise InvalidInput, with the JSON pointer, where `document` breaks the schema of `kind`."""
    validator = _validator(kind)
    if _is_valid(validator, document):
        return
    document = plain(document)
    if not validator.is_valid(document):
        raise _explain(document, kind)


def _is_valid(validator: jsonschema_rs.Draft202012Validator, document: Any) -> bool:
    try:
        return validator.is_valid(document)
    except ValueError:  # the compiled validator knows no subclass of float
        return False


@cache
def _validator(kind: str) -> jsonschema_rs.Draft202012Validator:
    resolved = [(schema(name)["$id"], schema(name)) for name in _closure(kind)]
    registry = jsonschema_rs.Registry(resolved)
    return jsonschema_rs.Draft202012Validator(schema(kind), registry=registry)


def _closure(kind: str) -> Iterator[str]:
    """Yield the schemas that `kind` refers to, itself included."""
    seen: set[str] = set()
    todo = [kind]
    while todo:
        name = todo.pop()
        if name not in seen:
            seen.add(name)
            todo.extend(_references(schema(name)))
            yield name


def _references(node: Any) -> Iterator[str]:
    if isinstance(node, dict):
        target = node.get("$ref", "")
        if isinstance(target, str) and not target.startswith("#") and target:
            yield target.split(".schema.json")[0]
        node = list(node.values())
    if isinstance(node, list):
        for item in node:
            yield from _references(item)


def _explain(document: Any, kind: str) -> InvalidInput:
    from jsonschema import Draft202012Validator
    from jsonschema.exceptions import best_match
    from referencing import Registry, Resource

    resources_ = [(schema(n)["$id"], Resource.from_contents(schema(n))) for n in _closure(kind)]
    registry: Registry[Any] = Registry().with_resources(resources_)
    errors = Draft202012Validator(schema(kind), registry=registry).iter_errors(document)
    error = best_match(errors)
    if error is None:  # the two libraries disagree on a corner of the standard
        return InvalidInput(f"does not match the schema of {kind}")
    return InvalidInput(_wording(error), pointer=_pointer(error))


def _pointer(error: ValidationError) -> str:
    """Return the pointer to what is wrong: of keys that no schema knows, to the first one."""
    parts = [*map(str, error.absolute_path)]
    if error.validator == "additionalProperties" and error.validator_value is False:
        rules: Any = error.schema
        document: Any = error.instance
        parts += [key for key in document if key not in rules.get("properties", {})][:1]
    return "".join(f"/{escaped(part)}" for part in parts) or "/"


def _wording(error: ValidationError) -> str:
    found = json.dumps(error.instance, ensure_ascii=False, default=str)
    message = error.message
    if len(found) > LONGEST_VALUE:
        message = message.replace(repr(error.instance), found[:LONGEST_VALUE] + "…")
    if len(message) > 4 * LONGEST_VALUE:
        message = message[: 4 * LONGEST_VALUE] + "…"
    expected = error.schema.get("description") if isinstance(error.schema, dict) else None
    return f"{message}; expected: {expected}" if expected else message
