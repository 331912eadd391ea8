"""Workers that crash, hang or refuse to stop, the number of workers, and the effect of a restart on them."""
import contextlib
import os
import re
import shutil
import signal
import sqlite3
import time

import pytest
from daemon_under_test import document, problem, wait_until


def worker_pid(daemon, job):
    """Returns the process that has this job's folder as its argument."""
    folder = os.path.join(daemon.data, "jobs", job)
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as f:
                if f.read().rstrip(b"\0").split(b"\0")[-1] == folder.encode():
                    return int(pid)
        except OSError:
            pass
    return None


def metric(daemon, name):
    return float(re.search(rf"^{re.escape(name)} (\S+)", daemon.get("/metrics").text, re.M).group(1))


def test_a_killed_worker_is_resumed(daemon):
    before = metric(daemon, "selvedge_attempts_lost_total")
    job = daemon.start_job("kill_once")
    done = daemon.wait_state(job, "succeeded")
    assert done["attempt"] == 2 and done["lost_attempts"] == 1 and done["result"]["run"] == 2 and done["error"] is None
    assert metric(daemon, "selvedge_attempts_lost_total") == before + 1


def test_three_lost_attempts_are_a_failure(daemon):
    job = daemon.start_job("kill")
    failed = daemon.wait_state(job, "failed")
    assert failed["attempt"] == 3 and failed["lost_attempts"] == 3 and failed["error"]["code"] == "worker_lost"
    assert "signal 9" in failed["error"]["text"] and "perhaps because memory was out" in failed["error"]["text"]
    assert re.search(r"peak memory [1-9]\d*\.\d MB", failed["error"]["text"]) and failed["peak_rss_bytes"] > 1_000_000
    assert daemon.post(f"/v1/jobs/{job}/retry").status_code == 202
    again = daemon.wait_state(job, "failed")
    assert again["attempt"] == 6 and again["lost_attempts"] == 3


def test_a_crash_names_its_signal_and_last_words(daemon):
    error = daemon.wait_state(daemon.start_job("segfault"), "failed")["error"]
    assert "signal 11" in error["text"] and "a last word" in error["text"]


@pytest.mark.parametrize("code, state, text", [
    (0, "succeeded", None), (2, "failed", "without an error message"), (17, "failed", "unknown code 17"), (127, "failed", "could not be started")])
def test_exit_codes(daemon, code, state, text):
    job = daemon.wait_state(daemon.start_job(f"exit {code}"), "succeeded", "failed")
    assert job["state"] == state and (text is None or text in job["error"]["text"])


def test_a_worker_that_fails_without_a_reason(daemon):
    error = daemon.wait_state(daemon.start_job("mute"), "failed")["error"]
    assert error["code"] == "internal" and "something terrible happened" in error["text"]


def test_a_folder_that_is_in_use_is_waited_for(daemon):
    import fcntl
    job = daemon.ready_job()
    with open(os.path.join(daemon.data, "jobs", job, "lock"), "w") as f:
        fcntl.flock(f, fcntl.LOCK_EX)
        daemon.post(f"/v1/jobs/{job}/start")
        wait_until(lambda: daemon.job(job)["attempt"] >= 1)
        time.sleep(0.5)
        assert daemon.job(job)["state"] in ("queued", "running")
    done = daemon.wait_state(job, "succeeded")
    assert done["lost_attempts"] == 0


def test_cancel_of_a_worker_that_ignores_sigterm(daemon):
    job = daemon.start_job("ignore_term")
    daemon.wait_state(job, "running")
    wait_until(lambda: daemon.job(job)["heartbeat_age_s"] is not None)
    pid = worker_pid(daemon, job)
    start = time.monotonic()
    assert daemon.post(f"/v1/jobs/{job}/cancel").json()["cancel_requested"] is True
    problem(daemon.post(f"/v1/jobs/{job}/retry"), 409, "conflict")
    daemon.wait_state(job, "cancelled")
    assert time.monotonic() - start > 0.9, "SIGKILL came before the grace time was over"
    assert not os.path.exists(f"/proc/{pid}")
    assert daemon.post(f"/v1/jobs/{job}/retry").status_code == 202
    daemon.post(f"/v1/jobs/{job}/cancel")
    daemon.wait_state(job, "cancelled")


def test_a_silent_worker_is_killed_and_resumed(daemon_maker):
    d = daemon_maker(options={"jobs.heartbeat_timeout_s": 2})
    done = d.wait_state(d.start_job("silent_once"), "succeeded")
    assert done["lost_attempts"] == 1
    assert "silent" in d.log_text()


