"""Measured BRDFs of RGL's format in a job, written by a program of their own: analytic BRDFs come back as radiances, and as Mitsuba 3 evaluates
the same file where it is installed (make bench-exports does that)."""
import json
import math
import os
import subprocess

import pytest
from daemon_under_test import program
from rgl_file import RglWriter, direction
from small_cloth import hair

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
PYTHON = os.path.join(os.path.dirname(os.path.dirname(program("selvedge-worker"))), "exports-python", "bin", "python")
SUPPORT = os.path.join(os.path.dirname(__file__), "..", "..", "support", "python")
ANGLES = [(20, 0, 20, 180), (45, 30, 45, 210), (60, 5, 20, 95), (10, 300, 60, 20), (35, 135, 50, -100), (65, 80, 5, 0)]
HALF_TURN = [-math.pi + k * math.pi / 8 for k in range(9)]


def measured(real, tmp_path, writer):
    """The rows that a job makes of the file, in the order of ANGLES."""
    writer.write(tmp_path / "m.bsdf")
    keys = ("light_theta_deg", "light_phi_deg", "camera_theta_deg", "camera_phi_deg")
    rows = [dict(zip(keys, a), set="fit" if i < 4 else "held-out") for i, a in enumerate(ANGLES)]
    job = real.create({"sample": "brdf", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "lamp": {"kind": "directional"},
                       "measurements": {"file": "m.bsdf", "configurations": rows}, "fit": {"path_budget": 20000, "render_px": 8, "render_samples": 1}})
    real.upload(job, "cloth.hair", hair(), "fibers")
    real.upload(job, "m.bsdf", (tmp_path / "m.bsdf").read_bytes(), "measurements")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    return real.wait_state(job, "succeeded", timeout_s=120)["result"]["rows"]


def pairs():
    return [(direction(math.radians(a), math.radians(b)), direction(math.radians(c), math.radians(d))) for a, b, c, d in ANGLES]


def half_vector(light, camera):
    h = [a + b for a, b in zip(light, camera)]
    return [x / math.sqrt(sum(y * y for y in h)) for x in h]


def lobe(light, camera):
    h = half_vector(light, camera)
    return 0.2 + 0.3 * math.exp(-((h[0] / 0.8) ** 2) - (h[1] / 0.6) ** 2)


@pytest.mark.slow
def test_a_diffuse_brdf_comes_back(real, tmp_path):
    albedo = (0.6, 0.3, 0.1)
    rows = measured(real, tmp_path, RglWriter(lambda light, camera: [a / math.pi for a in albedo], n_vndf=16, n_sample=16))
    for row, (light, _) in zip(rows, pairs()):
        assert row["measured"] == pytest.approx([a * light[2] for a in albedo], rel=0.03)


@pytest.mark.slow
def test_an_anisotropic_brdf_comes_back_and_mitsuba_sees_the_same(real, tmp_path):
    writer = RglWriter(lambda light, camera: [lobe(light, camera)] * 16, phi_i=HALF_TURN, n_vndf=16, n_sample=16, wavelengths=range(400, 701, 20))
    rows = measured(real, tmp_path, writer)
    for row, (light, camera) in zip(rows, pairs()):
        assert row["measured"] == pytest.approx([math.pi * lobe(light, camera) * light[2]] * 3, rel=0.08)
    if not os.access(PYTHON, os.X_OK):
        pytest.skip("the values are right; no Mitsuba to compare with (make bench-exports installs it)")
    done = subprocess.run([PYTHON, os.path.join(SUPPORT, "mitsuba_brdf.py"), str(tmp_path / "m.bsdf")], input=json.dumps(pairs()), capture_output=True,
                          text=True, check=True)
    for row, theirs, (light, camera) in zip(rows, json.loads(done.stdout), pairs()):
        assert row["measured"] == pytest.approx([math.pi * theirs / camera[2] * light[2]] * 3, rel=1e-4)
