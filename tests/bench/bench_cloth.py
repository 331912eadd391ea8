"""How well are measured fabrics reproduced by described cloths? Prints figures cloth.*, one JSON object on a line.

    bench_cloth.py [--build DIR] [--keep DIR] [--tables DIR] [--models IDS] [--plain-prior X] [--starts N] [--no-discrepancy]
                   [WHAT ...]

WHAT: names of tables or of recoveries; default: everything. All tables go through the same procedure: one job for each
of the descriptions in DESCRIPTIONS, whose cloth numbers are fitted together with the scattering parameters. The job
with the lowest cross-validation error inside the fitted rows is the result of the table. The held-out rows choose
nothing. The jobs' folders are kept in --keep, and a job that is there already, with the same document and files, is not
run again. A table or a recovery that fails does not keep the others from running; the exit status is then 1.
"""
import argparse
import filecmp
import glob
import json
import math
import os
import shutil
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
DATA = os.environ.get("SELVEDGE_DATA") or os.path.join(ROOT, "..", "shared", "data")

# What a user writes who knows no more than that it is woven, or a felt. {} is a number that is fitted within its range. Small
# tiles keep the search fast. The last fit has tiles of 16 x 16 yarns, whose random places move radiances less
# (optimizer/fit/NOTES.md, "What limits the recoveries").
WOVEN_YARN = {"fibers": 40, "flatness": {"lower": 1.2}, "packing": {"lower": 0.35}, "twist_per_m": {"lower": 0, "upper": 1500},
              "fiber_angle_deg": {}, "hairs_per_mm": {}}
DESCRIPTIONS = {
    "plain": {"weave": "plain", "tile_warps": 4, "tile_wefts": 4, "final_tiles": 4, "compression": {"lower": 0.6, "upper": 1.1},
              "yarns": [WOVEN_YARN]},
    "felt": {"weave": "felt", "final_tiles": 4, "density": {}, "tilt_spread_deg": {"lower": 2, "upper": 45}, "layering": {},
             "yarns": [{"fibers": 600}]},
}


def figure(name, value, unit, better="lower", note=None):
    """note: what the page says of a value, such as "not converged"."""
    row = {"name": name, "value": value, "unit": unit, "better": better}
    print(json.dumps(row if note is None else {**row, "note": note}), flush=True)


class Failure(Exception):
    """A table or a recovery that gives no figures, and why."""


def is_done(folder, document, files):
    """Whether the folder has the results of this very job."""
    if not os.path.exists(os.path.join(folder, "wall_s")):
        return False
    with open(os.path.join(folder, "job.json"), encoding="utf-8") as f:
        same = json.load(f) == document
    kept = [os.path.join(folder, "input", os.path.basename(file)) for file in files]
    return same and all(os.path.exists(k) and filecmp.cmp(k, file, shallow=False) for k, file in zip(kept, files))


def worker_error(folder, code):
    try:
        with open(os.path.join(folder, "status.json"), encoding="utf-8") as f:
            error = json.load(f).get("error") or {}
    except (OSError, ValueError):
        error = {}
    return f"{folder}: the worker ended with {code}: {error.get('text') or 'see worker.txt'}"


