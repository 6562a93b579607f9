"""facadegen: exact sizing, sound facades that meet their targets, completion, roofs."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from facade_houses import HOUSES, bare, elements, made, sample
from hypothesis import given, settings
from hypothesis import strategies as st

from facade_tools.artifacts.attributes import FacadeAttributes
from facade_tools.artifacts.building import SIDES, Box, Building, Element, Facade, Roof
from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read
from facade_tools.errors import Infeasible, InvalidInput
from facade_tools.exteriors.attributes import building_attributes
from facade_tools.exteriors.facade_energy import energy
from facade_tools.exteriors.facade_sizing import sized
from facade_tools.exteriors.genetic import Search
from facade_tools.geometry.blocked import wall_of
from facade_tools.geometry.checks import building_problems
from facade_tools.geometry.pieces import facade_pieces
from facade_tools.geometry.solids import building_solid, triangulated

STYLES = ("bungalow", "two_storey_gable", "victorian", "modern_flat", "split_garage")


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


def test_garage_under_an_upper_storey_gets_a_door_beside_the_entrance():
    main = Box("main", "general", 6, 4, 12, 8, 5.4, Roof("hip"))
    garage = Box("garage", "garage", 9, 3, 6, 6, 2.6, Roof("hip"))
    (house,) = made(bare(replace(sample("colonial"), boxes=(main, garage))))
    assert list(building_problems(house)) == []
    doors = [(piece.id, e) for _, piece, e in elements(house) if e.kind == "garage-door"]
    (entrance,) = [(piece.id, e) for _, piece, e in elements(house) if e.main]
    assert doors
    assert all(wall == entrance[0] and e.u >= 6 for wall, e in doors)
    assert entrance[1].u + entrance[1].width < min(e.u for _, e in doors)


def test_house_in_one_plane_with_its_garage_has_the_main_door_beside_it():
    boxes = (
        Box("main", "general", 6, 6, 12, 6, 6.0, Roof("hip")),
        Box("wing", "general", 2.75, 4.4, 5.5, 8.8, 2.7, Roof("gable", direction="y")),
        Box("garage", "garage", 8.75, 3.2, 6.5, 6.4, 2.7, Roof("gable", direction="y")),
    )
    (house,) = made(bare(replace(sample("colonial"), boxes=boxes)))
    assert list(building_problems(house)) == []
    (entrance,) = [e for _, _, e in elements(house) if e.main]
    doors = [e for _, _, e in elements(house) if e.kind == "garage-door"]
    assert doors
    assert all(e.u >= 5.5 for e in doors)
    assert entrance.u + entrance.width <= 5.5


def test_porch_beside_a_garage_shelters_the_door_in_the_wall_of_both():
    boxes = (
        Box("main", "general", 7.65, 4.8, 15.3, 7.4, 5.4, Roof("gable")),
        Box("wing", "general", 7.24, 2.05, 1.72, 4.1, 2.6, Roof("gable", direction="y")),
        Box("garage", "garage", 3.48, 3.4, 5.8, 6.8, 2.6, Roof("gable", direction="y")),
        Box("porch", "porch", 7.7, 0.3, 2.6, 1.5, 2.45, Roof("gable", direction="y")),
    )
    (house,) = made(bare(replace(sample("colonial"), boxes=boxes)))
    assert list(building_problems(house)) == []
    ((piece, door),) = [(piece, e) for _, piece, e in elements(house) if e.main]
    assert piece.box == "garage"
    assert 6.4 < piece.origin[0] + door.u + door.width / 2 < 9.0


@pytest.mark.parametrize("deeper", [0.0, 0.4])
def test_main_door_stands_behind_the_porch_whatever_the_targets(deeper):
    """Also where sampled measures put the porch at one end, or some way into the house."""
    for number in range(4):
        house, other = bare(sample("farmhouse", number)), bare(sample("farmhouse", number + 8))
        porch = next(box for box in house.boxes if box.kind == "porch" and box.y < 0)
        wall = next(
            p for p in facade_pieces(house)["front"] if abs(porch.x - p.origin[0]) < p.width
        )
        narrow = replace(porch, x=wall.origin[0] + 1.5, y=porch.y + deeper, width=2.0)
        boxes = tuple(narrow if box is porch else box for box in house.boxes)
        (done,) = made(replace(house, boxes=boxes, targets=other.targets))
        ((piece, door),) = [(piece, e) for _, piece, e in elements(done) if e.main]
        middle = piece.origin[0] + door.u + door.width / 2
        assert abs(middle - narrow.x) <= narrow.width / 2 - 0.5 + 1e-9


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
