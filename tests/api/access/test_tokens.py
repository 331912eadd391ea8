"""Access tokens: who needs one, what each scope may do, and how they are made, kept and revoked."""
import contextlib
import hashlib
import json
import os
import re
import sqlite3
import subprocess
import threading
import time

import pytest
import requests
from daemon_under_test import DOCUMENT, Daemon, problem, program, settings_arguments
from openapi_check import METHODS, load
from servers.old_database import migrations

OPERATIONS = [(path, method, item[method]) for path, item in load()["paths"].items() for method in METHODS if method in item]
SCOPES = ["none", "read", "submit", "admin"]
SOME_ID = "12345678-1234-1234-1234-123456789abc"


def some_url(path):
    return re.sub(r"\{\w+\}", SOME_ID, path)


@pytest.fixture(scope="module")
def guarded(tmp_path_factory):
    """A daemon with tokens: its attributes admin, submit and read are what their holders see."""
    with Daemon(tmp_path_factory.mktemp("guarded") / "data") as d:
        d.admin = d.of(d.make_token("root"))
        for scope in ("submit", "read"):
            setattr(d, scope, d.of(make(d.admin, f"{scope}er", scope)))
        yield d


def make(admin, name, scope="submit", **more):
    r = admin.post("/v1/tokens", json={"name": name, "scope": scope, **more})
    assert r.status_code == 201, r.text
    assert r.headers["Cache-Control"] == "no-store"
    return r.json()["token"]


def database(d):
    return sqlite3.connect(os.path.join(d.data, "selvedge.db"), timeout=10)


def test_without_tokens_nothing_changes(daemon_maker):
    d = daemon_maker()
    job = d.create(Authorization="Bearer for the proxy in front")
    assert d.job(job)["owner"] is None
    who = d.get("/v1/session").json()
    assert who["token_needed"] is False and who["scope"] == "admin" and who["name"] is None and who["used"]["jobs"] == 1
    assert d.get("/v1/tokens").json() == {"tokens": [], "next_cursor": None}
    # else any user of the machine could lock the others out
    problem(d.post("/v1/tokens", json={"name": "thief", "scope": "admin"}), 409, "conflict")
    problem(d.post("/v1/session", json={"token": "x"}), 401, "token", "token")
    assert d.get("/v1/jobs").status_code == 200


@pytest.mark.parametrize("running", [False, True])
def test_the_first_token(daemon_maker, running):
    d = daemon_maker()
    job = d.create()
    if not running:
        d.stop()
    token = d.make_token("root")
    assert re.fullmatch(r"selvedge_[A-Za-z0-9_-]{43}", token)
    if not running:
        d.start()
    r = d.get("/v1/jobs")
    problem(r, 401, "token", "Authorization")
    assert r.headers["WWW-Authenticate"] == 'Bearer realm="selvedge"'
    assert [j["id"] for j in d.of(token).get("/v1/jobs").json()["jobs"]] == [job]
    again = subprocess.run([program("selvedged"), "--data", d.data, *settings_arguments(d.options), "--make-token", "root"],
                           capture_output=True, text=True, check=False)
    assert again.returncode == 1 and "a token named 'root' exists" in again.stderr and again.stdout == ""


def test_tokens_can_be_asked_for_from_the_beginning(daemon_maker):
    d = daemon_maker(options={"access.required": "always"})
    problem(d.get("/v1/jobs"), 401, "token")
    problem(d.post("/v1/session", json={"token": "x"}), 401, "token")
    assert d.of(d.make_token("root")).get("/v1/jobs").status_code == 200


def test_a_daemon_of_another_version_is_not_migrated_under_its_feet(daemon_maker):
    d = daemon_maker()
    with database(d) as db:
        (version,) = db.execute("PRAGMA user_version").fetchone()
        db.execute(f"PRAGMA user_version={version - 1}")
    made = subprocess.run([program("selvedged"), "--data", d.data, "--make-token", "x"], capture_output=True, text=True, check=False)
    assert made.returncode == 1 and "of another version; stop it first" in made.stderr
    with database(d) as db:
        assert db.execute("PRAGMA user_version").fetchone() == (version - 1,)
        db.execute(f"PRAGMA user_version={version}")


