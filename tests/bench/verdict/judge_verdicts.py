"""Is the verdict on a scan about the cloth? Makes small scans (verdict_scans.py, selvedge-phantom), reconstructs them with
bench_verdict, and prints figures, one JSON object a line; the rows go to standard error.

    judge_verdicts.py [--build DIR] [--unseen DIR] [--drawn FIRST LAST] [--lumens] [NAME ...]

NAME: a scan of verdict_scans.py, of the product, of --unseen, or drawn-N, broad-N or hollow-N of drawn_scans.py; default: all but the
drawn ones.
--drawn: only those (and NAME), for limits that were chosen on the named scans; with --lumens also the hollow ones.
--broad: the scans broad-FIRST to broad-LAST as well, blends of kinds of fibers.
--lumens: only whether the fibers look hollow, in a tenth of the time.

geometry.verdict.false_good        scans called good with a recall below 0.9, a precision below 0.93 or above 1.5 fragments
geometry.verdict.good_called_bad   scans without these faults whose score says that the lines do not describe the cloth
geometry.verdict.rank_correlation  of the score with the smaller of recall and precision (Spearman)
geometry.{noise,sponge}.wall_s     time until a scan without fibers ends; noise is refused, which is no error
geometry.false_lumens              share of the solid scans that are called hollow or maybe hollow
geometry.hollow_power              share of the scans of hollow fibers that are called hollow
geometry.pull.position             error of the axes over the stated error, robust; median over the scans
geometry.pull.radius               the same of the radius of fibers
geometry.pull.point_radius         share of the vertices whose radius is within two stated errors; median over the scans
geometry.pull.*.worst              the scan with the largest pull, or the smallest share; its name is in "scan"
With --drawn or --broad the names begin with geometry.drawn.
Scans with a truth in other units than the product's text of fibers (--unseen) are converted.
"""
import argparse
import json
import os
import subprocess
import sys

import numpy as np

import drawn_scans
import verdict_scans

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..")
PRODUCT = {"product-knit": ["knit"], "product-plain": ["plain"], "product-twill": ["twill"], "product-velvet": ["velvet"], "product-felt": ["felt"],
           "product-plain-noisy": ["plain", "--snr", "2"], "product-knit-noisy": ["knit", "--snr", "2"], "product-felt-flat": ["felt", "--aspect", "2.5"],
           "product-twill-d4": ["twill", "--diameter-voxel", "4"], "product-plain-d4-noisy": ["plain", "--diameter-voxel", "4", "--snr", "2"],
           "product-knit-hollow": ["knit", "--lumen", "0.4"], "product-velvet-hollow": ["velvet", "--lumen", "0.4"]}


def make_product(build, folder, name):
    """A phantom of the product, of 7 fibers a yarn; returns its scan."""
    path = os.path.join(folder, name)
    n_fiber = "40" if "felt" in name else "7"
    command = [os.path.join(build, "bin", "selvedge-phantom"), "cloth", "--weave", *PRODUCT[name], "--fibers-per-yarn", n_fiber, "--out", path]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    os.replace(os.path.join(path, "scan.tif"), path + ".tif")
    os.replace(os.path.join(path, "truth.txt"), path + ".txt")
    return path + ".tif"


def take_unseen(source, folder, name):
    """Copies a scan whose truth has voxel centers at whole numbers; returns its copy."""
    path, voxel_mm, lines, radius = os.path.join(folder, name), 2.2e-3, [], "0"
    with open(os.path.join(source, name + ".tif"), "rb") as f, open(path + ".tif", "wb") as to:
        to.write(f.read())
    truth = os.path.join(source, name + ".truth.txt")
    if not os.path.exists(truth):
        return path + ".tif"
    with open(truth, encoding="utf-8") as f:
        for line in f:
            if line.startswith("fiber"):
                lines.append("")
                radius = line.split()[3]
            elif line.strip() and not line.startswith("#"):
                lines.append(" ".join("%.6f" % x for x in [*((float(x) + 0.5) * voxel_mm for x in line.split()), float(radius) * voxel_mm]))
    with open(path + ".txt", "w", encoding="utf-8") as f:
        f.write("\n".join(lines).strip() + "\n")
    return path + ".tif"


def rank(values):
    values = np.asarray(values, float)
    order = np.empty(len(values))
    order[np.argsort(values, kind="stable")] = np.arange(len(values))
    for v in np.unique(values):
        order[values == v] = order[values == v].mean()
    return order


def figure(name, value, unit, better="lower", **more):
    print(json.dumps({"name": "geometry." + name, "value": value, "unit": unit, "better": better, **more}), flush=True)


