"""Data flows one way: a package imports only from those above it in this list, and in no circle."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LAYERS = {
    "errors": 0, "randomness": 0, "compiled": 0, "parallel": 0, "workers": 0,
    "__init__": 0, "schemas": 0,
    "artifacts": 1,
    "geometry": 2,
    "imaging": 3,
    "formats": 4, "grammar": 4,
    "exteriors": 5, "layering": 5, "stylization": 5, "segmentation": 5, "reconstruction": 5,
    "cli": 6,
}  # fmt: skip
SIBLINGS_ALLOWED = 0  # errors, workers and the like may use one another
RANDOM_ALLOWED = {"np.random.Generator", "np.random.PCG64", "np.random.default_rng"}


def modules():
    for folder, package in (
        (ROOT / "facade_tools", "facade_tools"),
        (ROOT / "cli", "facade_tools.cli"),
    ):
        for path in sorted(folder.rglob("*.py")):
            name = ".".join([package, *path.relative_to(folder).with_suffix("").parts])
            yield pytest.param(path, name, id=name)


def imported(path: Path, name: str):
    parts = name.split(".")
    package = parts[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            target = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{target}.{alias.name}" for alias in node.names)
            if target != "facade_tools":
                yield target


def part(name: str) -> str:
    parts = name.split(".")
    return parts[1] if len(parts) > 1 else "__init__"


@pytest.mark.parametrize(("path", "name"), list(modules()))
def test_imports_go_one_way(path, name):
    own = part(name)
    for target in imported(path, name):
        if not target.startswith("facade_tools"):
            continue
        other = part(target)
        other = other if other in LAYERS else "__init__"
        if other == own:
            continue
        assert LAYERS[other] <= LAYERS[own], f"{name} imports {target}"
        same = LAYERS[other] == LAYERS[own] and LAYERS[own] > SIBLINGS_ALLOWED
        assert not same, f"{name} imports its sibling {target}"


def test_modules_import_one_another_in_no_circle():
    """Imports inside functions and for annotations alone count too: they tie as tightly."""
    rows = [module.values for module in modules()]
    known = {name for _, name in rows}
    waiting = {name: set(imported(path, name)) & known - {name} for path, name in rows}
    while ready := {name for name, needs in waiting.items() if not needs}:
        waiting = {name: needs - ready for name, needs in waiting.items() if name not in ready}
    assert not waiting, f"in a circle, or above one: {sorted(waiting)}"


def test_the_command_line_alone_reaches_a_method_by_name():
    """A module named in a string is an import that the other tests of this file do not see."""
    for path, name in (module.values for module in modules()):
        if part(name) != "cli":
            named = re.findall(r"[\"']facade_tools\.([\w.]+):\w+[\"']", path.read_text())
            assert not named, f"{name} names {named}"


@pytest.mark.parametrize(("path", "name"), [m for m in modules() if ".cli" not in m.id])
def test_the_library_neither_prints_nor_exits_nor_unpickles(path, name):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            assert called not in {
                "print",
                "sys.exit",
                "exit",
                "pickle.load",
                "pickle.loads",
                "eval",
                "exec",
            }
            assert not called.startswith("np.random.") or called in {
                "np.random.Generator",
                "np.random.PCG64",
            }
        if isinstance(node, ast.ExceptHandler):
            bare = node.type is None or ast.unparse(node.type) in {"BaseException"}
            assert not bare, f"{name}:{node.lineno}"
