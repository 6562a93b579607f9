"""Everything that can go wrong for a reason the caller can act on."""

from __future__ import annotations

from dataclasses import dataclass


class FacadeError(Exception):
    """Root of all typed errors; `exit_code` is what the command line returns."""

    exit_code = 1


@dataclass(frozen=True)
class Place:
    """Where in the inputs something is: file name, line (from 1) and JSON pointer."""

    source: str = ""
    line: int | None = None
    pointer: str = ""

    def __str__(self) -> str:
        line = "" if self.line is None else f":{self.line}"
        parts = [f"{self.source}{line}"] if self.source or line else []
        return ": ".join(parts + ([self.pointer] if self.pointer else []))


class InvalidInput(FacadeError):
    """An input that breaks its format, its schema or a rule of its geometry.

    `message` says what is wrong and what was expected; `place` says where. A library function
    that knows only the pointer raises with that, and the reader adds file and line by `at`.
    """

    exit_code = 3

    def __init__(self, message: str, place: Place | None = None, *, pointer: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.place = place or Place(pointer=pointer)

    def at(self, source: str, line: int | None = None) -> InvalidInput:
        """Return the same error with file and line filled in where they were unknown."""
        place = self.place
        at_line = line if place.line is None else place.line
        filled = Place(place.source or source, at_line, place.pointer)
        return InvalidInput(self.message, filled)

    def __str__(self) -> str:
        place = str(self.place)
        return f"{place}: {self.message}" if place else self.message

    def __reduce__(self) -> tuple[type[InvalidInput], tuple[str, Place]]:
        return type(self), (self.message, self.place)


class Infeasible(FacadeError):
    """No solution exists under the given hard constraints."""

    exit_code = 4


class OutputFailed(FacadeError):
    """A result could not be written: full disk, missing folder, no permission."""

    exit_code = 1


class WorkerDied(FacadeError):
    """A worker process ended twice over the same item (out of memory, crash in native code)."""

    exit_code = 1
