"""How near a scene that a job exports comes to the job's own renderings, when another program renders it: the twelve fits of export_fits.py, every
row of the fit rendered by Mitsuba 3 (mitsuba_row.py says what it makes of the other formats), the scene for Blender by Blender and the glTF files
by three.js (gltf_rows.py), where these are installed. Figures are relative RMS errors over the rows, in the measure of fits, beside the error that
the job states for the same rows.

What is finished is kept in the folder of each fit: the job, its exports and compared.json. A second run goes on from there, and compares anew only
what was exported anew. --only and --formats take a part."""
import argparse
import csv
import glob
import hashlib
import json
import os
import shutil
import subprocess
import sys

import export_fits

ROOT = export_fits.ROOT
# name in the figures: format of the job
SEEN = {"mitsuba": "mitsuba", "mitsuba_plugin": "mitsuba", "pbrt": "pbrt", "usd": "usd", "blender": "blender", "textures": "textures", "gltf": "gltf"}
# what a comparison depends on; without an entry conversion.json
SCENE_OF = {"mitsuba": "scene.xml", "mitsuba_plugin": "exact.xml", "pbrt": "cloth.pbrt", "usd": "cloth.usda", "blender": "scene.json"}
VIEWS_OF = {"textures": "pbrt"}  # an export without rows.csv is seen in the views of another one
LEAST_LLVM = 15  # Mitsuba renders the plug-ins in minutes without one, in seconds with it
PX, SPP = 16, 64
SPP_OF = {"mitsuba_plugin": 256}  # whose error is small, and whose time is that of its compilation


def llvm_library():
    """The newest LLVM of this machine, or None."""
    found = {}
    for path in glob.glob("/usr/lib/*/libLLVM*"):
        digits = os.path.basename(path).replace("libLLVM", "").strip("-.so").split(".so")[0].split(".")[0]
        if digits.isdigit() and int(digits) >= LEAST_LLVM:
            found[int(digits)] = path
    return found[max(found)] if found else None


def by_mitsuba(python, seen, folder, rows):
    """Mean radiances of rows by their numbers. Mitsuba may end its process on an error: the rows after it are rendered by another one."""
    environment = {k: v for k, v in os.environ.items() if k != "DRJIT_LIBLLVM_PATH"}
    library = os.environ.get("DRJIT_LIBLLVM_PATH") or llvm_library()
    if seen == "mitsuba_plugin" and library:
        environment["DRJIT_LIBLLVM_PATH"] = library
    found, rest = {}, list(rows)
    while rest:
        command = [python, os.path.join(ROOT, "tests", "bench", "mitsuba_row.py"), seen, folder, ",".join(map(str, rest)), str(PX), str(SPP_OF.get(seen, SPP))]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=sys.stderr, text=True, env=environment, check=False)
        lines = done.stdout.splitlines()
        found.update(zip(rest, map(json.loads, lines)))
        rest = rest[len(lines) + 1:]
    return found


def by_blender(folder, rows):
    """The same, by the exported script in Blender."""
    reader = os.path.join(ROOT, "tests", "support", "python", "blender_scene.py")
    found = {}
    for row in rows:
        command = ["blender", "-b", "--factory-startup", "--python-exit-code", "1", "--python", os.path.join(folder, "cloth.py"), "--python", reader,
                   "--", os.path.join(folder, f"row-{row}.exr"), str(SPP), str(PX), str(row)]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=sys.stderr, text=True, check=False)
        lines = [line for line in done.stdout.split("\n") if line.startswith("found ")]
        if done.returncode == 0 and lines:
            found[row] = json.loads(lines[0][6:])["mean"]
    return found


def by_three(packages, folder, rows):
    """The same, by three.js in Chromium."""
    command = ["/usr/bin/python3", os.path.join(ROOT, "tests", "bench", "gltf_rows.py"), folder, packages]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=sys.stderr, text=True, check=False)
    found = json.loads(done.stdout) if done.returncode == 0 else []
    return {row: found[row] for row in rows if row < len(found)}


def stated_error(conversion, seen, rows):
    """Over these rows where the job states an error for each; else over all of them."""
    errors = conversion.get("row_rel_errors")
    if seen == "mitsuba_plugin":
        return 0.0
    if errors and len(errors) > len(rows):
        return (sum(errors[row] ** 2 for row in rows) / len(rows)) ** 0.5
    return conversion.get("row_rel_rms", conversion["materials"][0].get("rel_rms"))


