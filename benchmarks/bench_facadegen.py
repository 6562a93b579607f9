"""Figures of `facade facadegen`: `python benchmarks/bench_facadegen.py [NAME]`.

NAME: sizing, held-out [FOLDER], least, completion, ablation [FOLDER], chain MASSES; without it all
but chain. Held-out buildings are sample houses of another seed than those of the shipped library.
FOLDER takes buildings to look at.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "sample_data"))

import make_samples  # noqa: E402  (beside the sample houses, not a package)

from facade_tools.artifacts.attributes import FacadeAttributes  # noqa: E402
from facade_tools.artifacts.building import SIDES, Building, Element, Facade, Piece  # noqa: E402
from facade_tools.artifacts.documents import encode  # noqa: E402
from facade_tools.artifacts.model import Model  # noqa: E402
from facade_tools.artifacts.numbers import dump_line  # noqa: E402
from facade_tools.artifacts.store import read_one  # noqa: E402
from facade_tools.artifacts.writing import write_bytes  # noqa: E402
from facade_tools.exteriors.attributes import building_attributes  # noqa: E402
from facade_tools.exteriors.facade_sizing import sized  # noqa: E402
from facade_tools.exteriors.facadegen import FacadeOptions, generate_facades  # noqa: E402
from facade_tools.exteriors.samples import SampleOptions, sample_attributes  # noqa: E402
from facade_tools.geometry.checks import building_problems  # noqa: E402
from facade_tools.geometry.pieces import facade_pieces  # noqa: E402
from facade_tools.randomness import item_generator  # noqa: E402

HELD_OUT_SEED = 999
PAPER_SECONDS = 60.0  # FW16: one minute a building


def held_out(per_style: int) -> list[Building]:
    return list(make_samples.houses(per_style, HELD_OUT_SEED))


def undressed(house: Building) -> Building:
    return replace(house, facades={}, colors=None, targets=building_attributes(house))


def finished(mass: Building, **options: object) -> list[Building]:
    rng = item_generator(0, "bench-facadegen", mass.id)
    return list(generate_facades(mass, FacadeOptions(**options), rng=rng))  # type: ignore[arg-type]


def write_buildings(path: Path, houses: Iterable[Building]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(path, b"".join(dump_line(encode(house)) for house in houses))


def row(name: str, value: str, wanted: str) -> None:
    print(f"{name:<58} {value:>14}   {wanted}")


def bench_held_out(folder: str = "build/held-out") -> None:
    """Targets of held-out buildings on their own masses; writes each building and its copy."""
    originals = held_out(20)
    houses = [undressed(house) for house in originals]
    finished(houses[0])  # compile
    start = time.process_time()
    done = [finished(house)[0] for house in houses]
    seconds = (time.process_time() - start) / len(houses)
    copies = [replace(house, id=f"{house.id}-made") for house in done]
    pairs_made = (house for pair in zip(originals, copies, strict=True) for house in pair)
    write_buildings(Path(folder) / "pairs.jsonl", pairs_made)
    energies = np.array([house.energy.facade for house in done])
    pairs = [
        (value, target)
        for house in done
        for value, target in zip(
            building_attributes(house).facade.wwr, house.targets.facade.wwr, strict=True
        )
        if value is not None and target is not None
    ]
    near = np.mean([abs(value - target) <= 0.02 for value, target in pairs])
    broken = sum(bool(list(building_problems(house))) for house in done)
    row(
        f"held-out buildings ({len(houses)}): energy below 1e-2",
        f"{np.mean(energies < 1e-2):.1%}",
        "≥ 90%",
    )
    row(
        "  median and 95th percentile of the energy",
        f"{np.median(energies):.1e} {np.quantile(energies, 0.95):.1e}",
        "",
    )
    row(f"  wwr within 0.02 ({len(pairs)} sides)", f"{near:.1%}", "≥ 90%")
    row("  buildings that break a rule of geometry", f"{broken}", "0")
    row(
        "  buildings a second on one core",
        f"{1 / seconds:.1f}",
        f"≥ 3; {PAPER_SECONDS / seconds:.0f} × the paper's speed",
    )


def least_by_exhaustion(mass: Building, wanted: FacadeAttributes) -> float:
    """Least energy over all subsets of symmetric, filled and aligned pieces, side by side.

    The ratio counts only as far as main door and garage door exceed it; a piece of less than 0.9 m
    in width or 1.9 m in height stays empty. The garage door stands in the middle of its wall, the
    main door behind its porch: where that does not reach the middle, the wall is not symmetric.
    """
    off_middle = door_walls_off_middle(mass)
    garages = {box.id for box in mass.boxes if box.kind == "garage"}
    total = 0.0
    for k, side in enumerate(SIDES):
        pieces = facade_pieces(mass)[side]
        usable = [p for p in pieces if p.width >= 0.9 and p.height >= 1.9]
        areas = [p.width * p.height for p in usable]
        wall = sum(p.width * p.height for p in pieces)
        pairs = [
            (i, j)
            for i, low in enumerate(usable)
            for j, high in enumerate(usable)
            if above(side, low, high)
        ]
        ratio = must_stand(mass, side) / wall
        over = term(ratio, wanted.wwr[k]) if ratio > (wanted.wwr[k] or 0.0) else 0.0
        allowed = [
            "a" if p.id in off_middle else "s" if side == "front" and p.box in garages else "esa"
            for p in usable
        ]
        best = np.inf
        for states in product(*allowed):  # empty, symmetric, asymmetric
            sym = (
                1.0 - sum(a for a, state in zip(areas, states, strict=True) if state == "a") / wall
            )
            filled = sum(states[i] != "e" and states[j] != "e" for i, j in pairs)
            fractions = [met / filled for met in range(filled + 1)] if filled else [1.0]
            align = min(term(f, wanted.align[k]) for f in fractions)
            best = min(best, term(sym, wanted.sym[k]) + align)
        total += best + over
    return total


def must_stand(mass: Building, side: str) -> float:
    """Return the area of the doors that a front has to have (m²)."""
    garages = [b for b in mass.boxes if b.kind == "garage"] if side == "front" else []
    doors = sum(2.1 * min(2.4, box.width - 0.5) for box in garages)
    return doors + (2.0 if side == "front" else 0.0)


def door_walls_off_middle(mass: Building) -> set[str]:
    """Return front walls with a porch under which the middle of the wall does not lie."""
    found = set()
    for piece in facade_pieces(mass)["front"]:
        x, y, z = piece.origin
        for box in mass.boxes:
            touches = box.kind == "porch" and abs(box.y + box.depth / 2 - y) < 0.05 and z == 0
            if touches and abs(box.x - x - piece.width / 2) > box.width / 2 - 0.5:
                found.add(piece.id)
    return found


def term(value: float, target: float | None) -> float:
    return 0.0 if target is None else ((value - target) / max(target, 0.1)) ** 2


def above(side: str, low: Piece, high: Piece) -> bool:
    axis = 0 if side in ("front", "back") else 1
    sign = -1.0 if side in ("back", "left") else 1.0
    if abs(low.origin[1 - axis] - high.origin[1 - axis]) > 1e-6:
        return False
    if abs(low.origin[2] + low.height - high.origin[2]) > 1e-6:
        return False
    a, b = sign * low.origin[axis], sign * high.origin[axis]
    shared = min(a + low.width, b + high.width) - max(a, b)
    return shared >= min(low.width, high.width) / 2 - 1e-6


def bench_least() -> None:
    """Arbitrary targets on small masses against exhaustion."""
    rng = np.random.default_rng(0)
    gaps = []
    for house in held_out(20):
        mass = undressed(house)
        sizes = [len(pieces) for pieces in facade_pieces(mass).values()]
        if sum(sizes) > 8:
            continue
        for _ in range(3):
            values = [
                tuple(float(v) for v in rng.uniform(*bounds, 4))
                for bounds in ((0.08, 0.25), (0.0, 1.0), (0.0, 1.0))
            ]
            wanted = FacadeAttributes(*values)
            (done,) = finished(replace(mass, targets=replace(mass.targets, facade=wanted)))
            gaps.append(done.energy.facade - least_by_exhaustion(mass, wanted))
    near = np.mean(np.array(gaps) <= 1e-2)
    row(
        f"arbitrary targets, masses of ≤ 8 pieces ({len(gaps)})",
        f"{near:.1%}",
        "within 1e-2 of the least",
    )
    row("  median and largest gap", f"{np.median(gaps):.1e} {np.max(gaps):.1e}", "")


def bench_chain(source: str | None = None) -> None:
    """1,000 buildings of the chain against the rules of geometry, and what they reach.

    source: masses that `facade massgen` made; without it they are read from standard input.
    """
    from facade_tools.artifacts.store import read

    energies, broken, seconds = [], [], 0.0
    near: dict[str, list[bool]] = {key: [] for key in ("wwr", "sym", "align")}
    for mass in read([source or "-"], "building"):
        start = time.process_time()
        (done,) = finished(mass)
        seconds += time.process_time() - start if energies else 0.0
        energies.append(done.energy.facade)
        problems = list(building_problems(done))
        broken += [(done.id, *problem) for problem in problems]
        if done.targets is not None:
            for key, found in near.items():
                off = np.abs(difference(done, done, key))
                found += (off[~np.isnan(off)] <= 0.02).tolist()
    count = len(energies)
    row(f"chain: violations in {count} generated buildings", f"{len(broken)}", "0")
    row("  buildings a second on one core", f"{max(count - 1, 1) / max(seconds, 1e-9):.1f}", "≥ 3")
    row("  median energy of sampled targets", f"{np.median(energies):.2f}", "(not all can be met)")
    shares = " ".join(f"{np.mean(found):.1%}" for found in near.values() if found)
    row("  sides within 0.02: wwr, sym, align", shares, "")
    for name, pointer, message in broken[:10]:
        print("   ", name, pointer, message)


def overlap(a: Element, b: Element) -> float:
    w = min(a.u + a.width, b.u + b.width) - max(a.u, b.u)
    h = min(a.v + a.height, b.v + b.height) - max(a.v, b.v)
    both = max(w, 0.0) * max(h, 0.0)
    return both / (a.width * a.height + b.width * b.height - both)


def hits(truth: Facade, guess: Facade) -> tuple[int, int, int]:
    """Return matches at an overlap (IoU) of at least 0.3, true elements, guessed elements."""
    found = true = guessed = 0
    for old, new in zip(truth.pieces, guess.pieces, strict=True):
        rest = list(new.elements)
        true, guessed = true + len(old.elements), guessed + len(rest)
        for element in old.elements:
            best = max(rest, key=lambda e, o=element: overlap(o, e), default=None)
            if best is not None and overlap(element, best) >= 0.3:
                rest.remove(best)
                found += 1
    return found, true, guessed


def score(truth: Building, guess: Building) -> float:
    """Return the F1 over the hidden sides."""
    rows = [hits(truth.facades[side], guess.facades[side]) for side in SIDES[1:]]
    found, true, guessed = np.sum(rows, axis=0)
    return 2 * found / max(true + guessed, 1)


def mirrored_front(truth: Building) -> Building:
    """Return the baseline: hidden walls show the most similar front wall, mirrored, scaled."""
    facades = {"front": truth.facades["front"]}
    for side in SIDES[1:]:
        pieces = []
        for piece in truth.facades[side].pieces:
            like = min(truth.facades["front"].pieces, key=lambda p, q=piece: unlike(p, q))
            scale = piece.width / like.width
            elements = tuple(
                replace(e, u=(like.width - e.u - e.width) * scale, width=e.width * scale)
                for e in like.elements
            )
            pieces.append(replace(piece, elements=elements))
        facades[side] = Facade(tuple(pieces))
    return replace(truth, facades=facades)


def unlike(one: Piece, other: Piece) -> float:
    level = abs(one.origin[2] - other.origin[2])
    return 10 * level + abs(one.width - other.width) + abs(one.height - other.height)


def bench_completion() -> None:
    """From mass and front: best of the five most probable completions, and mirroring the front.

    The hidden sides' targets are drawn from a model learned on the sample houses, given what is
    seen (`sample --given --top -n 5`).
    """
    model = learned_model()
    ours, near, mirror = [], [], []
    for truth in held_out(5)[:50]:
        seen = {"front": truth.facades["front"]}
        known = ("mass", "garage", "porch", "roof")
        keep = replace(truth, facades=seen, partial=True, complete=known)
        mass = replace(truth, facades={}, colors=None)
        given = building_attributes(keep)
        rng = item_generator(0, "bench-completion", truth.id)
        draws = sample_attributes(
            model, 5, rng=rng, given=given, options=SampleOptions(top=True, neighbours=False)
        )
        guesses = [finished(replace(mass, targets=row), keep=keep)[0] for row in draws]
        ours.append(max(score(truth, guess) for guess in guesses))
        near.append(max(score(truth, guess) for guess in finished(mass, keep=keep, candidates=5)))
        mirror.append(score(truth, mirrored_front(truth)))
    row(
        f"completion from the front ({len(ours)}): F1, best of five",
        f"{np.mean(ours):.3f}",
        f"mirrored front {np.mean(mirror):.3f}",
    )
    row("  without the model, targets of similar houses", f"{np.mean(near):.3f}", "")


def learned_model() -> Model:
    """Return the model that `facade learn sample_data/houses` learns."""
    facade = str(Path(sys.executable).with_name("facade"))
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/model.json"
        houses = str(ROOT / "sample_data" / "houses")
        subprocess.run([facade, "-q", "learn", houses, "-o", path], check=True)
        return read_one(path, "model")


ABLATIONS = {
    "all three": (),
    "without wwr": ("wwr",),
    "without sym": ("sym",),
    "without align": ("align",),
}


def bench_ablation(folder: str = "build/ablation") -> None:
    """Leave out one attribute of the targets at a time; writes buildings to look at."""
    houses = [undressed(house) for house in held_out(3)]
    for name, left_out in ABLATIONS.items():
        done = []
        for mass in houses:
            free = dict.fromkeys(left_out, (None,) * 4)
            targets = replace(mass.targets, facade=replace(mass.targets.facade, **free))
            done += finished(replace(mass, targets=targets))
        pairs = list(zip(done, houses, strict=True))
        errors = [
            float(np.nanmean([np.abs(difference(h, m, key)) for h, m in pairs]))
            for key in ("wwr", "sym", "align")
        ]
        row(
            f"ablation, {name}: mean error of wwr, sym, align",
            " ".join(f"{e:.3f}" for e in errors),
            "",
        )
        kind = name.replace(" ", "-")
        named = (replace(house, id=f"{house.id} {kind}") for house in done)
        write_buildings(Path(folder) / f"{kind}.jsonl", named)


def difference(house: Building, mass: Building, key: str) -> np.ndarray:
    reached = np.array(getattr(building_attributes(house).facade, key), dtype=float)
    return reached - np.array(getattr(mass.targets.facade, key), dtype=float)


def bench_sizing() -> None:
    """Compare the knapsack with a quadratic programming library."""
    import daqp

    rng = np.random.default_rng(0)
    n, count = 12, 2000
    wanted, share = rng.uniform(0.5, 2, (count, n)), rng.uniform(0.5, 2, (count, n))
    low, high, one = 0.5 * wanted, 1.5 * wanted, np.ones(n)
    totals = np.array([rng.uniform(s @ a, s @ b) for s, a, b in zip(share, low, high, strict=True)])
    sized(wanted[0], share[0], one, low[0], high[0], totals[0])
    start = time.process_time()
    ours = [
        sized(*args) for args in zip(wanted, share, [one] * count, low, high, totals, strict=True)
    ]
    mine = time.process_time() - start
    sense = np.array([0] * n + [5], dtype=np.int32)
    start = time.process_time()
    theirs = [
        daqp.solve(np.eye(n), -a, s[None].copy(), np.append(b, t), np.append(l, t), sense)[0]
        for a, s, l, b, t in zip(wanted, share, low, high, totals, strict=True)  # noqa: E741
    ]
    other = time.process_time() - start
    worst = np.abs(np.array(ours) - np.array(theirs)).max()
    row(
        "sizing, 12 sizes: microseconds each",
        f"{1e6 * mine / count:.1f}",
        f"daqp {1e6 * other / count:.1f}; differ by {worst:.0e}",
    )


BENCHES = {
    "sizing": bench_sizing,
    "held-out": bench_held_out,
    "least": bench_least,
    "completion": bench_completion,
    "ablation": bench_ablation,
    "chain": bench_chain,
}


def main() -> None:
    name, *rest = sys.argv[1:] or [""]
    if name and name not in BENCHES:
        sys.exit(__doc__)
    for key in [name] if name else [key for key in BENCHES if key != "chain"]:
        BENCHES[key](*rest)


if __name__ == "__main__":
    main()
