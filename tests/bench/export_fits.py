"""The twelve fits of bench_exports.py, and the folders that they are made in. Narrow bounds end a fit at chosen parameters, whatever its rows are,
so that ten described cloths and a scan have lobes of known shapes. The twelfth is the job of `make demo-camera`, fitted freely to raw files of a
simulated camera."""
import json
import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
# light theta, light phi, camera theta, camera phi, rotation of the cloth, in degrees
ROWS = [(30, 0, 0, 0, 0), (30, 180, 30, 0, 0), (45, 180, 45, 0, 0), (60, 180, 45, 0, 0), (45, 90, 45, 0, 0), (60, 90, 30, 0, 0), (20, 0, 60, 0, 0),
        (60, 0, 60, 180, 90), (45, 0, 45, 180, 90)]
FIT = {"path_budget": 1000000, "render_px": 16, "render_samples": 4, "seed": 5}
BOUND = 0.02  # half the width of the bounds over the value
# C_R, C_TT (red, green, blue), beta_R, beta_TT, gamma_TT in degrees; inside the bounds of both models
MIDDLE = (0.05, (0.6, 0.6, 0.6), 8, 20, 30)
NARROW = (0.04, (0.7, 0.55, 0.35), 3, 11, 10)
BROAD = (0.06, (0.5, 0.4, 0.3), 9.5, 40, 42)
DARK = (0.03, (0.06, 0.04, 0.03), 6, 15, 25)
BRIGHT = (0.06, (0.95, 0.93, 0.88), 8, 20, 30)
TEXTILE = {"w": 0.3, "s": 0.5, "f": 0.94, "h": 0.5}
SCAN = "scan"
CAMERA = "camera"
# name: weave, model, lobes of each kind of yarn
FITS = {
    "plain": ("plain", "textile.v3", [MIDDLE]),
    "twill": ("twill", "two_lobe.v1", [MIDDLE]),
    "narrow_textile": ("satin", "textile.v3", [NARROW]),
    "narrow_two_lobe": ("twill", "two_lobe.v1", [NARROW]),
    "broad_textile": ("basket", "textile.v3", [BROAD]),
    "broad_two_lobe": ("plain", "two_lobe.v1", [BROAD]),
    "dark_textile": ("twill", "textile.v3", [DARK]),
    "bright_two_lobe": ("satin", "two_lobe.v1", [BRIGHT]),
    "yarns_textile": ("twill", "textile.v3", [BRIGHT, DARK]),
    "yarns_two_lobe": ("plain", "two_lobe.v1", [NARROW, BROAD]),
    SCAN: (SCAN, "textile.v3", [MIDDLE]),
    CAMERA: (CAMERA, "two_lobe.v1", []),
}
KINDS = ["warp", "weft"]


def bounds_of(model, lobes, prefix):
    """Bounds by name of a parameter, and starts in their middle."""
    c_r, c_tt, *widths = lobes
    values = {"C_R": c_r, **{f"C_TT.{c}": v for c, v in zip("rgb", c_tt)}, **dict(zip(("beta_R", "beta_TT", "gamma_TT"), widths)),
              **(TEXTILE if model == "textile.v3" else {})}
    return ({prefix + k: [v * (1 - BOUND), v * (1 + BOUND)] for k, v in values.items()}, {prefix + k: v for k, v in values.items()})


def document_of(name, formats):
    weave, model, kinds = FITS[name]
    fit = dict(FIT, model=model, bounds={}, start={})
    for lobes, kind in zip(kinds, KINDS):
        bounds, start = bounds_of(model, lobes, f"{kind}." if len(kinds) > 1 else "")
        fit["bounds"].update(bounds)
        fit["start"].update(start)
    job = {"sample": f"export of {name}", "measurements": {"file": "rows.csv"}, "fit": fit, "export": {form: True for form in formats}}
    if weave == SCAN:
        return {**job, "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}}
    cloth = {"weave": weave, "seed": 3}
    if len(kinds) > 1:
        cloth.update({"warp": [0], "weft": [1], "yarns": [{"name": kind} for kind in KINDS]})
    return {**job, "cloth": cloth}


def make_input(build, folder, name, radiances):
    """folder/input: the rows with these radiances, and the scan."""
    made = os.path.join(folder, "input")
    os.makedirs(made, exist_ok=True)
    with open(os.path.join(made, "rows.csv"), "w", encoding="utf-8") as f:
        f.write("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n")
        for row, rgb in zip(ROWS, radiances):
            f.write(",".join(map(str, ("fit", *row, *rgb))) + "\n")
    if name == SCAN and not os.path.exists(os.path.join(made, "scan.tif")):
        phantom = os.path.join(folder, "phantom")
        subprocess.run([os.path.join(build, "bin", "selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", phantom],
                       check=True, stdout=sys.stderr)
        os.rename(os.path.join(phantom, "scan.tif"), os.path.join(made, "scan.tif"))


def run_job(build, folder, document):
    """The job's rows of result.json."""
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", folder], check=True, stdout=sys.stderr)
    with open(os.path.join(folder, "results", "result.json"), encoding="utf-8") as f:
        return json.load(f)["rows"]


def run_described(build, folder, name, formats):
    """A first job renders the rows, and the second one takes these radiances for measured ones: renderings are as exact as measured brightness asks."""
    document = document_of(name, formats)
    results, kept = os.path.join(folder, "results"), os.path.join(folder, "job.json")
    if os.path.exists(os.path.join(results, "result.json")):
        with open(kept, encoding="utf-8") as f:
            if {**json.load(f), "export": None} == {**document, "export": None}:
                return results
    for part in ("input", "work", "results", "job.json", "status.json", "series.rec"):  # comparisons stay: they know what they compared
        path = os.path.join(folder, part)
        if os.path.isdir(path):
            shutil.rmtree(path)
        elif os.path.exists(path):
            os.remove(path)
    make_input(build, folder, name, [(0.2, 0.15, 0.1)] * len(ROWS))
    rows = run_job(build, folder, {k: v for k, v in document.items() if k != "export"})
    shutil.rmtree(results)
    make_input(build, folder, name, [row["rendered"] for row in rows])
    run_job(build, folder, document)
    return results


def run_camera(build, folder):
    """The results of `make demo-camera`, which is not run again where it has finished."""
    results = os.path.join(folder, "results")
    if not os.path.exists(os.path.join(results, "result.json")):
        subprocess.run([os.path.join(ROOT, "clients", "demo.sh"), "--camera"], check=True, stdout=sys.stderr, stdin=subprocess.DEVNULL,
                       env={**os.environ, "DEMO_DIR": folder, "SELVEDGE_BUILD": os.path.abspath(build)})
    return results


def run_fit(build, folder, name, formats):
    """The folder of the results of a fit with its exports. What an earlier run has finished is kept."""
    results = run_camera(build, folder) if name == CAMERA else run_described(build, folder, name, formats)
    missing = [form for form in formats if not os.path.exists(os.path.join(results, "export", form, "conversion.json"))]
    if missing:
        subprocess.run([os.path.join(build, "bin", "selvedge"), "export", results, "--to", ",".join(missing)], check=True, stdout=sys.stderr)
    return results
