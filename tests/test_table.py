"""Tables as a user has them: what is refused and where, and the chain learn, sample, evaluate."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest

from facade_tools.artifacts.store import read_whole
from facade_tools.errors import InvalidInput
from facade_tools.exteriors.learning import LearnOptions
from facade_tools.exteriors.sample_lines import sample_lines
from facade_tools.exteriors.samples import SampleOptions
from facade_tools.exteriors.table import learn_table

PLAIN = "a,b\n1,2\n3,4\n5,6\n2,2\n1,1\n"
PLAIN_DRAW = {"options": SampleOptions(), "given": None, "provenance": None}
GROUPS = "groups: {one: [a], two: [b]}\n"


def learned(folder, table=PLAIN, groups=GROUPS, **options):
    (folder / "table.csv").write_text(table)
    (folder / "groups.yaml").write_text(groups)
    return learn_table(
        [read_whole(str(folder / "table.csv"))],
        str(folder / "groups.yaml"),
        rng=np.random.default_rng(0),
        options=LearnOptions(largest=3, **options),
    )


@pytest.mark.parametrize(
    ("table", "line", "message"),
    [
        ("a,b,id\n1,2,x\n3,4\n", 3, "2 cells; expected 3"),
        ("a,b\n1,inf\n2,3\n", 2, "expected a finite number"),
        ("a,b\n1,1\n2,nan\n", 3, "expected a finite number"),
        ("a,b\n1,1\n2,1e400\n", 3, "expected a finite number"),
        ("a,b\n1,1\n2,1e200\n", 3, "expected -1e+06 to 1000000"),
        ("a,b\n1,1\n2,x\n", 3, "'x' in column 'b'"),
        ("a,b,id\n1,2,x\n3,4,y\n1,5,x\n", 4, "'x' stands twice"),
        ("a,a\n1,2\n", 1, "'a' stands twice"),
        ("id,a,b,id\n1,2,3,4\n", 1, "'id' stands twice"),
        ("a,b\n", None, "expected at least 2"),
        ("", None, "is empty"),
    ],
)
def test_a_bad_table_is_refused_by_its_line(tmp_path, table, line, message):
    with pytest.raises(InvalidInput) as error:
        learned(tmp_path, table)
    assert error.value.place.source.endswith("table.csv")
    assert error.value.place.line == line
    assert message in error.value.message


@pytest.mark.parametrize(
    ("groups", "pointer"),
    [
        ("{}", "/groups"),
        ("groups: {}", "/groups"),
        ("bits: {flags: [a]}", "/groups"),
        ("groups: {one: []}", "/groups/one"),
        ("groups: {one: [a], two: [a]}", "/groups/two"),
        ("groups: {one: [a]}\nbits: {flags: [a]}", "/bits/flags"),
        ("groups: {one: [id]}", "/groups/one"),
        ("groups: {one: [nobody]}", "/groups/one"),
        ("groups: {one: [a]}\nbits: {flags: [nobody]}", "/bits/flags"),
        ("groups: {one: [a]}\nbits: {flags: b}", "/bits/flags"),
        ("groups: {one: {columns: [a], atoms: [x]}}", "/groups/one/atoms"),
        ("groups: {one: {columns: [a], atoms: [1, 1.0]}}", "/groups/one/atoms"),
        ("groups: {one: {columns: [a], floor: .nan}}", "/groups/one/floor"),
        ("groups: {one: {columns: [a], floor: -1}}", "/groups/one/floor"),
        ("groups: {one: {columns: [a], transform: [log]}}", "/groups/one/transform"),
    ],
)
def test_a_bad_declaration_is_refused_by_its_pointer(tmp_path, groups, pointer):
    with pytest.raises(InvalidInput) as error:
        learned(tmp_path, groups=groups)
    assert error.value.place.source.endswith("groups.yaml")
    assert error.value.place.pointer == pointer


@pytest.mark.parametrize(
    ("groups", "line"),
    [
        ("groups: {one: {columns: [a], transform: logit}}", 2),
        ("groups: {one: {columns: [a], transform: logit, atoms: [1, 3]}}", 4),
        ("groups: {one: [a]}\nbits: {flags: [b]}", 2),
    ],
)
def test_a_value_that_a_column_cannot_hold_is_refused_by_its_line(tmp_path, groups, line):
    with pytest.raises(InvalidInput) as error:
        learned(tmp_path, groups=groups)
    assert error.value.place.source.endswith("table.csv")
    assert error.value.place.line == line


@pytest.mark.parametrize("variant", ["full", "gmm"])
def test_what_nobody_observes_stays_unknown(tmp_path, variant):
    groups = GROUPS + "bits: {flags: [f, g]}\n"
    table = "a,b,f,g\n1,,1,\n3,,0,\n4,,1,\n"
    model = learned(tmp_path, table, groups, variant=variant)
    assert model.count == 3
    assert model.unobserved == ("b", "flags.g")
    lines = b"".join(
        run.data for run in sample_lines(model, 2, rng=np.random.default_rng(0), **PLAIN_DRAW)
    )
    for line in lines.decode().splitlines():
        name, a, b, f, g = line.split(",")
        assert (name[:2], b, g) == ("0-", "", "")
        assert np.isfinite(float(a))
        assert f in "01"


def test_columns_of_no_group_and_blank_lines_do_not_matter(tmp_path):
    table = "name,a,,,b\nAda,1,,x,2\n\nBo,3,y,,4\nAda,5,,,7\n\n"
    model = learned(tmp_path, table)
    assert model == learned(tmp_path, "a,b\n1,2\n3,4\n5,7\n")


def test_the_columns_that_there_are_are_named(tmp_path):
    with pytest.raises(InvalidInput, match="no column 'a'; expected one of 'a;b'"):
        learned(tmp_path, "a;b\n1;2\n3;4\n")


def test_holdout_and_report_of_a_table(facade_here, folder):
    words = ("learn", "table.csv", "--groups", "groups.yaml", "--holdout", 1)
    done = facade_here(*words, "--report", "r.html", "-o", "m.json", cwd=folder)
    assert done.returncode == 0
    rows = [line.split() for line in done.stderr.decode().splitlines()]
    assert [row[0] for row in rows[1:6]] == ["full", "no-lateral", "no-middle", "flat", "gmm"]
    assert np.isfinite([float(row[1]) for row in rows[1:6]]).all()
    page = (folder / "r.html").read_text()
    for text in ("Model of 40 rows", "nats a row", "<figcaption>width</figcaption>"):
        assert text in page
    assert "building" not in page


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("learn", "table.csv"), b"table.csv: a table needs --groups"),
        (("learn", "table.csv", "--groups", "groups.yaml", "--prior", "x"), b"--prior is of"),
    ],
)
def test_options_that_do_not_suit_a_table_are_refused(facade_here, folder, words, message):
    done = facade_here(*words, "-o", "never.json", cwd=folder)
    assert done.returncode == 2
    assert message in done.stderr
    assert not (folder / "never.json").exists()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A table whose names are those of buildings' coordinates, and what declares it."""
    folder = tmp_path_factory.mktemp("table")
    rng = np.random.default_rng(1)
    with (folder / "table.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["id", "height", "r1", "r2", "width", "flag"])
        for i in range(40):
            h = rng.normal(0, 20)
            share = 0.0 if rng.random() < 0.4 else rng.uniform(0.1, 0.9)
            row = [h, h + rng.normal(0, 0.1), share, rng.gamma(2.0), int(rng.random() < 0.5)]
            out.writerow([f'row "{i}"', *row])
    (folder / "groups.yaml").write_text(
        "groups: {far: [height, r1], arf: {columns: [r2], transform: logit, atoms: [0]},\n"
        "  size: {columns: [width], transform: log}}\nbits: {roof: [flag]}\n"
    )
    return folder


@pytest.mark.parametrize("variant", ["full", "no-middle", "flat", "gmm"])
def test_learn_sample_evaluate_of_a_table(facade_here, folder, variant):
    words = ("learn", "table.csv", "--groups", "groups.yaml", "--variant", variant)
    done = facade_here(*words, "-o", "model.json", cwd=folder)
    assert (done.returncode, done.stderr) == (0, b"")
    assert facade_here("validate", folder / "model.json").returncode == 0
    drawn = facade_here("sample", folder / "model.json", "-n", 300)
    assert (drawn.returncode, drawn.stderr) == (0, b"")
    rows = list(csv.DictReader(io.StringIO(drawn.stdout.decode())))
    assert list(rows[0]) == ["id", "height", "r1", "r2", "width", "flag"]
    assert [row["id"] for row in rows[:2]] == ["0-0", "0-1"]
    assert {row["flag"] for row in rows} == {"0", "1"}
    assert min(float(row["height"]) for row in rows) < 0  # no building's height
    assert 0.2 < np.mean([float(row["r2"]) == 0 for row in rows]) < 0.6
    for words, stdin, count in (("-", drawn.stdout, 300), (folder / "table.csv", b"", 40)):
        found = facade_here("evaluate", folder / "model.json", words, stdin=stdin)
        assert (found.returncode, found.stderr) == (0, b"")
        assert json.loads(found.stdout)["n"] == count


@pytest.fixture(scope="module")
def model(facade_script, folder):
    import subprocess

    path = folder / "plain.json"
    (folder / "plain.csv").write_text(PLAIN)
    (folder / "plain.yaml").write_text(GROUPS)
    words = ["learn", "plain.csv", "--groups", "plain.yaml", "-o", path]
    subprocess.run([facade_script, *map(str, words)], cwd=folder, check=True)
    return path


def test_a_table_from_standard_input_is_the_same_table(facade_here, folder, model):
    words = ("learn", "-", "--groups", folder / "plain.yaml")
    done = facade_here(*words, stdin=PLAIN.encode())
    assert done.returncode == 0
    here, there = json.loads(done.stdout), json.loads(model.read_text())
    assert here.pop("provenance")["inputs"][0]["name"] == "-"
    assert there.pop("provenance")["inputs"][0]["name"] == "plain.csv"
    assert here == there


def test_samples_of_a_table_do_not_depend_on_their_number_or_on_jobs(facade_here, model, tmp_path):
    out = tmp_path / "out.csv"
    assert facade_here("sample", model, "-n", 4100, "--jobs", 2, "-o", out).returncode == 0
    lines = out.read_bytes().splitlines()
    assert len(lines) == 4101
    assert facade_here("sample", model, "-n", 4100).stdout == out.read_bytes()
    assert facade_here("sample", model, "-n", 2).stdout.splitlines() == lines[:3]
    top = facade_here("sample", model, "-n", 3, "--top", "--min-distance", 0.05)
    assert len(top.stdout.splitlines()) == 4
    done = facade_here("sample", model, "-o", tmp_path / "out.jsonl")
    assert done.returncode == 2
    assert b"expected a .csv file" in done.stderr


def test_skip_leaves_out_bad_rows_of_a_table(facade_here, model, tmp_path):
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n3,x\n5,6\n2,2\n1,1e9\n,\n1,3,4\n")
    done = facade_here("evaluate", model, "bad.csv", "--on-error", "skip", cwd=tmp_path)
    assert done.returncode == 3
    assert json.loads(done.stdout)["n"] == 3
    for line in (3, 6, 7, 8):
        assert f"bad.csv:{line}: ".encode() in done.stderr
    stopped = facade_here("evaluate", model, "bad.csv", cwd=tmp_path)
    assert (stopped.returncode, stopped.stdout) == (3, b"")
    assert stopped.stderr.startswith(b"facade evaluate: error: bad.csv:3: 'x' in column 'b'")
    words = ("learn", "bad.csv", "--groups", model.with_name("plain.yaml"), "--on-error", "skip")
    assert facade_here(*words, "-o", "out.json", cwd=tmp_path).returncode == 3
    assert json.loads((tmp_path / "out.json").read_text())["count"] == 4


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("sample", "plain.json", "--given", "plain.csv"), b"is a model of a table"),
        (("massgen", "none.jsonl", "--model", "plain.json"), b"is a model of a table"),
        (("evaluate", "plain.json", "table.csv"), b"table.csv:1: has no column 'a'"),
    ],
)
def test_what_a_model_of_a_table_cannot_do_is_said(facade_here, folder, model, words, message):
    done = facade_here(*words, cwd=folder)
    assert done.returncode == 3
    assert message in done.stderr
    assert done.stderr.count(b"\n") == 1
