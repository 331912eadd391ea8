"""A simulated camera of known noise, colors and vignetting: `selvedge calibrate-camera` and `selvedge photo --job` through the client, and a job
with a chart, several exposures and a rig through the daemon to result.json."""
import json
import math
import os
import random
import subprocess
import sys

import pytest
from daemon_under_test import program
from small_cloth import hair
from small_tiff import tiff16

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bench"))
from png_picture import read_png  # noqa: E402

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
READ_MEAN, READ_VAR, DARK_PER_S, DARK_VAR, SHOT_VAR, GAIN = 120, 25, 40, 6, 0.8, 200000
CAMERA = ((0.61, 0.22, 0.05), (0.11, 0.74, 0.09), (0.02, 0.18, 0.48))  # radiance to camera rgb
VIGNETTING = {"center_px": [90, 60], "radius_px": 150, "a": [-0.2, 0, 0]}
RIG = {"selvedge_rig": 1, "lamps": {"near": {"theta_deg": 20, "phi_deg": 0}, "far": {"theta_deg": 45, "phi_deg": 0, "distance_cm": 122}},
       "cameras": {"a": {"theta_deg": 20, "phi_deg": 180}, "b": {"theta_deg": 60, "phi_deg": 90}},
       "views": {"v1": {"lamp": "near", "camera": "a"}, "v2": {"lamp": "near", "camera": "b", "cloth_rotation_deg": 90},
                 "v3": {"lamp": "far", "camera": "a"}}, "lens": {"vignetting": VIGNETTING}}
TRUTH = {"v1": (0.55, 0.42, 0.3), "v2": (0.05, 0.03, 0.02), "v3": (0.2, 0.15, 0.1)}  # from lamp.distance_cm; v3 shows a quarter of it
# X-Rite, charts from November 2014 on, CIE L*a*b* under D50; taken from colour-science 0.4.7, "ColorChecker24 - After November 2014"
LAB = [(37.54, 14.37, 14.92), (64.66, 19.27, 17.5), (49.32, -3.82, -22.54), (43.46, -12.74, 22.72), (54.94, 9.61, -24.79), (70.48, -32.26, -0.37),
       (62.73, 35.83, 56.5), (39.43, 10.75, -45.17), (50.57, 48.64, 16.67), (30.1, 22.54, -20.87), (71.77, -24.13, 58.19), (71.51, 18.24, 67.37),
       (28.37, 15.42, -49.8), (54.38, -39.72, 32.27), (42.43, 51.05, 28.62), (81.8, 2.67, 80.41), (50.63, 51.28, -14.12), (49.57, -29.71, -28.32),
       (95.19, -1.03, 2.93), (81.29, -0.57, 0.44), (66.89, -0.75, -0.06), (50.76, -0.13, 0.14), (35.63, -0.46, -0.48), (20.64, 0.07, -0.46)]


def reflectance(lab):
    """Linear sRGB of CIE L*a*b* under D50, adapted by Bradford."""
    fy = (lab[0] + 16) / 116
    xyz = [w * (f**3 if f > 6 / 29 else (116 * f - 16) * 27 / 24389) for w, f in zip((0.96422, 1, 0.82521), (fy + lab[1] / 500, fy, fy - lab[2] / 200))]
    return [sum(m * x for m, x in zip(row, xyz)) for row in
            ((3.1338561, -1.6168667, -0.4906146), (-0.9787684, 1.9161415, 0.0334540), (0.0719453, -0.2289914, 1.4052427))]


def shot(rng, width, height, radiance, t):
    """What the camera writes after t seconds of radiance(x, y)."""
    values = []
    for i in range(width * height):
        x, y = i % width + 0.5, i // width + 0.5
        r2 = sum((a - b) ** 2 for a, b in zip((x, y), VIGNETTING["center_px"])) / VIGNETTING["radius_px"] ** 2
        light = radiance(x, y)
        for row in CAMERA:
            signal = t * GAIN * (1 + VIGNETTING["a"][0] * r2) * sum(m * v for m, v in zip(row, light))
            deviation = math.sqrt(READ_VAR + DARK_VAR * t + SHOT_VAR * max(signal, 0))
            values.append(READ_MEAN + DARK_PER_S * t + signal + rng.gauss(0, deviation))
    return tiff16(width, height, values, t)


