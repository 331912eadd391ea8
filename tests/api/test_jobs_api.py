"""Creating, editing, listing, starting, cancelling and deleting jobs."""
import contextlib
import json
import os
import socket
import sqlite3

import pytest
from daemon_under_test import BUILD, DOCUMENT, FILES, document, problem, wait_until


def test_create_answers_with_the_job(daemon):
    r = daemon.post("/v1/jobs", json=DOCUMENT)
    assert r.status_code == 201
    job = r.json()
    assert r.headers["Location"] == f"/v1/jobs/{job['id']}"
    assert job["state"] == "draft" and job["document"] == DOCUMENT and job["fraction"] == 0
    assert job["missing_files"] == ["scan.tif", "rows.csv"] and job["files"] == []
    assert job["result_url"] is None and job["error"] is None
    assert daemon.get(f"/v1/jobs/{job['id']}").json() == job


@pytest.mark.parametrize("change, field", [
    ({"sample": ""}, "sample"),
    ({"sampel": "x"}, "sampel"),
    ({"volume": {"files": ["../../etc/passwd"], "voxel_size_um": 2}}, "volume.files[0]"),
    ({"volume": {"files": ["scan.tif"], "voxel_size_um": -1}}, "volume.voxel_size_um"),
    ({"fit": {"model": "no_such_model.v1"}}, "fit.model"),
    ({"fit": {"method": "no_such_method.v1"}}, "fit.method"),
    ({"fit": {"fixed": {"beta_Q": 1}}}, "fit.fixed.beta_Q"),
])
def test_document_errors_name_the_field(daemon, change, field):
    problem(daemon.post("/v1/jobs", json={**DOCUMENT, **change}), 422, "invalid", field)


@pytest.mark.parametrize("body", ["", "{", "nonsense", '{"sample":"a","sample":"b"}', "[" * 30, '{"sample":"\xff"}'.encode("latin-1")])
def test_malformed_json_is_400(daemon, body):
    problem(daemon.post("/v1/jobs", data=body, headers={"Content-Type": "application/json"}), 400, "malformed")


@pytest.mark.parametrize("body", ["[]", "3", '"x"', "{}", "null"])
def test_json_that_is_no_document_is_422(daemon, body):
    r = daemon.post("/v1/jobs", data=body, headers={"Content-Type": "application/json"})
    assert r.status_code in (400, 422) and r.json()["code"] in ("malformed", "invalid")


def test_content_type_length_and_size(daemon):
    text = json.dumps(DOCUMENT)
    problem(daemon.post("/v1/jobs", data=text, headers={"Content-Type": "text/plain"}), 415, "content_type")
    problem(daemon.post("/v1/jobs", data=text), 415, "content_type")
    problem(daemon.post("/v1/jobs", data=b"{" + b" " * (1 << 20), headers={"Content-Type": "application/json"}), 413, "too_large")
    assert daemon.post("/v1/jobs", data=text, headers={"Content-Type": "application/json; charset=utf-8"}).status_code == 201


def test_idempotency_key(daemon):
    first = daemon.post("/v1/jobs", json=DOCUMENT, headers={"Idempotency-Key": "k1"})
    again = daemon.post("/v1/jobs", json=DOCUMENT, headers={"Idempotency-Key": "k1"})
    assert first.status_code == again.status_code == 201
    assert first.json()["id"] == again.json()["id"]
    assert "Idempotent-Replay" not in first.headers and again.headers["Idempotent-Replay"] == "true"
    problem(daemon.post("/v1/jobs", json=document("other"), headers={"Idempotency-Key": "k1"}), 422, "idempotency_key_reused")
    assert daemon.post("/v1/jobs", json=DOCUMENT, headers={"Idempotency-Key": "k" * 128}).status_code == 201
    problem(daemon.post("/v1/jobs", json=DOCUMENT, headers={"Idempotency-Key": "k" * 129}), 422, "invalid", "Idempotency-Key")
    daemon.delete(f"/v1/jobs/{first.json()['id']}")
    wait_until(lambda: daemon.post("/v1/jobs", json=DOCUMENT, headers={"Idempotency-Key": "k1"}).json().get("id")
               not in (None, first.json()["id"]), what="a fresh job under the key of a deleted one")


