"""A job that is edited and run again keeps its earlier results as versions, whatever happens meanwhile."""
import json
import os
import subprocess
import sys

import pytest
from daemon_under_test import ROOT, document, program, wait_until

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402


def run_again(d, job, sample):
    assert d.put(f"/v1/jobs/{job}/document", json=document(sample)).status_code == 200
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return d.wait_state(job, "succeeded")


def versions(d, job):
    return [(v["version"], v["current"]) for v in d.get(f"/v1/jobs/{job}/versions").json()["versions"]]


def test_a_rerun_keeps_the_earlier_result(daemon):
    job = daemon.start_job("succeed", fit={"seed": 9007199254740993})
    first = daemon.wait_state(job, "succeeded")
    listed = {f["path"] for f in daemon.get(f"/v1/jobs/{job}/results").json()["files"]}
    bytes_before = daemon.get(f"/v1/jobs/{job}/results/result.json").content
    assert versions(daemon, job) == [(1, True)]
    # an edit alone takes nothing away
    assert daemon.put(f"/v1/jobs/{job}/document", json=document("succeed again")).status_code == 200
    assert versions(daemon, job) == [(1, False)]
    assert daemon.get(f"/v1/jobs/{job}/versions/1/result.json").content == bytes_before
    assert daemon.put(f"/v1/jobs/{job}/document", json=document("succeed twice")).status_code == 200
    assert daemon.get(f"/v1/jobs/{job}/versions/1").json()["document"] == first["document"], "the document of the run, not that of an edit"
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
    daemon.wait_state(job, "succeeded")
    assert versions(daemon, job) == [(1, False), (2, True)]
    old = daemon.get(f"/v1/jobs/{job}/versions/1").json()
    assert old["document"] == first["document"] and old["document"]["fit"]["seed"] == 9007199254740993
    assert old["finished_unix_s"] <= first["finished_unix_s"] + 1 and old["verdict"] == first["verdict"]
    assert {f["path"] for f in old["files"]} == listed | {"version.json"} and old["bytes"] == sum(f["size"] for f in old["files"])
    for f in old["files"]:
        assert len(daemon.get(f["url"]).content) == f["size"], f["path"]
    assert daemon.get(f"/v1/jobs/{job}/versions/1/result.json").content == bytes_before
    assert daemon.get(f"/v1/jobs/{job}/versions/2").json()["document"]["sample"] == "fake: succeed twice"


def test_what_is_no_version_is_not_found(daemon):
    job = daemon.start_job("succeed")
    daemon.wait_state(job, "succeeded")
    for number in ("0", "2", "01", "-1", "1.0", "x", "1" * 30, "..", "%2e%2e"):
        assert daemon.get(f"/v1/jobs/{job}/versions/{number}").status_code == 404, number
    for path in ("", "nothing.json", "../job.json", "..%2fjob.json", "%2e%2e/status.json"):
        assert daemon.get(f"/v1/jobs/{job}/versions/1/{path}").status_code == 404, path
    draft = daemon.create()
    assert daemon.get(f"/v1/jobs/{draft}/versions").json() == {"versions": []}


def test_a_run_without_a_result_makes_no_version(daemon):
    job = daemon.start_job("fail")
    daemon.wait_state(job, "failed")
    run_again(daemon, job, "succeed")
    assert versions(daemon, job) == [(2, True)]
    # the next run fails: the earlier result is there, and there is no present one
    assert daemon.put(f"/v1/jobs/{job}/document", json=document("fail")).status_code == 200
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
    daemon.wait_state(job, "failed")
    assert versions(daemon, job) == [(2, False)]


def test_an_edit_of_a_file_keeps_the_document(daemon):
    job = daemon.start_job("succeed")
    before = daemon.wait_state(job, "succeeded")["document"]
    assert daemon.delete(f"/v1/jobs/{job}/files/scan.tif").status_code == 204
    daemon.upload(job, "scan.tif", b"other bytes")
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
    daemon.wait_state(job, "succeeded")
    assert daemon.get(f"/v1/jobs/{job}/versions/1").json()["document"] == before