def test_every_operation_needs_its_scope(guarded):
    """Walks the description of the API: no token, a token of the scope below, and one of the scope itself."""
    users = {"none": guarded, "read": guarded.read, "submit": guarded.submit, "admin": guarded.admin}
    asked = set()
    for path, method, operation in OPERATIONS:
        need, url = operation["x-scope"], some_url(path)
        body = {"data": b"{}", "headers": {"Content-Type": "application/json"}} if "requestBody" in operation else {}
        nobody = guarded.request(method.upper(), url, **body)
        if need == "none":
            assert nobody.status_code not in (403, 404), path
            continue
        assert nobody.status_code == 401 and nobody.headers["WWW-Authenticate"].startswith("Bearer"), (path, method)
        below = SCOPES[SCOPES.index(need) - 1]
        if below != "none":
            r = users[below].request(method.upper(), url, **body)
            assert problem(r, 403, "scope")["scope"] == need, (path, method)
        assert users[need].request(method.upper(), url, **body).status_code not in (401, 403), (path, method)
        asked.add(need)
    assert asked == {"read", "submit", "admin"}
    for path in ("/", "/dashboard.js", "/livez"):
        assert guarded.get(path).status_code == 200


@pytest.mark.parametrize("header", ["", "Bearer", "Bearer ", "Bearer selvedge_", "Basic cm9vdDpyb290", "Bearer selvedge_" + "A" * 43,
                                    "Bearer " + "x" * 3000, "Token {}", "{}", "Bearer {}x", "Bearer {} {}"])
def test_what_is_no_token(guarded, header):
    token = guarded.admin.session.headers["Authorization"].split()[1]
    r = guarded.get("/v1/jobs", headers={"Authorization": header.replace("{}", token)})
    problem(r, 401, "token", "Authorization")
    assert guarded.get("/v1/jobs", headers={"Authorization": f"bearer  {token}"}).status_code == 200


def test_two_tokens_in_one_request_are_refused(guarded):
    token = guarded.admin.session.headers["Authorization"]
    with requests.Session() as s:
        r = s.send(requests.Request("GET", guarded.url + "/v1/jobs", headers={"authorization": token, "Authorization": token}).prepare())
        assert r.status_code == 400 or len(r.request.headers) < 2


def test_the_database_does_not_know_the_token(guarded):
    token = make(guarded.admin, "hashed")
    r = guarded.post("/v1/session", json={"token": token})
    cookie = r.cookies["selvedge_session"]
    assert cookie != token
    kept = b"".join(open(os.path.join(guarded.data, name), "rb").read() for name in os.listdir(guarded.data) if name.startswith("selvedge.db"))
    for secret in (token, cookie):
        assert secret.encode() not in kept and secret.removeprefix("selvedge_").encode() not in kept
        assert hashlib.blake2b(secret.encode(), digest_size=32).digest() in kept
    assert token not in guarded.log_text()
    # a hash is not a token
    digest = hashlib.blake2b(token.encode(), digest_size=32)
    for value in (digest.hexdigest(), "selvedge_" + digest.hexdigest()):
        assert guarded.get("/v1/jobs", headers={"Authorization": f"Bearer {value}"}).status_code == 401


def test_a_revoked_token_stops_at_once(guarded):
    token = make(guarded.admin, "leaver")
    user = guarded.of(token)
    job = user.create()
    cookie = guarded.post("/v1/session", json={"token": token}).cookies
    tag = user.get(f"/v1/jobs/{job}").headers["ETag"]
    waited = []
    poll = threading.Thread(target=lambda: waited.append(user.get(f"/v1/jobs/{job}?wait=20", headers={"If-None-Match": tag})))
    poll.start()
    time.sleep(0.3)
    assert guarded.admin.delete("/v1/tokens/leaver").status_code == 204
    problem(guarded.of(token).get("/v1/jobs"), 401, "token")
    problem(guarded.get("/v1/jobs", cookies=cookie), 401, "token")
    problem(guarded.post("/v1/session", json={"token": token}), 401, "token", "token")
    guarded.admin.post(f"/v1/jobs/{job}/cancel")  # what a waiting request would have told
    poll.join(10)
    assert not poll.is_alive()
    problem(waited[0], 401, "token")
    problem(guarded.admin.delete("/v1/tokens/leaver"), 404, "not_found")
    row = next(t for t in guarded.admin.get("/v1/tokens").json()["tokens"] if t["name"] == "leaver")
    assert row["revoked_unix_s"] > 0
    assert guarded.admin.delete(f"/v1/tokens/{row['id']}").status_code == 204  # a repeat by its id changes nothing
    assert next(t for t in guarded.admin.get("/v1/tokens").json()["tokens"] if t["id"] == row["id"])["revoked_unix_s"] == row["revoked_unix_s"]
    successor = guarded.of(make(guarded.admin, "leaver"))  # a new token of the same name has the same owner
    assert successor.job(job)["owner"] == "leaver"


