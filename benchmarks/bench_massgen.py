"""Mass generation against the figures of FW16: exactness, speed, validity, round trip.

    python benchmarks/bench_massgen.py [BUILDINGS...]   houses that nothing was tuned on
        [--model MODEL.json]                            also targets sampled from a model
        [--per-style 8] [--round-trip 50]

Without BUILDINGS it draws houses from the sample generator with a seed that the repository does
not ship. The ablation of FW16 Fig. 9 is benchmarks/bench_mass_ablation.py.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from facade_tools.artifacts.attributes import Attributes
from facade_tools.artifacts.building import Building
from facade_tools.artifacts.documents import decode, encode
from facade_tools.artifacts.store import read
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.annealing import PLAIN, RESTARTS, THRESHOLD, anneal
from facade_tools.exteriors.attributes import attribute_vector, building_attributes
from facade_tools.exteriors.mass_energy import mass_energy, target_of
from facade_tools.exteriors.mass_layout import new_layout, new_work
from facade_tools.exteriors.massgen import generate_mass
from facade_tools.geometry.boxes import area_perimeter, shared_outline, union_area_perimeter
from facade_tools.geometry.floors import floor_rectangles
from facade_tools.randomness import item_generator

ROOT = Path(__file__).resolve().parent.parent
UNSEEN_SEED = 20261122
PAPER_SECONDS = 12 * 60


def unseen_houses(per_style: int) -> list[Building]:
    with tempfile.TemporaryDirectory() as folder:
        script = str(ROOT / "sample_data" / "make_samples.py")
        options = ["--out", folder, "--per-style", str(per_style), "--seed", str(UNSEEN_SEED)]
        subprocess.run([sys.executable, script, *options], check=True, capture_output=True)
        return list(read([folder], "building"))


def targets_of(houses: list[Building]) -> list[Attributes]:
    rows = []
    for house in houses:
        try:
            rows.append(building_attributes(house))
        except InvalidInput as error:
            print(f"  left out {house.id}: {error}")
    return rows


def generated(targets: list[Attributes]) -> tuple[list[Building], float]:
    """Return one building a target and the processor seconds of one."""
    next(iter(generate_mass(targets[0], rng=np.random.default_rng(0))))
    start = time.process_time()
    made = [next(iter(generate_mass(t, rng=item_generator(0, "massgen", t.id)))) for t in targets]
    return made, (time.process_time() - start) / len(targets)


def differences(targets: list[Attributes], made: list[Building]) -> np.ndarray:
    found = np.array([attribute_vector(building_attributes(b)) for b in made])[:, :27]
    return np.abs(found - np.array([attribute_vector(t) for t in targets])[:, :27])


def print_exactness(title: str, targets: list[Attributes], goal: str = "99%") -> list[Building]:
    made, seconds = generated(targets)
    energies = np.array([b.energy.mass for b in made])
    d = differences(targets, made)
    sizes = np.all(np.nan_to_num(d[:, [0, 1, 2, 11, 12, 13]]) <= 0.02, axis=1)
    places = np.all(np.nan_to_num(d[:, [9, 10, 15, 16, 21, 22]]) <= 0.02, axis=1)
    exposed = np.all(np.nan_to_num(d[:, [14, 20, 26]]) <= 0.02, axis=1)
    fine = (energies < 1e-5) & sizes & places & exposed
    print(f"\n{title}: {len(targets)} targets")
    print(f"  E < 1e-3                            {np.mean(energies < 1e-3):7.1%}   (goal {goal})")
    print("  E < 1e-5 and sizes within 2 cm, places and exposure within 0.02")
    print(f"                                      {np.mean(fine):7.1%}   (goal 90%)")
    print(f"  median E, greatest E                {np.median(energies):.2g}, {energies.max():.2g}")
    speed = f"paper ÷ ours {PAPER_SECONDS / seconds:,.0f}"
    print(f"  buildings/s a core                  {1 / seconds:7.1f}   (goal 10; {speed})")
    for building in made:
        if building.energy.mass >= 1e-3:
            print(
                f"    {building.id}: {building.energy.mass:.2g} {dict(building.energy.residuals)}"
            )
    return made


def print_plain(targets: list[Attributes]) -> None:
    """Run the paper's annealing from nothing, untuned: what informed starts are worth."""
    work, trace = new_work(), np.zeros(10)
    least, start = [], time.process_time()
    for t in targets:
        rng, target = item_generator(1, t.id), target_of(t)
        energy = np.inf
        for _ in range(RESTARTS):
            energy = min(energy, anneal(new_layout(), target, PLAIN, rng, work, trace))
            if energy < THRESHOLD:
                break
        least.append(energy)
    seconds = (time.process_time() - start) / len(targets)
    share = np.mean(np.array(least) < THRESHOLD)
    print(f"  plain annealing alone: E < 1e-3     {share:7.1%}   {1 / seconds:.1f} buildings/s")
    print(f"  plain annealing alone: E < 1e-5     {np.mean(np.array(least) < 1e-5):7.1%}")


