"""Documentation that cannot drift."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path

import pytest

from facade_tools.cli._group import STAGES

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = [*sorted(DOCS.rglob("*.md")), ROOT / "README.md", ROOT / "DESIGN.md"]


def test_the_references_are_what_commands_and_schemas_say():
    spec = importlib.util.spec_from_file_location("make_reference", DOCS / "make_reference.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for page, write in module.PAGES.items():
        assert (DOCS / page).read_text(encoding="utf-8") == write(), f"{page} is stale: `make docs`"


@pytest.mark.parametrize("stage", STAGES)
def test_every_stage_has_an_example_and_a_page(stage, facade):
    help_text = facade(stage, "--help").stdout.decode()
    assert f"facade {stage}" in help_text.split("Options:")[0].split("\n", 1)[1]
    mentioned = [page for page in DOCS.glob("*.md") if f"facade {stage}" in page.read_text()]
    assert [page for page in mentioned if page.name != "cli-reference.md"], "no page tells of it"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_exist(page):
    for target in re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8")):
        if "://" not in target and not target.startswith("mailto:"):
            assert (page.parent / target).exists(), target


def test_no_tracked_page_names_a_machine():
    for page in PAGES:
        assert not re.search(r"(^|[^\w.])/(work|root|home)/", page.read_text(encoding="utf-8")), (
            page
        )


def blocks(page: Path) -> list[str]:
    """Return the blocks of a page that hold commands, fenced or indented."""
    text = page.read_text(encoding="utf-8")
    fenced = re.findall(r"```(?:sh|bash|console)\n(.*?)```", text, re.S)
    rest = re.sub(r"```.*?```", "", text, flags=re.S)
    indented = re.findall(r"(?:^ {4}\S.*\n(?:^ {4}.*\n)*)", rest, re.M)
    return fenced + [re.sub(r"^ {4}", "", block, flags=re.M) for block in indented]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_in_the_docs_are_commands(page):
    for block in blocks(page):
        for stage in re.findall(r"(?:^|[|&;]\s*|\$ )facade (?:-\S+ )*([a-z][a-z-]*)", block, re.M):
            assert stage in STAGES, f"{page.name}: facade {stage}"


def _raised(function):
    """Yield the names of the errors that a function raises itself."""
    for node in ast.walk(function):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            yield ast.unparse(node.exc.func)


def test_public_functions_tell_what_they_raise():
    silent = []
    for path in sorted((ROOT / "facade_tools").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                text = (ast.get_docstring(node) or "").lower()
                told = any(word in text for word in ("raise", "refuse"))
                expected = {"InvalidInput", "Infeasible", "OutputFailed", "ValueError"}
                if not told and expected & set(_raised(node)):
                    silent.append(f"{path.name}:{node.lineno} {node.name}")
    assert not silent


def _commands(page):
    """Yield stage and options of every `facade` command that a page's blocks show."""
    for block in blocks(page):
        for command in re.split(r"[|;&\n]", block.replace("\\\n", " ")):
            match = re.match(r"\s*\$?\s*facade (?:-\S+ )*([a-z][a-z-]*)(.*)", command)
            if match and match.group(1) in STAGES:
                yield match.group(1), re.findall(r"(?<![\w-])--[a-z][\w-]*", match.group(2))


def test_options_in_the_docs_are_options(facade_here):
    shown = {}
    for page in PAGES:
        for stage, options in _commands(page):
            if stage not in shown:
                shown[stage] = facade_here(stage, "--help").stdout.decode()
            for option in options:
                assert re.search(rf"{option}\b(?!-)", shown[stage]), (
                    f"{page.name}: {stage} {option}"
                )
    assert len(shown) > 10
