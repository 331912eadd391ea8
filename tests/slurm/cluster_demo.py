#!/usr/bin/python3
"""make cluster-demo: a batch of six small samples on a Slurm of two virtual nodes, with its database in PostgreSQL, one
worker killed in mid-fit, and every result compared bit by bit with that of the local backend on SQLite; what `selvedge
plan` expected of the batch, and what it took. Everything is in a folder below build/, and is stopped at the end, also
after Ctrl-C. Exit status 77: the packages are not installed."""
import argparse
import contextlib
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "support", "python"))
from daemon_under_test import BUILD, Daemon, program, store_options  # noqa: E402
from fit_outcome import outcome  # noqa: E402
from servers.postgres_server import PostgresMissing, PostgresServer, programs  # noqa: E402
from slurm_cluster import SlurmCluster, missing  # noqa: E402
from small_cloth import hair  # noqa: E402

SKIPPED = 77
N_SAMPLE = 6
TEMPLATE = {"sample": "", "fibers": {"file": "cloth.hair"}, "measurements": {"file": "rows.csv"},
            "fit": {"model": "two_lobe.v1", "path_budget": 600000, "render_px": 32, "render_samples": 4, "seed": 7}}
# files whose bytes have times in them: outcome() compares what else is in result.json, from which the pages are made
WITH_TIMES = ("result.json", "report.json", "summary.txt", ".html")


def say(text):
    print(text, flush=True)


# lamp and camera of each row: theta and phi of both, rotation of the cloth
FITTED = [(20, 0, 20, 180, 0), (45, 0, 45, 180, 0), (60, 0, 0, 180, 0), (45, 0, 45, 90, 90), (30, 0, 60, 180, 45), (60, 0, 60, 180, 90),
          (15, 0, 40, 90, 0), (70, 0, 30, 180, 90), (45, 0, 10, 0, 45), (30, 0, 30, 180, 90), (60, 0, 45, 45, 0), (10, 0, 60, 90, 45)]
