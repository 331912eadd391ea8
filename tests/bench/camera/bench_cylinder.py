"""Does one photograph of a cloth on a cylinder, or two, determine the fibers as 16 photographs of flat cloth do? Prints figures cylinder_input.*.

    bench_cylinder.py [--build DIR] [--keep DIR] [--seeds N] [--quick]

A twill of known fibers (two_lobe.v1) is rendered flat in the 16 configurations that are usual, and on a cylinder of radius 15 mm in two
(figure 5.22 of the fabric thesis has such photographs). Both are taken by simulated cameras (selvedge-phantom camera), one for each seed: raw
files of three exposures with noise, a lens that darkens and distorts, a chart, markers around the sample. Jobs fit the nine parameters to the
flat photographs and to the columns of the cylinders; the worker finds the outline of each cylinder in its picture. All cameras see the same
renderings, and each has its own noise, of the camera and of the fit.

Finished steps are kept in the folder: an interrupted run goes on, and fits of another program are made anew. Progress is on standard error.

cylinder_input.flat_error, .error, .error_of_one: root mean square over the nine parameters and the cameras of the relative difference between
fitted and true values; from 16 flat photographs, from two of a cylinder, and from the first of them alone.
cylinder_input.ratio, .ratio_of_one: the errors of the second and third over the first.
cylinder_input.ratio_spread: standard deviation over the cameras of the ratio of one camera.
cylinder_input.z_rms, .flat_z_rms, .z_rms_of_one: root mean square of the differences over their stated errors.
cylinder_input.column_error: root mean square relative difference of the columns' radiances from renderings of flat cloth at their angles and
at the true parameters, which holds the bend of the cloth, its texture, all errors of the chain and the noise of those renderings; .column_z: the
same over the errors of both.
"""
import argparse
import hashlib
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import time

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
TRUTH = {"C_R": [0.06, 0.05, 0.08], "C_TT": [0.72, 0.55, 0.35], "beta_R": 4, "beta_TT": 20, "gamma_TT": 18}
RADIUS_MM, LENGTH_MM, STEP_DEG, LIMIT_DEG, WIDTH_MM, SAMPLES = 15, 10, 6, 80, 34, 256
PATHS = 12000000  # of a fit: with 3 million the noise of its renderings is most of the error
# lamp theta and phi, turn of the cloth; the camera is above, the axis upright in its picture. These two determine the parameters best by
# linear propagation of errors (optimizer/photographs/NOTES.md): a highlight's profile, and crossed planes with forward scattering
CYLINDERS = [(10, 30, 90), (70, 60, 0)]


def run(arguments, name, *command):
    subprocess.run([os.path.join(ROOT, arguments.build, "bin", name), *map(str, command)], check=True, stdout=subprocess.DEVNULL)


def load(*path):
    with open(os.path.join(*path), encoding="utf-8") as f:
        return json.load(f)


def dump(value, *path):
    with open(os.path.join(*path), "w", encoding="utf-8") as f:
        json.dump(value, f, indent=1)


def write_cylinder(path, turn_deg, cells=240):
    """A cylinder as renderer/mesh has it, over 240 degrees, with the cloth turned on it about its normal."""
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    lines, half = [], 0.5 * 36
    for i in range(cells + 1):
        a = math.radians(240) * (i / cells - 0.5)
        for y in (-half, half):
            lines.append(f"v {RADIUS_MM * math.sin(a)} {y} {RADIUS_MM * (math.cos(a) - 1)}")
            lines.append(f"vt {c * RADIUS_MM * a + s * y} {-s * RADIUS_MM * a + c * y}")
    for i in range(cells):
        a, b, d, e = 2 * i + 1, 2 * i + 3, 2 * i + 4, 2 * i + 2
        lines.append(f"f {a}/{a} {b}/{b} {d}/{d}")
        lines.append(f"f {a}/{a} {d}/{d} {e}/{e}")
    with open(path, "w", encoding="utf-8") as f:
        f.write("\n".join(lines) + "\n")


