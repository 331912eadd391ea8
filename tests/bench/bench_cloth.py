"""How well are measured fabrics reproduced by described cloths? Prints figures cloth.*, one JSON object on a line.

    bench_cloth.py [--build DIR] [--keep DIR] [--tables DIR] [--models IDS] [WHAT ...]

WHAT: names of tables or of recoveries; default: everything. All tables go through the same procedure: one job for each
of the descriptions in DESCRIPTIONS, whose cloth numbers are fitted together with the scattering parameters. The job
with the lowest cross-validation error inside the fitted rows is the result of the table. The held-out rows choose
nothing. The jobs' folders are kept in --keep, and a job that is there already is not run again.
"""
import argparse
import glob
import json
import os
import shutil
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.environ.get("SELVEDGE_DATA") or os.path.join(ROOT, "..", "shared", "data")

# What a user writes who knows no more than that it is woven, or a felt. {} is a number that is fitted within its range.
WOVEN_YARN = {"fibers": 40, "flatness": {"lower": 1.2}, "packing": {"lower": 0.35}, "twist_per_m": {"lower": 0, "upper": 1500},
              "fiber_angle_deg": {}, "hairs_per_mm": {}}
DESCRIPTIONS = {
    "plain": {"weave": "plain", "tile_warps": 4, "tile_wefts": 4, "compression": {"lower": 0.6, "upper": 1.1},
              "yarns": [WOVEN_YARN]},
    "felt": {"weave": "felt", "density": {}, "tilt_spread_deg": {"lower": 2, "upper": 45}, "layering": {},
             "yarns": [{"fibers": 600}]},
}


def figure(name, value, unit, better="lower"):
    print(json.dumps({"name": name, "value": value, "unit": unit, "better": better}), flush=True)


def run_job(build, folder, document, files):
    """Runs the worker on a job; returns result.json and the wall time in seconds. A finished job is read only."""
    result_file, wall_file = os.path.join(folder, "results", "result.json"), os.path.join(folder, "wall_s")
    if not os.path.exists(wall_file):
        shutil.rmtree(folder, ignore_errors=True)
        os.makedirs(os.path.join(folder, "input"))
        for file in files:
            shutil.copy(file, os.path.join(folder, "input"))
        with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
            json.dump(document, f, indent=1)
        start = time.monotonic()
        with open(os.path.join(folder, "worker.txt"), "w", encoding="utf-8") as log:
            code = subprocess.run([os.path.join(build, "bin", "selvedge-worker"), folder], stdout=log, stderr=log).returncode
        if code != 0:
            with open(os.path.join(folder, "status.json"), encoding="utf-8") as f:
                raise RuntimeError(f"{folder}: worker ended with {code}: {json.load(f).get('error')}")
        with open(wall_file, "w", encoding="utf-8") as f:
            f.write(f"{time.monotonic() - start:.2f}")
    with open(result_file, encoding="utf-8") as f, open(wall_file, encoding="utf-8") as w:
        return json.load(f), float(w.read())


def cross_validation(result):
    """Error inside the fitted rows that chooses; infinite where there were too few rows for one."""
    value = (result["cross_validation"] or {}).get("rel_rms")
    return float("inf") if value is None else value


def bench_table(arguments, table):
    """Figures of one table; returns (held-out error of the twin, of the plain BRDF)."""
    sample = os.path.splitext(os.path.basename(table))[0]
    fit = {"render_px": 16, "render_samples": 4, "path_budget": arguments.path_budget}
    if arguments.models:
        fit["models"] = arguments.models.split(",")
    best, wall_s = None, 0.0
    for name, cloth in DESCRIPTIONS.items():
        document = {"sample": f"{sample} as {name}", "cloth": cloth, "measurements": {"file": os.path.basename(table)}, "fit": fit}
        result, seconds = run_job(arguments.build, os.path.join(arguments.keep, f"{sample}.{name}"), document, [table])
        wall_s += seconds
        print(f"{sample} as {name}: fitted {result['fit_rel_rms']:.3f}, cross-validation {cross_validation(result):.3f}, "
              f"held out {result['heldout_rel_rms']:.3f}, {seconds:.0f} s", file=sys.stderr)
        if best is None or cross_validation(result) < cross_validation(best):
            best = result
    brdf = best["skill"]["plain_brdf"]["heldout_rel_rms"]
    figure(f"cloth.real.{sample}.fit_rel_rms", best["fit_rel_rms"], "1")
    figure(f"cloth.real.{sample}.heldout_rel_rms", best["heldout_rel_rms"], "1")
    figure(f"cloth.real.{sample}.brdf_heldout_rel_rms", brdf, "1")
    figure(f"cloth.real.{sample}.wall_s", round(wall_s, 1), "s")
    return best["heldout_rel_rms"], brdf


def bench_tables(arguments):
    tables = sorted(glob.glob(os.path.join(arguments.tables, "*.csv")))
    if not tables:
        print(f"skipped cloth.real: no tables (*.csv) in {arguments.tables}", file=sys.stderr)
    scores = [bench_table(arguments, t) for t in tables if not arguments.what or os.path.splitext(os.path.basename(t))[0] in arguments.what]
    if scores and not arguments.what:
        figure("cloth.real.tables_below_5_percent", sum(twin < 0.05 for twin, _ in scores), "tables", "higher")
        figure("cloth.real.tables_below_brdf", sum(twin < brdf for twin, brdf in scores), "tables", "higher")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    parser.add_argument("--keep", help="folder of the jobs (default: bench-cloth in the build folder)")
    parser.add_argument("--tables", default=os.path.join(DATA, "measured-reflectance-dense"))
    parser.add_argument("--models", help="scattering models, separated by commas (default: that of a job without fit.models)")
    parser.add_argument("--path-budget", type=int, default=3000000)
    parser.add_argument("what", nargs="*")
    arguments = parser.parse_args()
    arguments.build = os.path.abspath(arguments.build)
    arguments.keep = os.path.abspath(arguments.keep or os.path.join(arguments.build, "bench-cloth"))
    bench_tables(arguments)


if __name__ == "__main__":
    main()
