"""A damaged or lost database: it is noticed, rebuilt from backup and job folders, and everything that was acknowledged is
there again. Folders in quarantine."""
import hashlib
import os
import shutil
import sqlite3
import subprocess

import pytest
from daemon_under_test import DOCUMENT, FILES, Daemon, document, program, selvedged, sha256, wait_until

KEY = {"Idempotency-Key": "the-first"}


def tree(folder):
    """path -> checksum of all files below a folder."""
    found = {}
    for path, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(path, name), "rb") as f:
                found[os.path.relpath(os.path.join(path, name), folder)] = hashlib.sha256(f.read()).hexdigest()
    return found


class Service:
    """A daemon with jobs in every state, and what was acknowledged of them."""

    def __init__(self, folder):
        self.d = d = Daemon(folder, options={"jobs.workers": 2}).start()
        d.checked = False  # each job has bytes of its own, which can be damaged alone
        self.jobs = {}
        self.jobs["succeeded"] = d.create(document("series 20"), **KEY)
        for name, (role, data) in FILES.items():
            d.upload(self.jobs["succeeded"], name, data, role)
        self.start("succeeded")
        self.jobs["failed"] = d.start_job("fail")
        d.wait_state(self.jobs["succeeded"], "succeeded")
        d.wait_state(self.jobs["failed"], "failed")
        os.makedirs(os.path.join(d.data, "backup"), mode=0o700)
        selvedged(d.data, "--backup", self.backup())
        self.after_backup()

    def backup(self):
        return os.path.join(self.d.data, "backup", "selvedge-20260101T000000Z.db")

    def after_backup(self):
        """More jobs: edited, with a removed file, with half an upload, a file of unknown checksum; cancelled, deleted, running."""
        d = self.d
        self.jobs["edited"] = d.ready_job()
        assert d.put(f"/v1/jobs/{self.jobs['edited']}/document", json=document("fail")).status_code == 200
        assert d.delete(f"/v1/jobs/{self.jobs['edited']}/files/rows.csv").status_code == 204
        self.jobs["partial"] = d.create(document("partial"))
        url = d.declare(self.jobs["partial"], "scan.tif", FILES["scan.tif"][1])["upload_url"]
        assert d.patch(url, 0, FILES["scan.tif"][1][:100]).status_code == 204
        self.partial_url = url
        unchecked = d.declare(self.jobs["partial"], "rows.csv", FILES["rows.csv"][1], "measurements", checked=False)["upload_url"]
        assert d.patch(unchecked, 0, FILES["rows.csv"][1]).status_code == 204
        self.jobs["deleted"] = d.ready_job()
        assert d.delete(f"/v1/jobs/{self.jobs['deleted']}").status_code == 204
        self.jobs["running"], self.jobs["second"] = d.start_job("work"), d.start_job("work_once")
        self.jobs["queued"] = d.start_job()
        self.jobs["cancelled"] = d.start_job()
        assert d.post(f"/v1/jobs/{self.jobs['cancelled']}/cancel").status_code in (200, 202)
        for name in ("running", "second"):
            wait_until(lambda name=name: d.job(self.jobs[name])["fraction"] == 0.5)
        d.kill()
        self.before = tree(os.path.join(d.data, "jobs"))

    def start(self, name):
        assert self.d.post(f"/v1/jobs/{self.jobs[name]}/start").status_code == 202

    def check(self, resumed=False):
        """Everything acknowledged is there."""
        d, jobs = self.d, self.jobs
        # the daemon changes nothing of what was there, but for jobs that run again
        now = tree(os.path.join(d.data, "jobs"))
        idle = [jobs[n] for n in ("succeeded", "failed", "edited", "partial", "cancelled")]
        assert {p: h for p, h in self.before.items() if p.split("/")[0] in idle} == {p: h for p, h in now.items() if p.split("/")[0] in idle}
        d.start()
        states = {"succeeded": "succeeded", "failed": "failed", "edited": "draft", "partial": "draft", "cancelled": "cancelled"}
        for name, state in states.items():
            assert d.job(jobs[name])["state"] == state, name
        assert d.job(jobs["succeeded"])["result"]["run"] == 1
        assert d.job(jobs["failed"])["error"]["text"].endswith("page 2 is cut off")
        assert d.job(jobs["edited"])["sample"] == "fake: fail" and d.job(jobs["edited"])["missing_files"] == ["rows.csv"]
        for name in ("succeeded", "failed", "cancelled", "running", "queued"):
            files = {f["name"]: f for f in d.job(jobs[name])["files"]}
            for file, (role, data) in FILES.items():
                assert files[file]["role"] == role and files[file]["sha256"] == sha256(data) and files[file]["state"] == "complete"
                assert d.get(f"/v1/jobs/{jobs[name]}/files/{file}").content == data
        assert d.get(f"/v1/jobs/{jobs['deleted']}").status_code == 404
        # an upload that was not complete starts anew at its old address
        assert d.job(jobs["partial"])["missing_files"] == ["scan.tif"]
        assert d.get(f"/v1/jobs/{jobs['partial']}/files/rows.csv").content == FILES["rows.csv"][1]
        assert d.offset(self.partial_url) == 0
        assert d.patch(self.partial_url, 0, FILES["scan.tif"][1]).status_code == 204
        assert d.job(jobs["partial"])["missing_files"] == []
        # a job that waited still does; one that was running waits for its owner's word, and goes on where it was
        d.wait_state(jobs["queued"], "succeeded")
        if not resumed:
            assert d.job(jobs["second"])["state"] == "cancelled"
            assert d.post(f"/v1/jobs/{jobs['second']}/retry").status_code == 202
        assert d.wait_state(jobs["second"], "succeeded")["result"]["run"] == 2
        again = d.post("/v1/jobs", json=document("series 20"), headers=KEY)
        assert again.status_code in (200, 201) and again.json()["id"] == jobs["succeeded"]
        order = [j["id"] for j in d.get("/v1/jobs?limit=100").json()["jobs"]]
        known = ("succeeded", "failed", "edited", "partial", "running", "second", "queued", "cancelled")
        assert [i for i in reversed(order) if i in jobs.values()] == [jobs[name] for name in known]
        assert os.listdir(os.path.join(d.data, "quarantine")) == []


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    return Service(tmp_path_factory.mktemp("original") / "data")


