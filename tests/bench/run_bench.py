"""Prints every figure as one JSON object on a line: {"name", "value", "unit", "better"}. Progress goes to standard
error."""
import argparse
import json
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tests", "real"))


def figure(name, value, unit, better="lower"):
    print(json.dumps({"name": name, "value": value, "unit": unit, "better": better}), flush=True)


def bench_demo():
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([os.path.join(ROOT, "clients", "demo.sh"), "--fresh"], check=True, stdin=subprocess.DEVNULL,
                       stdout=sys.stderr, env=dict(os.environ, DEMO_DIR=folder))
        with open(os.path.join(folder, "summary.json")) as f:
            summary = json.load(f)
    figure("demo.wall_s", summary["wall_s"], "s")
    figure("demo.heldout_rel_rms", summary["heldout_rel_rms"], "1")
    figure("demo.c_tt_error", summary["c_tt_error"], "1")


def bench_real():
    import real_jobs
    for name in sorted(real_jobs.JOBS):
        missing = real_jobs.missing_data(name)
        if missing:
            print(f"skipped real.{name}: no {', '.join(missing)} (set SELVEDGE_DATA)", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            result, _, wall_s = real_jobs.run_job(name, os.path.join(folder, "job"))
        figure(f"real.{name}.fit_rel_rms", result["fit_rel_rms"], "1")
        figure(f"real.{name}.heldout_rel_rms", result["heldout_rel_rms"], "1")
        figure(f"real.{name}.wall_s", round(wall_s, 2), "s")


def bench_camera(build):
    subprocess.run([sys.executable, os.path.join(ROOT, "tests", "bench", "camera", "bench_camera.py"), "--build", build], check=True)


def bench_programs(build):
    """tests/bench/bench_*.c print their figures themselves."""
    folder = os.path.join(build, "tests", "bench")
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else []:
        if name.startswith("bench_"):
            subprocess.run([os.path.join(folder, name)], check=True)
    for name in ("bench_models", "bench_profiles", "bench_chapter4", "bench_waves"):
        subprocess.run([os.path.join(folder, "models", name)], check=True)


def bench_service(build):
    subprocess.run([sys.executable, os.path.join(ROOT, "tests", "bench", "service", "bench_service.py"), "--build", build], check=True)


# Those with a target of their own, the shortest first.
TARGETS = ["bench-house", "bench-glints", "bench-dashboard", "bench-pile", "bench-sheared", "bench-tiles", "bench-exact", "bench-exports", "bench-scale",
           "bench-progress", "bench-pictures", "bench-recovery", "bench-cylinder", "bench-thesis", "bench-model-tables", "bench-cloth"]


def bench_targets():
    """A target that fails does not keep the others from running."""
    failed = [t for t in TARGETS if subprocess.run(["make", "--no-print-directory", "-C", ROOT, t]).returncode != 0]
    if failed:
        sys.exit("failed: " + ", ".join(failed))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--only", choices=["demo", "real", "camera", "programs", "service", "targets"])
    arguments = parser.parse_args()
    build = os.path.join(ROOT, arguments.build)
    os.environ["SELVEDGE_BUILD"] = build
    if arguments.only in (None, "demo"):
        bench_demo()
    if arguments.only in (None, "real"):
        bench_real()
    if arguments.only in (None, "service"):
        bench_service(build)
    if arguments.only in (None, "camera"):
        bench_camera(build)
    if arguments.only in (None, "programs"):
        bench_programs(build)
    if arguments.only in (None, "targets"):
        bench_targets()


if __name__ == "__main__":
    main()
