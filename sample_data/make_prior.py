"""Make the shipped prior from the sample houses: `python sample_data/make_prior.py`.

`facade learn` takes attributes that no training building observes from it. The same houses give
the same bytes.
"""

from __future__ import annotations

from pathlib import Path

from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read
from facade_tools.artifacts.writing import write_bytes
from facade_tools.exteriors.attributes import NAMES, attribute_vector, building_attributes

HERE = Path(__file__).resolve().parent
TARGET = HERE.parent / "facade_tools" / "exteriors" / "prior.json"


def main() -> None:
    """Write ids, storey heights and the 49 numbers of every sample house."""
    rows = [building_attributes(house) for house in read([str(HERE / "houses")], "building")]
    document = {
        "about": "attributes of the synthetic houses in sample_data, made by make_prior.py",
        "names": list(NAMES),
        "ids": [row.id for row in rows],
        "storey_heights": [row.storey_height for row in rows],
        "rows": [[float(f"{x:.6g}") for x in attribute_vector(row).tolist()] for row in rows],
    }
    write_bytes(TARGET, dump_line(document))


if __name__ == "__main__":
    main()