def judge_pulls(rows, of):
    """Prints the errors over the stated ones of scans in which lines were matched."""
    for name, key, unit, worst, better in (("position", "robust", "stated errors", max, "lower"), ("radius", "robust", "stated errors", max, "lower"),
                                           ("point_radius", "covered", "1", min, "higher")):
        pulls = [(r[name + "_pull"][key], r["name"]) for r in rows if r[name + "_pull"]["rms"] > 0]
        if not pulls:
            continue
        figure(of + "pull." + name, round(float(np.median([p for p, _ in pulls])), 3), unit, better)
        value, scan = worst(pulls)
        figure(of + "pull." + name + ".worst", value, unit, better, scan=scan)


def judge(rows, of):
    """Prints the figures of the rows that could be reconstructed; errors are counted."""
    for r in rows:
        if r["name"] in ("noise.mhd", "sponge.mhd"):
            figure(r["name"][:-4] + ".wall_s", r["wall_s"], "s")
    figure(of + "verdict.errors", sum("error" in r and "nothing but noise" not in r["error"] for r in rows), "scans")
    rows = [r for r in rows if "error" not in r]
    truth = [min(r["recall"], r["precision"]) for r in rows]
    right = [r["recall"] >= 0.9 and r["precision"] >= 0.93 and r["fragments"] <= 1.5 for r in rows]
    figure(of + "verdict.scans", len(rows), "scans", "higher")
    figure(of + "verdict.false_good", sum(r["is_good"] and not ok for r, ok in zip(rows, right)), "scans")
    figure(of + "verdict.good_called_bad", sum(ok and (r["score"] < 0.5 or r["verdict"] == "unresolved") for r, ok in zip(rows, right)), "scans")
    figure(of + "verdict.rank_correlation", round(float(np.corrcoef(rank(truth), rank([r["score"] for r in rows]))[0, 1]), 4), "1", "higher")
    judge_lumens(rows, of)
    judge_pulls(rows, of)


def judge_lumens(rows, of):
    """Prints the shares of solid scans that are called hollow or maybe hollow, and of hollow ones that are called hollow."""
    hollow = [r["lumens"] == "filled" for r in rows if "hollow" in r["name"]]
    solid = [r["lumens"] in ("filled", "possible") for r in rows if "hollow" not in r["name"]]
    if solid:
        figure(of + "false_lumens", round(sum(solid) / len(solid), 4), "1")
    if hollow:
        figure(of + "hollow_power", round(sum(hollow) / len(hollow), 4), "1", "higher")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=os.path.join(ROOT, "build"))
    parser.add_argument("--unseen", default=os.path.join(ROOT, "..", "shared", "data", "unseen-scans"))
    parser.add_argument("--drawn", type=int, nargs=2)
    parser.add_argument("--broad", type=int, nargs=2)
    parser.add_argument("--lumens", action="store_true")
    parser.add_argument("name", nargs="*")
    arguments = parser.parse_args()
    folder = os.path.join(arguments.build, "bench-verdict")
    os.makedirs(folder, exist_ok=True)
    unseen = sorted(f[:-4] for f in os.listdir(arguments.unseen) if f.endswith(".tif")) if os.path.isdir(arguments.unseen) else []
    rows = []
    numbers = range(arguments.drawn[0], arguments.drawn[1] + 1) if arguments.drawn else []
    drawn = [kind + "-%d" % i for i in numbers for kind in (["drawn", "hollow"] if arguments.lumens else ["drawn"])]
    drawn += ["broad-%d" % i for i in range(arguments.broad[0], arguments.broad[1] + 1)] if arguments.broad else []
    named = [*verdict_scans.SCANS, *PRODUCT, *unseen] if not drawn else []
    for name in (arguments.name or named) + drawn:
        if name in PRODUCT:
            path = make_product(arguments.build, folder, name)
        elif name in unseen:
            path = take_unseen(arguments.unseen, folder, name)
        elif name.startswith(("drawn-", "hollow-", "broad-")):
            kind, number = name.split("-")
            verdict_scans.make(name, getattr(drawn_scans, kind)(int(number), verdict_scans.DEFAULT), folder)
            path = os.path.join(folder, name + ".mhd")
        else:
            verdict_scans.make(name, {**verdict_scans.DEFAULT, **verdict_scans.SCANS[name]}, folder)
            path = os.path.join(folder, name + ".mhd")
        program = os.path.join(arguments.build, "tests", "bench", "verdict", "bench_verdict")
        command = [program, *(["--lumens"] if arguments.lumens else []), "2.2" if name in unseen else "2", path]
        made = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        print(made.stdout, end="", file=sys.stderr, flush=True)
        rows.append(json.loads(made.stdout.replace("nan", "0")))
    of = "drawn." if drawn else ""
    if arguments.lumens:
        judge_lumens([r for r in rows if "error" not in r], of)
    else:
        judge(rows, of)


if __name__ == "__main__":
    main()
