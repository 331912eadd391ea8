"""Declaring files, and the tus protocol."""
import contextlib
import os
import socket
import sqlite3
import threading
import time

import pytest
from daemon_under_test import BUILD, TUS, problem, sha256, wait_until


def declaration(**change):
    return {"name": "scan.tif", "role": "volume", "size": 10, "sha256": None, **change}


@pytest.mark.parametrize("change, status, code, field", [
    ({"name": "../x"}, 422, "invalid", "name"),
    ({"name": "a/b"}, 422, "invalid", "name"),
    ({"name": ".hidden"}, 422, "invalid", "name"),
    ({"name": ""}, 422, "invalid", "name"),
    ({"name": "a\u0000b"}, 422, "invalid", "name"),
    ({"name": "a\u0085b"}, 422, "invalid", "name"),
    ({"name": "ä" * 64}, 422, "invalid", "name"),
    ({"name": "x" * 128}, 422, "invalid", "name"),
    ({"name": 3}, 422, "invalid", "name"),
    ({"role": "poem"}, 422, "invalid", "role"),
    ({"size": 0}, 422, "invalid", "size"),
    ({"size": -5}, 422, "invalid", "size"),
    ({"size": 1.5}, 422, "invalid", "size"),
    ({"size": 1 << 62}, 413, "too_large", "size"),
    ({"sha256": "abc"}, 422, "invalid", "sha256"),
    ({"sha256": "g" * 64}, 422, "invalid", "sha256"),
    ({"colour": "red"}, 422, "invalid", "colour"),
])
def test_declaration_errors(daemon, change, status, code, field):
    job = daemon.create()
    r = daemon.post(f"/v1/jobs/{job}/files", json=declaration(**change))
    if change.get("name") == "a\u0000b":  # refused while reading the JSON
        assert r.status_code in (400, 422)
        return
    problem(r, status, code, field)
    assert daemon.job(job)["files"] == []


def test_declare_twice(daemon):
    job = daemon.create()
    first = daemon.post(f"/v1/jobs/{job}/files", json=declaration())
    again = daemon.post(f"/v1/jobs/{job}/files", json=declaration())
    assert (first.status_code, again.status_code) == (201, 200) and first.json() == again.json()
    assert first.headers["Location"] == first.json()["upload_url"]
    problem(daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=11)), 409, "exists", "name")
    assert daemon.delete(f"/v1/jobs/{job}/files/scan.tif").status_code == 204
    assert daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=11)).status_code == 201
    problem(daemon.delete(f"/v1/jobs/{job}/files/other.tif"), 404, "not_found")


def test_pieces_offsets_and_the_finished_file(daemon):
    job, data = daemon.create(), os.urandom(3_000_000)
    url = daemon.declare(job, "scan.tif", data)["upload_url"]
    head = daemon.request("HEAD", url, headers=TUS)
    assert head.headers["Upload-Offset"] == "0" and head.headers["Upload-Length"] == str(len(data))
    assert head.headers["Cache-Control"] == "no-store" and head.headers["Tus-Resumable"] == "1.0.0"
    r = daemon.patch(url, 0, data[:1_000_000])
    assert r.status_code == 204 and r.headers["Upload-Offset"] == "1000000"
    assert daemon.job(job)["files"][0]["offset"] == 1_000_000
    wrong = daemon.patch(url, 5, data[5:])
    problem(wrong, 409, "offset", "Upload-Offset")
    assert wrong.headers["Upload-Offset"] == "1000000"
    problem(daemon.get(f"/v1/jobs/{job}/files/scan.tif"), 409, "conflict")
    problem(daemon.patch(url, 1_000_000, data[1_000_000:] + b"more"), 413, "too_large")
    assert daemon.offset(url) == 1_000_000
    assert daemon.patch(url, 1_000_000, b"").status_code == 204
    r = daemon.patch(url, 1_000_000, data[1_000_000:])
    assert r.status_code == 204 and r.headers["Upload-Offset"] == str(len(data))
    file = daemon.job(job)["files"][0]
    assert file["state"] == "complete" and file["sha256"] == sha256(data) and file["upload_url"] is None
    assert daemon.get(file["url"]).content == data
    problem(daemon.patch(url, 0, data), 409, "offset")
    assert daemon.offset(url) == len(data)


def test_sha256_may_be_declared_in_capitals(daemon):
    job, data = daemon.create(), b"all of a scan"
    r = daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=len(data), sha256=sha256(data).upper()))
    assert r.status_code == 201 and r.json()["sha256"] == sha256(data)
    assert daemon.patch(r.json()["upload_url"], 0, data).status_code == 204
    assert daemon.job(job)["files"][0]["state"] == "complete"


