"""Where an artifact comes from: tool, version, stage, seed, options, inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .. import __version__


@dataclass(frozen=True, slots=True)
class Source:
    """One input: its name without folders, and the SHA-256 of its bytes (hexadecimal).

    For an item of a stream it is the digest of that item's own line, so that an item's
    provenance does not depend on what else is in the stream.
    """

    name: str
    sha256: str


@dataclass(frozen=True, slots=True)
class Provenance:
    """How an artifact was made; carries no clock and no absolute path.

    `options` holds only what can change the content.
    """

    stage: str
    seed: int | None = field(default=None, metadata={"keep": True})
    options: Mapping[str, Any] = field(default_factory=dict, metadata={"keep": True})
    inputs: tuple[Source, ...] = field(default=(), metadata={"keep": True})
    tool: str = field(default="facade-tools", metadata={"keep": True})
    version: str = field(default=__version__, metadata={"keep": True})
