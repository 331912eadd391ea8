"""Lumens of the single fibers of a scan of hollow fibers: they are in the result, on the quality page and in both fiber files."""
import os
import struct
import subprocess

import pytest
from daemon_under_test import program

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hollow")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "felt", "--lumen", "0.6", "--lumen-spread", "0.7", "--felt-tile-um", "150",
                    "--felt-thickness-um", "50", "--fibers-per-yarn", "24", "--seed", "3", "--out", str(folder)], check=True, capture_output=True)
    return folder


def test_lumens_are_measured_shown_and_written(real, scan):
    job = real.create({"sample": "hollow felt", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0, "hollow_fibers": True}})
    real.upload(job, "scan.tif", (scan / "scan.tif").read_bytes(), "volume")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    geometry = real.wait_state(job, "succeeded", timeout_s=240)["result"]["geometry"]
    found = geometry["sections"]
    assert geometry["hollow_fibers"] and found["lumen_told_share"] > 0.8
    assert 0.25 < found["lumen_median"] < 0.55 and found["lumen_p10"] < found["lumen_median"] < found["lumen_p90"] < 0.75
    assert 0 < found["lumen_error"] < 0.1
    page = real.get(f"/v1/jobs/{job}/results/quality.html").text
    assert "width of the lumens" in page and "length whose lumen the scan tells" in page

    # fourteen numbers in a line of text; nine for each point at the end of the binary file
    lines = real.get(f"/v1/jobs/{job}/results/fibers.txt").text.split("\n\n")[0].splitlines()
    assert all(len(line.split()) == 14 for line in lines)
    hair = real.get(f"/v1/jobs/{job}/results/fibers.hair").content
    assert b" lumens" in hair[:128]
    points = struct.unpack("<I", hair[8:12])[0]
    first = struct.unpack("<9f", hair[len(hair) - 36 * points:len(hair) - 36 * (points - 1)])
    assert first[7] == pytest.approx(float(lines[0].split()[12]), abs=1e-3) and first[8] == pytest.approx(float(lines[0].split()[13]), rel=1e-2)
