"""Links that show one job: what they allow, which is little, and how they end."""
import glob
import os
import sqlite3
import subprocess
import sys

import pytest
import requests
from daemon_under_test import DOCUMENT, ROOT, Daemon, problem, program
from openapi_check import METHODS, load
from test_owners import call, make_batch
from test_tokens import make

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402

OPERATIONS = [(path, method, item[method]) for path, item in load()["paths"].items() for method in METHODS if method in item]
ALLOWED = {"getJob", "listResults", "getResult", "getArchive"}


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """ann's job has succeeded, and she has another one; bob may submit, a reader of ann's may not."""
    with Daemon(tmp_path_factory.mktemp("lab") / "data", options={"jobs.workers": 2}) as d:
        d.admin = d.of(d.make_token("root"))
        d.ann, d.bob = d.of(make(d.admin, "ann")), d.of(make(d.admin, "bob"))
        d.reader = d.of(make(d.admin, "reader", "read", owner="ann"))
        d.job, d.other = (d.ann.start_job("series 20") for _ in range(2))
        for job in (d.job, d.other):
            d.ann.wait_state(job, "succeeded")
        yield d


def share(user, job, **more):
    reply = user.post(f"/v1/jobs/{job}/shares", json=more)
    assert reply.status_code == 201 and reply.headers["Cache-Control"] == "no-store", reply.text
    return reply.json()


def browser(lab, secret):
    """Somebody without a token who opens the link in a browser: cookies alone."""
    other = lab.of("none")
    del other.session.headers["Authorization"]
    opened = other.post("/v1/shared", json={"secret": secret})
    assert opened.status_code == 200, opened.text
    return other, opened


def test_a_link_shows_its_job_and_results(lab):
    made = share(lab.ann, lab.job, days=7)
    assert made["protected"] is True and made["made_by"] == "ann" and made["expires_unix_s"] - made["created_unix_s"] == pytest.approx(7 * 86400)
    page, opened = browser(lab, made["secret"])
    assert opened.json()["job"] == lab.job
    cookie = opened.headers["Set-Cookie"]
    assert f"Path=/v1/jobs/{lab.job};" in cookie and "HttpOnly" in cookie and "SameSite=Strict" in cookie
    for reader in (page, lab.of(made["secret"])):
        assert reader.get(f"/v1/jobs/{lab.job}").json()["id"] == lab.job
        assert reader.get(f"/v1/jobs/{lab.job}/results").json()["files"]
        assert reader.get(f"/v1/jobs/{lab.job}/results/result.json").status_code == 200
        assert reader.get(f"/v1/jobs/{lab.job}/results.tar").status_code == 200


def test_every_other_request_is_refused(lab):
    """Walks the description of the API, so a new operation is refused without being listed here."""
    secret = share(lab.ann, lab.job)["secret"]
    draft, batch = lab.ann.create(), make_batch(lab.ann)
    upload = lab.ann.declare(draft, "scan.tif", b"0123456789")["upload_url"].rsplit("/", 1)[1]
    before = lab.ann.get("/v1/jobs?limit=500").json()["jobs"]
    tried = set()
    for path, method, operation in OPERATIONS:
        if operation.get("x-scope") == "none":
            continue
        for user in (lab.of(secret), browser(lab, secret)[0]):
            # a cookie whose path a client does not respect shows no more
            user.session.cookies.set("selvedge_share", secret)
            for job in {lab.job, lab.other}:
                reply = call(user, path, method, operation, job, upload, batch)
                allowed = operation["operationId"] in ALLOWED and job == lab.job
                assert (reply.status_code == 200) if allowed else (reply.status_code == 401), (method, path, job == lab.job, reply.text[:200])
        tried.add(operation["operationId"])
    assert len(tried) > 50 and ALLOWED <= tried
    assert lab.ann.get("/v1/jobs?limit=500").json()["jobs"] == before


def test_a_session_of_the_browser_stays_as_it_is(lab):
    page, _ = browser(lab, share(lab.ann, lab.job)["secret"])
    token = make(lab.admin, "carla")
    assert page.post("/v1/session", json={"token": token}).status_code == 200
    assert page.get("/v1/session").json()["name"] == "carla"
    assert page.get(f"/v1/jobs/{lab.job}").status_code == 200 and page.get(f"/v1/jobs/{lab.other}").status_code == 404


