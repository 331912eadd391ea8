"""The session of a browser: a cookie in place of a token, and what pages of other sites can do with it."""
import os
import sqlite3

import pytest
import requests
from daemon_under_test import DOCUMENT, problem
from test_tokens import certificate, make


@pytest.fixture
def signed_in(daemon_maker):
    d = daemon_maker(options={"server.public_origin": "https://selvedge.example.org"})
    d.admin = d.of(d.make_token("root"))
    r = d.post("/v1/session", json={"token": make(d.admin, "ann", "submit", jobs=3)})
    assert r.status_code == 200 and r.headers["Cache-Control"] == "no-store"
    d.cookie = r.headers["Set-Cookie"]
    assert d.session.cookies["selvedge_session"]
    return d


def test_the_cookie_stands_for_the_token(signed_in):
    name, *flags = signed_in.cookie.split("; ")
    assert name.startswith("selvedge_session=selvedge_") and set(flags) == {"Path=/", "Max-Age=43200", "HttpOnly", "SameSite=Strict"}
    job = signed_in.create()
    assert signed_in.job(job)["owner"] == "ann"
    who = signed_in.get("/v1/session").json()
    assert who == {"token_needed": True, "name": "ann", "owner": "ann", "scope": "submit", "quota": {"requests_per_minute": 0, "stored_bytes": 0, "jobs": 3},
                   "used": {"stored_bytes": 0, "jobs": 1}}
    problem(signed_in.get("/v1/tokens"), 403, "scope")
    # the cookie's value is no bearer token, and a wrong header is not replaced by a cookie
    value = signed_in.session.cookies["selvedge_session"]
    problem(requests.get(signed_in.url + "/v1/jobs", headers={"Authorization": f"Bearer {value}"}, timeout=100), 401, "token")
    problem(signed_in.get("/v1/jobs", headers={"Authorization": "Bearer x"}), 401, "token")


def test_pages_of_other_sites_cannot_use_it(signed_in):
    for origin in ("https://evil.example", "null", f"http://localhost:{signed_in.port + 1}"):
        problem(signed_in.post("/v1/jobs", json=DOCUMENT, headers={"Origin": origin}), 403, "origin")
        problem(signed_in.delete("/v1/session", headers={"Origin": origin}), 403, "origin")
    assert signed_in.post("/v1/jobs", json=DOCUMENT, headers={"Origin": signed_in.url}).status_code == 201
    assert "Access-Control-Allow-Origin" not in signed_in.get("/v1/jobs").headers


def test_signing_out_ends_it_on_the_server(signed_in):
    cookies = signed_in.session.cookies.copy()
    r = signed_in.delete("/v1/session")
    assert r.status_code == 204 and "Max-Age=0" in r.headers["Set-Cookie"]
    problem(requests.get(signed_in.url + "/v1/jobs", cookies=cookies, timeout=100), 401, "token")
    assert requests.delete(signed_in.url + "/v1/session", cookies=cookies, timeout=100).status_code == 204


def test_a_session_survives_a_restart_and_ends_in_time(signed_in):
    cookies = signed_in.session.cookies.copy()
    signed_in.stop()
    signed_in.start()
    signed_in.session.cookies = cookies
    assert signed_in.get("/v1/jobs").status_code == 200
    with sqlite3.connect(os.path.join(signed_in.data, "selvedge.db"), timeout=10) as db:
        assert db.execute("UPDATE session SET expires = expires - 43201").rowcount == 1
    problem(signed_in.get("/v1/jobs"), 401, "token")
    admin = signed_in.of(signed_in.admin.session.headers["Authorization"].split()[1])  # the port is another one now
    signed_in.post("/v1/session", json={"token": make(admin, "eve")})
    with sqlite3.connect(os.path.join(signed_in.data, "selvedge.db"), timeout=10) as db:
        assert db.execute("SELECT count(*) FROM session").fetchone() == (1,)  # the old one is gone


@pytest.mark.parametrize("body", [{}, {"token": 3}, {"token": "x", "more": 1}, []])
def test_what_signs_nobody_in(signed_in, body):
    problem(signed_in.post("/v1/session", json=body), 422, "invalid", "token")


def test_the_cookie_is_secure_where_https_is_spoken(daemon_maker, tmp_path, signed_in):
    token = make(signed_in.admin, "far")
    behind = signed_in.post("/v1/session", json={"token": token}, headers={"Host": "selvedge.example.org"})
    assert "; Secure" in behind.headers["Set-Cookie"]
    d = daemon_maker("tls", options=certificate(tmp_path))
    token = d.make_token("root")
    r = requests.post(d.url + "/v1/session", json={"token": token}, verify=d.options["server.tls_certificate"], timeout=100)
    assert r.status_code == 200 and "; Secure" in r.headers["Set-Cookie"]
