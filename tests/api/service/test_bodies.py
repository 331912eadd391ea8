"""Bodies: one memory for all of them, and a minimum rate in each window of ten seconds."""
import json
import os
import select
import socket
import threading
import time

import pytest
from daemon_under_test import DOCUMENT, FILES, TIMEOUT_S, problem, sha256, wait_until

MIB = 1 << 20


def resident_bytes(pid):
    with open(f"/proc/{pid}/statm", encoding="ascii") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def padded(n_bytes):
    """A job document with so many bytes."""
    text = json.dumps(DOCUMENT).encode()
    return text[:-1] + b" " * (n_bytes - len(text)) + b"}"


def begin(d, path, body, held_back):
    """Sends all of a request but its last bytes."""
    s = socket.create_connection(("127.0.0.1", d.port))
    s.sendall(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n".encode())
    s.sendall(body[:len(body) - held_back])
    return s


def hold(d, body):
    """A connection that has sent all of the body but its last byte, once the daemon has taken memory for the body. The
    daemon refuses it where a body of the polls is first, and then it is sent again."""
    def is_held():
        nonlocal s
        if select.select([s], [], [], 0)[0]:
            s.close()
            s = begin(d, "/v1/jobs", body, 1)
        return post(d, padded(300_000)).status_code == 503

    s = begin(d, "/v1/jobs", body, 1)
    wait_until(is_held)
    return s


def post(d, body):
    return d.post("/v1/jobs", data=body, headers={"Content-Type": "application/json"})


def test_bodies_share_one_memory(daemon_maker):
    d = daemon_maker(options={"server.body_memory_bytes": MIB})
    held = hold(d, padded(900_000))
    refused = post(d, padded(300_000))
    problem(refused, 503, "busy")
    assert 1 <= int(refused.headers["Retry-After"]) <= 60
    assert post(d, padded(100_000)).status_code == 201  # what still has room
    assert d.get("/v1/jobs").status_code == 200
    held.sendall(b"}")
    assert held.recv(100).startswith(b"HTTP/1.1 201 ")
    assert post(d, padded(300_000)).status_code == 201
    held.close()
    for _ in range(3):  # a connection that ends gives back its part
        begin(d, "/v1/jobs", padded(900_000), 1).close()
    wait_until(lambda: post(d, padded(1_000_000)).status_code == 201)


def test_a_body_larger_than_the_memory_is_accepted_alone(daemon_maker):
    d = daemon_maker(options={"server.body_memory_bytes": MIB})
    files = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, (_, data) in FILES.items()]
    table = {"name": "large", "template": DOCUMENT, "samples": [{"sample": "fake: succeed", "files": files}]}
    text = json.dumps(table) + " " * 3 * MIB
    assert d.post("/v1/batches", data=text, headers={"Content-Type": "application/json"}).status_code == 201


def test_a_body_of_too_many_values_is_refused_before_it_is_parsed(daemon_maker):
    d = daemon_maker()
    before = resident_bytes(d.process.pid)
    r = d.post("/v1/batches", data="[" + "[]," * 5_000_000 + "[]]", headers={"Content-Type": "application/json"})
    assert "more than 1000000 values" in problem(r, 422, "invalid")["detail"]
    assert resident_bytes(d.process.pid) - before < 60 * MIB


@pytest.mark.slow
def test_40_clients_that_hold_back_the_end_of_a_batch(daemon_maker):
    d = daemon_maker()
    post(d, padded(1000))
    before, start, body = resident_bytes(d.process.pid), time.monotonic(), b"{" + b" " * (16 * MIB - 1)
    held, most = [], 0
    threads = [threading.Thread(target=lambda: held.append(begin(d, "/v1/batches", body, 1))) for _ in range(40)]
    for t in threads:
        t.start()
    while any(t.is_alive() for t in threads):
        most = max(most, resident_bytes(d.process.pid))
        time.sleep(0.05)
    assert len(held) == 40 and most - before < 120 * MIB, f"{(most - before) / MIB} MiB"
    problem(post(d, padded(200_000)), 503, "busy")
    assert d.get("/livez").ok
    for s in held:  # each is ended, though it had sent 16 MB in a moment
        s.settimeout(60)
        try:
            answer = s.recv(4096)
        except ConnectionError:
            answer = b""
        assert not answer or answer.startswith((b"HTTP/1.1 408 ", b"HTTP/1.1 503 ")), answer
        s.close()
    assert time.monotonic() - start < 60 * TIMEOUT_S
    wait_until(lambda: post(d, padded(200_000)).status_code == 201)
    assert wait_until(lambda: resident_bytes(d.process.pid) - before < 40 * MIB)


@pytest.mark.slow
def test_slow_clients_do_not_keep_the_memory(daemon_maker):
    """They send 4 kB/s, more than the minimum. A body of 700 kB may take 21 s once others need the memory."""
    d = daemon_maker(options={"server.body_memory_bytes": MIB})
    answers, started = [], []

    def trickle():
        s = begin(d, "/v1/jobs", padded(700_000), 699_000)
        started.append(time.monotonic())
        s.settimeout(1)
        while not answers:
            try:
                s.sendall(b" " * 4096)
                answers.append(s.recv(100))
            except TimeoutError:
                pass
            except ConnectionError:
                answers.append(b"")
        s.close()

    def memory_is_held():
        """On a machine so busy that the client itself is too slow, it is ended before; then another one begins."""
        if answers or not started:
            answers.clear()
            threads.append(threading.Thread(target=trickle))
            threads[-1].start()
            wait_until(lambda: len(started) == len(threads))
        return post(d, padded(500_000)).status_code == 503

    threads = []
    try:
        wait_until(memory_is_held)
        accepted_s = None
        while accepted_s is None and time.monotonic() - started[-1] < 60 * TIMEOUT_S:
            accepted_s = time.monotonic() - started[-1] if post(d, padded(500_000)).status_code == 201 else None
            time.sleep(0.3)
        assert accepted_s is not None and accepted_s > 20
    finally:
        answers.append(b"the test has ended")
        for thread in threads:
            thread.join()
    assert answers[0] == b"" or answers[0].startswith(b"HTTP/1.1 408 ")


@pytest.mark.slow
def test_a_body_that_is_stored_slowly_is_not_ended(daemon_maker, shim, tmp_path):
    hold = tmp_path / "hold"
    d = daemon_maker(options={"upload.commit_bytes": 65536}, environment={"LD_PRELOAD": shim, "FAULT_HOLD_SYNC": str(hold)})
    url = d.declare(d.create(), "scan.tif", b"x" * 500_000)["upload_url"]
    hold.touch()
    threading.Timer(14, hold.unlink).start()
    assert d.patch(url, 0, b"x" * 500_000).status_code == 204
