"""Slurm's commands at their worst: limits of jobs, no answer, accounts that fail for once. A folder in front of the real
commands, slurm.commands, has scripts in place of some of them."""
import os
import shutil
import time

import pytest
from daemon_under_test import TIMEOUT_S, wait_until

LIMIT = """#!/bin/sh
if [ "$(squeue --me --noheader --states=PENDING,RUNNING,COMPLETING | wc -l)" -ge 2 ]; then
    echo refused >> {folder}/calls
    echo "sbatch: error: QOSMaxSubmitJobPerUserLimit" >&2
    echo "sbatch: error: Batch job submission failed: Job violates accounting/QOS policy (job submit limit, user's size and/or time limits)" >&2
    exit 1
fi
exec {real} "$@"
"""
SLOW = """#!/bin/sh
for word in "$@"; do case "$word" in --comment=*) echo "$word" >> {folder}/calls ;; esac; done
sleep 0.5
exec {real} "$@"
"""
HANGS = """#!/bin/sh
touch {folder}/calls
sleep 1000
"""
FORGETS = """#!/bin/sh
[ -e {folder}/forgotten ] || exec {real} "$@"
"""
FAILS_ONCE = """#!/bin/sh
if [ ! -e {folder}/calls ]; then
    touch {folder}/calls
    echo "sacct: error: slurm_persist_conn_open_without_init: failed to open persistent connection" >&2
    exit 1
fi
for word in "$@"; do case "$word" in --jobs=*) echo "${{word#--jobs=}}|NODE_FAIL|0:0|n1" ;; esac; done
"""


@pytest.fixture
def commands(tmp_path, cluster):
    """Makes the folder; scripts by the names of commands."""
    def make(**scripts):
        folder = tmp_path / "commands"
        folder.mkdir()
        for name in ("sbatch", "squeue", "scancel", "sacct"):
            real = shutil.which(name, path=cluster.environment["PATH"])
            if name in scripts:
                (folder / name).write_text(scripts[name].format(folder=folder, real=real))
                (folder / name).chmod(0o755)
            elif real:
                os.symlink(real, folder / name)
        return folder
    return make


def test_a_limit_of_jobs_costs_one_try_at_a_time(daemon_maker, commands):
    folder = commands(sbatch=LIMIT)
    d = daemon_maker(options={"slurm.commands": str(folder), "jobs.workers": 8})
    jobs = [d.start_job("work 2") for _ in range(6)]
    wait_until(lambda: [d.job(j)["state"] for j in jobs].count("queued") == 4)
    wait_until(lambda: all("QOSMaxSubmitJobPerUserLimit" in d.job(j)["message"] for j in jobs if d.job(j)["state"] == "queued"))
    done = [d.wait_state(j, "succeeded", timeout_s=60) for j in jobs]
    refused = len((folder / "calls").read_text().splitlines())
    # at first some jobs may be launched together; then each refusal costs one attempt of one job
    assert sum(j["attempt"] - 1 for j in done) <= refused + 4 and max(j["lost_attempts"] for j in done) == 0
    log = d.log_text()
    assert log.count("Slurm takes no more jobs at present") == 1 and "Slurm cannot be used" not in log


def test_jobs_are_submitted_in_their_order(daemon_maker, commands):
    folder = commands(sbatch=SLOW)
    d = daemon_maker(options={"slurm.commands": str(folder)})
    jobs = [d.start_job("succeed") for _ in range(5)]
    for j in jobs:
        d.wait_state(j, "succeeded", timeout_s=60)
    assert (folder / "calls").read_text().splitlines() == [f"--comment=selvedge:{j}:1" for j in jobs]


def test_a_command_that_hangs_does_not_hold_the_daemon(daemon_maker, commands):
    folder = commands(sbatch=HANGS)
    d = daemon_maker(options={"slurm.commands": str(folder)})
    d.start_job("succeed")
    wait_until((folder / "calls").exists)
    begin = time.monotonic()
    d.stop()
    assert time.monotonic() - begin < 20 * TIMEOUT_S


def test_accounts_that_fail_once_are_asked_again(daemon_maker, commands):
    folder = commands(squeue=FORGETS, sacct=FAILS_ONCE)
    d = daemon_maker(options={"slurm.commands": str(folder), "slurm.file_delay_s": 10, "jobs.max_lost_attempts": 1})
    job = d.start_job("work")
    wait_until(lambda: d.job(job)["fraction"] == 0.5)
    (folder / "forgotten").touch()
    assert "its node was lost" in d.wait_state(job, "failed", timeout_s=60)["error"]["text"]


def test_time_before_a_suspension_counts(daemon_maker, cluster):
    d = daemon_maker(options={"jobs.time_limit_s": 8})
    job = d.start_job("work")
    wait_until(lambda: d.job(job)["fraction"] == 0.5)
    number = d.job(job)["backend"]["id"]
    time.sleep(5)
    cluster.run("scontrol", "suspend", number)
    wait_until(lambda: d.job(job)["backend"]["state"] == "SUSPENDED")
    time.sleep(5)
    assert d.job(job)["state"] == "running"
    cluster.run("scontrol", "resume", number)
    begin = time.monotonic()
    assert d.wait_state(job, "failed")["error"]["code"] == "time_limit"
    assert time.monotonic() - begin < 7, "the limit began anew"