def run_job(build, folder, document, files):
    """Runs the worker on a job; returns result.json and the wall time in seconds. A finished job is only read."""
    result_file, wall_file = os.path.join(folder, "results", "result.json"), os.path.join(folder, "wall_s")
    if not is_done(folder, document, files):
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
            raise Failure(worker_error(folder, code))
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
    fit = {"models": arguments.models.split(","), "render_px": 16, "render_samples": 4,
           "path_budget": arguments.starts * arguments.path_budget, "starts": arguments.starts,
           "plain_prior": arguments.plain_prior, "discrepancy": arguments.discrepancy}
    best, wall_s = None, 0.0
    for name, cloth in DESCRIPTIONS.items():
        document = {"sample": f"{sample} as {name}", "cloth": cloth, "measurements": {"file": os.path.basename(table)}, "fit": fit}
        result, seconds = run_job(arguments.build, os.path.join(arguments.keep, f"{sample}.{name}"), document, [table])
        if result["heldout_rel_rms"] is None or not result["skill"]:
            raise Failure(f"{table}: it has no held-out rows, or rows that a plain BRDF does not describe")
        wall_s += seconds
        print(f"{sample} as {name}: fitted {result['fit_rel_rms']:.3f}, cross-validation {cross_validation(result):.3f}, "
              f"held out {result['heldout_rel_rms']:.3f}, {seconds:.0f} s", file=sys.stderr)
        if best is None or cross_validation(result) < cross_validation(best):
            best = result
    brdf = best["skill"]["plain_brdf"]["heldout_rel_rms"]
    figure(f"cloth.real.{sample}.fit_rel_rms", best["fit_rel_rms"], "1")
    figure(f"cloth.real.{sample}.heldout_rel_rms", best["heldout_rel_rms"], "1")
    fibers = best["discrepancy"]["heldout_rel_rms_without"] if best["discrepancy"] else best["heldout_rel_rms"]
    figure(f"cloth.real.{sample}.fibers_heldout_rel_rms", fibers, "1")
    figure(f"cloth.real.{sample}.heldout_worst_channel_rel_rms", max(best["heldout_channel_rel_rms"]), "1")
    figure(f"cloth.real.{sample}.brdf_heldout_rel_rms", brdf, "1")
    figure(f"cloth.real.{sample}.wall_s", round(wall_s, 1), "s")
    return best["heldout_rel_rms"], brdf


def each(names, bench):
    """Results of bench(name) for each name, and whether all gave one. A failure is printed."""
    found, whole = [], True
    for name in names:
        try:
            found.append(bench(name))
        except (Failure, OSError, subprocess.CalledProcessError) as failure:
            print(f"FAILED {name}: {failure}", file=sys.stderr)
            whole = False
    return found, whole


def bench_tables(arguments):
    tables = sorted(glob.glob(os.path.join(arguments.tables, "*.csv")))
    if not tables:
        print(f"skipped cloth.real: no tables (*.csv) in {arguments.tables}", file=sys.stderr)
    wanted = [t for t in tables if not arguments.what or os.path.splitext(os.path.basename(t))[0] in arguments.what]
    scores, whole = each(wanted, lambda table: bench_table(arguments, table))
    if scores and not arguments.what:
        figure("cloth.real.tables_below_5_percent", sum(twin < 0.05 for twin, _ in scores), "tables", "higher")
        figure("cloth.real.tables_below_brdf", sum(twin < brdf for twin, brdf in scores), "tables", "higher")
    return whole


# Recoveries: (description of the true cloth, parameters, names of the kinds of yarn). A job gets the structure, the
# counts and the names; the numbers of FITTED start at their defaults and have the bounds of the measured fabrics.
FITTED = {key: WOVEN_YARN[key] for key in ("flatness", "packing", "twist_per_m", "fiber_angle_deg")}
TEXTILE = {"C_R": "0.05,0.05,0.05", "C_TT": "0.75,0.5,0.3", "beta_R": 6, "beta_TT": 20, "gamma_TT": 20}
SECOND = {"C_R": "0.04,0.04,0.04", "C_TT": "0.25,0.4,0.7", "beta_R": 8, "beta_TT": 25, "gamma_TT": 15}


def woven(weave, numbers, kinds=1, **cloth):
    """A weave whose kinds of yarn share the numbers; with two kinds the warp is the first."""
    yarns = [dict({"fibers": 40}, **numbers[k % len(numbers)]) for k in range(kinds)]
    order = {"warp": [0], "weft": [1]} if kinds == 2 else {}
    return dict({"weave": weave, "yarns": yarns}, **order, **cloth)


# Yarns along an edge of the tile: of the photographed cloth, whose tile is as large as the crop of a photograph (1 cm), so that
# nothing repeats in it as nothing does in a real cloth; and of the job's, in the search and in the last fit. The random places
# of the cloths differ, and radiances of single tiles scatter, those of larger ones less (optimizer/fit/NOTES.md, "What limits the
# recoveries").
TRUE_YARNS, JOB_YARNS, FINAL_TILES = {"plain": 48, "twill": 48, "satin": 45}, {"plain": 16, "twill": 16, "satin": 15}, 3


