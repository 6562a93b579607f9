"""The page that shows every stage from Python: its blocks run, and it forgets no stage."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest

from facade_tools.artifacts.building import Building
from facade_tools.artifacts.documents import decode, encode, parse_json
from facade_tools.artifacts.numbers import dump_line
from facade_tools.cli._group import STAGES
from facade_tools.geometry.mesh import Scene
from facade_tools.randomness import item_generator

ROOT = Path(__file__).resolve().parent.parent
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """What the page's blocks leave behind, run in order in a copy of the root with sample data."""
    folder = tmp_path_factory.mktemp("root")
    (folder / "sample_data").symlink_to(ROOT / "sample_data")
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for block in re.finditer(r"```python\n(.*?)```", PAGE, re.S):
            line = PAGE[: block.start(1)].count("\n")
            exec(compile("\n" * line + block[1], "docs/python.md", "exec"), found)
    found["written"] = {path.name for path in (folder / "build" / "python").iterdir()}
    return found


def test_blocks_make_what_they_say(names):
    assert all(isinstance(names[made], Building) for made in ("house", "building", "seen", "again"))
    assert {box.id for box in names["partial"].boxes} <= {box.id for box in names["around"].boxes}
    assert names["nats"].shape == (3,)
    assert names["windows"]
    assert all(isinstance(names[made], Scene) for made in ("scene", "styled"))
    assert names["block"].boxes
    assert names["seen"].partial
    assert names["written"] == {
        "front.svg", "house.glb", "house.png", "houses.jsonl", "mine.npz", "partial.json",
        "street.city.json",
    }  # fmt: skip


def test_every_stage_has_a_function_that_the_blocks_call():
    rows = re.findall(r"^\| (`[^|]+) \| ([^|]+) \|$", PAGE, re.M)
    stages = {name for row, _ in rows for name in re.findall(r"`([a-z-]+)`", row)}
    assert stages == set(STAGES)
    for _, functions in rows:
        module = ""
        for name in re.findall(r"`([\w.]+)`", functions):
            path, _, function = name.rpartition(".")
            module = path or module
            assert callable(getattr(import_module(f"facade_tools.{module}"), function)), name
    called = "".join(re.findall(r"```python\n(.*?)```", PAGE, re.S))
    first = [re.findall(r"`([\w.]+)`", functions)[0] for _, functions in rows]
    missing = [name for name in first if f"{name.rpartition('.')[2]}(" not in called]
    assert not missing


def test_with_the_generator_of_the_command_line_the_result_is_its_result(names, facade_here):
    row = names["building_attributes"](names["houses"][0])
    line = dump_line(encode(row))
    done = facade_here("massgen", "-", "--seed", 3, stdin=line)
    made = decode(parse_json(done.stdout), "building")
    again = decode(parse_json(line), "attributes")
    rng = item_generator(3, "massgen", row.id)
    (own,) = names["generate_mass"](again, rng=rng)
    written = decode(parse_json(dump_line(encode(own))), "building")
    assert written == replace(made, provenance=None)