def test_tokens_survive_a_restart_and_a_kill(daemon_maker):
    d = daemon_maker()
    token = d.make_token("root")
    user = make(d.of(token), "user", stored_bytes=5, jobs=7, requests_per_minute=600)
    assert d.of(user).get("/v1/jobs").status_code == 200
    d.stop()
    d.start()
    rows = {t["name"]: t for t in d.of(token).get("/v1/tokens").json()["tokens"]}
    assert rows["user"]["last_used_unix_s"] > 0 and (rows["user"]["stored_bytes"], rows["user"]["jobs"], rows["user"]["requests_per_minute"]) == (5, 7, 600)
    assert rows["root"]["stored_bytes"] is None and "token" not in rows["user"]
    assert d.of(token).delete("/v1/tokens/user").status_code == 204
    d.kill()
    d.start()
    assert d.of(user).get("/v1/jobs").status_code == 401
    assert d.of(token).delete("/v1/tokens/root").status_code == 204
    d.kill()
    d.start()
    assert d.get("/v1/jobs").status_code == 401  # without any valid token the service stays shut


@pytest.mark.parametrize("body, field", [
    ({"name": "a"}, "scope"), ({"name": "a", "scope": "open"}, "scope"), ({"scope": "read"}, "name"), ({"name": "", "scope": "read"}, "name"),
    ({"name": "a b", "scope": "read"}, "name"), ({"name": "x" * 65, "scope": "read"}, "name"), ({"name": "a", "owner": "ü", "scope": "read"}, "owner"),
    ({"name": "a", "scope": "read", "jobs": -1}, "jobs"), ({"name": "a", "scope": "read", "stored_bytes": 1.5}, "stored_bytes"),
    ({"name": "a", "scope": "read", "quota": 3}, "quota"), ([], None), ({"name": 3, "scope": "read"}, "name")])
def test_tokens_that_are_refused(guarded, body, field):
    before = guarded.admin.get("/v1/tokens").json()
    problem(guarded.admin.post("/v1/tokens", json=body), 422, "invalid", field)
    assert guarded.admin.get("/v1/tokens").json()["tokens"][0]["id"] == before["tokens"][0]["id"]


def test_names_are_unique_and_the_list_has_pages(guarded):
    for i in range(5):
        make(guarded.admin, f"page{i}")
    problem(guarded.admin.post("/v1/tokens", json={"name": "page3", "scope": "read"}), 409, "exists", "name")
    names, cursor = [], None
    while True:
        page = guarded.admin.get("/v1/tokens?limit=2" + (f"&cursor={cursor}" if cursor else "")).json()
        names += [t["name"] for t in page["tokens"]]
        cursor = page["next_cursor"]
        if cursor is None:
            break
    assert names[:5] == [f"page{i}" for i in (4, 3, 2, 1, 0)] and len(names) == len(guarded.admin.get("/v1/tokens").json()["tokens"])