class Kept:
    """Steps that are finished: NAME.done in the folder holds what they depend on and what they gave."""

    def __init__(self, folder):
        self.folder, self.start = folder, time.monotonic()
        os.makedirs(folder, exist_ok=True)

    def step(self, name, key, make):
        path, key = os.path.join(self.folder, f"{name}.done"), json.loads(json.dumps(key))
        if os.path.exists(path):
            there = load(path)
            if there["key"] == key:
                print(f"[{time.monotonic() - self.start:5.0f} s] {name}: kept", file=sys.stderr, flush=True)
                return there["value"]
            os.remove(path)
        value = make()
        dump({"key": key, "value": value}, f"{path}.new")
        os.replace(f"{path}.new", path)
        print(f"[{time.monotonic() - self.start:5.0f} s] {name}: made", file=sys.stderr, flush=True)
        return value


def render_cylinder(arguments, folder, hair, i):
    """roll-i.exr of a job that renders the cloth on cylinder i."""
    theta, phi, turn = CYLINDERS[i]
    job, out = os.path.join(folder, f"render-{i}"), os.path.join(folder, "wrapped")
    os.makedirs(os.path.join(job, "input"), exist_ok=True)
    os.makedirs(out, exist_ok=True)
    shutil.copy(hair, os.path.join(job, "input", "truth.hair"))
    write_cylinder(os.path.join(job, "input", "cylinder.obj"), turn)
    picture = {"on": "mesh", "mesh_file": "cylinder.obj", "mesh_unit_mm": 1, "width_mm": WIDTH_MM, "light_theta_deg": theta, "light_phi_deg": phi,
               "camera_theta_deg": 0, "camera_phi_deg": 270, "px": 80 if arguments.quick else 220, "samples": 16 if arguments.quick else SAMPLES}
    dump({"sample": "cloth on a cylinder", "fibers": {"file": "truth.hair"}, "fit": {"model": "two_lobe.v1", "fixed": TRUTH}, "pictures": [picture]},
         job, "job.json")
    run(arguments, "selvedge-worker", "--quiet", job)
    shutil.copy(os.path.join(job, "results", "pictures", "on-1.exr"), os.path.join(out, f"roll-{i}.exr"))


def describe_cylinders(folder):
    """Tables of the rendered cylinders for the simulated camera."""
    out = os.path.join(folder, "wrapped")
    rows = [{"file": f"roll-{i}.exr", "set": "fit", "light_theta_deg": theta, "light_phi_deg": phi, "camera_theta_deg": 0, "camera_phi_deg": 270,
             "cloth_rotation_deg": 0, "scale": 1} for i, (theta, phi, _) in enumerate(CYLINDERS)]
    dump(rows, out, "photographs.json")
    dump({"lamp": {"distance_cm": 61.0, "side_cm": 10.0}, "photographs": [{"file": row["file"]} for row in rows],
          "camera": {"distance_cm": 100.0, "crop_cm": 0.1 * WIDTH_MM, "far_field": False, "blur_mm": 0.0}}, out, "truth.json")
    return out


def render_flat(arguments, folder, hair):
    out = os.path.join(folder, "flat")
    words = [w for k, v in TRUTH.items() for w in ("--param", f"{k}=" + (",".join(map(str, v)) if isinstance(v, list) else str(v)))]
    run(arguments, "selvedge-phantom", "photograph", "--fibers", hair, "--out", out, "--seed", 11, "--px", 60, "--crop-cm", 1.25, "--blur-mm", 0.1,
        "--paths", 16384 if arguments.quick else 131072, *words)
    rows, truth = load(out, "photographs.json"), load(out, "truth.json")
    truth["photographs"] = truth["photographs"][:16]
    dump(rows[:16], out, "photographs.json")
    dump(truth, out, "truth.json")
    return out


