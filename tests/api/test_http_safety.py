"""Hostile and careless clients: ambiguous framing, slow requests, pages of other sites, many idle connections."""
import json
import os
import re
import socket
import subprocess
import time

import pytest
from daemon_under_test import DOCUMENT, Daemon, ROOT, TIMEOUT_S, problem, program, wait_until


def raw(daemon, text, wait_s=10):
    """Sends bytes, and reads until the server closes the connection or is silent for a while after a reply."""
    with socket.create_connection(("127.0.0.1", daemon.port)) as s:
        s.sendall(text if isinstance(text, bytes) else text.encode())
        s.settimeout(wait_s)
        answer = b""
        try:
            while True:
                piece = s.recv(65536)
                if not piece:
                    return answer, True
                answer += piece
                s.settimeout(0.5)
        except socket.timeout:
            return answer, False


SMUGGLED = "GET /v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\n"


@pytest.mark.parametrize("headers, status, code", [
    ("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n", 400, "length_and_chunked"),
    ("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n", 400, "length_and_chunked"),
    ("Content-Length: 5\r\nContent-Length: 6\r\n", 400, "duplicate_header"),
    ("Content-Length: 5\r\nContent-Length: 5\r\n", 400, "duplicate_header"),
    ("Transfer-Encoding: chunked\r\n", 411, "length_required"),
    ("Transfer-Encoding: gzip, chunked\r\n", 411, "length_required"),
    ("Content-Length: 5\r\nContent-Type: application/json\r\nContent-Type: text/plain\r\n", 400, "duplicate_header"),
    ("Transfer-Encoding:\r\n chunked\r\n", 400, "malformed"),
    ("Transfer-Encoding:\r\n\tchunked\r\nContent-Length: 5\r\n", 400, "malformed"),
    ("Transfer-Encoding: identity,\r\n chunked\r\n", 400, "malformed"),
    ("Content-Length:\r\n 5\r\n", 400, "malformed"),
    ("Content-Length: 5\r\n 0\r\n", 400, "malformed"),
])
def test_ambiguous_framing_is_refused_and_the_connection_closed(daemon, headers, status, code):
    answer, closed = raw(daemon, f"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\n{headers}\r\n0\r\n\r\n" + SMUGGLED)
    assert answer.startswith(f"HTTP/1.1 {status} ".encode()), answer[:200]
    assert f'"{code}"'.encode() in answer
    assert answer.count(b"HTTP/1.1 ") == 1, "the smuggled request was answered"
    assert closed


@pytest.mark.parametrize("text", [
    "\r\n\r\n", "GET\r\n\r\n", "GET / HTTP/9.9\r\n\r\n", "GET / HTTP/1.1\r\n\r\n", "\0\0\0\0\r\n\r\n",
    "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
    "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5x\r\n\r\nabcde",
    "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999\r\n\r\n",
    "GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n", "GET /" + "a" * 400000 + " HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET / HTTP/1.1\r\nHost: localhost\r\n" + "X: y\r\n" * 50000 + "\r\n", "BREW /v1/jobs HTTP/1.1\r\nHost: localhost\r\n\r\n",
])
def test_nonsense_gets_an_error_and_does_no_harm(daemon, text):
    answer, _ = raw(daemon, text, wait_s=2)
    assert not answer or re.match(rb"HTTP/1\.[01] [45]\d\d ", answer), answer[:100]
    assert daemon.get("/livez").json() == {"status": "alive"}


@pytest.mark.parametrize("text", [
    "GET /livez\0x HTTP/1.1\r\nHost: localhost\r\n\r\n", "GET /livez\0 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /livez?a\0b HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET\0x /livez HTTP/1.1\r\nHost: localhost\r\n\r\n", "GET /livez\1 HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /livez x HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /livez HTTP/1.1\r\n\r\n", "GET /livez HTTP/1.1\r\nHost: localhost\r\nX y\r\n\r\n", "GET /livez\r\n\r\n",
    "GET\t/livez HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n",
    "GET /livez HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999\r\n\r\n",
    "GET /livez HTTP/9.9\r\nHost: localhost\r\n\r\n", "GET /" + "a" * 400000 + " HTTP/1.1\r\nHost: localhost\r\n\r\n",
    "GET /livez HTTP/1.1\r\nHost: localhost\r\nX: " + "y" * 300000 + "\r\n\r\n",
])
@pytest.mark.parametrize("before", ["", "GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"])
def test_what_cannot_be_understood_gets_one_problem_document(daemon, text, before):
    answer, closed = raw(daemon, before + text)
    if before:
        first, answer = answer.split(b'{"status":"alive"}')
        assert first.startswith(b"HTTP/1.1 200 ")
    head, body = answer.split(b"\r\n\r\n", 1)
    assert closed and answer.count(b"HTTP/1.1 ") == 1 and b"Content-Type: application/problem+json" in head, answer[:300]
    said = json.loads(body)
    assert head.startswith(f"HTTP/1.1 {said['status']} ".encode()) and said["status"] in (400, 413, 414, 431, 505)
    assert said["type"] == f"urn:selvedge:problem:{said['code']}" and said["title"] and said["detail"]


