"""Long polls: a change ends the wait, nothing else does, and many that wait cost neither processor time nor answers to others."""
import http.client
import os
import socket
import threading
import time

import pytest
from daemon_under_test import document, problem, wait_until

N_WATCHER = 200


def tag_of(daemon, path):
    return daemon.get(path).headers["ETag"]


class Waiting(threading.Thread):
    """A long poll on a connection of its own."""
    def __init__(self, daemon, path, tag, wait=30):
        super().__init__(daemon=True)
        self.client = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=450)
        self.path, self.tag, self.status, self.took_s = f"{path}?wait={wait}", tag, None, None
        self.start()

    def run(self):
        begin = time.monotonic()
        try:
            self.client.request("GET", self.path, headers={"If-None-Match": self.tag})
            answer = self.client.getresponse()
            answer.read()
            self.status, self.tag = answer.status, answer.headers["ETag"]
        except http.client.RemoteDisconnected:
            self.status = "closed"
        self.took_s = time.monotonic() - begin
        self.client.close()


def n_waiting(daemon):
    """The number of requests that wait for a change: each has an event descriptor."""
    folder = f"/proc/{daemon.process.pid}/fd"
    n = 0
    for fd in os.listdir(folder):
        try:
            n += "eventfd" in os.readlink(os.path.join(folder, fd))
        except OSError:
            continue
    return n


def cpu_s(daemon):
    with open(f"/proc/{daemon.process.pid}/stat", encoding="ascii") as f:
        fields = f.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("watched", ["job", "list"])
def test_a_change_ends_the_wait(daemon, watched):
    job = daemon.create()
    path = f"/v1/jobs/{job}" if watched == "job" else "/v1/jobs"
    before = n_waiting(daemon)
    w = Waiting(daemon, path, tag_of(daemon, path))
    wait_until(lambda: n_waiting(daemon) == before + 1)
    assert w.status is None
    daemon.post(f"/v1/jobs/{job}/cancel")
    w.join(50)
    assert w.status == 200 and w.tag == tag_of(daemon, path)
    assert wait_until(lambda: n_waiting(daemon) == before)


def test_another_job_does_not_end_the_wait(daemon):
    job, other = daemon.create(), daemon.create()
    before = n_waiting(daemon)
    """Whether it was looked at for nothing is a matter of cost, which test_change_feed looks at."""
    w = Waiting(daemon, f"/v1/jobs/{job}", tag_of(daemon, f"/v1/jobs/{job}"), wait=1)
    wait_until(lambda: n_waiting(daemon) == before + 1)
    daemon.post(f"/v1/jobs/{other}/cancel")
    w.join(50)
    assert w.status == 304 and w.took_s > 0.99


def test_what_does_not_wait(daemon):
    job = daemon.create()
    path = f"/v1/jobs/{job}"
    for headers, wait, status in (({}, 60, 200), ({"If-None-Match": '"old"'}, 60, 200), ({"If-None-Match": tag_of(daemon, path)}, 0, 304)):
        assert daemon.get(path, params={"wait": wait}, headers=headers, timeout=100).status_code == status
    problem(daemon.get(path, params={"wait": 61}), 422, "invalid", "wait")
    problem(daemon.get("/v1/jobs", params={"wait": "x"}), 422, "invalid", "wait")


def test_a_worker_ends_the_wait(daemon):
    """Progress of a running job, which no request has made."""
    job = daemon.start_job("climb")
    wait_until(lambda: daemon.job(job)["fraction"] > 0.1)
    for path in [f"/v1/jobs/{job}"] * 3 + ["/v1/jobs"] * 2:
        w = Waiting(daemon, path, tag_of(daemon, path))
        w.join(50)
        assert w.status == 200
    assert daemon.job(job)["state"] == "running"
    daemon.delete(f"/v1/jobs/{job}")


@pytest.mark.slow
def test_a_wait_longer_than_the_idle_timeout_is_answered(daemon_maker):
    d = daemon_maker(options={"server.idle_timeout_s": 1})
    w = Waiting(d, "/v1/jobs", tag_of(d, "/v1/jobs"), wait=2)
    w.join(50)
    assert w.status == 304


def test_a_client_that_goes_away_is_not_waited_for(daemon):
    before = n_waiting(daemon)
    tag = tag_of(daemon, "/v1/jobs")
    with socket.create_connection(("127.0.0.1", daemon.port)) as s:
        s.sendall(f"GET /v1/jobs?wait=60 HTTP/1.1\r\nHost: localhost\r\nIf-None-Match: {tag}\r\n\r\n".encode())
        wait_until(lambda: n_waiting(daemon) == before + 1)
    wait_until(lambda: n_waiting(daemon) == before)


@pytest.mark.slow
def test_many_watchers_keep_nobody_waiting(daemon_maker):
    d = daemon_maker()
    job = d.create(document("succeed"))
    path = f"/v1/jobs/{job}"
    before = n_waiting(d)
    watchers = [Waiting(d, p, tag_of(d, p)) for p in [path, "/v1/jobs"] * (N_WATCHER // 2)]
    wait_until(lambda: n_waiting(d) == before + N_WATCHER)
    used_s, begin = cpu_s(d), time.monotonic()
    time.sleep(0.3)
    share = (cpu_s(d) - used_s) / (time.monotonic() - begin)
    assert share < 0.2, "a loop that looks again and again would use a whole processor"
    assert d.get("/livez").status_code == 200
    d.post(f"{path}/cancel")
    for w in watchers:
        w.join(30)
    assert {w.status for w in watchers} == {200}


def test_a_stop_ends_the_wait(daemon_maker):
    d = daemon_maker()
    before = n_waiting(d)
    w = Waiting(d, "/v1/jobs", tag_of(d, "/v1/jobs"), wait=60)
    wait_until(lambda: n_waiting(d) == before + 1)
    begin = time.monotonic()
    d.stop()
    w.join(50)
    assert w.status in (304, "closed") and time.monotonic() - begin < 50
