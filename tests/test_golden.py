"""Stage by stage, the bytes of the pipeline; refreshed by `make golden` and reviewed as a diff.

Every stage starts from the golden file of the one before, so that a change shows where it is.
"""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
GOLDEN = ROOT / "tests" / "golden"
SAMPLES = ROOT / "sample_data"

# name of the golden file -> the command that writes it
CHAIN = {
    "attributes.jsonl": ["attributes", "houses/farmhouse.jsonl"],
    "model.json": ["learn", "attributes.jsonl", "--restarts", "1"],
    "sampled.jsonl": ["sample", "model.json", "-n", "3", "--seed", "1"],
    "masses.jsonl": ["massgen", "sampled.jsonl", "--seed", "1"],
    "facades.jsonl": ["facadegen", "masses.jsonl", "--seed", "1"],
    "parses.jsonl": ["parse-image", "photos/facade-1.jpg", "photos/facade-3.jpg"],
    "parses-mrf.jsonl": ["parse-image", "photos/facade-1.jpg", "--method", "mrf"],
    "assembled.jsonl": ["assemble", "parses.jsonl"],
    "derived.jsonl": ["derive", "haussmann", "-n", "2", "--seed", "1"],
    "reconstructed.jsonl": ["reconstruct", "parses.jsonl", "--image", "photos/"],
}
PARALLEL = ("attributes", "massgen", "facadegen", "parse-image", "assemble", "reconstruct")


def locate(name: str) -> Path:
    return GOLDEN / name if name in CHAIN else SAMPLES / name


def run(facade, tmp_path: Path, name: str, *options: str) -> bytes:
    target = tmp_path / name
    words = [str(locate(word)) if "." in word or "/" in word else word for word in CHAIN[name]]
    done = facade(*words, *options, "-o", target)
    assert done.returncode == 0, done.stderr
    return target.read_bytes()


@pytest.mark.parametrize("name", CHAIN)
def test_bytes_of_the_stage(facade, tmp_path, name, update_golden):
    found = run(facade, tmp_path, name)
    if update_golden:
        (GOLDEN / name).write_bytes(found)
    assert found == (GOLDEN / name).read_bytes(), "changed: review, then `make golden`"


@pytest.mark.parametrize("name", [n for n, words in CHAIN.items() if words[0] in PARALLEL])
def test_bytes_do_not_depend_on_jobs(facade, tmp_path, name):
    assert run(facade, tmp_path, name, "--jobs", "2") == (GOLDEN / name).read_bytes()
