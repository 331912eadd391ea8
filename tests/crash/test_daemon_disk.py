"""A full disk, write errors and short writes: error messages are clear, offsets stay valid, nothing is lost, and work
continues when there is space again."""
import concurrent.futures
import errno
import itertools
import os
import shutil

import pytest
from daemon_under_test import FILES, TUS, Daemon, document, problem, sha256, wait_until
from servers.small_disk import fill, kept_full

AT_ONCE = 6  # runs of the same test


def declare(d, job, name, size):
    return d.post(f"/v1/jobs/{job}/files", json={"name": name, "role": "volume", "size": size})


def test_full_disk_is_refused_at_the_declaration(small_disk, tmp_path):
    with Daemon(small_disk / "data", options={"disk.ballast_bytes": 1 << 20}) as d:
        job = d.ready_job("succeed")
        # the space of a first large file is reserved, whatever happens later
        first = declare(d, job, "first.tif", 6 << 20).json()["upload_url"]
        problem(declare(d, job, "second.tif", 12 << 20), 507, "disk_full")
        assert [f["name"] for f in d.job(job)["files"]] == [*FILES, "first.tif"]
        filler = open(small_disk / "filler", "wb")
        with pytest.raises(OSError):
            while True:
                filler.write(b"x" * 65536)
                filler.flush()
        filler.close()
        problem(declare(d, job, "third.tif", 1 << 20), 507, "disk_full")
        # the database cannot grow either: the reply is success or that error, but never a false success
        r = d.patch(first, 0, b"y" * (3 << 20))
        assert r.status_code in (204, 507), r.text
        offset = d.request("HEAD", first, headers=TUS)
        os.remove(small_disk / "filler")
        offset = int(offset.headers["Upload-Offset"]) if offset.ok else d.offset(first)
        assert r.status_code == 507 or offset == 3 << 20
        assert d.patch(first, offset, b"y" * ((6 << 20) - offset)).status_code == 204
        assert d.get(f"/v1/jobs/{job}/files/first.tif").content == b"y" * (6 << 20)
        assert d.delete(f"/v1/jobs/{job}/files/first.tif").status_code == 204
        assert d.post(f"/v1/jobs/{job}/start").status_code == 202
        d.wait_state(job, "succeeded")


def test_delete_works_on_a_full_disk(small_disk):
    with Daemon(small_disk / "data", options={"disk.ballast_bytes": 1 << 20}) as d:
        job = d.ready_job()
        d.upload(job, "more.tif", b"z" * (2 << 20))
        fill(small_disk)
        r = d.delete(f"/v1/jobs/{job}")
        assert r.status_code == 204, r.text
        wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")) == [])
        assert d.post("/v1/jobs", json=document("succeed")).status_code == 201


def test_a_daemon_that_starts_on_a_full_disk_can_delete(small_disk):
    d = Daemon(small_disk / "data", options={"disk.ballast_bytes": 1 << 20}).start()
    job, other = d.ready_job(), d.start_job("work")
    wait_until(lambda: d.job(other)["fraction"] == 0.5 and os.path.exists(os.path.join(d.data, "ballast")))
    d.kill()
    fill(small_disk)
    with d:
        assert d.job(job)["state"] == "draft" and d.job(other)["state"] in ("queued", "running", "failed")
        for j in (job, other):
            assert d.delete(f"/v1/jobs/{j}").status_code == 204
        wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")) == [])
        assert d.post("/v1/jobs", json=document("succeed")).status_code == 201


def test_a_daemon_with_drafts_only_starts_on_a_full_disk(small_disk):
    """It changes no job at its start, so another step is the first that needs room."""
    d = Daemon(small_disk / "data", options={"disk.ballast_bytes": 1 << 20}).start()
    job = d.ready_job()
    wait_until(lambda: os.path.exists(os.path.join(d.data, "ballast")))
    d.kill()
    fill(small_disk)
    with d:
        assert d.delete(f"/v1/jobs/{job}").status_code == 204
        wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")) == [])


def everything(d):
    """18 things that can be deleted: jobs of several kinds, files, a batch, a token. Returns (method, path) each."""
    jobs = [d.ready_job() for _ in range(6)] + [d.start_job("succeed") for _ in range(6)]
    for job in jobs[6:]:
        d.wait_state(job, "succeeded")
    known = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, (_, data) in FILES.items()]
    batch = d.post("/v1/batches", json={"name": "a", "template": document(), "samples": [{"sample": f"s{i}", "replace": {}, "files": known} for i in range(3)]})
    assert batch.status_code in (200, 201), batch.text
    token = d.make_token("root")
    d.session.headers["Authorization"] = f"Bearer {token}"
    other = d.post("/v1/tokens", json={"name": "other", "scope": "read"})
    assert other.status_code == 201, other.text
    return [f"/v1/jobs/{job}/files/scan.tif" for job in jobs[:4]] + [f"/v1/jobs/{job}" for job in jobs] + [
        f"/v1/batches/{batch.json()['id']}?jobs=delete", f"/v1/tokens/{other.json()['id']}"]


