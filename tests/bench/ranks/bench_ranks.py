"""Strong scaling of one fit over ranks. `scale.ranks2_efficiency` is measured: the time of a fit of a million paths with one
rank over twice that with two, each with one thread, the better of two runs of each. `scale.ranks64_simulated_efficiency`
follows from the model of rank_model.py for the same fit with the default budget; its inputs go to stderr, as the rows of
docs/ranks.md from which plot_scaling.py draws. One JSON line per figure. Usage: bench_ranks.py BUILD [PATH_BUDGET_OF_THE_MEASURED_FITS]"""
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import plot_scaling  # noqa: E402
import rank_job  # noqa: E402
import rank_model  # noqa: E402

BUILD = os.path.abspath(sys.argv[1])
WORKER = os.path.join(BUILD, "bin", "selvedge-worker")
ROOT_MAY = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
# in which a helper prepares an estimate of 10 rows with derivatives (radiance_source_init; least of 50, 2026-11-25)
PREPARE_S = 7e-4
RANKS = [1, 2, 4, 8, 16, 32, 64]
LOG = re.compile(r"stage fit: 2 ranks shared work (\d+) times \((\d+) tasks, [\d.]+ s\): (\d+) orders of (\d+) bytes, (\d+) bytes of results in "
                 r"(\d+) messages; rank 0 waited ([\d.]+) s for others, and ran (\d+) tasks in [\d.]+ s of "
                 r"processor time, of ([\d.]+) s for shared work and ([\d.]+) s in all")


def print_figure(name, value):
    print(json.dumps({"name": f"scale.{name}", "value": round(value, 4), "unit": "1", "better": "higher"}), flush=True)


def run(folder, rows, ranks, threads=1, **fit):
    """Runs the job, and returns the seconds of its fit."""
    shutil.rmtree(folder, ignore_errors=True)
    rank_job.write_job(folder, rows, fit)
    subprocess.run([WORKER, "--quiet", "--threads", str(threads), "--ranks", str(ranks), folder], check=True, stdin=subprocess.DEVNULL)
    with open(os.path.join(folder, "results", "result.json")) as f:
        return json.load(f)["fit_wall_s"]


def messages():
    """Seconds of a short message one way, bytes a second of long ones, and processor time of rank 0 for a message."""
    command = ["mpirun", "-q", "--oversubscribe", "--bind-to", "none", "-n", "2", os.path.join(BUILD, "bin", "selvedge-mpi"),
               os.path.join(BUILD, "tests", "bench", "ranks", "rank_messages")]
    printed = subprocess.run(command, env=ROOT_MAY, check=True, capture_output=True, text=True, stdin=subprocess.DEVNULL).stdout
    lines = {line["bytes"]: line for line in map(json.loads, printed.splitlines())}
    short, long = lines[4096], lines[8 << 20]
    return short["median_s"] / 2, (8 << 20) / (long["median_s"] - short["median_s"]), short["cpu_s"]


def look(folder):
    """What the model needs of the fit of a job that two ranks have run."""
    with open(os.path.join(folder, "log.txt")) as f:
        found = LOG.search(f.read())
    n_share, n_task, n_order, order_bytes, result_bytes, _, _, n_own = (float(v) for v in found.groups()[:8])
    shared_s, all_s = (float(v) for v in found.groups()[8:])
    there_s, bytes_per_s, handle_s = messages()
    replicas = rank_model.tasks_of(os.path.join(folder, "work", "fit", "estimates.journal"))
    tasks = [a + b for a, b in zip(replicas[::2], replicas[1::2])]  # both replicas of a step are handed out together
    assert len(tasks) == n_share, "the log and the checkpoint do not agree"
    return {"tasks": tasks, "task_s": shared_s / n_own, "serial_s": all_s - shared_s, "prepare_s": PREPARE_S, "there_s": there_s, "handle_s": handle_s,
            "bytes_per_s": bytes_per_s, "order_bytes": order_bytes / n_order, "result_bytes": result_bytes / (n_task - n_own)}


def main():
    budget = int(sys.argv[2]) if len(sys.argv) > 2 else 1000000
    if not os.access(os.path.join(BUILD, "bin", "selvedge-mpi"), os.X_OK):
        print("no selvedge-mpi in the build folder: Open MPI is not installed", file=sys.stderr)
        return
    with tempfile.TemporaryDirectory() as top:
        folder, took = os.path.join(top, "job"), {1: [], 2: []}
        rows = rank_job.true_rows(WORKER, os.path.join(top, "truth"))
        for ranks in (1, 2, 1, 2):
            took[ranks].append(run(folder, rows, ranks, path_budget=budget))
        threads_s = min(run(folder, rows, 1, 2, path_budget=budget) for _ in range(2))
        print(f"two threads of one process: efficiency {min(took[1]) / (2 * threads_s):.3f}", file=sys.stderr)
        print(f"seconds of the fit with {budget} paths: {took}; load {os.getloadavg()[0]:.1f}", file=sys.stderr)
        print_figure("ranks2_efficiency", min(took[1]) / (2 * min(took[2])))
        run(folder, rows, 2)
        measured = look(folder)
    print(f"rows of docs/ranks.md, for `make docs-ranks` ({len(measured['tasks'])} steps, {sum(measured['tasks'])} tasks):", file=sys.stderr)
    print("\n".join(plot_scaling.rows_of_inputs(measured)), file=sys.stderr)
    for ranks in RANKS:
        print(f"{ranks:3d} ranks: {rank_model.fit_s(measured, ranks):8.3f} s, efficiency {rank_model.efficiency(measured, ranks):.3f}", file=sys.stderr)
    print_figure("ranks64_simulated_efficiency", rank_model.efficiency(measured, 64))


if __name__ == "__main__":
    main()