def test_etag_and_304(daemon):
    job = daemon.create()
    r = daemon.get(f"/v1/jobs/{job}")
    tag = r.headers["ETag"]
    same = daemon.get(f"/v1/jobs/{job}", headers={"If-None-Match": tag})
    assert same.status_code == 304 and same.headers["ETag"] == tag and same.content == b""
    assert daemon.get(f"/v1/jobs/{job}", headers={"If-None-Match": f'"other", {tag}'}).status_code == 304
    daemon.upload(job, "scan.tif", b"x")
    changed = daemon.get(f"/v1/jobs/{job}", headers={"If-None-Match": tag})
    assert changed.status_code == 200 and changed.headers["ETag"] != tag
    listing = daemon.get("/v1/jobs")
    assert daemon.get("/v1/jobs", headers={"If-None-Match": listing.headers["ETag"]}).status_code == 304


def test_replace_document(daemon):
    job = daemon.create()
    tag = daemon.get(f"/v1/jobs/{job}").headers["ETag"]
    r = daemon.put(f"/v1/jobs/{job}/document", json=document("edited"), headers={"If-Match": tag})
    assert r.status_code == 200 and r.json()["sample"] == "fake: edited"
    problem(daemon.put(f"/v1/jobs/{job}/document", json=document("again"), headers={"If-Match": tag}), 412, "precondition")
    problem(daemon.put(f"/v1/jobs/{job}/document", json={**DOCUMENT, "extra": 1}), 422, "invalid", "extra")
    assert daemon.job(job)["sample"] == "fake: edited"


