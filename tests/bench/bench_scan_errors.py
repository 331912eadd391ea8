"""Do the stated errors of a fit to scanned fibers contain the truth? Prints figures cloth.demo.* and cloth.scan.*, one JSON
object on a line.

    bench_scan_errors.py [--build DIR] [--keep DIR] [--seeds N] [--phantoms N] [--true N] [WHAT ...]

WHAT: demo, scan; default: both.
demo: the demo's cloth, scan and photographs are made with N seeds, and its nine parameters are fitted to the reconstructed
fibers. The first --true of them are fitted to the true fibers too, for the ratio of the stated errors. scan: --phantoms
small cloths go the same way, with other parameters each, for the coverage of two standard errors. Only fitted rows are
made. The jobs' folders are kept in --keep, and a job that is there already is not run again.
"""
import argparse
import json
import os
import subprocess
import sys

from bench_cloth import ROOT, figure, run_job

DEMO = {"C_R": "0.06,0.05,0.08", "C_TT": "0.72,0.55,0.35", "beta_R": 4, "beta_TT": 20, "gamma_TT": 18}


def fitted_rows(arguments):
    """File with the configurations of the 16 rows that are fitted by default."""
    path = os.path.join(arguments.keep, "rows.csv")
    listed = os.path.join(arguments.keep, "default")
    if not os.path.exists(path):
        phantom(arguments, "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", listed)
        phantom(arguments, "photograph", "--fibers", os.path.join(listed, "truth.hair"), "--out", listed, "--paths", "256", "--px", "1", "--quiet")
        with open(os.path.join(listed, "photographs.json"), encoding="utf-8") as f:
            rows = [p for p in json.load(f) if p["set"] == "fit"]
        keys = ["set", "light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg", "cloth_rotation_deg"]
        with open(path, "w", encoding="utf-8") as f:
            f.write(",".join(keys) + "\n" + "".join(",".join(str(r[k]) for k in keys) + "\n" for r in rows))
    return path


def phantom(arguments, *command):
    subprocess.run([os.path.join(arguments.build, "bin", "selvedge-phantom"), *command], check=True, stdout=subprocess.DEVNULL)


def make_sample(arguments, folder, weave, seed, parameters, paths):
    """Scan, true fibers and photographs; returns the photographs' part of the job document."""
    if not os.path.exists(os.path.join(folder, "truth.json")):
        given = [v for name, value in parameters.items() for v in ("--param", f"{name}={value}")]
        phantom(arguments, "cloth", *weave, "--seed", str(seed), "--out", folder)
        phantom(arguments, "photograph", "--fibers", os.path.join(folder, "truth.hair"), "--out", folder, "--table", fitted_rows(arguments),
                "--seed", str(seed + 4), "--noise", "0.005", "--paths", str(paths), "--px", "64", "--quiet", *given)
    with open(os.path.join(folder, "photographs.json"), encoding="utf-8") as f:
        return json.load(f)


def fit(arguments, folder, source, seed, photographs, option):
    """Fits the cloth of `source` (scan or truth); returns the rows of parameters with their true values."""
    cloth = {"scan": {"volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}}, "truth": {"fibers": {"file": "truth.hair"}}}[source]
    files = [os.path.join(folder, f) for f in [{"scan": "scan.tif", "truth": "truth.hair"}[source]] + [p["file"] for p in photographs]]
    given = dict({"model": "two_lobe.v1", "seed": seed, "render_px": 16, "render_samples": 4}, **option)
    document = {"sample": f"{source} {seed}", **cloth, "photographs": photographs, "fit": given}
    result, seconds = run_job(arguments.build, os.path.join(folder, source), document, files)
    with open(os.path.join(folder, "truth.json"), encoding="utf-8") as f:
        truth = json.load(f)["parameter"]
    rows = [(p["name"], (p["value"] - truth[p["name"]]) / p["standard_error"], p["standard_error"]) for p in result["parameters"] if p["determined"]]
    print(f"{folder} {source}, {seconds:.0f} s: " + ", ".join(f"{name} {z:+.2f}" for name, z, _ in rows), file=sys.stderr)
    return rows


def covered(rows):
    return sum(abs(z) <= 2 for _, z, _ in rows) / len(rows)


def bench_demo(arguments):
    every, ratios = [], []
    for k in range(arguments.seeds):
        folder = os.path.join(arguments.keep, f"demo-{k}")
        photographs = make_sample(arguments, folder, ["--weave", "twill"], 7 + k, DEMO, 131072)
        rows = fit(arguments, folder, "scan", 1 + k, photographs, {})
        every += rows
        if k < arguments.true:
            exact = {name: se for name, _, se in fit(arguments, folder, "truth", 1 + k, photographs, {})}
            ratios += [se / exact[name] for name, _, se in rows if name in exact]
    if every:
        figure("cloth.demo.worst_error_over_se", round(max(abs(z) for _, z, _ in every), 3), "1")
        figure("cloth.demo.covered", round(covered(every), 4), "1", "higher")
        figure("cloth.demo.parameters", len(every), "parameters", "higher")
    if ratios:
        figure("cloth.demo.se_over_true_fibers", round(max(ratios), 3), "1")


def bench_phantoms(arguments):
    every = []
    for k in range(arguments.phantoms):
        folder = os.path.join(arguments.keep, f"phantom-{k}")
        tone = 0.4 + 0.05 * (k % 9)
        parameters = {"C_R": f"{0.04 + 0.004 * (k % 7)},{0.05},{0.06}", "C_TT": f"{tone},{0.9 * tone},{0.7 * tone}",
                      "beta_R": 3.5 + 0.5 * (k % 8), "beta_TT": 15 + 2 * (k % 7), "gamma_TT": 14 + 2 * (k % 6)}
        weave = ["--weave", ("twill", "satin", "twill31")[k % 3], "--fibers-per-yarn", "7"]
        photographs = make_sample(arguments, folder, weave, 100 + k, parameters, 65536)
        every += fit(arguments, folder, "scan", 1 + k, photographs, {"path_budget": 2000000})
    if every:
        figure("cloth.scan.worst_error_over_se", round(max(abs(z) for _, z, _ in every), 3), "1")
        figure("cloth.scan.covered", round(covered(every), 4), "1", "higher")
        figure("cloth.scan.parameters", len(every), "parameters", "higher")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    parser.add_argument("--keep", default=None, help="folder of samples and jobs (default: BUILD/bench-scan)")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--phantoms", type=int, default=20)
    parser.add_argument("--true", type=int, default=3)
    parser.add_argument("what", nargs="*", help="demo, scan; other names, of other benchmarks, are passed over")
    arguments = parser.parse_args()
    arguments.keep = arguments.keep or os.path.join(arguments.build, "bench-scan")
    os.makedirs(arguments.keep, exist_ok=True)
    for name, bench in (("scan", bench_phantoms), ("demo", bench_demo)):
        if not arguments.what or name in arguments.what:
            bench(arguments)


if __name__ == "__main__":
    main()
