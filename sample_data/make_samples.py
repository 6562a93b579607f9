"""Make the synthetic sample houses: `python sample_data/make_samples.py`.

Hand-written rules with correlated choices, no learned model. The same seed gives the same bytes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from samples_draw import Draw  # noqa: E402  (beside this file, which is not a package)
from samples_facades import dressed  # noqa: E402
from samples_masses import STYLES  # noqa: E402

from facade_tools.artifacts.building import Building  # noqa: E402
from facade_tools.artifacts.documents import encode  # noqa: E402
from facade_tools.artifacts.numbers import dump_line  # noqa: E402
from facade_tools.artifacts.writing import write_bytes  # noqa: E402
from facade_tools.randomness import item_generator  # noqa: E402

PER_STYLE = 24
SEED = 2016


def house(style: str, number: int, seed: int = SEED) -> Building:
    """Return sample house `number` of a style."""
    identity = f"{style}-{number:02d}"
    d = Draw(item_generator(seed, "sample-house", identity))
    mass = STYLES[style](d)
    bare = Building(
        id=identity,
        boxes=mass.boxes,
        storey_height=mass.storey,
        features=mass.features,
        chimneys=mass.chimneys,
        colors=mass.colors,
        tags={"style": style, "synthetic": True},
    )
    return replace(bare, facades=dressed(bare, mass.dress, d))


def houses(per_style: int = PER_STYLE, seed: int = SEED) -> Iterator[Building]:
    """Yield all sample houses, style by style."""
    for style in STYLES:
        for number in range(1, per_style + 1):
            yield house(style, number, seed)


def main() -> None:
    """Write one JSON Lines file a style."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=HERE / "houses")
    parser.add_argument("--per-style", type=int, default=PER_STYLE)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for style in STYLES:
        rows = [house(style, k, options.seed) for k in range(1, options.per_style + 1)]
        data = b"".join(dump_line(encode(row)) for row in rows)
        write_bytes(options.out / f"{style}.jsonl", data)


if __name__ == "__main__":
    main()
