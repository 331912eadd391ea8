"""Scaling of the geometry of a scan over ranks: a felt of 300 x 300 x 73 voxels, whose fibers are traced by one rank and by
two, each with one thread, the better of two runs of each. `scale.geometry_ranks2_efficiency` is the time of all stages with
one rank over twice that with two. What each stage takes, what the ranks exchange, and the same ratio of the processor time
of rank 0, which other work on the machine hardly changes, go to stderr. One JSON line. Usage: bench_rank_scan.py BUILD"""
import json
import os
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bench_ranks import BUILD, WORKER, print_figure  # noqa: E402

FELT = ["--weave", "felt", "--fibers-per-yarn", "140", "--felt-tile-um", "600", "--felt-thickness-um", "60", "--diameter-voxel", "5"]
# diameter and radius are given, because measuring them takes a fixed time that a large scan hardly notices
VOLUME = {"files": ["scan.tif"], "voxel_size_um": 2.0, "fiber_diameter_voxel": 5, "radius_um": 5}
STAGES = ("volume", "orientation", "fibers", "directions")


def trace(scan, folder, ranks):
    """Runs a job of geometry only. Returns the seconds of its stages, and the processor time of rank 0."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(os.path.join(folder, "input"))
    shutil.copy(scan, os.path.join(folder, "input", "scan.tif"))
    with open(os.path.join(folder, "job.json"), "w") as f:
        json.dump({"sample": "ranks", "volume": VOLUME}, f)
    subprocess.run([WORKER, "--quiet", "--threads", "1", "--ranks", str(ranks), folder], check=True, stdin=subprocess.DEVNULL)
    with open(os.path.join(folder, "results", "result.json")) as f:
        wall_s = {s["name"]: round(s["wall_s"], 2) for s in json.load(f)["stages"] if s["name"] in STAGES}
    with open(os.path.join(folder, "status.json")) as f:
        cpu_s = json.load(f)["cpu_s"]
    with open(os.path.join(folder, "log.txt")) as f:
        said = [line.split("INFO ", 1)[1].strip() for line in f if "ranks shared" in line]
    print(f"{ranks} ranks: {wall_s} s, rank 0 {cpu_s:.2f} s of processor time; load {os.getloadavg()[0]:.1f}", *said, sep="\n  ", file=sys.stderr)
    return sum(wall_s.values()), cpu_s


def main():
    if not os.access(os.path.join(BUILD, "bin", "selvedge-mpi"), os.X_OK):
        return
    with tempfile.TemporaryDirectory() as top:
        subprocess.run([os.path.join(BUILD, "bin", "selvedge-phantom"), "cloth", *FELT, "--threads", "1", "--out", os.path.join(top, "felt")],
                       check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        took = {1: [], 2: []}
        for ranks in (1, 2, 1, 2):
            took[ranks].append(trace(os.path.join(top, "felt", "scan.tif"), os.path.join(top, "job"), ranks))
    wall, cpu = (min(t[i] for t in took[1]) / (2 * min(t[i] for t in took[2])) for i in (0, 1))
    print(f"processor time of rank 0, with one rank over twice that with two: {cpu:.3f}", file=sys.stderr)
    print_figure("geometry_ranks2_efficiency", wall)


if __name__ == "__main__":
    main()
