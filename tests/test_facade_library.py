"""facadegen: what comes from the library: sizes, sidelights, colours."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from facade_houses import HOUSES, ROOT, bare, elements, made, sample

from facade_tools.artifacts.building import Box, Building, Colors, Element, Facade, Roof
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read
from facade_tools.artifacts.writing import write_artifacts
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.exteriors.facade_layout import WIDE_WALL
from facade_tools.exteriors.library import (
    ElementLibrary,
    build_library,
    default_library,
    kmeans,
    read_library,
)
from facade_tools.exteriors.palette import house_colors
from facade_tools.geometry.checks import building_problems
from facade_tools.geometry.pieces import facade_pieces

# --- sidelights ---------------------------------------------------------------------------------


def slim(element):
    return element.kind == "window" and element.height > 3.0 * element.width


def library_with(width: float, sidelights: bool, others: float):
    """A library of one house: windows of one size all round, perhaps a pair beside the door."""
    house = bare(sample("colonial"))
    facades = {}
    for side, pieces in facade_pieces(house).items():
        row = []
        for piece in pieces:
            found = []
            if piece.width > 4 and piece.height > 2.3:
                tall = 1.8
                count = int(piece.width // 2)
                found = [
                    Element("window", "fixed", (k + 0.5) * piece.width / count, 0.4, others, tall)
                    for k in range(count)
                ]
                if side == "front" and piece.origin[2] == 0 and sidelights:
                    middle = piece.width / 2
                    door = Element("door", "panel", middle - 0.45, 0.0, 0.9, 2.1, True)
                    lights = [
                        Element("window", "fixed", middle + u, 0.3, width, 1.8)
                        for u in (-0.95, 0.6)
                    ]
                    found = [door, *lights]
            row.append(replace(piece, elements=tuple(found)))
        facades[side] = Facade(tuple(row))
    return ElementLibrary(build_library([replace(house, facades=facades, targets=None)]))


def test_sidelights_stand_beside_the_main_door_and_nowhere_else():
    shelf = library_with(0.35, True, 1.0)
    beside = 0
    for seed in range(12):
        (done,) = made(bare(sample("colonial", seed)), seed, library=shelf)
        assert list(building_problems(done)) == []
        for _, piece, element in elements(done):
            if not slim(element) or piece.width <= WIDE_WALL:
                continue
            doors = [e for e in piece.elements if e.main]
            assert len(doors) == 1
            gap = max(doors[0].u - element.u - element.width, element.u - doors[0].u - 0.9)
            assert 0 < gap < 0.4
            beside += 1
    assert beside >= 8


def test_a_library_of_slim_windows_alone_still_fills_walls():
    shelf = library_with(0.35, False, 0.45)
    (done,) = made(bare(sample("colonial", 1)), library=shelf)
    windows = [e for _, _, e in elements(done) if e.kind == "window"]
    assert len(windows) > 10
    assert sum(map(slim, windows)) > 5


def test_no_sill_is_out_of_reach_where_heads_are_high():
    """Storeys of 3.9 m with heads at 3.4 m: windows of 0.6 m under them would begin at 2.8 m."""
    main = Box("main", "general", 6, 5, 12, 10, 11.7, Roof("flat"))
    block = Building("block", (main,), storey_height=3.9)

    def shelf(heights):
        facades = {}
        for side, pieces in facade_pieces(block).items():
            rows = []
            for piece in pieces:
                found = tuple(
                    Element("window", "fixed", 1.0 + 2 * k, 3.4 - h, 1.0, h)
                    for k, h in enumerate(heights)
                )
                rows.append(replace(piece, elements=found))
            facades[side] = Facade(tuple(rows))
        return ElementLibrary(build_library([replace(block, facades=facades)]))

    for heights in ((1.7, 1.7, 0.6), (0.6, 0.6)):
        (done,) = made(block, library=shelf(heights))
        assert list(building_problems(done)) == []
        tall = {e.height for _, _, e in elements(done) if e.kind == "window"}
        assert tall == {max(heights)}


# --- library and colours ------------------------------------------------------------------------


def test_kmeans_finds_separated_groups():
    rng = np.random.default_rng(0)
    centres = np.array([[0, 0], [5, 0], [0, 5], [5, 5.0]])
    points = np.concatenate([c + rng.normal(0, 0.1, (30, 2)) for c in centres])
    found, label = kmeans(points, 4)
    assert sorted(np.round(found).tolist()) == sorted(centres.tolist())
    assert sorted(np.bincount(label).tolist()) == [30] * 4


def test_library_has_at_most_five_sizes_a_style():
    library = default_library().library
    counts: dict[tuple[str, str], int] = {}
    for row in library.substyles:
        counts[row.kind, row.style] = counts.get((row.kind, row.style), 0) + 1
    assert max(counts.values()) == 5
    assert len(library.buildings) == 288


def test_shipped_library_is_that_of_the_sample_houses():
    library = build_library(read([str(HOUSES)], "building"), "library")
    shipped = ROOT / "facade_tools" / "exteriors" / "library.json"
    assert (
        json.loads(dump_line(encode(library)))["buildings"]
        == (json.loads(shipped.read_bytes())["buildings"])
    )


def test_similar_building_has_the_same_bits():
    shelf = default_library()
    wanted = building_attributes(sample("victorian", 5))
    for entry in shelf.nearest(wanted, 3, np.random.default_rng(0)):
        assert entry.id.startswith("victorian")


def test_the_file_of_a_library_without_windows_is_named(tmp_path):
    write_artifacts(tmp_path / "bare.jsonl", [bare(sample("bungalow"))])
    with pytest.raises(InvalidInput, match=r"bare\.jsonl: the library's buildings have no window"):
        read_library(str(tmp_path / "bare.jsonl"))


def test_library_of_windowless_buildings_is_refused():
    with pytest.raises(InvalidInput, match="window"):
        build_library([Building("b", (Box("a", "general", 0, 0, 8, 8, 3, Roof("flat")),))])


def test_colours_come_from_the_template_and_given_ones_stay():
    entry = default_library().library.buildings[0]
    colors = house_colors([entry], rng=np.random.default_rng(0))
    assert (colors.trim, colors.door) == (entry.colors.trim, entry.colors.door)
    given_colors = Colors("#112233", "#445566", "#778899", "#aabbcc")
    (house,) = made(replace(bare(sample("cape")), colors=given_colors))
    assert house.colors == given_colors
