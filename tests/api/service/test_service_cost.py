"""Work that must not grow or wait: lists of declarations, answers beside a sync that hangs, tags without bodies, slow readers,
and the migration of databases of earlier versions."""
import contextlib
import json
import os
import re
import socket
import sqlite3
import threading
import time

import pytest
from daemon_under_test import TIMEOUT_S, document, problem, wait_until


def slices(n, **more):
    return [{"name": f"s{i}.tif", "role": "volume", "size": 100 + i, **more} for i in range(n)]


def test_a_list_of_declarations_is_made_at_once(daemon):
    job = daemon.create()
    r = daemon.post(f"/v1/jobs/{job}/files", json=slices(300))
    assert r.status_code == 201 and "Location" not in r.headers
    files = r.json()["files"]
    assert [(f["name"], f["size"], f["offset"]) for f in files] == [(s["name"], s["size"], 0) for s in slices(300)]
    assert [f["name"] for f in daemon.job(job)["files"]] == [s["name"] for s in slices(300)]
    assert daemon.patch(files[7]["upload_url"], 0, b"x" * 107).status_code == 204
    again = daemon.post(f"/v1/jobs/{job}/files", json=slices(300))
    assert again.status_code == 200 and again.json()["files"][7]["state"] == "complete", "a repeat changes nothing"
    more = daemon.post(f"/v1/jobs/{job}/files", json=slices(301))
    assert more.status_code == 201 and len(daemon.job(job)["files"]) == 301
    assert daemon.post(f"/v1/jobs/{job}/files", json=slices(1)[0]).json()["name"] == "s0.tif"


@pytest.mark.parametrize("spoil, status, code, field", [
    (lambda s: s[3].update(role="nonsense"), 422, "invalid", "[3].role"),
    (lambda s: s[2].update(extra=1), 422, "invalid", "[2].extra"),
    (lambda s: s[4].update(name="../x"), 422, "invalid", "[4].name"),
    (lambda s: s[4].update(name="s1.tif"), 422, "invalid", "[4].name"),
    (lambda s: s[1].update(name="there.tif", size=5), 409, "exists", "[1].name"),
    (lambda s: s[0].update(size=1 << 61), 413, "too_large", "[0].size"),
    (lambda s: s.clear(), 422, "invalid", None),
])
def test_one_wrong_declaration_refuses_the_list(daemon, spoil, status, code, field):
    job = daemon.create()
    daemon.declare(job, "there.tif", b"1234")
    wrong = slices(5)
    spoil(wrong)
    problem(daemon.post(f"/v1/jobs/{job}/files", json=wrong), status, code, field)
    assert [f["name"] for f in daemon.job(job)["files"]] == ["there.tif"]
    assert len(os.listdir(os.path.join(daemon.data, "jobs", job, "upload"))) == 1


