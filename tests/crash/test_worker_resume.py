"""A worker that is killed with SIGKILL at several points of the fit resumes and gives exactly the result of an
uninterrupted one, with 1 and with 2 threads. SIGTERM cancels. A stale attempt must not write."""
import json
import os
import shutil
import signal
import subprocess
import time

import pytest
from fit_outcome import outcome, read_json
from small_cloth import TABLE, hair

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("SELVEDGE_BUILD") or os.path.join(ROOT, "build")
WORKER = os.path.join(BUILD, "bin", "selvedge-worker")


def make_job(folder, **fit):
    os.makedirs(os.path.join(folder, "input"))
    model = {} if "models" in fit else {"model": "two_lobe.v1"}
    document = {"sample": "resume", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
                "fit": {**model, "path_budget": 160000, "max_iterations": 12, "render_px": 8, "render_samples": 1, "seed": 7, **fit}}
    with open(os.path.join(folder, "job.json"), "w") as f:
        json.dump(document, f)
    with open(os.path.join(folder, "input", "cloth.hair"), "wb") as f:
        f.write(hair())
    with open(os.path.join(folder, "input", "rows.csv"), "w") as f:
        f.write(TABLE)
    return folder


def edit_seed(folder, seed):
    document = read_json(folder, "job.json")
    document["fit"]["seed"] = seed
    with open(os.path.join(folder, "job.json"), "w") as f:
        json.dump(document, f)


