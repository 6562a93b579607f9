"""Rates of sampling, physical possibility, the clash test of FW16 Figs. 13, 14 and Fig. 11.

python benchmarks/bench_sample.py
"""

from __future__ import annotations

import time
from dataclasses import replace
from unittest.mock import patch

import numpy as np

from facade_tools.artifacts.attributes import Attributes, MassAttributes
from facade_tools.exteriors import physical
from facade_tools.exteriors.density import log_density
from facade_tools.exteriors.drawing import SampleOptions, sample_attributes
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.sample_lines import sample_lines
from facade_tools.exteriors.sampling import BLOCK, draw_block
from facade_tools.exteriors.serialisation import network_of


def clash(a: Attributes) -> bool:
    """Tell whether the front porch's plan meets the garage's by more than 5 cm both ways."""
    (w, d, _), garage, porch = a.mass.bbox, a.mass.garage, a.mass.porch[0]
    if not garage[2] or not porch[2]:
        return False
    meets = [
        abs(garage[i] - porch[i]) * size < (garage[2 + i] + porch[2 + i]) / 2 - 0.05
        for i, size in ((0, w), (1, d))
    ]
    return all(meets)


def clashes(model, houses: list[Attributes], each: int) -> float:
    """Return the share of clashing samples given bbox and garage, among those with a porch."""
    hit = total = 0
    for i, house in enumerate(h for h in houses if h.mass.garage[2]):
        mass = replace(MassAttributes(), bbox=house.mass.bbox, garage=house.mass.garage)
        rng = np.random.default_rng(i)
        given = Attributes(house.id, mass=mass)
        for sample in sample_attributes(model, each, rng=rng, given=given, options=QUICK):
            hit += clash(sample)
            total += 1
    return hit / max(total, 1)


QUICK = SampleOptions(neighbours=False)


def possible(a: Attributes) -> bool:
    (w, d, h), m = a.mass.bbox, a.mass
    px, py, gw, gd, gh, _ = m.garage
    inside = not gw or (
        gw / w / 2 - 1e-9 <= px <= 1 - gw / w / 2 + 1e-9
        and gd / d / 2 - 1e-9 <= py <= 1 - gd / d / 2 + 1e-9
        and gh <= h * (1 + 1e-9)
    )
    floors = abs(m.far * m.arf[0] - m.bcr) < 1e-9 and m.arf[0] >= m.arf[1] >= m.arf[2]
    edge = m.bdry * np.sqrt(m.bcr * w * d) >= 2 * (w + d) * (1 - 1e-9)
    glass = all(0 <= x < 1 for x in a.facade.wwr)
    return bool(inside and floors and edge and glass and any(a.element.roof.values()))


def main() -> None:
    houses = shipped_prior()
    held = houses[::5]
    train = [h for i, h in enumerate(houses) if i % 5]
    models = {
        v: learn_model(train, rng=np.random.default_rng(0), options=LearnOptions(variant=v))
        for v in ("full", "gmm")
    }
    network, rng = network_of(models["full"]), np.random.default_rng(0)
    draw_block(network, rng=rng)
    start = time.process_time()
    for _ in range(20):
        draw_block(network, rng=rng)
    print(f"unconditional draws (arrays): {20 * BLOCK / (time.process_time() - start):,.0f}/s")
    start = time.process_time()
    block = draw_block(network, rng=rng).readings
    log_density(network, block)
    print(f"with log density: {BLOCK / (time.process_time() - start):,.0f}/s")
    for name, options in (("lines of JSON", SampleOptions()), ("lines without neighbours", QUICK)):
        start = time.process_time()
        for _ in sample_lines(
            models["full"], 8192, rng=rng, given=None, options=options, provenance=None
        ):
            pass
        print(f"{name}: {8192 / (time.process_time() - start):,.0f}/s")
    start = time.process_time()
    drawn = list(sample_attributes(models["full"], 4000, rng=rng))
    print(f"as objects: {4000 / (time.process_time() - start):,.0f}/s")
    print(f"physically possible: {np.mean([possible(a) for a in drawn]):.2%}")
    mass = replace(MassAttributes(), bbox=held[3].mass.bbox)
    start = time.process_time()
    given = Attributes("g", mass=mass)
    list(sample_lines(models["full"], 4000, rng=rng, given=given, options=QUICK, provenance=None))
    print(f"given the bounding box: {4000 / (time.process_time() - start):,.0f}/s")
    for name, model in models.items():
        print(f"front porch meets garage, {name}: {clashes(model, held, 40):.2%}")
        with patch.object(physical, "_out_of_garage"):
            print(f"    before porches step out of garages: {clashes(model, held, 40):.2%}")
    print(f"the held-out houses themselves: {np.mean([clash(a) for a in held]):.2%}")
    top = SampleOptions(top=True)
    best = sample_attributes(models["full"], 1000, rng=rng, options=top)
    sources = [len(set(a.sample.neighbours.values())) for a in best]
    mean = np.mean(sources)
    print(f"training buildings behind each of the 1,000 most probable: {mean:.1f} (paper: 6)")


if __name__ == "__main__":
    main()
