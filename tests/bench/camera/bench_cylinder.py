"""Does one photograph of a cloth on a cylinder, or two, determine the fibers as 16 photographs of flat cloth do? Prints figures cylinder_input.*.

    bench_cylinder.py [--build DIR] [--keep DIR] [--seeds N] [--quick]

A twill of known fibers (two_lobe.v1) is rendered flat in the 16 configurations that are usual, and on a cylinder of radius 15 mm in two
(figure 5.22 of the fabric thesis has such photographs). Both are taken by one simulated camera (selvedge-phantom camera): raw files of three
exposures with noise, a lens that darkens and distorts, a chart, markers around the sample. Jobs fit the nine parameters to the flat
photographs and to the columns of the cylinders; the worker finds the outline of each cylinder in its picture.

cylinder_input.flat_error, .error, .error_of_one: root mean square over the nine parameters and the cameras of the relative difference between
fitted and true values; from 16 flat photographs, from two of a cylinder, and from the first of them alone.
cylinder_input.ratio, .ratio_of_one: the errors of the second and third over the first.
cylinder_input.z_rms, .flat_z_rms: root mean square of the differences over their stated errors.
cylinder_input.column_error: root mean square relative difference of the columns' radiances from renderings of flat cloth at their angles and
at the true parameters, which holds the bend of the cloth, its texture and all errors of the chain.
"""
import argparse
import contextlib
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
TRUTH = {"C_R": [0.06, 0.05, 0.08], "C_TT": [0.72, 0.55, 0.35], "beta_R": 4, "beta_TT": 20, "gamma_TT": 18}
RADIUS_MM, LENGTH_MM, LIMIT_DEG, WIDTH_MM = 15, 30, 75, 34
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


