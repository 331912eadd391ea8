"""Do mean radiances come back from raw files of a camera within the errors that are stated? Prints figures camera.*.

    bench_camera.py [--build DIR] [--keep DIR] [--quick]

Known radiances are taken with a simulated camera (selvedge-phantom camera): a Bayer mosaic with noise as DNG, three exposures of each
view, a wrong white balance, gain, a lens that darkens and distorts, a chart seen obliquely, markers around the sample. `selvedge
calibrate-camera` makes the record of its noise of dark and flat frames, and `selvedge photo --job` reads the views as a job would; crops
and places of the camera follow from the markers. Two kinds of samples:

camera.roundtrip: rendered cloth. The stated error contains the scatter of the cloth's texture, of which the rendering and its photograph
show the same piece, so the differences are smaller than the errors. rel_error, z_max: the largest over views and channels.
camera.cards: even cards, 20 cameras. Here the error is noise and what the chart makes of it. z_max: the largest |difference / error|;
z_max_expected: the median of the largest of random values with the stated covariance, in which the errors of the color matrix are common to
the views of a camera; chi2_per_value: the squares with that covariance, over their number. 1 is right.
camera.exposures: the even cards by cameras whose true exposure times differ by 5 % from the stated ones.
camera.chart_fall: the same under a lamp that gives 20 % less light at one end of the chart.
"""
import argparse
import contextlib
import json
import math
import os
import random
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", "..", ".."))
sys.path.insert(0, os.path.join(ROOT, "tests", "support", "python"))
import small_exr  # noqa: E402  pylint: disable=wrong-import-position

# light theta, light phi, camera theta, camera phi, rotation of the cloth
VIEWS = [(20, 0, 20, 180, 0), (45, 0, 45, 180, 0), (64, 0, 64, 180, 90), (60, 0, 10, 180, 0), (45, 0, 45, 90, 90), (40, 0, 40, 45, 0),
         (0, 0, 60, 0, 90), (64, 0, 64, 90, 90), (30, 0, 30, 135, 30), (70, 0, 50, 180, 0)]
TRUTH = ["C_R=0.06,0.05,0.08", "C_TT=0.72,0.55,0.35", "beta_R=4", "beta_TT=20", "gamma_TT=18"]
CARDS = [(0.9, 0.7, 0.6), (0.011, 0.009, 0.013), (0.2, 0.2, 0.2), (0.3, 0.1, 0.02), (0.03, 0.06, 0.2), (1.6, 1.2, 0.9), (0.05, 0.04, 0.03),
         (0.5, 0.6, 0.1)]
CROP_CM, BLUR_MM = 1.25, 0.12
CAMERAS, FAULTY_CAMERAS, DRAWS = 20, 8, 301


def run(arguments, name, *command, stdout=subprocess.DEVNULL):
    subprocess.run([os.path.join(arguments.build, "bin", name), *map(str, command)], check=True, stdout=stdout)


def render_cloth(arguments, folder):
    run(arguments, "selvedge-phantom", "cloth", "--weave", "twill", "--seed", 7, "--out", folder)
    table = os.path.join(folder, "views.csv")
    with open(table, "w", encoding="utf-8") as f:
        f.write("set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n")
        for view in VIEWS[:3] if arguments.quick else VIEWS:
            f.write(",".join(map(str, ("fit", *view))) + "\n")
    run(arguments, "selvedge-phantom", "photograph", "--fibers", f"{folder}/truth.hair", "--table", table, "--out", folder, "--seed", 11, "--paths",
        16384 if arguments.quick else 131072, "--px", 80, "--crop-cm", CROP_CM, "--blur-mm", BLUR_MM, *(word for t in TRUTH for word in ("--param", t)))


