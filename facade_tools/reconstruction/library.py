"""Shape grammars that ship with the tool, and the user's own."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from ..artifacts.documents import check_finite, decode, parse_json, parse_yaml
from ..artifacts.pointers import located
from ..artifacts.shape_grammar import ShapeGrammar
from ..artifacts.store import unreadable
from ..errors import InvalidInput
from .rules import check_shape_grammar

MAX_BYTES = 4 << 20


@dataclass(frozen=True, slots=True)
class Loaded:
    """A grammar, its text, and what to call it."""

    grammar: ShapeGrammar
    data: bytes
    name: str

    def located(self, error: InvalidInput) -> InvalidInput:
        """Return an error of the derivation with the grammar's file and the rule's line."""
        return located(error, self.data, self.name)


def builtin_names() -> list[str]:
    """Return the names of the shipped shape grammars."""
    entries = resources.files("facade_tools.reconstruction").joinpath("builtin").iterdir()
    return sorted(e.name.removesuffix(".yaml") for e in entries if e.name.endswith(".yaml"))


def load(name: str) -> Loaded:
    """Return a shipped grammar by its name, or the grammar of a file (.yaml or .json).

    Raises InvalidInput, with the line, on what is no grammar or does not fit together.
    """
    data = _text(name)
    json = name.lower().endswith(".json")
    try:
        document = parse_json(data) if json else parse_yaml(data)
        check_finite(document)
        if isinstance(document, dict) and not json:
            document = {"schema": "facade-tools/shape-grammar/1", **document}
        grammar: ShapeGrammar = decode(document, "shape-grammar")
        check_shape_grammar(grammar)
    except InvalidInput as error:
        raise located(error, data, name) from None
    return Loaded(grammar, data, name)


def _text(name: str) -> bytes:
    if name in builtin_names():
        folder = resources.files("facade_tools.reconstruction").joinpath("builtin")
        return folder.joinpath(f"{name}.yaml").read_bytes()
    path = Path(name)
    if not path.exists():
        shipped = ", ".join(builtin_names())
        raise InvalidInput(f"is neither a file nor a shipped grammar ({shipped})").at(name)
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise unreadable(name, error) from None
    if len(data) > MAX_BYTES:
        raise InvalidInput(f"is larger than {MAX_BYTES >> 20} MiB; expected a grammar").at(name)
    return data
