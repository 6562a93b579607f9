"""Pictures from strangers: read upright in eight bits, or refused in one line."""

from __future__ import annotations

import io
import struct
import zlib

import cv2
import numpy as np
import pytest

from facade_tools.errors import InvalidInput
from facade_tools.imaging.image_io import MAX_PIXELS, decoded, read_labels, read_photo


def png(array):
    return cv2.imencode(".png", array)[1].tobytes()


def jpeg(array):
    return cv2.imencode(".jpg", array)[1].tobytes()


def gradient(height=40, width=60, kind=np.uint8):
    top = np.iinfo(kind).max
    row = np.linspace(0, top, width).astype(kind)
    return np.repeat(np.repeat(row[None, :, None], height, 0), 3, 2)


def with_orientation(data, orientation):
    tiff = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01" + struct.pack(">HHI", orientation, 0, 0)
    body = b"Exif\0\0" + tiff
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + data[2:]


def test_sixteen_bits_grey_and_orientation_become_eight_bit_rgb_upright():
    deep = decoded(png(gradient(kind=np.uint16)), "x")
    assert deep.dtype == np.uint8
    np.testing.assert_array_equal(deep, gradient(kind=np.uint16)[..., ::-1] >> 8)
    assert decoded(png(gradient()[:, :, 0]), "x").shape == (40, 60, 3)
    assert decoded(with_orientation(jpeg(gradient()), 6), "x").shape == (60, 40, 3)


def test_cmyk_becomes_rgb():
    image = pytest.importorskip("PIL.Image")
    picture = np.zeros((16, 32, 3), np.uint8)
    picture[:, :16], picture[:, 16:] = (200, 40, 40), (40, 60, 200)
    data = io.BytesIO()
    image.fromarray(picture).convert("CMYK").save(data, "JPEG", quality=95)
    found = decoded(data.getvalue(), "x").astype(int)
    assert abs(found - picture)[:, [4, 28]].max() < 12


@pytest.mark.parametrize("ending", [".tif", ".bmp", ".webp", ".png", ".jpg"])
def test_every_format_is_read_whole_and_refused_in_part(ending):
    data = cv2.imencode(ending, gradient())[1].tobytes()
    assert decoded(data, "x").shape == (40, 60, 3)
    for part in (data[: len(data) // 2], data[:-5], data[:30]):
        with pytest.raises(InvalidInput, match=r"truncated|header|decoded"):
            decoded(part, "x")


def animated_png():
    data, body = png(gradient()), b"acTL" + struct.pack(">II", 3, 0)
    chunk = struct.pack(">I", 8) + body + struct.pack(">I", zlib.crc32(body))
    return data[:33] + chunk + data[33:]


def gif(frames, control=b"\x21\xf9\x04\0\0\0\0\0"):
    head = b"GIF89a" + struct.pack("<HH", 2, 2) + b"\xf0\0\0" + b"\0\0\0\xff\xff\xff"
    place = b"\x2c" + struct.pack("<HHHH", 0, 0, 2, 2)
    frame = control + place + b"\0\x02\x03\x44\x02\x05\0"
    return head + frame * frames + b"\x3b"


def huge_png():
    data = bytearray(png(np.zeros((1, 1, 3), np.uint8)))
    data[16:24] = struct.pack(">II", 20_000, 20_000)
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"hello, I am text", "no picture"),
        (b"", "no picture"),
        (png(gradient())[:20], "header"),
        (png(gradient())[:-30], "truncated"),
        (jpeg(gradient())[:-200], "truncated"),
        (huge_png(), "20000×20000"),
        (gif(3), "animated"),
        (gif(2, control=b""), "animated"),
        (gif(1)[:-1], "truncated"),
        (animated_png(), "animated"),
        (cv2.imencodemulti(".tif", [gradient(), gradient()])[1].tobytes(), "several pages"),
        (b"RIFF\0\0\0\0WAVEfmt ", "no pixels|header"),
        (b"\xff\xd8\xff", "header"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(data, words):
    with pytest.raises(InvalidInput, match=words) as error:
        decoded(data, "photo")
    assert "\n" not in str(error.value)
    assert MAX_PIXELS < 20_000**2


def test_a_still_gif_is_read():
    assert decoded(gif(1), "x").shape == (2, 2, 3)
    coloured = gif(1).replace(b"\0\x02\x03", b"\x80" + bytes(6) + b"\x02\x03")  # own colours
    assert decoded(coloured, "x").shape == (2, 2, 3)


def test_truncated_label_maps_are_named_so(tmp_path):
    path = tmp_path / "mask.png"
    path.write_bytes(png(np.eye(64, dtype=np.uint8))[:-20])
    with pytest.raises(InvalidInput, match=r"mask.png: is a truncated PNG; expected a whole file"):
        read_labels(str(path))


def test_missing_files_are_invalid_input(tmp_path):
    with pytest.raises(InvalidInput, match="cannot be read"):
        read_photo(str(tmp_path / "none.jpg"))
