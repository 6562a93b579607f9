"""`layer-solve`: a design to the layout that respects it best (IMAW15 5)."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product

from ..artifacts.design import Canvas, Design
from ..artifacts.layout import Group, Layout
from ..errors import Infeasible
from .alignment import prepare
from .evaluation import evaluate
from .explain import explanation
from .language import counters_of, symbols_of
from .problem import Direction
from .search import Answer, Clock, GroupSearch
from .shapes import Line, PlacedLetter, grid_of
from .sizing import Sizing, conflict, solve, substring_sizes
from .stack import Axis, Stack, stack_of
from .tasks import Key, full_key

TIME_LIMIT = 10.0  # seconds
MOST_VARIATIONS = 64
EXPLAINING = 5.0  # seconds, at most, to find out why there is no layout


@dataclass(frozen=True, slots=True)
class Solved:
    """One direction solved: an answer a group, their sizes, and where each layer's letters lie."""

    direction: Direction
    answers: Mapping[str, Answer]
    sizing: Sizing

    def group(self, name: str) -> int:
        """Return the place of a group among the alignments of the sizing."""
        return list(self.answers).index(name)


def solve_design(
    design: Design,
    *,
    width: float | None = None,
    height: float | None = None,
    time_limit: float = TIME_LIMIT,
) -> Layout:
    """Return the best layout of a design, on another canvas (m) if one is given.

    The time limit (s) is shared by both directions; what it cuts short is not `optimal`.
    Raises InvalidInput where the design means nothing, Infeasible where it has no layout.
    """
    stack = stack_of(design)
    prepare()
    start = time.monotonic()
    x = solve_direction(stack.direction("x", width), time_limit / 2)
    y = solve_direction(stack.direction("y", height), time_limit - (time.monotonic() - start))
    return layout_of(stack, x, y)


def solve_direction(direction: Direction, time_limit: float = TIME_LIMIT) -> Solved:
    """Return the solution of one direction. Raises Infeasible, with what is in conflict."""
    prepare()
    clock = Clock(time.monotonic() + time_limit)
    answers: dict[str, Answer] = {}
    for groups in components(direction):
        answers.update(_answers(direction, groups, clock))
    order = {name: answers[name] for name in direction.groups}
    if len(order) > 1 and conflict(direction, [a.alignment for a in order.values()]) is not None:
        # Only together do the groups have no sizing: look for one that they share.
        order = _answers(direction, tuple(direction.groups), clock)
    sizing = solve(direction, [answer.alignment for answer in order.values()])
    return Solved(direction, order, sizing)


def _answers(direction: Direction, groups: tuple[str, ...], clock: Clock) -> dict[str, Answer]:
    search = GroupSearch(direction, groups, clock)
    answer = search.answer()
    if answer is None:
        seconds = min(EXPLAINING, max(1.0, clock.until - time.monotonic()))
        why = explanation(direction, groups, seconds, late=clock.late, proved=search.exhausted)
        raise Infeasible(why)
    return _parted(direction, groups, answer)


def _parted(direction: Direction, groups: tuple[str, ...], answer: Answer) -> dict[str, Answer]:
    if len(groups) == 1:
        return {groups[0]: answer}
    out = {}
    for i, group in enumerate(groups):
        part = answer.alignment.part(i)
        point = {name: (size, size) for name, size in part.sizes}
        own = evaluate(direction, part.candidate, part.borders, part.tolerance, point)
        out[group] = replace(answer, alignment=replace(own, sizes=part.sizes))
    return out


def components(direction: Direction) -> list[tuple[str, ...]]:
    """Return the alignment groups, together where they share a counter or an unsized symbol."""
    shared: list[tuple[set[str], list[str]]] = []
    for group, rows in direction.groups.items():
        mine = {f"^{name}" for name in direction.counters_of(group)}
        for row in rows:
            mine |= {n for n in symbols_of(row.node) if direction.rules[n].size is None}
        touching = [entry for entry in shared if entry[0] & mine]
        shared = [entry for entry in shared if not entry[0] & mine]
        names = [name for entry in touching for name in entry[1]] + [group]
        shared.append((mine.union(*(entry[0] for entry in touching)), names))
    return [tuple(names) for _, names in shared]


def layout_of(stack: Stack, x: Solved, y: Solved) -> Layout:
    """Return the layout of two solved directions, its shapes included."""
    design = stack.design
    return Layout(
        design.id or "design",
        Canvas(x.direction.canvas, y.direction.canvas),
        {name: _group(x, name) for name in x.answers},
        {name: _group(y, name) for name in y.answers},
        grid_of(stack, _lines(x), _lines(y)),
        tags=design.tags,
    )