def read_rows(folder):
    """Radiances that the job rendered, by the number of a row of the fit."""
    with open(os.path.join(folder, "rows.csv"), encoding="utf-8") as f:
        return {i: [float(row["rendered_" + c]) for c in "rgb"] for i, row in enumerate(csv.DictReader(f)) if row["set"] == "fit"}


def compare(arguments, exports, seen):
    """rel_rms, as in fits: squares over the square of a row's mean over its channels; and rows that the renderer did not finish."""
    folder = os.path.join(exports, SEEN[seen])
    ours = read_rows(os.path.join(exports, VIEWS_OF.get(seen, SEEN[seen])))
    others = {"blender": lambda: by_blender(folder, ours), "gltf": lambda: by_three(os.path.join(arguments.build, "exports-node"), folder, ours)}
    theirs = others.get(seen, lambda: by_mitsuba(arguments.python, seen, folder, ours))()
    for row, rgb in ours.items():
        print(f"{seen}, row {row}: rendered {rgb}, by the other program {theirs.get(row)}", file=sys.stderr)
    square = sum(sum((a - b) ** 2 for a, b in zip(ours[row], rgb)) / max(sum(ours[row]) / 3, 0.02) ** 2 / 3 for row, rgb in theirs.items())
    return {"rel_rms": (square / len(theirs)) ** 0.5 if theirs else None, "failed": [r for r in ours if r not in theirs],
            "rows": {row: [rgb, theirs.get(row)] for row, rgb in ours.items()}}


def kept_comparisons(path):
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as f:
        return json.load(f)


def digest(exports, seen):
    """Of the files that a comparison depends on: the job's renderings, and the scene or the materials."""
    sha = hashlib.sha256()
    for name in (os.path.join(VIEWS_OF.get(seen, SEEN[seen]), "rows.csv"), os.path.join(SEEN[seen], SCENE_OF.get(seen, "conversion.json"))):
        with open(os.path.join(exports, name), "rb") as f:
            sha.update(f.read())
    return sha.hexdigest()


def compare_fit(arguments, folder, results, wanted):
    """compared.json of the folder, with what was wanted and missing or older than its export."""
    path, exports = os.path.join(folder, "compared.json"), os.path.join(results, "export")
    kept = kept_comparisons(path)
    for seen in wanted:
        if seen == "mitsuba_plugin" and not os.path.exists(os.path.join(exports, "mitsuba", "exact.xml")):
            continue
        compared = digest(exports, seen)
        if kept.get(seen, {}).get("of") == compared:
            continue
        kept[seen] = {"of": compared, **compare(arguments, exports, seen)}
        with open(path + ".new", "w", encoding="utf-8") as f:
            json.dump(kept, f)
        os.replace(path + ".new", path)
    found = {seen: kept[seen] for seen in wanted if seen in kept}
    for seen, comparison in found.items():
        with open(os.path.join(exports, SEEN[seen], "conversion.json"), encoding="utf-8") as f:
            comparison["stated"] = stated_error(json.load(f), seen, [int(row) for row in comparison["rows"]])
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build")
    parser.add_argument("--python", required=True, help="a Python that has mitsuba")
    parser.add_argument("--only", default=",".join(export_fits.FITS), metavar="FIT[,FIT...]")
    parser.add_argument("--formats", default=",".join(SEEN))
    arguments = parser.parse_args()
    wanted = arguments.formats.split(",")
    unknown = [x for x in arguments.only.split(",") if x not in export_fits.FITS] + [x for x in wanted if x not in SEEN]
    if unknown:
        parser.error(f"no such fit or format: {', '.join(unknown)} (fits: {', '.join(export_fits.FITS)}; formats: {', '.join(SEEN)})")
    if "blender" in wanted and shutil.which("blender") is None:
        print("no figures of blender, because there is none (Debian package blender)", file=sys.stderr)
        wanted.remove("blender")
    whole = True
    for name in arguments.only.split(","):
        folder = os.path.join(arguments.build, "bench-exports", name)
        formats = list(dict.fromkeys(form for seen in wanted for form in (VIEWS_OF.get(seen, SEEN[seen]), SEEN[seen])))
        results = export_fits.run_fit(arguments.build, folder, name, formats)
        for seen, found in compare_fit(arguments, folder, results, wanted).items():
            whole = whole and not found["failed"]
            for key in ("rel_rms", "stated"):
                if found[key] is not None:
                    print(json.dumps({"name": f"exports.{name}.{seen}.{key}", "value": found[key], "unit": "1", "better": "lower"}), flush=True)
    sys.exit(0 if whole else 1)


if __name__ == "__main__":
    main()
