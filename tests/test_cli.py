"""What every stage of the command line promises (CONTRACT section 1), on those without chance."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
HOUSES = ROOT / "sample_data" / "houses"
BUNGALOWS = HOUSES / "bungalow.jsonl"


def lines(data: bytes) -> list[dict]:
    return [json.loads(line) for line in data.splitlines()]


@pytest.fixture
def spoiled(tmp_path):
    """A stream whose third line lacks its boxes."""
    rows = BUNGALOWS.read_text().splitlines()[:5]
    rows[2] = '{"schema": "facade-tools/building/1", "id": "bad"}'
    path = tmp_path / "spoiled.jsonl"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_help_and_version(facade):
    for words in (["--help"], ["-h"], ["attributes", "--help"], ["--version"]):
        done = facade(*words)
        assert (done.returncode, done.stderr) == (0, b"")
        assert done.stdout


@pytest.mark.parametrize(
    "words",
    [
        ("capture-style", "model.obj"),
        ("export", "a.json"),
        ("rectify", "photo.png"),
        ("retarget", "style", "a.json"),
        ("view", "a.json"),
    ],
)
def test_help_does_not_promise_standard_output_to_stages_that_need_a_name(facade_here, words):
    told = b" ".join(facade_here(words[0], "--help").stdout.split())
    missing = facade_here(*words)
    assert missing.returncode == 2
    kinds = missing.stderr.strip().split(b"Missing option '-o': name ")[1]
    assert b"Where to write: " + kinds in told


def test_help_loads_no_stage_and_nothing_heavy():
    code = (
        "import sys; from facade_tools.cli.main import main; main(['--help'])\n"
        "heavy = {'numpy', 'jsonschema', 'jsonschema_rs', 'yaml', 'cv2', 'numba', 'scipy'}\n"
        "sys.exit(str(heavy & set(sys.modules)) if heavy & set(sys.modules) else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True)
    assert done.returncode == 0, done.stderr


def test_standard_output_holds_artifacts_only(facade):
    done = facade("attributes", BUNGALOWS)
    assert done.returncode == 0
    assert done.stderr == b""
    assert {row["schema"] for row in lines(done.stdout)} == {"facade-tools/attributes/1"}


def test_pipes_files_and_folders_give_the_same_artifacts(facade, tmp_path):
    out = tmp_path / "out.jsonl"
    assert facade("attributes", BUNGALOWS, "-o", out).returncode == 0
    piped = facade("attributes", "-", stdin=BUNGALOWS.read_bytes()).stdout
    drop = [{k: v for k, v in row.items() if k != "provenance"} for row in lines(piped)]
    kept = [{k: v for k, v in row.items() if k != "provenance"} for row in lines(out.read_bytes())]
    assert drop == kept
    folder = tmp_path / "each"
    assert facade("attributes", BUNGALOWS, "-o", f"{folder}/").returncode == 0
    assert len(list(folder.iterdir())) == len(kept)
    again = facade("attributes", folder / f"{kept[0]['id']}.json")
    assert again.returncode == 3
    assert b"expected facade-tools/building/1" in again.stderr


def test_bytes_do_not_depend_on_jobs(facade):
    one, two = (facade("attributes", HOUSES, "--jobs", n).stdout for n in (1, 2))
    assert one == two
    assert len(lines(one)) >= 240


def test_bytes_do_not_depend_on_the_scheduler(facade):
    distributed = pytest.importorskip("distributed")
    options = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster:
        remote = facade("attributes", BUNGALOWS, "--scheduler", cluster.scheduler_address)
    assert remote.stdout == facade("attributes", BUNGALOWS).stdout


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["no-such-stage"], 2),
        (["attributes"], 2),
        (["attributes", "x.json", "--jobs", "-1"], 2),
        (["attributes", "x.json", "--no-such-option"], 2),
        (["attributes", "no-such-file.json"], 3),
        (["attributes", "empty.json"], 3),
        (["attributes", "empty.jsonl"], 0),
        (["attributes", "broken.json"], 3),
        (["attributes", "empty.jsonl", "-o", "no/folder/x.jsonl"], 1),
        (["validate", "broken.json"], 3),
    ],
)
def test_exit_codes(facade, tmp_path, words, code):
    (tmp_path / "empty.json").touch()
    (tmp_path / "empty.jsonl").touch()
    (tmp_path / "broken.json").write_text("{")
    done = facade(*words, cwd=tmp_path)
    assert done.returncode == code, done.stderr
    assert b"Traceback" not in done.stderr
    if code == 3:
        assert done.stderr.startswith(b"facade " + words[0].encode() + b": error: ")
        assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        ["sample", "m.json", "--min-distance"],
        ["massgen", "a.jsonl", "--require"],
        ["view", "b.json", "-o", "x.png", "--azimuth"],
        ["view", "b.json", "-o", "x.png", "--elevation"],
        ["layer-solve", "d.yaml", "--time-limit"],
        ["layer-solve", "d.yaml", "--width"],
        ["capture-style", "m.obj", "-o", "s", "--front"],
        ["capture-style", "m.obj", "-o", "s", "--window-size"],
        ["reconstruct", "p.json", "-o", "b.json", "--depth"],
        ["assemble", "p.json", "-o", "b.json", "--storey-height"],
        ["parse-image", "p.png", "--height"],
        ["train-parser", "i", "l", "-o", "c.npz", "--balance"],
        ["derive", "grammar", "-o", "b.json", "--set", "floors={}"],
    ],
    ids=lambda words: " ".join(w for w in words if w.startswith("--") or words[0] == w),
)
@pytest.mark.parametrize("number", ["nan", "inf", "-inf"])
def test_a_number_that_is_none_is_usage(facade_here, tmp_path, words, number):
    last = [words[-1].format(number)] if "{}" in words[-1] else [words[-1], number]
    done = facade_here(*words[:-1], *last, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("sweep", ["1:1000:1e-320", "1000:1:1e-320"])
def test_a_sweep_of_endless_canvases_is_usage(facade_here, sweep):
    assert facade_here("layer-solve", "d.yaml", "--width", sweep).returncode == 2


def test_a_bad_item_stops_the_stream_and_leaves_no_file(facade, spoiled, tmp_path):
    out = tmp_path / "out.jsonl"
    done = facade("attributes", spoiled, "-o", out)
    assert done.returncode == 3
    assert f"error: {spoiled}:3: /: 'boxes' is a required".encode() in done.stderr
    assert not out.exists()
    assert {path.name for path in tmp_path.iterdir()} == {spoiled.name}
    assert len(lines(facade("attributes", spoiled).stdout)) == 2


@pytest.mark.parametrize("jobs", [1, 2])
def test_skip_goes_on_and_exits_with_three(facade, spoiled, tmp_path, jobs):
    out = tmp_path / "out.jsonl"
    done = facade("attributes", spoiled, "-o", out, "--on-error", "skip", "--jobs", jobs)
    assert done.returncode == 3
    assert len(lines(out.read_bytes())) == 4
    assert b"spoiled.jsonl:3: " in done.stderr
    assert b"1 bad item" in done.stderr


def test_debug_shows_the_traceback(facade, spoiled):
    assert b"Traceback" in facade("--debug", "attributes", spoiled).stderr


def test_one_json_file_holds_one_artifact(facade, tmp_path):
    several = facade("attributes", BUNGALOWS, "-o", tmp_path / "x.json")
    assert several.returncode == 1
    assert b"name a .jsonl file or a folder" in several.stderr
    first = BUNGALOWS.read_bytes().splitlines()[0]
    assert facade("attributes", "-", "-o", tmp_path / "x.json", stdin=first).returncode == 0
    assert (tmp_path / "x.json").read_bytes().count(b"\n") > 10


@pytest.mark.parametrize(("stage", "name"), [
    ("export", "a.city.json"), ("import", "a.city.json"), ("import", "./b/../a.city.json"),
    ("reconstruct", "a.json"), ("validate", "a.jsonl"), ("attributes", "a.jsonl"),
    ("massgen", "a.jsonl"), ("facadegen", "a.jsonl"), ("learn", "a.json"), ("sample", "a.json"),
    ("layer-solve", "a.json"), ("view", "a.png"), ("assemble", "a.json"),
])  # fmt: skip
def test_results_do_not_overwrite_their_input(facade_here, tmp_path, stage, name):
    (tmp_path / "b").mkdir()
    path = tmp_path / name
    path.write_text("{}")
    done = facade_here(stage, path.resolve(), "-o", name, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert b"is an input and would be overwritten" in done.stderr
    assert path.read_text() == "{}"


@pytest.mark.parametrize("option", ["--keep", "--library"])
def test_results_do_not_overwrite_what_an_option_names(facade_here, tmp_path, option):
    (tmp_path / "a.json").write_text("{}")
    done = facade_here("facadegen", BUNGALOWS, option, "./a.json", "-o", "a.json", cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert b"is an input and would be overwritten" in done.stderr


def test_a_folder_of_results_does_not_overwrite_an_input_in_it(facade_here, tmp_path):
    first = BUNGALOWS.read_bytes().splitlines()[0]
    path = tmp_path / f"{json.loads(first)['id']}.json"
    path.write_bytes(first)
    for output in (".", "other"):
        done = facade_here("attributes", path, "-o", output, cwd=tmp_path)
        assert done.returncode == (1 if output == "." else 0)
        assert path.read_bytes() == first
    assert facade_here("attributes", ".", "-o", tmp_path, cwd=tmp_path).returncode == 2


def test_devices_are_no_folders_and_no_path_is_no_folder_either(facade_here, tmp_path):
    done = facade_here("attributes", BUNGALOWS, "-o", "/dev/null", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, b"")
    full = facade_here("attributes", BUNGALOWS, "-o", "/dev/full", cwd=tmp_path)
    assert full.returncode == 1
    assert b"/dev/full: cannot be written: No space left on device" in full.stderr
    unset = facade_here("attributes", BUNGALOWS, "-o", "", cwd=tmp_path)
    assert unset.returncode == 2
    assert b"is empty; name a file or a folder" in unset.stderr
    assert not list(tmp_path.iterdir())


def test_a_file_in_the_place_of_a_folder_is_no_bug(facade_here, tmp_path):
    (tmp_path / "file").touch()
    done = facade_here("attributes", BUNGALOWS, "-o", "file/x.jsonl", cwd=tmp_path)
    assert done.returncode == 1
    assert b"file/x.jsonl: cannot be written: Not a directory" in done.stderr


def test_validate_finds_keys_that_stand_twice(facade_here, tmp_path):
    house = BUNGALOWS.read_text().splitlines()[0]
    (tmp_path / "a.jsonl").write_text(house.replace('"boxes":', '"boxes":[],"boxes":', 1) + "\n")
    done = facade_here("validate", "a.jsonl", "--format", "json", cwd=tmp_path)
    assert done.returncode == 3
    (finding,) = lines(done.stdout)
    assert (finding["line"], finding["message"]) == (
        1,
        "key 'boxes' stands twice; expected it once",
    )


def test_findings_are_no_single_json_document(facade_here, tmp_path):
    done = facade_here("validate", BUNGALOWS, "-o", "x.json", cwd=tmp_path)
    assert done.returncode == 2
    assert b"name a .txt or .jsonl file" in done.stderr


def test_what_is_no_artifact_is_told_the_kinds_once(facade_here, tmp_path):
    (tmp_path / "a.json").write_text('{"schema": "facade-tools/house/1"}')
    done = facade_here("validate", "a.json", cwd=tmp_path)
    assert b"expected facade-tools/KIND/1 with KIND one of attributes, blocks," in done.stdout
    assert len(done.stdout) < 250


@pytest.mark.parametrize(
    ("word", "told"), [("veiw", b"Did you mean 'view'?"), ("xyzzy", b"No such stage 'xyzzy'.")]
)
def test_a_mistyped_stage_is_told_the_nearest(facade_here, word, told):
    done = facade_here(word, "a.json")
    assert done.returncode == 2
    assert done.stderr.strip().endswith(told)


def test_ids_cannot_leave_the_folder(facade, tmp_path):
    row = json.loads(BUNGALOWS.read_text().splitlines()[0])
    row["id"] = "../../evil"
    done = facade("attributes", "-", "-o", f"{tmp_path}/out/", stdin=json.dumps(row).encode())
    assert done.returncode == 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["_.._evil.json"]


def test_skip_goes_on_after_an_id_that_stands_twice_in_a_folder(facade, tmp_path):
    first, second = BUNGALOWS.read_text().splitlines()[:2]
    stdin = "\n".join([first, first, second]).encode()
    words = ("attributes", "-", "-o", f"{tmp_path}/out/")
    done = facade(*words, "--on-error", "skip", stdin=stdin)
    assert done.returncode == 3
    assert b"stands twice" in done.stderr
    assert len(list((tmp_path / "out").iterdir())) == 2


def test_provenance_names_inputs_and_only_what_matters(facade):
    row = lines(facade("-v", "attributes", BUNGALOWS, "--on-error", "skip").stdout)[0]
    provenance = row["provenance"]
    assert provenance["stage"] == "attributes"
    assert provenance["tool"] == "facade-tools"
    assert provenance["inputs"][0]["name"] == "bungalow.jsonl"
    assert provenance["options"] == {}


def test_a_reader_that_leaves_early_is_no_error(facade_script):
    command = f"{facade_script} attributes {HOUSES} | head -n 1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True)
    assert done.returncode == 0
    assert done.stderr == b""


def _interrupted(facade_script, source: Path, out: Path, jobs: int, signum: int):
    """Start a long run, send a signal in the middle of it, return code and seconds to the end."""
    words = [facade_script, "attributes", source, "-o", out, "--jobs", str(jobs)]
    process = subprocess.Popen([str(word) for word in words], stderr=subprocess.PIPE)
    end = time.monotonic() + 30
    while not list(out.parent.glob(".*.tmp")) and time.monotonic() < end:
        time.sleep(0.02)
    time.sleep(0.3)
    assert process.poll() is None, "ended before the signal"
    start = time.monotonic()
    process.send_signal(signum)
    _, errors = process.communicate(timeout=20)
    return process.returncode, time.monotonic() - start, errors


@pytest.fixture(scope="module")
def long_stream(tmp_path_factory):
    path = tmp_path_factory.mktemp("long") / "long.jsonl"
    path.write_bytes(b"".join(p.read_bytes() for p in sorted(HOUSES.glob("*.jsonl"))) * 60)
    return path


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_ends_within_two_seconds_and_leaves_nothing(
    facade_script, long_stream, tmp_path, jobs
):
    out = tmp_path / "out.jsonl"
    code, seconds, errors = _interrupted(facade_script, long_stream, out, jobs, signal.SIGINT)
    assert code == 130
    assert errors.strip() == b"facade: interrupted"
    assert seconds < 2
    assert os.listdir(tmp_path) == []


def test_a_kill_leaves_no_output(facade_script, long_stream, tmp_path):
    out = tmp_path / "out.jsonl"
    _interrupted(facade_script, long_stream, out, 1, signal.SIGKILL)
    assert not out.exists()


def test_progress_shows_on_a_terminal_only(facade_script, long_stream, tmp_path):
    for quiet, expected in (("-v", True), ("-q", False)):
        ours, theirs = pty.openpty()
        words = [
            facade_script,
            quiet,
            "attributes",
            str(long_stream),
            "-o",
            str(tmp_path / "x.jsonl"),
        ]
        process = subprocess.Popen(words, stderr=theirs)
        time.sleep(2.5)
        process.kill()
        process.wait()
        os.close(theirs)
        shown = b""
        try:
            while chunk := os.read(ours, 65536):
                shown += chunk
        except OSError:
            pass
        os.close(ours)
        assert (b"a second" in shown) is expected


def test_validate_reports_file_line_and_pointer(facade, spoiled):
    done = facade("validate", spoiled, BUNGALOWS, "--format", "json")
    assert done.returncode == 3
    (finding,) = lines(done.stdout)
    assert (finding["line"], finding["id"], finding["pointer"]) == (3, "bad", "/")
    assert facade("validate", BUNGALOWS).returncode == 0


def test_shell_completion_knows_the_stages(facade_script):
    environment = {
        **os.environ,
        "_FACADE_COMPLETE": "bash_complete",
        "COMP_WORDS": "facade att",
        "COMP_CWORD": "1",
    }
    done = subprocess.run([facade_script], env=environment, capture_output=True)
    assert b"attributes" in done.stdout
