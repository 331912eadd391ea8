"""Verdicts for scripts: filters of the list and of a batch's table, and the counter of the metrics."""
import csv
import io
import os
import re
import subprocess
import time

import pytest
from daemon_under_test import DOCUMENT, FILES, ROOT, problem, program, sha256

WORKER = os.path.join(ROOT, "tests", "support", "python", "client_stub_worker.py")
CODES = {"good": "good", "undetermined": "good_but_undetermined", "pictures": "pictures_only", "bad": "does_not_describe_this_cloth", "plain": "none"}


@pytest.fixture
def batch(daemon_maker):
    """(daemon, id of a batch whose samples end with each verdict)"""
    d = daemon_maker(worker=WORKER)
    upload = d.create()
    for name, (role, data) in FILES.items():
        d.upload(upload, name, data, role)
    files = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, (_, data) in FILES.items()]
    samples = [{"sample": f"{word} twill", "replace": {}, "files": files} for word in CODES]
    made = d.post("/v1/batches", json={"name": "all", "template": DOCUMENT, "samples": samples}).json()
    assert d.post(f"/v1/batches/{made['id']}/start").status_code == 202
    for one in made["samples"]:
        d.wait_state(one["job"], "succeeded")
    return d, made["id"]


def counts(d):
    found = re.findall(r'^selvedge_verdicts_total\{verdict="(\w+)"\} (\d+)$', d.get("/metrics").text, re.M)
    return {code: int(n) for code, n in found}


def test_verdicts_in_lists_tables_and_metrics(batch):
    d, made = batch
    end = time.monotonic() + 30  # a job is counted a moment after its state has changed
    while counts(d) != dict.fromkeys(CODES.values(), 1) and time.monotonic() < end:
        time.sleep(0.05)
    assert counts(d) == dict.fromkeys(CODES.values(), 1)
    path = f"/v1/batches/{made}"
    assert d.get(path).json()["verdicts"] == dict.fromkeys([c for c in CODES.values() if c != "none"], 1)
    for word, code in CODES.items():
        (listed,) = d.get(f"/v1/jobs?batch={made}&verdict={code}").json()["jobs"]
        assert listed["sample"] == f"{word} twill" and (listed["verdict"] or {"code": "none"})["code"] == code
        (row,) = d.get(f"{path}/results.json?verdict={code}").json()["samples"]
        assert row["sample"] == f"{word} twill" and (row["verdict"] or "none") == code
    both = list(csv.DictReader(io.StringIO(d.get(f"{path}/results.csv?verdict=good,pictures_only").text)))
    assert [row["sample"] for row in both] == ["good twill", "pictures twill"]
    assert problem(d.get(f"{path}/results.csv?verdict=best"), 422, "invalid")["field"] == "verdict"
    done = subprocess.run([program("selvedge"), "--server", d.url, "batch", "results", "all", "--verdict", "good_but_undetermined,none"], capture_output=True,
                          text=True, check=True)
    assert [row["sample"] for row in csv.DictReader(io.StringIO(done.stdout))] == ["undetermined twill", "plain twill"]
