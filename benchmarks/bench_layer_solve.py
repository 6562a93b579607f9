"""How long `layer-solve` takes, and how far it agrees with the brute force of the tests.

Usage: python benchmarks/bench_layer_solve.py [--hard] [--oracle N] [--language N] [--first SEED];
without any, the sample designs. Seconds are of CPU time.
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from layering_checks import compared  # noqa: E402
from layering_designs import random_direction, words_of  # noqa: E402
from layering_documents import drawn  # noqa: E402
from layering_oracle import TooLarge, best, best_of  # noqa: E402

from facade_tools.artifacts.store import read_one  # noqa: E402
from facade_tools.layering.alignment import prepare  # noqa: E402
from facade_tools.layering.language import parse  # noqa: E402
from facade_tools.layering.problem import Direction, LayerPattern, Rule  # noqa: E402
from facade_tools.layering.search import Answer, Clock, GroupSearch  # noqa: E402
from facade_tools.layering.solve import solve_design  # noqa: E402

PAPER_26_LAYERS = 1.0  # seconds, IMAW15
PATIENCE = 10  # times more than the brute force has in the tests
HASTE = 0.2  # the same, of designs of the whole language


def samples() -> None:
    print(f"{'design':24} {'ms':>8} {'limit':>6}  optimal")
    for path in sorted((ROOT / "sample_data" / "designs").glob("*.yaml")):
        design = read_one(str(path), "design")
        solve_design(design)
        times = []
        for _ in range(5):
            start = time.process_time()
            layout = solve_design(design)
            times.append(time.process_time() - start)
        median = sorted(times)[2]
        proved = all(g.optimal for g in [*layout.x.values(), *layout.y.values()])
        limit = 100 if path.stem == "concert-hall" else 250
        print(f"{path.stem:24} {1000 * median:8.1f} {limit:6}  {proved}", end="")
        ratio = f"  {PAPER_26_LAYERS / median:.0f}x the paper's speed"
        print(ratio if path.stem == "concert-hall" else "")


def hard(seconds: float, first: int) -> None:
    """Answer under-constrained designs: free counters, alternations, very different sizes."""
    proved = answered = 0
    for seed in range(first, first + 30):
        problem = underconstrained(random.Random(seed))
        start = time.process_time()
        clock = Clock(start + seconds, now=time.process_time)  # of CPU: other work counts nothing
        answer = GroupSearch(problem, ("default",), clock).answer()
        spent = time.process_time() - start
        no_layout = answer is None and not clock.late
        answered += answer is not None or no_layout
        proved += no_layout or (answer is not None and answer.optimal)
        what = f"none, {'proved' if no_layout else 'in the time given'}"
        if answer is not None:
            what = f"{answer.alignment.omega:.3f} {answer.optimal}"
        print(f"under-constrained {seed:2}: {spent:6.2f} s  error {what}", flush=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"answered {answered} of 30, proved optimal {proved}; at most {memory:.0f} MB")


def underconstrained(rng: random.Random) -> Direction:
    """Return a problem of 3 or 4 layers with 2 or 3 free counters and sizes from 0.3 to 8 m."""
    rules = {n: Rule(round(rng.choice([0.3, 0.7, 1.1, 1.9, 3.1, 5.3, 8.0]), 2)) for n in "ABCDE"}
    rules["t"] = Rule(round(rng.uniform(0.5, 6), 1), transparent=True)
    rules["u"] = Rule(None, transparent=True)
    shapes = ["A(BA)^k", "(AB)^kC(AB)^m", "D(C|E)^m", "t(Dt)^n", "uC^nu", "(A|BC)^k", "(tB)^mt"]
    rows = rng.sample(shapes, rng.randint(2, 3))
    layers = [LayerPattern(f"L{i}", text, parse(text)) for i, text in enumerate([*rows, "A^kB^m"])]
    counters = dict.fromkeys("kmn", (0, 60))
    return Direction(
        "x", rng.choice([12.0, 20.0, 30.0]), rules, {"default": tuple(layers)}, counters
    )


def oracle(count: int, first: int, seconds: float) -> None:
    """Compare µ, Ω, pieces and columns of random small designs with the brute force.

    Words have up to 7 letters, on up to 3 layers, with all qualifiers. Every answer is checked
    against the constraints, too; odd seeds go through lattices, even ones word by word.
    """
    verdicts = Counter[str]()
    for seed in range(first, first + count):
        problem = random_direction(random.Random(seed), letters=7, layers=3, unsized=0.1)
        try:
            expected = brute_force(problem)
        except TooLarge:
            verdicts["too large for the brute force"] += 1
            print(f"seed {seed}: too large for the brute force", flush=True)
            continue
        clock = Clock(time.process_time() + seconds, now=time.process_time)
        search = GroupSearch(problem, ("default",), clock, few=0 if seed % 2 else 6)
        found = search.answer()
        verdict = compared(problem, expected, found, search.exhausted)
        verdicts[verdict] += 1
        if (seed + 1) % 25 == 0:
            print(f"… {seed}: {dict(verdicts)}", flush=True)
        if verdict != "equal":
            print(f"seed {seed}: {verdict}: brute force {expected}", flush=True)
    print(f"{count} designs:", ", ".join(f"{n} {what}" for what, n in verdicts.items()))


def language(count: int, first: int, seconds: float) -> None:
    """Compare random designs of the whole language with the brute force, names included.

    One direction of each: substituted patterns, reflections, counters, unsized symbols, splits,
    groups, and words that the brute force reads off the texts itself.
    """
    verdicts, seen = Counter[str](), Counter[str]()
    for seed in range(first, first + count):
        design = drawn(seed)
        for groups, tuples, layers in design.searches():
            try:
                expected = best_of(design.problem, tuples, HASTE, layers)
            except TooLarge:
                verdicts["too large for the brute force"] += 1
                continue
            clock = Clock(time.process_time() + seconds, now=time.process_time)
            search = GroupSearch(design.problem, groups, clock, few=0 if seed % 2 else 6)
            found = search.answer()
            verdict = compared(design.problem, expected, found, search.exhausted)
            verdicts[verdict] += 1
            seen.update(features(groups, found))
            if verdict != "equal":
                print(f"seed {seed}, {groups}: {verdict}: brute force {expected}", flush=True)
        if (seed + 1) % 100 == 0:
            print(f"… {seed}: {dict(verdicts)}", flush=True)
    for what, counts in ((f"{count} designs", verdicts), ("of the answers", seen)):
        print(f"{what}:", ", ".join(f"{n} {name}" for name, n in counts.items()))


def features(groups: tuple[str, ...], found: Answer | None) -> Iterator[str]:
    """Yield what is hard about an answer."""
    if found is None:
        yield "without a layout"
        return
    one = found.alignment
    if one.candidate.unsized:
        yield "with unsized symbols"
    if one.pieces:
        yield "with splits"
    if len(groups) > 1:
        yield "of groups together"


def brute_force(problem: Direction) -> tuple[Any, ...] | None:
    """Return the brute force's answer, however long it takes within reason."""
    words = [words_of(problem, row) for row in problem.groups["default"]]
    try:
        return best(problem, words)
    except TooLarge:
        return best(problem, words, PATIENCE)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--oracle", type=int, default=0, help="random designs to compare")
    parser.add_argument("--language", type=int, default=0, help="the same, of the whole language")
    parser.add_argument("--first", type=int, default=0, help="seed of the first design")
    parser.add_argument("--hard", action="store_true", help="30 under-constrained designs")
    parser.add_argument("--seconds", type=float, default=10.0, help="time limit of each of them")
    options = parser.parse_args()
    prepare()
    if not (options.oracle or options.language or options.hard):
        samples()
    if options.hard:
        hard(options.seconds, options.first)
    if options.oracle:
        oracle(options.oracle, options.first, options.seconds)
    if options.language:
        language(options.language, options.first, options.seconds)
