"""The list of jobs: filters, orders, pages, rows and digests, tags, actions on many jobs, and the forecast of the queue."""
import os
import time

import pytest
from daemon_under_test import document
from servers.old_database import make_older


@pytest.fixture(scope="module")
def jobs(daemon):
    """Five drafts by name, made in this order."""
    samples = ("blue Twill", "Silk 100%", "a_b", "wool twill", "ähre")
    return {name: daemon.post("/v1/jobs", json={**document(), "sample": name}).json()["id"] for name in samples}


def names(daemon, query):
    reply = daemon.get(f"/v1/jobs?{query}")
    assert reply.status_code == 200, reply.text
    return [job["sample"] for job in reply.json()["jobs"]]


def test_filters(daemon, jobs):
    assert names(daemon, "sample=TWILL") == ["wool twill", "blue Twill"]
    assert names(daemon, "sample=100%25") == ["Silk 100%"] and names(daemon, "sample=a_b") == ["a_b"] and names(daemon, "sample=axb") == []
    assert names(daemon, "state=draft,queued&sample=wool") == ["wool twill"] and names(daemon, "state=failed,running&sample=wool") == []
    one = jobs["a_b"]
    assert names(daemon, f"id={one[:8]}") == ["a_b"] and names(daemon, f"id={one}") == ["a_b"]
    made = daemon.get(f"/v1/jobs/{one}").json()["created_unix_s"]
    assert names(daemon, f"created_after={made!r}") == ["ähre", "wool twill", "a_b"]
    assert names(daemon, f"created_before={made!r}") == ["Silk 100%", "blue Twill"]
    assert set(names(daemon, "verdict=none")) == set(jobs) and names(daemon, "verdict=good,good_but_undetermined,pictures_only,usable") == []
    refused = daemon.get("/v1/jobs?verdict=good,best")
    assert refused.status_code == 422 and refused.json()["field"] == "verdict"
    assert "has 'best'; it must be good, good_but_undetermined" in refused.json()["detail"]


@pytest.mark.parametrize("sort", ["created", "finished", "sample"])
@pytest.mark.parametrize("order", ["asc", "desc"])
def test_pages_of_each_order(daemon, jobs, sort, order):
    whole = names(daemon, f"sort={sort}&order={order}")
    found, cursor = [], ""
    while cursor is not None:
        page = daemon.get(f"/v1/jobs?sort={sort}&order={order}&limit=2{cursor and '&cursor=' + cursor}").json()
        found += [job["sample"] for job in page["jobs"]]
        cursor = page["next_cursor"]
    assert found == whole and sorted(found) == sorted(jobs)
    by_name = ["a_b", "blue Twill", "Silk 100%", "wool twill", "ähre"]
    expected = by_name if sort == "sample" else list(jobs)
    assert whole == (expected if order == "asc" else expected[::-1])


@pytest.mark.parametrize("query, field", [
    ("colour=red", "colour"), ("limit=2&limit=3", "limit"), ("state=asleep", "state"), ("state=", "state"), ("state=draft,", "state"),
    ("verdict=nice", "verdict"), ("sort=age", "sort"), ("order=up", "order"), ("view=full", "view"), ("id=XYZ", "id"), ("created_after=today", "created_after"),
    ("created_before=nan", "created_before"), ("cursor=0", "cursor"), ("cursor=5x", "cursor"), ("sort=sample&cursor=5", "cursor"),
    ("sort=sample&cursor=5.0g", "cursor"),
    ("%FF%01=1", "??")])
def test_what_is_unknown_is_refused(daemon, query, field):
    reply = daemon.get(f"/v1/jobs?{query}")
    assert reply.status_code == 422 and reply.json()["field"] == field and reply.json()["code"] == "invalid"


def test_every_endpoint_refuses_unknown_parameters(daemon, jobs):
    for path in ("/v1/about", "/v1/tags", f"/v1/jobs/{jobs['a_b']}", f"/v1/jobs/{jobs['a_b']}/log"):
        assert daemon.get(f"{path}?no=1").json()["field"] == "no"
    reply = daemon.post(f"/v1/jobs/{jobs['a_b']}/cancel?force=1")
    assert reply.status_code == 422 and daemon.get(f"/v1/jobs/{jobs['a_b']}").json()["state"] == "draft"