def take(arguments, source, folder, seed):
    """Makes raw files of the renderings in the folder `source`. Returns the keys of a job document."""
    shutil.rmtree(folder, ignore_errors=True)
    run(arguments, "selvedge-phantom", "camera", "--photographs", source, "--out", folder, "--seed", seed, "--cameras-from-markers")
    raw = sorted(os.listdir(folder))
    run(arguments, "selvedge-camera", "calibrate-camera", "--dark", *(os.path.join(folder, n) for n in raw if n.startswith("dark-")),
        "--flat", *(os.path.join(folder, n) for n in raw if n.startswith("flat-")), "--out", os.path.join(folder, "noise.json"))
    return load(folder, "camera-job.json")


def fit(arguments, raw, hair, folder, keys, seed):
    """Returns the parameters by a job that fits all nine to the photographs."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(raw, os.path.join(folder, "input"))
    shutil.copy(hair, os.path.join(folder, "input", "truth.hair"))
    document = dict(keys, sample="recovery", fibers={"file": "truth.hair"},
                    fit={"model": "two_lobe.v1", "path_budget": 100000 if arguments.quick else PATHS, "seed": 2 + seed, "render_px": 32,
                         "render_samples": 4})
    dump(document, folder, "job.json")
    run(arguments, "selvedge-worker", "--quiet", folder)
    return [{k: p[k] for k in ("name", "value", "standard_error")} for p in load(folder, "results", "result.json")["parameters"]]


def differences(parameters, what):
    """Relative differences of the nine parameters from the truth, and the same over their stated errors."""
    rel, z = [], []
    for p in parameters:
        name, _, channel = p["name"].partition(".")
        true = TRUTH[name]["rgb".index(channel.lower())] if channel else TRUTH[name]
        rel.append(p["value"] / true - 1.0)
        z.append((p["value"] - true) / p["standard_error"])
        print(f"{what:<9} {p['name']:<9} true {true:<6} fitted {p['value']:.4f} +- {p['standard_error']:.4f}", file=sys.stderr)
    return rel, z


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def figure(name, value):
    print(json.dumps({"name": f"cylinder_input.{name}", "value": round(value, 5), "unit": "1", "better": "lower"}), flush=True)


def keys_of_cylinders(keys):
    """The keys of the camera's photographs as those of cylinders."""
    for photograph in keys["photographs"]:
        theta, phi, turn = CYLINDERS[int(photograph["file"].split("-")[1])]
        photograph.update(cylinder_radius_mm=RADIUS_MM, cylinder_length_mm=LENGTH_MM, cylinder_limit_deg=LIMIT_DEG, cylinder_step_deg=STEP_DEG,
                          light_theta_deg=theta, light_phi_deg=phi, cloth_rotation_deg=turn)
        del photograph["view"]
    return keys


def render(arguments, kept):
    """Renders all pictures, each once. Returns the fibers, and the folders of the flat pictures and of the cylinders."""
    folder = kept.folder
    hair = os.path.join(folder, "cloth", "truth.hair")
    key = [TRUTH, arguments.quick]
    kept.step("cloth", key, lambda: run(arguments, "selvedge-phantom", "cloth", "--weave", "twill", "--seed", 7, "--out", os.path.dirname(hair)))
    flat = kept.step("flat", key, lambda: render_flat(arguments, folder, hair))
    for i, lamp in enumerate(CYLINDERS):
        kept.step(f"cylinder-{i}", [key, lamp, RADIUS_MM, WIDTH_MM, SAMPLES], lambda i=i: render_cylinder(arguments, folder, hair, i))
    return hair, flat, describe_cylinders(folder)


def compare(arguments, kept, program):
    """Relative differences, and those over stated errors, of each kind of input: a list of nine for each camera."""
    folder = kept.folder
    hair, flat, wrapped = render(arguments, kept)
    found = {"flat": [], "two": [], "one": []}
    for seed in range(1, arguments.seeds + 1):
        raw = {k: os.path.join(folder, f"{k}-raw-{seed}") for k in ("flat", "wrapped")}
        taken = {k: kept.step(f"{k}-raw-{seed}", [TRUTH, CYLINDERS, SAMPLES, arguments.quick],
                              lambda k=k, source=source: take(arguments, source, raw[k], seed))
                 for k, source in (("flat", flat), ("wrapped", wrapped))}
        cylinders = keys_of_cylinders(taken["wrapped"])
        jobs = {"flat": (raw["flat"], taken["flat"]), "two": (raw["wrapped"], cylinders),
                "one": (raw["wrapped"], dict(cylinders, photographs=cylinders["photographs"][:1]))}
        for what, (source, keys) in jobs.items():
            job = os.path.join(folder, f"{what}-job-{seed}")
            parameters = kept.step(f"{what}-fit-{seed}", [program, keys, PATHS],
                                   lambda job=job, source=source, keys=keys: fit(arguments, source, hair, job, keys, seed))
            found[what].append(differences(parameters, what))
    return found


