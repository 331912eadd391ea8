"""The real worker under the daemon: a small job from scan to results, kills in the middle of the fit, and invalid
input."""
import io
import json
import math
import os
import struct
import subprocess
import tarfile
import time

import pytest
from daemon_under_test import Daemon, problem, program, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]

HEAD = "set,index,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b\n"
ROWS = [f"fit,{i},{lt},0,{ct},180,{rot},0.{10 + i},0.{12 + i},0.{15 + i}" for i, (lt, ct, rot) in enumerate(
    [(20, 20, 0), (45, 45, 0), (60, 0, 0), (20, 45, 90), (45, 20, 90), (60, 60, 90)])] + ["held-out,0,30,0,30,90,all,0.12,0.14,0.17"]
TABLE = (HEAD + "\n".join(ROWS) + "\n").encode()


def tiff(pages, width=24, height=24, value=lambda page, x, y: 0):
    """Returns a multi-page 8-bit TIFF. pages: a list of (width, height), or a count."""
    sizes = [(width, height)] * pages if isinstance(pages, int) else pages
    out, offsets = bytearray(b"II*\0\0\0\0\0"), []
    for k, (w, h) in enumerate(sizes):
        data = len(out)
        out += bytes(value(k, x, y) for y in range(h) for x in range(w))
        out += b"\0" * (len(out) % 2)
        offsets.append(len(out))
        tags = [(256, 3, w), (257, 3, h), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, data), (277, 3, 1), (278, 3, h), (279, 4, w * h)]
        out += struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", t, kind, 1, v) for t, kind, v in tags) + b"\0\0\0\0"
    struct.pack_into("<I", out, 4, offsets[0])
    for here, following in zip(offsets, offsets[1:]):
        struct.pack_into("<I", out, here + 2 + 9 * 12, following)
    return bytes(out)


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    folder = tmp_path_factory.mktemp("phantom")
    if not os.access(program("selvedge-phantom"), os.X_OK):
        pytest.skip("no selvedge-phantom in the build folder")
    subprocess.run([program("selvedge-phantom"), "cloth", "--weave", "plain", "--fibers-per-yarn", "7", "--out", str(folder)],
                   check=True, capture_output=True)
    return (folder / "scan.tif").read_bytes()


def document(**fit):
    return {"sample": "small plain weave", "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0}, "measurements": {"file": "rows.csv"},
            "fit": {"model": "two_lobe.v1", "seed": 3, "max_iterations": 4, "path_budget": 80000, "render_px": 16, "render_samples": 4, **fit}}


def submit(d, scan, table=TABLE, **fit):
    job = d.create(document(**fit))
    d.upload(job, "scan.tif", scan, "volume")
    d.upload(job, "rows.csv", table, "measurements")
    r = d.post(f"/v1/jobs/{job}/start")
    assert r.status_code == 202, r.text
    return job


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    with Daemon(tmp_path_factory.mktemp("real") / "data", worker=program("selvedge-worker"), options={"jobs.cancel_grace_s": 20}) as d:
        yield d


@pytest.fixture(scope="module")
def finished(real, scan):
    job = submit(real, scan)
    seen = []
    while True:
        j = real.job(job)
        seen.append((j["fraction"], j["stage"], j["eta_s"]))
        if j["state"] not in ("queued", "running"):
            break
        time.sleep(0.05)
    assert j["state"] == "succeeded", j["error"]
    return job, seen


def test_from_scan_to_results(real, finished):
    job, seen = finished
    fractions = [f for f, _, _ in seen]
    falls = [(i, *seen[i:i + 2]) for i, (a, b) in enumerate(zip(fractions, fractions[1:])) if b < a - 1e-9]
    assert not falls and fractions[-1] == 1, falls
    stages = [s["name"] for s in real.get("/v1/about").json()["stages"]]
    passed = [stages.index(s) for _, s, _ in seen if s]
    assert passed == sorted(passed) and len(set(passed)) >= 2  # a short stage may pass between two polls
    j = real.job(job)
    assert j["parameters"] and all({"name", "value", "standard_error"} <= set(p) for p in j["parameters"])
    assert j["attempt"] == 1 and j["objective"] is not None
    series = real.get(f"/v1/jobs/{job}/series").json()["points"]
    assert series and all(math.isfinite(p["objective"]) and p["objective_se"] >= 0 for p in series)
    assert [p["step"] for p in series] == sorted({p["step"] for p in series})
    log = real.get(f"/v1/jobs/{job}/log").text
    assert [s for s in stages if f"stage {s}" in log] == stages
    names = [f["path"] for f in real.get(f"/v1/jobs/{job}/results").json()["files"]]
    archive = tarfile.open(fileobj=io.BytesIO(real.get(f"/v1/jobs/{job}/results.tar").content))
    assert archive.getnames() == names and "result.json" in names
    assert any(n.endswith(".hair") for n in names) and any(n.endswith(".vol") for n in names) and any(n.endswith(".png") for n in names)
    assert json.load(archive.extractfile("result.json")) == j["result"]
    assert [r["all_rotations"] for r in j["result"]["rows"]] == [False] * 6 + [True]


def steps(d, job):
    return d.get(f"/v1/jobs/{job}/series").json()["n_step"]


def strip(result):
    """Keeps what must be equal in two runs: parameters and their errors, not times."""
    return [(p["name"], p["value"], p["standard_error"]) for p in result["parameters"]]


def command_line(pid):
    """Empty for a process that has ended meanwhile."""
    try:
        with open(f"/proc/{pid}/cmdline", encoding="utf-8", errors="replace") as text:
            return text.read()
    except OSError:
        return ""


