"""Inputs by SHA-256: bytes that a job of the same owner has are not sent again, and are never shared by others."""
import json
import os
import subprocess
import sys

from daemon_under_test import DOCUMENT, FILES, ROOT, program, sha256

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402

SCAN = b"a scan of silk" * 1000


def input_path(d, job, name):
    return os.path.join(d.data, "jobs", job, "input", name)


def first_job(d, data=SCAN):
    job = d.create()
    d.upload(job, "scan.tif", data)
    return job


def test_a_declaration_of_known_bytes_is_complete(daemon):
    data = SCAN + b"1"
    first = first_job(daemon, data)
    assert daemon.get("/v1/inputs", params={"sha256": sha256(data)}).json() == {
        "sha256": sha256(data), "known": True, "size": len(data), "job": first, "name": "scan.tif"}
    second = daemon.create()
    made = daemon.post(f"/v1/jobs/{second}/files", json={"name": "other.tif", "role": "volume", "size": len(data), "sha256": sha256(data).upper()})
    assert made.status_code == 201 and made.json()["state"] == "complete" and made.json()["upload_url"] is None
    assert daemon.get(f"/v1/jobs/{second}/files/other.tif").content == data
    one, two = os.stat(input_path(daemon, first, "scan.tif")), os.stat(input_path(daemon, second, "other.tif"))
    assert one.st_ino == two.st_ino and one.st_mode & 0o777 == 0o400, "no worker may open it for writing"
    assert os.listdir(os.path.join(daemon.data, "jobs", second, "upload")) == []
    # each job may be changed and deleted without the other
    assert daemon.delete(f"/v1/jobs/{first}").status_code == 204
    assert daemon.get(f"/v1/jobs/{second}/files/other.tif").content == data
    assert daemon.delete(f"/v1/jobs/{second}/files/other.tif").status_code == 204
    assert daemon.get("/v1/inputs", params={"sha256": sha256(data)}).json()["known"] is False


def test_a_list_with_known_and_new_bytes_keeps_its_order(daemon):
    data = SCAN + b"2"
    first_job(daemon, data)
    job = daemon.create()
    files = [("a.tif", b"new a", True), ("b.tif", data, True), ("c.tif", b"new c", False), ("d.tif", data, True)]
    asked = [{"name": n, "role": "volume", "size": len(x), "sha256": sha256(x) if checked else None} for n, x, checked in files]
    states = daemon.post(f"/v1/jobs/{job}/files", json=asked).json()["files"]
    assert [(f["name"], f["state"]) for f in states] == [("a.tif", "uploading"), ("b.tif", "complete"), ("c.tif", "uploading"), ("d.tif", "complete")]
    assert [f["name"] for f in daemon.job(job)["files"]] == [n for n, _, _ in files]
    for (name, x, _), state in zip(files, states):
        if state["state"] == "uploading":
            assert daemon.patch(state["upload_url"], 0, x).status_code == 204
        assert daemon.get(f"/v1/jobs/{job}/files/{name}").content == x


def test_what_differs_or_is_incomplete_is_uploaded(daemon):
    data = SCAN + b"3"
    part = daemon.create()
    daemon.declare(part, "scan.tif", data)
    job = daemon.create()
    assert daemon.declare(job, "scan.tif", data)["state"] == "uploading", "its bytes have not arrived"
    daemon.upload(part, "scan.tif", data)
    for change in ({"size": len(data) - 1}, {"sha256": "0" * 64}, {"sha256": None}):
        ask = {"name": "x.tif", "role": "volume", "size": len(data), "sha256": sha256(data), **change}
        made = daemon.post(f"/v1/jobs/{job}/files", json=ask)
        assert made.json()["state"] == "uploading", change
        assert daemon.delete(f"/v1/jobs/{job}/files/x.tif").status_code == 204


def test_bytes_that_were_lost_are_uploaded(daemon):
    data = SCAN + b"4"
    first = first_job(daemon, data)
    os.truncate(input_path(daemon, first, "scan.tif"), 10)
    assert daemon.declare(daemon.create(), "scan.tif", data)["state"] == "uploading"
    os.remove(input_path(daemon, first, "scan.tif"))
    assert daemon.declare(daemon.create(), "scan.tif", data)["state"] == "uploading"