def render_cylinders(arguments, folder, hair):
    """on-1.exr and on-2.exr of a job that renders the cloth on both cylinders."""
    job = os.path.join(folder, "render")
    os.makedirs(os.path.join(job, "input"), exist_ok=True)
    shutil.copy(hair, os.path.join(job, "input", "truth.hair"))
    pictures = []
    for i, (theta, phi, turn) in enumerate(CYLINDERS):
        write_cylinder(os.path.join(job, "input", f"cylinder-{i}.obj"), turn)
        pictures.append({"on": "mesh", "mesh_file": f"cylinder-{i}.obj", "mesh_unit_mm": 1, "width_mm": WIDTH_MM, "light_theta_deg": theta,
                         "light_phi_deg": phi, "camera_theta_deg": 0, "camera_phi_deg": 270, "px": 80 if arguments.quick else 220,
                         "samples": 16 if arguments.quick else 256})
    dump({"sample": "cloth on a cylinder", "fibers": {"file": "truth.hair"}, "fit": {"model": "two_lobe.v1", "fixed": TRUTH}, "pictures": pictures},
         job, "job.json")
    run(arguments, "selvedge-worker", "--quiet", job)
    out = os.path.join(folder, "wrapped")
    os.makedirs(out, exist_ok=True)
    rows, truth = [], []
    for i, (theta, phi, turn) in enumerate(CYLINDERS):
        shutil.copy(os.path.join(job, "results", "pictures", f"on-{i + 1}.exr"), os.path.join(out, f"roll-{i}.exr"))
        rows.append({"file": f"roll-{i}.exr", "set": "fit", "light_theta_deg": theta, "light_phi_deg": phi, "camera_theta_deg": 0,
                     "camera_phi_deg": 270, "cloth_rotation_deg": 0, "scale": 1})
        truth.append({"file": f"roll-{i}.exr"})
        print(f"roll-{i}: lamp {theta}/{phi}, cloth turned by {turn}", file=sys.stderr)
    dump(rows, out, "photographs.json")
    dump({"lamp": {"distance_cm": 61.0, "side_cm": 10.0}, "photographs": truth,
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
    """Raw files of the renderings in the folder `source`; the keys of a job document."""
    run(arguments, "selvedge-phantom", "camera", "--photographs", source, "--out", folder, "--seed", seed, "--cameras-from-markers")
    raw = sorted(os.listdir(folder))
    run(arguments, "selvedge-camera", "calibrate-camera", "--dark", *(os.path.join(folder, n) for n in raw if n.startswith("dark-")),
        "--flat", *(os.path.join(folder, n) for n in raw if n.startswith("flat-")), "--out", os.path.join(folder, "noise.json"))
    return load(folder, "camera-job.json")


def fit(arguments, raw, hair, folder, keys):
    """The result of a job that fits the nine parameters to the photographs."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(raw, os.path.join(folder, "input"))
    shutil.copy(hair, os.path.join(folder, "input", "truth.hair"))
    document = dict(keys, sample="recovery", fibers={"file": "truth.hair"},
                    fit={"model": "two_lobe.v1", "path_budget": 100000 if arguments.quick else 3000000, "seed": 3, "render_px": 32,
                         "render_samples": 4})
    dump(document, folder, "job.json")
    run(arguments, "selvedge-worker", "--quiet", folder)
    return load(folder, "results", "result.json")


def differences(result, what):
    """Relative differences of the nine parameters from the truth, and the same over their stated errors."""
    rel, z = [], []
    for p in result["parameters"]:
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


def compare(arguments, folder):
    run(arguments, "selvedge-phantom", "cloth", "--weave", "twill", "--seed", 7, "--out", os.path.join(folder, "cloth"))
    hair = os.path.join(folder, "cloth", "truth.hair")
    flat, wrapped = render_flat(arguments, folder, hair), render_cylinders(arguments, folder, hair)
    rel, z = {"flat": [], "two": [], "one": []}, {"flat": [], "two": [], "one": []}
    for seed in range(1, arguments.seeds + 1):
        raw = os.path.join(folder, f"flat-raw-{seed}"), os.path.join(folder, f"wrapped-raw-{seed}")
        jobs = {"flat": (raw[0], take(arguments, flat, raw[0], seed)), "two": (raw[1], take(arguments, wrapped, raw[1], seed))}
        for photograph, (_, _, turn) in zip(jobs["two"][1]["photographs"], CYLINDERS):
            photograph.update(cylinder_radius_mm=RADIUS_MM, cylinder_length_mm=LENGTH_MM, cylinder_limit_deg=LIMIT_DEG)
            del photograph["view"]
            i = int(photograph["file"].split("-")[1])
            photograph.update(light_theta_deg=CYLINDERS[i][0], light_phi_deg=CYLINDERS[i][1], cloth_rotation_deg=turn)
        jobs["one"] = (raw[1], dict(jobs["two"][1], photographs=jobs["two"][1]["photographs"][:1]))
        for what, (source, keys) in jobs.items():
            result = fit(arguments, source, hair, os.path.join(folder, f"{what}-job-{seed}"), keys)
            d = differences(result, what)
            rel[what] += d[0]
            z[what] += d[1]
    return rel, z


def column_error(arguments, folder):
    """Columns against renderings at the true parameters: the job of two photographs with all parameters but one held at the truth."""
    job = os.path.join(folder, "columns-job")
    shutil.rmtree(job, ignore_errors=True)
    shutil.copytree(os.path.join(folder, "two-job-1", "input"), os.path.join(job, "input"))
    document = load(folder, "two-job-1", "job.json")
    fixed = {k: v for k, v in TRUTH.items() if k != "gamma_TT"}
    document["fit"] = {"model": "two_lobe.v1", "path_budget": 400000, "seed": 5, "render_px": 32, "render_samples": 4, "fixed": fixed,
                       "bounds": {"gamma_TT": [17.99, 18.01]}}
    dump(document, job, "job.json")
    run(arguments, "selvedge-worker", "--quiet", job)
    rel = []
    for row in load(job, "results", "result.json")["rows"]:
        rel += [m / r - 1.0 for m, r in zip(row["measured"], row["rendered"])]
        print(f"{row['name']} {row['column']['angle_deg']:+7.2f} deg, lamp {row['light_theta_deg']:5.1f}, camera {row['camera_theta_deg']:5.1f}: "
              + "  ".join(f"{m:.4f} +- {s:.4f} ({100 * (m / r - 1):+.1f} %)" for m, s, r in zip(row["measured"], row["measured_se"], row["rendered"])),
              file=sys.stderr)
    return rms(rel)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--keep", help="keep the files there")
    parser.add_argument("--seeds", type=int, default=3, help="cameras")
    parser.add_argument("--quick", action="store_true", help="small pictures, few paths, one camera")
    arguments = parser.parse_args()
    if arguments.quick:
        arguments.seeds = 1
    with contextlib.ExitStack() as stack:
        folder = arguments.keep or stack.enter_context(tempfile.TemporaryDirectory())
        os.makedirs(folder, exist_ok=True)
        rel, z = compare(arguments, folder)
        figure("flat_error", rms(rel["flat"]))
        figure("error", rms(rel["two"]))
        figure("error_of_one", rms(rel["one"]))
        figure("ratio", rms(rel["two"]) / rms(rel["flat"]))
        figure("ratio_of_one", rms(rel["one"]) / rms(rel["flat"]))
        figure("flat_z_rms", rms(z["flat"]))
        figure("z_rms", rms(z["two"]))
        figure("column_error", column_error(arguments, folder))


if __name__ == "__main__":
    main()
