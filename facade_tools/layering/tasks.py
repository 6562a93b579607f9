"""What an aligner is asked, what it answers, and how alignments are ordered."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .candidates import Bounds
from .problem import SLACK, Alignment, Candidate

Key = tuple[float, int, int, float, tuple[Any, ...]]

MOST_LABELS = 500_000
MOST_STEPS = 60_000_000
MOST_NODES = 30_000


@dataclass(frozen=True, slots=True)
class Effort:
    """Bounds on one search: labels kept, rows tried, nodes branched; `beam` 0 for none."""

    labels: int = MOST_LABELS
    steps: int = MOST_STEPS
    nodes: int = MOST_NODES
    beam: int = 0


@dataclass(frozen=True, slots=True)
class Task:
    """One candidate at one tolerance (a share of the canvas) with a budget of Ω (m)."""

    candidate: Candidate
    bounds: tuple[Bounds, ...]
    tolerance: float
    budget: float
    splits: bool = False
    effort: Effort = field(default_factory=Effort)
    rival: Alignment | None = None  # only what may go before it is wanted


@dataclass(frozen=True, slots=True)
class Found:
    """The best alignment of a task, or none; `complete` unless a bound cut the search short."""

    alignment: Alignment | None
    complete: bool
    bound: float = 0.0  # no alignment that was left out has a smaller Ω (m)


def key_of(alignment: Alignment, canvas: float) -> Key:
    """Return what alignments are ordered by: Ω, pieces, columns, |Σ − canvas|, names."""
    step = SLACK * canvas
    return (
        round(alignment.omega / step) * step,
        alignment.pieces,
        -alignment.count,
        round(abs(alignment.sigma - canvas) / step) * step,
        (),
    )


def names_of(alignment: Alignment) -> tuple[Any, ...]:
    """Return words and columns as names, for the last tie."""
    words = alignment.candidate.words
    named = tuple(tuple(letter.name for letter in word) for word in words)
    columns = tuple(
        tuple(
            tuple(a.name for a in alignment.column(row, column))
            for column in range(alignment.count)
        )
        for row in range(len(words))
    )
    return named, columns


def full_key(alignment: Alignment, canvas: float) -> Key:
    """Return the whole order, names included."""
    return (*key_of(alignment, canvas)[:4], names_of(alignment))