def make_cards(folder):
    """The files of selvedge-phantom photograph for even cards under a lamp at 20 degrees."""
    os.makedirs(folder)
    rows, truth = [], []
    for i, rgb in enumerate(CARDS):
        name = f"card-{i}.exr"
        with open(os.path.join(folder, name), "wb") as f:
            f.write(small_exr.exr(16, 16, lambda x, y, rgb=rgb: rgb))
        rows.append({"file": name, "set": "fit", "light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 6.0 * i, "camera_phi_deg": 47.0 * i,
                     "cloth_rotation_deg": 0, "scale": 1})
        truth.append({"file": name, "mean_rgb": rgb})
    with open(os.path.join(folder, "photographs.json"), "w", encoding="utf-8") as f:
        json.dump(rows, f)
    with open(os.path.join(folder, "truth.json"), "w", encoding="utf-8") as f:
        json.dump({"lamp": {"distance_cm": 61.0, "side_cm": 10.0}, "photographs": truth,
                   "camera": {"distance_cm": 100.0, "crop_cm": CROP_CM, "far_field": False, "blur_mm": 0.0}}, f)


def take(arguments, source, folder, seed, *faults):
    """Takes the samples of a folder; [(true mean rgb, row of `selvedge photo --json`, view)]."""
    run(arguments, "selvedge-phantom", "camera", "--photographs", source, "--out", folder, "--seed", seed, "--cameras-from-markers", *faults)

    def frames(kind):
        return sorted(os.path.join(folder, name) for name in os.listdir(folder) if name.startswith(kind))

    run(arguments, "selvedge-camera", "calibrate-camera", "--dark", *frames("dark-"), "--flat", *frames("flat-"), "--out", f"{folder}/noise.json")
    with open(os.path.join(folder, "camera-job.json"), encoding="utf-8") as f:
        job = dict(json.load(f), sample="round trip", fibers={"file": "not-used.hair"})
    with open(os.path.join(folder, "job.json"), "w", encoding="utf-8") as f:
        json.dump(job, f)
    run(arguments, "selvedge-camera", "photo", "--job", f"{folder}/job.json", "--json", f"{folder}/rows.json")
    with open(os.path.join(folder, "rows.json"), encoding="utf-8") as f, open(os.path.join(folder, "truth.json"), encoding="utf-8") as g, \
            open(os.path.join(source, "photographs.json"), encoding="utf-8") as h:
        return [(t["mean_rgb"], row, view) for row, t, view in zip(json.load(f), json.load(g)["photographs"], json.load(h))]


def z_values(views):
    return [(row["mean_rgb"][c] - true[c]) / row["standard_error"][c] for true, row, _ in views for c in range(3)]


def relative_errors(views):
    return [abs(row["mean_rgb"][c] / true[c] - 1.0) for true, row, _ in views for c in range(3)]


def solve(matrix, b):
    """x of matrix x = b, by elimination."""
    n = len(b)
    rows = [list(matrix[i]) + [b[i]] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(rows[k][i]))
        rows[i], rows[pivot] = rows[pivot], rows[i]
        for k in range(i + 1, n):
            f = rows[k][i] / rows[i][i]
            rows[k] = [a - f * b for a, b in zip(rows[k], rows[i])]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - sum(rows[i][k] * x[k] for k in range(i + 1, n))) / rows[i][i]
    return x


def own_error(row, c):
    """Error of a row's mean by causes of its own: the camera's noise, and its fitted exposure times."""
    return math.hypot(row["photograph"]["noise_se"][c], row["photograph"]["exposure_se"][c])


def chi_square(views):
    """Sum of squares of the differences over their covariance: each channel's noise, and the causes that its views have in common."""
    total = 0.0
    for c in range(3):
        d = [row["mean_rgb"][c] - true[c] for true, row, _ in views]
        cause = [row["color_error"][c] for _, row, _ in views]
        noise = [own_error(row, c) for _, row, _ in views]
        cov = [[sum(a * b for a, b in zip(cause[i], cause[j])) + (noise[i] ** 2 if i == j else 0.0) for j in range(len(d))] for i in range(len(d))]
        total += sum(a * b for a, b in zip(d, solve(cov, d)))
    return total


def angle_error_deg(view, row):
    """Angle between the true direction to the camera and the one that the markers gave."""
    def direction(theta, phi):
        theta, phi = math.radians(theta), math.radians(phi)
        return math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)
    a, b = direction(view["camera_theta_deg"], view["camera_phi_deg"]), direction(row["camera_theta_deg"], row["camera_phi_deg"])
    return math.degrees(2.0 * math.asin(min(1.0, 0.5 * math.dist(a, b))))


