"""How well does each model reproduce measured fabrics? Prints figures models.real.<sample>.<id>.*, one JSON object on a line.

    bench_model_tables.py [--build DIR] [--keep DIR] [--tables DIR] [--path-budget N] [SAMPLE ...]

One job a table compares all models of the catalogue, as `fit.models` does for a user. All fit the same rows on the same cloth, which
nobody scanned: a felt where the name of the table has "felt", else a plain weave of single yarns, both with the numbers that a
description has when none are given. No number of the cloth is fitted, so a model is not helped by a cloth of its own. Held-out rows
choose nothing. The jobs' folders are kept, and a job that is there already is not run again. Standard error has the plain BRDF of each
table, and where each model is too bright or too dark: the median of rendered over measured radiance, and in brackets the relative RMS
error, over the held-out rows of each kind in KINDS.
"""
import argparse
import glob
import json
import math
import os
import statistics
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from bench_cloth import DATA, ROOT, Failure, each, figure, run_job  # noqa: E402

WEAVE = {"weave": "plain", "tile_warps": 8, "tile_wefts": 8, "yarns": [{"fibers": 40}]}
FELT = {"weave": "felt", "yarns": [{"fibers": 600}]}


def model_ids(build):
    """The catalogue, as the worker prints it."""
    said = subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--catalogue"], check=True, capture_output=True, text=True)
    return [model["id"] for model in json.loads(said.stdout)["models"]]


KINDS = ["low highlight", "highlight", "towards the lamp", "low", "rest"]


def direction(theta_deg, phi_deg):
    theta, phi = math.radians(theta_deg), math.radians(phi_deg)
    return math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)


def kind(row):
    """Highlights are within 25 degrees of the mirror direction; "low" is a lamp or a camera at 60 degrees or more."""
    camera = direction(row["camera_theta_deg"], row["camera_phi_deg"])
    near = math.cos(math.radians(25))
    low = max(row["light_theta_deg"], row["camera_theta_deg"]) >= 60
    for turn, name in ((180, "highlight"), (0, "towards the lamp")):
        other = direction(row["light_theta_deg"], row["light_phi_deg"] + turn)
        if sum(a * b for a, b in zip(camera, other)) >= near:
            return "low highlight" if low and turn else name
    return "low" if low else "rest"


def by_kind(rows):
    text = []
    for name in KINDS:
        of = [r for r in rows if r["set"] == "held-out" and kind(r) == name]
        ratio = [sum(r["rendered"]) / sum(r["measured"]) for r in of]
        rms = math.sqrt(sum(r["rel_error"] ** 2 for r in of) / len(of)) if of else None
        text.append(f"{statistics.median(ratio):.2f} ({rms:.2f})" if of else "-")
    return ", ".join(text)


def with_se(model, what):
    """The noise of the renderings is taken off, so an error may come out as 0; its standard error tells what that is worth."""
    return f"{model[what]:.4f} +- {model[what + '_se']:.4f}"


def bench_table(arguments, table):
    sample = os.path.splitext(os.path.basename(table))[0]
    document = {"sample": sample, "cloth": FELT if "felt" in sample else WEAVE, "measurements": {"file": os.path.basename(table)},
                "fit": {"models": model_ids(arguments.build), "path_budget": arguments.path_budget, "render_px": 16, "render_samples": 4,
                        "discrepancy": False}}
    result, seconds = run_job(arguments.build, os.path.join(arguments.keep, sample), document, [table])
    if result["heldout_rel_rms"] is None or not result["skill"]:
        raise Failure(f"{table}: it has no held-out rows, or rows that a plain BRDF does not describe")
    brdf = result["skill"]["plain_brdf"]
    print(f"{sample}: {seconds:.0f} s; plain BRDF {brdf['fit_rel_rms']:.4f} fitted, {brdf['heldout_rel_rms']:.4f} held out; held-out rows: "
          + ", ".join(f"{name}: {sum(r['set'] == 'held-out' and kind(r) == name for r in result['rows'])}" for name in KINDS), file=sys.stderr)
    for model in result["models"]:
        for what in ("fit_rel_rms", "heldout_rel_rms"):
            figure(f"models.real.{sample}.{model['id']}.{what}", model[what], "1", note=None if model["converged"] else "not converged")
        rows = [{**a, **b} for a, b in zip(result["rows"], model["rows"])]
        print(f"  {model['id']:26} fitted {with_se(model, 'fit_rel_rms')}, "
              f"held out {with_se(model, 'heldout_rel_rms')}, {'converged' if model['converged'] else 'not converged'}; {by_kind(rows)}", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--keep", default=None, help="default: bench-model-tables in the build folder")
    parser.add_argument("--tables", default=os.path.join(DATA, "measured-reflectance-dense"))
    parser.add_argument("--path-budget", type=int, default=1000000, help="of each model's fit")
    parser.add_argument("what", nargs="*", metavar="SAMPLE")
    arguments = parser.parse_args()
    arguments.build = os.path.join(ROOT, arguments.build)
    arguments.keep = arguments.keep or os.path.join(arguments.build, "bench-model-tables")
    tables = sorted(glob.glob(os.path.join(arguments.tables, "*.csv")))
    if not tables:
        print(f"skipped models.real: no tables (*.csv) in {arguments.tables} (set SELVEDGE_DATA)", file=sys.stderr)
    named = {os.path.splitext(os.path.basename(table))[0]: table for table in tables}
    unknown = [sample for sample in arguments.what if sample not in named]
    if tables and unknown:
        parser.error(f"no table of {', '.join(unknown)} in {arguments.tables}: there are {', '.join(named)}")
    _, whole = each([named[sample] for sample in arguments.what or named if sample in named], lambda table: bench_table(arguments, table))
    return 0 if whole else 1


if __name__ == "__main__":
    sys.exit(main())