def start(folder, threads=1, program=WORKER):
    return subprocess.Popen([program, "--quiet", "--threads", str(threads), folder], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finish(folder, threads=1):
    worker = start(folder, threads)
    _, stderr = worker.communicate(timeout=600)
    assert worker.returncode == 0, (read_json(folder, "status.json"), stderr)


def journal_bytes(folder, stage, number="", name="estimates"):
    try:
        return os.path.getsize(os.path.join(folder, "work", stage, f"{name}{number}.journal"))
    except FileNotFoundError:
        return 0


def kill_when(folder, threads, condition, timeout_s=60):
    """Sends SIGKILL as soon as the condition holds. Returns False if the worker ended before."""
    worker = start(folder, threads)
    deadline = time.monotonic() + timeout_s
    while worker.poll() is None and not condition():
        assert time.monotonic() < deadline, "the worker makes no progress"
        time.sleep(0.001)
    killed = worker.poll() is None
    worker.kill()
    worker.wait()
    worker.stderr.close()
    return killed


KINDS = ["gauss_newton.v1", "published_sgd.v1", "several_models", "all_options"]
# what these tests look at is the same code for every kind of fit; make test-crash has them all
one_kind = pytest.mark.parametrize("reference", KINDS if os.environ.get("SELVEDGE_EVERY") == "1" else ["gauss_newton.v1"], indirect=True)


@pytest.fixture(scope="module", params=KINDS)
def reference(request, tmp_path_factory):
    fit = {"method": request.param}
    if request.param == "several_models":
        fit = {"models": ["microflake.v1", "two_lobe.v1"], "path_budget": 60000}
    if request.param == "all_options":
        fit = {"tied": [["C_R"]], "bounds": {"beta_R": [2, 8]}, "priors": {"gamma_TT": {"mean": 10, "se": 5}}, "starts": 2, "path_budget": 300000,
               "nuisance": {"gain": "per_photograph", "stray_light": True}, "candidates": {"grid": True}}
    if request.param == "published_sgd.v1":
        fit.update(max_iterations=2, path_budget=300000)
    folder = make_job(str(tmp_path_factory.mktemp("reference") / "job"), **fit)
    finish(folder, 1)
    return fit, folder, outcome(folder)


@pytest.mark.parametrize("threads", [1, 2])
def test_killed_at_several_points(reference, tmp_path, threads):
    fit, _, want = reference
    folder = make_job(str(tmp_path / "job"), **fit)
    kills = int(kill_when(folder, threads, lambda: journal_bytes(folder, "fit") > 20))
    record = journal_bytes(folder, "fit")
    for point in (3, 6, 9):
        kills += kill_when(folder, threads, lambda p=point: journal_bytes(folder, "fit") >= p * record)
    if "models" in fit:
        kills += kill_when(folder, threads, lambda: journal_bytes(folder, "fit", "-1") >= 3 * record)
    kills += kill_when(folder, threads, lambda: journal_bytes(folder, "validation") > 20)
    # the remaining row was never traced
    kills += kill_when(folder, threads, lambda: os.path.exists(os.path.join(folder, "work", "validation.done")))
    assert kills >= 3, "the fit is too fast for this test"
    finish(folder, threads)
    assert outcome(folder) == want
    assert read_json(folder, "status.json")["state"] == "succeeded"


def test_killed_while_looking_for_the_radius(tmp_path):
    fit = {"fit_radius": {"lower_um": 6, "upper_um": 10}, "path_budget": 40000}
    whole, killed = make_job(str(tmp_path / "whole"), **fit), make_job(str(tmp_path / "killed"), **fit)
    finish(whole, 2)
    assert kill_when(killed, 2, lambda: journal_bytes(killed, "fit", name="radius-02") > 20)
    assert kill_when(killed, 1, lambda: journal_bytes(killed, "fit", name="radius-06") > 20)
    kill_when(killed, 2, lambda: journal_bytes(killed, "fit") > 20)
    kill_when(killed, 2, lambda: journal_bytes(killed, "validation") > 20)  # now the radius comes from the finished fit
    finish(killed, 2)
    assert outcome(killed) == outcome(whole)


@one_kind
def test_damaged_checkpoints(reference, tmp_path):
    """A journal with an incomplete record and a damaged stage file cost time but change no result."""
    fit, _, want = reference
    folder = make_job(str(tmp_path / "job"), **fit)
    kill_when(folder, 2, lambda: journal_bytes(folder, "fit") > 20000)
    size = journal_bytes(folder, "fit")
    os.truncate(os.path.join(folder, "work", "fit", "estimates.journal"), size - 7)
    with open(os.path.join(folder, "work", "fibers", "fibers.bin"), "r+b") as f:
        f.seek(500)
        f.write(b"damage")
    with open(os.path.join(folder, "series.rec"), "ab") as f:
        f.write(b"0123abcd {torn")
    finish(folder, 2)
    assert outcome(folder) == want


@one_kind
def test_edited_document_starts_anew(reference, tmp_path):
    """A job folder whose document was edited by hand does not return the results of the old document."""
    fit, source, want = reference
    folder = str(tmp_path / "job")
    shutil.copytree(source, folder)
    edit_seed(folder, 8)
    finish(folder, 2)
    assert outcome(folder)[0]["seed"] == 8
    assert outcome(folder)[0]["parameters"] != want[0]["parameters"]
    with open(os.path.join(folder, "series.rec")) as f:
        steps = [json.loads(line[9:])["step"] for line in f]
    assert steps == list(range(len(steps)))


def test_another_build_starts_anew(tmp_path):
    """Estimates of another build of the program are not mixed with those of this one."""
    folder = make_job(str(tmp_path / "job"))
    other = str(tmp_path / "other-build")
    shutil.copy(WORKER, other)
    with open(other, "ab") as f:
        f.write(b"another build")
    assert kill_when(folder, 1, lambda: journal_bytes(folder, "fit") > 20)
    journal = os.path.join(folder, "work", "fit", "estimates.journal")
    with open(journal, "rb") as before:  # kept open, so that the new file cannot get its inode
        worker = start(folder, program=other)
        worker.communicate(timeout=600)
        assert worker.returncode == 0
        assert os.fstat(before.fileno()).st_nlink == 0, "the old journal was continued"
    assert [r["step"] for r in outcome(folder)[1]] == list(range(len(outcome(folder)[1])))


@one_kind
def test_stage_that_runs_again_outdates_later_ones(reference, tmp_path):
    """Fibers are read again, then the fit fails. The next attempt must not use what an earlier attempt made from the
    old fibers."""
    _, source, want = reference
    folder = str(tmp_path / "job")
    shutil.copytree(source, folder)
    os.truncate(os.path.join(folder, "work", "fibers", "fibers.bin"), 100)
    journal = os.path.join(folder, "work", "fit", "estimates.journal")
    os.remove(journal)
    os.mkdir(journal)
    worker = start(folder, 2)
    worker.communicate(timeout=300)
    assert worker.returncode == 1
    marks = {name for name in os.listdir(os.path.join(folder, "work")) if name.endswith(".done")}
    assert "fibers.done" in marks and not marks & {"fit.done", "validation.done", "report.done"}
    os.rmdir(journal)
    finish(folder, 2)
    assert outcome(folder) == want


@one_kind
def test_killed_while_removing_what_is_outdated(reference, tmp_path):
    """The old fingerprint is removed, but the marks of the old job's finished stages are not. They must be ignored."""
    fit, source, _ = reference
    folder = str(tmp_path / "job")
    shutil.copytree(source, folder)
    edit_seed(folder, 8)
    os.remove(os.path.join(folder, "work", "inputs.fingerprint"))
    finish(folder, 2)
    whole = make_job(str(tmp_path / "whole"), **{**fit, "seed": 8})
    finish(whole, 2)
    assert outcome(folder) == outcome(whole)


@one_kind
def test_cancel_and_resume(reference, tmp_path):
    fit, _, want = reference
    folder = make_job(str(tmp_path / "job"), **fit)
    worker = start(folder, 2)
    while journal_bytes(folder, "fit") <= 20 and worker.poll() is None:
        time.sleep(0.002)
    worker.send_signal(signal.SIGTERM)
    sent = time.monotonic()
    worker.communicate(timeout=100)
    assert worker.returncode == 3
    assert time.monotonic() - sent < 20
    status = read_json(folder, "status.json")
    assert status["state"] == "cancelled" and status["error"] is None
    finish(folder, 2)
    assert outcome(folder) == want


def test_stale_attempt(tmp_path):
    """A worker whose attempt has been replaced ends with status 4 and does not change status.json."""
    folder = make_job(str(tmp_path / "job"), path_budget=2000000, max_iterations=80)
    with open(os.path.join(folder, "attempt.json"), "w") as f:
        json.dump({"attempt": 1, "token": "old"}, f)
    worker = start(folder, 1)
    while journal_bytes(folder, "fit") <= 20 and worker.poll() is None:
        time.sleep(0.002)
    second = start(folder, 1)  # the lock excludes another worker
    assert second.wait(timeout=100) == 4
    second.stderr.close()
    assert read_json(folder, "status.json")["attempt"] == 1
    with open(os.path.join(folder, "new"), "w") as f:
        json.dump({"attempt": 2, "token": "new"}, f)
    os.rename(os.path.join(folder, "new"), os.path.join(folder, "attempt.json"))
    worker.communicate(timeout=100)
    assert worker.returncode == 4
    assert read_json(folder, "status.json")["state"] == "running"


def test_heartbeat(tmp_path):
    folder = make_job(str(tmp_path / "job"), path_budget=2000000, max_iterations=80)
    worker = start(folder, 1)
    beats, end = set(), time.monotonic() + 4
    while time.monotonic() < end and worker.poll() is None:
        try:
            status = read_json(folder, "status.json")  # always complete
            beats.add(status["heartbeat_unix_s"])
        except FileNotFoundError:
            pass
        time.sleep(0.02)
    assert len(beats) >= 4
    assert time.time() - max(beats) < 1.5
    worker.terminate()
    worker.communicate(timeout=100)
    assert worker.returncode == 3


def test_failure_is_told(tmp_path):
    folder = make_job(str(tmp_path / "job"))
    os.truncate(os.path.join(folder, "input", "cloth.hair"), 500)
    worker = start(folder, 1)
    worker.communicate(timeout=300)
    assert worker.returncode == 1
    status = read_json(folder, "status.json")
    assert status["state"] == "failed"
    assert status["error"]["code"] == "format" and status["error"]["field"] == "fibers.file" and "cloth.hair" in status["error"]["text"]


def test_usage(tmp_path):
    assert subprocess.run([WORKER], stderr=subprocess.DEVNULL).returncode == 2
    assert subprocess.run([WORKER, "--threads", "-3", str(tmp_path)], stderr=subprocess.DEVNULL).returncode == 2
    assert subprocess.run([WORKER, str(tmp_path / "absent")], stderr=subprocess.DEVNULL).returncode == 2
    done = subprocess.run([WORKER, "--help"], stdout=subprocess.PIPE, text=True)
    assert done.returncode == 0 and "JOBDIR" in done.stdout