def test_an_input_that_a_worker_replaced_is_not_shared(daemon):
    """Of the same size, with mode 0400 or 0600; and one that is written over under its name."""
    for i, mode in enumerate((0o400, 0o600)):
        data = SCAN + b"6%d" % i
        job = daemon.create(DOCUMENT)
        for name, (role, other) in FILES.items():
            daemon.upload(job, name, data if name == "scan.tif" else other, role)
        path = input_path(daemon, job, "scan.tif")
        assert os.stat(path).st_mode & 0o777 == 0o400, "complete inputs are never written"
        assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
        daemon.wait_state(job, "succeeded")
        assert daemon.get("/v1/inputs", params={"sha256": sha256(data)}).json()["known"] is True
        with open(path + ".new", "wb") as f:
            f.write(data[::-1])
        os.chmod(path + ".new", mode)
        os.rename(path + ".new", path)
        assert daemon.get("/v1/inputs", params={"sha256": sha256(data)}).json()["known"] is False
        other = daemon.create()
        assert daemon.declare(other, "scan.tif", data)["state"] == "uploading"
        daemon.upload(other, "scan.tif", data)
        assert daemon.get(f"/v1/jobs/{other}/files/scan.tif").content == data


def test_what_a_killed_daemon_left_of_a_link_does_not_matter(daemon):
    data = SCAN + b"5"
    first_job(daemon, data)
    job = daemon.create()
    with open(input_path(daemon, job, "scan.tif"), "wb") as f:
        f.write(b"something else")
    assert daemon.declare(job, "scan.tif", data)["state"] == "complete"
    assert daemon.get(f"/v1/jobs/{job}/files/scan.tif").content == data


def test_inputs_of_another_owner_stay_unknown(daemon_maker):
    d = daemon_maker()
    admin = d.of(d.make_token("root"))
    tokens = {n: admin.post("/v1/tokens", json={"name": n, "scope": "submit"}).json()["token"] for n in ("ann", "bob")}
    ann, bob = d.of(tokens["ann"]), d.of(tokens["bob"])
    first_job(ann)
    ask = {"sha256": sha256(SCAN)}
    assert ann.get("/v1/inputs", params=ask).json()["known"] is True
    nothing = bob.get("/v1/inputs", params=ask)
    assert nothing.json() == {**ask, "known": False, "size": None, "job": None, "name": None}
    assert bob.declare(bob.create(), "scan.tif", SCAN)["state"] == "uploading"
    # an admin who declares it in a job of bob does not give him the bytes of ann
    job = bob.create()
    assert admin.declare(job, "scan.tif", SCAN)["state"] == "uploading"


def test_a_quota_counts_shared_bytes(daemon_maker):
    d = daemon_maker()
    admin = d.of(d.make_token("root"))
    token = admin.post("/v1/tokens", json={"name": "ann", "scope": "submit", "stored_bytes": len(SCAN) * 3 // 2}).json()["token"]
    ann = d.of(token)
    first_job(ann)
    r = ann.post(f"/v1/jobs/{ann.create()}/files", json={"name": "scan.tif", "role": "volume", "size": len(SCAN), "sha256": sha256(SCAN)})
    assert r.status_code == 507 and r.json()["code"] == "quota"


def test_bad_questions(daemon):
    for bad in ("", "x" * 64, "0" * 63, "0" * 65, "A" * 64):
        r = daemon.get("/v1/inputs", params={"sha256": bad})
        assert r.status_code == 422 and r.json()["field"] == "sha256"
    assert daemon.get("/v1/inputs").status_code == 422


def test_a_job_with_shared_inputs_survives_kills(daemon_maker):
    d = daemon_maker()
    jobs = [d.ready_job()]
    for _ in range(5):
        jobs.append(d.ready_job())
        d.kill()
        d.start()
        for job in jobs:
            for name, (_, data) in FILES.items():
                assert d.get(f"/v1/jobs/{job}/files/{name}").content == data
    assert d.post(f"/v1/jobs/{jobs[-1]}/start").status_code == 202
    d.wait_state(jobs[-1], "succeeded")


def test_clients_say_that_nothing_was_sent(daemon, tmp_path):
    for name, (_, data) in FILES.items():
        (tmp_path / name).write_bytes(data + b"clients")
    (tmp_path / "job.json").write_text(json.dumps(DOCUMENT))
    for sent, known in ((2, 0), (0, 2)):
        done = subprocess.run([program("selvedge"), "submit", str(tmp_path / "job.json"), "--server", daemon.url], capture_output=True, text=True,
                              timeout=300, check=False)
        assert done.returncode == 0 and f"{sent} uploaded now, {known} on the server already" in done.stderr, done.stderr
    client = selvedge.Client(daemon.url)
    assert client.has_input(sha256((tmp_path / "scan.tif").read_bytes())) and not client.has_input("0" * 64)
    client.submit(str(tmp_path / "job.json")).wait(timeout_s=30)