def test_every_deletion_succeeds_while_the_disk_stays_full(small_disk):
    """Another program takes what becomes free at once."""
    with Daemon(small_disk / "data", options={"disk.ballast_bytes": 1 << 20}) as d:
        paths = everything(d)
        assert len(paths) == 18
        with kept_full(small_disk):
            replies = {path: d.delete(path) for path in paths}
        assert {path: r.status_code for path, r in replies.items() if r.status_code != 204} == {}
        wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")) == [])


def test_a_completely_full_disk_refuses_no_start(small_disk, tmp_path):
    """With the settings as they are: started and stopped again and again on a disk that is filled each time, and asked
    for deletions meanwhile. The disk has no room for the whole ballast file."""
    os.mkdir(small_disk / "data", 0o700)
    os.symlink(small_disk / "data", tmp_path / "link")  # so that the log is on another disk
    with Daemon(tmp_path / "link") as d:
        paths = everything(d)
        for i in range(6):
            d.kill() if i % 3 == 2 else d.stop()
            fill(small_disk, name=f"filler{i}")
            headers = dict(d.session.headers)
            d.start()
            d.session.headers.update(headers)
            for path in paths[3 * i:3 * i + 3]:
                r = d.delete(path)
                assert r.status_code == 204, (i, path, r.text)


def test_a_full_disk_refuses_no_start_without_a_ballast_setting(small_disk, tmp_path):
    """The least ballast is kept with `disk.ballast_bytes = 0`, too."""
    os.mkdir(small_disk / "data", 0o700)
    os.symlink(small_disk / "data", tmp_path / "link")
    with Daemon(tmp_path / "link", options={"disk.ballast_bytes": 0}) as d:
        jobs = [d.ready_job() for _ in range(3)]
        for i, job in enumerate(jobs):
            d.kill() if i == 1 else d.stop()
            fill(small_disk, name=f"filler{i}")
            d.start()
            assert d.delete(f"/v1/jobs/{job}").status_code == 204


def test_running_jobs_pause_under_the_floor_and_go_on(small_disk):
    with Daemon(small_disk / "data", options={"disk.floor_bytes": 8 << 20, "disk.ballast_bytes": 0}) as d:
        job = d.start_job("work_once")
        wait_until(lambda: d.job(job)["fraction"] == 0.5)
        with open(small_disk / "filler", "wb") as f:
            f.write(b"x" * (12 << 20))
        paused = d.wait_state(job, "paused")
        assert paused["lost_attempts"] == 0 and "nearly full; the job goes on" in paused["message"]
        problem(d.post("/v1/jobs", json=document("succeed")), 507, "disk_full")
        problem(d.get("/readyz"), 503, "not_ready")
        os.remove(small_disk / "filler")
        done = d.wait_state(job, "succeeded")
        assert done["attempt"] == 2 and done["lost_attempts"] == 0


def test_a_job_that_needs_more_than_is_free_is_refused_at_its_start(small_disk):
    """The plan of the fake worker says 5 MB; the disk has room for 3 MB above the floor."""
    with Daemon(small_disk / "data", options={"disk.floor_bytes": 8 << 20, "disk.ballast_bytes": 0}) as d:
        planned, unplanned = d.ready_job(), d.ready_job()
        assert d.post(f"/v1/jobs/{planned}/plan").json()["disk_bytes"] == 5e6
        free = os.statvfs(small_disk)
        with open(small_disk / "filler", "wb") as f:
            f.write(b"x" * (free.f_bavail * free.f_frsize - (11 << 20)))
        r = d.post(f"/v1/jobs/{planned}/start")
        assert "5000000 are needed" in problem(r, 507, "disk_full")["detail"] and d.job(planned)["state"] == "draft"
        assert d.post(f"/v1/jobs/{unplanned}/start").status_code == 202
        os.remove(small_disk / "filler")
        assert d.post(f"/v1/jobs/{planned}/start").status_code == 202
        d.wait_state(planned, "succeeded")


