"""The stage after the result: a picture and the twin, while no job waits or runs, stopped and resumed, found after a crash."""
import json
import os
import pathlib
import time

import pytest
from daemon_under_test import problem
from small_cloth import hair

FIXED = {"C_R": [0.1, 0.1, 0.1], "C_TT": [0.5, 0.3, 0.2], "beta_R": 10, "beta_TT": 20, "gamma_TT": 25}
SMALL = {"on": "flat", "light_theta_deg": 45, "light_phi_deg": 0, "camera_theta_deg": 45, "camera_phi_deg": 180, "px": 8, "samples": 2}


@pytest.fixture
def making(daemon_maker):
    return daemon_maker(worker=None, options={"jobs.pictures": 1})


def start(daemon, **more):
    job = daemon.create({"sample": "stage", "fibers": {"file": "cloth.hair"}, "fit": {"model": "two_lobe.v1", "fixed": FIXED}, "pictures": [SMALL], **more})
    daemon.upload(job, "cloth.hair", hair(layers=3), "fibers")
    assert daemon.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


def pictures(daemon, job):
    return daemon.get(f"/v1/jobs/{job}/pictures").json()


def wait(daemon, job, *states, timeout_s=240):
    end = time.monotonic() + timeout_s
    while (now := pictures(daemon, job))["state"] not in states:
        assert time.monotonic() < end, (now, daemon.get(f"/v1/jobs/{job}/log").text[-1000:])
        time.sleep(0.2)
    return now


def files(daemon, job):
    return {f["path"] for f in daemon.get(f"/v1/jobs/{job}/results").json()["files"]}


def wait_file(daemon, job, path, timeout_s=240):
    end = time.monotonic() + timeout_s
    while path not in files(daemon, job):
        assert time.monotonic() < end and pictures(daemon, job)["state"] in ("waiting", "running"), pictures(daemon, job)
        time.sleep(0.3)


def makers(job):
    """Processes that make the pictures of a job."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if "--pictures" in words and any(w.rstrip("/").endswith(job) for w in words):
            found.append(int(path.parent.name))
    return found


def wait_ended(job, timeout_s):
    """Waits until no process makes pictures of the job, and returns how long that took."""
    begin = time.monotonic()
    while makers(job):
        assert time.monotonic() < begin + timeout_s, "the worker goes on"
        time.sleep(0.02)
    return time.monotonic() - begin


def test_a_deleted_job_and_a_queued_one_end_the_worker(making):
    """The worker ends soon, whichever of both comes; of a deleted job nothing remains; the log of the job stays as it was."""
    daemon = making
    job = start(daemon)
    assert daemon.wait_state(job, "succeeded", "failed", timeout_s=120)["state"] == "succeeded"
    log = daemon.get(f"/v1/jobs/{job}/log").text
    wait_file(daemon, job, "pictures/hero.png")
    assert makers(job) and daemon.get(f"/v1/jobs/{job}/log").text == log
    other = start(daemon, pictures=[SMALL, {**SMALL, "light_phi_deg": 10}])
    yielded_s = wait_ended(job, 100)
    print(f"worker of pictures ended {yielded_s:.2f} s after a job was queued")
    assert daemon.wait_state(other, "succeeded", "failed", timeout_s=120)["state"] == "succeeded"
    wait(daemon, job, "running")
    folder = os.path.join(daemon.data, "jobs", job)
    assert os.path.exists(os.path.join(folder, "pictures-log.txt")) and makers(job)
    assert daemon.delete(f"/v1/jobs/{job}").status_code == 204
    ended_s = wait_ended(job, 100)
    print(f"worker of pictures ended {ended_s:.2f} s after its job was deleted")
    end = time.monotonic() + 100
    while os.path.exists(folder) or os.path.exists(os.path.join(daemon.data, "pictures", job)):
        assert time.monotonic() < end, os.listdir(daemon.data)
        time.sleep(0.1)
    assert daemon.get(f"/v1/jobs/{job}/pictures").status_code == 404
    wait(daemon, other, "running", "succeeded")


def test_stop_and_resume_and_a_crash(making):
    """The result is there before the picture; a draft comes first; a stop keeps it; a killed daemon's list is still there."""
    daemon = making
    job = start(daemon)
    done = daemon.wait_state(job, "succeeded", "failed", timeout_s=120)
    assert done["state"] == "succeeded", done["error"]
    assert "pictures/hero.png" not in files(daemon, job)
    wait_file(daemon, job, "pictures/hero.png")
    draft = json.loads(daemon.get(f"/v1/jobs/{job}/results/pictures/hero.json").content)
    assert draft["kind"] == "drape" and draft["partial"]
    stopped = daemon.post(f"/v1/jobs/{job}/pictures/stop")
    assert stopped.status_code == 200
    wait(daemon, job, "cancelled")
    assert "pictures/hero.png" in files(daemon, job) and daemon.get(f"/v1/jobs/{job}").json()["state"] == "succeeded"
    assert daemon.post(f"/v1/jobs/{job}/pictures/start").json()["state"] in ("waiting", "running")
    wait(daemon, job, "running")
    daemon.kill()
    daemon.start()
    wait(daemon, job, "running")
    assert daemon.get(f"/v1/jobs/{job}").json()["state"] == "succeeded"
    other = start(daemon, pictures=[SMALL, {**SMALL, "light_phi_deg": 10}])
    assert daemon.wait_state(other, "succeeded", "failed", timeout_s=120)["state"] == "succeeded"
    assert {pictures(daemon, j)["state"] for j in (job, other)} <= {"waiting", "running"}


def test_jobs_that_want_none(making):
    """A geometry would have none; a document may leave them out; a job that has not succeeded has none to start."""
    daemon = making
    job = daemon.create({"sample": "s", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"}, "pictures": "none"})
    assert pictures(daemon, job) == {"state": "none", "fraction": 0.0, "error": None}
    assert "not succeeded" in problem(daemon.post(f"/v1/jobs/{job}/pictures/start"), 409, "conflict")["detail"]
    assert not os.listdir(os.path.join(daemon.data, "pictures"))
