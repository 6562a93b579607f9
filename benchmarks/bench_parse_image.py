"""Time and energy of the stages of parse-image on rendered facades of 700×400 pixels.

python benchmarks/bench_parse_image.py [COUNT]
"""

from __future__ import annotations

import sys
import time

import numpy as np
from threadpoolctl import threadpool_limits

from facade_tools.grammar.library import builtin
from facade_tools.grammar.plan import plan
from facade_tools.randomness import item_generator
from facade_tools.segmentation import dp, walk
from facade_tools.segmentation.classifier import default
from facade_tools.segmentation.energy import field_of
from facade_tools.segmentation.painting import render_facade


def timed(function):
    start = time.process_time()
    value = function()
    return value, time.process_time() - start


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    threadpool_limits(1)  # as the command line does
    classifier = default()
    plans = {name: plan(builtin(name)) for name in ("haussmann", "haussmann-floors")}
    rows = []
    for number in range(count + 1):  # the first compiles
        rng = item_generator(1, "bench", number)
        _, picture, _ = render_facade(builtin("haussmann-floors"), 400, 700, rng=rng)
        working = classifier.working(picture)
        belief, seconds = timed(lambda w=working: classifier.probabilities(w))
        row = {"classifier": seconds}
        for name, made in plans.items():
            field = field_of(belief, classifier.classes, made)
            exact, row[f"dp {name}"] = timed(lambda f=field, m=made: dp.solve(f, m))
            walked, row[f"walk {name}"] = timed(
                lambda f=field, m=made, r=rng: walk.solve(f, m, rng=r)
            )
            row[f"energy {name}"] = exact.energy / walked.energy
        rows.append(row)
    for name in rows[0]:
        values = np.array([row[name] for row in rows[1:]])
        kind = "dp / walk" if name.startswith("energy") else "s of CPU"
        print(f"{name:28} median {np.median(values):.3f}  worst {values.max():.3f}  {kind}")
    for name in plans:
        ratio = np.median([row[f"walk {name}"] / row[f"dp {name}"] for row in rows[1:]])
        print(f"dp is {ratio:.1f} times as fast as the walk ({name})")


if __name__ == "__main__":
    main()