def test_a_paused_job_can_be_cancelled(small_disk):
    with Daemon(small_disk / "data", options={"disk.floor_bytes": 8 << 20, "disk.ballast_bytes": 0}) as d:
        job = d.start_job("work_once")
        wait_until(lambda: d.job(job)["fraction"] == 0.5)
        with open(small_disk / "filler", "wb") as f:
            f.write(b"x" * (12 << 20))
        d.wait_state(job, "paused")
        assert d.post(f"/v1/jobs/{job}/cancel").status_code == 200
        assert d.job(job)["state"] == "cancelled"


def insist(call):
    """A client that repeats requests which failed in the server. Returns the reply and the number of repeats."""
    for n in range(5):
        r = call()
        if r.status_code not in (500, 503, 507):
            return r, n
        assert r.json()["code"] in ("io", "disk_full", "internal"), r.text
    raise AssertionError(f"still {r.status_code}: {r.text}")


def scenario(d):
    """Goes from a document to results with a client that repeats failed requests. Returns the number of repeats."""
    import requests
    repeats = 0

    def send(method, path, **more):
        nonlocal repeats
        r, n = insist(lambda: d.request(method, path, **more))
        repeats += n
        return r

    r = send("POST", "/v1/jobs", json=document("succeed"), headers={"Idempotency-Key": "one"})
    assert r.status_code == 201
    job = r.json()["id"]
    for name, (role, data) in FILES.items():
        r = send("POST", f"/v1/jobs/{job}/files", json={"name": name, "role": role, "size": len(data)})
        assert r.status_code in (200, 201), r.text
        url = r.json()["upload_url"]
        acknowledged = 0
        while url and acknowledged < len(data):
            r = send("HEAD", url, headers=TUS)
            offset = int(r.headers["Upload-Offset"])
            assert offset >= acknowledged
            r = d.patch(url, offset, data[offset:offset + 90])
            if r.status_code == 204:
                acknowledged = int(r.headers["Upload-Offset"])
            else:
                repeats += 1
                assert r.status_code in (500, 507), r.text
        assert send("GET", f"/v1/jobs/{job}/files/{name}").content == data
    assert send("POST", f"/v1/jobs/{job}/start").status_code in (200, 202)
    done = d.wait_state(job, "succeeded", "failed")
    assert done["state"] == "succeeded", done["error"]
    assert len(d.get("/v1/jobs").json()["jobs"]) == 1, "a failed creation left something behind"
    assert isinstance(requests.__version__, str)
    return repeats


@pytest.mark.parametrize("call, code, path, step", [
    ("write", errno.ENOSPC, "/upload/", 7), ("write", errno.EIO, "/upload/", 13), ("write", 0, "/upload/", 11), ("sync", errno.EIO, "/upload/", 7),
    ("fallocate", errno.ENOSPC, "/upload/", 1), ("write", errno.ENOSPC, "selvedge.db", 23), ("write", errno.EIO, "selvedge.db", 29),
    ("write", 0, "selvedge.db", 37), ("sync", errno.EIO, "selvedge.db", 13), ("write", errno.ENOSPC, "/jobs/", 17), ("sync", errno.EIO, "/jobs/", 17)])
def test_one_fault_at_every_call(shim, tmp_path, call, code, path, step):
    """One call fails, at first the first one and then later ones, until a run ends without a fault. SELVEDGE_EVERY=1
    (make test-crash): every call. Runs wait for timers and disk most of the time, so that several go on at once."""

    def run(n):
        mark = tmp_path / f"mark{n}"
        d = Daemon(tmp_path / f"data{n}", environment={"LD_PRELOAD": shim, "FAULT_CALL": call, "FAULT_AT": str(n), "FAULT_ERRNO": str(code),
                                                       "FAULT_PATH": path, "FAULT_MARK": str(mark)})
        try:
            d.start()
        # the fault came while the database was made: there is an error message, and the next start succeeds
        except AssertionError:
            assert mark.exists() and "error: " in d.log_text()
            d.environment = {}
            d.start()
        repeats = scenario(d)
        d.environment = {}
        d.stop()
        d.start()
        assert d.get("/v1/jobs").json()["jobs"][0]["state"] == "succeeded"
        d.stop()
        shutil.rmtree(d.data)
        return mark.exists(), repeats

    outcomes = []
    places = iter(range(1, 2000, 1 if os.environ.get("SELVEDGE_EVERY") == "1" else step))
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        while all(fault for fault, _ in outcomes):
            some = list(itertools.islice(places, AT_ONCE))
            assert some, "no end"
            outcomes += pool.map(run, some)
    fired = sum(fault for fault, _ in outcomes)
    assert fired > 0, "no fault was injected"
    print(f"{call} {errno.errorcode.get(code, 'short')} {path}: {fired} faults, {sum(n for _, n in outcomes)} repeats by the client")
