"""The first start of a new version on an older database: killed at any sync, on a full disk, and after a way back."""
import contextlib
import os
import shutil
import sqlite3

import pytest
from daemon_under_test import Daemon
from servers.old_database import make_older, migrations
from servers.small_disk import fill

OLD = len(migrations()) - 1
AT_MOST = 100  # syncs of a first start


def database(data):
    return os.path.join(data, "selvedge.db")


def version_of(path):
    with contextlib.closing(sqlite3.connect(path)) as db:
        assert db.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        return db.execute("PRAGMA user_version").fetchone()[0]


def samples_of(path):
    with contextlib.closing(sqlite3.connect(path)) as db:
        return sorted(sample for (sample,) in db.execute("SELECT sample FROM job WHERE deleted = 0"))


def copies(data):
    """Files beside the database that a start leaves or makes, while no daemon runs."""
    return sorted(name for name in os.listdir(data) if name.startswith("selvedge.db") and name != "selvedge.db")


@pytest.fixture(scope="module")
def old(tmp_path_factory):
    """(data folder with a database of the version before, samples of its jobs)"""
    folder = tmp_path_factory.mktemp("old") / "data"
    with Daemon(folder, options={"disk.ballast_bytes": 0}) as d:
        jobs = [d.ready_job("succeed") for _ in range(4)] + [d.start_job("fail")]
        d.wait_state(jobs[-1], "failed")
    os.remove(folder / "ballast")
    make_older(database(folder), OLD)
    return folder, samples_of(database(folder))


def check_upgraded(d, samples):
    """Starts the daemon. It has the present version with all jobs and works, and the copy of the old one is whole."""
    with d:
        assert sorted(j["sample"] for j in d.get("/v1/jobs").json()["jobs"]) == samples
        assert d.create() and d.get("/v1/batches").json()["batches"] == []
    assert version_of(database(d.data)) == OLD + 1
    assert copies(d.data) == [f"selvedge.db.v{OLD}"]
    assert version_of(f"{database(d.data)}.v{OLD}") == OLD and samples_of(f"{database(d.data)}.v{OLD}") == samples
    assert os.listdir(os.path.join(d.data, "quarantine")) == []


@pytest.mark.parametrize("call", ["sync", "write"])
def test_a_first_start_that_is_killed_is_repeated(shim, tmp_path, old, call):
    """kill -9 before the n-th sync, and before every fourth write, until a start needs fewer; each state starts again."""
    killed = 0
    for n in range(1, AT_MOST, 1 if call == "sync" else 4):
        data = tmp_path / "data"
        shutil.rmtree(data, ignore_errors=True)
        shutil.copytree(old[0], data)
        d = Daemon(data, environment={"LD_PRELOAD": shim, "FAULT_CALL": call, "FAULT_AT": str(n), "FAULT_PATH": "selvedge.db",
                                      "FAULT_MARK": str(tmp_path / f"mark{n}"), "FAULT_KILL": "1"})
        with contextlib.suppress(AssertionError):
            d.start()
        migrated = d.process is not None
        if migrated:
            d.kill()
        d.environment = {}
        check_upgraded(d, old[1])
        if migrated and not (tmp_path / f"mark{n}").exists():
            break
        killed += 1
    print(f"{killed} starts were killed before a {call}")
    assert n < AT_MOST and killed >= 4, f"{killed} starts were killed"


def test_a_copy_that_was_begun_is_made_anew(tmp_path, old):
    """Files of any content under the names of the copy."""
    shutil.copytree(old[0], tmp_path / "data")
    for ending in ("", ".part", ".part-journal"):
        (tmp_path / "data" / f"selvedge.db.v{OLD}{ending}").write_bytes(b"half of a copy" * 1000)
    check_upgraded(Daemon(tmp_path / "data"), old[1])


def test_upgrade_way_back_upgrade(tmp_path, old):
    """The second copy has the jobs of the time between."""
    shutil.copytree(old[0], tmp_path / "data")
    d = Daemon(tmp_path / "data").start()
    d.stop()
    shutil.copyfile(f"{database(d.data)}.v{OLD}", database(d.data))
    with contextlib.closing(sqlite3.connect(database(d.data))) as db:  # work of the old version
        db.execute("UPDATE job SET sample = 'between', updated = updated + 1 WHERE serial = 1")
        db.commit()
    check_upgraded(d, sorted([*old[1][:-1], "between"]))


@pytest.mark.parametrize("ballast_bytes", [0, 1 << 20])
def test_an_upgrade_on_a_full_disk(small_disk, tmp_path, old, ballast_bytes):
    """With any space left it either starts or says that the disk is full; with space again it starts."""
    size = os.path.getsize(database(old[0]))
    refused = 0
    for free_bytes in (0, 4096, 65536, size // 8192 * 4096, size, size + 65536, 2 * size // 4096 * 4096):
        data = small_disk / "data"
        shutil.rmtree(data, ignore_errors=True)
        shutil.copytree(old[0], data)
        (tmp_path / "link").unlink(missing_ok=True)
        os.symlink(data, tmp_path / "link")  # so that the log is on another disk
        if ballast_bytes:
            with open(data / "ballast", "wb") as f:
                f.write(bytes(ballast_bytes))
        fill(small_disk, free_bytes)
        d = Daemon(tmp_path / "link", options={"disk.ballast_bytes": ballast_bytes})
        try:
            d.start()
        except AssertionError as e:
            refused += 1
            assert ballast_bytes == 0, e
            assert "is full" in str(e), e
        else:
            d.kill()
        os.remove(small_disk / "filler")
        check_upgraded(d, old[1])
    assert refused > 0 or ballast_bytes
