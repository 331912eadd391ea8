"""A job of geometry only: a scan without photographs. A later job goes on from its geometry without making it again, also
when the first job is deleted meanwhile."""
import json
import os
import subprocess
import time

import pytest
from daemon_under_test import problem, program
from small_cloth import TABLE

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
FIT = {"max_iterations": 1, "path_budget": 1000, "render_px": 8, "render_samples": 1}
ROWS = {"measurements": {"file": "rows.csv"}, "fit": FIT}


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("phantom")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--metaimage", "--out", str(folder)],
                   check=True, capture_output=True)
    return folder


def start(d, document, files):
    job = d.create({"sample": "cloth", **document})
    for name, role, data in files:
        d.upload(job, name, data, role)
    assert d.post(f"/v1/jobs/{job}/start").status_code == 202
    return job


def test_geometry_alone_and_a_job_that_goes_on_from_it(real, scan):
    first = start(real, {"volume": {"files": ["scan.tif"], "voxel_size_um": 2.0, "trial": True}}, [("scan.tif", "volume", (scan / "scan.tif").read_bytes())])
    state = real.wait_state(first, "succeeded", timeout_s=120)
    made = state["result"]
    assert made["parameters"] == made["rows"] == made["models"] == [] and made["model"] is None
    assert made["geometry"]["n_fiber"] > 20 and made["geometry"]["grade"]["verdict"] == "resolved" and made["geometry"]["from_job"] is None
    trial = made["geometry"]["trial"]
    assert trial["recall"] > 0.9 and trial["axis_rms_voxel"] < 0.5 and trial["n_true"] == made["geometry"]["n_fiber"]
    assert trial["axis_ratio"] == 1 and trial["lumen"] == trial["lumen_spread"] == 0 and trial["lumen_rms"] is None and 0 <= trial["radius_spread"] < 0.1
    assert 0 <= trial["recall_error"] < 0.05 and 0 <= trial["fragments_error"] < 0.2
    assert 3 < trial["signal_to_noise"] < 8 and trial["noise_sd_voxel"] < 0.4 and 0.4 < trial["blur_sd_voxel"] < 1.0
    done = {s["name"]: s["wall_s"] for s in made["stages"]}
    assert done["directions"] is not None and done["scene"] is None and done["fit"] is None
    listed = {f["path"] for f in real.get(f"/v1/jobs/{first}/results").json()["files"]}
    assert {"result.json", "summary.txt", "fibers.hair", "direction.vol", "density.vol", "quality.html", "pictures/slice-x.png",
            "scan/x.slices", "scan/y.slices", "scan/z.slices", "scan/fibers.hair", "scan/contrast.u8"} <= listed

    second = start(real, {"geometry": {"job": first}, **ROWS}, [("rows.csv", "measurements", TABLE.encode())])
    fitted = real.wait_state(second, "succeeded", timeout_s=120)["result"]
    assert fitted["geometry"]["from_job"] == first and len(fitted["parameters"]) > 3
    for key in ("n_fiber", "total_length_mm", "radius_um", "dice", "grade", "trial", "options"):
        assert fitted["geometry"][key] == made["geometry"][key]
    wall_s = {s["name"]: s["wall_s"] for s in fitted["stages"]}
    assert all(wall_s[stage] is None for stage in ("volume", "orientation", "fibers", "directions")) and wall_s["fit"] is not None
    hair = [real.get(f"/v1/jobs/{job}/results/fibers.hair").content for job in (first, second)]
    assert hair[0] == hair[1]

    shared = [os.stat(os.path.join(real.data, "jobs", job, "work", "fibers", "fibers.bin")) for job in (first, second)]
    assert shared[0].st_ino == shared[1].st_ino and shared[0].st_mode & 0o777 == 0o400, "no worker may write to what two jobs have"

    # Its own checkpoints: the first job may go, and the second can be retried or gone on from.
    assert real.delete(f"/v1/jobs/{first}").status_code in (202, 204)
    third = start(real, {"geometry": {"job": second}, **ROWS}, [("rows.csv", "measurements", TABLE.encode())])
    assert real.wait_state(third, "succeeded", timeout_s=120)["result"]["geometry"]["n_fiber"] == made["geometry"]["n_fiber"]
    until = time.monotonic() + 30
    while real.get(f"/v1/jobs/{first}").status_code != 404 and time.monotonic() < until:
        time.sleep(0.05)
    lost = real.create({"sample": "cloth", "geometry": {"job": first}, **ROWS})
    real.upload(lost, "rows.csv", TABLE.encode(), "measurements")
    assert "does not exist" in problem(real.post(f"/v1/jobs/{lost}/start"), 422, "invalid", "geometry.job")["detail"]


def reconstruct(d, *words):
    return subprocess.run([program("selvedge"), "reconstruct", *map(str, words)], env=dict(os.environ, SELVEDGE_SERVER=d.url, SELVEDGE_TOKEN=""),
                          capture_output=True, text=True, timeout=1500)


