"""From attributes to mass models with roofs (FW16 6.1), from scratch or around known boxes."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..artifacts.attributes import Attributes
from ..artifacts.building import Box, Building, Energy
from ..artifacts.model import Model
from ..errors import Infeasible
from .annealing import search
from .mass_attributes import KINDS
from .mass_candidates import Mass, diverse
from .mass_energy import Target, layout_of, mass_energy, relative_residuals
from .mass_hints import search_target
from .mass_layout import EMPTY, GARAGE, GENERAL, Layout, move_to_origin
from .mass_polish import round_layout
from .mass_porches import clear_porches, outside_porches
from .mass_roofs import (
    chimney_of,
    draw_roof_plan,
    missing_styles,
    roofed,
    under_tower,
    with_tower,
)
from .mass_search import new_pool, pooled, rank
from .relations import states_storeys
from .roof_library import RoofLibrary

log = logging.getLogger("facade_tools.massgen")

POOL = 48
GRAIN = 1e-3  # generated positions and sizes are rounded to it (m)
ROUNDING = 1e-6  # energy that rounding may cost without another try
LIFTS = (0.0, 0.5, -0.5)  # heights near the threshold of a storey are rounded up, or down
LEAST_WALL = 2.3  # of a general box where it changes no attribute (m)
MET = 0.01  # a group whose relative residual is less counts as met


def generate_mass(
    attributes: Attributes,
    *,
    rng: np.random.Generator,
    keep: Building | None = None,
    candidates: int = 1,
    require: float | None = None,
    model: Model | None = None,
    library: RoofLibrary | None = None,
) -> Iterator[Building]:
    """Yield buildings (boxes and roofs, no facades) whose mass attributes are those wanted.

    Unknown attributes leave the search free. keep: boxes that stay exactly as they are, with
    what is `complete`, and its storey height where it states one (not the default) or shows walls;
    their unknown heights and roofs are filled in.
    candidates: how many, in order of energy, mutually different (see `mass_candidates`). require:
    raises Infeasible where the best energy is above it, and in any case where there is no mass.
    model: attributes that `keep` contradicts are drawn from it anew, given the others. library:
    roofs are mansards, as steep, and their eaves as far out, as those of a building like this.
    `energy.residuals` names the groups that the result misses.
    """
    if keep is not None and (keep.facades or states_storeys(keep)):
        attributes = replace(attributes, storey_height=keep.storey_height)
    target = search_target(attributes, keep, rng=rng)
    masses = find_masses(target, keep, candidates, rng=rng)
    if model is not None and keep is not None and masses:
        from .mass_editing import suggestion  # the model's machinery, only where it is wanted

        suited = suggestion(attributes, keep, masses[0].shares, model, rng=rng)
        if suited is not None:
            attributes = suited
            target = search_target(attributes, keep, rng=rng)
            masses = find_masses(target, keep, candidates, rng=rng)
    if not masses:
        raise Infeasible(f"no mass for {attributes.id!r}: what is known leaves no general box")
    if require is not None and masses[0].energy > require:
        raise Infeasible(f"mass energy {masses[0].energy:.3g}; required at most {require:g}")
    if masses[0].energy > 1e-3:
        missed = ", ".join(relative_residuals(masses[0].shares, MET)) or "none"
        log.warning("%s: energy %.3g; not met: %s", attributes.id, masses[0].energy, missed)
    for number, mass in enumerate(masses, start=1):
        name = attributes.id if candidates == 1 else f"{attributes.id}-{number}"
        yield _finished(name, attributes, mass, keep, library, rng=rng)


def find_masses(
    target: Target, keep: Building | None, count: int, *, rng: np.random.Generator
) -> list[Mass]:
    """Return up to `count` different masses around the boxes of `keep`, best first."""
    known = keep.boxes if keep else ()
    base = layout_of(known, locked=True)
    pool = new_pool(POOL)
    rounds = 2 if count == 1 else 4 + count
    search(pool, base, target, rounds, rng=rng)
    found = []
    rows = pool.history[: pool.counts[1]].tolist()
    curve = tuple((int(done), float(f"{energy:.4g}")) for done, energy in rows)
    for k in np.flatnonzero(np.isfinite(pool.energies)).tolist():
        layout = pooled(pool, k)
        _raise_low_walls(layout, target.storey_height)
        if not known:
            move_to_origin(layout)
        mass = _rounded(layout, known, target, curve)
        mass = _changed(mass, outside_porches(mass.boxes, keep), target)
        found.append((rank(mass.energy, pool.taste[k]), mass))
    ranked = [mass for _, mass in sorted(found, key=lambda row: row[0])]
    chosen = [
        _changed(mass, clear_porches(mass.boxes, keep), target) for mass in diverse(ranked, count)
    ]
    return sorted(chosen, key=lambda mass: mass.energy)


def _rounded(
    layout: Layout, known: Sequence[Box], target: Target, curve: tuple[tuple[int, float], ...]
) -> Mass:
    """Return a layout's mass, rounded to the grain in the way that costs least.

    What meets its targets by gaps and jogs below a millimetre loses them, and goes behind others.
    """
    near = 1.5 * _mass(layout, known, target, curve).energy + ROUNDING
    tries = []
    for lift in LIFTS:
        trial = Layout(layout.rows.copy(), layout.kinds.copy(), layout.locks.copy())
        round_layout(trial, GRAIN, lift)
        tries.append(_mass(trial, known, target, curve))
        if tries[-1].energy <= near:
            break
    return min(tries, key=lambda mass: mass.energy)


def _changed(mass: Mass, boxes: tuple[Box, ...], target: Target) -> Mass:
    """Return a mass with other boxes and the energy of these."""
    return mass if boxes == mass.boxes else Mass(boxes, *mass_energy(boxes, target), mass.curve)


def _raise_low_walls(layout: Layout, storey_height: float) -> None:
    """Raise general boxes that a person could not enter, in place; no storey comes or goes.

    The attributes say nothing of a box between half a storey and one and a half.
    """
    solid = np.isin(layout.kinds, (GENERAL, GARAGE))
    if not solid.any():
        return
    highest = float(layout.rows[solid, 4].max())
    least = min(LEAST_WALL, highest, 1.5 * storey_height * (1 - 1e-6))
    low = (layout.kinds == GENERAL) & (layout.locks == 0) & (layout.rows[:, 4] < least)
    layout.rows[low, 4] = least


def _mass(
    layout: Layout, known: Sequence[Box], target: Target, curve: tuple[tuple[int, float], ...]
) -> Mass:
    boxes = boxes_of(layout, known)
    return Mass(boxes, *mass_energy(boxes, target), curve)


def boxes_of(layout: Layout, known: Sequence[Box]) -> tuple[Box, ...]:
    """Return the boxes of a layout without roofs; the first ones are the `known` ones."""
    boxes = [
        box if box.height is not None else replace(box, height=float(layout.rows[k, 4]))
        for k, box in enumerate(known)
    ]
    names = {box.id for box in boxes}
    new = [k for k in range(len(known), len(layout.kinds)) if layout.kinds[k] != EMPTY]
    for k in sorted(new, key=lambda k: (layout.kinds[k], -_volume(layout.rows[k]))):
        kind = KINDS[layout.kinds[k]]
        name = _free_name("main" if not names and kind == "general" else _NAMES[kind], names)
        names.add(name)
        x0, y0, x1, y1, height = layout.rows[k].tolist()
        centre = round((x0 + x1) / 2, 9), round((y0 + y1) / 2, 9)
        size = round(x1 - x0, 9), round(y1 - y0, 9), round(height, 9)
        boxes.append(Box(name, kind, *centre, *size))  # type: ignore[arg-type]
    return tuple(boxes)


_NAMES = {"general": "wing", "garage": "garage", "porch": "porch"}


def _volume(row: np.ndarray) -> float:
    return float((row[2] - row[0]) * (row[3] - row[1]) * row[4])


def _free_name(name: str, taken: set[str]) -> str:
    numbered = (f"{name}-{n}" for n in range(2, len(taken) + 3))
    return next(n for n in (name, *numbered) if n not in taken)


def _ids(keep: Building | None) -> frozenset[str]:
    return frozenset(box.id for box in keep.boxes) if keep else frozenset()


def _finished(
    name: str,
    attributes: Attributes,
    mass: Mass,
    keep: Building | None,
    library: RoofLibrary | None,
    *,
    rng: np.random.Generator,
) -> Building:
    """Return the building of a mass: towers, roofs, chimneys, energy."""
    special = attributes.element.special
    wanted = {part for part in ("chimney", "tower") if special.get(part) == 1}
    wanted |= set(keep.features) if keep else set()
    tower = "tower" in wanted and not any(b.roof and b.roof.style == "cone" for b in mass.boxes)
    added = tower and not (keep and "mass" in keep.complete)
    boxes = with_tower(mass.boxes, rng=rng) if added else mass.boxes
    boxes = under_tower(boxes, _ids(keep), attributes.storey_height) if tower else boxes
    roofs = draw_roof_plan(attributes.element, rng=rng)
    if library is not None:
        roofs = replace(roofs, like=library.like(attributes, rng=rng))
    boxes = roofed(boxes, roofs, tower=tower)
    chimneys = keep.chimneys if keep else ()
    if "chimney" in wanted and not chimneys:
        chimney = chimney_of(boxes, rng=rng)
        chimneys = (chimney,) if chimney else ()
    cones = any(b.roof and b.roof.style == "cone" for b in boxes)
    residuals = relative_residuals(mass.shares, MET)
    if missing := missing_styles(attributes.element, boxes):
        log.warning("%s: no box is left for a roof of style %s", name, " or ".join(missing))
        residuals["roof"] = float(len(missing))
    features = [part for part, there in (("chimney", chimneys), ("tower", cones)) if there]
    return Building(
        id=name,
        boxes=boxes,
        facades=keep.facades if keep else {},
        storey_height=attributes.storey_height,
        features=tuple(part for part in features if part in wanted),
        chimneys=chimneys,
        targets=replace(attributes, provenance=None),
        energy=Energy(mass=mass.energy, residuals=residuals),
        tags={"mass_energy_curve": mass.curve},
    )
