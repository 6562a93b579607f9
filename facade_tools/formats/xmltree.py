"""XML from strangers: no document types, no entities, no network; bounded size."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import BinaryIO
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import fromstring, iterparse

from ..errors import InvalidInput, Place


def parse(data: bytes) -> Element:
    """Return the root of a document, names without namespaces.

    Raises InvalidInput where it is not well-formed, or declares a document type or an entity.
    """
    try:
        root: Element = fromstring(data, forbid_dtd=True)
    except ParseError as error:
        raise _broken(error) from None
    except DefusedXmlException:
        raise InvalidInput("declares a document type or an entity; expected plain XML") from None
    except (LookupError, ValueError) as error:  # an encoding that Python lacks, or of many bytes
        raise InvalidInput(f"cannot be decoded: {error}; expected XML in UTF-8") from None
    for element in root.iter():
        element.tag = local(element.tag)
    return root


def iterate(stream: BinaryIO, names: Collection[str]) -> Iterator[Element]:
    """Yield every outermost element of these names, with its whole content, one in memory.

    Raises InvalidInput, with the line, on broken XML.
    """
    depth = 0
    stack: list[Element] = []
    try:
        for event, element in iterparse(stream, events=("start", "end"), forbid_dtd=True):
            if event == "start":
                stack.append(element)
                depth += local(element.tag) in names
                continue
            stack.pop()
            if local(element.tag) in names:
                depth -= 1
                if depth == 0:
                    yield element
            if depth == 0:
                element.clear()
                if stack:
                    stack[-1].remove(element)
    except ParseError as error:
        raise _broken(error) from None
    except DefusedXmlException:
        raise InvalidInput("declares a document type or an entity; expected plain XML") from None
    except (LookupError, ValueError) as error:  # an encoding that Python lacks, or of many bytes
        raise InvalidInput(f"cannot be decoded: {error}; expected XML in UTF-8") from None


def _broken(error: ParseError) -> InvalidInput:
    line, column = error.position
    reason = str(error).split(":")[0]
    return InvalidInput(f"not well-formed XML: {reason} (column {column})", Place(line=line))


def local(tag: str) -> str:
    """Return an element's name without its namespace."""
    return tag.rpartition("}")[2]


def text(element: Element | None, path: str, default: str = "") -> str:
    """Return the text at `path` below `element`, stripped; `default` where there is none."""
    found = None if element is None else element.find(path)
    return default if found is None or found.text is None else found.text.strip()


def number(value: str | None) -> float | None:
    """Return a finite number, or None for what is none."""
    try:
        found = float(value) if value else None
    except ValueError:
        return None
    return found if found is not None and abs(found) < 1e12 else None
