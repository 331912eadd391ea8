"""One forecast for jobs of six kinds, sampled over time: prints figures forecast.{kind}.{in_range,worst_ratio,plan_ratio}.

    bench_forecast.py [--build DIR] [--threads N] [--keep DIR] [--cpu-clock] [KIND ...]

Each job runs twice on a folder of remembered speeds of its own: the first is the first of its kind on a machine that has run nothing, the second
knows the first. in_range: share of the looks at the first job whose stated range has the true remaining time (25 % either way where only a time is
stated), the plan before its start among them. worst_ratio: largest factor by which the true remaining time of the second job lay outside of what users
read, from a tenth of the time on, while a twentieth of it is left. plan_ratio: the time that the second job took over its plan, or the inverse.
still: longest time in which the stated fraction of the second job, in tenths of a percent, stood still, over the job's time.

With --cpu-clock the programs' clock is their processor time, for machines that others use at the same time.
"""
import argparse
import contextlib
import json
import os
import random
import subprocess
import sys
import tempfile

import bench_progress as progress

ANGLES = "set,light_theta_deg,light_phi_deg,cloth_rotation_deg,camera_theta_deg,camera_phi_deg,r,g,b"
FIXED = {"C_R": [0.12, 0.05, 0.07], "C_TT": [0.8, 0.4, 0.35], "beta_R": 4, "beta_TT": 12, "gamma_TT": 20}
PICTURE = {"on": "cylinder", "px": 128, "samples": 8, "light_theta_deg": 45, "light_phi_deg": 0, "camera_theta_deg": 30, "camera_phi_deg": 180}
LEAST_REST_S = 0.3


def write_job(folder, document, **files):
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(document, f)
    for name, text in files.items():
        with open(os.path.join(folder, f"{name}.csv"), "w", encoding="utf-8") as f:
            f.write(text)


def scan(arguments, folder):
    """Returns the entry `volume` of a small scan in the folder."""
    progress.phantom(arguments, "cloth", "--weave", "plain", "--fibers-per-yarn", 7, "--seed", 3, "--out", folder)
    with open(os.path.join(folder, "phantom.json"), encoding="utf-8") as f:
        return {"files": ["scan.tif"], "voxel_size_um": json.load(f)["cloth"]["voxel_size_um"]}


def scan_with_photographs(arguments, folder):
    volume = scan(arguments, folder)
    progress.phantom(arguments, "photograph", "--fibers", f"{folder}/truth.hair", "--out", folder, "--seed", 11, "--noise", 0.01, "--paths", 8192, "--px", 32)
    with open(os.path.join(folder, "photographs.json"), encoding="utf-8") as f:
        write_job(folder, {"sample": "scan and photographs", "volume": volume, "photographs": json.load(f),
                           "fit": {"model": "two_lobe.v1", "seed": 1, "path_budget": 1500000}})


def geometry(arguments, folder):
    write_job(folder, {"sample": "geometry only", "volume": scan(arguments, folder)})


def table_rows():
    rows = "".join(f"{'fit' if i % 4 else 'held-out'},{10 + 4 * i},0,0,30,180,{0.2 - 0.004 * i:.4f},{0.15 - 0.003 * i:.4f},{0.1 - 0.002 * i:.4f}\n"
                   for i in range(16))
    return f"{ANGLES}\n{rows}"


def described(_, folder):
    write_job(folder, {"sample": "described cloth", "cloth": {"weave": "plain", "yarns": [{"fibers": 20}]}, "measurements": {"file": "rows.csv"},
                       "fit": {"model": "two_lobe.v1", "seed": 1}}, rows=table_rows())


def exported(_, folder):
    write_job(folder, {"sample": "exports", "cloth": {"weave": "twill", "yarns": [{"fibers": 20}]}, "measurements": {"file": "rows.csv"},
                       "fit": {"model": "two_lobe.v1", "seed": 1, "path_budget": 400000},
                       "export": {"mitsuba": True, "pbrt": True, "usd": True, "blender": True, "textures": True}}, rows=table_rows())


def profile(_, folder):
    noise = random.Random(3)
    rows = "".join(f"{theta},{phi},{0.09 * (1 + 0.02 * noise.gauss(0, 1)):.6f},0.0018\n" for theta in range(-60, 61, 2)
                   for phi in range(-40, 221, 4))
    write_job(folder, {"sample": "profile", "profile": {"file": "fiber.csv", "theta_i_deg": -40},
                       "fit": {"models": ["two_lobe.v1", "kajiya_kay.v1", "elliptical.v1"]}}, fiber="theta_o_deg,phi_deg,radiance,radiance_se\n" + rows)