def test_rows_are_sent_only_when_they_have_changed(daemon, jobs):
    reply = daemon.get("/v1/jobs?view=row&sort=sample")
    rows, tag = reply.json()["jobs"], reply.headers["ETag"]
    assert len({row["digest"] for row in rows}) == 5 and all(len(row["digest"]) == 12 for row in rows)
    assert daemon.get("/v1/jobs?view=row&sort=sample", headers={"If-None-Match": tag}).status_code == 304
    have = ",".join(row["digest"] for row in rows)
    again = daemon.get(f"/v1/jobs?view=row&sort=sample&have={have}")
    assert again.headers["ETag"] == tag and again.json()["jobs"] == [{"id": row["id"], "digest": row["digest"]} for row in rows]
    daemon.put(f"/v1/jobs/{jobs['a_b']}/tags", json={"tags": ["row"]})
    changed = daemon.get(f"/v1/jobs?view=row&sort=sample&have={have}", headers={"If-None-Match": tag})
    assert changed.status_code == 200 and [row["id"] for row in changed.json()["jobs"] if "sample" in row] == [jobs["a_b"]]
    assert changed.json()["jobs"][-1]["tags"] == ["row"]
    daemon.put(f"/v1/jobs/{jobs['a_b']}/tags", json={"tags": []})


def test_tags(daemon, jobs):
    a, b = jobs["a_b"], jobs["wool twill"]
    job = daemon.put(f"/v1/jobs/{a}/tags", json={"tags": ["batch-7", "Größe:L", "batch-7"]})
    assert job.status_code == 200 and job.json()["tags"] == ["batch-7", "Größe:L"] and daemon.get(f"/v1/jobs/{a}").json()["tags"] == ["batch-7", "Größe:L"]
    outcome = daemon.post("/v1/actions", json={"action": "tag", "jobs": [a, b], "add_tags": ["batch-7"], "remove_tags": ["Größe:L", "none"]}).json()["results"]
    assert [one["outcome"] for one in outcome] == ["done", "done"]
    again = daemon.post("/v1/actions", json={"action": "tag", "jobs": [b], "add_tags": ["batch-7"]}).json()["results"]
    assert again == [{"id": b, "outcome": "unchanged", "state": "draft"}]
    assert names(daemon, "tag=batch-7") == ["wool twill", "a_b"] and names(daemon, "tag=batch") == [] and names(daemon, "tag=Größe:L") == []
    assert daemon.get("/v1/tags").json() == {"tags": [{"tag": "batch-7", "jobs": 2}]}
    for bad in (["a b"], [""], ["a,b"], ["x" * 41], ["\n"], [5], "x", [str(i) for i in range(17)]):
        reply = daemon.put(f"/v1/jobs/{a}/tags", json={"tags": bad})
        assert reply.status_code == 422 and reply.json()["field"].startswith("tags"), bad
    for _ in range(2):  # more than 16 in all
        reply = daemon.post("/v1/actions", json={"action": "tag", "jobs": [a], "add_tags": [f"t{i}" for i in range(16)]}).json()["results"]
        assert reply[0]["outcome"] == "refused" and reply[0]["code"] == "invalid"
    daemon.post("/v1/actions", json={"action": "tag", "jobs": [a, b], "remove_tags": ["batch-7"]})
    assert daemon.get("/v1/tags").json() == {"tags": []}


