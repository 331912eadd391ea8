"""A power cut at any moment, for everything that test_power_loss.py has not: versions of results, tags, tokens, linked
inputs, batches, kept jobs, retention, backups, and the migration of an older database.

Tests of missing syncs leave out syncs from the record; the same checks must notice that something is missing."""
import contextlib
import os
import re
import shutil
import sqlite3

import pytest
from daemon_under_test import FILES, Daemon, document, sha256, wait_until
from disks.replay import record, try_states
from servers.old_database import make_older, migrations

OPTIONS = {"backup.every_s": 1, "disk.ballast_bytes": 0}
OLD = len(migrations()) - 1
KNOWN = [{"name": name, "size": len(data), "sha256": sha256(data)} for name, (_, data) in FILES.items()]
BATCH = {"name": "batch", "template": document(), "samples": [{"sample": f"fake: {s}", "replace": {}, "files": KNOWN} for s in ("a", "b", "c")]}


def as_root(d, token):
    d.session.headers["Authorization"] = f"Bearer {token}"


def started_as(token):
    """A daemon that asks with a token as soon as it runs."""
    class AsRoot(Daemon):
        def start(self):
            super().start()
            as_root(self, token)
            return self
    return AsRoot


def look(d, job):
    """The job without its result, which a worker that syncs nothing may have lost."""
    r = d.get(f"/v1/jobs/{job}")
    assert r.status_code == 200, f"job {job} is lost: {r.status_code}"
    return r.json()


# ---- what is confirmed. journal.say(name, fact=(check, ...)): the last fact of a name holds


def say(journal, name, check, *arguments):
    journal.say(name, fact=(check, arguments))


def check_version(d, job, number, content):
    r = d.get(f"/v1/jobs/{job}/versions/{number}/result.json")
    assert r.status_code == 200 and r.content == content, f"version {number} of job {job} is lost: {r.status_code}"


def check_tags(d, job, *allowed):
    assert look(d, job)["tags"] in allowed, "tags are lost"


def check_token(d, token, *allowed):
    assert d.of(token).get("/v1/jobs").status_code in allowed, "a token, or that it was revoked, is forgotten"


def check_files(d, job):
    for name, (_, data) in FILES.items():
        assert d.get(f"/v1/jobs/{job}/files/{name}").content == data, f"input {name} of job {job} is lost"


def check_batch(d, batch):
    """Submitting it again gives the same batch, with all jobs and files, whether or not it was confirmed."""
    r = d.post("/v1/batches", json=BATCH)
    assert r.status_code in (200, 201), r.text
    assert batch in (None, r.json()["id"]), "the batch is forgotten"
    for one in r.json()["samples"]:
        assert look(d, one["job"])["sample"] == one["sample"]
        check_files(d, one["job"])


def check_kept(d, job):
    if look(d, job)["state"] == "succeeded":
        refused = d.post("/v1/retention", json={"jobs": [job]}).json()["not_removed"]
        assert refused and "is kept" in refused[0]["why"], "the mark of a kept job is lost"


def check_removed(d, job):
    assert d.get(f"/v1/jobs/{job}").status_code == 404, "a removed job is back"
    assert job in [one["id"] for one in d.get("/v1/removals").json()["removals"]], "the removal is not recorded"


def check_copy(d, name, n_job):
    try:
        with contextlib.closing(sqlite3.connect(f"file:{os.path.join(d.data, name)}?mode=ro", uri=True)) as db:
            assert db.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            assert db.execute("SELECT count(*) FROM job").fetchone()[0] >= n_job
    except sqlite3.Error as e:
        raise AssertionError(f"the copy {name} is lost or damaged: {e}") from e


def check_all(folder, expected, make=Daemon):
    """Starts a daemon on this disk. Everything that is expected holds, and new jobs can be made."""
    d = make(folder, options={**OPTIONS, "backup.every_s": 0}).start()
    try:
        for fact in expected.values():
            check, arguments = fact["fact"]
            check(d, *arguments)
        assert look(d, d.ready_job())["state"] == "draft"
    finally:
        d.kill()