def test_expect_continue_is_answered_before_the_body(daemon):
    answer, closed = raw(daemon, "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: text/plain\r\n"
                         "Content-Length: 5000\r\nExpect: 100-continue\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 415 ") and closed
    answer, _ = raw(daemon, "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                    "Content-Length: 5000\r\nExpect: 100-continue\r\n\r\n", 2)
    assert answer.startswith(b"HTTP/1.1 100 ")


@pytest.mark.parametrize("host, fine", [("localhost", True), ("LocalHost:1234", True), ("127.0.0.1", True), ("[::1]:80", True), ("evil.example", False),
                                        ("localhost.evil.example", False), ("127.0.0.1.evil.example", False), ("localhost:80@evil", False), ("", False)])
def test_host_names_of_others_are_refused(daemon, host, fine):
    answer, _ = raw(daemon, f"GET /v1/jobs HTTP/1.1\r\nHost: {host}\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 200 " if fine else b"HTTP/1.1 400 ")


def test_pages_of_other_sites_change_nothing(daemon):
    job = daemon.create()
    for origin in ["http://evil.example", "null", f"https://127.0.0.1:{daemon.port}", "http://127.0.0.1:1"]:
        problem(daemon.post(f"/v1/jobs/{job}/cancel", headers={"Origin": origin}), 403, "origin")
        problem(daemon.delete(f"/v1/jobs/{job}", headers={"Origin": origin}), 403, "origin")
    assert daemon.job(job)["state"] == "draft"
    assert daemon.post(f"/v1/jobs/{job}/cancel", headers={"Origin": daemon.url}).status_code == 200
    r = daemon.get("/v1/jobs", headers={"Origin": "http://evil.example"})
    assert not any(h.lower().startswith("access-control") for h in r.headers)


@pytest.mark.parametrize("address", ["0.0.0.0", "192.168.1.1", "::", "8.8.8.8"])
def test_other_addresses_are_refused_without_tokens(tmp_path, address):
    r = subprocess.run([program("selvedged"), "--data", str(tmp_path / "d"), "--port", "0", "--listen", address, "--worker", "/bin/true"],
                       capture_output=True, text=True, timeout=150)
    assert r.returncode == 1 and "only loopback addresses" in r.stderr and address in r.stderr


@pytest.mark.slow
def test_slow_drip(daemon_maker):
    d = daemon_maker(options={"server.header_deadline_s": 2, "server.min_rate_bytes_per_s": 1000})
    job = d.create()
    url = d.declare(job, "scan.tif", b"x" * 100_000)["upload_url"]
    head = socket.create_connection(("127.0.0.1", d.port))
    body = socket.create_connection(("127.0.0.1", d.port))
    body.sendall(f"PATCH {url} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: 0\r\nContent-Type: application/offset+octet-stream\r\n"
                 "Content-Length: 100000\r\n\r\n".encode())
    ended, start = {}, time.monotonic()
    for s in (head, body):
        s.setblocking(False)
    text = iter(b"GET /v1/jobs HTTP/1.1\r\nX: " + b"y" * 1000)
    while len(ended) < 2 and time.monotonic() - start < 40 * TIMEOUT_S:
        for name, s in (("head", head), ("body", body)):
            if name in ended:
                continue
            try:
                s.send(bytes([next(text)]) if name == "head" else b"x")
            except OSError:
                pass
            try:
                ended[name] = (s.recv(4096), time.monotonic() - start)
            except BlockingIOError:
                pass
            except OSError:
                ended[name] = (b"", time.monotonic() - start)
        time.sleep(0.1)
    assert set(ended) == {"head", "body"}, ended
    assert ended["head"][1] < 8 and ended["head"][0].startswith(b"HTTP/1.1 408 ")
    assert ended["body"][1] < 20 and ended["body"][0].startswith(b"HTTP/1.1 408 ")
    length = re.search(rb"Content-Length: (\d+)\r\n", ended["head"][0]).group(1)
    assert len(ended["head"][0].split(b"\r\n\r\n", 1)[1]) == int(length)
    assert 0 < d.offset(url) < 1000, "what the slow client had sent is kept"


def test_a_thousand_idle_clients(daemon_maker):
    import resource
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft < 1200:
        if hard != resource.RLIM_INFINITY and hard < 1200:
            pytest.skip("not enough descriptors")
        resource.setrlimit(resource.RLIMIT_NOFILE, (1200, hard))
    d = daemon_maker()
    idle = [socket.create_connection(("127.0.0.1", d.port)) for _ in range(1000)]
    start = time.monotonic()
    for _ in range(10):
        assert d.get("/v1/jobs").status_code == 200
    print(f"a request beside 1000 idle connections: {(time.monotonic() - start) * 100:.1f} ms")
    connections = float(re.search(r"^selvedge_http_connections (\S+)", d.get("/metrics").text, re.M).group(1))
    assert connections >= 1000
    # not all at once: a thread of libmicrohttpd 0.9.75 that finds a multiple of 128 events waits for one more before it handles them
    for i, s in enumerate(idle):
        s.close()
        if i % 20 == 0:
            time.sleep(0.01)
    wait_until(lambda: float(re.search(r"^selvedge_http_connections (\S+)", d.get("/metrics").text, re.M).group(1)) < 50, what="closing")


def test_one_daemon_per_data_folder(daemon):
    second = Daemon(daemon.data)
    with pytest.raises(AssertionError, match="another selvedged is using it"):
        second.start()
    assert daemon.get("/livez").ok


def test_dashboard_and_vendor_files(daemon):
    page = daemon.get("/")
    if page.status_code == 200:
        assert page.headers["Content-Type"].startswith("text/html")
    for path, kind in [("/vendor/dygraph.min.js", "text/javascript"), ("/vendor/dygraph.min.css", "text/css"), ("/vendor/three.min.js", "text/javascript"),
                       ("/vendor/three.module.js", "text/javascript")]:
        r = daemon.get(path)
        assert r.status_code == 200 and r.headers["Content-Type"].startswith(kind) and len(r.content) > 500
    for r in (daemon.get("/vendor/three.min.js"), page, daemon.get("/nothing")):
        assert "default-src 'self'" in r.headers["Content-Security-Policy"] and r.headers["X-Content-Type-Options"] == "nosniff"
    for name in ("README.md", "dashboard_test.py", "../cli/commands/cli_main.c"):
        problem(daemon.get("/" + name), 404, "not_found")


def test_web_folder_option(daemon_maker, tmp_path):
    web = tmp_path / "web"
    (web / "parts").mkdir(parents=True)
    (web / "index.html").write_text("<p>hello")
    (web / "parts" / "a.js").write_text("1")
    (web / "secret.conf").write_text("x")
    os.symlink("/etc/passwd", web / "passwd.html")
    d = daemon_maker(options={"server.web": str(web)})
    assert d.get("/").text == "<p>hello" and d.get("/parts/a.js").text == "1"
    for path in ("/secret.conf", "/passwd.html", "/parts/", "/parts"):
        problem(d.get(path), 404, "not_found")


def test_health_and_metrics(daemon):
    assert daemon.get("/livez").json() == {"status": "alive"} and daemon.get("/readyz").json() == {"status": "ready"}
    daemon.create()
    text = daemon.get("/metrics").text
    for line in text.splitlines():
        assert re.match(r"# (HELP|TYPE) [a-z_]+ .+$|[a-z_]+(\{[a-z]+=\"[a-z0-9_]+\"\})? [0-9.e+-]+$", line), line
    assert re.search(r'^selvedge_jobs\{state="draft"\} [1-9]', text, re.M)
    assert "process_resident_memory_bytes" in text and not re.search(r"[0-9a-f]{8}-[0-9a-f]{4}", text)


def test_disk_floor(daemon_maker):
    d = daemon_maker()
    job = d.ready_job()
    d.stop()
    d.options["disk.floor_bytes"] = 1 << 60
    d.start()
    problem(d.post("/v1/jobs", json=DOCUMENT), 507, "disk_full")
    problem(d.post(f"/v1/jobs/{job}/start"), 507, "disk_full")
    problem(d.post(f"/v1/jobs/{job}/files", json={"name": "more.tif", "role": "volume", "size": 5}), 507, "disk_full")
    problem(d.get("/readyz"), 503, "not_ready")
    assert d.delete(f"/v1/jobs/{job}").status_code == 204


def test_versions_and_options(tmp_path):

    def run(*a):
        return subprocess.run([program("selvedged"), *a], capture_output=True, text=True, timeout=150, cwd=tmp_path)
    assert run("--version").stdout.startswith("selvedged ")
    assert run("--help").returncode == 0
    for bad in (["--port", "x"], ["--port", "70000"], ["--set", "jobs.nothing=1"], ["--set", "x"], ["stray"], ["--config", "/nonexistent.conf"]):
        r = run(*bad)
        assert r.returncode == 2 and r.stderr.startswith(("error: ", "/")), (bad, r.stderr)
    r = run("--data", "d", "--worker", "/no/such/worker", "--port", "0")
    assert r.returncode == 1 and "/no/such/worker" in r.stderr
    assert not os.path.exists(os.path.join(ROOT, "d"))
