"""Jobs on a real Slurm of two virtual nodes, with the fake worker (tests/support/python/fake_worker.py)."""
import json
import os
import re
import signal
import time

import pytest
from daemon_under_test import Daemon, document, selvedged, wait_until


def slurm_id(daemon, job):
    """The number that Slurm gave the running job."""
    return wait_until(lambda: (daemon.job(job)["backend"] or {}).get("id"), what="a number from Slurm")


def wait_beat(daemon, job):
    return wait_until(lambda: daemon.job(job)["fraction"] == 0.5, what="a heartbeat")


def worker_pids(cluster, daemon, job):
    folder = os.path.join(daemon.data, "jobs", job).encode()
    found = []
    for pid in cluster.strays():
        with open(f"/proc/{pid}/cmdline", "rb") as f:
            if f.read().rstrip(b"\0").split(b"\0")[-1] == folder:
                found.append(pid)
    return found


def test_a_job_runs_on_a_node(daemon_maker, cluster):
    d = daemon_maker(options={"slurm.extra_arguments": "--nice=3"})
    job = d.start_job("surroundings")
    number = slurm_id(d, job)
    told = cluster.run("scontrol", "show", "job", number)
    assert re.search(r"JobName=selvedge-fake__surroundings\n", told) and f"Comment=selvedge:{job}:1" in told
    assert "Requeue=0" in told and "MinMemoryNode=600M" in told and "CPUs/Task=1" in told and "Nice=3" in told
    done = d.wait_state(job, "succeeded")
    assert done["attempt"] == 1 and done["lost_attempts"] == 0 and done["backend"] is None and done["message"] != ""
    environment = done["result"]["environment"]
    assert environment["SLURM_JOB_ID"] == number and "HOME" not in environment and done["result"]["limits"]["CORE"] == [0, 0]


def test_jobs_wait_for_nodes_and_say_so(daemon_maker, cluster):
    d = daemon_maker()
    jobs = [d.start_job("work") for _ in range(3)]
    wait_until(lambda: [d.job(j)["backend"]["state"] if d.job(j)["backend"] else "" for j in jobs].count("RUNNING") == 2)
    waiting = next(j for j in jobs if d.job(j)["backend"]["state"] == "PENDING")
    told = wait_until(lambda: (lambda j: j if j["backend"]["reason"] in ("Resources", "Priority") else None)(d.job(waiting)))
    assert told["state"] == "running" and told["heartbeat_age_s"] is None
    assert re.fullmatch(r"waits in Slurm: (Resources|Priority) \(job \d+\)", told["message"])
    assert {d.job(j)["backend"]["nodes"] for j in jobs} == {"n1", "n2", ""}
    # cancel while it waits, and while it runs
    for j in (waiting, *(j for j in jobs if j != waiting)):
        assert d.post(f"/v1/jobs/{j}/cancel").json()["cancel_requested"] is True
        cancelled = d.wait_state(j, "cancelled")
        assert cancelled["error"] is None
    with open(os.path.join(d.data, "jobs", jobs[0], "status.json")) as f:
        assert json.load(f)["state"] == "cancelled", "the worker was killed before it could write"


def test_a_worker_that_ignores_sigterm_is_ended(daemon_maker, cluster):
    d = daemon_maker()
    job = d.start_job("ignore_term")
    wait_beat(d, job)
    d.post(f"/v1/jobs/{job}/cancel")
    d.wait_state(job, "cancelled")
    assert not worker_pids(cluster, d, job)


@pytest.mark.parametrize("behaviour, state, attempt, lost, text", [
    ("fail", "failed", 1, 0, "page 2 is cut off"), ("mute", "failed", 1, 0, "something terrible happened"),
    ("kill_once", "succeeded", 2, 1, None), ("segfault", "failed", 3, 3, "signal 11"), ("exit 17", "failed", 3, 3, "unknown code 17"),
    ("exit 2", "failed", 1, 0, "without an error message")])
def test_exit_codes(daemon_maker, behaviour, state, attempt, lost, text):
    d = daemon_maker()
    job = d.wait_state(d.start_job(behaviour), "succeeded", "failed", timeout_s=40)
    assert (job["state"], job["attempt"], job["lost_attempts"]) == (state, attempt, lost), job["error"]
    assert text is None or text in job["error"]["text"]


