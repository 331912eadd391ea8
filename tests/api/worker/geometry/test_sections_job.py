"""Sections along the fibers of a scan of flat fibers whose radius varies: they are in the result, on the quality page and in
the fiber files, and come back with these files in another job."""
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flat")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "felt", "--aspect", "2.2", "--taper", "0.4", "--felt-tile-um", "170",
                    "--felt-thickness-um", "60", "--fibers-per-yarn", "30", "--seed", "3", "--out", str(folder)], check=True, capture_output=True)
    return folder


def test_sections_are_measured_shown_and_read_back(real, scan):
    first = real.create({"sample": "flat felt", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}})
    real.upload(first, "scan.tif", (scan / "scan.tif").read_bytes(), "volume")
    assert real.post(f"/v1/jobs/{first}/start").status_code == 202
    geometry = real.wait_state(first, "succeeded", timeout_s=240)["result"]["geometry"]
    found = geometry["sections"]
    assert found["measured_share"] == 1.0 and 1.3 < found["axis_ratio_median"] < 1.9 and found["flat_share"] > 0.6
    assert 0 < found["axis_ratio_error"] < 0.1 and 0 < found["angle_error_deg"] < 6
    assert found["n_varying_radius"] > 0.5 * geometry["n_fiber"] and 0.05 < found["radius_variation"] < 0.25
    assert 0 < found["radius_variation_error"] < 0.05 and sum(found["bin_share"]) == pytest.approx(1.0)
    page = real.get(f"/v1/jobs/{first}/results/quality.html").text
    assert "Sections of the fibers" in page and "fiber-sections.svg" in page and f"{found['n_varying_radius']} of {geometry['n_fiber']}" in page
    assert b"<rect" in real.get(f"/v1/jobs/{first}/results/pictures/fiber-sections.svg").content

    # the same in both files: twelve numbers in a line of text, of which those of a fiber differ
    lines = real.get(f"/v1/jobs/{first}/results/fibers.txt").text.split("\n\n")[0].splitlines()
    assert all(len(line.split()) == 12 for line in lines) and len({line.split()[5] for line in lines}) > 3
    results = {}
    for name in ("fibers.hair", "fibers.txt"):
        document = {"sample": "again", "fibers": {"file": name, "tile_mm": geometry["tile_mm"]}, "measurements": {"file": "rows.csv"},
                    "fit": {"model": "textile.v3", "max_iterations": 1, "path_budget": 1000, "render_px": 8, "render_samples": 1}}
        job = real.create(document)
        real.upload(job, name, real.get(f"/v1/jobs/{first}/results/{name}").content, "fibers")
        real.upload(job, "rows.csv", TABLE.encode(), "measurements")
        assert real.post(f"/v1/jobs/{job}/start").status_code == 202
        results[name] = real.wait_state(job, "succeeded", timeout_s=120)["result"]["geometry"]
        again = results[name]["sections"]
        assert again["n_varying_radius"] == found["n_varying_radius"]
        for key in ("axis_ratio_median", "axis_ratio_error", "angle_error_deg", "radius_variation"):
            assert again[key] == pytest.approx(found[key], rel=1e-3)
