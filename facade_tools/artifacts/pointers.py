"""Where in a hand-written file a JSON pointer leads to."""

from __future__ import annotations

from typing import Any

from ..errors import InvalidInput, Place


def escaped(key: str) -> str:
    """Return a key as a part of a JSON pointer."""
    return key.replace("~", "~0").replace("/", "~1")


def line_of(data: bytes, pointer: str) -> int | None:
    """Return the line (from 1) of what a JSON pointer leads to in YAML or JSON text.

    Of a value with a key it is the key's line. A pointer that leads nowhere gives the line of the
    last value on its way; text that cannot be read gives None.
    """
    import yaml

    try:
        node: Any = yaml.compose(data, Loader=yaml.SafeLoader)
    except (yaml.YAMLError, ValueError, RecursionError):
        return None
    if node is None:
        return None
    line = node.start_mark.line
    for part in pointer.strip("/").split("/") if pointer.strip("/") else []:
        key, node = _child(node, part.replace("~1", "/").replace("~0", "~"))
        if node is None:
            break
        line = key.start_mark.line
    return int(line) + 1


def _child(node: Any, part: str) -> tuple[Any, Any]:
    """Return the node of a part's key (of an entry of a list, the entry) and of its value."""
    import yaml

    if isinstance(node, yaml.MappingNode):
        return next((row for row in node.value if str(row[0].value) == part), (None, None))
    if isinstance(node, yaml.SequenceNode) and part.isdigit() and int(part) < len(node.value):
        return node.value[int(part)], node.value[int(part)]
    return None, None


def located(error: InvalidInput, data: bytes, source: str) -> InvalidInput:
    """Return the error with the file and, told by its pointer, the line."""
    place = error.place
    line = line_of(data, place.pointer) if place.line is None and place.pointer else place.line
    return InvalidInput(error.message, Place(place.source or source, line, place.pointer))
