"""Quotas of tokens, and the order in which jobs of several owners run."""
import threading

import pytest
from daemon_under_test import DOCUMENT, document, problem, wait_until
from test_tokens import make


@pytest.fixture
def guarded(daemon_maker):
    d = daemon_maker(options={"access.jobs": 4, "access.stored_bytes": 1000, "access.requests_per_minute": 100000})
    d.admin = d.of(d.make_token("root"))
    return d


def test_requests_a_minute(guarded):
    token = make(guarded.admin, "eager", requests_per_minute=60)
    user, other = guarded.of(token), guarded.of(make(guarded.admin, "calm"))
    codes = [user.get("/v1/jobs?limit=1").status_code for _ in range(70)]
    # a minute's requests at once, then one a second
    assert codes[:60] == [200] * 60 and 429 in codes[60:]
    r = next(r for r in iter(lambda: user.get("/v1/jobs"), None) if r.status_code == 429)
    body = problem(r, 429, "rate")
    assert r.headers["Retry-After"] == "1" and body["retry_after_s"] == 1 and body["requests_per_minute"] == 60
    cookies = guarded.post("/v1/session", json={"token": token}).cookies
    assert 429 in [guarded.get("/v1/jobs", cookies=cookies).status_code for _ in range(3)]  # the session counts for its token
    assert other.get("/v1/jobs").status_code == 200 and guarded.get("/livez").status_code == 200
    wait_until(lambda: user.get("/v1/jobs").status_code == 200, 3, "the next request")


def declare(user, job, name, size):
    return user.post(f"/v1/jobs/{job}/files", json={"name": name, "role": "volume", "size": size})


def test_bytes_are_decided_at_the_declaration(guarded):
    user, small = guarded.of(make(guarded.admin, "ann")), guarded.of(make(guarded.admin, "small", stored_bytes=10))
    job, second = user.create(), user.create()
    assert declare(user, job, "a.tif", 600).status_code == 201
    r = declare(user, second, "b.tif", 401)
    body = problem(r, 507, "quota", "size")
    assert (body["quota_bytes"], body["used"], body["wanted"]) == (1000, 600, 401)
    assert user.get(f"/v1/jobs/{second}/files").json()["files"] == []
    assert declare(user, second, "b.tif", 400).status_code == 201
    assert declare(user, job, "a.tif", 600).status_code == 200  # a repeat takes no more
    problem(declare(user, job, "c.tif", 1), 507, "quota", "size")
    problem(small.post(f"/v1/jobs/{small.create()}/files", json=[{"name": f"{i}.tif", "role": "volume", "size": 6} for i in range(2)]), 507, "quota")
    assert small.get("/v1/session").json()["used"]["stored_bytes"] == 0
    # what is deleted, file or job, can be used again at once
    assert user.delete(f"/v1/jobs/{job}/files/a.tif").status_code == 204
    assert user.get("/v1/session").json()["used"] == {"stored_bytes": 400, "jobs": 2}
    assert user.delete(f"/v1/jobs/{second}").status_code == 204
    assert user.get("/v1/session").json()["used"] == {"stored_bytes": 0, "jobs": 1}
    assert declare(user, job, "a.tif", 1000).status_code == 201
    guarded.stop()
    guarded.start()
    assert guarded.of(user.session.headers["Authorization"].split()[1]).get("/v1/session").json()["used"] == {"stored_bytes": 1000, "jobs": 1}


def test_two_at_once_do_not_pass_the_quota_together(guarded):
    token = make(guarded.admin, "ann", stored_bytes=100)
    jobs = [guarded.of(token).create() for _ in range(4)]
    codes = []
    threads = [threading.Thread(target=lambda i=i: codes.append(declare(guarded.of(token), jobs[i % 4], f"{i}.tif", 30).status_code)) for i in range(12)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert sorted(codes) == [201] * 3 + [507] * 9


def test_jobs_are_counted_by_owner(guarded):
    user = guarded.of(make(guarded.admin, "ann"))
    more = guarded.of(make(guarded.admin, "ann2", owner="ann", jobs=5))
    free = guarded.of(make(guarded.admin, "free", jobs=0))
    jobs = [user.create() for _ in range(4)]
    body = problem(user.post("/v1/jobs", json=DOCUMENT), 507, "quota")
    assert (body["quota_jobs"], body["used"], body["wanted"]) == (4, 4, 1)
    more.create()
    problem(more.post("/v1/jobs", json=DOCUMENT), 507, "quota")
    assert user.post("/v1/jobs", json=DOCUMENT, headers={"Idempotency-Key": "k"}).status_code == 507
    assert user.delete(f"/v1/jobs/{jobs[0]}").status_code == 204
    assert user.delete(f"/v1/jobs/{jobs[1]}").status_code == 204
    job = user.create(**{"Idempotency-Key": "k"})
    assert user.create(**{"Idempotency-Key": "k"}) == job  # a replay makes none
    for _ in range(6):
        free.create()


def started(user, jobs):
    """The jobs in the order in which they were started, once all have ended."""
    for job in jobs:
        user.wait_state(job, "succeeded")
    return sorted(jobs, key=lambda job: user.job(job)["started_unix_s"])


def test_owners_take_turns_and_priorities_order_the_jobs_of_one(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 1})
    admin = d.of(d.make_token("root"))
    ann, bob = d.of(make(admin, "ann")), d.of(make(admin, "bob"))
    holder = admin.start_job("climb")  # keeps the only worker until it is cancelled
    admin.wait_state(holder, "running")
    queue = [ann.start_job() for _ in range(3)]
    urgent = ann.ready_job()
    r = ann.post(f"/v1/jobs/{urgent}/start?priority=5")
    assert r.status_code == 202 and r.json()["priority"] == 5
    last = ann.post(f"/v1/jobs/{queue[0]}/start?priority=-10")
    assert last.status_code == 200 and last.json()["priority"] == -10  # of a job that is queued already
    of_bob = bob.start_job()
    problem(ann.post(f"/v1/jobs/{urgent}/start?priority=11"), 422, "invalid", "priority")
    admin.post(f"/v1/jobs/{holder}/cancel")
    order = started(admin, [*queue, urgent, of_bob])
    assert [j for j in order if j != of_bob] == [urgent, queue[1], queue[2], queue[0]]


def test_a_long_queue_of_one_owner_does_not_keep_another_waiting(daemon_maker):
    d = daemon_maker(options={"jobs.workers": 2})
    admin = d.of(d.make_token("root"))
    ann, bob = d.of(make(admin, "ann")), d.of(make(admin, "bob"))
    long = [ann.start_job("climb") for _ in range(4)]
    wait_until(lambda: sum(ann.job(j)["state"] == "running" for j in long) == 2)
    waiting = bob.start_job("climb")
    ann.post(f"/v1/jobs/{long[0]}/cancel")
    # the free worker goes to bob, who has none, though two of ann's have waited longer
    bob.wait_state(waiting, "running")
    assert [ann.job(j)["state"] for j in long[1:]] == ["running", "queued", "queued"]
    for j in long:
        ann.post(f"/v1/jobs/{j}/cancel")
    bob.post(f"/v1/jobs/{waiting}/cancel")
    assert document()["sample"] == "fake: succeed"
