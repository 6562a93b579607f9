"""Make the element library that ships with the package: `python sample_data/make_library.py`.

With arguments, `make_library.py OUT.json BUILDINGS...`, it makes a library of other buildings.
"""

from __future__ import annotations

import sys
from pathlib import Path

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.store import read
from facade_tools.artifacts.writing import write_bytes
from facade_tools.exteriors.library import build_library

HERE = Path(__file__).resolve().parent
SHIPPED = HERE.parent / "facade_tools" / "exteriors" / "library.json"


def main() -> None:
    """Write the library of the given buildings, or the shipped one of the sample houses."""
    out, *inputs = sys.argv[1:] or [str(SHIPPED), str(HERE / "houses")]
    library = build_library(read(inputs, "building"), Path(out).stem)
    write_bytes(Path(out), dump_line(encode(library)))


if __name__ == "__main__":
    main()
