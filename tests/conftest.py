"""Fixtures that every test file may use."""

from __future__ import annotations

import io
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="rewrite tests/golden")


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--update-golden"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real data made by others, where it lies beside the checkout; tests skip without it."""
    folder = Path(os.environ.get("FACADE_TOOLS_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("no shared data here")
    return folder


@pytest.fixture(scope="session")
def facade_script() -> str:
    """The installed `facade` command."""
    return str(Path(sys.executable).with_name("facade"))


@pytest.fixture
def facade(facade_script):
    """Run `facade` in a process of its own; returns what it printed and its exit code."""

    def run(*arguments: object, stdin: bytes = b"", cwd: Path | None = None):
        words = [facade_script, *map(str, arguments)]
        return subprocess.run(words, input=stdin, capture_output=True, cwd=cwd, timeout=300)

    return run


@pytest.fixture
def facade_here(capfdbinary, monkeypatch):
    """Run `facade` in this process, which is faster; results are as those of `facade`."""
    from facade_tools.cli.main import main

    def run(*arguments: object, stdin: bytes = b"", cwd: Path | None = None):
        logger = logging.getLogger("facade_tools")
        before = logger.handlers, logger.level, logger.propagate
        with monkeypatch.context() as patch:
            patch.setattr(sys, "stdin", io.TextIOWrapper(io.BufferedReader(io.BytesIO(stdin))))
            if cwd is not None:
                patch.chdir(cwd)
            code = main([str(argument) for argument in arguments])
        logger.handlers, logger.level, logger.propagate = before
        out, err = capfdbinary.readouterr()
        return subprocess.CompletedProcess(arguments, code, out, err)

    return run


@pytest.fixture(scope="session")
def styles():
    """The styles of sample_data/textured by name."""
    from facade_tools.formats.mesh_reader import read_textured
    from facade_tools.stylization.capture import capture_style

    return {
        folder.name: capture_style(read_textured(folder / "model.obj"), folder.name)
        for folder in sorted((ROOT / "sample_data" / "textured").iterdir())
    }
