"""The share of houses in which each of the 49 attributes is observed, as a Markdown table.

facade import SOURCE -o attributes.jsonl
python benchmarks/observed_attributes.py attributes.jsonl
"""

from __future__ import annotations

import sys

import numpy as np

from facade_tools.artifacts.store import read
from facade_tools.exteriors.attributes import NAMES, attribute_matrix

COLUMNS = 4


def main() -> None:
    matrix = attribute_matrix(read(sys.argv[1:], "attributes"))
    shares = 1.0 - np.isnan(matrix).mean(axis=0)
    cells = [f"{name} | {share:.3f}" for name, share in zip(NAMES, shares, strict=True)]
    print(f"{len(matrix)} houses, {shares.sum():.2f} of 49 attributes observed a house\n")
    print("| " + " | ".join(["attribute | share"] * COLUMNS) + " |")
    print("| " + " | ".join(["--- | ---:"] * COLUMNS) + " |")
    rows = -(-len(cells) // COLUMNS)
    for row in range(rows):
        picked = cells[row::rows]
        print("| " + " | ".join(picked + ["| "] * (COLUMNS - len(picked))) + " |")


if __name__ == "__main__":
    main()
