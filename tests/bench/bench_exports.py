"""How near a scene that a job exports comes to the job's own renderings, when another program renders it: two described cloths with two models,
every row rendered by Mitsuba 3 (mitsuba_row.py says what it makes of the other formats), and by Blender, where it is installed, the scene for it.
Figures are relative RMS errors over the rows, in the same
measure as those of fits."""
import argparse
import csv
import json
import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
# light theta, light phi, camera theta, camera phi, rotation of the cloth, in degrees
ROWS = [(30, 0, 0, 0, 0), (30, 180, 30, 0, 0), (45, 180, 45, 0, 0), (60, 180, 45, 0, 0), (45, 90, 45, 0, 0), (60, 90, 30, 0, 0), (20, 0, 60, 0, 0),
        (60, 0, 60, 180, 90), (45, 0, 45, 180, 90)]
FIT = {"path_budget": 100000, "render_px": 16, "render_samples": 4, "seed": 5}
FORMATS = ["mitsuba", "pbrt", "usd", "textures", "blender"]
# Narrow bounds: the fit ends at these parameters, whatever the rows are.
TWO_LOBE = {"C_R": [0.045, 0.055], "C_TT": [0.55, 0.65], "beta_R": [7.5, 8.5], "beta_TT": [19, 21], "gamma_TT": [29, 31]}
TEXTILE = dict(TWO_LOBE, w=[0.28, 0.32], s=[0.48, 0.52], f=[0.93, 0.95], h=[0.48, 0.52])
# The default model has no name of its own in the figures.
JOBS = {".two_lobe": ("twill", dict(FIT, model="two_lobe.v1", bounds=TWO_LOBE, start={k: sum(v) / 2 for k, v in TWO_LOBE.items()})),
        "": ("plain", dict(FIT, model="textile.v3", bounds=TEXTILE, start={k: sum(v) / 2 for k, v in TEXTILE.items()}))}


def run_job(build, folder, weave, fit):
    """The folder of the exported scenes, and result.json."""
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(os.path.join(folder, "input"))
    with open(os.path.join(folder, "input", "rows.csv"), "w", encoding="utf-8") as f:
        f.write("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n")
        for row in ROWS:
            f.write(",".join(map(str, ("fit", *row, 0.2, 0.15, 0.1))) + "\n")
    document = {"sample": "export", "cloth": {"weave": weave, "seed": 3}, "measurements": {"file": "rows.csv"}, "fit": fit,
                "export": {name: True for name in FORMATS}}
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True, stdout=sys.stderr)
    with open(os.path.join(folder, "results", "result.json"), encoding="utf-8") as f:
        return os.path.join(folder, "results", "export"), json.load(f)


def rendered_by_mitsuba(python, form, folder, row, px, spp):
    """Mean radiance of a row, or None when Mitsuba fails."""
    command = [python, os.path.join(ROOT, "tests", "bench", "mitsuba_row.py"), form, folder, str(row), str(px), str(spp)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=sys.stderr, check=False)
    return json.loads(done.stdout) if done.returncode == 0 else None


def rendered_by_blender(folder, row, px, spp):
    """The same, by the exported script in Blender."""
    picture = os.path.join(folder, f"row-{row}.exr")
    reader = os.path.join(ROOT, "tests", "support", "python", "blender_scene.py")
    command = ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", os.path.join(folder, "cloth.py"), "--python", reader,
               "--", picture, str(spp), str(px), str(row)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=sys.stderr, text=True, check=False)
    found = [line for line in done.stdout.split("\n") if line.startswith("found ")]
    return json.loads(found[0][6:])["mean"] if done.returncode == 0 and found else None


def compare(python, form, folder, px=16, spp=64):
    """Relative RMS error over the rows, as in fits: squares over the square of a row's mean over its channels. And rows that were rendered."""
    with open(os.path.join(os.path.dirname(folder), "mitsuba", "rows.csv"), encoding="utf-8") as f:
        rows = list(csv.DictReader(f))
    square, n = 0.0, 0
    for i, row in enumerate(rows):
        ours = [float(row["rendered_" + c]) for c in "rgb"]
        blender = form == "blender"
        theirs = rendered_by_blender(folder, i, px, spp) if blender else rendered_by_mitsuba(python, form, folder, i, px, spp)
        if theirs is None:
            print(f"{form}, row {i}: the renderer failed", file=sys.stderr)
            continue
        print(f"{form}, row {i}: rendered {ours}, by the other program {theirs}", file=sys.stderr)
        square += sum((a - b) ** 2 for a, b in zip(ours, theirs)) / max(sum(ours) / 3, 0.02) ** 2 / 3
        n += 1
    return (square / n) ** 0.5 if n > 0 else float("nan"), n, len(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--python", required=True, help="a Python that has mitsuba")
    parser.add_argument("--formats", default=",".join(FORMATS))
    arguments = parser.parse_args()
    whole = True
    for name, (weave, fit) in JOBS.items():
        folder, result = run_job(arguments.build, os.path.join(arguments.build, "bench-exports", weave), weave, fit)
        for export in result["exports"]:
            form = export["format"]
            if form not in arguments.formats.split(","):
                continue
            if form == "blender" and shutil.which("blender") is None:
                print("no figures of blender, because there is none (Debian package blender)", file=sys.stderr)
                continue
            material = export["materials"][0]
            stated = export.get("row_rel_rms", material.get("rel_rms"))
            exact = 0.0 if os.path.exists(os.path.join(folder, form, "exact.xml")) else None
            for seen, rel_rms in ((form, stated), ("mitsuba_plugin", exact), ("usd_preview", material.get("preview_surface", {}).get("rel_rms"))):
                if rel_rms is None:
                    continue
                error, n, n_row = compare(arguments.python, seen, os.path.join(folder, form))
                whole = whole and n == n_row
                for key, value in (("rel_rms", error), ("stated", rel_rms)):
                    print(json.dumps({"name": f"exports.{seen}{name}.{key}", "value": value, "unit": "1", "better": "lower"}), flush=True)
    sys.exit(0 if whole else 1)


if __name__ == "__main__":
    main()
