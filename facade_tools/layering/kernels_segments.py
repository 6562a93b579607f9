"""Segments of a lattice: all that a row can have in one column, from every place in it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled

# Columns of the table of edges.
FROM, TO, RANK, CLEAR, OPAQUE, UNOCCLUDABLE, ATTACHED = range(7)
# Columns of the table of segments.
START, END, HEAD, TAIL, CLEAR_SEGMENT, SOLID, UNCOVERED, GRIPS = range(8)

Array = Any  # integer arrays; numba knows their exact types


@compiled
def whole_segments(size: int, edges: Array, most: int) -> Any:
    """Return (segments, count): each pair of nodes between which a row's substring can lie.

    edges (n, 7), ordered by node. A segment has letters that are all transparent or none; of the
    words between two nodes it is the first one, spelt by HEAD (an edge) and TAIL (a segment or
    -1). GRIPS: the first letter is attached; such words are kept apart. count > most: too many.
    """
    table = np.empty((most, 8), np.int64)
    first = np.zeros(size + 1, np.int64)  # segments of a node: first[node] to last[node]
    last = np.zeros(size + 1, np.int64)
    best = np.full((size, 2), -1, np.int64)
    out = np.zeros(size + 1, np.int64)
    for k in range(len(edges)):
        out[edges[k, FROM] + 1] = k + 1
    for node in range(size):
        out[node + 1] = max(out[node + 1], out[node])
    count = np.int64(0)
    for node in range(size - 1, -1, -1):
        first[node] = count
        for k in range(out[node], out[node + 1]):
            grips, middle = edges[k, ATTACHED], edges[k, TO]
            for at in range(-1, last[middle] - first[middle]):
                tail = -1 if at < 0 else first[middle] + at
                if at >= 0 and table[tail, CLEAR_SEGMENT] != edges[k, CLEAR]:
                    continue
                end = middle if at < 0 else table[tail, END]
                old = best[end, grips]
                if old >= first[node]:
                    if spelt_before(edges, table, k, tail, old):
                        table[old, HEAD], table[old, TAIL] = k, tail
                    continue
                if count >= most:
                    return table, most + 1
                table[count, START], table[count, END] = node, end
                table[count, HEAD], table[count, TAIL] = k, tail
                table[count, CLEAR_SEGMENT], table[count, GRIPS] = edges[k, CLEAR], grips
                solid, bare = edges[k, OPAQUE], edges[k, UNOCCLUDABLE]
                if at >= 0:
                    solid, bare = solid & table[tail, SOLID], bare | table[tail, UNCOVERED]
                table[count, SOLID], table[count, UNCOVERED] = solid, bare
                best[end, grips] = count
                count += 1
        last[node] = count
    return table, count


@compiled
def spelt_before(edges: Array, table: Array, head: int, tail: int, other: int) -> bool:
    """Tell whether an edge and a segment after it spell a word before that of another segment."""
    while True:
        mine, theirs = edges[head, RANK], edges[table[other, HEAD], RANK]
        if mine != theirs:
            return bool(mine < theirs)
        other = table[other, TAIL]
        if tail < 0 or other < 0:
            return False
        head, tail = table[tail, HEAD], table[tail, TAIL]


# Columns of the table of steps.
SOURCE, TARGET, SEGMENT, CLEAR_STEP, SOLID_STEP, BARE_STEP, GRIPS_STEP, BEHIND, AHEAD = range(9)


@compiled
def column_steps(  # noqa: C901 - one table, row by row
    size: int, edges: Array, segments: Array, splits: bool, most: int
) -> Any:
    """Return (steps, count): what a row can have in a column, from each place to another.

    Places are the nodes, then (splits) the insides of transparent edges in their order. Whole
    letters of a step lie between the nodes BEHIND and AHEAD, spelt by SEGMENT (or -1).
    """
    table = np.empty((most, 9), np.int64)
    place = np.full(len(edges), -1, np.int64)
    opens = size
    for k in range(len(edges)):
        if splits and edges[k, CLEAR]:
            place[k] = opens
            opens += 1
    first = np.zeros(size + 1, np.int64)  # edges by node
    for k in range(len(edges)):
        first[edges[k, FROM] + 1] = k + 1
    for node in range(size):
        first[node + 1] = max(first[node + 1], first[node])
    begin = np.zeros(size, np.int64)  # segments by node, stored from the last node to the first
    end = np.zeros(size, np.int64)
    for k in range(len(segments)):
        node = segments[k, START]
        if k == 0 or segments[k - 1, START] != node:
            begin[node] = k
        end[node] = k + 1
    count = np.int64(0)
    for source in range(size + len(edges)):
        inside = source - size
        if inside >= 0 and place[inside] < 0:
            continue
        node = source if inside < 0 else edges[inside, TO]
        if count + 2 * (1 + end[node] - begin[node]) > most:
            return table, most + 1
        if inside >= 0:
            for target in (place[inside], node):
                _step(table, count, place[inside], target, -1, node, node)
                table[count, BARE_STEP] = edges[inside, UNOCCLUDABLE]
                count += 1
        for k in range(begin[node] - 1, end[node]):
            segment = k if k >= begin[node] else -1  # none: straight into a letter
            clear = segment < 0 or segments[segment, CLEAR_SEGMENT] == 1
            if inside >= 0 and not clear:
                continue
            stop = node if segment < 0 else segments[segment, END]
            if count + 1 + first[stop + 1] - first[stop] > most:
                return table, most + 1
            bare = np.int64(0) if inside < 0 else edges[inside, UNOCCLUDABLE]
            here = source if inside < 0 else place[inside]
            if segment >= 0:
                bare |= segments[segment, UNCOVERED]
                _step(table, count, here, stop, segment, node, stop)
                table[count, CLEAR_STEP], table[count, BARE_STEP] = clear, bare
                table[count, SOLID_STEP] = segments[segment, SOLID]
                table[count, GRIPS_STEP] = segments[segment, GRIPS] if inside < 0 else 0
                count += 1
            for edge in range(first[stop], first[stop + 1]):
                if clear and place[edge] >= 0 and place[edge] != here:
                    _step(table, count, here, place[edge], segment, node, stop)
                    table[count, BARE_STEP] = bare | edges[edge, UNOCCLUDABLE]
                    if inside < 0:
                        grips = edges[edge, ATTACHED] if segment < 0 else segments[segment, GRIPS]
                        table[count, GRIPS_STEP] = grips
                    count += 1
    return table, count


@compiled
def _step(
    table: Array, at: Any, source: Any, target: Any, segment: Any, behind: Any, ahead: Any
) -> None:
    table[at, SOURCE], table[at, TARGET], table[at, SEGMENT] = source, target, segment
    table[at, BEHIND], table[at, AHEAD] = behind, ahead
    table[at, CLEAR_STEP], table[at, SOLID_STEP] = 1, 0
    table[at, BARE_STEP], table[at, GRIPS_STEP] = 0, 0
