"""All faults of a job's input files before it is started: POST /v1/jobs/{id}/check, and /start?check=1. The files are uploaded, or known by their
SHA-256; a worker in its sandbox opens them."""
import json
import os
import random
import shutil
import signal
import subprocess
import sys

import pytest
from daemon_under_test import ROOT, program, sha256
from small_exr import exr
from small_png import png

sys.path.insert(0, os.path.join(ROOT, "clients", "python"))
import selvedge  # noqa: E402

VIEW = {"set": "fit", "light_theta_deg": 20, "light_phi_deg": 0, "camera_theta_deg": 10, "camera_phi_deg": 180, "crop_px": [4, 4, 36, 36]}
GOOD = exr(48, 48, lambda x, y: (0.2 + 0.01 * ((x * 7 + y * 3) % 5), 0.1, 0.05))
FAULTY = {"a.jpg": (GOOD, "right suffix"), "b.png": (png(48, lambda x, y: 90), "transfer"),
          "c.exr": (GOOD[:700], "c.exr"), "d.dng": (b"no picture", "d.dng")}


def document(*names):
    return {"sample": "judged", "cloth": {"weave": "twill"}, "fit": {"path_budget": 1000},
            "photographs": [dict(VIEW, file=name, camera_theta_deg=10 + 5 * i) for i, name in enumerate(names)]}


def faulty_job(d, upload):
    job = d.create(document(*FAULTY, "good.exr"))
    for name, (data, _) in {**FAULTY, "good.exr": (GOOD, "")}.items():
        upload(job, name, data)
    return job


def upload(d):
    return lambda job, name, data: d.upload(job, name, data, role="photograph")


def known(d):
    def declare(job, name, data):
        r = d.post(f"/v1/jobs/{job}/files", json={"name": name, "role": "photograph", "size": len(data), "sha256": sha256(data)})
        assert r.json()["state"] == "complete", (name, r.text)
    return declare


def expect_all_faults(errors):
    assert [e["field"] for e in errors] == [f"photographs[{i}].file" for i in range(len(FAULTY))], errors
    for error, (_, word) in zip(errors, FAULTY.values()):
        assert word in error["detail"] and error["code"] in ("format", "invalid"), error
        assert "/jobs/" not in error["detail"], "the folder of the service is no one's business"


def test_all_faults_of_uploaded_and_known_files(real):
    for way in (upload(real), known(real)):
        job = faulty_job(real, way)
        r = real.post(f"/v1/jobs/{job}/check")
        assert r.status_code == 200 and r.json()["valid"] is False and r.json()["n_file"] == 5, r.text
        expect_all_faults(r.json()["errors"])
        r = real.post(f"/v1/jobs/{job}/start?check=1")
        assert r.status_code == 422 and r.json()["code"] == "invalid" and r.json()["field"] == "photographs[0].file", r.text
        expect_all_faults(r.json()["errors"])
        assert real.job(job)["state"] == "draft"


def test_what_is_mended_starts(real):
    job = faulty_job(real, upload(real))
    r = real.put(f"/v1/jobs/{job}/document", json=document("good.exr"))
    assert r.status_code == 200
    report = real.post(f"/v1/jobs/{job}/check").json()
    assert report["valid"] and report["errors"] == [] and report["n_file"] == 1, report
    assert any("few" in w["detail"] or "row" in w["detail"] for w in report["warnings"]) or report["warnings"] == [], report
    assert real.post(f"/v1/jobs/{job}/start?check=1").status_code == 202
    real.post(f"/v1/jobs/{job}/cancel")
    assert real.post(f"/v1/jobs/{job}/start?check=2").status_code == 422


def test_files_that_are_not_there_yet(real):
    job = real.create(document("good.exr"))
    report = real.post(f"/v1/jobs/{job}/check").json()
    assert [(e["code"], e["field"]) for e in report["errors"]] == [("not_found", "good.exr")]
    assert report["errors"][0]["detail"] == "input file 'good.exr' (photograph) does not exist"
    assert real.post("/v1/jobs/" + "0" * 32 + "/check").status_code == 404


def test_a_job_that_was_not_checked_fails_with_all_faults(real):
    job = faulty_job(real, upload(real))
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    failed = real.wait_state(job, "failed")
    said = " ".join([failed["error"]["text"], *failed["warnings"]])
    for word in (name for name in FAULTY if name not in ("b.png",)):
        assert word in said, said


def test_a_scan_that_is_no_scan_names_the_other_faults_too(real):
    doc = dict(document("a.jpg"), volume={"files": ["scan.tif"], "voxel_size_um": 1})
    del doc["cloth"]
    job = real.create(doc)
    real.upload(job, "a.jpg", GOOD, role="photograph")
    real.upload(job, "scan.tif", b"no scan at all, whatever its name says")
    errors = real.post(f"/v1/jobs/{job}/check").json()["errors"]
    assert {e["field"] for e in errors} == {"volume.files", "photographs[0].file"}, errors