def _group(solved: Solved, name: str) -> Group:
    answer = solved.answers[name]
    alignment = answer.alignment
    layers = range(len(alignment.candidate.words))
    rows = solved.direction.groups[name]
    used = set[str]().union(*(counters_of(row.node) for row in rows))
    rules = solved.direction.rules
    return Group(
        layers=tuple(row.layer for row in rows),
        words=tuple(tuple(a.name for a in word) for word in alignment.candidate.words),
        counters={k: v for k, v in alignment.candidate.counters if k in used},
        columns=tuple(
            tuple(tuple(a.name for a in alignment.column(i, j)) for j in range(alignment.count))
            for i in layers
        ),
        alignment_error=max(0.0, alignment.omega),
        tolerance=alignment.tolerance,
        boundaries=tuple(_boundaries(solved, name)),
        sizes=solved.sizing.sizes,
        residual=solved.sizing.residual,
        optimal=answer.optimal,
        gap=answer.gap,
        pieces=alignment.pieces,
        borders=tuple(tuple(_borders(solved, name, i)) for i in layers),
        unsized=tuple(n for n in solved.sizing.sizes if rules[n].size is None),
    )


def _boundaries(solved: Solved, name: str) -> list[float]:
    """Return the positions of the column borders (m), the last exactly the canvas."""
    alignment, index = solved.answers[name].alignment, solved.group(name)
    out = [0.0]
    for column in range(alignment.count):
        rows = range(len(alignment.candidate.words))
        row = next(row for row in rows if alignment.column(row, column))
        out.append(out[-1] + sum(substring_sizes(solved.sizing, alignment, index, row, column)))
    return [*out[:-1], solved.direction.canvas]


def _borders(solved: Solved, name: str, row: int) -> Iterator[float]:
    """Yield the borders (m) of a layer's letters and pieces, empty columns skipped over."""
    alignment, index = solved.answers[name].alignment, solved.group(name)
    boundaries = _boundaries(solved, name)
    for column in range(alignment.count):
        sizes = substring_sizes(solved.sizing, alignment, index, row, column)
        position = boundaries[column]
        for size in sizes[:-1]:
            yield position
            position += size
        if sizes:
            yield position
    yield boundaries[-1]


def _lines(solved: Solved) -> dict[str, Line]:
    """Return every layer's letters with their bounds s and t (m)."""
    out = {}
    for name, rows in solved.direction.groups.items():
        for i, row in enumerate(rows):
            out[row.layer] = tuple(_letters_of(solved, name, i))
    return out


def _letters_of(solved: Solved, name: str, row: int) -> Iterator[PlacedLetter]:
    alignment, index = solved.answers[name].alignment, solved.group(name)
    boundaries = _boundaries(solved, name)
    word = alignment.candidate.words[row]
    spans: dict[int, tuple[float, float]] = {}
    for column in range(alignment.count):
        first, end = alignment.letters(row, column)
        position = boundaries[column]
        for letter, size in zip(
            range(first, end),
            substring_sizes(solved.sizing, alignment, index, row, column),
            strict=True,
        ):
            stop = boundaries[column + 1] if letter == end - 1 else position + size
            spans[letter] = (spans.get(letter, (position,))[0], stop)
            position = stop
    for letter, (s, t) in sorted(spans.items()):
        yield PlacedLetter(word[letter], s, t)


def variations(
    design: Design,
    *,
    width: float | None = None,
    height: float | None = None,
    time_limit: float = TIME_LIMIT,
) -> Iterator[Layout]:
    """Yield the best layout of every tuple of words at the tolerance that the best one needs.

    The best comes first; at most MOST_VARIATIONS.
    """
    stack = stack_of(design)
    sides = [
        list(_direction_variations(stack.direction(axis, length), time_limit / 2))
        for axis, length in _axes(width, height)
    ]
    pairs = sorted(product(*map(range, map(len, sides))), key=lambda pair: (sum(pair), pair))
    for i, j in islice(pairs, MOST_VARIATIONS):
        layout = layout_of(stack, sides[0][i], sides[1][j])
        yield replace(layout, id=f"{layout.id}-{i + 1}-{j + 1}" if i or j else layout.id)


def _axes(width: float | None, height: float | None) -> Sequence[tuple[Axis, float | None]]:
    return (("x", width), ("y", height))


def _direction_variations(direction: Direction, time_limit: float) -> Iterator[Solved]:
    """Yield the best solution, then those with other words in one of the groups at a time."""
    best = solve_direction(direction, time_limit)
    yield best
    clock = Clock(time.monotonic() + time_limit)
    found: list[tuple[Key, dict[str, Answer]]] = []
    for groups in components(direction):
        found += _others(direction, groups, best, clock)
    for _, answers in sorted(found, key=lambda one: one[0]):
        alignments = [answer.alignment for answer in answers.values()]
        yield Solved(direction, answers, solve(direction, alignments))


def _others(
    direction: Direction, groups: tuple[str, ...], best: Solved, clock: Clock
) -> Iterator[tuple[Key, dict[str, Answer]]]:
    """Yield answers of all groups, of which some have other words than the best one."""
    own = [best.answers[group] for group in groups]
    words = tuple(word for answer in own for word in answer.alignment.candidate.words)
    search = GroupSearch(direction, groups, clock, few=float("inf"))
    splits = any(answer.alignment.pieces > 0 for answer in own)
    for one in search.all_at(own[0].alignment.tolerance, splits):
        if one.candidate.words == words:
            continue
        changed = _parted(direction, groups, Answer(one, own[0].optimal))
        answers = {name: changed.get(name, answer) for name, answer in best.answers.items()}
        together = [answer.alignment for answer in answers.values()]
        if len(together) == 1 or conflict(direction, together) is None:
            yield full_key(one, direction.canvas), answers
