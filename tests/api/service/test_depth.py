"""Depth: what clients and workers nest a thousand times is refused with a sentence, or is removed like anything else."""
import json
import os

import pytest
from daemon_under_test import DOCUMENT, document, problem, wait_until

DEEP = 7000


@pytest.mark.parametrize("path", [".".join(["a"] * DEEP), "/" + "/".join(["a"] * DEEP), "volume" + "[0]" * DEEP, "volume." + ".".join(["a"] * 33)])
def test_a_long_path_in_a_batch_is_refused(daemon, path):
    table = {"name": "deep", "template": document(), "samples": [{"sample": "fake: succeed", "replace": {path: "x"}}]}
    body = problem(daemon.post("/v1/batches", json=table), 422, "invalid")
    assert "has more than 32 names" in body["detail"] and body["field"].startswith("samples[0].replace.")
    assert daemon.get("/livez").ok and daemon.get("/v1/batches").json()["batches"] == []


@pytest.mark.parametrize("depth", [33, 2000, 400_000])
@pytest.mark.parametrize("kind", ["[]", "{}"])
@pytest.mark.parametrize("path", ["/v1/jobs", "/v1/batches", "/v1/session"])
def test_a_deep_body_is_refused(daemon, path, kind, depth):
    text = "[" * depth + "]" * depth if kind == "[]" else '{"a":' * (depth - 1) + "{}" + "}" * (depth - 1)
    reply = daemon.post(path, data=text[:1 << 20], headers={"Content-Type": "application/json"})
    assert "more than 32 levels" in problem(reply, 422, "invalid")["detail"]


def test_a_value_that_makes_a_document_too_deep_is_refused(daemon):
    value = json.loads("[" * 25 + "]" * 25)
    table = {"name": "sum", "template": document(), "samples": [{"sample": "fake: succeed", "replace": {".".join(["a"] * 20): value}}]}
    assert "more than 32 levels" in problem(daemon.post("/v1/batches", json=table), 422, "invalid", "samples[0]")["detail"]


def test_a_check_of_a_deep_document_tells_it(daemon):
    reply = daemon.post("/v1/check", data="[" * 2000 + "]" * 2000, headers={"Content-Type": "application/json"})
    assert "more than 32 levels" in reply.text and reply.status_code in (200, 422)


def test_what_documents_need_is_accepted(daemon):
    assert daemon.post("/v1/jobs", json=DOCUMENT).status_code == 201
    problem(daemon.post("/v1/jobs", json=dict(DOCUMENT, colour=json.loads("[" * 31 + "]" * 31))), 422, "invalid", "colour")


@pytest.mark.parametrize("end", ["delete", "again"])
def test_a_worker_that_nests_3000_folders(daemon_maker, end):
    d = daemon_maker(options={"jobs.folder_depth": 0})  # no limit, so that all of them are made
    job = d.start_job("nest 3000")
    d.wait_state(job, "succeeded", timeout_s=120)
    listed = {f["path"] for f in d.get(f"/v1/jobs/{job}/results").json()["files"]}
    assert "result.json" in listed and all(path.count("/") < 16 for path in listed)
    assert d.get(f"/v1/jobs/{job}/results.tar").status_code == 200
    if end == "again":  # an edit removes what the earlier attempt has left
        assert d.put(f"/v1/jobs/{job}/document", json=document("succeed")).status_code == 200
        assert d.post(f"/v1/jobs/{job}/start").status_code == 202
        d.wait_state(job, "succeeded", timeout_s=120)
    assert d.delete(f"/v1/jobs/{job}").status_code == 204
    wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")) == [], timeout_s=120, what="the removal of the job's folder")
    assert "could not be removed" not in d.log_text()
