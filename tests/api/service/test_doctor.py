"""`selvedge doctor`: what it says of a machine and of the folder of a job, sound and with faults of each kind."""
import json
import os
import platform
import shutil
import subprocess

import pytest
from daemon_under_test import Daemon, document, program
from small_cloth import TABLE

CLOTH = {"sample": "described", "cloth": {"weave": "plain"}, "measurements": {"file": "rows.csv"}}


def doctor(data, *arguments, program_name="selvedge", **options):
    """(exit status, [(grade, subject, text)], all that was printed)"""
    more = [part for key, value in options.items() for part in ("--set", f"{key.replace('__', '.')}={value}")]
    start = [program("selvedge"), "doctor"] if program_name == "selvedge" else [program("selvedged"), "--doctor"]
    done = subprocess.run([*start, "--data", str(data), "--port", "0", *more, *arguments], capture_output=True, text=True, check=False, timeout=300)
    lines = [line.split(None, 2) for line in done.stdout.splitlines() if line.startswith(("ok ", "note ", "FAULT "))]
    return done.returncode, lines, done.stdout + done.stderr


def about(lines, subject):
    return [(grade, text) for grade, at, text in lines if at == subject]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A data folder with a finished job, without a daemon."""
    with Daemon(tmp_path_factory.mktemp("doctor") / "data") as d:
        d.wait_state(d.start_job("series 20"), "succeeded")
        d.draft = d.create(document("draft"))
        d.declare(d.draft, "scan.tif", b"bytes that no other job has")
        d.done = d.get("/v1/jobs").json()["jobs"][1]["id"]
    return d


def test_a_sound_machine(kept):
    before = set(os.listdir(kept.data))
    code, lines, text = doctor(kept.data, "--set", "disk.floor_bytes=0")
    assert code == 0, text
    subjects = {subject for _, subject, _ in lines}
    assert {"processor", "memory", "descriptors", "kernel", "clock", "disk", "database", "backup", "address", "worker", "dashboard"} <= subjects
    assert about(lines, "worker")[0][0] == "ok" and "all its libraries" in text
    assert about(lines, "database")[0] == ("ok", about(lines, "database")[0][1]) and "2 jobs" in about(lines, "database")[0][1]
    assert text.rstrip().endswith(" 0 faults")
    assert set(os.listdir(kept.data)) - {"selvedge.db-wal", "selvedge.db-shm"} == before, "nothing is left behind, but for SQLite's files of a reader"


def test_a_running_daemon_is_found_and_not_disturbed(tmp_path):
    with Daemon(tmp_path / "data") as d:
        job = d.start_job("work")
        code, lines, text = doctor(d.data, "--set", "disk.floor_bytes=0", program_name="selvedged")
        assert code == 0 and about(lines, "daemon") == [("ok", "it is running on this data folder")], text
        code, lines, text = doctor(d.data, job)
        assert about(lines, "worker")[0][0] == "ok" and d.job(job)["attempt"] == 1, text


@pytest.mark.parametrize("subject, words, spoil", [
    ("data", "other users may write into it", lambda data, s: os.chmod(data, 0o777)),
    ("disk", "keeps 4000000000.00 GB in reserve", lambda data, s: s.update(disk__floor_bytes=4 * 10**18)),
    ("database", "is damaged", lambda data, s: open(os.path.join(data, "selvedge.db"), "r+b").write(b"x" * 5000)),
    ("worker", "No such file", lambda data, s: s.update(jobs__worker=data + "/missing/worker")),
    ("worker", "has version", lambda data, s: s.update(jobs__worker="/bin/echo")),
    ("worker", "does not run", lambda data, s: s.update(jobs__worker="/bin/false")),
    ("dashboard", "cannot read the dashboard's folder", lambda data, s: s.update(server__web=data + "/missing")),
    ("address", "cannot", lambda data, s: s.update(server__listen="192.0.2.1")),
    ("TLS", "cannot read", lambda data, s: s.update(server__tls_certificate=data + "/missing.pem", server__tls_key=data + "/missing.key")),
    ("webhook", "cannot read", lambda data, s: s.update(webhook__url="http://localhost:1/", webhook__secret_file=data + "/missing")),
])
def test_faults_of_a_machine(tmp_path, subject, words, spoil):
    """Each is found, named, and the only one."""
    with Daemon(tmp_path / "data"):
        pass
    settings = {"disk__floor_bytes": 0}
    spoil(str(tmp_path / "data"), settings)
    code, lines, text = doctor(tmp_path / "data", **settings)
    faults = [(at, what) for grade, at, what in lines if grade == "FAULT"]
    assert code == 1 and len(faults) == 1 and faults[0][0] == subject and words in faults[0][1], text


@pytest.mark.skipif(shutil.which("qemu-x86_64") is None or platform.machine() != "x86_64" or "SELVEDGE_SANITIZED" in os.environ,
                    reason="no qemu-user, or another processor")
@pytest.mark.parametrize("name", ["selvedge", "selvedged", "selvedge-worker", "selvedge-phantom", "selvedge-camera"])
def test_an_old_processor_gets_a_sentence(name):
    """Nehalem, of 2008, has no AVX2. Without the sentence a program would end by an illegal instruction."""
    done = subprocess.run(["qemu-x86_64", "-cpu", "Nehalem", program(name), "--version"], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 1 and done.stderr.startswith("error: this processor cannot run this program"), done


def test_settings_that_cannot_be_used(tmp_path):
    (tmp_path / "conf").write_text("[jobs]\nwrkers = 2\n")
    code, _, text = doctor(tmp_path / "data", "--config", tmp_path / "conf")
    assert code == 2 and "line 2: setting 'jobs.wrkers' does not exist" in text


def test_a_machine_before_its_first_start(tmp_path):
    code, lines, text = doctor(tmp_path / "data")
    assert code == 0 and about(lines, "data")[0][0] == "note" and not (tmp_path / "data").exists(), text


def test_a_clock_that_was_set_back(tmp_path):
    with Daemon(tmp_path / "data"):
        pass
    os.utime(tmp_path / "data" / "selvedge.db", (4e9, 4e9))
    _, lines, text = doctor(tmp_path / "data", "--set", "disk.floor_bytes=0")
    assert any("the clock has been set back" in what for _, what in about(lines, "clock")), text


def folder_of(d, job):
    return os.path.join(d.data, "jobs", job)


def test_a_sound_job_of_the_daemon(kept):
    code, lines, text = doctor(kept.data, kept.done)
    # the inputs of these tests are no scan, which is what the worker says; all else is right
    assert {at for grade, at, _ in lines if grade == "FAULT"} == {"document"} and code == 1, text
    assert about(lines, "inputs") == [("ok", "all 2 have the bytes that were sent")]
    assert about(lines, "series") == [("ok", "20 records")] and about(lines, "results")[0][0] == "ok"
    assert "succeeded" in about(lines, "journal")[0][1]
    assert doctor(kept.data, folder_of(kept, kept.done))[1] == lines, "by its folder"


def test_a_draft_lacks_files_and_that_is_no_fault_of_the_folder(kept):
    _, lines, text = doctor(kept.data, kept.draft)
    assert [grade for grade, _ in about(lines, "inputs")] == ["note"] and about(lines, "worker") == [("ok", "none has run yet")], text


@pytest.mark.parametrize("subject, grade, words, spoil", [
    ("inputs", "FAULT", "its bytes are not those that were sent", lambda f: open(os.path.join(f, "input", "rows.csv"), "r+b").write(b"X")),
    ("results", "FAULT", "is damaged", lambda f: open(os.path.join(f, "results", "result.json"), "w").write('{"a":')),
    ("results", "FAULT", "cannot", lambda f: os.remove(os.path.join(f, "results", "result.json"))),
    ("series", "note", "20 records, and 7 bytes behind them", lambda f: open(os.path.join(f, "series.rec"), "a").write("garbage")),
    ("journal", "note", "1 of its lines are damaged", lambda f: open(os.path.join(f, "journal.rec"), "a").write("garbage\n")),
    ("worker", "FAULT", "is damaged", lambda f: open(os.path.join(f, "status.json"), "w").write("{")),
    ("folder", "FAULT", "other users may write into it", lambda f: os.chmod(f, 0o777)),
])
def test_faults_of_a_job(tmp_path, kept, subject, grade, words, spoil):
    subprocess.run(["cp", "-a", folder_of(kept, kept.done), tmp_path], check=True)
    os.makedirs(tmp_path / "data" / "jobs")
    os.rename(tmp_path / kept.done, tmp_path / "data" / "jobs" / kept.done)
    spoil(tmp_path / "data" / "jobs" / kept.done)
    _, lines, text = doctor(tmp_path / "data", kept.done)
    assert any(g == grade and words in what for g, what in about(lines, subject)), text


def test_a_folder_made_by_hand(tmp_path):
    (tmp_path / "job" / "input").mkdir(parents=True)
    (tmp_path / "job" / "job.json").write_text(json.dumps(CLOTH))
    (tmp_path / "job" / "input" / "rows.csv").write_text(TABLE)
    code, lines, text = doctor(tmp_path / "data", tmp_path / "job")
    assert code == 0 and about(lines, "document") == [("ok", "the worker can use it and all files that it names")], text
    os.remove(tmp_path / "job" / "input" / "rows.csv")
    code, lines, text = doctor(tmp_path / "data", tmp_path / "job")
    assert code == 1 and "rows.csv" in about(lines, "document")[0][1], text
    assert doctor(tmp_path / "data", "nothing")[0] == 1 and "neither the id of a job" in doctor(tmp_path / "data", "nothing")[2]
