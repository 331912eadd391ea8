"""How far a plan of a batch is off, of two batches of six small samples: that of `make cluster-demo`, files of fibers and a
table of reflectances each, and another one, each with a scan of another weave and a table.

`scale.plan_ratio` is of the demo's batch, on this machine, the larger one of planned over taken core hours and its inverse,
of a service that has run nothing before. `scale.plan_scans_ratio` is that of the batch of scans, `scale.plan_ratio_again` of
the same batch once its jobs are known, and `scale.plan_memory_ratio` and `scale.plan_disk_ratio` are the ratios taken over
planned of that. `scale.plan_wall_ratio` is the time from the first start to the last end over the planned one of the first
batch of scans; it goes with the load of the machine.
One JSON line per figure. Usage: bench_plan.py [--demo]   (--demo: the demo's batch alone)"""
import json
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support", "python"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "slurm"))
import cluster_demo  # noqa: E402
from daemon_under_test import Daemon, program, wait_until  # noqa: E402

WEAVES = ("plain", "twill", "satin", "twill31", "knit", "plain")
TEMPLATE = {"sample": "", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0},
            "measurements": {"file": "rows.csv"}, "fit": {"path_budget": 500000, "seed": 1}}
HEADER = "set,light_theta_deg,light_phi_deg,cloth_rotation_deg,camera_theta_deg,camera_phi_deg,r,g,b\n"


def print_figure(name, value, unit):
    print(json.dumps({"name": f"scale.{name}", "value": round(value, 4), "unit": unit, "better": "lower"}), flush=True)


def make_samples(folder):
    rows = "".join(f"{'fit' if i % 4 else 'held-out'},{10 + 5 * i},0,0,30,180,{0.2 - 0.01 * i:.3f},{0.15 - 0.008 * i:.3f},0.05\n" for i in range(12))
    for i, weave in enumerate(WEAVES):
        sample = os.path.join(folder, f"{i}-{weave}")
        os.makedirs(sample)
        made = os.path.join(folder, "..", f"made-{i}")
        subprocess.run([program("selvedge-phantom"), "cloth", "--weave", weave, "--fibers-per-yarn", str(7 + 3 * (i % 2)), "--seed", str(i), "--out", made],
                       check=True, stdout=subprocess.DEVNULL)
        os.rename(os.path.join(made, "scan.tif"), os.path.join(sample, "scan.tif"))
        with open(os.path.join(sample, "rows.csv"), "w") as f:
            f.write(HEADER + rows)


def plan(d, name):
    said = subprocess.run([program("selvedge"), "--server", d.url, "plan", name, "--json"], check=True, capture_output=True, text=True).stdout
    return json.loads(said)


def run_batch(d, template, samples, name):
    """The plan before, the plan afterwards, and the time from the first start to the last end."""
    subprocess.run([program("selvedge"), "--server", d.url, "batch", "submit", template, samples, "--name", name, "--draft"],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    before = plan(d, name)
    assert before["expected"]["n"] == len(WEAVES), before
    batch = before["id"]
    d.post(f"/v1/batches/{batch}/start")
    wait_until(lambda: d.get(f"/v1/batches/{batch}").json()["states"]["succeeded"] == len(WEAVES), 3600)
    jobs = d.get(f"/v1/jobs?limit=50&batch={batch}").json()["jobs"]
    wall_s = max(j["finished_unix_s"] for j in jobs) - min(j["started_unix_s"] for j in jobs)
    return before, plan(d, name), wall_s


def larger(ratio):
    return max(ratio, 1 / ratio)


def bench_demo():
    with tempfile.TemporaryDirectory() as folder:
        samples = cluster_demo.make_samples(os.path.join(folder, "samples"))
        with Daemon(os.path.join(folder, "data"), worker=program("selvedge-worker"), options={"jobs.workers": 2, "jobs.threads": 1}) as d:
            _, after, _ = run_batch(d, os.path.join(samples, "template.json"), os.path.join(samples, "week.csv"), "demo")
            print_figure("plan_ratio", larger(after["ratio"]["cpu_s"]), "1")


def bench_scans():
    with tempfile.TemporaryDirectory() as folder:
        make_samples(os.path.join(folder, "samples"))
        with open(os.path.join(folder, "template.json"), "w") as f:
            json.dump(TEMPLATE, f)
        with Daemon(os.path.join(folder, "data"), worker=program("selvedge-worker")) as d:
            template, samples = os.path.join(folder, "template.json"), os.path.join(folder, "samples")
            before, after, wall_s = run_batch(d, template, samples, "first")
            print_figure("plan_scans_ratio", larger(after["ratio"]["cpu_s"]), "1")
            print_figure("plan_wall_ratio", wall_s / before["expected"]["wall_s"], "1")
            _, after, _ = run_batch(d, template, samples, "again")
            print_figure("plan_ratio_again", larger(after["ratio"]["cpu_s"]), "1")
            print_figure("plan_memory_ratio", after["ratio"]["memory_bytes"], "1")
            print_figure("plan_disk_ratio", after["ratio"]["disk_bytes"], "1")


if __name__ == "__main__":
    bench_demo()
    if sys.argv[1:] != ["--demo"]:
        bench_scans()