def test_command_line(real, scan, tmp_path):
    """The header names its data file, which is sent too, and states the voxel size."""
    done = reconstruct(real, scan / "scan.mhd", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "2 files in place" in done.stderr and "single fibers in the scan: resolved" in done.stdout and "fitted parameters" not in done.stdout
    assert json.loads((tmp_path / "out" / "result.json").read_text())["geometry"]["voxel_size_um"] == pytest.approx([2, 2, 2])
    assert (tmp_path / "out" / "fibers.hair").stat().st_size > 1000


@pytest.mark.parametrize("name,header,sent", [
    ("a.mhd", "NDims = 3\nElementDataFile = b.raw\n", ["a.mhd", "b.raw"]), ("A.MHD", "elementdatafile=LOCAL\n", ["A.MHD"]),
    ("a.nhdr", "NRRD0004\ndatafile: b.raw\n", ["a.nhdr", "b.raw"]), ("a.nhdr", "NRRD0004\nData File: b.raw\n", ["a.nhdr", "b.raw"]),
    ("a.hdr", "-", ["a.hdr", "a.img"]), ("slices/1.TIF", "II*", ["1.TIF"]),
])
def test_files_of_a_scan(real, tmp_path, name, header, sent):
    """The worker refuses these scans, but the client finds their files."""
    scan = tmp_path / name
    scan.parent.mkdir(exist_ok=True)
    scan.write_text(header)
    (tmp_path / "b.raw").write_bytes(b"0")
    (tmp_path / "a.img").write_bytes(b"0")
    done = reconstruct(real, scan.parent if name.startswith("slices") else scan, "--voxel-um", "2", "--id-file", tmp_path / "id")
    assert done.returncode != 0
    job = real.get(f"/v1/jobs/{(tmp_path / 'id').read_text().strip()}").json()
    assert sorted(f["name"] for f in job["files"]) == sorted(sent), done.stderr


def test_what_the_command_line_says_of_fibers(real, tmp_path):
    """The document of the job has it; the worker refuses the scan."""
    (tmp_path / "scan.tif").write_bytes(b"II*")
    reconstruct(real, tmp_path / "scan.tif", "--voxel-um", "2", "--hollow", "no", "--diameter-voxel", "7.5", "--trial", "--id-file", tmp_path / "id")
    volume = real.get(f"/v1/jobs/{(tmp_path / 'id').read_text().strip()}").json()["document"]["volume"]
    assert volume["hollow_fibers"] is False and volume["fiber_diameter_voxel"] == 7.5 and volume["trial"] is True


@pytest.mark.parametrize("words,text", [
    (["nothing.tif"], "cannot read the scan 'nothing.tif'"), ([".", "--voxel-um", "2"], "has no TIFF or DICOM files"),
    (["lost.mhd"], "does not name its data file"), *((["scan.tif", "--voxel-um", um], "--voxel-um") for um in ("2,3", "2,,3", "2,", "-2")),
    (["scan.tif", "--hollow", "maybe"], "'--hollow' takes yes or no: 'maybe'"),
    (["scan.tif", "--diameter-voxel", "0"], "'--diameter-voxel' takes a number above 0"),
    (["scan.tif", "--diameter-voxel", "7px"], "'7px'"),
])
def test_command_line_errors(real, tmp_path, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    if words[0] == "scan.tif":
        (tmp_path / "scan.tif").write_bytes(b"II*")
    (tmp_path / "lost.mhd").write_text("NDims = 3\n")
    done = reconstruct(real, *words)
    assert done.returncode == 1 and text in done.stderr, done.stderr


@pytest.mark.parametrize("document,field,text", [
    ({"volume": {"files": ["a.tif"]}, "fit": FIT}, "photographs", "'fit' is given"),
    ({"fibers": {"file": "a.hair"}}, "photographs", "missing"),
    ({"geometry": {"job": "x"}}, "photographs", "missing"),
    ({"geometry": {"job": "../x"}, **ROWS}, "geometry.job", "not the id of a job"),
    ({"geometry": {"job": "x"}, "volume": {"files": ["a.tif"]}, **ROWS}, "geometry", "one of them"),
])
def test_documents_that_are_refused(real, document, field, text):
    reply = real.post("/v1/jobs", json={"sample": "s", **document})
    assert reply.status_code == 422 and reply.json()["field"] == field and text in reply.json()["detail"]


def test_a_large_tile_of_several_repeats(tmp_path):
    """A scan of two repeats along each edge: moves by half of it, and with noise perhaps by a yarn of both directions; all ends go on."""
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--yarns", "4,4", "--fibers-per-yarn", "7", "--out", str(tmp_path / "cloth")],
                   check=True, capture_output=True)
    (tmp_path / "job/input").mkdir(parents=True)
    os.rename(tmp_path / "cloth/scan.tif", tmp_path / "job/input/scan.tif")
    (tmp_path / "job/job.json").write_text(json.dumps({"sample": "s", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0, "tiles": 3}}))
    subprocess.run([program("selvedge-worker"), "--quiet", str(tmp_path / "job")], check=True, timeout=300)
    made = json.loads((tmp_path / "job/results/result.json").read_text())
    tiles = made["geometry"]["seam_fibers"]["tiles"]
    assert 4 <= tiles["n_move"] <= 9 and tiles["n_cut_end"] > 100 and tiles["n_free"] < 0.1 * tiles["n_cut_end"], tiles
    assert not [w for w in made["warnings"] if "shows no repeat" in w]
    picture = {"on": "flat", "px": 8, "samples": 1, "light_theta_deg": 30, "light_phi_deg": 0, "camera_theta_deg": 0, "camera_phi_deg": 0}
    document = json.loads((tmp_path / "job/job.json").read_text())
    document.update({"fit": {"model": "phase_isotropic.v1", "fixed": {"alpha": [0.9, 0.9, 0.9]}}, "pictures": [picture]})
    (tmp_path / "job/job.json").write_text(json.dumps(document))
    subprocess.run([program("selvedge-worker"), "--quiet", str(tmp_path / "job")], check=True, timeout=300)
    warnings = json.loads((tmp_path / "job/results/result.json").read_text())["warnings"]
    assert [w for w in warnings if "'volume.tiles'" in w and "voxels of the scan" in w], warnings
