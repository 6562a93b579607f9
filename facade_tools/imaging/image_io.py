"""Pictures from strangers: bounded, upright, eight bits, three channels; and label maps.

The size is read from the header before anything is decoded. EXIF orientation is applied, 16 bits
become 8, CMYK and grey become RGB, transparency is dropped. Animations, truncated files and what
is too large are refused in one line.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..artifacts.store import digest, unreadable
from ..errors import InvalidInput
from .image_headers import Header, header
from .sgi import decoded_sgi

Picture = NDArray[np.uint8]  # (height, width, 3) RGB
Holes = NDArray[np.bool_]  # (height, width), where one sees through a picture

MAX_BYTES = 256 << 20
MAX_PIXELS = 1 << 26  # 8192 × 8192, the usual largest texture
MAX_SIDE = 30_000
TRANSPARENT = ("PNG", "TIFF", "WebP")
PICTURES = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".webp")


@dataclass(frozen=True, slots=True)
class Photo:
    """A picture with the name and digest of its file."""

    name: str
    pixels: Picture
    sha256: str


def read_photo(path: str) -> Photo:
    """Return the picture of a file, upright. Raises InvalidInput on what cannot be used."""
    source = digest(path)
    data = _bytes(path)
    pixels = decoded(data, path)
    return Photo(source.name, pixels, source.sha256)


def decoded(data: bytes, name: str) -> Picture:
    """Return the RGB picture of an encoded file. Raises InvalidInput with `name`."""
    return _eight_bit_rgb(_decoded(data, name, alpha=False))


def decoded_texture(data: bytes, name: str) -> tuple[Picture, Holes | None]:
    """Return the RGB picture of an encoded file, and where one sees through it.

    The holes (h, w) are the pixels that are more than half transparent; None where there are none,
    or where nothing else would be left. Raises InvalidInput with `name`.
    """
    picture = _decoded(data, name, alpha=True)
    rgb = _eight_bit_rgb(picture)
    if picture.ndim == 2 or picture.shape[2] < 4:
        return rgb, None
    holes: Holes = picture[:, :, 3].astype(np.float64) < 0.5 * _most(picture)
    return rgb, (holes if holes.any() and not holes.all() else None)


def _most(picture: NDArray[np.generic]) -> float:
    kind = picture.dtype
    return float(np.iinfo(kind).max) if kind.kind == "u" else 1.0  # type: ignore[type-var]


def _decoded(data: bytes, name: str, *, alpha: bool) -> NDArray[np.generic]:
    """Return a picture as it is stored; alpha: with its transparency, where it has one."""
    info = header(data, name)
    if max(info.width, info.height) > MAX_SIDE or info.width * info.height > MAX_PIXELS:
        limit = f"{MAX_PIXELS >> 20} megapixels"
        raise InvalidInput(f"has {info.width}×{info.height} pixels; expected at most {limit}").at(
            name
        )
    if info.frames > 1:
        raise InvalidInput("is animated or has several pages; expected one picture").at(name)
    if not info.complete:
        raise _truncated(info).at(name)
    picture: NDArray[np.generic] | None
    if info.format == "SGI":
        found = decoded_sgi(data)
        picture = found if found is None or found.ndim == 2 else found[:, :, ::-1]
    else:
        with _quiet():
            whole = info.deep or (alpha and info.format in TRANSPARENT)
            flags = cv2.IMREAD_UNCHANGED if whole else cv2.IMREAD_COLOR
            picture = _decode(data, flags)
    if picture is None:
        raise InvalidInput(f"cannot be decoded as {info.format}").at(name)
    return picture


def _truncated(info: Header) -> InvalidInput:
    return InvalidInput(f"is a truncated {info.format}; expected a whole file")


def _decode(data: bytes, flags: int) -> NDArray[np.generic] | None:
    try:
        return cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error:
        return None


def _bytes(path: str) -> bytes:
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise unreadable(path, error) from None
    if len(data) > MAX_BYTES:
        raise InvalidInput(f"is larger than {MAX_BYTES >> 20} MiB; expected a picture").at(path)
    return data


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the decoders' own words off standard error: they write to the descriptor."""
    kept = os.dup(2)
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(sink)


def _eight_bit_rgb(picture: NDArray[np.generic]) -> Picture:
    if picture.dtype == np.uint16:
        picture = (picture >> 8).astype(np.uint8)  # type: ignore[operator]
    elif picture.dtype != np.uint8:
        shares = np.nan_to_num(picture.astype(np.float32), posinf=1.0, neginf=0.0)
        picture = (255 * np.clip(shares, 0, 1)).astype(np.uint8)
    if picture.ndim == 2:
        return np.repeat(picture[:, :, None], 3, axis=2).astype(np.uint8)
    return np.ascontiguousarray(picture[:, :, 2::-1]).astype(np.uint8)


def read_label_picture(path: str) -> NDArray[np.uint8]:
    """Return a label map as stored: (height, width) indices, or (height, width, 3) RGB colours."""
    data = _bytes(path)
    info = header(data, path)
    if info.width * info.height > MAX_PIXELS:
        raise InvalidInput(f"has {info.width}×{info.height} pixels; too large").at(path)
    if not info.complete:
        raise _truncated(info).at(path)
    with _quiet():
        picture = _decode(data, cv2.IMREAD_UNCHANGED)
    if picture is None or picture.dtype != np.uint8:
        raise InvalidInput("expected a label map of 8 bits (PNG)").at(path)
    if picture.ndim == 3:
        picture = picture[:, :, 2::-1]
    return picture.astype(np.uint8)


def read_labels(path: str) -> NDArray[np.uint8]:
    """Return an 8-bit map of one channel. Raises InvalidInput on a colour picture."""
    picture = read_label_picture(path)
    if picture.ndim != 2:
        raise InvalidInput("expected a map of one channel (grey PNG)").at(path)
    return picture


def fitted(picture: Picture, height: int, pixels: int) -> Picture:
    """Return a picture shrunk to at most `height` rows and `pixels` pixels; never enlarged."""
    h, w = picture.shape[:2]
    scale = min(1.0, height / h, (pixels / (h * w)) ** 0.5)
    if scale == 1.0:
        return picture
    size = (max(1, round(w * scale)), max(1, round(h * scale)))
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8)


def encoded(picture: NDArray[np.uint8], ending: str) -> bytes:
    """Return the bytes of an RGB picture or a label map in the format of a file ending.

    Raises InvalidInput on an ending of no picture.
    """
    turned = picture[:, :, ::-1] if picture.ndim == 3 else picture
    options = [cv2.IMWRITE_JPEG_QUALITY, 92] if ending in (".jpg", ".jpeg") else []
    try:
        done, data = cv2.imencode(ending, np.ascontiguousarray(turned), options)
    except cv2.error:
        done = False
    if not done:
        raise InvalidInput(f"{ending!r} is no ending of a picture; expected .png or .jpg")
    return data.tobytes()
