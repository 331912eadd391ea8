"""Batches by the command line and in Python: tables, folders of samples, files that several samples share."""
import copy
import csv
import io
import json
import os
import re
import subprocess
import sys

import pytest
from daemon_under_test import ROOT, document, program

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402

SELVEDGE = program("selvedge")


def run(daemon, *words, expect=0):
    done = subprocess.run([SELVEDGE, "--server", daemon.url, "batch", *map(str, words)], capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == expect, done.stdout + done.stderr
    return done.stdout + done.stderr


def state_of(daemon, name):
    return selvedge.Client(daemon.url).batch(name).wait(60, 0.1)


@pytest.fixture
def folder(tmp_path):
    """A template, a table, and the files that its samples share."""
    (tmp_path / "template.json").write_text(json.dumps(document()))
    (tmp_path / "scan.tif").write_bytes(b"II*\0" + os.urandom(4000))
    (tmp_path / "rows.csv").write_bytes(os.urandom(300))
    (tmp_path / "other.csv").write_bytes(os.urandom(300))
    (tmp_path / "table.csv").write_text('sample,volume.voxel_size_um,measurements.file,/fit/start/C_R.g\r\n"fake: succeed ""a,b""",1.5,,\r\n'
                                        "fake: succeed b,,other.csv,0.25\r\nfake: fail,,,\r\n")
    return tmp_path


def test_a_table(daemon, folder):
    said = run(daemon, "submit", folder / "template.json", folder / "table.csv", "--name", "a table")
    # scan.tif and rows.csv are shared: each is sent once
    assert "3 samples: 3 new or changed, 0 taken over, 0 jobs left the batch; 3 files uploaded, 3 on the server already" in said
    state = state_of(daemon, "a table")
    assert state.states["succeeded"] == 2 and state.states["failed"] == 1 and state.ended
    shown = run(daemon, "show", "a table")
    assert "3: 2 succeeded, 1 failed" in shown and "fake: fail: volume.files: cannot read volume 'scan.tif': page 2 is cut off" in shown
    jobs = {job["sample"]: daemon.get(f"/v1/jobs/{job['id']}").json()["document"] for job in daemon.get(f"/v1/jobs?batch={state.raw['id']}").json()["jobs"]}
    assert jobs['fake: succeed "a,b"']["volume"]["voxel_size_um"] == 1.5
    assert jobs["fake: succeed b"]["measurements"]["file"] == "other.csv" and jobs["fake: succeed b"]["fit"] == {"start": {"C_R.g": 0.25}}
    lines = list(csv.DictReader(io.StringIO(run(daemon, "results", "a table"))))
    assert [line["sample"] for line in lines] == ['fake: succeed "a,b"', "fake: succeed b", "fake: fail"] and lines[0]["beta_R"] == "5"
    run(daemon, "results", "a table", "--out", folder / "out.csv")
    assert (folder / "out.csv").read_text().startswith("sample,job,state,verdict")
    assert "a table" in run(daemon, "retry", state.raw["id"][:8])
    assert state_of(daemon, "a table").states["failed"] == 1
    assert re.search(r"3  a table  +2 succeeded, 1 failed", run(daemon, "list"))
    assert json.loads(run(daemon, "show", "a table", "--json"))["name"] == "a table"


def test_a_changed_table(daemon, folder):
    table = folder / "week.csv"
    table.write_text("sample,volume.voxel_size_um\nfake: succeed 1,1\nfake: succeed 2,2\n")
    run(daemon, "submit", folder / "template.json", table)
    state_of(daemon, "week")
    again = run(daemon, "submit", folder / "template.json", table)
    assert "0 new or changed, 2 taken over" in again
    table.write_text("sample,volume.voxel_size_um\nfake: succeed 1,1\nfake: succeed 2,7\nfake: succeed 3,3\n")
    assert "--update makes it like this table" in run(daemon, "submit", folder / "template.json", table, expect=1)
    assert "2 new or changed, 1 taken over, 1 jobs left the batch" in run(daemon, "submit", folder / "template.json", table, "--update")
    assert state_of(daemon, "week").states["succeeded"] == 3
    assert "--keep-jobs or --delete-jobs" in run(daemon, "delete", "week", expect=1)
    run(daemon, "delete", "week", "--delete-jobs")
    assert "there is no batch 'week'" in run(daemon, "show", "week", expect=1)


def test_a_folder_of_samples(daemon, folder):
    template = copy.deepcopy(document())
    template["volume"]["files"], template["measurements"]["file"] = ["*.tif"], "*.csv"
    (folder / "template.json").write_text(json.dumps(template))
    for name in ("fake: succeed x", "fake: succeed y"):
        (folder / "samples" / name).mkdir(parents=True)
        (folder / "samples" / name / f"scan {name[-1]}.tif".replace(" ", "-")).write_bytes(os.urandom(500))
        (folder / "samples" / name / "rows.csv").write_bytes(os.urandom(200))
    assert "2 samples: 2 new" in run(daemon, "submit", folder / "template.json", folder / "samples")
    state = state_of(daemon, "samples")
    assert state.states["succeeded"] == 2
    (job, _) = daemon.get(f"/v1/jobs?batch={state.raw['id']}").json()["jobs"]
    assert daemon.get(f"/v1/jobs/{job['id']}").json()["document"]["volume"]["files"] == ["scan-y.tif"]
    (folder / "samples" / "fake: succeed x" / "job.json").write_text("{}")
    assert "has a job.json of its own" in run(daemon, "submit", folder / "template.json", folder / "samples", expect=1)


@pytest.mark.parametrize("text, words", [
    ("name,x\na,1\n", "no column 'sample'"), ("sample\n", "no row"), ("sample,a\nx\n", "row 1 has 1 cells"), ('sample\n"x\n', "does not end"),
    ("sample,volume.files[3]\nx,y\n", "row 1: the template has no place 'volume.files[3]'"), ("sample,volume.files[0]\nx,none.tif\n", "none.tif"),
    ("sample,volume.colour\nfake: succeed,1\n", "samples[0].volume.colour")])
def test_a_table_at_fault(daemon, folder, text, words):
    (folder / "table.csv").write_text(text)
    assert words in run(daemon, "submit", folder / "template.json", folder / "table.csv", expect=1)


def test_wrong_words(daemon, folder):
    assert "unknown action 'go'" in run(daemon, "go", expect=1)
    assert "needs a template and a table" in run(daemon, "submit", folder / "template.json", expect=1)
    assert "needs the name or the id" in run(daemon, "show", expect=1)
    assert "takes no 'more'" in run(daemon, "show", "x", "more", expect=1)


def test_in_python(daemon, folder):
    client = selvedge.Client(daemon.url)
    batch = client.submit_batch("python", folder / "template.json", folder / "table.csv")
    assert [one["outcome"] for one in batch.submitted["samples"]] == ["new"] * 3
    state = batch.wait(60, 0.1)
    assert state.states["succeeded"] == 2 and state.fraction == 1 and state.failures[0]["sample"] == "fake: fail"
    assert batch.retry().raw["n_changed"] == 1
    batch.wait(60, 0.1)
    assert [row["sample"] for row in batch.results()] == ['fake: succeed "a,b"', "fake: succeed b", "fake: fail"]
    assert batch.results_csv().count("\r\n") == 4
    rows = [{"sample": "fake: succeed b", "replace": {"measurements.file": "other.csv", "/fit/start/C_R.g": 0.25}}, {"sample": "fake: succeed new"}]
    with pytest.raises(selvedge.Problem) as problem:
        client.submit_batch("python", folder / "template.json", rows, folder)
    assert problem.value.code == "exists"
    again = client.submit_batch("python", folder / "template.json", rows, folder, update=True)
    assert again.id == batch.id and [one["outcome"] for one in again.submitted["samples"]] == ["taken_over", "new"]
    again.wait(60, 0.1)
    assert client.batch("python").id == batch.id and batch.id in [one.id for one in client.batches()]
    again.cancel()
    again.delete(jobs=True)
    with pytest.raises(KeyError):
        client.batch("python")


def test_command_line_and_python_send_the_same(daemon, folder):
    """A batch that one has made is taken over by the other."""
    run(daemon, "submit", folder / "template.json", folder / "table.csv", "--name", "same", "--draft")
    batch = selvedge.Client(daemon.url).submit_batch("same", folder / "template.json", folder / "table.csv", start=False)
    assert {one["outcome"] for one in batch.submitted["samples"]} == {"taken_over"} and batch.state().states["draft"] == 3
    batch.delete(jobs=True)