def of_size(cloth, yarns):
    n = yarns[cloth["weave"]]
    return dict(cloth, tile_warps=n, tile_wefts=n)


# Photographs: those that `selvedge-phantom photograph` makes by itself, all of whose fitted ones have the camera opposite
# of the light or a quarter turn beside it, and 16 fitted ones more. By linear error propagation at the truth of "plain",
# photographs known to 0.5 % and exact renderings determine the held-out means to 0.84 % without these, which is a ratio of
# 1.8, and to 0.32 % or 1.15 with them. They were chosen one by one from 58 random places, each as the one that determines
# the means of all these places best. Angles are light_theta, camera_theta, camera_phi in degrees.
IN_PLANE = [(20, 20, 180), (45, 45, 180), (75, 75, 180), (60, 0, 180), (20, 20, 90), (45, 45, 90), (64, 64, 90), (60, 0, 90)]
OBLIQUE = {0: [(70, 0, 150), (55, 55, 45)],
           45: [(70, 70, 135), (40, 70, 90), (70, 40, 110), (40, 70, 180), (70, 40, 20), (70, 0, 90), (40, 20, 0), (25, 20, 45),
                (70, 40, 90), (25, 70, 150)],
           90: [(55, 70, 45), (55, 0, 70), (70, 40, 110), (55, 40, 165)]}
HELD_OUT = [(10, 30, 180), (30, 50, 180), (50, 70, 180), (70, 50, 180), (30, 30, 135), (60, 60, 135), (45, 20, 90), (70, 30, 90),
            (40, 40, 45), (60, 30, 20), (70, 70, 150), (0, 60, 0)]


def write_views(path):
    with open(path, "w", encoding="utf-8") as f:
        f.write("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n")
        for name, views in (("fit", {0: IN_PLANE, 90: IN_PLANE}), ("fit", OBLIQUE), ("held-out", {0: HELD_OUT, 90: HELD_OUT})):
            for rotation, angles in views.items():
                f.writelines(f"{name},{light},0,{camera},{phi},{rotation}\n" for light, camera, phi in angles)


RECOVERIES = {
    "plain": (woven("plain", [{"flatness": 2.6, "packing": 0.5, "twist_per_m": 300, "fiber_angle_deg": 8}]), [TEXTILE]),
    "plain_tight": (woven("plain", [{"flatness": 1.6, "packing": 0.7, "twist_per_m": 800, "fiber_angle_deg": 3}]), [SECOND]),
    "twill": (woven("twill", [{"flatness": 2.2, "packing": 0.55, "twist_per_m": 600, "fiber_angle_deg": 6}]), [TEXTILE]),
    "satin": (woven("satin", [{"flatness": 3.0, "packing": 0.65, "twist_per_m": 200, "fiber_angle_deg": 3}]), [SECOND]),
    "twill_two_yarns": (woven("twill", [{"flatness": 2.2, "packing": 0.6, "twist_per_m": 500, "fiber_angle_deg": 5}], 2),
                        [TEXTILE, SECOND]),
    "satin_two_yarns": (woven("satin", [{"flatness": 2.8, "packing": 0.6, "twist_per_m": 300, "fiber_angle_deg": 5}], 2),
                        [TEXTILE, SECOND]),
}


def read_json(path):
    with open(path, encoding="utf-8") as f:
        return json.load(f)


def write_json(path, value):
    with open(path, "w", encoding="utf-8") as f:
        json.dump(value, f)


def run(arguments, *command):
    subprocess.run([os.path.join(arguments.build, "bin", command[0]), *command[1:]], check=True, stdout=sys.stderr)


