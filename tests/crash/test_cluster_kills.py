"""Two daemons on one PostgreSQL: a few kills, and a server that restarts (make test-cluster-kills: 200 kills)."""
import os
import threading
import time

import pytest
import requests

from cluster_kills import pair, run
from daemon_under_test import selvedged, settings_arguments, wait_until
from servers.postgres_server import PostgresMissing, PostgresServer


@pytest.fixture(scope="module")
def server():
    try:
        with PostgresServer() as s:
            yield s
    except PostgresMissing as why:
        pytest.skip(str(why))


@pytest.fixture
def daemons(server, tmp_path):
    made = [d.start() for d in pair(server, str(tmp_path))]
    yield made
    for d in made:
        d.stop()


def test_nothing_acknowledged_is_lost(server, tmp_path):
    count = run(server, str(tmp_path), 10, seed=7, pauses_s=(0, 0.2))
    assert count["kills"] >= 10 and count["facts"] > 20 and count["lost"] == 0


def test_jobs_of_a_killed_daemon_are_taken_over_at_once(daemons):
    """On one machine the other daemon sees that the process is gone, and need not wait for the end of the lease."""
    one, two = daemons
    jobs = [one.start_job("work 2") for _ in range(4)]
    wait_until(lambda: sum(two.job(j)["state"] == "running" for j in jobs) == 4, what="all jobs to run, two at each daemon")
    one.kill()
    for j in jobs:
        done = two.wait_state(j, "succeeded", timeout_s=30)
        assert done["lost_attempts"] == 0, "the daemon's death is not the job's fault"
    assert sorted(two.job(j)["attempt"] for j in jobs) == [1, 1, 2, 2]
    one.start()


def test_a_server_that_restarts_ends_no_job(daemons, server):
    one, two = daemons
    job = one.start_job("work 3")
    wait_until(lambda: two.job(job)["state"] == "running")
    server.stop("immediate")
    r = requests.post(one.url + "/v1/jobs", json={}, timeout=150)
    assert r.status_code >= 400
    assert requests.get(f"{one.url}/v1/jobs/{job}", timeout=150).status_code == 500
    server.start()
    wait_until(lambda: requests.get(f"{one.url}/v1/jobs/{job}", timeout=150).status_code == 200, 10, "the connection to be opened again")
    done = two.wait_state(job, "succeeded", timeout_s=30)
    assert done["attempt"] == 1
    assert two.start_job("succeed")


def test_a_daemon_that_was_stopped_for_long_finds_its_jobs_taken(daemons):
    """SIGSTOP for longer than the lease, then SIGCONT: the other daemon has the jobs, and each has one result."""
    one, two = daemons
    jobs = [one.start_job("work 2") for _ in range(3)]
    wait_until(lambda: sum(two.job(j)["state"] == "running" for j in jobs) == 3)
    one.process.send_signal(19)
    try:
        for j in jobs:
            two.wait_state(j, "succeeded", timeout_s=60)
    finally:
        one.process.send_signal(18)
    wait_until(lambda: "has lost its lease" in one.log_text(), 20, "the stopped daemon to learn of it")
    job = one.start_job("succeed")
    one.wait_state(job, "succeeded")
    log = one.log_text()
    assert all(log.count(f"job {j} is succeeded") == 1 for j in jobs)


def test_what_a_shared_folder_refuses(daemons, server, tmp_path):
    one, _ = daemons
    assert os.path.exists(os.path.join(one.data, "store.id"))
    other = pair(server, str(tmp_path))[0]  # another database for the same folder
    with pytest.raises(AssertionError, match="belongs to another database"):
        other.start()
    embedded = pair(server, str(tmp_path))[0]
    del embedded.options["server.store"]
    with pytest.raises(AssertionError, match="another selvedged is using it"):
        embedded.start()


def test_the_doctor_looks_at_database_and_folder(daemons, server):
    one, two = daemons
    settings = settings_arguments(one.options)
    said = selvedged(one.data, *settings, "--doctor", expect=1)  # the server of the tests does not sync
    assert "does not write safely" in said and "locks, syncs, O_EXCL and renames work" in said and "it is running" in said
    assert all(f"process {d.process.pid}, {d.url}: its lease lasts" in said for d in (one, two))
    assert server.password not in said and server.password not in one.log_text()
    said = selvedged(one.data, *settings, "--backup", "/nowhere", expect=1)
    assert "pg_dump" in said
    said = selvedged(one.data, "--set", f"server.store={server.address('none')}", "--doctor", expect=1)
    assert "no password supplied" in said
    said = selvedged(one.data, *settings, "--set", f"server.store={server.address(server.make_database())}", "--doctor", expect=1)
    assert "note   database     the database has no tables yet" in said and "its lease lasts" not in said


def test_a_list_that_waits_learns_of_changes_at_the_other_daemon(daemons):
    one, two = daemons
    job = one.create()
    r = two.get(f"/v1/jobs/{job}")
    begin = time.monotonic()
    threading.Timer(0.5, lambda: one.delete(f"/v1/jobs/{job}")).start()
    r = two.get(f"/v1/jobs/{job}?wait=60", headers={"If-None-Match": r.headers["ETag"]})
    assert r.status_code == 404 and time.monotonic() - begin < 50