def test_clients_show_all_faults(real, tmp_path):
    for name, (data, _) in {**FAULTY, "good.exr": (GOOD, "")}.items():
        (tmp_path / name).write_bytes(data)
    (tmp_path / "job.json").write_text(json.dumps(document(*FAULTY, "good.exr")))
    url = f"http://127.0.0.1:{real.port}"
    done = subprocess.run([program("selvedge"), "--server", url, "submit", str(tmp_path / "job.json")], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and done.stdout == "", done
    assert done.stderr.count("fault: photographs[") == len(FAULTY) and "the input has 4 faults, so the job is not started" in done.stderr, done.stderr
    with pytest.raises(selvedge.Problem) as refused:
        selvedge.Client(url).submit(str(tmp_path / "job.json"), check=True)
    expect_all_faults(refused.value.body["errors"])
    job = selvedge.Client(url).submit(str(tmp_path / "job.json"), start=False)
    expect_all_faults(job.check()["errors"])


def script(folder, text):
    path = folder / "worker.sh"
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(0o755)
    return str(path)


def test_a_worker_that_dies_hangs_or_holds_too_much(daemon_maker, tmp_path):
    for text, settings, expected in (
            ("kill -SEGV $$", {}, "worker_lost"), (f"kill -{int(signal.SIGSYS)} $$", {}, "forbidden_call"), ("echo nonsense", {}, "worker_lost"),
            ("exec /usr/bin/python3 -c 'x = bytearray(300000000); import time; time.sleep(60)'", {"jobs.resident_limit_bytes": 100000000}, "worker_lost"),
            ("sleep 600", {"jobs.check_limit_s": 1}, None)):
        shutil.rmtree(tmp_path / "data", ignore_errors=True)
        d = daemon_maker("data", worker=script(tmp_path, text), options=settings)
        job = d.create(document("good.exr"))
        d.upload(job, "good.exr", GOOD, role="photograph")
        r = d.post(f"/v1/jobs/{job}/check")
        if expected is None:
            assert r.status_code == 503 and r.json()["code"] == "not_ready" and "jobs.check_limit_s" in r.json()["detail"], r.text
        else:
            assert r.json()["valid"] is False and r.json()["errors"][0]["code"] == expected, (text, r.text)
        d.stop()


def test_links_of_a_folder_made_by_hand_are_read_and_those_of_a_job_are_not(real, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "p.exr").write_bytes(GOOD)
    (tmp_path / "mine").mkdir()
    os.symlink(tmp_path / "elsewhere" / "p.exr", tmp_path / "mine" / "good.exr")
    (tmp_path / "mine" / "job.json").write_text(json.dumps(document("good.exr")))

    def faults(*more):
        command = [program("selvedge-worker"), *more, "--check", str(tmp_path / "mine" / "job.json"), str(tmp_path / "mine")]
        return json.loads(subprocess.run(command, capture_output=True, check=False).stdout)["faults"]

    assert faults() == []
    # what the sandbox keeps away depends on the kernel (Landlock)
    landlock = os.path.exists("/sys/kernel/security/lsm") is False or "landlock" in open("/sys/kernel/security/lsm", encoding="utf-8").read()
    if landlock:
        assert any("Permission denied" in f["detail"] or "good.exr" in f["detail"] for f in faults("--no-links"))
    # a worker that its input has taken over may have put a link into its job's inputs
    job = real.create(document("good.exr"))
    real.upload(job, "good.exr", GOOD, role="photograph")
    at = os.path.join(real.data, "jobs", job, "input", "good.exr")
    os.unlink(at)
    os.symlink(tmp_path / "elsewhere" / "p.exr", at)
    if landlock:
        assert real.post(f"/v1/jobs/{job}/check").json()["valid"] is False


def test_a_scan_of_noise_is_told_before_the_job_starts(real):
    """A scan of bytes that have no order, as a file of another type has; with its fibers' diameter stated it is taken."""
    random.seed(3)
    scan = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 64 64 64\nencoding: raw\n\n" + random.randbytes(64**3)
    for stated in ({}, {"fiber_diameter_voxel": 6}):
        job = real.create({"sample": "noise", "volume": {"files": ["noise.nrrd"], "voxel_size_um": 2, **stated}})
        real.upload(job, "noise.nrrd", scan)
        checked = real.post(f"/v1/jobs/{job}/check").json()
        assert checked["valid"] is bool(stated)
        if not stated:
            (error,) = checked["errors"]
            assert error["field"] == "volume.files" and "nothing but noise" in error["detail"]
            assert real.post(f"/v1/jobs/{job}/start?check=1").status_code == 422 and real.job(job)["state"] == "draft"
