"""Rates of sampling, physical possibility, the clash test of FW16 Figs. 13, 14 and Fig. 11.

python benchmarks/bench_sample.py [--variants full,gmm] [--fifths]

--fifths: the clash test alone, over the five ways to hold out every fifth house.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from unittest.mock import patch

import numpy as np

from facade_tools.artifacts.attributes import Attributes, MassAttributes
from facade_tools.exteriors import physical
from facade_tools.exteriors.density import log_density
from facade_tools.exteriors.learning import LearnOptions, learn_model
from facade_tools.exteriors.prior import shipped_prior
from facade_tools.exteriors.sample_lines import sample_lines
from facade_tools.exteriors.samples import SampleOptions, sample_attributes
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
    attached = all(
        not porch[2]
        or max(
            abs(porch[i] - 0.5) * size - (porch[2 + i] + size) / 2 for i, size in ((0, w), (1, d))
        )
        <= 1e-6
        for porch in m.porch
    )
    floors = abs(m.far * m.arf[0] - m.bcr) < 1e-9 and m.arf[0] >= m.arf[1] >= m.arf[2]
    edge = m.bdry * np.sqrt(m.bcr * w * d) >= 2 * (w + d) * (1 - 1e-9)
    glass = all(0 <= x < 1 for x in a.facade.wwr)
    return bool(inside and attached and floors and edge and glass and any(a.element.roof.values()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--variants", default="full,no-lateral,no-middle,flat,gmm")
    parser.add_argument("--fifths", action="store_true")
    options = parser.parse_args()
    houses = shipped_prior()
    if options.fifths:
        print_fifths(houses, options.variants.split(","))
        return
    held = houses[::5]
    train = [h for i, h in enumerate(houses) if i % 5]
    models = {
        v: learn_model(train, rng=np.random.default_rng(0), options=LearnOptions(variant=v))
        for v in options.variants.split(",")
    }
    rates(models["full"], held[3])
    for name, model in models.items():
        drawn = list(sample_attributes(model, 4000, rng=np.random.default_rng(0)))
        possibly = np.mean([possible(a) for a in drawn])
        with patch.object(physical, "_out_of_garage"):
            raw = clashes(model, held, 40)
        print(
            f"{name:<11} physically possible {possibly:.2%}; front porch meets garage "
            f"{clashes(model, held, 40):.2%}, before porches step out of garages {raw:.2%}",
            flush=True,
        )
    print(f"the held-out houses themselves: {np.mean([clash(a) for a in held]):.2%}")
    rng = np.random.default_rng(0)
    best = sample_attributes(models["full"], 1000, rng=rng, options=SampleOptions(top=True))
    neighbours = [a.sample.neighbours for a in best]
    mean = np.mean([len(set(names.values())) for names in neighbours])
    print(f"training buildings behind each of the 1,000 most probable: {mean:.1f} (paper: 6)")


def print_fifths(houses: list[Attributes], variants: list[str]) -> None:
    """Print the clashes as drawn for each fifth of the houses held out, and their mean."""
    for variant in variants:
        found = []
        for k in range(5):
            train = [house for i, house in enumerate(houses) if i % 5 != k]
            options = LearnOptions(variant=variant)
            model = learn_model(train, rng=np.random.default_rng(0), options=options)
            with patch.object(physical, "_out_of_garage"):
                found.append(clashes(model, houses[k::5], 40))
        shares = ", ".join(f"{share:.2%}" for share in found)
        print(f"{variant:<11} {np.mean(found):.2%} ({shares})", flush=True)


def rates(model, house: Attributes) -> None:
    """Print how many samples a second one process makes, the best of five runs of each kind."""
    network, rng = network_of(model), np.random.default_rng(0)
    block = draw_block(network, rng=rng).readings
    given = Attributes("g", mass=replace(MassAttributes(), bbox=house.mass.bbox))

    def lines(count: int, options: SampleOptions, known: Attributes | None = None) -> None:
        made = sample_lines(model, count, rng=rng, given=known, options=options, provenance=None)
        for _ in made:
            pass

    kinds = {
        "unconditional draws (arrays)": (BLOCK, lambda: draw_block(network, rng=rng)),
        "their log density": (BLOCK, lambda: log_density(network, block)),
        "lines of JSON": (4 * BLOCK, lambda: lines(4 * BLOCK, SampleOptions())),
        "lines without neighbours": (4 * BLOCK, lambda: lines(4 * BLOCK, QUICK)),
        "as objects": (2000, lambda: list(sample_attributes(model, 2000, rng=rng))),
        "given the bounding box": (2000, lambda: lines(2000, QUICK, given)),
    }
    for name, (count, run) in kinds.items():
        run()
        seconds = min(timed(run) for _ in range(5))
        print(f"{name}: {count / seconds:,.0f}/s of CPU", flush=True)


def timed(run: Callable[[], object]) -> float:
    start = time.process_time()
    run()
    return time.process_time() - start


if __name__ == "__main__":
    main()
