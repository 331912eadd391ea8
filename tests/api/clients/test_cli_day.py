"""The command line in daily work: short ids, filters, help, pipes that end early, and words that are true."""
import os
import re
import subprocess
import threading
import time

import pytest
from daemon_under_test import program

SELVEDGE = program("selvedge")


def run(daemon, *words, expect=0):
    done = subprocess.run([SELVEDGE, "--server", daemon.url, *words], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == expect, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def job(daemon):
    job = daemon.start_job()
    daemon.wait_state(job, "succeeded")
    daemon.put(f"/v1/jobs/{job}/tags", json={"tags": ["a&b"]})
    return job


def test_short_ids(daemon, job):
    assert job in run(daemon, "status", "--json", job[:8]) and job in run(daemon, "status", "--json", job)
    assert "no job has an id that begins with" in run(daemon, "status", "0123456", expect=1)
    assert "not a job id" in run(daemon, "status", "a/b", expect=1)
    first = {}
    while True:  # until two jobs begin alike
        one = daemon.create()
        if one[:1] in first:
            break
        first[one[:1]] = one
    assert "does not exist" in run(daemon, "cancel", one[:3], expect=1)  # too short to stand for a job


def test_filters(daemon, job):
    draft = daemon.create()
    assert job in run(daemon, "list", "--state", "succeeded,failed") and draft not in run(daemon, "list", "--state", "succeeded,failed")
    assert job in run(daemon, "list", "--tag", "a&b") and "no job fits" in run(daemon, "list", "--tag", "a")
    assert job in run(daemon, "list", "--sample", "FAKE:", "--days", "1") and "no job fits" in run(daemon, "list", "--verdict", "good")
    assert "states between commas" in run(daemon, "list", "--state", "asleep", expect=1)
    assert "--days" in run(daemon, "list", "--days", "soon", expect=1)


def test_help(daemon):
    assert "usage: selvedge COMMAND" in run(daemon, "help")
    for words in (("help", "list"), ("list", "--help")):
        assert "--verdict" in run(daemon, *words)
    assert "did you mean 'list'" in run(daemon, "help", "lits", expect=2)


def test_what_did_nothing_says_so(daemon, job):
    assert "nothing to do, it is already succeeded" in run(daemon, "cancel", job)
    draft = daemon.create()
    assert "cancelled (now cancelled)" in run(daemon, "cancel", draft) and "already cancelled" in run(daemon, "cancel", draft)
    running = daemon.start_job("work 60")
    daemon.wait_state(running, "running")
    assert "nothing to do, it is already running" in run(daemon, "retry", running)
    assert re.search(r"cancellation requested \(now (running|cancelled)\)", run(daemon, "cancel", running))  # its worker may end at once
    daemon.wait_state(running, "cancelled")
    assert re.search(r"continues from its last checkpoint \(now (queued|running)\)", run(daemon, "retry", running))
    daemon.delete(f"/v1/jobs/{running}")


def test_a_reader_that_has_seen_enough(daemon, job):
    for _ in range(150):
        daemon.create()
    pipe = f"'{SELVEDGE}' --server {daemon.url} list | head -1"
    done = subprocess.run(["/bin/bash", "-o", "pipefail", "-c", pipe], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stderr == "" and done.stdout.startswith("id")
    with open("/dev/full", "w", encoding="ascii") as full:  # a disk that is full is an error all the same
        assert subprocess.run([SELVEDGE, "--server", daemon.url, "list"], stdout=full, stderr=subprocess.PIPE, check=False).returncode == 1


def test_a_daemon_that_is_starting_is_waited_for(daemon_maker):
    daemon = daemon_maker()
    daemon.create()
    port = daemon.port
    daemon.stop()
    daemon.command = lambda: [word if word != "0" else str(port) for word in type(daemon).command(daemon)]
    later = threading.Thread(target=lambda: (time.sleep(1), daemon.start()))
    later.start()
    assert "fake: succeed" in run(daemon, "list")
    later.join()
    assert os.path.exists(daemon.data)