def make_truth(arguments, folder, cloth, sets, groups):
    """Fibers and photographs of the true cloth, whose random places are not those of the job's cloth. Those of an earlier
    run with the same commands are taken as they are: empty the folder after a change of the renderer."""
    os.makedirs(folder, exist_ok=True)
    description, recipe = os.path.join(folder, "description.json"), os.path.join(folder, "commands.json")
    make = ["selvedge-phantom", "cloth", "--description", description, "--out", folder, "--snr", "0", "--voxel-um", "40"]
    parameters = []
    for group, values in zip(groups, sets):
        for key, value in values.items():
            parameters += ["--param", f"{group + '.' if len(groups) > 1 else ''}{key}={value}"]
    photograph = ["selvedge-phantom", "photograph", "--fibers", os.path.join(folder, "truth.hair"), "--out", folder,
                  "--table", os.path.join(folder, "views.csv"), "--model", arguments.recovery_model, "--paths", "262144",
                  "--px", "32", "--noise", "0.005", "--seed", "11", "--quiet", *parameters,
                  *(["--groups", ",".join(groups)] if len(groups) > 1 else [])]
    wanted = [dict(of_size(cloth, TRUE_YARNS), seed=77), IN_PLANE, OBLIQUE, HELD_OUT, make, photograph]
    wanted = json.loads(json.dumps(wanted))
    if not os.path.exists(recipe) or read_json(recipe) != wanted:
        write_json(description, wanted[0])
        write_views(os.path.join(folder, "views.csv"))
        run(arguments, *make)
        run(arguments, *photograph)
        write_json(recipe, wanted)
    return read_json(os.path.join(folder, "photographs.json")), read_json(os.path.join(folder, "truth.json"))


def covered(result, truth_numbers, truth_parameters):
    """(covered, determined): how many determined values lie within two standard errors of the truth."""
    found = [(n, truth_numbers[n["name"].split(".")[-1]]) for n in result.get("cloth_numbers", []) if n["name"].split(".")[-1] in truth_numbers]
    found += [(p, truth_parameters[p["name"]]) for p in result["parameters"] if p["name"] in truth_parameters]
    found = [(v, t) for v, t in found if v["determined"] and not v.get("fixed")]
    for v, t in found:
        print(f"  {v['name']}: {v['value']:.4g} +- {v['standard_error']:.2g}, true {t:.4g}", file=sys.stderr)
    return sum(abs(v["value"] - t) <= 2 * v["standard_error"] for v, t in found), len(found)


def held_out_squares(result, truth):
    """For each held-out photograph the mean square over its channels, relative to its brightness: of the difference between
    the rendered and the true mean, without the noise of both, and of the photograph's own error, which is known."""
    squares = []
    for row, exact in zip(result["rows"], truth["photographs"]):
        if row["set"] != "held-out":
            continue
        brightness = sum(exact["mean_rgb"]) / 3
        own = noise = 0.0
        for rendered, se, mean, mean_se in zip(row["rendered"], row["rendered_se"], exact["mean_rgb"], exact["mean_rgb_se"]):
            own += ((rendered - mean) ** 2 - se ** 2 - mean_se ** 2) / (3 * brightness ** 2)
            noise += ((truth["noise"] * mean) ** 2 + mean_se ** 2) / (3 * brightness ** 2)
        squares.append((own, noise))
    return squares


def score(squares):
    """(ratio of the held-out error to that of the truth, own error). The ratio is what other draws of the photographs' noise
    give in the mean: the truth then has the error of the photographs, the fit that and its own."""
    own, noise = (max(0.0, sum(column)) / len(squares) for column in zip(*squares))
    return math.sqrt(1 + own / noise), math.sqrt(own)


def scores(result, truth):
    """((ratio, own error), their standard errors by leaving out one held-out photograph after the other)."""
    squares = held_out_squares(result, truth)
    n = len(squares)
    left_out = list(zip(*(score(squares[:i] + squares[i + 1:]) for i in range(n))))
    errors = [math.sqrt((n - 1) / n * sum((v - sum(values) / n) ** 2 for v in values)) for values in left_out]
    return score(squares), errors


