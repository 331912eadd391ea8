"""Requests that two programs could read differently, and what must not be left behind or stand open."""
import fcntl
import os
import socket
import subprocess
import threading

import pytest
from daemon_under_test import DOCUMENT, Daemon, document, problem, program


def answers(daemon, head, body=b""):
    """Sends bytes; the codes of all answers, and whether the server then closed the connection."""
    got = b""
    with socket.create_connection(("127.0.0.1", daemon.port)) as s:
        s.settimeout(20)
        s.sendall(head + body)
        try:
            while piece := s.recv(65536):
                got += piece
        except ConnectionError:
            pass
        except socket.timeout:
            return got, False
    return got, True


@pytest.mark.parametrize("line", [
    b"X(A: 1", b"Content-Length : 3", b"Transfer-Encoding\t: chunked", b"X-A: a\rb", b"X-A: a\0b", b"X\0A: b", b"Content-Length:", b"Content-Length: ",
    b"Content-Length: 1\r\n 5", b"Content-Length:\r\n 5", b"Transfer-Encoding:\r\n chunked", b"X-A: 1\nX-B: 2", b"\xc3\xa4: 1", b"no colon"])
def test_ambiguous_headers_are_refused_and_the_connection_closed(daemon, line):
    smuggled = b"GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\n"
    got, closed = answers(daemon, b"GET /livez HTTP/1.1\r\nHost: localhost\r\n" + line + b"\r\n\r\n", smuggled)
    assert got.startswith(b"HTTP/1.1 400") and closed and b"jobs" not in got and b"200 OK" not in got


def test_a_missing_length_closes_the_connection(daemon):
    head = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n\r\n"
    got, closed = answers(daemon, head, b"GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\n")
    assert got.startswith(b"HTTP/1.1 411") and closed and got.count(b"HTTP/1.1") == 1


def test_a_failed_creation_leaves_no_folder(daemon_maker, shim, tmp_path):
    mark = tmp_path / "mark"
    d = daemon_maker(environment={"LD_PRELOAD": shim, "FAULT_CALL": "sync", "FAULT_AT": "1", "FAULT_PATH": "data/jobs", "FAULT_MARK": str(mark),
                                  "FAULT_ERRNO": "5"})
    answer = None
    while not mark.exists():
        assert answer is None or answer.status_code == 201
        answer = d.post("/v1/jobs", json=DOCUMENT)
    problem(answer, 500, "io")
    jobs = [j["id"] for j in d.get("/v1/jobs").json()["jobs"]]
    assert sorted(os.listdir(tmp_path / "data" / "jobs")) == sorted(jobs)


@pytest.mark.parametrize("mode", [0o770, 0o702, 0o777])
def test_a_data_folder_that_others_may_write_is_refused(tmp_path, mode):
    data = tmp_path / "data"
    data.mkdir()
    os.chmod(data, mode)
    done = subprocess.run([program("selvedged"), "--data", data, "--port", "0"], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "may write into it" in done.stderr and os.listdir(data) == []


def test_a_lock_that_is_held_for_a_moment_delays_the_start(tmp_path):
    """As by the child of a killed daemon before it becomes a worker."""
    os.makedirs(tmp_path / "data", mode=0o700)
    with open(tmp_path / "data" / "lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        release = threading.Timer(0.3, lambda: fcntl.flock(lock, fcntl.LOCK_UN))
        release.start()
        with Daemon(tmp_path / "data") as d:
            assert d.get("/livez").status_code == 200
        release.join()


def test_the_console_is_bounded_and_keeps_its_last_words(daemon):
    job = daemon.ready_job()
    daemon.put(f"/v1/jobs/{job}/document", json=document("chatter 8000"))
    daemon.post(f"/v1/jobs/{job}/start")
    assert daemon.wait_state(job, "failed")["error"]["text"].endswith("these are my last words")
    assert os.path.getsize(os.path.join(daemon.data, "jobs", job, "console.txt")) <= 1 << 20


@pytest.mark.parametrize("body, word", [(b'{"size": 99999999999999999999}', "too large"), (b'{"name": "a\\u0000b"}', "NUL"), (b'{"a\\u0000b": 1}', "NUL")])
def test_json_beyond_what_can_be_represented(daemon, body, word):
    """It is JSON, so 400 would be untrue."""
    job = daemon.create()
    for path in ("/v1/jobs", f"/v1/jobs/{job}/files"):
        r = daemon.post(path, data=body, headers={"Content-Type": "application/json"})
        assert word in problem(r, 422, "invalid")["detail"]


def test_an_empty_hash_is_not_taken_for_none(daemon):
    r = daemon.post(f"/v1/jobs/{daemon.create()}/files", json={"name": "scan.tif", "role": "volume", "size": 10, "sha256": ""})
    problem(r, 422, "invalid", "sha256")
