"""From raw files of a simulated camera to a job's result: small pictures, described fibers, few paths."""
import json
import os
import subprocess

import pytest

BUILD = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", os.environ.get("SELVEDGE_BUILD", "build"))
VIEWS = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg\nfit,20,0,20,180\nfit,45,0,30,90\nheld-out,40,0,0,180\n"


def run(name, *command):
    done = subprocess.run([os.path.join(BUILD, "bin", name), *map(str, command)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def load(*path):
    with open(os.path.join(*map(str, path)), encoding="utf-8") as f:
        return json.load(f)


def take(folder):
    """FOLDER/raw with raw files of a small twill, and the record of the camera's noise."""
    (folder / "views.csv").write_text(VIEWS)
    run("selvedge-phantom", "cloth", "--weave", "plain", "--seed", 7, "--voxel-um", 4, "--fibers-per-yarn", 6, "--out", folder / "cloth")
    run("selvedge-phantom", "photograph", "--fibers", folder / "cloth" / "truth.hair", "--table", folder / "views.csv", "--out", folder / "rendered",
        "--paths", 20000, "--px", 40, "--crop-cm", 1.25, "--blur-mm", 0.25)
    run("selvedge-phantom", "camera", "--photographs", folder / "rendered", "--out", folder / "raw", "--size-px", "260,220", "--px-per-mm", 2.6,
        "--cameras-from-markers")
    raw = sorted(os.listdir(folder / "raw"))
    run("selvedge-camera", "calibrate-camera", "--dark", *(folder / "raw" / n for n in raw if n.startswith("dark-")),
        "--flat", *(folder / "raw" / n for n in raw if n.startswith("flat-")), "--out", folder / "raw" / "noise.json")


def make_job(folder):
    job = folder / "job"
    os.makedirs(job / "input")
    for name in os.listdir(folder / "raw"):
        os.rename(folder / "raw" / name, job / "input" / name)
    os.rename(folder / "cloth" / "truth.hair", job / "input" / "truth.hair")
    document = dict(load(job, "input", "camera-job.json"), sample="raw files", fibers={"file": "truth.hair"},
                    fit={"model": "two_lobe.v1", "path_budget": 20000, "render_px": 16, "render_samples": 4, "seed": 3})
    (job / "job.json").write_text(json.dumps(document))
    return job


@pytest.mark.slow
def test_a_job_from_raw_files(tmp_path):
    take(tmp_path)
    job = make_job(tmp_path)
    run("selvedge-worker", "--quiet", job)
    result = load(job, "results", "result.json")
    assert result["color"]["found_automatically"] and result["color"]["delta_e_2000_after"]["largest"] < 1.0
    true = {os.path.splitext(p["file"])[0] + "-0.dng": p["mean_rgb"] for p in load(job, "input", "truth.json")["photographs"]}
    view = {os.path.splitext(p["file"])[0] + "-0.dng": p for p in load(tmp_path, "rendered", "photographs.json")}
    assert len(result["rows"]) == 3
    for row in result["rows"]:
        photograph = row["photograph"]
        assert photograph["n_exposure"] == 3 and photograph["camera"] == "Selvedge Test camera" and photograph["iso"] == 200
        assert abs(row["camera_theta_deg"] - view[row["name"]]["camera_theta_deg"]) < 2.0
        for t, m, se, noise, color in zip(true[row["name"]], row["measured"], row["measured_se"], photograph["noise_se"], photograph["color_se"]):
            assert abs(m / t - 1.0) < 0.05 and abs(m - t) < 2.0 * se, (row["name"], true[row["name"]], row["measured"], row["measured_se"])
            assert 0.0 < noise < se and 0.0 < color < se