def test_a_restarted_daemon_finds_its_jobs(daemon_maker, cluster):
    d = daemon_maker()
    jobs = [d.start_job("work 4"), d.start_job("work"), d.start_job("work")]
    numbers = [slurm_id(d, j) for j in jobs]
    wait_beat(d, jobs[0])
    d.kill()
    # one ends while no daemon runs, one of the notes is lost, and a third is cancelled after the restart
    with open(os.path.join(d.data, "jobs", jobs[0], "backend.json")) as f:
        assert json.load(f)["id"] == numbers[0]
    os.remove(os.path.join(d.data, "jobs", jobs[1], "backend.json"))
    wait_until(lambda: cluster.jobs()[numbers[0]] == "COMPLETED")
    d.start()
    done = d.wait_state(jobs[0], "succeeded")
    assert done["attempt"] == 1 and done["lost_attempts"] == 0
    assert slurm_id(d, jobs[1]) == numbers[1] and d.job(jobs[1])["attempt"] == 1
    d.stop()
    assert cluster.jobs()[numbers[1]] in ("RUNNING", "PENDING"), "an orderly stop ended a job of the cluster"
    d.start()
    for j in jobs[1:]:
        d.post(f"/v1/jobs/{j}/cancel")
        assert d.wait_state(j, "cancelled")["attempt"] == 1


def test_a_job_cancelled_in_slurm_is_cancelled(daemon_maker, cluster):
    d = daemon_maker()
    job = d.start_job("work")
    wait_beat(d, job)
    cluster.run("scancel", slurm_id(d, job))
    assert d.wait_state(job, "cancelled")["lost_attempts"] == 0
    assert "it was cancelled in Slurm" in d.log_text()


def test_slurm_refuses_a_job(daemon_maker):
    d = daemon_maker(options={"slurm.partition": "nowhere"})
    error = d.wait_state(d.start_job("succeed"), "failed")["error"]
    assert error["code"] == "backend_refused" and "invalid partition specified: nowhere" in error["text"]
    d.stop()
    d.options["slurm.partition"] = ""
    d.options["slurm.memory_bytes"] = 1 << 40
    d.start()
    error = d.wait_state(d.start_job("succeed"), "failed")["error"]
    assert error["code"] == "backend_refused" and "Memory specification can not be satisfied" in error["text"]


def test_the_doctor_asks_slurm(daemon_maker, cluster, tmp_path, monkeypatch):
    for name, value in cluster.environment.items():
        monkeypatch.setenv(name, value)
    options = [f"--set={key}={value}" for key, value in cluster.options().items()]
    told = selvedged(tmp_path / "data", *options, "--doctor")
    assert re.search(r"ok +cluster +Slurm would take a job of 1 cores and 600 MiB\n", told)
    before = cluster.jobs()
    told = selvedged(tmp_path / "data", *options, "--set=slurm.partition=nowhere", "--doctor", expect=1)
    assert re.search(r"FAULT +cluster .*invalid partition specified: nowhere", told)
    told = selvedged(tmp_path / "data", *options, "--set=slurm.commands=/nowhere", "--doctor", expect=1)
    assert re.search(r"FAULT +cluster .*there is no program '/nowhere/sbatch'", told)
    assert cluster.jobs() == before


def test_settings_that_slurm_cannot_have(cluster, tmp_path):
    for key, value, text in [("slurm.extra_arguments", "--array=1-9", "'--array=1-9'"), ("slurm.commands", "/nowhere", "/nowhere/sbatch"),
                             ("slurm.account", "a b", "'a b'")]:
        options = dict(cluster.options(), **{key: value})
        with pytest.raises(AssertionError, match="(?s)did not start.*" + re.escape(text)):
            Daemon(tmp_path / "data", options=options, environment=cluster.environment).start()