@pytest.mark.parametrize("behaviour", ["clock_set", "unreadable"])
def test_a_worker_that_beats_is_not_silent(daemon_maker, behaviour):
    d = daemon_maker(options={"jobs.heartbeat_timeout_s": 2})
    done = d.wait_state(d.start_job(f"{behaviour} 2.3"), "succeeded")
    assert done["lost_attempts"] == 0 and "silent" not in d.log_text()


def test_at_most_so_many_workers(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 2})
    jobs = [d.start_job("work") for _ in range(4)]
    wait_until(lambda: sum(d.job(j)["state"] == "running" for j in jobs) == 2)
    time.sleep(0.5)
    assert [d.job(j)["state"] for j in jobs] == ["running", "running", "queued", "queued"], "not in the order of their start"
    for j in jobs:
        d.post(f"/v1/jobs/{j}/cancel")
    for j in jobs:
        d.wait_state(j, "cancelled")


def test_workers_are_nice_in_a_session_of_their_own_and_bounded(daemon_maker):
    d = daemon_maker(options={"jobs.nice": 7, "jobs.memory_limit_bytes": 3_000_000_000, "jobs.volume_memory_bytes": 300 << 20})
    job = d.start_job("work")
    wait_until(lambda: d.job(job)["fraction"] == 0.5)
    pid = worker_pid(d, job)
    assert os.getsid(pid) == pid and os.getpriority(os.PRIO_PROCESS, pid) == 7
    with open(f"/proc/{pid}/limits") as f:
        limits = f.read()
    assert re.search(r"Max address space +3000000000 ", limits) and re.search(r"Max core file size +0 ", limits)
    open_files = [os.readlink(f"/proc/{pid}/fd/{n}") for n in os.listdir(f"/proc/{pid}/fd")]
    with open(f"/proc/{pid}/cmdline", "rb") as f:
        assert b"--memory-mib\x00300\x00" in f.read()
    assert not any("selvedge.db" in f or "socket" in f for f in open_files), open_files


def test_an_orderly_stop_lets_workers_write_a_checkpoint(daemon_maker):
    d = daemon_maker()
    job = d.start_job("work_once")
    wait_until(lambda: d.job(job)["fraction"] == 0.5)
    pid = worker_pid(d, job)
    d.stop()
    assert not os.path.exists(f"/proc/{pid}")
    import json
    with open(os.path.join(d.data, "jobs", job, "status.json")) as f:
        assert json.load(f)["state"] == "cancelled", "the worker was not asked to stop"
    d.start()
    done = d.wait_state(job, "succeeded")
    assert done["lost_attempts"] == 0 and done["attempt"] == 2


def test_nothing_starts_under_the_disk_floor(daemon_maker):
    d = daemon_maker()
    job = d.start_job("work_once")
    wait_until(lambda: d.job(job)["fraction"] == 0.5)
    d.stop()
    d.options["disk.floor_bytes"] = 1 << 60
    d.start()
    time.sleep(1)
    assert d.job(job)["state"] == "queued"
    d.stop()
    d.options["disk.floor_bytes"] = 0
    d.start()
    assert d.wait_state(job, "succeeded")["lost_attempts"] == 0


def test_unknown_folders_are_quarantined(daemon_maker):
    d = daemon_maker()
    job = d.ready_job()
    d.stop()
    for name in ("stranger", "00000000-0000-4000-8000-000000000000"):
        os.makedirs(os.path.join(d.data, "jobs", name))
        with open(os.path.join(d.data, "jobs", name, "precious.txt"), "w") as f:
            f.write(name)
    d.start()
    kept = os.listdir(os.path.join(d.data, "quarantine"))
    assert len(kept) == 2 and os.listdir(os.path.join(d.data, "jobs")) == [job]
    for name in kept:
        with open(os.path.join(d.data, "quarantine", name, "precious.txt")) as f:
            assert name.startswith(f.read())


def test_folders_that_resist_do_not_keep_the_daemon_from_starting(daemon_maker, shim):
    d = daemon_maker(environment={"LD_PRELOAD": shim, "FAULT_STUCK": "stuck"})
    deleted, broken, good = d.create(), d.create(), d.ready_job()
    jobs = os.path.join(d.data, "jobs")
    with open(os.path.join(jobs, deleted, "stuck"), "w"):
        pass
    assert d.delete(f"/v1/jobs/{deleted}").status_code == 204
    warned = f"job {deleted} is deleted, but a part of it could not be removed"
    wait_until(lambda: warned in d.log_text())
    for _ in range(3):  # each makes the supervisor check again
        d.delete(f"/v1/jobs/{d.create()}")
    wait_until(lambda: len(os.listdir(jobs)) == 3)
    assert d.log_text().count(warned) == 1, "the log is flooded"
    d.stop()
    stranger = "s" * 250  # its name in the quarantine would be too long
    os.mkdir(os.path.join(jobs, stranger))
    shutil.rmtree(os.path.join(jobs, broken))
    with open(os.path.join(jobs, broken), "w"):
        pass
    d.start()
    assert {j["id"] for j in d.get("/v1/jobs").json()["jobs"]} == {broken, good}
    assert d.post(f"/v1/jobs/{good}/start").status_code == 202
    d.wait_state(good, "succeeded")
    assert all(text in d.log_text() for text in (f"cannot move unknown '{jobs}/{stranger}'", f"job {broken}: "))
    assert sorted(os.listdir(jobs)) == sorted([deleted, broken, good, stranger])


