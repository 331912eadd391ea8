"""What an operator does to a service beside using it: few descriptors, a clock that goes back, settings with a mistake, a
folder that cannot be written, two daemons, a signal of log rotation."""
import os
import shutil
import signal
import socket
import subprocess
import time

import pytest
import requests
from daemon_under_test import BUILD, Daemon, document, program, wait_until

NEXT_YEAR = """
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
int clock_gettime(clockid_t clock, struct timespec *t)
{
    int r = (int)syscall(SYS_clock_gettime, clock, t);
    if (clock == CLOCK_REALTIME) t->tv_sec += 365 * 86400;
    return r;
}
"""


def start_fails(folder, *options):
    done = subprocess.run([program("selvedged"), "--data", str(folder), "--port", "0", *options], capture_output=True, text=True, check=False, timeout=150)
    assert done.returncode != 0
    return done.stderr


def start_by_itself(d, job):
    """Starts a job on a connection of its own. One too many may be closed instead of waiting (libmicrohttpd 0.9.75)."""
    try:
        return requests.post(f"{d.url}/v1/jobs/{job}/start", timeout=100).status_code
    except requests.ConnectionError:
        return None


def test_few_descriptors_mean_fewer_connections(tmp_path):
    """Idle clients take the connections; none is taken of what database, uploads and workers need."""
    d = Daemon(tmp_path / "data", options={"server.idle_timeout_s": 2, "server.header_deadline_s": 2},
               wrapper=["bash", "-c", 'ulimit -n 256; exec "$@"', "bash"])
    with d:
        assert "256 descriptors are allowed (LimitNOFILE=, ulimit -n), so 64 connections instead of 2048" in d.log_text()
        job = d.ready_job("succeed")
        idle = [socket.create_connection(("127.0.0.1", d.port)) for _ in range(150)]
        wait_until(lambda: len(os.listdir(f"/proc/{d.process.pid}/fd")) > 64)
        assert len(os.listdir(f"/proc/{d.process.pid}/fd")) < 200
        assert wait_until(lambda: start_by_itself(d, job)) == 202, "when the first of them have been silent for too long"
        for s in idle:
            s.close()
        d.wait_state(job, "succeeded")


@pytest.fixture(scope="module")
def next_year(tmp_path_factory):
    """The environment of a daemon whose clock is ahead by a year."""
    compiler = shutil.which("cc") or shutil.which("gcc") or pytest.skip("no C compiler")
    if "asan" in BUILD:
        pytest.skip("the address sanitizer wants to be loaded first")
    path = str(tmp_path_factory.mktemp("clock") / "clock.so")
    subprocess.run([compiler, "-shared", "-fPIC", "-x", "c", "-o", path, "-"], input=NEXT_YEAR, text=True, check=True)
    return {"LD_PRELOAD": path}


def test_a_clock_that_goes_back_by_a_year(tmp_path, next_year):
    """Jobs of later than now stay, run in their turn, and new ones run, too."""
    d = Daemon(tmp_path / "data", options={"retention.max_age_days": 1, "retention.check_s": 1})
    d.environment = next_year
    with d:
        ended, waiting = d.start_job("succeed"), d.ready_job("succeed")
        d.wait_state(ended, "succeeded")
    d.environment = {}
    with d:
        assert d.job(ended)["finished_unix_s"] > time.time() + 3e7
        d.post(f"/v1/jobs/{waiting}/start")
        new = d.start_job("work 0.3")
        for job in (waiting, new):
            done = d.wait_state(job, "succeeded")
            assert done["heartbeat_age_s"] is None or done["heartbeat_age_s"] >= 0
        assert [j["id"] for j in d.get("/v1/jobs").json()["jobs"]] == [new, waiting, ended]


@pytest.mark.parametrize("text, words", [
    ("[server]\nprot = 1\n", "line 2: setting 'server.prot' does not exist"),
    ("[jobs]\n\nworkers = two\n", "line 3: setting 'jobs.workers' is 'two', which is not a whole number"),
    ("[jobs]\nworkers = 1025\n", "line 2: setting 'jobs.workers' is 1025, which is outside 1..1024"),
    ("workers\n", "line 1 is not 'name = value'"),
])
def test_settings_with_a_mistake(tmp_path, text, words):
    (tmp_path / "conf").write_text(text)
    assert words in start_fails(tmp_path / "data", "--config", str(tmp_path / "conf"))
    assert not (tmp_path / "data").exists()


def test_two_daemons(daemon):
    assert "another selvedged is using it" in start_fails(daemon.data)
    assert daemon.get("/readyz").status_code == 200


@pytest.mark.skipif(os.geteuid() != 0 or shutil.which("unshare") is None, reason="mounting needs root")
def test_a_folder_that_cannot_be_written(tmp_path):
    with Daemon(tmp_path / "data"):
        pass
    mount = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$1" --data "$0" --port 0'
    done = subprocess.run(["unshare", "-m", "sh", "-c", mount, tmp_path / "data", program("selvedged")],
                          capture_output=True, text=True, check=False, timeout=150)
    if "mount" in done.stderr.split("error:")[0]:
        pytest.skip("this machine permits no mounts")
    assert done.returncode == 1 and done.stderr.startswith("error: cannot open") and "Read-only file system" in done.stderr, done.stderr


def test_rotation_of_logs_does_not_stop_the_service(tmp_path):
    with Daemon(tmp_path / "data") as d:
        job = d.create(document())
        d.process.send_signal(signal.SIGHUP)
        wait_until(lambda: "SIGHUP changes nothing" in d.log_text())
        assert d.job(job)["state"] == "draft" and d.process.poll() is None