def test_sha256_is_computed_when_not_declared(daemon):
    job = daemon.create()
    url = daemon.declare(job, "scan.tif", b"abc", checked=False)["upload_url"]
    assert daemon.patch(url, 0, b"abc").status_code == 204
    assert daemon.job(job)["files"][0]["sha256"] == sha256(b"abc")


def test_a_checksum_that_comes_later_is_checked(daemon):
    """A client sends half of one file, then another client declares a different checksum: a mixture of both is not
    accepted."""
    job, first, second = daemon.create(), b"a" * 1000, b"b" * 1000
    url = daemon.declare(job, "scan.tif", first, checked=False)["upload_url"]
    assert daemon.patch(url, 0, first[:500]).status_code == 204
    again = daemon.declare(job, "scan.tif", second)
    assert again["sha256"] == sha256(second) and again["offset"] == 500 and again["upload_url"] == url
    problem(daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=1000, sha256=sha256(first))), 409, "exists", "name")
    problem(daemon.patch(url, 500, second[500:]), 422, "checksum", "scan.tif")
    assert daemon.offset(url) == 0
    assert daemon.patch(url, 0, second).status_code == 204
    assert daemon.declare(job, "scan.tif", second)["state"] == "complete"
    problem(daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=1000, sha256=sha256(first))), 409, "exists", "name")


def test_a_checksum_that_comes_while_a_piece_is_on_its_way(daemon):
    job, data = daemon.create(), os.urandom(100_000)
    url = daemon.declare(job, "scan.tif", data, checked=False)["upload_url"]
    with socket.create_connection(("127.0.0.1", daemon.port)) as s:
        s.sendall((f"PATCH {url} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: 0\r\n"
                   f"Content-Type: application/offset+octet-stream\r\nContent-Length: {len(data)}\r\n\r\n").encode() + data[:60_000])
        wait_until(lambda: daemon.get(f"/v1/jobs/{job}/files").json()["files"][0]["offset"] == 60_000)
        assert daemon.declare(job, "scan.tif", b"c" * len(data))["offset"] == 60_000
        s.sendall(data[60_000:])
        assert s.recv(4096).startswith(b"HTTP/1.1 422 ")
    assert daemon.offset(url) == 0


def test_checksum_mismatch_starts_again(daemon):
    job = daemon.create()
    url = daemon.declare(job, "scan.tif", b"right")["upload_url"]
    assert daemon.patch(url, 0, b"wr").status_code == 204
    bad = daemon.patch(url, 2, b"ong")
    problem(bad, 422, "checksum", "scan.tif")
    assert bad.headers["Upload-Offset"] == "0" and daemon.offset(url) == 0
    assert daemon.job(job)["files"][0]["state"] == "uploading"
    assert daemon.patch(url, 0, b"right").status_code == 204
    assert daemon.get(f"/v1/jobs/{job}/files/scan.tif").content == b"right"


def test_protocol_errors(daemon):
    job = daemon.create()
    url = daemon.declare(job, "scan.tif", b"0123456789")["upload_url"]
    good = {**TUS, "Upload-Offset": "0", "Content-Type": "application/offset+octet-stream"}
    for method in ("HEAD", "PATCH", "DELETE"):
        headers = {k: v for k, v in good.items() if k != "Tus-Resumable"}
        assert daemon.request(method, url, headers=headers, data=b"x" if method == "PATCH" else None).status_code == 412
        assert daemon.request(method, url, headers={**headers, "Tus-Resumable": "0.2.1"}, data=b"x" if method == "PATCH" else None).status_code == 412
    problem(daemon.request("PATCH", url, headers={**good, "Content-Type": "text/plain"}, data=b"x"), 415, "content_type")
    for offset in ("-1", "x", "", "1e3", "9" * 30):
        problem(daemon.request("PATCH", url, headers={**good, "Upload-Offset": offset}, data=b"x"), 400, "malformed", "Upload-Offset")
    problem(daemon.request("PATCH", url, headers=TUS | {"Content-Type": good["Content-Type"]}, data=b"x"), 400, "malformed")
    unknown = "/v1/uploads/00000000-0000-0000-0000-000000000000"
    problem(daemon.request("PATCH", unknown, headers=good, data=b"x"), 404, "not_found")
    problem(daemon.request("DELETE", unknown, headers=TUS), 404, "not_found")
    assert daemon.request("HEAD", unknown, headers=TUS).status_code == 404
    problem(daemon.get(url), 405, "method")
    options = daemon.request("OPTIONS", url)
    assert options.status_code == 204 and options.headers["Tus-Version"] == "1.0.0"
    assert options.headers["Tus-Extension"] == "termination" and int(options.headers["Tus-Max-Size"]) > 1e9
    assert daemon.offset(url) == 0


