"""Jobs that several ranks run: results and checkpoints are those of one rank bit by bit, a lost rank costs nothing but
time, and only rank 0 decides when the job ends."""
import json
import os
import shutil
import signal
import struct
import subprocess
import time

import pytest
from daemon_under_test import program
from fit_outcome import outcome, read_json
from small_cloth import TABLE, hair, start_small_job
from small_exr import exr

WORKER, AGENT = program("selvedge-worker"), program("selvedge-mpi")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(WORKER, os.X_OK), reason="no selvedge-worker in the build folder")]
needs_mpi = pytest.mark.skipif(not os.access(AGENT, os.X_OK) or shutil.which("mpirun") is None,
                               reason="Open MPI is not installed (libopenmpi-dev, openmpi-bin)")
FIT = {"models": ["two_lobe.v1", "microflake.v1"], "path_budget": 16000, "max_iterations": 3, "render_px": 8, "render_samples": 1, "seed": 7}
FIBERS = {"fibers": {"file": "cloth.hair"}, "environment": {"file": "sky.exr", "scale": 0.3}}
CLOTH = {"cloth": {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "yarns": [{"fibers": 9, "flatness": {"value": 1.6, "lower": 1, "upper": 4}}]}}
TURNED = TABLE + "fit,50,0,20,180,all,0.1,0.08,0.04\n"


def make_job(folder, document=FIBERS, **fit):
    (folder / "input").mkdir(parents=True)
    (folder / "job.json").write_text(json.dumps({"sample": "ranks", "measurements": {"file": "rows.csv"}, "fit": {**FIT, **fit}, **document}))
    (folder / "input" / "cloth.hair").write_bytes(hair())
    (folder / "input" / "rows.csv").write_text(TURNED)
    (folder / "input" / "sky.exr").write_bytes(exr(8, 4, lambda x, y: (0.1 * x, 0.2, 0.05 * y)))
    return folder