def test_no_answer_waits_for_a_sync(daemon_maker, shim, tmp_path):
    """The disk hangs during an upload. Other requests are answered, whichever connection they come on."""
    hold = tmp_path / "hold"
    d = daemon_maker(environment={"LD_PRELOAD": shim, "FAULT_HOLD_SYNC": str(hold)})
    job, other = d.create(), d.create()
    url = d.declare(job, "scan.tif", b"abc" * 1000)["upload_url"]
    hold.touch()
    answer = []
    writers = [threading.Thread(target=lambda: answer.append(d.patch(url, 0, b"abc" * 1000).status_code)),
               threading.Thread(target=lambda: answer.append(d.delete(f"/v1/jobs/{other}").status_code))]
    for writer in writers:
        writer.start()
    wait_until(lambda: d.job(job)["files"][0]["offset"] == 3000, what="the bytes are written")
    for i in range(8):
        with socket.create_connection(("127.0.0.1", d.port)) as s:
            s.settimeout(20)
            s.sendall(f"GET {'/livez' if i % 2 else '/v1/jobs'} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
            assert s.recv(100).startswith(b"HTTP/1.1 200")
    assert len(d.get("/v1/jobs").json()["jobs"]) == 2 and d.get(f"/v1/jobs/{job}/files").status_code == 200
    assert answer == [], "neither change may be acknowledged before its sync"
    hold.unlink()
    for writer in writers:
        writer.join(20)
    assert sorted(answer) == [204, 204]


def test_tags_change_with_what_they_stand_for(daemon):
    job = daemon.create()
    tags = []

    def changed():
        new = tuple(daemon.get(f"/v1/jobs/{job}{tail}").headers["ETag"] for tail in ("", "/files"))
        assert all(daemon.get(f"/v1/jobs/{job}{tail}", headers={"If-None-Match": tag}).status_code == 304 for tail, tag in zip(("", "/files"), new))
        different = not tags or all(a != b for a, b in zip(tags[-1], new))
        tags.append(new)
        return different

    assert changed()
    url = daemon.declare(job, "scan.tif", b"abcdef", checked=False)["upload_url"]
    assert changed()
    assert daemon.patch(url, 0, b"abc").status_code == 204 and changed()
    assert daemon.patch(url, 3, b"def").status_code == 204 and changed()
    assert daemon.put(f"/v1/jobs/{job}/document", json=document("other")).status_code == 200 and changed()
    assert daemon.delete(f"/v1/jobs/{job}/files/scan.tif").status_code == 204 and changed()
    assert len({tag for both in tags for tag in both}) == len({both for both in tags}) * 2


VERSION_1 = """
CREATE TABLE job (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, sample TEXT NOT NULL, document TEXT NOT NULL,
 state INTEGER NOT NULL, cancel_requested INTEGER NOT NULL, dirty INTEGER NOT NULL, deleted INTEGER NOT NULL, attempt INTEGER NOT NULL,
 lost_attempts INTEGER NOT NULL, generation INTEGER NOT NULL, token TEXT NOT NULL, created REAL NOT NULL, updated REAL NOT NULL,
 queued REAL NOT NULL, started REAL NOT NULL, finished REAL NOT NULL, error_code TEXT NOT NULL, error_field TEXT NOT NULL,
 error_text TEXT NOT NULL, peak_rss INTEGER NOT NULL);
CREATE INDEX job_state ON job (deleted, state, serial);
CREATE TABLE file (serial INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, job_id TEXT NOT NULL, name TEXT NOT NULL,
 role TEXT NOT NULL, size INTEGER NOT NULL, offset INTEGER NOT NULL, sha256 TEXT NOT NULL, state INTEGER NOT NULL,
 hash_state BLOB NOT NULL, UNIQUE (job_id, name));
CREATE TABLE idempotency (key TEXT PRIMARY KEY, job_id TEXT NOT NULL, body_hash TEXT NOT NULL, created REAL NOT NULL);
CREATE INDEX idempotency_job ON idempotency (job_id);
CREATE TABLE probe (one INTEGER PRIMARY KEY, at REAL NOT NULL);
PRAGMA user_version = 1;
"""


def test_a_database_of_version_1_is_migrated(daemon_maker, tmp_path):
    ids = [f"00000000-0000-4000-8000-00000000000{i}" for i in range(3)]
    os.mkdir(tmp_path / "data")
    with sqlite3.connect(tmp_path / "data" / "selvedge.db") as db:
        db.executescript(VERSION_1)
        for i, (job, state) in enumerate(zip(ids, (0, 6, 6))):
            db.execute("INSERT INTO job VALUES (NULL,?,?,?,?,0,0,0,0,0,0,'',?,1,0,0,0,'','','',0)", (job, f"fake: {i}", json.dumps(document(i)), state, i + 1))
        db.execute("INSERT INTO file VALUES (NULL,?,?,'scan.tif','volume',4,0,'',0,zeroblob(256))", (ids[0][:-1] + "9", ids[0]))
    db.close()
    d = daemon_maker()
    assert os.path.exists(tmp_path / "data" / "selvedge.db.v1")
    assert [j["id"] for j in d.get("/v1/jobs").json()["jobs"]] == ids[::-1]
    assert [j["id"] for j in d.get("/v1/jobs?state=cancelled").json()["jobs"]] == [ids[2], ids[1]]
    job = d.job(ids[0])
    assert job["document"] == document(0) and [f["name"] for f in job["files"]] == ["scan.tif"]
    assert 'selvedge_jobs{state="cancelled"} 2' in d.get("/metrics").text
    d.delete(f"/v1/jobs/{ids[1]}")
    d.create()
    counts = d.get("/metrics").text
    assert 'selvedge_jobs{state="cancelled"} 1' in counts and 'selvedge_jobs{state="draft"} 2' in counts


def n_connected(d):
    return int(re.search(r"^selvedge_http_connections (\d+)", d.get("/metrics").text, flags=re.M).group(1))


@pytest.mark.slow
def test_slow_readers_are_disconnected(daemon_maker):
    """A reader of a byte a second loses its connection; one that reads slowly, but steadily, gets all."""
    d = daemon_maker()
    job = d.start_job("succeed")
    d.wait_state(job, "succeeded")
    size = 14_000_000
    with open(os.path.join(d.data, "jobs", job, "results", "large.txt"), "wb") as f:
        f.write(b"x" * size)

    def connect():
        s = socket.socket()
        s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        s.connect(("127.0.0.1", d.port))
        s.settimeout(40)
        s.sendall(f"GET /v1/jobs/{job}/results/large.txt HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
        return s

    slow, steady = connect(), connect()
    n = 0
    start = time.monotonic()
    slow.recv(1)
    n += len(steady.recv(1))
    connected = n_connected(d)
    # until the daemon has ended the slow one, which its limit lets it do after 10 s at the earliest
    while n_connected(d) >= connected and time.monotonic() - start < 40 * TIMEOUT_S:
        slow.recv(1)
        n += len(steady.recv(20_000))
        time.sleep(0.1)
    while piece := steady.recv(1 << 20):
        n += len(piece)
    assert n > size
    total = 0
    with contextlib.suppress(ConnectionError):
        while piece := slow.recv(1 << 20):
            total += len(piece)
    assert total < size, "the slow reader got the whole answer"
    slow.close()
    steady.close()