def largest_drawn(views, rng):
    """The largest |difference / error| of one camera, drawn with the stated covariance."""
    largest = 0.0
    cause = [rng.gauss(0.0, 1.0) for _ in views[0][1]["color_error"][0]]
    for c in range(3):
        for _, row, _ in views:
            error = sum(a * b for a, b in zip(cause, row["color_error"][c])) + rng.gauss(0.0, own_error(row, c))
            largest = max(largest, abs(error) / row["standard_error"][c])
    return largest


def expected_largest(cameras):
    rng = random.Random(1)
    return statistics.median(max(largest_drawn(views, rng) for views in cameras) for _ in range(DRAWS))


def figure(name, value, unit="1"):
    print(json.dumps({"name": f"camera.{name}", "value": round(value, 5), "unit": unit, "better": "lower"}), flush=True)


def show(kind, views):
    for true, row, _ in views:
        words = "  ".join(f"{true[c]:.5f} {100 * (row['mean_rgb'][c] / true[c] - 1):+.3f} % {(row['mean_rgb'][c] - true[c]) / row['standard_error'][c]:+.2f}"
                          for c in range(3))
        print(f"{kind} {row['file']:<14} {words}", file=sys.stderr)


def bench_cloth(arguments, folder):
    source = os.path.join(folder, "cloth")
    render_cloth(arguments, source)
    views = take(arguments, source, os.path.join(folder, "cloth-raw"), 1)
    show("cloth", views)
    figure("roundtrip.rel_error", max(relative_errors(views)))
    figure("roundtrip.z_max", max(map(abs, z_values(views))))
    figure("roundtrip.camera_angle_deg", max(angle_error_deg(view, row) for _, row, view in views), "deg")


def bench_fault(arguments, folder, name, *faults):
    """The even cards by cameras that have a fault."""
    cameras = []
    for seed in range(1, 2 if arguments.quick else FAULTY_CAMERAS + 1):
        cameras.append(take(arguments, os.path.join(folder, "cards"), os.path.join(folder, f"{name}-raw"), seed, *faults))
        show(name, cameras[-1])
    z = [value for views in cameras for value in z_values(views)]
    figure(f"{name}.rel_error", max(max(relative_errors(views)) for views in cameras))
    figure(f"{name}.z_max", max(map(abs, z)))
    figure(f"{name}.z_max_expected", expected_largest(cameras))
    figure(f"{name}.chi2_per_value", sum(map(chi_square, cameras)) / len(z))


def bench_cards(arguments, folder):
    source = os.path.join(folder, "cards")
    make_cards(source)
    cameras = []
    for seed in range(1, 2 if arguments.quick else CAMERAS + 1):
        cameras.append(take(arguments, source, os.path.join(folder, "cards-raw"), seed))
        show("card", cameras[-1])
    z = [value for views in cameras for value in z_values(views)]
    figure("cards.rel_error", max(max(relative_errors(views)) for views in cameras))
    figure("cards.z_max", max(map(abs, z)))
    figure("cards.z_max_expected", expected_largest(cameras))
    figure("cards.chi2_per_value", sum(map(chi_square, cameras)) / len(z))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default="build")
    parser.add_argument("--keep", help="keep the files there")
    parser.add_argument("--quick", action="store_true", help="three views, one camera")
    arguments = parser.parse_args()
    arguments.build = os.path.join(ROOT, arguments.build)
    with contextlib.ExitStack() as stack:
        folder = arguments.keep or stack.enter_context(tempfile.TemporaryDirectory())
        os.makedirs(folder, exist_ok=True)
        bench_cloth(arguments, folder)
        bench_cards(arguments, folder)
        bench_fault(arguments, folder, "exposures", "--exposure-error", 0.05)
        bench_fault(arguments, folder, "chart_fall", "--chart-fall", 0.2)


if __name__ == "__main__":
    main()