def test_one_of_two_editors_with_the_same_tag_wins(daemon):
    """If-Match prevents that one editor's change silently replaces another's, however close in time the two are."""
    job, n = daemon.create(), 8
    host = daemon.url.split("//")[1]
    address = (host.split(":")[0], int(host.split(":")[1]))
    for k in range(150):
        tag, sockets = daemon.get(f"/v1/jobs/{job}").headers["ETag"], []
        for i in range(n):
            body = json.dumps(document(f"{k}-{i}"))
            s = socket.create_connection(address, timeout=300)
            s.sendall((f"PUT /v1/jobs/{job}/document HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nIf-Match: {tag}\r\n"
                       f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n{body[:-1]}").encode())
            sockets.append(s)
        for s in sockets:  # the last bytes of both requests at the same moment
            s.sendall(b"}")
        codes = [s.recv(4096).split()[1] for s in sockets]
        for s in sockets:
            s.close()
        assert sorted(codes) == [b"200"] + [b"412"] * (n - 1), (k, codes)


def test_listing_pages_and_filters(daemon_maker):
    d = daemon_maker()
    made = [d.create(document(f"n{i}")) for i in range(7)]
    seen, cursor = [], ""
    while True:
        page = d.get(f"/v1/jobs?limit=3{cursor}").json()
        assert len(page["jobs"]) <= 3
        seen += [j["id"] for j in page["jobs"]]
        if page["next_cursor"] is None:
            break
        cursor = "&cursor=" + page["next_cursor"]
    assert seen == made[::-1]
    assert "document" not in page["jobs"][0]
    assert d.get("/v1/jobs?limit=7").json()["next_cursor"] is None
    assert d.get("/v1/jobs?state=running").json()["jobs"] == []
    assert len(d.get("/v1/jobs?state=draft").json()["jobs"]) == 7
    problem(d.get("/v1/jobs?state=asleep"), 422, "invalid", "state")
    for bad in ["limit=0", "limit=501", "limit=x", "limit=", "cursor=-1", "cursor=abc", "limit=99999999999999999999"]:
        problem(d.get(f"/v1/jobs?{bad}"), 422, "invalid", bad.split("=")[0])


def test_unknown_jobs_and_addresses(daemon):
    for job in ["0" * 36, "00000000-0000-0000-0000-000000000000", "..", "%2e%2e", "x", "a" * 500]:
        problem(daemon.get(f"/v1/jobs/{job}"), 404, "not_found")
    for path in ["/v1", "/v1/nothing", "/v1/jobs/", "/v2/jobs", "/v1/jobs%00", "/v1/jobs/%00"]:
        problem(daemon.get(path), 404, "not_found")
    for act in ["start", "cancel", "retry"]:
        problem(daemon.post(f"/v1/jobs/00000000-0000-0000-0000-000000000000/{act}"), 404, "not_found")
    r = daemon.request("PATCH", "/v1/jobs")
    problem(r, 405, "method")
    assert r.headers["Allow"] == "GET, POST"


def test_start_needs_files(daemon):
    job = daemon.create()
    body = problem(daemon.post(f"/v1/jobs/{job}/start"), 409, "files_missing")
    assert body["missing_files"] == ["scan.tif", "rows.csv"]
    daemon.upload(job, "scan.tif", b"x")
    assert problem(daemon.post(f"/v1/jobs/{job}/start"), 409, "files_missing")["missing_files"] == ["rows.csv"]
    assert daemon.job(job)["state"] == "draft"


def test_run_to_success(daemon):
    job = daemon.start_job("succeed")
    done = daemon.wait_state(job, "succeeded")
    assert done["fraction"] == 1 and done["attempt"] == 1 and done["lost_attempts"] == 0 and done["generation"] == 1
    assert done["parameters"] == [{"name": "beta_R", "value": 5.0, "standard_error": 0.1}]
    assert done["result"]["objective"] == 0.01 and done["warnings"] == ["a warning"] and done["error"] is None
    assert done["started_unix_s"] <= done["finished_unix_s"] and done["peak_rss_bytes"] > 0
    for _ in range(2):
        assert daemon.post(f"/v1/jobs/{job}/start").status_code == 200
    assert daemon.post(f"/v1/jobs/{job}/cancel").status_code == 200
    problem(daemon.post(f"/v1/jobs/{job}/retry"), 409, "conflict")
    assert daemon.job(job)["state"] == "succeeded"


def test_failed_job_is_edited_and_started_again(daemon):
    job = daemon.start_job("fail")
    failed = daemon.wait_state(job, "failed")
    assert failed["error"] == {"code": "format", "field": "volume.files", "text": "cannot read volume 'scan.tif': page 2 is cut off"}
    assert daemon.post(f"/v1/jobs/{job}/retry").status_code == 202
    failed = daemon.wait_state(job, "failed")
    assert failed["attempt"] == 2 and failed["generation"] == 1
    # the user replaces one file: the others stay, and the next start discards earlier progress
    problem(daemon.post(f"/v1/jobs/{job}/files", json={"name": "scan.tif", "role": "volume", "size": 3}), 409, "exists", "name")
    assert daemon.delete(f"/v1/jobs/{job}/files/scan.tif").status_code == 204
    assert daemon.job(job)["state"] == "draft" and daemon.job(job)["missing_files"] == ["scan.tif"]
    daemon.upload(job, "scan.tif", b"better")
    assert daemon.put(f"/v1/jobs/{job}/document", json=document("succeed")).status_code == 200
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
    done = daemon.wait_state(job, "succeeded")
    assert done["generation"] == 2 and done["result"]["run"] == 1, "the folder of the old input was not cleared"


def test_a_running_job_cannot_be_edited(daemon):
    job = daemon.start_job("work")
    daemon.wait_state(job, "running")
    problem(daemon.put(f"/v1/jobs/{job}/document", json=DOCUMENT), 409, "conflict")
    problem(daemon.delete(f"/v1/jobs/{job}/files/scan.tif"), 409, "conflict")
    problem(daemon.post(f"/v1/jobs/{job}/files", json={"name": "more.tif", "role": "volume", "size": 3}), 409, "conflict")
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 200
    running = wait_until(lambda: (lambda j: j if j["fraction"] == 0.5 else None)(daemon.job(job)))
    assert running["stage"] == "fit" and running["eta_s"] == 5 and 0 <= running["heartbeat_age_s"] < 5
    r = daemon.post(f"/v1/jobs/{job}/cancel")
    assert r.status_code == 202
    assert daemon.wait_state(job, "cancelled")["cancel_requested"] is False
    assert daemon.post(f"/v1/jobs/{job}/cancel").status_code == 200


def test_cancel_of_waiting_jobs_and_queue_order(daemon):
    first = daemon.start_job("work")
    daemon.wait_state(first, "running")
    second, third = daemon.start_job("succeed"), daemon.start_job("succeed")
    assert daemon.job(second)["state"] == "queued"
    assert daemon.post(f"/v1/jobs/{second}/cancel").status_code == 200
    assert daemon.job(second)["state"] == "cancelled"
    daemon.post(f"/v1/jobs/{first}/cancel")
    daemon.wait_state(third, "succeeded")
    assert daemon.job(second)["attempt"] == 0


def test_delete(daemon):
    import os
    job, running = daemon.ready_job(), daemon.start_job("ignore_term")
    daemon.wait_state(running, "running")
    for j in (job, running):
        assert daemon.delete(f"/v1/jobs/{j}").status_code == 204
        problem(daemon.get(f"/v1/jobs/{j}"), 404, "not_found")
        problem(daemon.delete(f"/v1/jobs/{j}"), 404, "not_found")
        wait_until(lambda: not os.path.exists(os.path.join(daemon.data, "jobs", j)), what="removal of the folder")
    assert job not in daemon.get("/v1/jobs?limit=500").text


def test_too_many_jobs(daemon_maker):
    d = daemon_maker(options={"jobs.max_jobs": 2, "upload.max_files_per_job": 1})
    job = d.create()
    d.create()
    problem(d.post("/v1/jobs", json=DOCUMENT), 429, "too_many")
    d.declare(job, "a.tif", b"x")
    problem(d.post(f"/v1/jobs/{job}/files", json={"name": "b.tif", "role": "volume", "size": 1}), 429, "too_many")
    d.delete(f"/v1/jobs/{job}")
    assert wait_until(lambda: d.post("/v1/jobs", json=DOCUMENT).status_code == 201)


def test_restart_keeps_everything(daemon_maker):
    d = daemon_maker()
    job, draft = d.start_job("series 30"), d.create()
    before = d.wait_state(job, "succeeded")
    half = d.declare(draft, "scan.tif", b"0123456789")["upload_url"]
    assert d.patch(half, 0, b"01234").status_code == 204
    series = d.get(f"/v1/jobs/{job}/series").json()
    d.stop()
    d.start()
    assert d.job(job) == before
    assert d.get(f"/v1/jobs/{job}/series").json() == series
    assert d.get(f"/v1/jobs/{job}/files/scan.tif").content == FILES["scan.tif"][1]
    assert d.offset(half) == 5
    assert d.patch(half, 5, b"56789").status_code == 204
    assert d.get(f"/v1/jobs/{draft}/files/scan.tif").content == b"0123456789"


def test_a_stored_document_that_is_refused_today_can_still_be_read(daemon_maker):
    d = daemon_maker()
    done, draft = d.start_job(), d.create()
    d.wait_state(done, "succeeded")
    d.stop()
    old = {**DOCUMENT, "fit": {"fixed": {"beta_Q": 1}}}
    with sqlite3.connect(os.path.join(d.data, "selvedge.db")) as db:
        assert db.execute("UPDATE document SET text = ?", [json.dumps(old)]).rowcount == 2
    db.close()
    d.start()
    for job in (done, draft):
        seen = d.job(job)
        assert seen["document"] == old and seen["missing_files"] == []
        files = d.get(f"/v1/jobs/{job}/files")
        assert files.status_code == 200 and files.json()["missing_files"] == []
    assert seen["state"] == "draft" and d.job(done)["result"]["run"] == 1
    problem(d.post(f"/v1/jobs/{draft}/start"), 422, "invalid", "fit.fixed.beta_Q")
    problem(d.put(f"/v1/jobs/{draft}/document", json=old), 422, "invalid", "fit.fixed.beta_Q")
    # the tag of such a job can be used for the edit that corrects it
    tag = d.get(f"/v1/jobs/{draft}").headers["ETag"]
    assert d.put(f"/v1/jobs/{draft}/document", json=DOCUMENT, headers={"If-Match": tag}).status_code == 200
    assert d.job(draft)["missing_files"] == ["scan.tif", "rows.csv"]


def test_a_daemon_that_cannot_announce_itself_runs(daemon_maker):
    d = daemon_maker()
    d.stop()
    os.remove(os.path.join(d.data, "daemon.json"))
    os.mkdir(os.path.join(d.data, "daemon.json"))
    d.start()
    assert d.get("/livez").status_code == 200 and "daemon.json" in d.log_text()


@pytest.mark.skipif("asan" in BUILD or "tsan" in BUILD, reason="the sanitizer keeps what was freed")
def test_lists_and_the_start_do_without_documents(daemon_maker):
    """Documents may have a megabyte each. Lists of jobs do not read them, and updates of such rows leave them
    unchanged."""
    d = daemon_maker()
    running, jobs = d.start_job("work_once"), [d.create() for _ in range(60)]
    d.wait_state(running, "running")
    d.kill()
    with contextlib.closing(sqlite3.connect(os.path.join(d.data, "selvedge.db"))) as db, db:
        db.execute("UPDATE document SET text = text || ?", [" " * 1_000_000])
    d.start()
    assert len(d.get("/v1/jobs?limit=500").json()["jobs"]) == 61
    d.wait_state(running, "succeeded")
    with open(f"/proc/{d.process.pid}/status") as f:
        peak_kib = next(int(line.split()[1]) for line in f if line.startswith("VmHWM"))
    assert d.wrapper or peak_kib < 45_000
    with contextlib.closing(sqlite3.connect(os.path.join(d.data, "selvedge.db"))) as db:
        assert {n for n, in db.execute("SELECT length(text) > 1000000 FROM document")} == {1}
    assert d.job(jobs[0])["document"] == DOCUMENT