# ---- what is done


def keep_versions(d, journal):
    """A job that is run three times, with an edit between."""
    job = d.create(document("synced one"))
    for name, (role, data) in FILES.items():
        d.upload(job, name, data, role)
    for number, sample in enumerate(("one", "two", "three"), 1):
        if number > 1:
            assert d.put(f"/v1/jobs/{job}/document", json=document(f"synced {sample}")).status_code == 200
        assert d.post(f"/v1/jobs/{job}/start").status_code == 202
        d.wait_state(job, "succeeded")
        content = d.get(f"/v1/jobs/{job}/results/result.json").content
        assert f'"argument": "{sample}"'.encode() in content
        say(journal, f"version {number}", check_version, job, number, content)
    return job


def tag(d, journal, job):
    before = []
    for tags in (["red"], ["blue", "green"], []):
        say(journal, "tags", check_tags, job, before, tags)
        assert d.put(f"/v1/jobs/{job}/tags", json={"tags": tags}).status_code in (200, 204)
        say(journal, "tags", check_tags, job, tags)
        before = tags


def make_tokens(d, journal):
    for name in ("ann", "bob"):
        r = d.post("/v1/tokens", json={"name": name, "scope": "read"})
        assert r.status_code == 201
        token = r.json()["token"]
        say(journal, name, check_token, token, 200)
    say(journal, "bob", check_token, token, 200, 401)
    assert d.delete("/v1/tokens/bob").status_code == 204
    say(journal, "bob", check_token, token, 401)


def link_inputs(d, journal):
    """Inputs that another job has. Returns the job."""
    job = d.create(document())
    for name, (role, data) in FILES.items():
        assert d.declare(job, name, data, role, checked=True)["state"] == "complete"
    say(journal, f"inputs of {job}", check_files, job)
    return job


def submit_batch(d, journal):
    say(journal, "batch", check_batch, None)
    r = d.post("/v1/batches", json=BATCH)
    assert r.status_code == 201, r.text
    say(journal, "batch", check_batch, r.json()["id"])


def retain(d, journal):
    kept, removed = (link_inputs(d, journal) for _ in range(2))
    for job in (kept, removed):
        assert d.post(f"/v1/jobs/{job}/start").status_code == 202
        d.wait_state(job, "succeeded")
    assert d.put(f"/v1/jobs/{kept}/keep").status_code == 204
    say(journal, "kept", check_kept, kept)
    for name in (f"inputs of {removed}", "removed"):
        say(journal, name, lambda d: None)
    r = d.post("/v1/retention", json={"jobs": [removed]})
    assert [one["id"] for one in r.json()["removed"]] == [removed], r.text
    say(journal, "removed", check_removed, removed)


def await_backup(d, journal):
    def last():
        return next(float(line.split()[1]) for line in d.get("/metrics").text.splitlines()
                    if line.startswith("selvedge_backup_last_success_timestamp_seconds "))
    before = last()
    wait_until(lambda: last() > before, what="a backup")
    for name in os.listdir(os.path.join(d.data, "backup")):
        if name.endswith(".db"):
            say(journal, name, check_copy, os.path.join("backup", name), 1)


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    """(calls, journal, class of daemons that know the token)"""
    folder = tmp_path_factory.mktemp("paths")
    with Daemon(folder / "data", options={**OPTIONS, "backup.every_s": 0}) as d:
        token = d.make_token("root")
        as_root(d, token)
        d.ready_job()

    def scenario(d, journal):
        as_root(d, token)
        say(journal, "root", check_token, token, 200)
        job = keep_versions(d, journal)
        tag(d, journal, job)
        make_tokens(d, journal)
        link_inputs(d, journal)
        submit_batch(d, journal)
        retain(d, journal)
        await_backup(d, journal)

    return *record(folder, scenario, options=OPTIONS), started_as(token)


