from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_every_package_is_listed():
    folders = {p.parent for p in (ROOT / "facade_tools").rglob("__init__.py")}
    found = {".".join(folder.relative_to(ROOT).parts) for folder in folders}
    assert found | {"facade_tools.cli", "facade_tools.schemas"} == set(
        PROJECT["tool"]["setuptools"]["packages"]
    )


def test_versions_agree():
    from facade_tools import __version__

    assert PROJECT["project"]["version"] == __version__


def test_the_lock_has_hashes_and_no_host_names():
    lock = (ROOT / "requirements.lock").read_text()
    assert "://" not in lock
    pinned = re.findall(r"^([a-z0-9-]+)==", lock, re.M)
    assert len(pinned) > 30
    assert lock.count("--hash=sha256:") >= len(pinned)
    wanted = {re.split(r"[><=\[ ]", row)[0].lower() for row in PROJECT["project"]["dependencies"]}
    assert wanted <= set(pinned)


def test_no_dependency_is_under_the_gpl():
    from importlib import metadata

    for row in PROJECT["project"]["dependencies"]:
        data = metadata.metadata(re.split(r"[><=\[ ]", row)[0])
        words = f"{data.get('License', '')} {data.get('License-Expression', '')}"
        words += " ".join(data.get_all("Classifier") or [])
        assert not re.search(r"\bGPL|GNU General", words.split("\n")[0]), row


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Build from a clean copy: a stale build folder would resurrect deleted modules."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for name in ("facade_tools", "cli", "schemas"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    subprocess.run(
        [*pip, "wheel", "-q", "--no-deps", "--no-build-isolation", "-w", folder, source], check=True
    )
    return next(folder.glob("*.whl"))


def test_the_wheel_holds_one_import_package(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0].split("-")[0] for name in names} == {"facade_tools"}
    assert "facade_tools/schemas/building.schema.json" in names
    assert "facade_tools/cli/main.py" in names
    assert "facade_tools/py.typed" in names


def test_the_installed_wheel_runs_and_finds_its_schemas(wheel, tmp_path):
    target = tmp_path / "site"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(target)
    code = (
        f"import sys; sys.path.insert(0, {str(target)!r})\n"
        "import facade_tools\n"
        "from facade_tools.artifacts.validation import schema_names\n"
        "from facade_tools.cli.main import main\n"
        f"assert facade_tools.__file__.startswith({str(target)!r})\n"
        "assert 'building' in schema_names()\n"
        "sys.exit(main(['--version']))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tmp_path, capture_output=True)
    assert done.stdout.startswith(b"facade "), done.stderr


def test_no_stray_top_level_names(tmp_path):
    for name in ("cli", "schemas"):
        done = subprocess.run(
            [sys.executable, "-P", "-c", f"import {name}"], cwd=tmp_path, capture_output=True
        )
        assert b"ModuleNotFoundError" in done.stderr
