"""The three commands as a user runs them: learn, sample, evaluate."""

from __future__ import annotations

import json

import pytest


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("chain")


@pytest.fixture(scope="module")
def attributes(folder):
    """Sixty of the sample houses as a stream."""
    from facade_tools.artifacts.documents import encode
    from facade_tools.artifacts.numbers import dump_line
    from facade_tools.exteriors.prior import shipped_prior

    path = folder / "attributes.jsonl"
    path.write_bytes(b"".join(dump_line(encode(row)) for row in shipped_prior()[::5]))
    return path


def run(facade_script, *words, code=0, stdin=b""):
    import subprocess

    done = subprocess.run([facade_script, *map(str, words)], input=stdin, capture_output=True)
    assert done.returncode == code, done.stderr.decode()
    return done


@pytest.fixture(scope="module")
def model(facade_script, folder, attributes):
    path = folder / "model.json"
    run(
        facade_script, "learn", attributes, "--variant", "no-lateral", "-o", path,
        "--report", folder / "report.html",
    )  # fmt: skip
    return path


def test_learn_sample_evaluate_in_a_pipe(facade_script, model, attributes):
    drawn = run(facade_script, "sample", model, "-n", 4).stdout
    assert drawn == run(facade_script, "sample", model, "-n", 4).stdout
    rows = [json.loads(line) for line in drawn.splitlines()]
    assert [row["id"] for row in rows] == ["0-0", "0-1", "0-2", "0-3"]
    assert rows[0]["provenance"]["stage"] == "sample"
    found = json.loads(run(facade_script, "evaluate", model, "-", stdin=drawn).stdout)
    assert set(found) == {"n", "nll", "per_building"}
    assert found["n"] == 4
    assert found["nll"] == pytest.approx(sum(found["per_building"]) / 4)
    known = -rows[0]["sample"]["log_density"]
    assert found["per_building"][0] == pytest.approx(known, abs=1e-6)
    assert run(facade_script, "evaluate", model, attributes).returncode == 0


def test_samples_do_not_depend_on_jobs_or_on_where_they_are_written(facade_script, folder, model):
    """Runs of samples by two workers; a folder and a single file take them one by one."""
    path = folder / "many.jsonl"
    run(facade_script, "sample", model, "-n", 4100, "--jobs", 2, "-o", path)
    alone = run(facade_script, "sample", model, "-n", 4100).stdout
    assert path.read_bytes() == alone
    assert [json.loads(line)["id"] for line in alone.splitlines()[4095:4097]] == [
        "0-4095",
        "0-4096",
    ]
    run(facade_script, "sample", model, "-n", 3, "-o", f"{folder}/apart/")
    files = sorted((folder / "apart").iterdir())
    assert [f.name for f in files] == ["0-0.json", "0-1.json", "0-2.json"]
    assert b"".join(f.read_bytes() for f in files) == b"".join(alone.splitlines(True)[:3])
    done = run(facade_script, "sample", model, "-n", 2, "-o", folder / "one.json", code=1)
    assert b"several artifacts" in done.stderr


def test_the_same_seed_learns_the_same_bytes(facade_script, folder, model, attributes):
    again = folder / "again.json"
    run(facade_script, "learn", attributes, "--variant", "no-lateral", "-o", again)
    assert again.read_bytes() == model.read_bytes()


def test_report_is_self_contained(model, folder):
    page = (folder / "report.html").read_text()
    assert "<svg" in page
    assert page.count("src=") == page.count("src='data:image/png;base64,") > 2
    assert "<script" not in page


def test_completion_of_a_hand_written_part(facade_script, folder, model):
    partial = folder / "partial.yaml"
    partial.write_text(
        "schema: facade-tools/attributes/1\nid: mine\n"
        "mass: {bbox: [12.123456789012346, null, null]}\n"
    )
    out = run(facade_script, "sample", model, "--given", partial, "--top", "-n", 2).stdout
    rows = [json.loads(line) for line in out.splitlines()]
    assert [row["mass"]["bbox"][0] for row in rows] == [12.123456789012346] * 2
    assert b"null" not in out.replace(b'"style":null', b"")


def test_bad_input_is_one_line_and_exit_3(facade_script, folder, model):
    document = json.loads(model.read_text())
    document["style"][0] += 0.5
    (folder / "broken.json").write_text(json.dumps(document))
    for words in (
        ("sample", folder / "broken.json"),
        ("sample", folder / "missing.json"),
        ("learn", model),
        ("evaluate", model, model),
    ):
        done = run(facade_script, *words, code=3)
        assert done.stderr.decode().count("\n") == 1
        assert done.stderr.decode().startswith(f"facade {words[0]}: error:")


