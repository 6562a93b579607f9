"""The body of `facade rectify`."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import click
import numpy as np

from facade_tools.artifacts.numbers import dump_document
from facade_tools.artifacts.store import read_raw
from facade_tools.artifacts.writing import write_bytes
from facade_tools.errors import InvalidInput
from facade_tools.imaging.homography import Points
from facade_tools.imaging.image_io import Photo, encoded, read_photo
from facade_tools.imaging.rectify import (
    LEAST_CONFIDENCE,
    Rectification,
    automatic,
    from_corners,
    from_report,
    view_of,
)

from ._options import refuse_overwriting
from ._stream import to_stdout

LOG = logging.getLogger("facade_tools.rectify")


def run_rectify(image: str, output: str, corners: str, report: str | None) -> None:
    """Read, rectify, write the picture and the report."""
    given = None if corners == "auto" else _corners(corners)
    refuse_overwriting([image], [output, report])
    photo = read_photo(image)
    try:
        found = _found(photo, given)
    except InvalidInput as error:
        raise error.at(image) from None
    LOG.info("%s: confidence %.2f", image, found.confidence)
    _tell_guess(image, found)
    ending = ".png" if output == "-" else Path(output).suffix.lower()
    try:
        data = encoded(found.picture(photo.pixels), ending)
    except InvalidInput as error:
        raise click.UsageError(str(error)) from None
    if output == "-":
        to_stdout("", data)
    else:
        write_bytes(Path(output), data)
    if report is not None:
        document = {
            "homography": found.homography.tolist(), "confidence": found.confidence,
            "guessed": found.guessed, "size": list(found.size),
            "image": {"name": photo.name, "sha256": photo.sha256},
        }  # fmt: skip
        write_bytes(Path(report), dump_document(document))


def _tell_guess(image: str, found: Rectification) -> None:
    if found.guessed:
        LOG.warning("%s: its lines do not tell the focal length; width to height is a guess", image)


def told_view(image: str, photo: Photo, *, straight: bool) -> float | None:
    """Return the structure of a photograph that is to be read (None: too small to tell).

    Warns where it shows few lines of a facade, and, unless it was made straight, where it looks
    taken at an angle.
    """
    view = view_of(photo.pixels)
    if view.structure is not None and view.structure < LEAST_CONFIDENCE:
        LOG.warning("%s: hardly looks like a facade (structure %.2f)", image, view.structure)
    if view.angle is not None and not straight:
        LOG.warning(
            "%s: looks taken at an angle of %.0f degrees: --rectify auto", image, view.angle
        )
    return view.structure


def _found(photo: Photo, corners: Points | None) -> Rectification:
    if corners is None:
        return automatic(photo.pixels)
    return from_corners(photo.pixels.shape, corners)


def check_rectification(asked: str) -> None:
    """Raise BadParameter unless `--rectify` asks for auto, four corners or a report."""
    if asked != "auto" and not _is_report(asked):
        _corners(asked)


def _is_report(asked: str) -> bool:
    return Path(asked).suffix.lower() == ".json"


def rectification_of(photo: Photo, asked: str) -> Rectification:
    """Return the rectification that `--rectify` asks for: auto, four corners, or a report."""
    if _is_report(asked):
        return _reported(photo, asked)
    found = _found(photo, None if asked == "auto" else _corners(asked))
    _tell_guess(photo.name, found)
    return found


def _reported(photo: Photo, path: str) -> Rectification:
    """Return the rectification of a report that `facade rectify` has written about this picture."""
    try:
        report = next(read_raw([path])).document()
        found = from_report(report["homography"], report["size"], report["confidence"])
        digest = report["image"]["sha256"]
    except (KeyError, TypeError, ValueError, StopIteration):
        message = "is no report of `facade rectify`: homography, size, confidence, image"
        raise InvalidInput(message).at(path) from None
    if digest != photo.sha256:
        raise InvalidInput(f"is the report of another picture than {photo.name}").at(path)
    return found


def _corners(text: str) -> Points:
    pairs = re.findall(r"(-?\d+(?:\.\d+)?)\s*,\s*(-?\d+(?:\.\d+)?)", text)
    corners = np.array(pairs, np.float64)
    if len(pairs) != 4 or re.sub(r"[-\d.,\s]", "", text) or not np.isfinite(corners).all():
        raise click.BadParameter(f"{text!r} is not four pairs X,Y in pixels, or auto")
    return corners