@pytest.mark.parametrize("most", [0, 2])
def test_the_oldest_versions_go(daemon_maker, most):
    d = daemon_maker(options={"jobs.keep_versions": most})
    job = d.start_job("succeed")
    d.wait_state(job, "succeeded")
    for i in range(4):
        run_again(d, job, f"succeed {i}")
    assert versions(d, job) == [(n, n == 5) for n in range(5 - most, 6)]
    folder = os.path.join(d.data, "jobs", job, "versions")
    assert sorted(os.listdir(folder) if os.path.isdir(folder) else []) == [str(n) for n in range(5 - most, 5)]
    assert not os.path.exists(os.path.join(d.data, "jobs", job, "run.json"))


def test_a_damaged_description_spoils_no_list(daemon):
    job = daemon.start_job("succeed")
    daemon.wait_state(job, "succeeded")
    for i in range(2):
        run_again(daemon, job, f"succeed {i}")
    path = os.path.join(daemon.data, "jobs", job, "versions", "1", "version.json")
    for text in ('{"version": 1, "sam', "[]", '{"sample": 7}', ""):
        with open(path, "w", encoding="utf-8") as f:
            f.write(text)
        listed = daemon.get(f"/v1/jobs/{job}/versions").json()["versions"]
        assert [(v["version"], v.get("damaged", False)) for v in listed] == [(1, True), (2, False), (3, False)], text
        one = daemon.get(f"/v1/jobs/{job}/versions/1").json()
        assert one["document"] == {} and one["verdict"] is None and one["damaged"] and len(one["files"]) == one["n_file"] > 1
        assert daemon.get(f"/v1/jobs/{job}/versions/1/result.json").status_code == 200


def test_inputs_of_a_version(daemon):
    """They are those that the worker computed with, also when a file was replaced before the next run."""
    job = daemon.start_job("succeed")
    daemon.wait_state(job, "succeeded")
    inputs = [{"name": "scan.tif", "role": "volume", "size": 4, "sha256": "ab" * 32}]
    with open(os.path.join(daemon.data, "jobs", job, "results", "report.json"), "w", encoding="utf-8") as f:
        json.dump({"inputs": inputs, "document": {}}, f)
    assert daemon.get(f"/v1/jobs/{job}/versions/1").json()["inputs"] == inputs
    assert daemon.delete(f"/v1/jobs/{job}/files/scan.tif").status_code == 204
    daemon.upload(job, "scan.tif", b"other bytes")
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
    daemon.wait_state(job, "succeeded")
    assert daemon.get(f"/v1/jobs/{job}/versions/1").json()["inputs"] == inputs
    assert daemon.get(f"/v1/jobs/{job}/versions/2").json()["inputs"] is None, "a run without a report"


def test_versions_count_as_stored_bytes(daemon_maker):
    d = daemon_maker(options={"jobs.keep_versions": 1})
    admin = d.of(d.make_token("root"))
    ann = d.of(admin.post("/v1/tokens", json={"name": "ann", "scope": "submit"}).json()["token"])

    def used():
        return ann.get("/v1/session").json()["used"]["stored_bytes"]
    job = ann.start_job("succeed")
    ann.wait_state(job, "succeeded")
    inputs = used()
    for i in range(3):  # the second version takes the place of the first
        run_again(ann, job, f"succeed {i}")
        kept = ann.get(f"/v1/jobs/{job}/versions").json()["versions"][0]["bytes"]
        assert kept > 0 and used() == inputs + kept, i
    quota = used() + 10
    bob = d.of(admin.post("/v1/tokens", json={"name": "ann-2", "owner": "ann", "scope": "submit", "stored_bytes": quota}).json()["token"])
    draft = bob.create()
    refused = bob.post(f"/v1/jobs/{draft}/files", json={"name": "rows.csv", "role": "measurements", "size": 20})
    assert refused.status_code == 507 and refused.json()["used"] == used(), refused.text
    assert ann.delete(f"/v1/jobs/{job}").status_code == 204
    assert used() == 0
    assert bob.post(f"/v1/jobs/{draft}/files", json={"name": "rows.csv", "role": "measurements", "size": 20}).status_code == 201


