"""Errors of scanned fibers in those of the scattering parameters, through the daemon and the real worker."""
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"max_iterations": 2, "path_budget": 60000, "render_px": 8, "render_samples": 1}


def result(d, cloth, name, role, data):
    job = d.create({"sample": "cloth", **cloth, "measurements": {"file": "rows.csv"}, "fit": FIT})
    d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    d.upload(job, name, data, role)
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return d.wait_state(job, "succeeded", timeout_s=120)["result"]


def test_errors_of_fibers_are_carried(real, tmp_path):
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", str(tmp_path)],
                   check=True, capture_output=True)
    scanned = result(real, {"volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}}, "scan.tif", "volume", (tmp_path / "scan.tif").read_bytes())
    geometry = scanned["geometry"]
    assert 0.2 < geometry["axis_direction_error_deg"] < 3 and 0.01 < geometry["axis_position_error_um"] < 0.5
    assert abs(geometry["radius_profile_um"] / geometry["radius_um"][0] - 1) < 0.1
    for p in scanned["parameters"]:
        assert 0 <= p["standard_error_of_fibers"] and p["standard_error"] > 0
    assert any(p["standard_error_of_fibers"] > 0 for p in scanned["parameters"])
    given = result(real, {"fibers": {"file": "truth.hair"}}, "truth.hair", "fibers", (tmp_path / "truth.hair").read_bytes())
    assert all("standard_error_of_fibers" not in p for p in given["parameters"])
