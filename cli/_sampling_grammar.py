"""The body of `facade sample-grammar`."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.provenance import Provenance
from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.formats.png import write as write_png
from facade_tools.grammar.library import load
from facade_tools.randomness import item_generator
from facade_tools.segmentation.painting import render_facade
from facade_tools.segmentation.random_parse import random_parse

from ._options import refuse_overwriting
from ._stream import open_sink, refuse_single, side_input

NAME = "sample-grammar"


def run_sampling(grammar: str, output: str | None, seed: int, values: Mapping[str, Any]) -> None:
    """Draw the facades, and their pictures where asked for."""
    refuse_single(output, values["count"], "facades")
    refuse_overwriting([grammar], [output])
    rules = load(grammar)
    size = (values["width"], values["height"])
    sources = side_input(grammar) if Path(grammar).is_file() else ()
    recorded = {"grammar": Path(grammar).name, "width": size[0], "height": size[1]}
    provenance = Provenance(NAME, seed, recorded, sources)
    folders = [_folder(values[name]) for name in ("pictures", "labels")]
    with open_sink(output) as write:
        for number in range(values["count"]):
            identity = f"{seed}-{number}"
            rng = item_generator(seed, NAME, number)
            try:
                tree, picture, labels = render_facade(rules, *size, rng=rng)
            except Infeasible as error:
                raise Infeasible(f"{grammar}: {error}") from None
            pixels = write_png(picture)
            digest = hashlib.sha256(pixels).hexdigest()
            parse = random_parse(tree, rules, identity, size, digest)
            write(identity, dump_line(encode(replace(parse, provenance=provenance))))
            for folder, data in zip(folders, (pixels, write_png(labels)), strict=True):
                if folder is not None:
                    write_bytes(folder / f"{identity}.png", data)


def _folder(name: str | None) -> Path | None:
    if name is None:
        return None
    try:
        Path(name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInput(f"cannot be made: {error.strerror}").at(name) from None
    return Path(name)