def twin(_, folder):
    write_job(folder, {"sample": "picture and twin", "cloth": {"weave": "twill", "yarns": [{"fibers": 30}]}, "fit": {"model": "two_lobe.v1", "fixed": FIXED},
                       "pictures": [PICTURE], "twin": {"make": True, "paths": 200000, "texels": 1024}})


KINDS = {"scan_photographs": scan_with_photographs, "table": described, "geometry": geometry, "profile": profile, "twin": twin, "export": exported}


def plan_of(arguments, job, speeds):
    command = [progress.program(arguments, "selvedge-worker"), "--plan", "--threads", str(arguments.threads), "--speeds", speeds, job]
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)


def stated(look):
    """(low, likely, high) of a look, NaN-free, or None."""
    if look["eta_s"] is None:
        return None
    if look["eta_low_s"] is not None:
        return look["eta_low_s"], look["eta_s"], look["eta_high_s"]
    return look["eta_s"] / 1.25, look["eta_s"], look["eta_s"] * 1.25


def in_range(looks, total_s, plan):
    inside = [plan["wall_low_s"] <= total_s <= plan["wall_high_s"]]
    for t, _, look in looks:
        rest, says = total_s - t, stated(look)
        if look["state"] == "running" and says and rest >= max(LEAST_REST_S, 0.05 * total_s):
            inside.append(says[0] <= rest <= says[2])
    return sum(inside) / len(inside)


def worst_ratio(looks, total_s):
    """Users read the range where there is one, the time otherwise."""
    worst = 1.0
    for t, _, look in looks:
        rest, says = total_s - t, stated(look)
        if look["state"] != "running" or t < 0.1 * total_s or rest < max(LEAST_REST_S, 0.05 * total_s):
            continue
        low, high = (says[0], says[2]) if look["eta_low_s"] is not None else (look["eta_s"],) * 2 if says else (0.0, 0.0)
        worst = max(worst, progress.off(rest, low, high))
    return worst


def longest_still(looks, total_s):
    longest, since, shown = 0.0, 0.0, -1
    for t, _, look in looks:
        if round(1000 * look["fraction"]) != shown:
            since, shown = t, round(1000 * look["fraction"])
        longest = max(longest, t - since)
    return longest / total_s


def figure(kind, name, value, better="lower"):
    print(json.dumps({"name": f"forecast.{kind}.{name}", "value": round(value, 4), "unit": "1", "better": better}), flush=True)


def bench(arguments, kind, folder):
    sample, speeds, took = os.path.join(folder, f"{kind}-sample"), os.path.join(folder, f"{kind}-speeds.json"), []
    KINDS[kind](arguments, sample)
    for run in ("first", "second"):
        job = os.path.join(folder, f"{kind}-{run}")
        progress.make_job(sample, job)
        plan = plan_of(arguments, job, speeds)
        looks, _ = progress.record(arguments, job, speeds)
        total_s = looks[-1][0]
        took.append((plan, looks, total_s))
        print(f"{kind}, {run}: plan {plan['wall_s']:.1f} s ({plan['wall_low_s']:.1f} to {plan['wall_high_s']:.1f}), took {total_s:.1f} s", file=sys.stderr)
    figure(kind, "in_range", in_range(took[0][1], took[0][2], took[0][0]), "higher")
    plan, looks, total_s = took[1]
    figure(kind, "worst_ratio", worst_ratio(looks, total_s))
    figure(kind, "plan_ratio", max(total_s / plan["wall_s"], plan["wall_s"] / total_s))
    figure(kind, "still", longest_still(looks, total_s))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--keep")
    parser.add_argument("--cpu-clock", action="store_true")
    parser.add_argument("kind", nargs="*", choices=[*KINDS, []])
    arguments = parser.parse_args()
    with contextlib.ExitStack() as stack:
        folder = arguments.keep or stack.enter_context(tempfile.TemporaryDirectory())
        os.makedirs(folder, exist_ok=True)
        for kind in arguments.kind or KINDS:
            bench(arguments, kind, folder)


if __name__ == "__main__":
    main()