def test_jobs_stay_queued_while_slurm_is_away(daemon_maker, cluster):
    d = daemon_maker()
    running = d.start_job("work 1")
    wait_beat(d, running)
    cluster.end("slurmctld")
    try:
        jobs = [d.start_job("succeed") for _ in range(3)]
        wait_until(lambda: all(d.job(j)["state"] == "queued" and "Unable to contact slurm controller" in d.job(j)["message"] for j in jobs))
        time.sleep(2)
        assert max(d.job(j)["attempt"] for j in jobs) <= 1 and d.job(running)["state"] == "running"
        assert d.log_text().count("Slurm cannot be used") == 1, "the log is flooded"
    finally:
        cluster.start_controller()
    for j in (running, *jobs):
        assert d.wait_state(j, "succeeded", timeout_s=60)["lost_attempts"] == 0


def test_a_start_that_slurm_repeats_writes_nothing(daemon_maker, cluster, tmp_path):
    """The script that Slurm has is run a second time, as Slurm does after some failures of a controller."""
    d = daemon_maker()
    job = d.start_job("work 3")
    number = slurm_id(d, job)
    wait_beat(d, job)
    script = tmp_path / "script"
    cluster.run("scontrol", "write", "batch_script", number, str(script))
    assert f"--start \"slurm-$SLURM_JOB_ID.${{SLURM_RESTART_COUNT:-0}}\" '{d.data}/jobs/{job}'" in script.read_text()
    again = cluster.run("sbatch", "--parsable", f"--output={tmp_path}/again", str(script)).strip()
    wait_until(lambda: cluster.jobs()[again] == "FAILED")
    assert "ExitCode=4:0" in cluster.run("scontrol", "show", "job", again)
    done = d.wait_state(job, "succeeded")
    assert done["attempt"] == 1 and done["result"]["run"] == 1


def test_a_preempted_job_goes_on(daemon_maker, cluster):
    d = daemon_maker()
    job = d.start_job("work_once")
    wait_beat(d, job)
    number = slurm_id(d, job)
    urgent = cluster.run("sbatch", "--parsable", "--partition=urgent", "--nodes=2", "--exclusive", "--output=/dev/null", "--wrap=sleep 1").strip()
    done = d.wait_state(job, "succeeded", timeout_s=40)
    assert cluster.jobs()[number] == "PREEMPTED" and cluster.jobs()[urgent] == "COMPLETED"
    assert done["attempt"] == 2 and done["lost_attempts"] == 0


def test_a_killed_worker_and_a_new_document(daemon_maker, cluster):
    d = daemon_maker()
    job = d.start_job("work_once")
    wait_beat(d, job)
    os.kill(worker_pids(cluster, d, job)[0], signal.SIGKILL)
    done = d.wait_state(job, "succeeded")
    assert done["attempt"] == 2 and done["lost_attempts"] == 1
    d.put(f"/v1/jobs/{job}/document", json=document("succeed"))
    d.post(f"/v1/jobs/{job}/start")
    assert d.wait_state(job, "succeeded")["result"]["run"] == 1


def test_a_lost_node(daemon_maker, cluster):
    d = daemon_maker()
    job = d.start_job("work_once")
    wait_beat(d, job)
    node = wait_until(lambda: d.job(job)["backend"]["nodes"])
    cluster.lose_node(node)
    try:
        done = d.wait_state(job, "succeeded", timeout_s=90)
        assert done["attempt"] == 2 and done["lost_attempts"] == 1
        assert "its node was lost" in d.log_text()
    finally:
        cluster.start_node(node)


def test_a_job_longer_than_the_time_limit_goes_on(daemon_maker):
    """Slurm sends its signal up to a minute early, here soon after the start."""
    d = daemon_maker(options={"slurm.time_limit_s": 120, "slurm.warn_s": 100})
    done = d.wait_state(d.start_job("step_once"), "succeeded", timeout_s=200)
    assert done["attempt"] == 2 and done["lost_attempts"] == 0 and done["result"]["run"] == 2
    assert "Slurm has asked it to stop, and it has written a checkpoint" in d.log_text()


@pytest.mark.parametrize("behaviour", ["work_once", "ignore_term"])
def test_the_time_limit_of_slurm(daemon_maker, behaviour):
    """Slurm counts in minutes, and sends its signal up to a minute early."""
    d = daemon_maker(options={"slurm.time_limit_s": 60, "slurm.warn_s": 30, "jobs.max_lost_attempts": 1})
    job = d.start_job(behaviour)
    error = d.wait_state(job, "failed", timeout_s=200)["error"]
    assert error["code"] == "worker_lost" and "finished no stage and no step" in error["text"]
