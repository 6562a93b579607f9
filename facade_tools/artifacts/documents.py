"""Text to plain JSON data and back to typed artifacts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from math import isfinite
from typing import Any, ClassVar, Protocol

from ..errors import InvalidInput, Place
from .codec import from_json, to_json
from .numbers import parse_float
from .pointers import escaped
from .validation import check

# Kind of artifact -> module and class. The modules load when an artifact of the kind does.
KINDS: dict[str, str] = {
    "attributes": "attributes:Attributes",
    "blocks": "blocks:Blocks",
    "building": "building:Building",
    "derivation": "derivation:Derivation",
    "design": "design:Design",
    "footprint": "footprint:Footprint",
    "grammar": "grammar:Grammar",
    "layout": "layout:Layout",
    "library": "library:Library",
    "model": "model:Model",
    "parse": "parse:Parse",
    "shape-grammar": "shape_grammar:ShapeGrammar",
    "stylesheet": "stylesheet:StyleSheet",
}

MAX_YAML_BYTES = 4 << 20


class Artifact(Protocol):
    """What every artifact has: the kind (its class's name on disk)."""

    kind: ClassVar[str]


def parse_json(data: bytes, unique: bool = False) -> Any:
    """Return the JSON value of `data` (UTF-8). Raises InvalidInput with the line of an error.

    unique: refuse a key that stands twice, of which the last one counts otherwise (a tenth slower).
    """
    pairs = _refuse_doubled if unique else None
    try:
        text = data.decode("utf-8-sig")
        return json.loads(
            text,
            parse_float=parse_float,
            parse_constant=_refuse_constant,
            object_pairs_hook=pairs,
        )
    except json.JSONDecodeError as error:
        line = error.lineno if text.count("\n") > 1 else None
        at = f"column {error.colno}"
        raise InvalidInput(f"not valid JSON: {error.msg} ({at})", Place(line=line)) from None
    except UnicodeDecodeError as error:
        raise InvalidInput(f"not UTF-8 text (byte {error.start}); expected JSON") from None
    except RecursionError:
        raise InvalidInput("nested too deeply; expected an artifact") from None
    except ValueError as error:
        raise InvalidInput(f"not valid JSON: {error}") from None


def _refuse_doubled(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise InvalidInput(f"key {twice!r} stands twice; expected it once")
    return found


def _refuse_constant(name: str) -> float:
    raise InvalidInput(f"{name} is not a JSON number; expected a finite number or null")


def parse_yaml(data: bytes) -> Any:
    """Return the value of hand-written YAML; aliases and duplicate keys are refused."""
    import yaml

    if len(data) > MAX_YAML_BYTES:
        raise InvalidInput(f"larger than {MAX_YAML_BYTES >> 20} MiB; expected a hand-written file")
    try:
        return yaml.load(data, Loader=_yaml_loader())
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        place = Place(line=None if mark is None else mark.line + 1)
        raise InvalidInput(f"not valid YAML: {error.problem}", place) from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InvalidInput(f"not valid YAML: {error}".split("\n")[0]) from None


def check_finite(value: Any, pointer: str = "") -> None:
    """Raise InvalidInput, with the pointer, where a YAML value holds `.nan` or `.inf`."""
    if isinstance(value, float) and not isfinite(value):
        raise InvalidInput(f"{value} is no finite number; expected one, or null", pointer=pointer)
    if isinstance(value, dict | list):
        rows = value.items() if isinstance(value, dict) else enumerate(value)
        for key, item in rows:
            check_finite(item, f"{pointer}/{escaped(str(key))}")


@cache
def _yaml_loader() -> Any:
    import yaml

    class Loader(yaml.SafeLoader):
        """Safe loader without aliases (a few bytes of which fill any memory)."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                event: Any = self.get_event()
                raise yaml.MarkedYAMLError(None, None, "aliases are refused", event.start_mark)
            return super().compose_node(parent, index)

        def construct_mapping(self, node: Any, deep: bool = False) -> Any:
            seen: set[str] = set()
            for key, _ in node.value:
                if str(key.value) in seen:
                    problem = f"key {key.value!r} stands twice"
                    raise yaml.MarkedYAMLError(None, None, problem, key.start_mark)
                seen.add(str(key.value))
            return super().construct_mapping(node, deep)

        def construct_yaml_float(self, node: Any) -> Any:
            value = super().construct_yaml_float(node)
            return parse_float(repr(value)) if isfinite(value) else value

    tag = "tag:yaml.org,2002:float"
    Loader.add_constructor(tag, Loader.construct_yaml_float)
    return Loader


def artifact_class(kind: str) -> type[Any]:
    """Return the dataclass of a kind of artifact."""
    module, name = KINDS[kind].split(":")
    cls: type[Any] = getattr(import_module(f".{module}", __package__), name)
    return cls


def kind_of(document: Any, expected: tuple[str, ...]) -> str:
    """Return the artifact kind of `document`; raises InvalidInput unless it is `expected`."""
    wanted = _wanted(expected)
    if isinstance(document, list):
        raise InvalidInput(f"is a JSON list; expected {wanted} (several: one a line of a .jsonl)")
    if not isinstance(document, dict):
        found = type(document).__name__
        raise InvalidInput(f"is a JSON {found}; expected an object with schema {wanted}")
    schema = document.get("schema")
    if schema is None:
        raise InvalidInput(f'has no "schema"; expected {wanted}', pointer="/schema")
    for kind in expected:
        if schema == f"facade-tools/{kind}/1":
            return kind
    raise InvalidInput(f"is {str(schema)[:80]!r}; expected {wanted}", pointer="/schema")


def _wanted(expected: tuple[str, ...]) -> str:
    if len(expected) == len(KINDS):
        return f"facade-tools/KIND/1 with KIND one of {', '.join(expected)}"
    return " or ".join(f"facade-tools/{kind}/1" for kind in expected)


def decode(document: Any, *expected: str) -> Any:
    """Return the typed artifact of schema-checked `document`, one of the kinds `expected`."""
    kind = kind_of(document, expected or tuple(KINDS))
    check(document, kind)
    return from_json(artifact_class(kind), document)


def encode(artifact: Artifact) -> dict[str, Any]:
    """Return plain JSON data of an artifact, its `schema` first."""
    body: Mapping[str, Any] = to_json(artifact)
    return {"schema": f"facade-tools/{artifact.kind}/1", **body}
