"""Noise of renderings beside their photographs: bench_comparison.py --build DIR

Six photographs of a twill with known parameters, 64 pixels of 32 samples each, are fitted; a job renders the fitted cloth beside
them. Prints, as a JSON line, the standard deviation of the rendering's pixels over their mean, over the same of the photograph,
both with as many pixels, as the mean of the rows: 1 is a rendering as even and as structured as the photograph. The same without the
filter, and each row with the structure that both pictures share, go to standard error. DIR/bench-comparison keeps the photographs.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "support", "python"))
from small_exr import read_exr  # noqa: E402

PX = 64
TABLE = """set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg
fit,20,0,20,180,0
fit,45,0,45,180,0
fit,60,0,0,180,0
fit,45,0,45,90,90
held-out,30,0,50,180,0
held-out,60,0,30,20,90
"""
TRUTH = {"C_R": "0.06,0.05,0.08", "C_TT": "0.72,0.55,0.35", "beta_R": 4, "beta_TT": 20, "gamma_TT": 18}


def make_photographs(build, folder):
    if os.path.exists(os.path.join(folder, "photographs.json")):
        return
    phantom = os.path.join(build, "bin", "selvedge-phantom")
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "views.csv"), "w", encoding="utf-8") as f:
        f.write(TABLE)
    subprocess.run([phantom, "cloth", "--weave", "twill", "--seed", "7", "--out", folder], check=True, stdout=subprocess.DEVNULL)
    words = [w for name, value in TRUTH.items() for w in ("--param", f"{name}={value}")]
    subprocess.run([phantom, "photograph", "--fibers", os.path.join(folder, "truth.hair"), "--table", os.path.join(folder, "views.csv"),
                    "--px", str(PX), "--seed", "11", "--quiet", *words, "--out", folder], check=True, stdout=subprocess.DEVNULL)


def run_job(build, sample, job):
    shutil.rmtree(job, ignore_errors=True)
    os.makedirs(os.path.join(job, "input"))
    with open(os.path.join(sample, "photographs.json"), encoding="utf-8") as f:
        photographs = json.load(f)
    for name in ["truth.hair"] + [p["file"] for p in photographs]:
        shutil.copy(os.path.join(sample, name), os.path.join(job, "input"))
    with open(os.path.join(job, "job.json"), "w", encoding="utf-8") as f:
        json.dump({"sample": "a twill", "fibers": {"file": "truth.hair", "voxel_um": 2}, "photographs": photographs,
                   "fit": {"model": "two_lobe.v1", "path_budget": 600000, "seed": 1, "render_px": PX}}, f)
    subprocess.run([os.path.join(build, "bin", "selvedge-worker"), "--quiet", job], check=True)
    with open(os.path.join(job, "results", "result.json"), encoding="utf-8") as f:
        return json.load(f)["rows"]


def brightness(path, layer=""):
    """The pixels' brightness, over its mean and less 1."""
    with open(path, "rb") as f:
        width, height, pixel = read_exr(f.read(), layer)
    value = [sum(pixel(x, y)) / 3 for y in range(height) for x in range(width)]
    mean = sum(value) / len(value)
    return [v / mean - 1 for v in value]


def common_sd(a, b):
    """Of two pictures with the same structure and noise of their own: the standard deviation of the structure; of one picture, its own."""
    return max(0, sum(x * y for x, y in zip(a, b)) / len(a)) ** 0.5


def main():
    p = argparse.ArgumentParser()
    p.add_argument("--build", required=True)
    a = p.parse_args()
    folder = os.path.join(a.build, "bench-comparison")
    make_photographs(a.build, os.path.join(folder, "sample"))
    rows = run_job(a.build, os.path.join(folder, "sample"), os.path.join(folder, "job"))
    ratios = {"": [], "filtered.": []}
    for row in rows:
        results = os.path.join(folder, "job", "results")
        photograph = brightness(os.path.join(results, row["photograph_png"].replace(".png", ".exr")))
        shown = {layer: brightness(os.path.join(results, row["rendering_exr"]), layer) for layer in ratios}
        for layer, value in shown.items():
            ratios[layer].append(common_sd(value, value) / common_sd(photograph, photograph))
        print(f"{row['name']}: photograph {common_sd(photograph, photograph):.3f}, rendering {common_sd(shown[''], shown['']):.3f}, "
              f"filtered by {row['rendering_filter']} {common_sd(shown['filtered.'], shown['filtered.']):.3f}; "
              f"structure of photograph and rendering {common_sd(photograph, shown['']):.3f}, of photograph and filtered view "
              f"{common_sd(photograph, shown['filtered.']):.3f}", file=sys.stderr)
    mean = {layer: sum(values) / len(values) for layer, values in ratios.items()}
    print(f"without the filter: {mean['']:.3f}", file=sys.stderr)
    print(json.dumps({"name": "pictures.comparison.noise_ratio", "value": round(mean["filtered."], 4), "unit": "", "better": "lower"}))


main()