def bench_recovery(arguments, name, cloth, sets):
    groups = ["warp", "weft"][:len(sets)]
    folder = os.path.join(arguments.keep, "truth." + name)
    photographs, truth = make_truth(arguments, folder, cloth, sets, groups)
    files = sorted(glob.glob(os.path.join(folder, "*.exr")))
    fit = {"models": [arguments.recovery_model], "render_px": 16, "render_samples": 4, "path_budget": arguments.recovery_budget,
           "precision": arguments.recovery_precision}
    named = json.loads(json.dumps(cloth))
    for yarn, group in zip(named["yarns"], groups if len(groups) > 1 else []):
        yarn["name"] = group
    searched = json.loads(json.dumps(dict(of_size(named, JOB_YARNS), seed=1000, renew_places=True, final_tiles=FINAL_TILES)))
    for yarn in searched["yarns"]:
        yarn.update(FITTED)
    document = {"sample": name, "cloth": searched, "photographs": photographs, "fit": fit}
    result, seconds = run_job(arguments.build, os.path.join(arguments.keep, "recovery." + name), document, files)
    inside, n = covered(result, cloth["yarns"][0], truth["parameter"])
    (ratio, own), (ratio_se, own_se) = scores(result, truth)
    print(f"{name}: fitted {result['fit_rel_rms']:.4f}, held out {result['heldout_rel_rms']:.4f}, own error {own:.4f} +- {own_se:.4f}, "
          f"ratio {ratio:.2f} +- {ratio_se:.2f}, {inside} of {n} within two standard errors, "
          f"{'converged' if result['converged'] else 'not converged'}, {seconds:.0f} s", file=sys.stderr)
    figure(f"cloth.recovery.{name}.ratio", round(ratio, 3), "1")
    figure(f"cloth.recovery.{name}.ratio_se", round(ratio_se, 3), "1")
    figure(f"cloth.recovery.{name}.own_rel_rms", round(own, 4), "1")
    figure(f"cloth.recovery.{name}.determined", n, "values", "higher")
    if n > 0:
        figure(f"cloth.recovery.{name}.covered", round(inside / n, 3), "1", "higher")
    return inside, n


def bench_recoveries(arguments):
    wanted = [name for name in RECOVERIES if not arguments.what or name in arguments.what]
    counts, whole = each(wanted, lambda name: bench_recovery(arguments, name, *RECOVERIES[name]))
    n = sum(n for _, n in counts)
    if n > 0 and not arguments.what:
        figure("cloth.recovery.covered", round(sum(c for c, _ in counts) / n, 3), "1", "higher")
    return whole


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    parser.add_argument("--keep", help="folder of the jobs (default: bench-cloth in the build folder)")
    parser.add_argument("--tables", default=os.path.join(DATA, "measured-reflectance-dense"))
    parser.add_argument("--models", default="textile.v3", help="scattering models, separated by commas; several: the worker chooses by cross-validation")
    parser.add_argument("--path-budget", type=int, default=6000000, help="paths of each start")
    parser.add_argument("--starts", type=int, default=1, help="searches of each job of a table, of which cross-validation keeps one")
    parser.add_argument("--plain-prior", type=float, default=1, help="fit.plain_prior of the tables' jobs")
    parser.add_argument("--discrepancy", action=argparse.BooleanOptionalAction, default=True, help="fit.discrepancy of the tables' jobs")
    parser.add_argument("--recovery-budget", type=int, default=72000000, help="most paths of a recovery")
    parser.add_argument("--recovery-precision", type=float, default=1, help="fit.precision of the recoveries, which ends them")
    parser.add_argument("--recovery-model", default="textile.v3", help="model of the recoveries")
    parser.add_argument("what", nargs="*", help="tables or recoveries")
    arguments = parser.parse_args()
    arguments.build = os.path.abspath(arguments.build)
    arguments.keep = os.path.abspath(arguments.keep or os.path.join(arguments.build, "bench-cloth"))
    whole = bench_tables(arguments)
    return 0 if bench_recoveries(arguments) and whole else 1


if __name__ == "__main__":
    sys.exit(main())