def test_a_worker_that_vanishes_from_disk(daemon_maker, tmp_path):
    worker = tmp_path / "worker"
    worker.write_text("#!/bin/sh\nexit 0\n")
    worker.chmod(0o755)
    d = daemon_maker(worker=str(worker))
    worker.unlink()
    error = d.wait_state(d.start_job(), "failed")["error"]
    assert "cannot be executed" in error["text"] or "could not be started" in error["text"]


def test_a_job_whose_worker_cannot_be_started_nor_that_be_written_does_not_stay_running(daemon_maker):
    d = daemon_maker()
    job = d.ready_job()
    console = os.path.join(d.data, "jobs", job, "console.txt")
    os.mkdir(console)  # no worker can be started
    with contextlib.closing(sqlite3.connect(os.path.join(d.data, "selvedge.db"))) as db:
        db.execute("CREATE TRIGGER refuse BEFORE UPDATE ON job WHEN OLD.state = 2 BEGIN SELECT RAISE(ABORT, 'for a test'); END")
        d.post(f"/v1/jobs/{job}/start")
        wait_until(lambda: "for a test" in d.log_text())
        assert d.job(job)["state"] == "running"
        os.rmdir(console)
        db.execute("DROP TRIGGER refuse")
    done = d.wait_state(job, "succeeded")
    assert done["attempt"] == 2 and done["lost_attempts"] == 1


def test_a_daemon_that_cannot_write_a_lost_start_still_stops(daemon_maker):
    d = daemon_maker()
    job = d.ready_job()
    os.mkdir(os.path.join(d.data, "jobs", job, "console.txt"))
    with contextlib.closing(sqlite3.connect(os.path.join(d.data, "selvedge.db"))) as db:
        db.execute("CREATE TRIGGER refuse BEFORE UPDATE ON job WHEN OLD.state = 2 BEGIN SELECT RAISE(ABORT, 'for a test'); END")
        d.post(f"/v1/jobs/{job}/start")
        wait_until(lambda: "for a test" in d.log_text())
        d.process.send_signal(signal.SIGTERM)
        wait_until(lambda: "stopping" in d.log_text())
        db.execute("DROP TRIGGER refuse")
    d.stop()
    d.start()
    assert d.job(job)["state"] in ("queued", "running")


def test_signals_to_a_worker_from_outside(daemon):
    job = daemon.start_job("work_once")
    wait_until(lambda: daemon.job(job)["fraction"] == 0.5)
    os.kill(worker_pid(daemon, job), signal.SIGTERM)
    assert daemon.wait_state(job, "succeeded")["lost_attempts"] == 1
    assert daemon.job(job)["sample"] == document("work_once")["sample"]


@pytest.mark.parametrize("behaviour", ["work", "ignore_term"])
def test_a_job_that_runs_too_long_fails_and_can_be_resumed(daemon_maker, behaviour):
    d = daemon_maker(options={"jobs.time_limit_s": 1, "jobs.cancel_grace_s": 0})
    job = d.start_job(behaviour)
    failed = d.wait_state(job, "failed")
    assert failed["error"]["code"] == "time_limit" and failed["attempt"] == 1 and failed["lost_attempts"] == 0
    d.put(f"/v1/jobs/{job}/document", json=document("succeed"))
    d.stop()
    del d.options["jobs.time_limit_s"]  # a busy machine may need more than a second for a job that succeeds
    d.start()
    d.post(f"/v1/jobs/{job}/start")
    assert d.wait_state(job, "succeeded")["error"] is None


def test_a_worker_that_holds_too_much_memory_is_ended(daemon_maker):
    d = daemon_maker(options={"jobs.resident_limit_bytes": 128 << 20})
    job = d.start_job("hold 300")
    failed = d.wait_state(job, "failed")
    assert failed["error"]["code"] == "memory_limit" and "jobs.resident_limit_bytes" in failed["error"]["text"]
    assert failed["attempt"] == 1 and failed["lost_attempts"] == 0
    # pages of files can be taken back, so they do not count
    d.wait_state(d.start_job("map 300"), "succeeded")