def test_a_piece_is_at_most_64_mib(daemon):
    job = daemon.create()
    url = daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=1 << 30)).json()["upload_url"]
    with socket.create_connection(("127.0.0.1", daemon.port)) as s:
        s.sendall(f"PATCH {url} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: 0\r\n"
                  f"Content-Type: application/offset+octet-stream\r\nContent-Length: {(64 << 20) + 1}\r\n\r\n".encode())
        answer = s.recv(65536)
    assert answer.startswith(b"HTTP/1.1 413 ") and b'"too_large"' in answer


def test_terminate(daemon):
    job = daemon.create()
    url = daemon.declare(job, "scan.tif", b"0123456789")["upload_url"]
    daemon.patch(url, 0, b"01234")
    assert daemon.request("DELETE", url, headers=TUS).status_code == 204
    assert daemon.job(job)["files"] == []
    assert daemon.request("HEAD", url, headers=TUS).status_code == 404
    folder = os.path.join(daemon.data, "jobs", job)
    assert os.listdir(os.path.join(folder, "upload")) == [] and os.listdir(os.path.join(folder, "input")) == []


@contextlib.contextmanager
def file_rows_locked(data, what="UPDATE"):
    """For a while no row of a file can be written."""
    with contextlib.closing(sqlite3.connect(os.path.join(data, "selvedge.db"))) as db:
        db.execute(f"CREATE TRIGGER refuse BEFORE {what} ON file BEGIN SELECT RAISE(ABORT, 'for a test'); END")
        yield
        db.execute("DROP TRIGGER refuse")


def test_a_verified_file_that_cannot_be_settled_at_the_start_is_not_given_up(daemon_maker):
    d = daemon_maker()
    job, data = d.create(), b"precious" * 1000
    d.upload(job, "scan.tif", data)
    d.stop()
    with contextlib.closing(sqlite3.connect(os.path.join(d.data, "selvedge.db"))) as db, db:
        db.execute("UPDATE file SET state = 1")  # verified but not yet complete, as a crash leaves it
    with file_rows_locked(d.data):
        d.start()
        assert "lost its bytes" not in d.log_text() and "for a test" in d.log_text()
    d.stop()
    d.start()
    assert d.get(f"/v1/jobs/{job}/files/scan.tif").content == data


def test_an_offset_that_cannot_be_committed_keeps_its_checksum(daemon_maker):
    """The database always holds the offset together with the checksum state up to it."""
    d = daemon_maker()
    job, data = d.create(), os.urandom(100_000)
    url = d.declare(job, "scan.tif", data, checked=False)["upload_url"]
    with socket.create_connection(("127.0.0.1", d.port)) as s:
        s.sendall((f"PATCH {url} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: 0\r\n"
                   f"Content-Type: application/offset+octet-stream\r\nContent-Length: {len(data)}\r\n\r\n").encode() + data[:60_000])
        wait_until(lambda: d.get(f"/v1/jobs/{job}/files").json()["files"][0]["offset"] == 60_000)
        with file_rows_locked(d.data):
            assert not d.session.head(d.url + url, headers=TUS).ok
        d.declare(job, "scan.tif", data)
        d.kill()
    d.start()
    offset = d.offset(url)
    assert d.patch(url, offset, data[offset:]).status_code == 204


def test_a_job_whose_edit_fails_is_what_it_was(daemon_maker):
    d = daemon_maker()
    job = d.start_job()
    done = d.wait_state(job, "succeeded")
    with file_rows_locked(d.data, "INSERT"):
        assert not d.post(f"/v1/jobs/{job}/files", json=declaration(name="more.tif")).ok
    with file_rows_locked(d.data, "DELETE"):
        assert not d.delete(f"/v1/jobs/{job}/files/scan.tif").ok
    uploads = os.path.join(d.data, "jobs", job, "upload")
    assert os.listdir(uploads) == [], "room is still kept for what was refused"
    os.rmdir(uploads)
    assert not d.post(f"/v1/jobs/{job}/files", json=declaration(name="more.tif")).ok
    assert d.job(job) == done
    assert d.delete(f"/v1/jobs/{job}/files/scan.tif").status_code == 204
    edited = d.job(job)
    assert edited["state"] == "draft" and edited["missing_files"] == ["scan.tif"]


