"""A database that is behind the folders of the jobs: a start refuses it, nothing goes to quarantine, and a rebuild brings
everything back that was acknowledged."""
import contextlib
import json
import os
import random
import shutil
import sqlite3
import zlib

import pytest
from daemon_under_test import BUILD, Daemon, document, selvedged, store_options, wait_until
from servers.postgres_server import PostgresMissing, PostgresServer

N_BEFORE, N_AFTER = 12, 8  # jobs in the file of the database, and in its WAL only


def database(data):
    return os.path.join(data, "selvedge.db")


def checkpoint(data):
    with contextlib.closing(sqlite3.connect(database(data))) as db:
        assert db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()[0] == 0


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """(data folder of a killed daemon, job -> state): jobs, starts, cancels and edits after the last checkpoint."""
    d = Daemon(tmp_path_factory.mktemp("original") / "data", options={"jobs.workers": 2}).start()
    jobs = [d.ready_job() for _ in range(N_BEFORE)]
    checkpoint(d.data)
    shutil.copyfile(database(d.data), str(d.data) + ".before")
    jobs += [d.ready_job() for _ in range(N_AFTER)]
    state = dict.fromkeys(jobs, "draft")
    for job, end in ((jobs[0], "succeeded"), (jobs[-1], "succeeded"), (jobs[1], "cancelled")):
        assert d.post(f"/v1/jobs/{job}/{'start' if end == 'succeeded' else 'cancel'}").status_code in (200, 202)
        state[job] = d.wait_state(job, end)["state"]
    assert d.put(f"/v1/jobs/{jobs[2]}/document", json=document("fail")).status_code == 200
    d.kill()
    return d.data, state


def write_at(path, offset, data):
    with open(path, "r+b") as f:
        f.seek(offset)
        f.write(data)


def garbage(path, begin, end):
    write_at(path, begin, random.Random(1).randbytes((end or os.path.getsize(path)) - begin))


DAMAGE = {
    "no WAL": lambda data: [os.remove(database(data) + e) for e in ("-wal", "-shm")],
    "no WAL, but its index": lambda data: os.remove(database(data) + "-wal"),
    "an empty WAL": lambda data: os.truncate(database(data) + "-wal", 0),
    "garbage in place of the WAL": lambda data: garbage(database(data) + "-wal", 0, None),
    "garbage in the header of the WAL": lambda data: garbage(database(data) + "-wal", 0, 32),
    "garbage in a frame of the WAL": lambda data: garbage(database(data) + "-wal", 32 + 24, 32 + 24 + 512),
    "zeros in the WAL": lambda data: write_at(database(data) + "-wal", 0, bytes(8192)),
    "the WAL cut off": lambda data: os.truncate(database(data) + "-wal", 32 + 4096),
    "an old copy": lambda data: [os.remove(database(data) + e) for e in ("-wal", "-shm")] and shutil.copyfile(ORIGINAL[0] + ".before", database(data)),
}
ORIGINAL = []


@pytest.fixture
def copied(original, tmp_path):
    ORIGINAL[:] = [original[0]]
    shutil.copytree(original[0], tmp_path / "data")
    d = Daemon(tmp_path / "data", options={"jobs.workers": 2})
    yield d
    d.stop()


def states(d):
    return {j["id"]: j["state"] for j in d.get("/v1/jobs?limit=500").json()["jobs"]}


def folders(d):
    return sorted(os.listdir(os.path.join(d.data, "jobs"))), os.listdir(os.path.join(d.data, "quarantine"))


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_database_without_its_wal_is_refused(copied, original, damage):
    before = folders(copied)
    DAMAGE[damage](copied.data)
    with pytest.raises(AssertionError, match=r"is behind the folders of the jobs: it lacks \d+ jobs.*selvedged --data '.*' --rebuild"):
        copied.start()
    assert folders(copied) == before and before[1] == []
    assert "--rebuild" in selvedged(copied.data, "--make-token", "x", expect=1)
    assert f"{N_BEFORE + N_AFTER} jobs are brought back" in selvedged(copied.data, "--rebuild")
    copied.start()
    assert states(copied) == original[1] and folders(copied) == before


def test_lost_changes_of_known_jobs_are_noticed(daemon_maker):
    """No job is missing, but what was acknowledged of them."""
    d = daemon_maker()
    job = d.ready_job()
    checkpoint(d.data)
    assert d.post(f"/v1/jobs/{job}/cancel").status_code == 200
    d.kill()
    os.remove(database(d.data) + "-wal")
    with pytest.raises(AssertionError, match=r"it lacks 0 jobs.* has an older state of 1 \(the first is " + job):
        d.start()
    selvedged(d.data, "--rebuild")
    d.start()
    assert d.job(job)["state"] == "cancelled"


def last_record(data, job):
    with open(os.path.join(data, "jobs", job, "journal.rec"), "rb") as f:
        return f.read().splitlines()[-1][9:].decode()