@pytest.fixture
def service(original, tmp_path):
    """A copy of one service that was killed in the middle of its work."""
    copy = object.__new__(Service)
    copy.__dict__.update(original.__dict__)
    copy.d = Daemon(tmp_path / "data", options={"jobs.workers": 2})
    shutil.copytree(original.d.data, copy.d.data)
    yield copy
    copy.d.stop()


def flip_pages(path):
    with open(path, "r+b") as f:
        size = f.seek(0, 2)
        for at in range(4096, size, 8192):
            f.seek(at)
            f.write(b"\xa5" * 512)


def remove(data, *endings):
    for ending in endings:
        path = os.path.join(data, "selvedge.db" + ending)
        if os.path.exists(path):
            os.remove(path)


def checkpoint(data):
    with sqlite3.connect(os.path.join(data, "selvedge.db")) as db:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    db.close()


DAMAGE = {
    "truncated": lambda data: os.truncate(os.path.join(data, "selvedge.db"), 3 * 4096 + 100),
    "pages": lambda data: flip_pages(os.path.join(data, "selvedge.db")),
    "header": lambda data: open(os.path.join(data, "selvedge.db"), "r+b").write(bytes(100)),
    "empty": lambda data: os.truncate(os.path.join(data, "selvedge.db"), 0),
    "text": lambda data: open(os.path.join(data, "selvedge.db"), "w").write("this is no database, but long enough to be one\n" * 1000),
    "deleted": lambda data: remove(data, "", "-wal", "-shm"),
}


@pytest.mark.parametrize("with_backup", [True, False])
@pytest.mark.parametrize("damage", list(DAMAGE))
def test_a_damaged_database_is_noticed_and_rebuilt(service, damage, with_backup):
    if not with_backup:
        os.remove(service.backup())
    checkpoint(service.d.data)
    DAMAGE[damage](service.d.data)
    with pytest.raises(AssertionError, match="--rebuild"):
        service.d.start()
    said = selvedged(service.d.data, "--rebuild")
    assert ("begun with the backup" in said) == with_backup and "8 jobs are brought back" in said, said
    replaced = os.listdir(os.path.join(service.d.data, "replaced"))
    assert any(name.endswith(".db") for name in replaced) != (damage == "deleted")
    service.check()


def test_a_lost_database_whose_wal_is_left(service):
    assert os.path.getsize(os.path.join(service.d.data, "selvedge.db-wal")) > 0
    remove(service.d.data, "")
    with pytest.raises(AssertionError, match="is missing or empty, but there are folders"):
        service.d.start()
    said = selvedged(service.d.data, "--rebuild", "--resume")
    assert "it is queued and continues" in said
    assert any(name.endswith("-wal") for name in os.listdir(os.path.join(service.d.data, "replaced")))
    service.check(resumed=True)


