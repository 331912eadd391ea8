"""Real jobs on the cluster of make cluster-demo, and the demo when it is interrupted."""
import os
import signal
import subprocess
import sys
import time

import pytest
from cluster_demo import Batch, kill_a_worker, make_samples
from daemon_under_test import BUILD, ROOT, Daemon, program, wait_until
from slurm_cluster import SlurmCluster, missing

DEMO = os.path.join(ROOT, "tests", "slurm", "cluster_demo.py")


def folders():
    return {name for name in os.listdir(BUILD) if name.startswith("cluster-demo-")}


def alone(batch, sample, folder):
    """What the same job finds without a daemon, uninterrupted."""
    os.makedirs(folder)
    for name in ("job.json", "input"):
        subprocess.run(["cp", "-r", os.path.join(batch.folder(sample), name), folder], check=True)
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "1", str(folder)], check=True)
    return batch.results_of(str(folder))


def test_a_worker_that_slurm_stops_goes_on_with_the_same_numbers(cluster, daemon_maker, tmp_path):
    """The signal that Slurm sends before the time limit, or before it gives a node away."""
    d = daemon_maker(worker=program("selvedge-worker"), options={"slurm.memory_bytes": 0})
    batch = Batch(d, make_samples(str(tmp_path / "samples")))
    sample, _, number = kill_a_worker(batch, cluster, lambda number: cluster.run("scancel", "--batch", "--signal=TERM", number))
    jobs = batch.wait()
    assert jobs[sample]["attempt"] == 2 and jobs[sample]["lost_attempts"] == 0
    with open(os.path.join(batch.folder(sample), "log.txt")) as f:
        assert "cancelled" in f.read()
    assert batch.results(sample) == alone(batch, sample, tmp_path / "alone")
    assert cluster.jobs()[number] == "FAILED"


@pytest.mark.skipif(not os.path.exists(program("selvedge-mpi")), reason="selvedge-mpi is not built: libopenmpi-dev is missing")
@pytest.mark.parametrize("instead", ["--signal=TERM", None])
def test_ranks(tmp_path, instead):
    """Two ranks that srun starts, one of which is killed, or all asked to stop. Both are on one node, because the PMIx of
    two virtual nodes would use the same folder of /tmp."""
    reason = missing()
    if reason:
        pytest.skip(reason)
    samples = make_samples(str(tmp_path / "samples"))
    with SlurmCluster(tmp_path / "cluster", n_node=1, n_cpu=2) as c:
        options = c.options(**{"slurm.ranks": 2, "slurm.mpi": "pmix", "slurm.memory_bytes": 0})
        with Daemon(tmp_path / "data", worker=program("selvedge-worker"), options=options, environment=c.environment) as d:
            batch = Batch(d, samples)
            sample, _, _ = kill_a_worker(batch, c, instead and (lambda number: c.run("scancel", instead, number)))
            jobs = batch.wait()
            assert (jobs[sample]["attempt"], jobs[sample]["lost_attempts"]) == (2, 0)
            with open(os.path.join(batch.folder(sample), "log.txt")) as f:
                assert "2 ranks shared" in f.read()
            assert batch.results(sample) == alone(batch, sample, tmp_path / "alone")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_demo_leaves_nothing(cluster, number):
    before = folders()
    demo = subprocess.Popen([sys.executable, DEMO], stdout=subprocess.PIPE, text=True, start_new_session=True)
    folder = wait_until(lambda: folders() - before).pop()
    wait_until(lambda: os.path.exists(os.path.join(BUILD, folder, "slurm", "jobs")))
    time.sleep(1)
    os.killpg(demo.pid, number)  # as Ctrl-C in a terminal does
    demo.communicate(timeout=300)
    assert demo.returncode == 128 + number
    assert folders() == before
    mark = f"/{folder}/".encode()
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/cmdline", "rb") as line, open(f"/proc/{pid}/environ", "rb") as environment:
                assert mark not in line.read() + environment.read(), f"process {pid} is left"
        except OSError:
            continue