def start(folder, ranks=1, threads=1, **environment):
    return subprocess.Popen([WORKER, "--quiet", "--ranks", str(ranks), "--threads", str(threads), str(folder)], env={**os.environ, **environment},
                            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def finish(folder, ranks=1, threads=1):
    worker = start(folder, ranks, threads)
    _, words = worker.communicate(timeout=600)
    assert worker.returncode == 0, (read_json(folder, "status.json"), words)
    return words


def checkpoints(folder):
    """The records of every checkpoint of estimates, without the times that they hold."""
    found = {}
    for path in sorted((folder / "work").rglob("*.journal")):
        data, at, records = path.read_bytes(), 16, []
        while at < len(data):
            n_bytes, _ = struct.unpack_from("<II", data, at)
            payload = data[at + 8:at + 8 + n_bytes]
            records.append(payload[:24] + payload[32:])
            at += 8 + n_bytes
        found[str(path.relative_to(folder))] = records
    assert found
    return found


def processes_of(folder, rank):
    """Process ids of the workers that are this rank of the job."""
    found = []
    for entry in os.listdir("/proc"):
        try:
            with open(f"/proc/{entry}/cmdline", "rb") as f:
                words = f.read().decode(errors="replace").split("\0")
        except (FileNotFoundError, NotADirectoryError, ProcessLookupError, PermissionError):
            continue
        if "--team" in words and str(folder) in words and words[words.index("--team") + 1].split(",")[1] == str(rank):
            found.append(int(entry))
    return found


def command_lines_below(pid):
    """Of the children of a process."""
    with open(f"/proc/{pid}/task/{pid}/children") as f:
        children = f.read().split()
    for child in children:
        with open(f"/proc/{child}/cmdline", "rb") as f:
            yield f.read()


def wait_for_estimates(worker, folder, n_bytes):
    journal, deadline = folder / "work" / "fit" / "estimates.journal", time.monotonic() + 60
    while not journal.exists() or journal.stat().st_size < n_bytes:
        assert worker.poll() is None and time.monotonic() < deadline, "the job does not come so far"
        time.sleep(0.002)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Two models, of fibers and of a volume, under an image of the surroundings, with a row that is a mean over
    rotations; one rank."""
    folder = make_job(tmp_path_factory.mktemp("alone") / "job")
    finish(folder)
    return folder


@needs_mpi
@pytest.mark.parametrize("ranks,threads", [(2, 1), (4, 1), (7, 1), (2, 2)])
def test_ranks_and_threads_change_no_bit(alone, tmp_path, ranks, threads):
    folder = make_job(tmp_path / "job")
    words = finish(folder, ranks, threads)
    assert words == "" or "without a sandbox" in words  # which builds for the sanitizers lack
    assert outcome(folder) == outcome(alone)
    assert checkpoints(folder) == checkpoints(alone)
    pictures = sorted(p.name for p in (alone / "results" / "renderings").glob("*.exr"))
    assert pictures
    for name in pictures:
        assert (folder / "results" / "renderings" / name).read_bytes() == (alone / "results" / "renderings" / name).read_bytes()
    log = (folder / "log.txt").read_text()
    assert f"{ranks} ranks shared" in log and "forbids" not in log


@needs_mpi
def test_numbers_of_a_cloth_are_found_by_all_ranks(tmp_path):
    one, two = (make_job(tmp_path / name, CLOTH, models=["two_lobe.v1"], path_budget=6000, max_iterations=1) for name in ("one", "two"))
    finish(one)
    finish(two, 2)
    assert outcome(two) == outcome(one)


@needs_mpi
@pytest.mark.parametrize("rank", [0, 1])
def test_a_lost_rank_costs_no_more_than_time(alone, tmp_path, rank):
    folder = make_job(tmp_path / "job")
    worker = start(folder, 2, TMPDIR=str(tmp_path))
    wait_for_estimates(worker, folder, 20)
    lost = processes_of(folder, rank)
    assert len(lost) == 1
    os.kill(lost[0], signal.SIGKILL)
    _, words = worker.communicate(timeout=600)
    assert worker.returncode == 0, words
    assert "a rank is lost; the job goes on" in words
    assert "cancelled" not in (folder / "log.txt").read_text()
    assert outcome(folder) == outcome(alone)
    assert not files_of_mpi(tmp_path)


def files_of_mpi(folder):
    """What runs of mpirun with this TMPDIR have left there."""
    return list(folder.glob("ompi.*/pid.*"))


def shared_memory_of(pids):
    """Files by which processes exchange messages."""
    return {line.split()[-1] for pid in pids for line in open(f"/proc/{pid}/maps") if "/vader_segment" in line}


def parent_of(pid):
    with open(f"/proc/{pid}/stat") as f:
        return int(f.read().rpartition(")")[2].split()[1])


@needs_mpi
def test_a_worker_that_is_killed_leaves_neither_ranks_nor_files(tmp_path):
    folder = make_job(tmp_path / "job")
    worker = start(folder, 2, TMPDIR=str(tmp_path))
    wait_for_estimates(worker, folder, 20)
    shared = shared_memory_of([parent_of(pid) for r in (0, 1) for pid in processes_of(folder, r)])
    assert files_of_mpi(tmp_path) and shared
    worker.kill()
    worker.communicate(timeout=300)
    deadline = time.monotonic() + 10
    while any(processes_of(folder, r) for r in (0, 1)) or files_of_mpi(tmp_path) or any(map(os.path.exists, shared)):
        assert time.monotonic() < deadline, (files_of_mpi(tmp_path), shared)
        time.sleep(0.05)


@needs_mpi
def test_stopping_while_the_ranks_start_is_not_lost(tmp_path):
    folder = make_job(tmp_path / "job")
    worker, deadline = start(folder, 2), time.monotonic() + 60
    while not any(b"mpirun" in words for words in command_lines_below(worker.pid)):
        assert time.monotonic() < deadline
    worker.send_signal(signal.SIGTERM)
    _, words = worker.communicate(timeout=300)
    assert worker.returncode == 3, words
    assert not (folder / "results" / "result.json").exists()


@needs_mpi
def test_a_rank_that_its_sandbox_ends_is_not_started_again(tmp_path):
    folder = make_job(tmp_path / "job")
    worker = start(folder, 2)
    wait_for_estimates(worker, folder, 20)
    os.kill(processes_of(folder, 1)[0], signal.SIGSYS)
    _, words = worker.communicate(timeout=300)
    assert worker.returncode == -signal.SIGSYS, words


@needs_mpi
def test_cancelling_keeps_what_there_is(alone, tmp_path):
    folder = make_job(tmp_path / "job")
    worker = start(folder, 3)
    wait_for_estimates(worker, folder, 20)
    worker.send_signal(signal.SIGTERM)
    _, words = worker.communicate(timeout=300)
    assert worker.returncode == 3, words
    assert read_json(folder, "status.json")["state"] == "cancelled"
    deadline = time.monotonic() + 10
    while any(processes_of(folder, r) for r in range(3)):
        assert time.monotonic() < deadline, "ranks are left over"
        time.sleep(0.05)
    finish(folder, 1)
    assert outcome(folder) == outcome(alone)


@needs_mpi
def test_a_job_that_fails_ends_all_ranks(tmp_path):
    folder = make_job(tmp_path / "job")
    (folder / "input" / "cloth.hair").write_bytes(b"no fibers")
    worker = start(folder, 2)
    _, words = worker.communicate(timeout=300)
    assert worker.returncode == 1, words
    assert "cloth.hair" in read_json(folder, "status.json")["error"]["text"]
    assert not processes_of(folder, 1)


@needs_mpi
def test_mpirun_may_start_the_worker_itself(alone, tmp_path):
    folder = make_job(tmp_path / "job")
    environment = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    subprocess.run(["mpirun", "-q", "--oversubscribe", "-n", "2", WORKER, "--quiet", "--threads", "1", str(folder)],
                   env=environment, stdin=subprocess.DEVNULL, check=True, timeout=600)
    assert outcome(folder) == outcome(alone)
    assert "2 ranks shared" in (folder / "log.txt").read_text()


def test_without_the_program_of_the_ranks_it_is_asked_for(tmp_path):
    folder = make_job(tmp_path / "job")
    copy = tmp_path / "selvedge-worker"
    shutil.copy(WORKER, copy)
    end = subprocess.run([copy, "--quiet", "--ranks", "2", str(folder)], capture_output=True, text=True, timeout=300)
    assert end.returncode == 2
    assert "selvedge-mpi' is not there" in end.stderr and "libopenmpi-dev" in end.stderr
    assert not (folder / "status.json").exists()


@needs_mpi
def test_the_service_runs_jobs_with_ranks(daemon_maker):
    d = daemon_maker(worker=WORKER, options={"jobs.ranks": 2})
    job = start_small_job(d, {"sample": "ranks", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
                              "fit": {**FIT, "models": ["two_lobe.v1"], "path_budget": 10000}})
    d.wait_state(job, "succeeded", timeout_s=120)
    assert "2 ranks shared" in d.get(f"/v1/jobs/{job}/log").text