def test_actions_say_what_came_of_each_job(daemon):
    draft, done = daemon.create(), daemon.start_job()
    daemon.wait_state(done, "succeeded")
    nobody = "00000000-0000-0000-0000-000000000000"

    def act(action, *ids):
        results = daemon.post("/v1/actions", json={"action": action, "jobs": list(ids)}).json()["results"]
        return [(one["outcome"], one.get("state"), one.get("code")) for one in results]
    unknown = ("refused", None, "not_found")
    assert act("cancel", draft, done, nobody, "../x") == [("done", "cancelled", None), ("unchanged", "succeeded", None), unknown, unknown]
    assert act("cancel", draft) == [("unchanged", "cancelled", None)]
    assert act("retry", draft, done) == [("refused", None, "files_missing"), ("refused", None, "conflict")]
    assert act("start", done) == [("unchanged", "succeeded", None)]
    assert act("delete", draft, done) == [("done", None, None), ("done", None, None)] and daemon.get(f"/v1/jobs/{done}").status_code == 404
    for bad, field in (({"action": "jump", "jobs": []}, "action"), ({"action": "retry", "jobs": "all"}, "jobs"), ({"action": "retry", "jobs": [5]}, "jobs"),
                       ({"action": "retry", "jobs": [], "add_tags": ["x"]}, "add_tags"), ({"action": "tag", "jobs": [], "tags": []}, "tags")):
        reply = daemon.post("/v1/actions", json=bad)
        assert reply.status_code == 422 and reply.json()["field"] == field, bad


def test_the_queue_is_foreseen(daemon_maker):
    daemon = daemon_maker(options={"jobs.workers": 1})
    daemon.wait_state(daemon.start_job(), "succeeded")
    running = daemon.start_job("work 60")
    daemon.wait_state(running, "running")
    waiting = [daemon.start_job("work 60") for _ in range(3)]
    urgent = daemon.start_job("work 60")
    daemon.post(f"/v1/jobs/{urgent}/start?priority=5")

    def places():
        return [daemon.get(f"/v1/jobs/{job}").json()["queue_position"] for job in (urgent, *waiting)]
    time.sleep(1)
    assert places() == [1, 2, 3, 4]
    rows = {row["id"]: row for row in daemon.get("/v1/jobs?view=row&state=queued").json()["jobs"]}
    starts = [rows[job]["expected_start_unix_s"] for job in (urgent, *waiting)]
    assert starts == sorted(starts) and time.time() - 1 <= starts[0] <= time.time() + 90
    assert "queue_position" not in daemon.get(f"/v1/jobs?view=row&id={running}").json()["jobs"][0]
    assert daemon.get(f"/v1/jobs/{running}").json()["queue_position"] is None
    daemon.post("/v1/actions", json={"action": "delete", "jobs": [running, urgent, *waiting]})


def test_the_tags_and_jobs_of_others_are_not_seen(daemon_maker):
    daemon = daemon_maker()
    admin = daemon.of(daemon.make_token("root"))
    ann, bob = (daemon.of(admin.post("/v1/tokens", json={"name": name, "scope": "submit"}).json()["token"]) for name in ("ann", "bob"))
    job = ann.create()
    assert ann.put(f"/v1/jobs/{job}/tags", json={"tags": ["secret"]}).status_code == 200
    assert bob.get("/v1/tags").json() == {"tags": []} and bob.get("/v1/jobs?tag=secret").json()["jobs"] == []
    assert bob.put(f"/v1/jobs/{job}/tags", json={"tags": []}).status_code == 404
    assert [one["code"] for one in bob.post("/v1/actions", json={"action": "delete", "jobs": [job]}).json()["results"]] == ["not_found"]
    assert ann.get("/v1/tags").json() == admin.get("/v1/tags").json() == {"tags": [{"tag": "secret", "jobs": 1}]}


def test_an_older_database_gets_its_verdicts(daemon_maker):
    """A database of the schema before verdicts, in which a job has succeeded with a verdict."""
    daemon = daemon_maker()
    job = daemon.start_job()
    daemon.wait_state(job, "succeeded")
    daemon.stop()
    status = os.path.join(daemon.data, "jobs", job, "status.json")
    with open(status) as f:
        text = f.read()
    with open(status, "w") as f:
        f.write(text.rstrip().rstrip("}") + ', "verdict": {"code": "usable", "words": "usable with reservations", "text": "."}}')
    make_older(os.path.join(daemon.data, "selvedge.db"), 4)
    daemon.start()
    (row,) = daemon.get("/v1/jobs?view=row&verdict=usable").json()["jobs"]
    assert row["id"] == job and row["verdict"] == {"code": "usable", "words": "usable with reservations"}
    assert os.path.exists(os.path.join(daemon.data, "selvedge.db.v4"))