def append(data, job, text):
    with open(os.path.join(data, "jobs", job, "journal.rec"), "ab") as f:
        f.write(f"{zlib.crc32(text.encode()):08x} {text}\n".encode())


def test_a_worker_cannot_keep_the_service_from_starting(daemon_maker):
    """A worker may write anything into its journal. Records without the seal of this job count for nothing."""
    d = daemon_maker()
    job, later = d.ready_job(), d.ready_job()
    d.stop()
    true = last_record(d.data, job)
    forged = json.loads(true)
    forged["job"].update(updated_unix_s=4e9, state="succeeded")
    bare = {key: value for key, value in forged.items() if key != "seal"}
    append(d.data, job, json.dumps(bare, separators=(",", ":")))
    append(d.data, job, json.dumps(forged, separators=(",", ":")))  # with the seal of another text
    append(d.data, job, last_record(d.data, later))  # sealed, but of another job
    append(d.data, job, "{" * 3000)
    d.start()
    assert d.job(job)["state"] == "draft"
    d.stop()
    path = os.path.join(d.data, "jobs", job, "journal.rec")
    for make in (os.mkfifo, lambda p: os.symlink("/dev/zero", p), os.mkdir, lambda p: open(p, "wb").write(bytes(1 << 20))):
        os.rmdir(path) if os.path.isdir(path) and not os.path.islink(path) else os.remove(path)
        make(path)
        d.start()
        assert states(d) == {job: "draft", later: "draft"}
        d.stop()


def test_deleted_jobs_are_not_missed(daemon_maker):
    """The folder of a deleted job that has come back, as after a power cut, goes to quarantine."""
    d = daemon_maker()
    job = d.ready_job()
    folder = os.path.join(d.data, "jobs", job)
    shutil.copytree(folder, str(d.data) + ".copy")
    assert d.delete(f"/v1/jobs/{job}").status_code == 204
    wait_until(lambda: not os.path.exists(folder))
    d.stop()
    shutil.copytree(str(d.data) + ".copy", folder)
    os.remove(os.path.join(folder, "journal.rec"))
    d.start()
    assert states(d) == {} and [name[:36] for name in folders(d)[1]] == [job]


def test_a_folder_that_cannot_be_brought_back_does_not_stop_the_service(daemon_maker):
    """A rebuild moves it to quarantine and says so; the next start succeeds."""
    d = daemon_maker()
    whole, half = d.ready_job(), d.ready_job()
    d.kill()
    for ending in ("", "-wal", "-shm"):
        os.remove(database(d.data) + ending)
    os.remove(os.path.join(d.data, "jobs", half, "job.json"))
    said = selvedged(d.data, "--rebuild")
    assert f"job {half} is not brought back" in said and "1 jobs are brought back" in said
    d.start()
    assert states(d) == {whole: "draft"} and [name[:36] for name in folders(d)[1]] == [half]
    assert half in selvedged(d.data, "--quarantine", "list")


@pytest.fixture(scope="module")
def server():
    if not os.path.exists(os.path.join(BUILD, "lib", "selvedge-postgresql.so")):
        pytest.skip("selvedge-postgresql.so is not built: libpq-dev is absent")
    try:
        with PostgresServer() as s:
            yield s
    except PostgresMissing as e:
        pytest.skip(str(e))


def test_a_database_of_a_server_that_is_behind(server, tmp_path):
    """An old dump that was put back: it lacks a job, or has an older state of one. Clocks of daemons may differ by a minute."""
    name = server.make_database()
    options = store_options(server, name, tmp_path)
    d = Daemon(tmp_path / "data", options=options).start()
    kept, older = d.ready_job(), d.ready_job()
    d.stop()
    d.start()
    d.stop()
    server.query(f"UPDATE job SET updated = updated - 60 WHERE id = '{kept}'", name)
    d.start()
    d.stop()
    server.query(f"CREATE TABLE put_back AS SELECT * FROM job; UPDATE job SET updated = updated - 3600 WHERE id = '{older}'", name)
    with pytest.raises(AssertionError, match=r"it lacks 0 jobs.* has an older state of 1 \(the first is " + older + ".*put a newer dump of it back"):
        d.start()
    server.query(f"ALTER TABLE job DISABLE TRIGGER ALL; DELETE FROM job WHERE id IN ('{kept}', '{older}')", name)
    with pytest.raises(AssertionError, match=r"it lacks 2 jobs"):
        d.start()
    assert os.listdir(os.path.join(d.data, "quarantine")) == []
    server.query("INSERT INTO job SELECT * FROM put_back; ALTER TABLE job ENABLE TRIGGER ALL; DROP TABLE put_back", name)
    d.start()
    assert {d.job(job)["state"] for job in (kept, older)} == {"draft"}
    d.stop()