HELD_OUT = [(30, 0, 50, 180, 0), (60, 0, 30, 20, 90), (40, 0, 20, 135, 45), (50, 0, 50, 180, 90), (20, 0, 65, 45, 0), (65, 0, 15, 180, 45)]
ANGLES = ("light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "cloth_rotation_deg")


def photograph(folder, i):
    """Renders the rows of cloth i with parameters of its own, and writes their mean radiances as its table."""
    rows = [("fit", *row) for row in FITTED] + [("held-out", *row) for row in HELD_OUT]
    head = ",".join(("set", *ANGLES))
    with open(os.path.join(folder, "angles.csv"), "w") as f:
        f.write(head + ",r,g,b\n" + "".join(",".join(map(str, row)) + ",1,1,1\n" for row in rows))
    parameters = {"C_R": (0.06 + 0.01 * i, 0.05, 0.09 - 0.008 * i), "C_TT": (0.75 - 0.06 * i, 0.5 + 0.02 * i, 0.35 + 0.06 * i), "beta_R": (5 + 0.5 * i,),
                  "beta_TT": (18,), "gamma_TT": (20,)}
    truth = os.path.join(folder, "truth")
    subprocess.run([program("selvedge-phantom"), "photograph", "--quiet", "--fibers", os.path.join(folder, "cloth.hair"), "--table",
                    os.path.join(folder, "angles.csv"), "--out", truth, "--paths", "16384", "--px", "8", "--noise", "0.005", "--seed", str(i + 1),
                    *(f"--param={name}={','.join(f'{x:.4f}' for x in value)}" for name, value in parameters.items())], check=True)
    with open(os.path.join(truth, "truth.json")) as f:
        mean = [row["mean_rgb"] for row in json.load(f)["photographs"]]
    with open(os.path.join(folder, "rows.csv"), "w") as f:
        f.write(head + ",r,g,b\n" + "".join(",".join([*map(str, row), *(f"{x:.6f}" for x in rgb)]) + "\n" for row, rgb in zip(rows, mean)))
    shutil.rmtree(truth)
    os.remove(os.path.join(folder, "angles.csv"))


def make_samples(folder):
    """A template, a table, and a folder of each sample: cloths of other radii and colours, measured with an error of 0.5 %."""
    os.makedirs(folder)
    with open(os.path.join(folder, "template.json"), "w") as f:
        json.dump(TEMPLATE, f)
    with open(os.path.join(folder, "week.csv"), "w") as f:
        f.write("sample\n" + "".join(f"cloth {i + 1}\n" for i in range(N_SAMPLE)))
    for i in range(N_SAMPLE):
        sample = os.path.join(folder, f"cloth {i + 1}")
        os.makedirs(sample)
        with open(os.path.join(sample, "cloth.hair"), "wb") as f:
            f.write(hair(radius_mm=0.007 + 0.0004 * i))
        photograph(sample, i)
    return folder


class Batch:
    """The batch on one daemon, planned before it starts."""

    def __init__(self, daemon, samples):
        self.daemon = daemon
        self.cli("batch", "submit", os.path.join(samples, "template.json"), os.path.join(samples, "week.csv"), "--draft")
        self.cli("plan", "week")
        self.cli("batch", "start", "week")
        jobs = daemon.get("/v1/jobs", params={"limit": 100}).json()["jobs"]
        self.job = {j["sample"]: j["id"] for j in jobs}
        assert len(self.job) == N_SAMPLE, self.job

    def cli(self, *arguments):
        done = subprocess.run([program("selvedge"), *arguments, "--server", self.daemon.url], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"selvedge {' '.join(arguments[:2])}: {done.stdout}{done.stderr}")
        return done.stdout

    def say_plan(self):
        """What was expected, and what the samples with one attempt took."""
        say("selvedge plan week\n" + "".join(f"  {line}\n" for line in self.cli("plan", "week").splitlines()).rstrip())

    def folder(self, sample):
        return os.path.join(self.daemon.data, "jobs", self.job[sample])

    def wait(self, patience_s=1500):
        """Waits for the end of all jobs; returns them, {sample: job}."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            jobs = {s: self.daemon.get(f"/v1/jobs/{j}").json() for s, j in self.job.items()}
            if all(j["state"] in ("succeeded", "failed", "cancelled") for j in jobs.values()):
                for sample, job in jobs.items():
                    if job["state"] != "succeeded":
                        raise RuntimeError(f"'{sample}' is {job['state']}: {job['error']}")
                return jobs
            time.sleep(0.1)
        raise RuntimeError("the batch did not end")

    def results(self, sample):
        return self.results_of(self.folder(sample))

    @staticmethod
    def results_of(job):
        """(result and series without times, {file: SHA-256})."""
        top, sums = os.path.join(job, "results"), {}
        for folder, _, names in os.walk(top):
            for name in names:
                path = os.path.join(folder, name)
                if not name.endswith(WITH_TIMES):
                    with open(path, "rb") as f:
                        sums[os.path.relpath(path, top)] = hashlib.sha256(f.read()).hexdigest()
        return outcome(job), sums


def kill_a_worker(batch, cluster, instead=None):
    """Kills the worker of the first sample whose fit has made a step, or calls instead(its Slurm job); returns (sample,
    steps, its Slurm job)."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        for pid in cluster.strays():
            try:
                with open(f"/proc/{pid}/cmdline", "rb") as f:
                    folder = f.read().rstrip(b"\0").split(b"\0")[-1].decode()
                sample = next((s for s in batch.job if batch.folder(s) == folder), None)
                with open(os.path.join(folder, "series.rec")) as f:
                    steps = len(f.read().splitlines())
                if sample is None or steps < 1:
                    continue
                with open(os.path.join(folder, "backend.json")) as f:
                    number = json.load(f)["id"]
                if instead is None:
                    os.kill(pid, signal.SIGKILL)
                else:
                    instead(number)
                return sample, steps, number
            except (OSError, ProcessLookupError):
                continue
        time.sleep(0.01)
    raise RuntimeError("no worker was seen in mid-fit")


@contextlib.contextmanager
def database(folder, kind):
    """Settings of a daemon with this kind of database."""
    if kind == "sqlite":
        yield {}
        return
    with PostgresServer() as server:
        say(server.query("SELECT split_part(version(), ' (', 1)"))
        yield store_options(server, server.make_database(), folder)


def missing_postgresql():
    """Why the daemon cannot use PostgreSQL here, or None."""
    try:
        programs()
    except PostgresMissing as e:
        return str(e)
    plugin = os.path.join(BUILD, "lib", "selvedge-postgresql.so")
    return None if os.path.exists(plugin) else "it was built without libpq-dev"


def on_cluster(folder, samples, options, kind):
    with SlurmCluster(os.path.join(folder, "cluster")) as cluster, database(folder, kind) as store:
        say(f"Slurm {cluster.run('sinfo', '--version').split()[-1]} with nodes {', '.join(cluster.nodes)}")
        settings = cluster.options(**{"slurm.memory_bytes": 0, **store, **options})
        with Daemon(os.path.join(folder, "slurm"), worker=program("selvedge-worker"), options=settings, environment=cluster.environment) as daemon:
            batch = Batch(daemon, samples)
            sample, steps, number = kill_a_worker(batch, cluster)
            say(f"killed the worker of '{sample}' (Slurm job {number}) after {steps} step(s) of its fit")
            jobs = batch.wait()
            if jobs[sample]["attempt"] != 2 or jobs[sample]["lost_attempts"] != 1:
                raise RuntimeError(f"the killed job has {jobs[sample]['attempt']} attempts")
            say(cluster.run("squeue", "--states=all", "--sort=i", "--format=%.6i %.20j %.10T %.6N").rstrip())
            batch.say_plan()
            return {s: batch.results(s) for s in jobs}


def on_this_machine(folder, samples, options):
    with Daemon(os.path.join(folder, "local"), worker=program("selvedge-worker"), options={"jobs.workers": 2, "jobs.threads": 1, **options}) as daemon:
        batch = Batch(daemon, samples)
        jobs = batch.wait()
        for line in batch.cli("batch", "results", "week").splitlines():
            say("  " + " ".join(f"{cell:.22s}".ljust(16) for cell in (line.split(",")[i] for i in (0, 2, 3, 4, 5, 7))))
        batch.say_plan()
        return {s: batch.results(s) for s in jobs}


def run(folder, options, kind):
    """Returns the number of samples whose results differ."""
    samples, start = make_samples(os.path.join(folder, "samples")), time.monotonic()
    cluster = on_cluster(folder, samples, options, kind)
    middle = time.monotonic()
    local = on_this_machine(folder, samples, options)
    n_other = 0
    for sample in sorted(cluster):
        same = cluster[sample] == local[sample]
        n_other += not same
        say(f"{'same ' if same else 'OTHER'} {sample}: objective {local[sample][0][0]['models'][0]['objective']!r}, {len(local[sample][0][1])} steps, "
            f"{len(local[sample][1])} further files")
    say(f"{len(cluster) - n_other} of {len(cluster)} samples have the same results bit by bit; cluster {middle - start:.1f} s with its start, "
        f"this machine {time.monotonic() - middle:.1f} s")
    return n_other


def stop(number, unused):
    raise SystemExit(128 + number)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a setting of both daemons")
    parser.add_argument("--store", choices=["sqlite", "postgresql"], default="postgresql", help="the database of the daemon with the cluster")
    parser.add_argument("--keep", action="store_true", help="keep the folder")
    arguments = parser.parse_args()
    reason = missing() or (missing_postgresql() if arguments.store == "postgresql" else None)
    if reason:
        say(f"cluster-demo is skipped: {reason}")
        return SKIPPED
    signal.signal(signal.SIGTERM, stop)
    signal.signal(signal.SIGHUP, stop)
    folder = tempfile.mkdtemp(prefix="cluster-demo-", dir=BUILD)
    try:
        n_other = run(folder, dict(pair.split("=", 1) for pair in arguments.set), arguments.store)
        arguments.keep = arguments.keep or n_other > 0
        return 1 if n_other else 0
    except KeyboardInterrupt:
        say("stopped")
        return 130
    except Exception as e:  # the folder tells more than a traceback
        arguments.keep = True
        say(f"error: {type(e).__name__}: {e}")
        return 1
    finally:
        if arguments.keep:
            say(f"the folder is kept: {folder}")
        else:
            shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