def column_error(arguments, folder):
    """Columns against renderings at the true parameters: the job of two photographs with all parameters but one held at the truth. Their root mean
    square relative difference, and over the errors of columns and renderings."""
    job = os.path.join(folder, "columns-job")
    shutil.rmtree(job, ignore_errors=True)
    shutil.copytree(os.path.join(folder, "two-job-1", "input"), os.path.join(job, "input"))
    document = load(folder, "two-job-1", "job.json")
    fixed = {k: v for k, v in TRUTH.items() if k != "gamma_TT"}
    document["fit"] = {"model": "two_lobe.v1", "path_budget": 400000 if arguments.quick else 4000000, "seed": 5, "render_px": 32, "render_samples": 4,
                       "fixed": fixed, "bounds": {"gamma_TT": [17.99, 18.01]}}
    dump(document, job, "job.json")
    run(arguments, "selvedge-worker", "--quiet", job)
    rel, z = [], []
    for row in load(job, "results", "result.json")["rows"]:
        values = list(zip(row["measured"], row["measured_se"], row["rendered"], row["rendered_se"]))
        rel += [m / r - 1.0 for m, _, r, _ in values]
        z += [(m - r) / math.hypot(s, t) for m, s, r, t in values]
        print(f"{row['name']} {row['column']['angle_deg']:+7.2f} deg, lamp {row['light_theta_deg']:5.1f}, camera {row['camera_theta_deg']:5.1f}: "
              + "  ".join(f"{m:.4f} +- {s:.4f} ({100 * (m / r - 1):+.1f} +- {100 * t / r:.1f} %)" for m, s, r, t in values), file=sys.stderr)
    return rms(rel), rms(z)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--keep", help="folder of finished steps; default: bench-cylinder in the build folder, or bench-cylinder-quick")
    parser.add_argument("--seeds", type=int, default=3, help="cameras")
    parser.add_argument("--quick", action="store_true", help="small pictures, few paths, one camera")
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.seeds = 1
    build = os.path.join(ROOT, arguments.build)
    kept = Kept(os.path.abspath(arguments.keep or os.path.join(build, "bench-cylinder" + ("-quick" if arguments.quick else ""))))
    with open(os.path.join(build, "bin", "selvedge-worker"), "rb") as f:
        program = hashlib.sha256(f.read()).hexdigest()[:12]
    found = compare(arguments, kept, program)
    rel = {what: rms([v for camera, _ in cameras for v in camera]) for what, cameras in found.items()}
    z = {what: rms([v for _, camera in cameras for v in camera]) for what, cameras in found.items()}
    ratios = [rms(two[0]) / rms(flat[0]) for two, flat in zip(found["two"], found["flat"])]
    figure("flat_error", rel["flat"])
    figure("error", rel["two"])
    figure("error_of_one", rel["one"])
    figure("ratio", rel["two"] / rel["flat"])
    if len(ratios) > 1:
        figure("ratio_spread", statistics.stdev(ratios))
    figure("ratio_of_one", rel["one"] / rel["flat"])
    figure("flat_z_rms", z["flat"])
    figure("z_rms", z["two"])
    figure("z_rms_of_one", z["one"])
    differs, differs_z = kept.step("columns", program, lambda: column_error(arguments, kept.folder))
    figure("column_error", differs)
    figure("column_z", differs_z)


if __name__ == "__main__":
    main()
