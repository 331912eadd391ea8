"""How well does each model reproduce measured fabrics? Prints figures models.real.<sample>.<id>.*, one JSON object on a line.

    bench_model_tables.py [--build DIR] [--keep DIR] [--tables DIR] [--path-budget N] [SAMPLE ...]

One job a table compares all models of the catalogue, as `fit.models` does for a user. All fit the same rows on the same cloth, which
nobody scanned: a felt where the name of the table has "felt", else a plain weave of single yarns, both with the numbers that a
description has when none are given. No number of the cloth is fitted, so a model is not helped by a cloth of its own. Held-out rows
choose nothing. The jobs' folders are kept, and a job that is there already is not run again. Standard errors of the tracing and the
plain BRDF of each table go to standard error.
"""
import argparse
import glob
import os
import re
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from bench_cloth import DATA, ROOT, Failure, figure, run_job  # noqa: E402

WEAVE = {"weave": "plain", "tile_warps": 8, "tile_wefts": 8, "yarns": [{"fibers": 40}]}
FELT = {"weave": "felt", "yarns": [{"fibers": 600}]}


def model_ids():
    with open(os.path.join(ROOT, "base", "catalogue", "models.def"), encoding="utf-8") as f:
        return re.findall(r'^(?:SURFACE|VOLUME)_MODEL\(\w+,\s*"([^"]+)"', f.read(), re.MULTILINE)


def bench_table(arguments, table):
    sample = os.path.splitext(os.path.basename(table))[0]
    document = {"sample": sample, "cloth": FELT if "felt" in sample else WEAVE, "measurements": {"file": os.path.basename(table)},
                "fit": {"models": model_ids(), "path_budget": arguments.path_budget, "render_px": 16, "render_samples": 4,
                        "discrepancy": False}}
    result, seconds = run_job(arguments.build, os.path.join(arguments.keep, sample), document, [table])
    brdf = result["skill"]["plain_brdf"] if result["skill"] else None
    print(f"{sample}: {seconds:.0f} s; plain BRDF {brdf and brdf['fit_rel_rms']} fitted, {brdf and brdf['heldout_rel_rms']} held out",
          file=sys.stderr)
    for model in result["models"]:
        figure(f"models.real.{sample}.{model['id']}.fit_rel_rms", model["fit_rel_rms"], "1")
        figure(f"models.real.{sample}.{model['id']}.heldout_rel_rms", model["heldout_rel_rms"], "1")
        print(f"  {model['id']:26} fitted {model['fit_rel_rms']:.4f}, held out {model['heldout_rel_rms']:.4f}, "
              f"{'converged' if model['converged'] else 'not converged'}", file=sys.stderr)


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
    whole = True
    for table in tables:
        if arguments.what and os.path.splitext(os.path.basename(table))[0] not in arguments.what:
            continue
        try:
            bench_table(arguments, table)
        except (Failure, OSError) as failure:
            print(f"FAILED {table}: {failure}", file=sys.stderr)
            whole = False
    return 0 if whole else 1


if __name__ == "__main__":
    sys.exit(main())
