"""One self-contained HTML page of models that turn and pictures; needs no network."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Literal

VIEWER = "facade_tools.imaging.viewer"


@dataclass(frozen=True, slots=True)
class Exhibit:
    """One item of a page: a GLB file (`model`) or a PNG file (`picture`)."""

    name: str
    kind: Literal["model", "picture"]
    data: bytes


def page(exhibits: Sequence[Exhibit], title: str) -> bytes:
    """Return the page; equal exhibits give equal bytes."""
    rows = [
        {"name": item.name, "kind": item.kind, "data": base64.b64encode(item.data).decode()}
        for item in exhibits
    ]
    parts = {
        "@TITLE@": html.escape(title),
        "@EXHIBITS@": json.dumps(rows, ensure_ascii=False).replace("<", "\\u003c"),
        "@LICENSE@": _asset("three.LICENSE.txt").replace("*/", "* /"),
        "@THREE@": _inline(_asset("three.min.js")),
        "@VIEWER@": _inline(_asset("viewer.js")),
    }
    text = _asset("page.html")
    out = []
    # Split before filling in, so that no part's own text is taken for a marker.
    for piece in text.split("@"):
        out.append(parts.get(f"@{piece}@", piece))
    return "".join(out).encode()


def _asset(name: str) -> str:
    return (files(VIEWER) / name).read_text(encoding="utf-8")


def _inline(script: str) -> str:
    return script.replace("</script", "<\\/script").replace("<!--", "<\\!--")