def test_only_who_may_change_the_job_makes_and_revokes_links(lab):
    problem(lab.reader.post(f"/v1/jobs/{lab.job}/shares", json={}), 403, "scope")
    problem(lab.bob.post(f"/v1/jobs/{lab.job}/shares", json={}), 404, "not_found")
    made = share(lab.ann, lab.job)
    problem(lab.bob.delete(f"/v1/jobs/{lab.job}/shares/{made['id']}"), 404, "not_found")
    problem(lab.ann.delete(f"/v1/jobs/{lab.other}/shares/{made['id']}"), 404, "not_found")
    for days in (0, -1, 1e9, "7", None):
        problem(lab.ann.post(f"/v1/jobs/{lab.job}/shares", json={"days": days}), 422, "invalid", field="days")
    problem(lab.ann.post(f"/v1/jobs/{lab.job}/shares", json={"owner": "x"}), 422, "invalid", field="owner")


def test_a_revoked_link_ends_at_once(lab):
    made = share(lab.ann, lab.job)
    page, _ = browser(lab, made["secret"])
    assert lab.ann.delete(f"/v1/jobs/{lab.job}/shares/{made['id']}").status_code == 204
    assert page.get(f"/v1/jobs/{lab.job}").status_code == 401 and page.get(f"/v1/jobs/{lab.job}/results/result.json").status_code == 401
    problem(page.post("/v1/shared", json={"secret": made["secret"]}), 404, "not_found")
    (row,) = [s for s in lab.ann.get(f"/v1/jobs/{lab.job}/shares").json()["shares"] if s["id"] == made["id"]]
    assert row["open"] is False and row["revoked_unix_s"] and "secret" not in row


def test_a_link_ends_with_its_time_and_with_its_job(lab):
    late, job = share(lab.ann, lab.job), lab.ann.start_job("series 3")
    lab.ann.wait_state(job, "succeeded")
    of_job = share(lab.ann, job)
    lab.stop()
    with sqlite3.connect(glob.glob(os.path.join(lab.data, "*.db"))[0]) as db:
        assert db.execute("UPDATE share SET expires = created WHERE id = ?", (late["id"],)).rowcount == 1
    lab.start()
    lab.ann.url = lab.bob.url = lab.admin.url = lab.reader.url = lab.url
    problem(lab.post("/v1/shared", json={"secret": late["secret"]}), 404, "not_found")
    assert lab.of(of_job["secret"]).get(f"/v1/jobs/{job}").status_code == 200, "links outlive a restart"
    assert lab.ann.delete(f"/v1/jobs/{job}").status_code == 204
    problem(lab.post("/v1/shared", json={"secret": of_job["secret"]}), 404, "not_found")


def test_the_secret_is_not_stored(lab):
    secret = share(lab.ann, lab.job)["secret"].encode()
    stored = b"".join(open(p, "rb").read() for p in glob.glob(os.path.join(lab.data, "*")) if os.path.isfile(p))
    assert stored and secret not in stored and secret not in open(lab.data + ".log", "rb").read()


def test_without_tokens_a_link_says_that_it_protects_nothing(daemon):
    job = daemon.create(DOCUMENT)
    made = share(daemon, job)
    assert made["protected"] is False and made["made_by"] == ""
    assert requests.post(daemon.url + "/v1/shared", json={"secret": made["secret"]}, timeout=150).json()["job"] == job
    problem(daemon.post("/v1/shared", json={"secret": "x" * 30}), 404, "not_found")
    problem(daemon.post("/v1/shared", json={"secret": 5}), 422, "invalid", field="secret")


def test_command_and_python_make_and_revoke_links(lab):
    token = make(lab.admin, "dora", owner="ann")

    def share_command(*words):
        return subprocess.run([program("selvedge"), "share", lab.job, *words, "--server", lab.url], env=dict(os.environ, SELVEDGE_TOKEN=token),
                              capture_output=True, text=True, timeout=300, check=False)

    made = share_command("--days", "2")
    assert made.returncode == 0 and made.stdout.startswith(f"{lab.url}/#share/selvedge_") and "valid until" in made.stderr, made.stderr
    reader = lab.of(made.stdout.strip().split("/#share/")[1])
    address = selvedge.Client(lab.url, token).job(lab.job).share(3)
    other = lab.of(address.split("/#share/")[1])
    assert reader.get(f"/v1/jobs/{lab.job}").status_code == other.get(f"/v1/jobs/{lab.job}").status_code == 200
    assert share_command("--links").stdout.count("made by dora") == 2
    assert share_command("--revoke").stdout.count("revoked") >= 2
    assert reader.get(f"/v1/jobs/{lab.job}").status_code == other.get(f"/v1/jobs/{lab.job}").status_code == 401
    assert "no link" in share_command("--links").stderr and share_command("--days", "soon").returncode == 1
    assert selvedge.Client(lab.url, token).job(lab.job).unshare() == 0