def test_skip_goes_on_after_rows_without_observations(facade_script, folder, model, attributes):
    head = {"schema": "facade-tools/attributes/1"}
    bad = [{"id": "e"}, {"id": "f", "mass": {"bdry": 4.2}}, {"id": "g", "mass": {"far": 0.5}}]
    good = attributes.read_bytes().splitlines(keepends=True)[:3]
    rows = [json.dumps({**head, **row}).encode() + b"\n" for row in (*bad, {"id": "e"})]
    (folder / "some.jsonl").write_bytes(b"".join([*good, *rows]))
    done = run(
        facade_script, "evaluate", model, folder / "some.jsonl", "--on-error", "skip", code=3
    )
    found = json.loads(done.stdout)
    assert found["n"] == len(found["per_building"]) == 3
    alone = "alone no coordinate of the model follows"
    for line, reason in (
        (4, "e: nothing is observed"),
        (5, f"f: of mass.bdry {alone}"),
        (6, f"g: of mass.far {alone}"),
        (7, "id 'e' stands twice"),
    ):
        assert f"some.jsonl:{line}: {reason}" in done.stderr.decode()
    stopped = run(facade_script, "evaluate", model, folder / "some.jsonl", code=3)
    assert stopped.stdout == b""
    assert stopped.stderr.decode().count("\n") == 1


def _swap(document):
    first, second = document["groups"][2:4]
    document["groups"][2:4] = second, first


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        (lambda d: d["groups"].append(d["groups"][0]), "/groups/10"),
        (lambda d: d["groups"].pop(), "/groups"),
        (lambda d: d["groups"][0].update(name="nobody"), "/groups/0/name"),
        (
            lambda d: d["groups"][0]["coordinates"][0].update(name="w"),
            "/groups/0/coordinates/0/name",
        ),
        (lambda d: d["groups"][5]["coordinates"][0].pop("part"), "/groups/5/coordinates/0/part"),
        (_swap, "/groups/2/name"),
        (lambda d: d["groups"][3]["channels"].pop(), "/groups/3/channels"),
        (
            lambda d: d["groups"][3]["channels"][0].update(states=["value", "none", "all"]),
            "/groups/3/channels/0/states/1",
        ),
        (
            lambda d: d["groups"][3]["coordinates"][0].update(atoms=[0.5, 0.75]),
            "/groups/3/coordinates/0/atoms",
        ),
        (lambda d: d["elements"].pop(0), "/elements/0/name"),
        (lambda d: d["elements"][0]["bits"].__setitem__(0, "tent"), "/elements/0/bits/0"),
        (lambda d: d.update(boundary="bdry"), "/groups/2/coordinates/0/name"),
        (lambda d: d["training"]["values"][3].pop(), "/training/values/3"),
    ],
)
@pytest.mark.parametrize("stage", ["sample", "evaluate"])
def test_a_model_of_other_names_is_refused(
    facade_here, tmp_path, model, attributes, stage, change, pointer
):
    document = json.loads(model.read_text())
    change(document)
    path = tmp_path / "tampered.json"
    path.write_text(json.dumps(document))
    done = facade_here(stage, path, *([attributes] if stage == "evaluate" else []))
    assert (done.returncode, done.stdout) == (3, b"")
    start = f"facade {stage}: error: {path}: {pointer}: "
    assert done.stderr.decode().startswith(start)
    assert done.stderr.count(b"\n") == 1


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["--report", "x.json", "-o", "./x.json"], 2, "another file for the report"),
        (["--report", "no/folder/x.html", "-o", "x.json"], 1, "no/folder/x.html: cannot be"),
        (["-o", "no/folder/x.json"], 1, "no/folder/x.json: cannot be"),
    ],
)
def test_outputs_that_cannot_be_are_refused_before_learning(
    facade_here, monkeypatch, tmp_path, attributes, words, code, message
):
    import facade_tools.exteriors.learning as learning

    monkeypatch.setattr(learning, "learn_model", lambda *_, **__: pytest.fail("learned"))
    done = facade_here("learn", attributes, *words, cwd=tmp_path)
    assert done.returncode == code
    assert message in done.stderr.decode()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("stage", ["learn", "evaluate"])
def test_an_id_that_stands_twice_is_refused_by_its_line(facade_here, model, attributes, stage):
    words = (stage, model) if stage == "evaluate" else (stage,)
    done = facade_here(*words, attributes, "-", stdin=attributes.read_bytes().splitlines()[3])
    assert done.returncode == 3
    assert done.stderr.decode().startswith(f"facade {stage}: error: -:1: id ")


@pytest.mark.parametrize("number", [".nan", ".inf", "-.inf"])
def test_a_number_that_is_none_is_refused_by_its_pointer(facade_here, tmp_path, model, number):
    partial = tmp_path / "partial.yaml"
    partial.write_text(
        f"schema: facade-tools/attributes/1\nid: mine\nmass: {{bbox: [12.5, {number}, null]}}\n"
    )
    done = facade_here("sample", model, "--given", partial)
    assert done.returncode == 3
    assert f"{partial}: /mass/bbox/1: " in done.stderr.decode()


def test_nothing_observed_is_invalid(facade_script, folder, model):
    (folder / "empty.json").write_text('{"schema": "facade-tools/attributes/1", "id": "e"}')
    run(facade_script, "evaluate", model, folder / "empty.json", code=3)