def test_a_stale_backup_put_back_by_hand(service):
    """It is sound, so only the folders know of the jobs since."""
    remove(service.d.data, "-wal", "-shm")
    shutil.copy(service.backup(), os.path.join(service.d.data, "selvedge.db"))
    said = selvedged(service.d.data, "--rebuild")
    assert "the present database is sound: 2 jobs" in said
    service.check()


def test_a_damaged_backup_is_passed_over(service):
    newer = os.path.join(os.path.dirname(service.backup()), "selvedge-20260202T000000Z.db")
    shutil.copy(service.backup(), newer)
    flip_pages(newer)
    remove(service.d.data, "", "-wal", "-shm")
    said = selvedged(service.d.data, "--rebuild")
    assert f"backup '{newer}' is of no use" in said and f"begun with the backup '{service.backup()}'" in said
    service.check()


def test_a_rebuild_twice_is_a_rebuild_once(service):
    remove(service.d.data, "", "-wal", "-shm")
    selvedged(service.d.data, "--rebuild")
    selvedged(service.d.data, "--rebuild")
    service.check()


def test_damaged_inputs_results_and_journals_are_told(daemon_maker):
    d = daemon_maker()
    good, damaged, lost, bare, torn = (d.start_job("succeed") for _ in range(5))
    for job in (good, damaged, lost, bare, torn):
        d.wait_state(job, "succeeded")
    d.stop()
    folder = os.path.join(d.data, "jobs")
    os.remove(os.path.join(folder, damaged, "input", "scan.tif"))  # which is a link to the bytes that all have
    shutil.copyfile(os.path.join(folder, good, "input", "scan.tif"), os.path.join(folder, damaged, "input", "scan.tif"))
    os.chmod(os.path.join(folder, damaged, "input", "scan.tif"), 0o600)
    with open(os.path.join(folder, damaged, "input", "scan.tif"), "r+b") as f:
        f.write(b"X")
    os.remove(os.path.join(folder, lost, "results", "result.json"))
    os.remove(os.path.join(folder, bare, "journal.rec"))
    with open(os.path.join(folder, torn, "journal.rec"), "r+b") as f:
        first = f.readline()
        f.seek(len(first) // 2)
        f.write(b"#")
        f.seek(0, 2)
        f.write(b"00000000 {\"job\": half a rec")
    remove(d.data, "", "-wal", "-shm")
    said = selvedged(d.data, "--rebuild")
    assert "input 'scan.tif' must be sent again: its bytes are not those that were sent" in said
    assert "2 damaged lines of its journal are passed over" in said and "no journal, and no backup knows it" in said
    d.start()
    assert d.job(damaged)["missing_files"] == ["scan.tif"]
    assert d.job(lost)["error"]["code"] == "results_lost"
    for job in (good, bare, torn):
        j = d.job(job)
        assert j["state"] == "succeeded" and j["missing_files"] == [] and j["result"]["run"] == 1
        assert {f["name"]: f["sha256"] for f in j["files"]} == {name: sha256(data) for name, (_, data) in FILES.items()}


@pytest.mark.parametrize("change", ["cut", "grown"])
def test_an_input_without_a_checksum_is_known_by_its_size(daemon_maker, change):
    """Where nobody has declared a checksum and the database is lost, the size is all that is known of the bytes."""
    d = daemon_maker()
    job = d.ready_job(checked=False)
    d.stop()
    path = os.path.join(d.data, "jobs", job, "input", "rows.csv")
    os.chmod(path, 0o600)
    os.truncate(path, len(FILES["rows.csv"][1]) + (1 if change == "grown" else -1))
    remove(d.data, "", "-wal", "-shm")
    said = selvedged(d.data, "--rebuild")
    assert "input 'rows.csv' must be sent again: its bytes are not those that were sent" in said and "scan.tif" not in said
    assert "1 inputs are right, 1 must be sent again" in said
    d.start()
    assert d.job(job)["missing_files"] == ["rows.csv"]


def test_a_journal_that_is_a_link_or_a_pipe_harms_nothing(daemon_maker, tmp_path):
    """A worker may write in its folder, and must not lead the daemon out of it."""
    d = daemon_maker()
    job, other = d.ready_job(), d.ready_job()
    victim = tmp_path / "victim"
    victim.write_text("untouched")
    for name, make in ((job, lambda p: os.symlink(victim, p)), (other, os.mkfifo)):
        path = os.path.join(d.data, "jobs", name, "journal.rec")
        os.remove(path)
        make(path)
        assert d.post(f"/v1/jobs/{name}/start").status_code == 202
        d.wait_state(name, "succeeded")
    assert victim.read_text() == "untouched"


def test_jobs_from_before_there_were_journals_get_one(service):
    """At the next start; then they survive the loss of the database."""
    for job in os.listdir(os.path.join(service.d.data, "jobs")):
        for name in ("journal.rec", "job.json"):
            if os.path.exists(os.path.join(service.d.data, "jobs", job, name)):
                os.remove(os.path.join(service.d.data, "jobs", job, name))
    service.d.start()
    service.d.kill()
    for name in ("", "-wal", "-shm"):
        remove(service.d.data, name)
    os.remove(service.backup())
    selvedged(service.d.data, "--rebuild")
    service.d.start()
    assert service.d.job(service.jobs["succeeded"])["result"]["run"] == 1
    assert service.d.job(service.jobs["failed"])["error"]["code"] == "format"
    assert service.d.job(service.jobs["edited"])["sample"] == "fake: fail" and service.d.job(service.jobs["edited"])["missing_files"] == ["rows.csv"]


def test_quarantine_lists_and_restores(daemon_maker):
    d = daemon_maker()
    job = d.start_job("succeed")
    d.wait_state(job, "succeeded")
    d.stop()
    with sqlite3.connect(os.path.join(d.data, "selvedge.db")) as db:
        for table, column in (("job", "id"), ("file", "job_id"), ("document", "job_id")):
            db.execute(f"DELETE FROM {table} WHERE {column} = ?", (job,))
    db.close()
    os.makedirs(os.path.join(d.data, "jobs", "something"))
    with pytest.raises(AssertionError, match="it lacks 1 jobs that were acknowledged.*--rebuild"):
        d.start()
    os.rename(os.path.join(d.data, "jobs", job), os.path.join(d.data, "quarantine", f"{job}-1"))
    d.start()
    assert d.get(f"/v1/jobs/{job}").status_code == 404
    assert "another selvedged is using it" in selvedged(d.data, "--quarantine", "restore", job, expect=1)
    listed = selvedged(d.data, "--quarantine", "list")
    assert f"{job}-" in listed and "'fake: succeed' succeeded, 2 files" in listed and "something" in listed
    d.stop()
    assert "has no folder of a job 'nonsense'" in selvedged(d.data, "--quarantine", "restore", "nonsense", expect=1)
    selvedged(d.data, "--quarantine", "restore", job)
    assert "has no folder" in selvedged(d.data, "--quarantine", "restore", job, expect=1)
    d.start()
    assert d.job(job)["result"]["run"] == 1
    for name, (_, data) in FILES.items():
        assert d.get(f"/v1/jobs/{job}/files/{name}").content == data


@pytest.mark.parametrize("with_backup", [True, False])
def test_a_rebuild_opens_no_door(daemon_maker, with_backup):
    """Owners are kept. Tokens are those of the backup; where they are lost, requests without one are still refused."""
    d = daemon_maker()
    token = d.make_token("ann")
    ann = d.of(token)
    job = ann.ready_job()
    if with_backup:
        os.makedirs(os.path.join(d.data, "backup"), mode=0o700)
        selvedged(d.data, "--backup", os.path.join(d.data, "backup", "selvedge-20260101T000000Z.db"))
    later = ann.create(**KEY)
    d.kill()
    remove(d.data, "", "-wal", "-shm")
    refused = subprocess.run([program("selvedged"), "--data", d.data, "--make-token", "eve"], capture_output=True, text=True, check=False)
    assert refused.returncode == 1 and "--rebuild" in refused.stderr and refused.stdout == ""
    said = selvedged(d.data, "--rebuild")
    assert ("access tokens are lost" in said) != with_backup and ("GET /v1/tokens" in said) == with_backup
    d.start()
    assert d.get("/v1/jobs").status_code == 401
    assert d.of(token).get("/v1/jobs").status_code == (200 if with_backup else 401)
    ann, bob = d.of(token if with_backup else d.make_token("ann")), d.of(d.make_token("bob", "submit"))
    assert {j["id"] for j in ann.get("/v1/jobs").json()["jobs"]} == {job, later} and ann.get("/v1/tokens").ok
    assert bob.get("/v1/jobs").json()["jobs"] == [] and bob.get(f"/v1/jobs/{job}").status_code == 404
    assert ann.post("/v1/jobs", json=DOCUMENT, headers=KEY).json()["id"] == later
    assert bob.post("/v1/jobs", json=DOCUMENT, headers=KEY).json()["id"] != later


def test_wrong_commands_are_refused(tmp_path):
    for arguments in (["--quarantine", "open"], ["--quarantine", "restore"], ["--resume"], ["--rebuild", "now"]):
        assert "usage:" in selvedged(tmp_path, *arguments, expect=2)