def test_another_owner_sees_no_versions(daemon_maker):
    d = daemon_maker()
    admin = d.of(d.make_token("root"))
    tokens = {n: admin.post("/v1/tokens", json={"name": n, "scope": "submit"}).json()["token"] for n in ("ann", "bob")}
    ann, bob = d.of(tokens["ann"]), d.of(tokens["bob"])
    job = ann.start_job("succeed")
    ann.wait_state(job, "succeeded")
    for path in ("", "/1", "/1/result.json"):
        assert bob.get(f"/v1/jobs/{job}/versions{path}").status_code == 404
        assert ann.get(f"/v1/jobs/{job}/versions{path}").status_code == 200


def test_numbers_that_are_taken_are_not_taken_again(daemon_maker):
    """As after the database came back from a backup that is older than the folders."""
    d = daemon_maker()
    job = d.start_job("succeed")
    d.wait_state(job, "succeeded")
    os.makedirs(os.path.join(d.data, "jobs", job, "versions", "7"))
    for name, text in (("result.json", "{}"), ("version.json", '{"sample":"","started_unix_s":null,"finished_unix_s":1.0,"verdict":null,"document":{}}')):
        with open(os.path.join(d.data, "jobs", job, "versions", "7", name), "w") as f:
            f.write(text)
    run_again(d, job, "succeed 2")
    assert versions(d, job) == [(7, False), (8, False), (9, True)]
    assert d.get(f"/v1/jobs/{job}/versions/8").json()["document"]["sample"] == "fake: succeed"


def cli(d, *arguments):
    return subprocess.run([program("selvedge"), *arguments, "--server", d.url], capture_output=True, text=True, timeout=300, check=False)


def test_clients(daemon, tmp_path):
    job = daemon.start_job("succeed")
    daemon.wait_state(job, "succeeded")
    run_again(daemon, job, "succeed 2")
    shown = cli(daemon, "versions", job[:12])
    assert shown.returncode == 0 and [line.split()[0] for line in shown.stdout.splitlines()] == ["version", "1", "2"], shown
    assert "present" in shown.stdout.splitlines()[2]
    got = cli(daemon, "versions", job, "1", "--out", str(tmp_path / "old"))
    assert got.returncode == 0 and (tmp_path / "old" / "result.json").read_bytes() == daemon.get(f"/v1/jobs/{job}/versions/1/result.json").content
    missing = cli(daemon, "versions", job, "3")
    assert missing.returncode == 1 and "version 3" in missing.stderr
    wrong = cli(daemon, "versions", job, "../1")
    assert wrong.returncode == 1 and "whole number" in wrong.stderr
    known = selvedge.Client(daemon.url).job(job)
    assert [(v.version, v.current) for v in known.versions()] == [(1, False), (2, True)]
    assert known.version_document(1)["sample"] == "fake: succeed" and known.version_result(1).raw


def test_kills_around_the_start_of_a_rerun(daemon_maker):
    """kill -9 at any moment of edit, start and run: the earlier result and what was acknowledged stay."""
    d = daemon_maker()
    job = d.start_job("succeed")
    d.wait_state(job, "succeeded")
    results = {1: d.get(f"/v1/jobs/{job}/results/result.json").content}
    for k in range(12):
        assert d.put(f"/v1/jobs/{job}/document", json=document(f"succeed {k}")).status_code == 200
        assert d.post(f"/v1/jobs/{job}/start").status_code == 202
        if k % 2:
            wait_until(lambda: d.job(job)["state"] != "queued")
        d.kill()
        d.start()
        d.wait_state(job, "succeeded")
        known = [v["version"] for v in d.get(f"/v1/jobs/{job}/versions").json()["versions"]]
        present = d.job(job)["generation"]
        assert present == known[-1] and known == list(range(max(1, present - 5), present + 1)), k
        for n in known[:-1]:
            assert d.get(f"/v1/jobs/{job}/versions/{n}/result.json").content == results[n]
        results[present] = d.get(f"/v1/jobs/{job}/results/result.json").content
        assert d.get(f"/v1/jobs/{job}/versions/{present}").json()["document"]["sample"] == f"fake: succeed {k}"
