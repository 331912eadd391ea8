"""Retention: which finished jobs go by age and size, which never go, and what is said of those that went."""
import json
import os
import sqlite3
import subprocess
import time

import pytest
from daemon_under_test import program, wait_until

DAY_S = 86400


def ended(d, behaviour="succeed", state="succeeded"):
    job = d.start_job(behaviour)
    d.wait_state(job, state)
    return job


def set_age(d, **days):
    """Stops the daemon and makes jobs end so many days ago: set_age(d, **{job: 10})."""
    d.stop()
    with sqlite3.connect(os.path.join(d.data, "selvedge.db")) as db:
        for job, n in days.items():
            db.execute("UPDATE job SET finished = ? WHERE id = ?", (time.time() - n * DAY_S, job))
    db.close()


def ids(plan, key="jobs"):
    return [job["id"] for job in plan[key]]


def exists(d, job):
    return d.get(f"/v1/jobs/{job}").status_code == 200


def cli(d, *arguments):
    return subprocess.run([program("selvedge"), arguments[0], "--server", d.url, *arguments[1:]], capture_output=True, text=True, timeout=300)


def test_the_daemon_removes_by_age_and_says_so(daemon_maker):
    d = daemon_maker()
    old, failed, kept, young, draft = ended(d), ended(d, "fail", "failed"), ended(d), ended(d), d.create()
    assert d.request("PUT", f"/v1/jobs/{kept}/keep").status_code == 204
    set_age(d, **{old: 10, failed: 11, kept: 12, young: 2})
    d.options.update({"retention.max_age_days": 5, "retention.check_s": 1})
    d.start()
    assert ids(d.get("/v1/retention").json()) == [failed, old], "the list that the daemon acts by, before it does"
    wait_until(lambda: not exists(d, old) and not exists(d, failed), what="removal by age")
    removals = wait_until(lambda: len(d.get("/v1/removals").json()["removals"]) == 2 and d.get("/v1/removals").json()["removals"])
    assert [r["id"] for r in removals] == [old, failed] and {r["reason"] for r in removals} == {"age"}
    assert all(r["bytes"] > 0 and abs(r["removed_unix_s"] - time.time()) < 60 for r in removals)
    wait_until(lambda: not os.path.exists(os.path.join(d.data, "jobs", old)), what="removal of the folder")
    assert f"job {old} ('fake: succeed'" in d.log_text()
    time.sleep(1.5)
    assert exists(d, kept) and exists(d, young) and exists(d, draft), "kept, young and unfinished jobs stay"
    d.stop()
    d.start()
    assert len(d.get("/v1/removals?limit=1").json()["removals"]) == 1, "the record outlives the daemon"


def test_the_daemon_removes_by_size_the_oldest_first(daemon_maker):
    d = daemon_maker()
    first, second, third = ended(d), ended(d), ended(d)
    set_age(d, **{first: 1, second: 3, third: 2})
    d.start()
    plan = d.get("/v1/retention?max_bytes=1").json()
    assert ids(plan) == [second, third, first] and plan["total_bytes"] == plan["removed_bytes"] == sum(j["bytes"] for j in plan["jobs"])
    limit = plan["total_bytes"] - 1
    assert ids(d.get(f"/v1/retention?max_bytes={limit}").json()) == [second], "one is enough"
    d.stop()
    d.options.update({"retention.max_bytes": limit, "retention.check_s": 1})
    d.start()
    wait_until(lambda: not exists(d, second), what="removal by size")
    time.sleep(1.5)
    assert exists(d, first) and exists(d, third)
    assert d.get("/v1/removals").json()["removals"][0]["reason"] == "size"


def test_without_limits_nothing_goes(daemon_maker):
    d = daemon_maker(options={"retention.check_s": 1})
    job = ended(d)
    set_age(d, **{job: 10000})
    d.start()
    time.sleep(1.5)
    plan = d.get("/v1/retention").json()
    assert exists(d, job) and plan["jobs"] == [] and plan["max_age_days"] is None and plan["total_bytes"] > 0


def test_the_command_asks_first(daemon_maker):
    d = daemon_maker()
    old, kept, young = ended(d), ended(d), ended(d)
    assert cli(d, "keep", kept).returncode == 0
    set_age(d, **{old: 100, kept: 100})
    d.start()
    said = cli(d, "retention", "--max-age-days", "30")
    assert said.returncode == 0 and old in said.stdout and kept not in said.stdout and young not in said.stdout
    assert "nothing was removed" in said.stderr and "1 jobs are kept" in said.stderr and exists(d, old)
    said = cli(d, "retention", "--max-age-days", "30", "--yes", "--json")
    assert ids(json.loads(said.stdout), "removed") == [old] and not exists(d, old) and exists(d, kept) and exists(d, young)
    assert cli(d, "unkeep", kept).returncode == 0
    assert kept in cli(d, "retention", "--max-age-days", "30", "--yes").stdout and not exists(d, kept)
    said = cli(d, "retention", "--max-age-days", "soon")
    assert said.returncode == 1 and "--max-age-days" in said.stderr


def test_what_never_goes(daemon_maker):
    d = daemon_maker()
    source, kept = ended(d), ended(d)
    d.request("PUT", f"/v1/jobs/{kept}/keep")
    draft = d.create({"sample": "goes on", "geometry": {"job": source}, "measurements": {"file": "rows.csv"}})
    running = d.start_job("work")
    d.wait_state(running, "running")
    asked = [source, kept, draft, running, "no-such-job"]
    done = d.post("/v1/retention", json={"jobs": asked}).json()
    assert done["removed"] == [] and [left["id"] for left in done["not_removed"]] == asked
    for left, word in zip(done["not_removed"], ["geometry", "is kept", "is draft", "is running", "does not exist"]):
        assert word in left["why"], left
    assert d.get("/v1/retention?max_bytes=1").json()["jobs"] == []
    d.delete(f"/v1/jobs/{draft}")
    assert ids(d.get("/v1/retention?max_bytes=1").json()) == [source]


def test_a_kept_job_shows_it(daemon):
    job = ended(daemon)
    before = daemon.get(f"/v1/jobs/{job}")
    assert before.json()["kept"] is False
    daemon.request("PUT", f"/v1/jobs/{job}/keep")
    after = daemon.get(f"/v1/jobs/{job}", headers={"If-None-Match": before.headers["ETag"]})
    assert after.status_code == 200 and after.json()["kept"] is True and after.json()["state"] == "succeeded"


@pytest.mark.parametrize("body", [[], {}, {"jobs": "all"}, {"jobs": [1]}, {"jobs": ["x"] * 1001}, {"jobs": [], "age": 1}])
def test_unclear_requests_remove_nothing(daemon, body):
    reply = daemon.post("/v1/retention", json=body)
    assert reply.status_code == 422 and reply.json()["field"] == "jobs"
