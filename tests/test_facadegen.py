"""facadegen: exact sizing, sound facades that meet their targets, completion, library, colours."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.attributes import FacadeAttributes
from facade_tools.artifacts.building import SIDES, Box, Building, Colors, Element, Facade, Roof
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.exteriors.facade_energy import energy
from facade_tools.exteriors.facade_layout import WIDE_WALL
from facade_tools.exteriors.facade_sizing import sized
from facade_tools.exteriors.facadegen import FacadeOptions, generate_facades
from facade_tools.exteriors.genetic import Search
from facade_tools.exteriors.library import (
    ElementLibrary,
    build_library,
    default_library,
    kmeans,
)
from facade_tools.exteriors.palette import house_colors
from facade_tools.geometry.blocked import wall_of
from facade_tools.geometry.checks import building_problems
from facade_tools.geometry.pieces import facade_pieces
from facade_tools.geometry.solids import building_solid, triangulated

ROOT = Path(__file__).parent.parent
HOUSES = ROOT / "sample_data" / "houses"
STYLES = ("bungalow", "two_storey_gable", "victorian", "modern_flat", "split_garage")


def sample(style: str, number: int = 0) -> Building:
    return list(read([str(HOUSES / f"{style}.jsonl")], "building"))[number]


def bare(building: Building) -> Building:
    """The mass of a house with its own attributes as targets."""
    targets = building_attributes(building)
    return replace(building, facades={}, targets=targets, colors=None, energy=None)


def made(building: Building, seed: int = 0, **options) -> list[Building]:
    rng = np.random.default_rng(seed)
    return list(generate_facades(building, FacadeOptions(**options), rng=rng))


def elements(building: Building):
    return [
        (side, piece, element)
        for side, facade in building.facades.items()
        for piece in facade.pieces
        for element in piece.elements
    ]


# --- sizing -------------------------------------------------------------------------------------


@st.composite
def programmes(draw):
    n = draw(st.integers(1, 8))
    floats = st.floats(0.2, 3.0)
    wanted, share = (np.array(draw(st.lists(floats, min_size=n, max_size=n))) for _ in range(2))
    weight = np.array(draw(st.lists(st.integers(1, 6), min_size=n, max_size=n)), dtype=float)
    part = draw(st.floats(0.0, 1.0))
    low, high = 0.5 * wanted, 1.5 * wanted
    total = (1 - part) * (share * low).sum() + part * (share * high).sum()
    return wanted, share, weight, low, high, float(total)


@given(programmes())
@settings(max_examples=150, deadline=None)
def test_sizes_keep_bounds_and_total_and_no_pair_can_do_better(programme):
    wanted, share, weight, low, high, total = programme
    sizes = sized(*programme)
    assert (sizes >= low - 1e-12).all()
    assert (sizes <= high + 1e-12).all()
    assert share @ sizes == pytest.approx(total, abs=1e-9)
    # The optimum of a convex programme: one multiplier for all sizes between their bounds.
    pull = weight * (sizes - wanted) / share
    inner = (sizes > low + 1e-9) & (sizes < high - 1e-9)
    if inner.any():
        level = pull[inner].mean()
        assert pull[inner] == pytest.approx(level, abs=1e-6)
        assert (pull[sizes <= low + 1e-9] >= level - 1e-6).all()
        assert (pull[sizes >= high - 1e-9] <= level + 1e-6).all()
    assert np.array_equal(sizes, sized.py_func(*programme))


def test_sizes_agree_with_a_quadratic_programming_library():
    import daqp

    rng = np.random.default_rng(0)
    for _ in range(50):
        n = int(rng.integers(2, 9))
        wanted, share = rng.uniform(0.5, 2, n), rng.uniform(0.5, 2, n)
        weight = rng.integers(1, 5, n).astype(float)
        low, high = 0.5 * wanted, 1.5 * wanted
        total = float(rng.uniform(share @ low, share @ high))
        upper, lower = np.append(high, total), np.append(low, total)
        sense = np.array([0] * n + [5], dtype=np.int32)
        hessian, linear = np.diag(weight), -weight * wanted
        solution, *_ = daqp.solve(hessian, linear, share[None].copy(), upper, lower, sense)
        sizes = sized(wanted, share, weight, low, high, total)
        assert sizes == pytest.approx(np.array(solution), abs=1e-6)


def test_totals_out_of_reach_stop_at_the_bounds():
    one = np.ones(3)
    assert sized(one, one, one, 0.5 * one, 1.5 * one, 0.1).tolist() == [0.5] * 3
    assert sized(one, one, one, 0.5 * one, 1.5 * one, 9.0).tolist() == [1.5] * 3
    assert len(sized(*(np.empty(0),) * 5, 1.0)) == 0


# --- facades ------------------------------------------------------------------------------------


@pytest.mark.parametrize("style", STYLES)
def test_facades_are_sound_and_meet_their_targets(style):
    mass = bare(sample(style, 3))
    before = dump_line(encode(mass))
    (house,) = made(mass)
    assert list(building_problems(house)) == []
    assert dump_line(encode(mass)) == before
    assert house.energy is not None
    assert house.energy.facade < 1e-2
    reached = building_attributes(house).facade
    assert house.energy.facade == pytest.approx(energy(reached, mass.targets.facade))
    for value, target in zip(reached.wwr, mass.targets.facade.wwr, strict=True):
        assert value == pytest.approx(target, abs=0.02)


def test_heads_line_up_in_a_storey_on_all_sides():
    (house,) = made(bare(sample("colonial")))
    kinds = {box.id: box.kind for box in house.boxes}
    heads: dict[int, set[float]] = {}
    for _, piece, e in elements(house):
        if e.kind == "window" and kinds[piece.box] == "general":
            storey = int((piece.origin[2] + 1e-6) // house.storey_height)
            heads.setdefault(storey, set()).add(round(piece.origin[2] + e.v + e.height, 2))
    assert all(len(values) == 1 for values in heads.values()), heads


def test_garage_gets_its_door_and_the_front_its_entrance():
    (house,) = made(bare(sample("ranch_l")))
    kinds = {box.id: box.kind for box in house.boxes}
    doors = [(piece, e) for _, piece, e in elements(house) if e.kind == "garage-door"]
    assert doors
    assert all(kinds[piece.box] == "garage" and e.v == 0 for piece, e in doors)
    mains = [(side, e.v) for side, _, e in elements(house) if e.main]
    assert mains == [("front", 0.0)]


def test_without_targets_the_library_gives_them():
    (house,) = made(replace(bare(sample("cape")), targets=None))
    assert list(building_problems(house)) == []
    assert house.energy.facade is not None
    assert {side for side, *_ in elements(house)} == set(SIDES)


def test_same_seed_same_bytes_other_seed_other_house():
    mass = bare(sample("farmhouse"))
    first, again, other = (dump_line(encode(made(mass, seed)[0])) for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_compiled_search_walks_the_path_of_the_plain_one():
    from facade_tools.exteriors import genetic

    mass = bare(sample("bungalow"))
    short = Search(population=12, elite=3, generations=3)
    (fast,) = made(mass, search=short)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(genetic, "evolve", genetic.evolve.py_func)
        (plain,) = made(mass, search=short)
    assert dump_line(encode(fast)) == dump_line(encode(plain))


def test_candidates_differ_and_are_numbered():
    houses = made(bare(sample("cape", 2)), candidates=3)
    assert [house.id for house in houses] == [f"cape-03-{k}" for k in (1, 2, 3)]
    assert len({dump_line(encode(replace(house, id="same"))) for house in houses}) == 3


def test_partial_building_is_refused_with_advice():
    partial = Building("p", (Box("a", "general", 0, 0, 8, 8),), partial=True)
    with pytest.raises(InvalidInput, match="massgen"):
        made(partial)


def test_two_wall_box_meets_the_least_energy_that_its_pieces_allow():
    """Arbitrary symmetry targets on a cube: one piece a side, symmetric or not."""
    cube = Building("cube", (Box("a", "general", 0, 0, 8, 8, 3, Roof("flat")),))
    empty = building_attributes(cube)
    for wwr, sym in product((0.1, 0.25), (0.0, 0.5, 0.8, 1.0)):
        wanted = FacadeAttributes((wwr,) * 4, (sym,) * 4, (None,) * 4)
        (house,) = made(replace(cube, targets=replace(empty, facade=wanted)))
        least = 4 * min(((s - sym) / max(sym, 0.1)) ** 2 for s in (0.0, 1.0))
        assert house.energy.facade == pytest.approx(least, abs=1e-2)


# --- completion ---------------------------------------------------------------------------------


def test_kept_front_stays_to_the_bit_and_the_rest_is_made():
    whole = sample("two_storey_gable", 1)
    front = {"front": whole.facades["front"]}
    keep = Building(whole.id, whole.boxes, front, whole.storey_height, partial=True)
    (house,) = made(bare(whole), keep=keep)
    old = [replace(e, known=True) for p in front["front"].pieces for e in p.elements]
    new = [e for p in house.facades["front"].pieces for e in p.elements]
    assert new == old
    assert {side for side, *_ in elements(house)} == set(SIDES)
    assert list(building_problems(house)) == []


def test_known_element_without_a_wall_is_infeasible():
    whole = sample("two_storey_gable", 1)
    far = replace(whole.boxes[0], depth=whole.boxes[0].depth + 1.0)
    keep = replace(whole, partial=True)
    with pytest.raises(Infeasible, match="known"):
        made(replace(bare(whole), boxes=(far, *whole.boxes[1:])), keep=keep)


def _moved(building: Building, by: float) -> Building:
    """A partial building of the front alone, all of its elements known and moved along."""
    pieces = tuple(
        replace(p, elements=tuple(replace(e, u=e.u + by, known=True) for e in p.elements))
        for p in building.facades["front"].pieces
    )
    return replace(building, facades={"front": Facade(pieces)}, partial=True)


def test_known_elements_that_overlap_are_infeasible():
    mass = bare(sample("two_storey_gable", 1))
    seen = _moved(sample("two_storey_gable", 1), 0.0)
    shifted = _moved(sample("two_storey_gable", 1), 0.03)
    with pytest.raises(Infeasible, match="overlap"):
        made(replace(mass, facades=seen.facades), keep=shifted)


def test_two_known_main_doors_are_infeasible():
    whole = sample("two_storey_gable", 1)
    left, *others = whole.facades["left"].pieces
    door = Element("door", "panel", 1.0, 0.0, 0.9, 2.1, main=True)
    doubled = replace(left, elements=(door,))
    sides = {"front": whole.facades["front"], "left": Facade((doubled, *others))}
    with pytest.raises(Infeasible, match="both main doors"):
        made(bare(whole), keep=replace(whole, facades=sides, partial=True))


def test_element_known_twice_to_the_millimetre_is_one():
    mass = bare(sample("two_storey_gable", 1))
    seen, again = (_moved(sample("two_storey_gable", 1), by) for by in (0.0, 5e-4))
    (house,) = made(replace(mass, facades=seen.facades), keep=again)
    assert [e for side, _, e in elements(house) if side == "front"] == [
        e for _, _, e in elements(again)
    ]


# --- roofs before walls -------------------------------------------------------------------------


def sunk(building: Building) -> list[str]:
    """Elements of which a point 3 cm before the wall lies inside the solid."""
    vertices, triangles, _ = triangulated(building_solid(building))
    corners = vertices[triangles]
    found = []
    for side, piece, e in elements(building):
        wall = wall_of(side, piece)
        start = np.array(wall.start) + 0.03 * np.array(wall.outwards)
        for across, up in product((0.02, 0.25, 0.5, 0.75, 0.98), repeat=2):
            at = start + (e.u + across * e.width) * np.array(wall.along) + (1e-5, 2e-5)
            if _inside(corners, (*at, piece.origin[2] + e.v + up * e.height)):
                found.append(f"{piece.id} {e.kind}")
                break
    return found


def _inside(corners, point) -> bool:
    """Whether an odd number of triangles (n, 3, 3) lie above a point."""
    edges = np.roll(corners, -1, axis=1) - corners
    offset = np.array(point) - corners
    turns = edges[..., 0] * offset[..., 1] - edges[..., 1] * offset[..., 0]
    over = corners[(turns > 0).all(axis=1) | (turns < 0).all(axis=1)]
    normal = np.cross(over[:, 1] - over[:, 0], over[:, 2] - over[:, 0])
    height = (normal * (over[:, 0] - np.array(point))).sum(axis=1) / normal[:, 2]
    return bool((height > 0).sum() % 2)


def _two(*boxes: Box) -> Building:
    targets = replace(building_attributes(sample("two_storey_gable")), id="m")
    return Building("m", boxes, targets=targets)


def _roofs_before_walls() -> dict[str, Building]:
    hip, gable, shed = (Roof(style, 35, "x", 0.4) for style in ("hip", "gable", "shed"))
    lean = {"depth": 2.82, "height": 3.0}
    return {
        "hip behind": _two(
            Box("main", "general", 6.25, 3.79, 12.5, 7.58, 5.9, hip),
            Box("wing", "general", 6.25, 8.99, 12.5, **lean, roof=hip),
        ),
        "gable behind": _two(
            Box("main", "general", 6.25, 3.79, 12.5, 7.58, 5.9, gable),
            Box("wing", "general", 6.25, 8.99, 6.5, **lean, roof=Roof("gable", 35, "y", 0.4)),
        ),
        **{
            f"tall box in a {roof.style}": _two(
                Box("main", "general", 6, 5, 12, 10, 4.9, roof),
                Box("tall", "general", 7, 6, 4, 4, 10, gable),
            )
            for roof in (gable, shed, hip)
        },
    }


@pytest.mark.parametrize("name", _roofs_before_walls())
def test_no_element_is_sunk_in_a_lower_roof(name):
    mass = _roofs_before_walls()[name]
    for seed in range(2):
        done = made(mass, seed)[0]
        assert sunk(done) == []
        assert list(building_problems(done)) == []


def test_no_sample_house_has_a_window_sunk_in_a_roof():
    for style in ("victorian", "split_garage", "hip_porches"):
        houses = read([str(HOUSES / f"{style}.jsonl")], "building")
        assert [house.id for house in houses if sunk(house)] == []


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


# --- command ------------------------------------------------------------------------------------


def test_command_on_a_stream_with_a_library_of_its_own(facade, tmp_path):
    masses = tmp_path / "masses.jsonl"
    masses.write_bytes(b"".join(dump_line(encode(bare(sample("cape", k)))) for k in (0, 1)))
    library = str(HOUSES / "cape.jsonl")
    done = facade("facadegen", masses, "--library", library, "--seed", 4)
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["id"] for row in rows] == ["cape-01", "cape-02"]
    names = [source["name"] for source in rows[0]["provenance"]["inputs"]]
    assert names == ["masses.jsonl", "cape.jsonl"]
    assert rows[0]["provenance"]["seed"] == 4


def test_pieces_of_the_result_are_those_of_the_mass():
    (house,) = made(bare(sample("victorian")))
    for side, pieces in facade_pieces(house).items():
        stripped = tuple(replace(p, elements=()) for p in house.facades[side].pieces)
        assert stripped == pieces


# --- designs ------------------------------------------------------------------------------------


def test_design_takes_the_place_of_the_front_with_its_door(facade, tmp_path):
    mass = tmp_path / "mass.jsonl"
    mass.write_bytes(dump_line(encode(bare(sample("colonial")))))
    design = ROOT / "sample_data" / "designs" / "house-front.yaml"
    out = tmp_path / "house.jsonl"
    done = facade("facadegen", mass, "--design", f"front:{design}", "-o", out)
    assert done.returncode == 0, done.stderr
    (house,) = read([str(out)], "building")
    assert list(building_problems(house)) == []
    front = [e for side, _, e in elements(house) if side == "front"]
    assert [e.main for e in front if e.kind == "door"] == [True]
    assert len({round(e.width, 6) for e in front if e.kind == "window" and e.style == "sash"}) >= 1
    assert {side for side, *_ in elements(house)} == set(SIDES)


def door_design(width: float, height: float) -> list[Element]:
    door = Element("door", "panel", width / 2 - 0.5, 0.0, 1.0, 2.1, main=True)
    return [door, Element("window", "sash", 0.5, 1.0, 0.8, 1.0)]


def test_main_door_is_in_the_front_where_other_sides_are_designed():
    mass = bare(sample("split_garage"))
    (house,) = made(mass, designs=dict.fromkeys(SIDES, door_design))
    assert list(building_problems(house)) == []
    assert [side for side, _, e in elements(house) if e.main] == ["front"]
    assert {side for side, _, e in elements(house) if e.kind == "door" and e.known} == set(SIDES)


def test_garage_beside_a_designed_wall_has_its_door():
    mass = bare(sample("split_garage"))
    (house,) = made(mass, designs={"front": door_design})
    assert [side for side, _, e in elements(house) if e.kind == "garage-door"] == ["front"]


def test_piece_that_loses_its_whole_design_is_generated():
    mass = bare(sample("colonial"))
    (house,) = made(
        mass, designs={"front": lambda w, h: [Element("window", "sash", 1, 0.5, 1, h - 1)]}
    )
    assert list(building_problems(house)) == []
    assert all(piece.elements for piece in house.facades["front"].pieces)


def test_observed_side_cannot_be_designed():
    house = sample("colonial")
    keep = replace(house, partial=True, facades={"front": house.facades["front"]})
    with pytest.raises(InvalidInput, match="front was observed"):
        made(bare(house), keep=keep, designs={"front": door_design})


def test_front_that_takes_no_main_door_is_reported(caplog):
    thin = Building("thin", (Box("main", "general", 0.4, 4, 0.8, 8, 3, Roof("flat", 0, "x")),))
    made(thin)
    assert "no main door" in caplog.text


def test_design_of_no_side_is_refused(facade):
    done = facade("facadegen", HOUSES / "cape.jsonl", "--design", "roof:x.yaml")
    assert done.returncode == 3
    assert b"SIDE:DESIGN" in done.stderr
