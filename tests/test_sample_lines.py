"""Samples as lines: the bytes of the slow writer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drawn import house_model

from facade_tools.artifacts.documents import encode
from facade_tools.artifacts.numbers import dump_line
from facade_tools.artifacts.provenance import Provenance
from facade_tools.exteriors.row_bytes import Row, joined, text_column
from facade_tools.exteriors.sample_lines import sample_lines
from facade_tools.exteriors.samples import SampleOptions, sample_attributes


@pytest.mark.parametrize("options", [{}, {"neighbours": False, "style": 1}, {"top": True}])
def test_columns_write_the_same_bytes_as_artifacts(options):
    model = house_model()
    provenance = Provenance("sample", 3, {"odd": 'per cent % "quoted" \x00'}, ())
    chosen = SampleOptions(**options, prefix="%", first=7)
    wanted = [
        dump_line(encode(replace(row, provenance=provenance)))
        for row in sample_attributes(model, 40, rng=np.random.default_rng(2), options=chosen)
    ]
    found = sample_lines(
        model, 40, rng=np.random.default_rng(2), given=None, options=chosen, provenance=provenance
    )
    found = [apart for lines in found for apart in lines.apart()]
    assert [line for _, line in found] == wanted
    assert [identity for identity, _ in found] == [f"%-{i}" for i in range(7, 47)]


def test_rows_with_numbers_of_any_size_are_the_same_bytes():
    """Of numbers, texts and pieces, also numbers that the compiled loop leaves to Python."""
    rng = np.random.default_rng(0)
    numbers = 10.0 ** rng.uniform(-30, 30, (50, 3))
    numbers[:5] = [[0.0, -0.0, 1e-12], [1e12, 1e16, 1e22], [1.0, 0.5, 3e-320], [2, 3, 4], [5, 6, 7]]
    words = ("é", "", '"q"')
    index = rng.integers(0, 3, 50)
    row = Row(
        (b"[", b",", b",", b",", b"]\n"), (*numbers.T[:2], text_column(words, index), numbers.T[2])
    )
    found = joined(row, 50).decode().splitlines()
    for line, three, word in zip(found, numbers.tolist(), index, strict=True):
        texts = [dump_line(x).decode()[:-1] for x in three]
        assert line == f"[{texts[0]},{texts[1]},{words[word]},{texts[2]}]"
    with pytest.raises(ValueError, match="cannot be written"):
        joined(Row((b"", b""), (np.array([np.nan]),)), 1)
    assert joined(Row((b"", b""), (np.empty(0),)), 0) == b""
