"""kill -9 of the daemon at any moment: nothing acknowledged is lost, no job is left running without a worker, and files
match their hashes.

SELVEDGE_KILLS says how often all tests together kill (100; `make test-crash`: 2,000). They print
the kills and the facts that were confirmed, as lines of JSON."""
import concurrent.futures
import json
import os
import random
import threading
import time

import pytest
import requests
from daemon_under_test import FILES, TUS, Daemon, document, sha256, wait_until


AT_ONCE = 4
KILLS_IN_UPLOADS = 12
KILLS = int(os.environ.get("SELVEDGE_KILLS", "100"))
LOOPS = max(2, KILLS // 100)
ROUNDS = max(15, (KILLS - 3 * KILLS_IN_UPLOADS) // LOOPS)


@pytest.fixture(scope="module")
def figures():
    """Counts of all tests together. A lost fact fails its test, so that there is no figure of it other than 0."""
    count = {"kills": 0, "facts": 0, "lost": 0}
    yield count
    for name, value in count.items():
        print(json.dumps({"name": f"service.{name}", "value": value, "unit": "1", "better": "lower" if name == "lost" else "higher"}))


def processes_of(daemon):
    """Returns the workers whose job is in this daemon's data folder."""
    found = []
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as f:
                command = f.read()
            with open(f"/proc/{pid}/stat") as f:
                zombie = f.read().rsplit(")", 1)[1].split()[0] == "Z"
        except OSError:
            continue
        if (daemon.data + "/jobs/").encode() in command and not zombie:
            found.append(int(pid))
    return found


def test_workers_die_with_the_daemon_and_their_jobs_resume(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 2})
    jobs = [d.start_job("work_once") for _ in range(2)]
    for j in jobs:
        wait_until(lambda: d.job(j)["fraction"] == 0.5)
    assert len(processes_of(d)) == 2
    d.kill()
    wait_until(lambda: not processes_of(d), timeout_s=5, what="the end of the workers")
    d.start()
    for j in jobs:
        done = d.wait_state(j, "succeeded")
        assert done["attempt"] == 2 and done["lost_attempts"] == 0, "the daemon's death is not the job's fault"


def test_a_cancel_that_was_acknowledged_holds(daemon_maker):
    d = daemon_maker(options={"jobs.cancel_grace_s": 60})
    job = d.start_job("ignore_term")
    wait_until(lambda: d.job(job)["fraction"] == 0.5)
    assert d.post(f"/v1/jobs/{job}/cancel").status_code == 202
    d.kill()
    d.start()
    time.sleep(0.5)
    assert d.job(job)["state"] == "cancelled"


def test_a_delete_that_was_acknowledged_holds(daemon_maker):
    d = daemon_maker()
    jobs = [d.ready_job() for _ in range(8)]
    for j in jobs:
        assert d.delete(f"/v1/jobs/{j}").status_code == 204
    d.kill()
    d.start()
    assert d.get("/v1/jobs").json()["jobs"] == []
    wait_until(lambda: os.listdir(os.path.join(d.data, "jobs")) == [])
    assert os.listdir(os.path.join(d.data, "quarantine")) == []


def at_once(act, folder, n):
    """Runs act(folder, seed) for n seeds, each with a daemon of its own. They wait for disk and timers most of the time."""
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        for done in [pool.submit(act, folder / str(seed), seed) for seed in range(n)]:
            done.result()


def test_kill_in_mid_upload(figures, tmp_path):
    at_once(lambda folder, seed: kills_in_mid_upload(figures, folder, seed), tmp_path, 3)


def test_kill_loop_over_everything(figures, tmp_path):
    at_once(lambda folder, seed: kills_at_everything(figures, folder, seed), tmp_path, LOOPS)


def kills_in_mid_upload(figures, tmp_path, seed):
    """Uploads continue through many kills: every acknowledged offset is kept, and the files are complete at the end."""
    rng = random.Random(seed)
    d = Daemon(tmp_path / "data", options={"upload.commit_bytes": 1 << 18}).start()
    job = d.create(document("succeed"))
    data = {n: rng.randbytes(6_000_000 if n == "scan.tif" else 300_000) for n in FILES}
    url = {n: d.declare(job, n, data[n], FILES[n][0])["upload_url"] for n in FILES}
    acknowledged = dict.fromkeys(FILES, 0)
    kills = 0
    while kills < KILLS_IN_UPLOADS or min(acknowledged[n] - len(data[n]) for n in FILES) < 0:
        unfinished = [n for n in FILES if acknowledged[n] < len(data[n])]
        killer = None
        if kills < KILLS_IN_UPLOADS:
            delay = rng.uniform(0, 0.06)
            killer = threading.Thread(target=lambda: (time.sleep(delay), d.process.kill()))
        if killer:
            killer.start()
        try:
            for _ in range(30):
                name = rng.choice(unfinished or list(FILES))
                r = requests.request("HEAD", d.url + url[name], headers=TUS, timeout=100)
                assert r.status_code == 200
                offset = int(r.headers["Upload-Offset"])
                assert acknowledged[name] <= offset <= len(data[name]), "acknowledged bytes are gone"
                size = rng.choice([1, 1000, 70_000, 400_000])
                r = requests.patch(d.url + url[name], data=data[name][offset:offset + size], timeout=100, headers={
                    **TUS, "Upload-Offset": str(offset), "Content-Type": "application/offset+octet-stream"})
                assert r.status_code == 204, r.text
                acknowledged[name] = int(r.headers["Upload-Offset"])
                figures["facts"] += 1
                if acknowledged[name] == len(data[name]) and not killer:
                    break
        except requests.ConnectionError:
            pass
        if killer:
            killer.join()
            d.kill()
            kills += 1
            figures["kills"] += 1
            d.start()
    files = {f["name"]: f for f in d.job(job)["files"]}
    for n in FILES:
        assert files[n]["state"] == "complete" and files[n]["sha256"] == sha256(data[n])
        assert d.get(f"/v1/jobs/{job}/files/{n}").content == data[n]
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    d.wait_state(job, "succeeded")
    assert os.listdir(os.path.join(d.data, "quarantine")) == []
    d.stop()


def kills_at_everything(figures, tmp_path, seed):
    """Random requests and kills: what was acknowledged is checked after each restart, and at the end every job reaches
    a final state."""
    rng = random.Random(100 + seed)
    d = Daemon(tmp_path / "data", options={"jobs.workers": 2, "jobs.cancel_grace_s": 0}).start()
    known = {}  # job -> set of states allowed by what was acknowledged; None: deleted
    for _ in range(ROUNDS):
        stop_at = time.monotonic() + rng.uniform(0.02, 0.4)
        killer = threading.Thread(target=lambda: (time.sleep(max(0, stop_at - time.monotonic())), d.process.kill()))
        killer.start()
        try:
            while True:
                alive = [j for j, state in known.items() if state is not None]
                act = rng.choice(["create", "start", "cancel", "delete", "retry"]) if alive else "create"
                if act == "create":
                    # by uploads, and by links to the inputs of an earlier job
                    known[d.ready_job(rng.choice(["succeed", "fail", "kill_once", "work 0.2"]), checked=rng.random() < 0.5)] = "draft"
                    figures["facts"] += 1 + 2 * len(FILES)
                else:
                    j = rng.choice(alive)
                    if act == "delete":
                        known[j] = "unknown"  # until the reply has arrived
                        r = d.delete(f"/v1/jobs/{j}")
                        assert r.status_code in (204, 404)
                        known[j] = None
                        figures["facts"] += 1
                    else:
                        r = d.post(f"/v1/jobs/{j}/{act}")
                        assert r.status_code in (200, 202, 409, 404) and (r.status_code != 404 or known[j] == "unknown"), r.text
                        if r.status_code == 202 and act in ("start", "retry"):
                            known[j] = "started"
                            figures["facts"] += 1
        except (requests.ConnectionError, requests.Timeout):
            pass
        killer.join()
        d.kill()
        figures["kills"] += 1
        wait_until(lambda: not processes_of(d), timeout_s=5, what="the end of the workers")
        d.start()
        for j, state in known.items():
            r = d.get(f"/v1/jobs/{j}")
            if state is None:
                assert r.status_code == 404
            elif state != "unknown":
                assert r.status_code == 200, f"job {j} ({state}) is lost"
                assert state != "started" or r.json()["state"] != "draft"
                for name, (_, content) in FILES.items():
                    assert d.get(f"/v1/jobs/{j}/files/{name}").content == content
            elif r.status_code == 404:
                known[j] = None
    jobs = d.get("/v1/jobs?limit=500").json()["jobs"]
    # jobs that were being created when the daemon was killed may exist without being known; they are drafts
    for j in jobs:
        assert j["id"] in known or j["state"] == "draft"
    wait_until(lambda: all(j["state"] in ("draft", "succeeded", "failed", "cancelled") for j in d.get("/v1/jobs?limit=500").json()["jobs"]), 60, "rest")
    assert not processes_of(d)
    assert os.listdir(os.path.join(d.data, "quarantine")) == []
    d.stop()
