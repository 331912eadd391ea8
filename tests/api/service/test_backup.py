"""Backups of the database: by hand and by themselves, complete under load, thinned out, counted."""
import os
import sqlite3
import threading

from daemon_under_test import document, selvedged, wait_until


def test_a_backup_under_load_opens_and_equals(daemon_maker, tmp_path):
    """While files are declared, backups are made one after the other: each holds what was acknowledged before it began."""
    d = daemon_maker()
    acknowledged, stop = [], threading.Event()

    def load():
        while not stop.is_set():
            job = d.create(document("load"))
            d.declare(job, "scan.tif", b"x" * 1000)
            acknowledged.append(job)
    thread = threading.Thread(target=load)
    thread.start()
    try:
        for i in range(8):
            wait_until(lambda i=i: len(acknowledged) > 5 * i)
            before = list(acknowledged)
            selvedged(d.data, "--backup", str(tmp_path / f"{i}.db"))
            with sqlite3.connect(tmp_path / f"{i}.db") as db:
                assert db.execute("PRAGMA integrity_check").fetchone() == ("ok",)
                jobs = {row[0] for row in db.execute("SELECT id FROM job")}
                files = {row[0] for row in db.execute("SELECT job_id FROM file")}
            db.close()
            assert set(before) <= jobs and set(before) <= files
    finally:
        stop.set()
        thread.join()
    assert "exists already" in selvedged(d.data, "--backup", str(tmp_path / "0.db"), expect=1)
    with sqlite3.connect(os.path.join(d.data, "selvedge.db")) as live:
        rows = {table: live.execute(f"SELECT * FROM {table} ORDER BY 1").fetchall() for table in ("job", "file", "document", "idempotency", "job_count")}
    live.close()
    selvedged(d.data, "--backup", str(tmp_path / "last.db"))
    with sqlite3.connect(tmp_path / "last.db") as db:
        assert {table: db.execute(f"SELECT * FROM {table} ORDER BY 1").fetchall() for table in rows} == rows
    db.close()


def metric(d, name):
    return float(next(line for line in d.get("/metrics").text.splitlines() if line.startswith(name + " ")).split()[1])


def test_backups_are_made_by_themselves_and_old_ones_go(daemon_maker, tmp_path):
    folder = tmp_path / "elsewhere"
    d = daemon_maker(options={"backup.every_s": 1, "backup.keep": 2, "backup.keep_days": 2, "backup.folder": folder})
    assert metric(d, "selvedge_backup_failures_total") == 0
    d.create()
    os.makedirs(folder, exist_ok=True)
    for name in ("selvedge-20260101T000000Z.db", "selvedge-20260102T000000Z.db", "selvedge-20260102T120000Z.db", "selvedge-20260103T000000Z.db.part",
                 "notes.txt"):
        (folder / name).write_text("")
    wait_until(lambda: metric(d, "selvedge_backups_total") >= 3)
    assert metric(d, "selvedge_backup_last_success_timestamp_seconds") > 1.7e9 and metric(d, "selvedge_backup_size_bytes") > 4096
    d.stop()
    left = sorted(os.listdir(folder))
    # of today the two newest; of the day before, the newest; what is no backup stays
    assert left[0] == "notes.txt" and left[1] == "selvedge-20260102T120000Z.db" and len(left) == 4, left


def test_a_backup_that_fails_is_counted(daemon_maker, tmp_path):
    (tmp_path / "file").write_text("in the way")
    d = daemon_maker(options={"backup.every_s": 1, "backup.folder": tmp_path / "file"})
    wait_until(lambda: metric(d, "selvedge_backup_failures_total") >= 1)
    assert metric(d, "selvedge_backups_total") == 0 and "cannot" in d.log_text() and d.get("/readyz").ok


def test_no_backups_if_the_settings_say_so(daemon_maker):
    d = daemon_maker(options={"backup.every_s": 0})
    assert metric(d, "selvedge_backup_last_success_timestamp_seconds") == 0