def test_nothing_confirmed_is_lost(paths, memory_folder):
    calls, journal, make = paths
    assert {"link", "rename", "sync"} <= {c.name for c in calls}
    n, lost = try_states(calls, journal, memory_folder, lambda *to: check_all(*to, make), shares=(0.4, 0.02))
    print(f"{len(calls)} calls, {n} states, {len(lost)} with a loss")
    assert n > 50 and not lost, lost


LINK = b"link"  # a call, no part of a path
# syncs to leave out, what is lost without them, and a part of the name of the first path from which on it may be lost
MISSING = {
    "the folder of versions": (lambda c: c.path.endswith(b"/versions"), "version 1 of job", b"/versions"),
    "the folder of linked inputs": (lambda c: c.path.endswith(b"/input"), "input .* is lost", LINK),
    "everything, for a batch": (lambda c: "all" in c.flags, "is lost|is forgotten|behind", b""),
    "the bytes of backups": (lambda c: b"backup/" in c.path, "the copy .* is lost", b"removed.rec"),
    "the folder of backups": (lambda c: c.path == b"backup", "the copy .* is lost", b"removed.rec"),
    "the record of removals": (lambda c: c.path == b"removed.rec", "not recorded", b"removed.rec"),
    "the database": (lambda c: b"selvedge.db" in c.path, "", b""),
}


def without(calls, dropped):
    """Returns the calls without some syncs, and the place of the first one: before it nothing is different."""
    found = [i for i, c in enumerate(calls) if c.name == "sync" and dropped(c)]
    assert found, "there is no such sync"
    return [c for i, c in enumerate(calls) if i not in found], found[0]


@pytest.mark.parametrize("what", MISSING)
def test_a_missing_sync_is_found(paths, memory_folder, what):
    calls, journal, make = paths
    dropped, loss, part = MISSING[what]
    left, begin = without(calls, dropped)
    begin = max(begin, next(i for i, c in enumerate(left) if (c.name == "link" if part is LINK else part in c.path)))
    n, lost = try_states(left, journal, memory_folder, lambda *to: check_all(*to, make), enough=1, shares=(1.0, 0.0), begin=begin)
    print(f"{n} states until {lost}")
    assert lost and re.search(loss, lost[0]), lost


# ---- migration


@pytest.fixture(scope="module")
def migration(tmp_path_factory):
    folder = tmp_path_factory.mktemp("migration")
    with Daemon(folder / "data", options=OPTIONS) as d:
        jobs = [d.ready_job() for _ in range(3)]
    make_older(folder / "data" / "selvedge.db", OLD)
    shutil.rmtree(folder / "data" / "backup", ignore_errors=True)

    def scenario(d, journal):
        say(journal, "copy", check_copy, f"selvedge.db.v{OLD}", len(jobs))
        journal.changes = [(0, job, {"fact": (check_files, (job,))}) for job in jobs] + journal.changes

    return record(folder, scenario, options={**OPTIONS, "backup.every_s": 0})


def test_a_migration_is_whole_or_not_there(migration, memory_folder):
    n, lost = try_states(*migration, memory_folder, check_all, shares=(1.0, 0.2))
    print(f"{len(migration[0])} calls, {n} states, {len(lost)} with a loss")
    assert n > 10 and not lost, lost


@pytest.mark.parametrize("part", [f"selvedge.db.v{OLD}.part".encode(), b"selvedge.db-wal"])
def test_a_missing_sync_of_a_migration_is_found(migration, memory_folder, part):
    calls, journal = migration
    left, begin = without(calls, lambda c: c.path == part)
    n, lost = try_states(left, journal, memory_folder, check_all, enough=1, shares=(1.0, 0.5), begin=begin)
    print(f"{n} states until {lost}")
    assert lost
