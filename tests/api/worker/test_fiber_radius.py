"""The file of a cloth states fibers 1.3 times too thick. The search for the radius finds the true radius within its
standard error."""
import json
import os
import shutil
import struct
import subprocess

import pytest
from daemon_under_test import program

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
TRUTH_UM, FACTOR = 7.0, 1.3  # radius of the phantom's fibers: 7 voxels of 2 um in diameter
VIEWS = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n" + "".join(
    f"fit,{light},0,{camera},180,{turn}\n" for light, camera, turn in [(20, 20, 0), (45, 45, 0), (60, 0, 0), (60, 60, 90), (30, 0, 90), (70, 30, 90)])


def thicker(hair):
    """Returns the .hair file with every thickness multiplied."""
    data = bytearray(hair)
    strands, points, flags = struct.unpack_from("<III", data, 4)
    assert flags & 7 == 7
    at = 128 + 2 * strands + 12 * points
    thickness = struct.unpack_from(f"<{points}f", data, at)
    struct.pack_into(f"<{points}f", data, at, *[FACTOR * t for t in thickness])
    return bytes(data)


def test_radius_comes_back(tmp_path):
    sample, job = tmp_path / "sample", tmp_path / "job"
    (tmp_path / "views.csv").write_text(VIEWS)
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "12", "--out", str(sample)], check=True, capture_output=True)
    subprocess.run([program("selvedge-phantom"), "photograph", "--fibers", str(sample / "truth.hair"), "--out", str(sample),
                    "--table", str(tmp_path / "views.csv"),
                    "--px", "32", "--paths", "60000", "--seed", "2",
                    "--param", "C_TT=0.7,0.5,0.3", "--param", "beta_TT=15", "--param", "gamma_TT=20", "--quiet"], check=True)
    (job / "input").mkdir(parents=True)
    (job / "input" / "cloth.hair").write_bytes(thicker((sample / "truth.hair").read_bytes()))
    photographs = json.loads((sample / "photographs.json").read_text())
    for p in photographs:
        shutil.copy(sample / p["file"], job / "input")
    fit = {"model": "two_lobe.v1", "path_budget": 100000, "seed": 2, "fit_radius": True, "render_px": 8, "render_samples": 1,
           "fixed": {"C_R": 0.1, "beta_R": 5, "beta_TT": 15, "gamma_TT": 20}}
    (job / "job.json").write_text(json.dumps({"sample": "too thick", "fibers": {"file": "cloth.hair"}, "photographs": photographs, "fit": fit}))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(job)], check=True)
    result = json.loads((job / "results" / "result.json").read_text())
    radius = result["radius"]
    assert abs(radius["start_um"] - FACTOR * TRUTH_UM) < 1e-3 and radius["determined"] and not radius["at_bound"], radius
    assert abs(radius["radius_um"] - TRUTH_UM) < 2.5 * radius["standard_error_um"] and radius["standard_error_um"] < 0.1 * TRUTH_UM, radius
    assert abs(result["geometry"]["mean_radius_um"] - radius["radius_um"]) < 1e-3