def test_an_older_database_is_migrated(daemon_maker, tmp_path):
    """The schema before there were tokens, with a job, its file, a key and a delivery."""
    job, upload = SOME_ID, SOME_ID.replace("1", "2")
    os.makedirs(tmp_path / "data" / "jobs" / job / "input")
    os.chmod(tmp_path / "data", 0o700)
    (tmp_path / "data" / "jobs" / job / "input" / "scan.tif").write_bytes(b"0123456789")
    db = sqlite3.connect(tmp_path / "data" / "selvedge.db")
    for entry in migrations()[:3]:
        db.executescript(entry)
    db.execute("INSERT INTO webhook VALUES (1)")
    db.execute("INSERT INTO job VALUES (1, ?, 's', 0, 0, 0, 0, 0, 0, 0, '', 1, 1, 0, 0, 0, '', '', '', 0, 0)", (job,))
    db.execute("INSERT INTO document VALUES (?, ?)", (job, json.dumps(DOCUMENT)))
    db.execute("INSERT INTO file VALUES (1, ?, ?, 'scan.tif', 'volume', 10, 10, '', 2, x'')", (upload, job))
    db.execute("INSERT INTO idempotency VALUES ('k', ?, ?, 1)", (job, hashlib.sha256(json.dumps(DOCUMENT).encode()).hexdigest()))
    db.execute("UPDATE job SET state = 6 WHERE serial = 1")
    db.execute("PRAGMA user_version=3")
    db.commit()
    db.close()
    d = daemon_maker()
    assert os.path.exists(tmp_path / "data" / "selvedge.db.v3")
    r = d.post("/v1/jobs", data=json.dumps(DOCUMENT), headers={"Content-Type": "application/json", "Idempotency-Key": "k"})
    assert r.status_code == 201 and r.json()["id"] == job and r.headers["Idempotent-Replay"] == "true"
    assert d.get("/v1/session").json()["used"] == {"stored_bytes": 10, "jobs": 1}
    assert len(d.get("/v1/deliveries").json()["deliveries"]) == 1
    token = d.make_token("root")
    user = d.of(make(d.of(token), "user"))
    assert d.of(token).job(job)["owner"] is None
    assert user.get(f"/v1/jobs/{job}").status_code == 404 and user.get("/v1/deliveries").json()["deliveries"] == []
    assert d.of(token).delete(f"/v1/jobs/{job}").status_code == 204


def test_the_queue_of_an_older_database_is_kept(daemon_maker, tmp_path):
    """The schema before there were batches, with two queued jobs."""
    os.makedirs(tmp_path / "data")
    os.chmod(tmp_path / "data", 0o700)
    jobs = [SOME_ID, SOME_ID.replace("1", "2")]
    with contextlib.closing(sqlite3.connect(tmp_path / "data" / "selvedge.db")) as db:
        for entry in migrations()[:6]:
            db.executescript(entry)
        for job in jobs:
            db.execute("INSERT INTO job (id, sample, state, cancel_requested, dirty, deleted, attempt, lost_attempts, generation, token, created, updated,"
                       " queued, started, finished, error_code, error_field, error_text, peak_rss)"
                       " VALUES (?, 's', 1, 0, 0, 0, 0, 0, 0, '', 1, 1, 1, 0, 0, '', '', '', 0)", (job,))
            db.execute("INSERT INTO document VALUES (?, ?)", (job, json.dumps(DOCUMENT)))
        db.execute("PRAGMA user_version=6")
        db.commit()
    d = daemon_maker()
    assert os.path.exists(tmp_path / "data" / "selvedge.db.v6")
    for job in jobs:
        assert d.wait_state(job, "succeeded")["batch"] is None
    assert d.get("/v1/batches").json() == {"batches": [], "next_cursor": None}


def certificate(folder):
    key, cert = str(folder / "key.pem"), str(folder / "cert.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", key, "-out", cert,
                    "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"], check=True, capture_output=True)
    os.chmod(key, 0o600)
    return {"server.tls_certificate": cert, "server.tls_key": key}


def test_other_machines_need_tokens_and_tls(tmp_path):
    """Each of the three steps is asked for with a message of its own; then it listens on all addresses."""
    d = Daemon(tmp_path / "data", options={"server.listen": "0.0.0.0"})
    with pytest.raises(AssertionError, match="without access tokens only loopback.*--make-token"):
        d.start()
    token = d.make_token("root")
    with pytest.raises(AssertionError, match="without TLS, because access tokens would cross the network"):
        d.start()
    d.options.update(certificate(tmp_path))
    with d:
        url = f"https://127.0.0.1:{d.port}/v1/jobs"
        ask = {"verify": d.options["server.tls_certificate"], "timeout": 20}
        assert requests.get(url, **ask).status_code == 401
        for host in ("selvedge.example.org", "10.1.2.3:7878"):  # it has names that it does not know
            assert requests.get(url, headers={"Authorization": f"Bearer {token}", "Host": host}, **ask).status_code == 200
            r = requests.post(url, headers={"Authorization": f"Bearer {token}", "Host": host, "Origin": "https://evil.example"}, json=DOCUMENT, **ask)
            assert r.status_code == 403 and r.json()["code"] == "origin"
