"""What a job reports about its geometry, through the daemon and the real worker: the quality report, warnings, and an
alignment that can be repeated by hand."""
import os
import subprocess

import pytest
from daemon_under_test import program
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"max_iterations": 1, "path_budget": 1000, "render_px": 8, "render_samples": 1}


@pytest.fixture(scope="module")
def phantom(tmp_path_factory):
    folder = tmp_path_factory.mktemp("phantom")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", str(folder)], check=True, capture_output=True)
    return folder


def run(d, cloth, files):
    job = d.create({"sample": "a <b>cloth</b>", **cloth, "measurements": {"file": "rows.csv"}, "fit": FIT})
    d.upload(job, "rows.csv", TABLE.encode(), "measurements")
    for name, role, data in files:
        d.upload(job, name, data, role)
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


def result(d, job):
    return d.wait_state(job, "succeeded", timeout_s=120)


def test_fibers_as_text_and_their_report(real, phantom):
    """The unit of a fiber file is wrong. The job runs, and every view of it shows a warning."""
    text = "\n".join(" ".join(f"{float(v) / 1000:.9g}" for v in line.split()) for line in (phantom / "truth.txt").read_text().splitlines())
    job = run(real, {"fibers": {"file": "cloth.txt", "tile_mm": [0.01, 0.01]}}, [("cloth.txt", "fibers", text.encode())])
    state = result(real, job)
    told = [w for w in state["warnings"] if "not that of a textile fiber" in w]
    assert len(told) == 1 and told[0] in state["result"]["warnings"]
    assert state["result"]["geometry"]["input"] == "fibers"
    listed = {f["path"]: f for f in real.get(f"/v1/jobs/{job}/results").json()["files"]}
    assert {"quality.html", "quality.css", "quality.json", "pictures/fiber-lengths.svg", "pictures/top.png"} <= set(listed)
    assert state["result"]["quality"] == {"page": "quality.html", "numbers": "quality.json"}
    page = real.get(listed["quality.html"]["url"])
    assert page.headers["Content-Type"].startswith("text/html")
    assert "a &lt;b&gt;cloth&lt;/b&gt;" in page.text and "<b>cloth" not in page.text and "not that of a textile fiber" in page.text
    assert "<script" not in page.text and "style=" not in page.text
    numbers = real.get(listed["quality.json"]["url"]).json()
    lengths = numbers["lengths"]
    n = numbers["geometry"]["n_fiber"]
    assert sum(lengths["n"]) == n == sum(map(sum, lengths["bin_count"])) and len(lengths["bin_edge_mm"]) == 25
    assert abs(sum(lengths["total_mm"]) - numbers["geometry"]["total_length_mm"]) < 1e-6
    assert lengths["shortest_mm"] <= lengths["p10_mm"] <= lengths["median_mm"] <= lengths["p90_mm"] <= lengths["longest_mm"]


def test_alignment_and_crop_can_be_repeated(real, phantom):
    scan = (phantom / "scan.tif").read_bytes()
    volume = {"files": ["scan.tif"], "voxel_size_um": 2.0}
    turned = {**volume, "matrix": [0.9962, -0.0872, 0, 0.0872, 0.9962, 0, 0, 0, 1]}  # 5 degrees
    jobs = [run(real, {"volume": v}, [("scan.tif", "volume", scan)]) for v in ({**volume, "align": "auto", "crop": "auto", "crop_keep": 0.6}, turned)]
    found, corners = (result(real, j)["result"] for j in jobs)
    g = found["geometry"]
    assert g["alignment"]["outcome"] == "found" and abs(g["alignment"]["rotation_deg"]) < 3
    assert g["grade"]["verdict"] in ("resolved", "partly") and 0.5 < g["grade"]["safe_share"] <= 1
    assert g["crop"]["keep"] == 0.6 and len(g["crop"]["mismatch"]) == 2
    assert all(r > 0 for r in g["seam_density"]["ratio"]) and len(g["direction_noise_deg"]) == 2
    seam = g["seam_fibers"]
    assert seam["n_joined"] > 0 and all(len(seam[k]) == 2 for k in ("n_end", "offset_um", "angle_deg", "step_inside", "warp_um", "shift_um"))
    for a in range(2):  # joining closes the seam: more ends continue, and closer
        assert seam["found"]["continued"][a] <= seam["continued"][a] and seam["continued"][a] > 0.6
        assert seam["offset_um"][a] < 0.5 * seam["found"]["offset_um"][a] and 0 <= seam["step"][a] <= 1
    assert any("corners from outside of the scan" in w for w in corners["warnings"]) and corners["geometry"]["alignment"] is None
    options = g["options"]
    by_hand = {**volume, "matrix": options["matrix"]}
    if options["crop_voxel"]:
        by_hand["crop_voxel"] = options["crop_voxel"]
    again = result(real, run(real, {"volume": by_hand}, [("scan.tif", "volume", scan)]))["result"]["geometry"]
    assert again["n_voxel"] == g["n_voxel"]
    assert abs(again["dice"] - g["dice"]) < 0.02 and abs(again["n_fiber"] - g["n_fiber"]) <= 2


def test_empty_slice_is_refused_at_once(real):
    job = real.create({"sample": "stack", "volume": {"files": ["s0.tif", "s1.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"}})
    answer = real.post(f"/v1/jobs/{job}/files", json={"name": "s1.tif", "role": "volume", "size": 0, "sha256": None})
    assert answer.status_code == 422 and answer.json()["field"] == "size" and "s1.tif" in answer.json()["detail"]