def is_sound(building: Building) -> list[str]:
    """Return the rules that a generated building breaks."""
    broken = []
    energy, shares = mass_energy(building.boxes, target_of(building.targets))
    again = decode(encode(building), "building")
    if abs(mass_energy(again.boxes, target_of(again.targets))[0] - energy) > 1e-9:
        broken.append("energy differs when recomputed")
    if shares["topology"]:
        broken.append("not connected")
    if min(min(b.width, b.depth) for b in building.boxes) < 0.5 - 1e-9:
        broken.append("thinner than 0.5 m")
    ground = floor_rectangles(building, 0)
    for box in building.boxes:
        if box.kind == "garage":
            half = box.width / 2, box.depth / 2
            edges = (box.x - half[0], box.y - half[1], box.x + half[0], box.y + half[1])
            if shared_outline(np.round(edges, 6), ground) < 0.5:
                broken.append("garage inside")
    return broken + solid_faults(building)


def solid_faults(building: Building) -> list[str]:
    from facade_tools.geometry.solids import building_solid, triangulated

    solid = building_solid(building)
    vertices, faces = triangulated(solid)[:2]
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    corners = vertices[faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    eaves = min(b.height for b in building.boxes if b.kind != "porch")
    faults = ["not watertight"] if (counts % 2).any() else []
    faults += ["no positive volume"] if volume <= 0 else []
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    roof = normals[:, 2] > 1e-9 * np.linalg.norm(normals, axis=1)
    if roof.any() and corners[roof][:, :, 2].min() < eaves - 1e-6:
        faults.append("roof below the eaves")
    return faults


def print_soundness(made: list[Building]) -> None:
    broken = {b.id: faults for b in made if (faults := is_sound(b))}
    share = 1 - len(broken) / len(made)
    print(f"\nsound (connected, thick, closed, garage outside): {share:.1%} of {len(made)}")
    for name, faults in broken.items():
        print(f"  {name}: {', '.join(faults)}")


def footprint_iou(a: Building, b: Building) -> float:
    """Intersection over union of floor 0, bounding boxes at the same corner."""
    first, second = (
        r - np.tile(r[:, :2].min(axis=0), 2) for r in (floor_rectangles(x, 0) for x in (a, b))
    )
    union = union_area_perimeter(np.vstack([first, second]))[0]
    both = area_perimeter(first)[0] + area_perimeter(second)[0] - union
    return both / union


def print_round_trip(houses: list[Building], count: int) -> None:
    """FW16 Fig. 8: building → attributes → buildings; the best of five."""
    rng = np.random.default_rng(5)
    chosen = [houses[k] for k in rng.permutation(len(houses))[:count]]
    first, best = [], []
    for house in chosen:
        target = building_attributes(house)
        made = generate_mass(target, rng=item_generator(2, house.id), candidates=5)
        scores = [footprint_iou(house, b) for b in made]
        first.append(scores[0])
        best.append(max(scores))
    print(f"\nround trip over {len(chosen)} held-out buildings: footprint IoU")
    print(f"  first {np.mean(first):.3f}   best of 5 {np.mean(best):.3f}   worst {min(best):.3f}")


def sampled_targets(model: str, count: int) -> list[Attributes]:
    facade = str(Path(sys.executable).with_name("facade"))
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/sampled.jsonl"
        subprocess.run([facade, "sample", model, "-n", str(count), "-o", path], check=True)
        return list(read([path], "attributes"))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("buildings", nargs="*")
    parser.add_argument("--model")
    parser.add_argument("--samples", type=int, default=200)
    parser.add_argument("--per-style", type=int, default=8)
    parser.add_argument("--round-trip", type=int, default=50)
    options = parser.parse_args()
    houses = unseen_houses(options.per_style)
    targets = targets_of(houses)
    made = print_exactness("unseen sample houses", targets)
    print_plain(targets)
    if options.buildings:
        real = list(read(options.buildings, "building"))
        made += print_exactness("given buildings", targets_of(real))
    if options.model:
        made += print_exactness(
            "model samples", sampled_targets(options.model, options.samples), "80%"
        )
    print_soundness(made)
    print_round_trip(houses, options.round_trip)


if __name__ == "__main__":
    main()
