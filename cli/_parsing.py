"""The body of `facade parse-image`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_document, dump_line
from facade_tools.artifacts.provenance import Provenance, Source
from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import FacadeError, InvalidInput
from facade_tools.formats.png import write as write_png
from facade_tools.grammar.reading import Method, Reading, ReadOptions, check_mask
from facade_tools.imaging.homography import warped
from facade_tools.imaging.image_io import PICTURES, Photo, read_labels, read_photo
from facade_tools.imaging.label_views import overlay
from facade_tools.imaging.rectify import Rectification
from facade_tools.randomness import item_generator

from ._items import each
from ._options import StreamOptions, refuse_overwriting
from ._rectifying import check_rectification, rectification_of, told_view
from ._stream import (
    Faults,
    file_name,
    is_folder,
    is_single,
    new_file_name,
    open_sink,
    refuse_single,
    side_input,
)
from ._tables import METHODS, load

NAME = "parse-image"
SOLVER = "dp"
FEW_LINES = 0.2  # structure of skies, noise, plants, animals, and of blurred facades
APART = 0.4  # agreement of the windows of two readings of what is no facade


@dataclass(frozen=True)
class ParseOptions:
    """What the command line asks for."""

    classifier: str | None
    grammar: str | None
    method: str
    solver: str | None
    mask: str | None
    labels: str | None
    raw_labels: str | None
    overlay: str | None
    height: float | None = None
    storey_height: float | None = None
    rectify: str | None = None

    @property
    def recorded(self) -> dict[str, str | float | None]:
        """Options that can change the content."""
        metres = {"height": self.height, "storey_height": self.storey_height}
        return {
            "method": self.method, "solver": self.solver or SOLVER,
            "mask": self.mask and Path(self.mask).name,
            "grammar": self.grammar and Path(self.grammar).name,
            "classifier": self.classifier and Path(self.classifier).name,
            **{name: value for name, value in metres.items() if value is not None},
            **({"rectify": Path(self.rectify).name} if self.rectify else {}),
        }  # fmt: skip


@dataclass(frozen=True)
class Result:
    """Bytes of a parse and of the pictures that were asked for, by option."""

    id: str
    parse: bytes
    pictures: dict[str, bytes]


@dataclass(frozen=True)
class Read:
    """Reads one picture in any process."""

    options: ParseOptions
    seed: int
    sources: tuple[Source, ...]
    indented: bool

    def __call__(self, path: str) -> Result:
        """Return everything that becomes of the picture at `path`."""
        photo = read_photo(path)
        identity = Path(path).stem
        rng = item_generator(self.seed, NAME, identity)
        mask = _mask(self.options.mask)
        try:
            turned = None
            if self.options.rectify is not None:
                turned = rectification_of(photo, self.options.rectify)
                photo, mask = _straight(photo, mask, turned)
            structure = told_view(path, photo, straight=turned is not None)
            method = _method(self.options.method, _read_options(self.options))
            reading = method(photo, identity, rng=rng, mask=mask)
            if self.options.method == "both":
                _check_facade(structure, reading)
        except InvalidInput as error:
            raise error.at(path) from None
        except FacadeError as error:
            raise type(error)(f"{path}: {error}") from None
        inputs = (Source(photo.name, photo.sha256), *self.sources)
        provenance = Provenance(NAME, self.seed, self.options.recorded, inputs)
        parse = replace(reading.parse, provenance=provenance, tags=self._tags(reading, structure))
        if turned is not None:
            parse = replace(parse, rectification=turned.rows)
        document = encode(parse)
        data = dump_document(document) if self.indented else dump_line(document)
        return Result(identity, data, dict(self._pictures(photo, reading)))

    def _tags(self, reading: Reading, structure: float | None) -> Mapping[str, object]:
        """Return a parse's tags: what a classifier of one's own reads is as it always was."""
        tags = reading.parse.tags
        if self.options.method == "forest" or structure is None:
            return tags
        return {**tags, "structure": round(structure, 3)}

    def _pictures(self, photo: Photo, reading: Reading) -> Iterator[tuple[str, bytes]]:
        if self.options.labels:
            yield "labels", write_png(reading.labels)
        if self.options.raw_labels:
            yield "raw_labels", write_png(reading.raw)
        if self.options.overlay:
            yield "overlay", write_png(overlay(photo.pixels, reading.parse))


def _check_facade(structure: float | None, reading: Reading) -> None:
    """Raise InvalidInput where neither lines nor both readings' windows speak for a facade.

    Skies, noise and plants have neither; a blurred facade has no lines, but its windows agree.
    """
    found = reading.parse.tags.get("agreement")
    agreement = found if isinstance(found, float) else 0.0  # without mrf's reading there is none
    if structure is not None and structure < FEW_LINES and agreement < APART:
        told = f"structure is {structure:.2f}, agreement {agreement:.2f}"
        raise InvalidInput(f"shows no facade ({told}); expected {FEW_LINES:g} or {APART:g}")


def _read_options(options: ParseOptions) -> ReadOptions:
    solver = options.solver or SOLVER
    return ReadOptions(
        options.classifier, options.grammar, solver, options.height, options.storey_height
    )


def both_methods(options: ReadOptions) -> Method:
    """Return TSKP10's method with KSTTP09's windows, found from both, as a second opinion."""
    from facade_tools.reconstruction.mrf import mrf_method
    from facade_tools.segmentation.parsing import forest_method

    return forest_method(options, second=partial(mrf_method, options))


@lru_cache(maxsize=1)
def _method(name: str, options: ReadOptions) -> Method:
    method: Method = load(METHODS[name])(options)
    return method


@lru_cache(maxsize=1)
def _mask(path: str | None) -> NDArray[np.bool_] | None:
    return None if path is None else read_labels(path) > 0


def _straight(
    photo: Photo, mask: NDArray[np.bool_] | None, turned: Rectification
) -> tuple[Photo, NDArray[np.bool_] | None]:
    """Return the photograph and its mask as they look from the front."""
    straight = replace(photo, pixels=turned.picture(photo.pixels))
    if mask is None:
        return straight, None
    check_mask(mask, photo.pixels.shape)
    return straight, warped(mask.astype(np.uint8), turned.homography, turned.size) > 0


def run_parse(stream: StreamOptions, options: ParseOptions) -> None:
    """Read all pictures; write parses to the output and pictures beside."""
    _refuse_foreign(options)
    if options.rectify is not None:
        check_rectification(options.rectify)
    paths = list(_paths(stream.inputs))
    _check_outputs(paths, stream.output, options)
    method = _method(options.method, _read_options(options))  # its errors come before any picture
    del method
    sources = (
        *side_input(options.classifier),
        *_grammar_source(options),
        *side_input(options.mask),
        *_report_source(options),
    )
    read = Read(options, stream.seed or 0, sources, is_single(stream.output))
    faults = Faults(NAME, stream.on_error)
    with open_sink(stream.output) as write:
        for result in each(read, stream, faults, paths):
            write(result.id, result.parse)
            _write_pictures(result, options, len(paths) > 1)
    faults.complain()


FOREIGN = {
    "forest": ("height", "storey_height"),
    "mrf": ("classifier", "grammar", "solver"),
    "both": (),
}


def _refuse_foreign(options: ParseOptions) -> None:
    """Raise UsageError where an option of another method is given."""
    for name in FOREIGN[options.method]:
        if getattr(options, name) is not None:
            flag = name.replace("_", "-")
            raise click.UsageError(f"--{flag} means nothing to --method {options.method}")


PICTURE_OPTIONS = ("labels", "raw_labels", "overlay")


def _check_outputs(paths: list[str], output: str | None, options: ParseOptions) -> None:
    """Raise UsageError or InvalidInput where a result would overwrite an input or another one."""
    many = len(paths) > 1
    refuse_single(output, len(paths), "pictures")
    identities = [Path(path).stem for path in paths]
    named = [target for name in PICTURE_OPTIONS if (target := getattr(options, name))]
    folder = output if output not in (None, "-") and is_folder(str(output)) else None
    seen: dict[str, str] = {}
    for identity in identities if named or folder else ():
        new_file_name(identity, seen)
    written = [_target(name, identity, many) for name in named for identity in identities]
    parses = [output] if folder is None else [f"{folder}/{file_name(i)}.json" for i in identities]
    sides = (options.classifier, options.grammar, options.mask, options.rectify)
    refuse_overwriting([*paths, *sides], [*parses, *map(str, written)])


def _target(named: str, identity: str, many: bool) -> Path:
    """Return the file of one picture's label map or overlay."""
    folder = many or is_folder(named)
    return Path(named) / f"{file_name(identity)}.png" if folder else Path(named)


def _grammar_source(options: ParseOptions) -> tuple[Source, ...]:
    named = options.grammar
    return side_input(named) if named is not None and Path(named).is_file() else ()


def _report_source(options: ParseOptions) -> tuple[Source, ...]:
    named = options.rectify
    return side_input(named) if named is not None and named.lower().endswith(".json") else ()


def _paths(inputs: tuple[str, ...]) -> Iterator[str]:
    for name in inputs:
        folder = Path(name)
        if not folder.is_dir():
            yield name
            continue
        found = sorted(p for p in folder.iterdir() if p.suffix.lower() in PICTURES)
        if not found:
            raise InvalidInput(f"holds no picture ({', '.join(PICTURES)})").at(name)
        yield from map(str, found)


def _write_pictures(result: Result, options: ParseOptions, many: bool) -> None:
    for name, data in result.pictures.items():
        named = getattr(options, name)
        path = _target(named, result.id, many)
        if path != Path(named):
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
            except OSError:
                raise InvalidInput("is a file; several pictures need a folder").at(named) from None
        write_bytes(path, data)
