"""A worker whose attempt is no longer the present one writes nothing more: whole jobs with the real worker, by hand."""
import glob
import json
import os
import re
import shutil
import signal
import subprocess

import pytest
from daemon_under_test import TIMEOUT_S, program, wait_until
from small_cloth import TABLE, hair

WORKER = program("selvedge-worker")
JOURNAL_HEAD_BYTES = 16
pytestmark = pytest.mark.skipif(not os.access(WORKER, os.X_OK), reason="no selvedge-worker in the build folder")


def job_folder(folder, path_budget):
    (folder / "input").mkdir(parents=True)
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(TABLE)
    fit = {"model": "two_lobe.v1", "path_budget": path_budget, "render_px": 8, "render_samples": 1}
    (folder / "job.json").write_text(json.dumps({"sample": "stale", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
                                                 "export": {name: True for name in ("mitsuba", "pbrt", "usd")}, "fit": fit}))
    (folder / "attempt.json").write_text('{"attempt":1,"token":"one"}')
    return folder


def tree(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name not in ("log.txt", "attempt.json", "lock")}


def has_stopped(pid):
    """Whether all threads of a process have stopped."""
    return all(open(path).read().rsplit(")", 1)[1].split()[0] == "T" for path in glob.glob(f"/proc/{pid}/task/*/stat"))


def durable_writes(record):
    """The files that were put in their places or got a record of a journal, and those of them before which the thread did not
    look at the attempt: right before it made the temporary file or, unless that is one of durable_replace, after it."""
    events, writes, unseen = {}, [], []
    for line in record.splitlines():
        record_of_journal = re.match(r"(\d+) +pwrite64\(\d+<([^>]*\.journal)>.*, (\d+)\) += \d+$", line)
        if record_of_journal is not None and int(record_of_journal[3]) >= JOURNAL_HEAD_BYTES:
            own = events.setdefault(record_of_journal[1], [])
            writes.append(record_of_journal[2])
            unseen += [] if own[-1:] == ["look"] else [record_of_journal[2]]
            own.append(record_of_journal[2])
        call = re.match(r'(\d+) +(open|rename)\w*\((?:AT_FDCWD[^,]*, )?"([^"]*)"(?:, (?:AT_FDCWD[^,]*, )?"([^"]*)")?', line)
        if call is None:
            continue
        thread, kind, source, target = call.groups()
        own = events.setdefault(thread, [])
        if kind == "open":
            own += ["look"] if source.endswith("/attempt.json") else [source] if "O_CREAT" in line else []
            continue
        if not os.path.basename(target).startswith(".part-"):
            made = own.index(source) if source in own else 0
            writes.append(target)
            unseen += [] if own[max(0, made - 1):made if ".tmp-" in source else None].count("look") else [target]
        own.append(target)
    return writes, unseen


@pytest.mark.skipif(shutil.which("strace") is None, reason="no strace")
def test_every_durable_write_follows_a_look_at_the_attempt(tmp_path):
    folder = job_folder(tmp_path / "job", 100000)
    if subprocess.run(["strace", "-qq", "-o", os.devnull, "true"], check=False).returncode != 0:
        pytest.skip("strace may not trace here")
    record = tmp_path / "calls.txt"
    strace = ["strace", "-f", "-qq", "-y", "-s", "400", "-e", "trace=open,openat,rename,renameat,renameat2,pwrite64", "-o", record]
    done = subprocess.run([*strace, WORKER, "--quiet", "--sandbox", "off", folder], check=False, timeout=600)
    assert done.returncode == 0, (folder / "log.txt").read_text()
    writes, unseen = durable_writes(record.read_text())
    assert len(writes) > 30 and unseen == []


def test_a_worker_that_becomes_stale_leaves_the_folder_as_it_is(tmp_path):
    folder = job_folder(tmp_path / "job", 20_000_000)
    with subprocess.Popen([WORKER, "--quiet", "--sandbox", "off", folder]) as worker:
        wait_until(lambda: list(folder.glob("work/fit/*.journal")), what="the fit")
        worker.send_signal(signal.SIGSTOP)
        wait_until(lambda: has_stopped(worker.pid), what="stop")
        (folder / "attempt.next").write_text('{"attempt":2,"token":"two"}')
        os.rename(folder / "attempt.next", folder / "attempt.json")
        before = tree(folder)
        worker.send_signal(signal.SIGCONT)
        assert worker.wait(60 * TIMEOUT_S) == 4
    after = tree(folder)
    assert after == before
    assert json.loads(after["status.json"])["attempt"] == 1 and json.loads(after["status.json"])["state"] == "running"