@pytest.mark.parametrize("victim", ["worker", "daemon"])
def test_killed_in_mid_fit_and_resumed_bit_for_bit(tmp_path, scan, finished, real, victim):
    whole = real.job(finished[0])["result"]
    d = Daemon(tmp_path / "data", worker=program("selvedge-worker")).start()
    job = submit(d, scan)
    wait_until(lambda: steps(d, job) >= 2, 120, "two steps of the fit")
    if victim == "daemon":
        d.kill()
        d.start()
    else:
        folder = os.path.join(d.data, "jobs", job)
        pids = [p for p in os.listdir("/proc") if p.isdigit() and folder in command_line(p)]
        assert len(pids) == 1
        os.kill(int(pids[0]), 9)
    done = d.wait_state(job, "succeeded", "failed", timeout_s=180)
    assert done["state"] == "succeeded", done["error"]
    assert done["attempt"] == 2 and done["lost_attempts"] == (victim == "worker")
    assert strip(done["result"]) == strip(whole)
    points = d.get(f"/v1/jobs/{job}/series").json()["points"]
    assert [p["step"] for p in points] == sorted({p["step"] for p in points}), "a step was repeated"
    d.stop()


def test_cancel_in_mid_fit_and_retry(real, scan, finished):
    job = submit(real, scan)
    wait_until(lambda: steps(real, job) >= 1, 120, "a step of the fit")
    start = time.monotonic()
    assert real.post(f"/v1/jobs/{job}/cancel").status_code == 202
    real.wait_state(job, "cancelled")
    print(f"cancelled within {time.monotonic() - start:.2f} s")
    assert real.post(f"/v1/jobs/{job}/retry").status_code == 202
    done = real.wait_state(job, "succeeded", "failed", timeout_s=180)
    assert done["state"] == "succeeded", done["error"]
    assert strip(done["result"]) == strip(real.job(finished[0])["result"])


def row(text):
    return (HEAD + "\n".join(ROWS[:-1] + [text]) + "\n").encode()


BAD = {
    "truncated TIFF": ("scan.tif", lambda scan: scan[:len(scan) // 2], "scan.tif"),
    "pages of different size": ("scan.tif", lambda scan: tiff([(24, 24)] * 5 + [(24, 20)] + [(24, 24)] * 6), "page"),
    "empty volume": ("scan.tif", lambda scan: tiff(24), "all voxels of the scan"),
    "not a TIFF": ("scan.tif", lambda scan: b"nonsense" * 100, "scan.tif"),
    "missing column": ("rows.csv", lambda scan: b"\n".join(
        b",".join(line.split(b",")[:4] + line.split(b",")[5:]) for line in TABLE.split(b"\n")), "camera_theta_deg"),
    "NaN radiance": ("rows.csv", lambda scan: row("fit,6,20,0,20,180,0,nan,0.1,0.1"), "rows.csv"),
    "negative radiance": ("rows.csv", lambda scan: row("fit,6,20,0,20,180,0,-3,0.1,0.1"), "rows.csv"),
    "camera angle beyond 90 degrees": ("rows.csv", lambda scan: row("fit,6,20,0,95,180,0,0.1,0.1,0.1"), "90"),
    "light angle beyond 90 degrees over a black sheet": ("rows.csv", lambda scan: row("fit,6,120,0,20,180,0,0.1,0.1,0.1"), "90"),
    "no rows": ("rows.csv", lambda scan: HEAD.encode(), "rows.csv"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_gets_a_clear_error_and_nothing_is_lost(real, scan, kind):
    name, make, word = BAD[kind]
    files = {"scan.tif": scan, "rows.csv": TABLE}
    files[name] = make(scan)
    job = submit(real, files["scan.tif"], files["rows.csv"])
    failed = real.wait_state(job, "failed", "succeeded", timeout_s=120)
    assert failed["state"] == "failed", f"{kind} was accepted"
    print(f"{kind}: {failed['error']['code']}, {failed['error']['field']}: {failed['error']['text']}")
    assert failed["error"]["code"] in ("format", "invalid", "numeric", "unsupported") and failed["lost_attempts"] == 0
    assert word in failed["error"]["text"] or word in failed["error"]["field"], failed["error"]
    for n, data in files.items():
        assert real.get(f"/v1/jobs/{job}/files/{n}").content == data


def test_a_filter_that_keeps_no_voxel_is_named(real, scan):
    job = real.create({**document(), "volume": {"files": ["scan.tif"], "voxel_size_um": 2.0, "filter": {"eps_J": -900000}}})
    real.upload(job, "scan.tif", scan, "volume")
    real.upload(job, "rows.csv", TABLE, "measurements")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    failed = real.wait_state(job, "failed", "succeeded", timeout_s=120)
    assert failed["error"]["field"] == "volume.filter.eps_J" and "cannot find fibers" in failed["error"]["text"], failed["error"]


def test_a_bad_file_is_replaced_and_the_job_succeeds(real, scan, finished):
    job = submit(real, scan, row("fit,6,20,0,20,180,0,nan,0.1,0.1"))
    real.wait_state(job, "failed", timeout_s=120)
    assert real.delete(f"/v1/jobs/{job}/files/rows.csv").status_code == 204
    real.upload(job, "rows.csv", TABLE, "measurements")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    done = real.wait_state(job, "succeeded", "failed", timeout_s=180)
    assert done["state"] == "succeeded" and strip(done["result"]) == strip(real.job(finished[0])["result"])


def test_unknown_models_and_parameters_are_refused_at_once(real):
    for fit, field in [({"model": "three_lobe.v1"}, "fit.model"), ({"fixed": {"beta_X": 1}}, "fit.fixed.beta_X"), ({"method": "guess.v1"}, "fit.method")]:
        problem(real.post("/v1/jobs", json=document(**fit)), 422, "invalid", field)