def test_space_is_reserved(daemon):
    job = daemon.create()
    daemon.post(f"/v1/jobs/{job}/files", json=declaration(size=50_000_000))
    folder = os.path.join(daemon.data, "jobs", job, "upload")
    st = os.stat(os.path.join(folder, os.listdir(folder)[0]))
    assert st.st_size == 50_000_000 and st.st_blocks * 512 >= 50_000_000
    r = daemon.post(f"/v1/jobs/{job}/files", json=declaration(name="huge.tif", size=1 << 39))
    if r.status_code != 201:  # a machine with half a terabyte free accepts it
        problem(r, 507, "disk_full")
        assert len(os.listdir(folder)) == 1


def raw_patch(daemon, url, offset, length):
    s = socket.create_connection(("127.0.0.1", daemon.port))
    s.sendall(f"PATCH {url} HTTP/1.1\r\nHost: localhost\r\nTus-Resumable: 1.0.0\r\nUpload-Offset: {offset}\r\n"
              f"Content-Type: application/offset+octet-stream\r\nContent-Length: {length}\r\n\r\n".encode())
    return s


def test_what_arrived_before_the_connection_broke_is_kept(daemon):
    job, data = daemon.create(), os.urandom(2_000_000)
    url = daemon.declare(job, "scan.tif", data)["upload_url"]
    s = raw_patch(daemon, url, 0, len(data))
    s.sendall(data[:1_234_567])
    wait_until(lambda: daemon.job(job)["files"][0]["offset"] == 1_234_567, what="arrival of the first part")
    s.close()
    assert daemon.offset(url) == 1_234_567
    assert daemon.patch(url, 1_234_567, data[1_234_567:]).status_code == 204
    assert daemon.get(f"/v1/jobs/{job}/files/scan.tif").content == data


def test_a_second_writer_takes_over(daemon):
    job, data = daemon.create(), os.urandom(2_000_000)
    url = daemon.declare(job, "scan.tif", data)["upload_url"]
    first = raw_patch(daemon, url, 0, len(data))
    first.sendall(data[:500_000])
    wait_until(lambda: daemon.job(job)["files"][0]["offset"] == 500_000, what="arrival of the first part")
    # the first connection is still open; the second continues at its offset
    assert daemon.offset(url) == 500_000
    second = daemon.patch(url, 500_000, data[500_000:1_000_000])
    assert second.status_code == 204
    try:  # late bytes of the first writer must be ignored
        first.sendall(b"x" * 100_000)
        first.settimeout(5)
        while first.recv(65536):
            pass
    except OSError:
        pass
    first.close()
    assert daemon.offset(url) == 1_000_000
    assert daemon.patch(url, 1_000_000, data[1_000_000:]).status_code == 204
    assert daemon.get(f"/v1/jobs/{job}/files/scan.tif").content == data


def test_many_uploads_at_once(daemon):
    job = daemon.create()
    data = {f"p{i:02}.exr": os.urandom(300_000) for i in range(16)}
    failures = []

    def send(name):
        import requests
        try:
            url = daemon.url + daemon.declare(job, name, data[name], "photograph")["upload_url"]
            for start in range(0, 300_000, 70_000):
                r = requests.patch(url, data=data[name][start:start + 70_000], headers={
                    **TUS, "Upload-Offset": str(start), "Content-Type": "application/offset+octet-stream"})
                assert r.status_code == 204, r.text
        except Exception as e:  # noqa: BLE001
            failures.append(e)

    threads = [threading.Thread(target=send, args=(n,)) for n in data]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert not failures
    for name, content in data.items():
        assert daemon.get(f"/v1/jobs/{job}/files/{name}").content == content


@pytest.mark.slow
def test_memory_does_not_grow_with_the_file(daemon):
    def resident():
        with open(f"/proc/{daemon.process.pid}/statm") as f:
            return int(f.read().split()[1]) * 4096

    if daemon.wrapper or "asan" in BUILD:
        pytest.skip("memory of an instrumented daemon says nothing")
    job, size = daemon.create(), 200_000_000
    before = resident()
    url = daemon.post(f"/v1/jobs/{job}/files", json=declaration(name="big.tif", size=size)).json()["upload_url"]
    piece = os.urandom(50_000_000)
    start = time.monotonic()
    for offset in range(0, size, len(piece)):
        assert daemon.patch(url, offset, piece).status_code == 204
    print(f"upload: {size / 1e6 / (time.monotonic() - start):.0f} MB/s, memory grew by {(resident() - before) / 1e6:.1f} MB")
    assert resident() - before < 20_000_000
    assert daemon.job(job)["files"][0]["sha256"] == sha256(piece * (size // len(piece)))