def chart(x, y):
    """Radiance of a chart with patches of 25 pixels and gaps of 2.5, whose first corner is at (8, 8)."""
    u, v = (x - 8) / 27.5, (y - 8) / 27.5
    inside = 0 <= u < 6 and 0 <= v < 4 and u % 1 < 25 / 27.5 and v % 1 < 25 / 27.5
    return reflectance(LAB[int(v) * 6 + int(u)]) if inside else (0.03, 0.03, 0.03)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Frames of the camera, the record that calibrate-camera makes of them, a job document and its photographs."""
    path, rng = tmp_path_factory.mktemp("camera"), random.Random(3)
    frames = {f"dark-{t}-{k}.tif": ((0, 0, 0), t) for t in (0.05, 2) for k in (0, 1)}
    frames |= {f"flat-{k}.tif": ((0.4, 0.4, 0.4), 0.5) for k in (0, 1)}
    for name, (light, t) in frames.items():
        (path / name).write_bytes(shot(rng, 64, 64, lambda x, y, light=light: light, t))
    command = [program("selvedge"), "calibrate-camera", "--transfer", "linear", "--dark", *(str(path / n) for n in frames if n[0] == "d"),
               "--flat", *(str(path / n) for n in frames if n[0] == "f"), "--out", str(path / "noise.json")]
    subprocess.run(command, capture_output=True, text=True, check=True)
    photographs = []
    for view, light in TRUTH.items():
        seen = [v / (4 if view == "v3" else 1) for v in light]
        for t in (0.05, 1):
            (path / f"{view}-{t}.tif").write_bytes(shot(rng, 24, 24, lambda x, y, seen=seen: seen, t))
        photographs.append({"file": f"{view}-1.tif", "more_exposures": [{"file": f"{view}-0.05.tif"}], "view": view, "transfer": "linear",
                            "set": "fit" if view != "v3" else "held-out"})
    (path / "chart.tif").write_bytes(shot(rng, 178, 124, chart, 0.2))
    (path / "rig.json").write_text(json.dumps(RIG))
    (path / "cloth.hair").write_bytes(hair())
    corners = [8, 8, 8 + 162.5, 8, 8 + 162.5, 8 + 107.5, 8, 8 + 107.5]
    document = {"sample": "camera", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "rig": {"file": "rig.json"}, "camera": {"noise_file": "noise.json"},
                "color": {"chart": {"file": "chart.tif", "transfer": "linear", "edition": "from_2014", "corners_px": corners}},
                "photographs": photographs, "fit": {"path_budget": 20000, "render_px": 8, "render_samples": 1}}
    (path / "job.json").write_text(json.dumps(document))
    return path


def test_calibrate_camera(folder):
    record = json.loads((folder / "noise.json").read_text())
    for key, truth, rel in (("read_mean_dn", READ_MEAN, 0.02), ("read_var_dn2", READ_VAR, 0.15), ("dark_mean_dn_per_s", DARK_PER_S, 0.05),
                            ("dark_var_dn2_per_s", DARK_VAR, 0.4), ("shot_var_dn", SHOT_VAR, 0.1)):
        assert record[key] == pytest.approx([truth] * 3, rel=rel), key
    assert record["iso"] == 100 and record["n_dark"] == 4 and record["n_flat"] == 2


def test_photo_shows_the_photographs_of_a_job(folder):
    done = subprocess.run([program("selvedge"), "photo", "--job", str(folder / "job.json")], capture_output=True, text=True, check=True)
    means = [[float(v) for v in line.split()[2:]] for line in done.stdout.splitlines() if line.split()[:2] == ["mean", "rgb"]]
    for mean, light in zip(means, TRUTH.values(), strict=True):
        assert mean == pytest.approx(light, rel=0.02)
    assert "colors" in done.stdout and "CIEDE2000" in done.stdout


def test_photo_draws_the_photographs_of_a_job(folder, tmp_path):
    """Each as it is developed, as a whole, with its crop; a photograph that cannot be used is drawn, too."""
    document = json.loads((folder / "job.json").read_text())
    document["photographs"][0]["crop_px"] = [4, 6, 20, 22]
    document["photographs"][1]["crop_px"] = [4, 6, 200, 22]
    (folder / "cropped.json").write_text(json.dumps(document))
    done = subprocess.run([program("selvedge"), "photo", "--job", str(folder / "cropped.json"), "--out", str(tmp_path / "look")],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "v2-1.tif" in done.stderr  # its crop is larger than the picture
    assert sorted(os.listdir(tmp_path / "look")) == ["color-chart.png", "v1-1.tif.png", "v2-1.tif.png", "v3-1.tif.png"]
    rows = read_png(str(tmp_path / "look" / "v1-1.tif.png"))
    assert len(rows) == 24 and all(len(row) == 3 * 24 for row in rows)
    red = {(x, y) for y, row in enumerate(rows) for x in range(24) if row[3 * x:3 * x + 3] == b"\xff\0\0"}
    assert red == {(x, y) for x in range(4, 20) for y in range(6, 22) if x in (4, 19) or y in (6, 21)}


@pytest.mark.slow
def test_a_job_of_raw_exposures(real, folder):
    document = json.loads((folder / "job.json").read_text())
    job = real.create(document)
    roles = {"cloth.hair": "fibers", "rig.json": "rig", "noise.json": "camera_noise", "chart.tif": "chart"}
    roles |= {f"{view}-{t}.tif": "photograph" for view in TRUTH for t in (1, 0.05)}
    for name, role in roles.items():
        real.upload(job, name, (folder / name).read_bytes(), role)
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    result = real.wait_state(job, "succeeded", timeout_s=120)["result"]
    for row, (view, light) in zip(result["rows"], TRUTH.items(), strict=True):
        assert row["measured"] == pytest.approx(light, rel=0.02), row["name"]
        assert row["photograph"]["n_exposure"] == 2 and all(0 < x < 0.01 for x in row["photograph"]["noise_se"])
        assert row["set"] == ("held-out" if view == "v3" else "fit")
        lamp, camera = RIG["lamps"][RIG["views"][view]["lamp"]], RIG["cameras"][RIG["views"][view]["camera"]]
        assert (row["light_theta_deg"], row["camera_theta_deg"]) == pytest.approx((lamp["theta_deg"], camera["theta_deg"]))
    color = result["color"]
    assert color["edition"] == "from_2014" and not color["found_automatically"]
    assert color["delta_e_2000_after"]["mean"] < 1 < color["delta_e_2000_before"]["mean"]
