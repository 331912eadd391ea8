"""Jobs that fit numbers of a described cloth: they come back from photographs of a known cloth, and a job that is killed
again and again ends with the same bits."""
import json
import os
import re
import shutil
import signal
import subprocess
import time

import pytest
from daemon_under_test import program

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")]
VIEWS = "set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg\n" + "".join(
    f"{'fit' if i < 10 else 'held-out'},{light},0,{camera},{phi},{turn}\n"
    for i, (light, camera, phi, turn) in enumerate([
        (20, 20, 180, 0), (45, 45, 180, 0), (60, 0, 180, 0), (60, 60, 180, 90), (30, 0, 180, 90), (70, 30, 180, 90), (70, 70, 180, 0),
        (50, 50, 90, 0), (40, 60, 30, 45), (75, 40, 150, 90), (30, 60, 180, 0), (60, 30, 90, 90)]))
TRUTH = {"C_R": [0.06, 0.05, 0.08], "C_TT": [0.7, 0.5, 0.3], "beta_R": 6, "beta_TT": 20, "gamma_TT": 20}
FITTED = {"flatness": {"value": 1.6, "lower": 1, "upper": 4}}
OUTPUT = {"render_px": 8, "render_samples": 1}


def cloth(**yarn):
    return {"weave": "plain", "tile_warps": 4, "tile_wefts": 4, "yarns": [{"fibers": 20, **yarn}]}


def run(job, **document):
    (job / "job.json").write_text(json.dumps({"sample": "known numbers", **document}))
    subprocess.run([program("selvedge-worker"), "--quiet", "--threads", "2", str(job)], check=True)
    return json.loads((job / "results" / "result.json").read_text())


def make_job(tmp_path, name, sample=None):
    job = tmp_path / name
    (job / "input").mkdir(parents=True)
    if sample is not None:
        for p in json.loads((sample / "photographs.json").read_text()):
            shutil.copy(sample / p["file"], job / "input")
    return job


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    """Photographs of a cloth whose yarns are 2.6 times as wide as high."""
    tmp_path = tmp_path_factory.mktemp("sample")
    table = tmp_path / "views.csv"
    table.write_text(VIEWS)
    first = make_job(tmp_path, "first")
    rows = VIEWS.replace("cloth_rotation_deg\n", "cloth_rotation_deg,r,g,b\n").replace("held-out", "fit")
    rows = "\n".join(line if i == 0 else line + ",0.1,0.1,0.1" for i, line in enumerate(rows.strip().split("\n")))
    (first / "input" / "rows.csv").write_text(rows + "\n")
    run(first, cloth=cloth(flatness=2.6), measurements={"file": "rows.csv"}, fit={"path_budget": 1000, "max_iterations": 1, **OUTPUT})
    subprocess.run([program("selvedge-phantom"), "photograph", "--fibers", str(first / "results" / "fibers.hair"), "--out", str(tmp_path / "photographs"),
                    "--table", str(table), "--px", "16", "--paths", "30000", "--seed", "5", "--param", "C_R=0.06,0.05,0.08",
                    "--param", "C_TT=0.7,0.5,0.3", "--param", "beta_R=6", "--param", "beta_TT=20", "--param", "gamma_TT=20", "--quiet"], check=True)
    return tmp_path / "photographs"


def photographs(sample):
    return json.loads((sample / "photographs.json").read_text())


def test_a_budget_that_cannot_be_kept_is_said(tmp_path, sample):
    """Screening of the contained model's result, joint fit with its differences and final fit count."""
    def warnings_of(name, budget):
        job = make_job(tmp_path, name, sample)
        result = run(job, cloth=cloth(**FITTED), photographs=photographs(sample),
                     fit={"models": ["two_lobe.v1", "two_lobe_diffuse.v1"], "path_budget": budget, "max_iterations": 2, **OUTPUT})
        return result, [w for w in result["warnings"] if w.startswith("fit.path_budget")]

    _, said = warnings_of("less", 1000)
    least = [int(re.search(r"takes up to (\d+) all the same: that is the least with numbers of the cloth", w).group(1)) for w in said]
    fit = least[0] // 6  # of one fit: twice for the joint fit, as often for its differences, twice for the final fit
    assert least == [6 * fit, (3 * 12 + 4 + 4) * fit]
    result, said = warnings_of("least", max(least))
    assert said == [] and all(m["n_path_fit"] <= max(least) for m in result["models"])


def test_numbers_come_back(tmp_path, sample):
    """The flatness is found again. Where hairs are as good as none, their length is not determined, and the job says so."""
    job = make_job(tmp_path, "job", sample)
    fixed = {k: TRUTH[k] for k in ("beta_R", "beta_TT", "gamma_TT")}
    described = cloth(hairs_per_mm=0.02, hair_length_um={"value": 200, "lower": 100, "upper": 1000}, **FITTED)
    result = run(job, cloth={**described, "final_tiles": 2}, photographs=photographs(sample),
                 fit={"model": "two_lobe.v1", "path_budget": 1200000, "fixed": fixed, **OUTPUT})
    numbers = {n["name"]: n for n in result["cloth_numbers"]}
    flatness, hairs = numbers["yarns[0].flatness"], numbers["yarns[0].hair_length_um"]
    assert flatness["determined"] and abs(flatness["value"] - 2.6) < 0.8 and flatness["standard_error"] < 0.6, flatness
    assert not hairs["determined"] and 100 <= hairs["value"] <= 1000 and hairs["unit"] == "um", hairs
    assert "these measurements do not determine" in json.dumps(result["warnings"]) and "hair_length_um" in json.dumps(result["warnings"])
    assert len(flatness["correlation_parameters"]) == len(result["parameters"])
    folds = result["cross_validation"]
    assert folds["cloth_numbers_held"] and folds["with_cloth_numbers"]["rel_rms"] >= 0 and folds["with_cloth_numbers"]["rel_rms_se"] > 0
    shown = {n["name"]: n for n in result["geometry"]["cloth"]["numbers"]}
    assert abs(shown["yarns[0].flatness"]["value"] - flatness["value"]) < 1e-9
    made = result["geometry"]["cloth"]
    assert made["made"]["tile_yarns"] == [8, 8] and made["description"]["tile_warps"] == made["description"]["tile_wefts"] == 8
    # a staple that ends at the face of the tile is not cut there
    assert result["geometry"]["n_fiber"] >= 0.95 * (4 * 8 * 20)
    again = make_job(tmp_path, "again", sample)
    run(again, cloth=made["description"], photographs=photographs(sample), fit={"model": "two_lobe.v1", "path_budget": 1000, "max_iterations": 1, **OUTPUT})
    alike = json.loads((again / "results" / "result.json").read_text())["geometry"]
    # how many vertices a fiber has follows from the numbers of the document, so lengths differ by the corners, and a staple that ends within
    # one of them from a face of the tile may be cut there or not: a fourth of the 16 yarns may have one more or less
    assert abs(alike["n_fiber"] - result["geometry"]["n_fiber"]) <= 4 and abs(alike["total_length_mm"] / result["geometry"]["total_length_mm"] - 1) < 0.05
    summary = (job / "results" / "summary.txt").read_text()
    assert "yarns[0].flatness" in summary and "these measurements do not determine it" in summary
    assert sum(s["best"] for s in result["cloth_screening"]) == 1


def without_times(result):
    return {k: v for k, v in result.items() if k not in ("fit_wall_s", "stages", "models")}


def test_killed_jobs_end_with_the_same_bits(tmp_path, sample):
    document = {"cloth": cloth(**FITTED), "photographs": photographs(sample),
                "fit": {"model": "two_lobe.v1", "path_budget": 150000, "max_iterations": 4, **OUTPUT}}
    document["cloth"]["renew_places"] = True
    want = without_times(run(make_job(tmp_path, "whole", sample), **document))
    one_tile = {**document, "cloth": {k: v for k, v in document["cloth"].items() if k != "renew_places"}}
    other = without_times(run(make_job(tmp_path, "one-tile", sample), **one_tile))
    assert other["cloth_numbers"][0]["value"] != want["cloth_numbers"][0]["value"], "renew_places changes the cloths of the search"
    job = make_job(tmp_path, "killed", sample)
    (job / "job.json").write_text(json.dumps({"sample": "known numbers", **document}))
    journal = job / "work" / "fit" / "estimates.journal"
    for _ in range(3):
        size = journal.stat().st_size if journal.exists() else 0
        worker = subprocess.Popen([program("selvedge-worker"), "--quiet", "--threads", "2", str(job)])
        deadline = time.monotonic() + 120
        while worker.poll() is None and time.monotonic() < deadline and not (journal.exists() and journal.stat().st_size > size):
            time.sleep(0.01)
        worker.send_signal(signal.SIGKILL)
        worker.wait()
    assert without_times(run(job, **document)) == want


def refused(tmp_path, name, sample, **document):
    job = make_job(tmp_path, name, sample)
    (job / "job.json").write_text(json.dumps({"sample": "s", "photographs": photographs(sample), **document}))
    subprocess.run([program("selvedge-worker"), "--quiet", str(job)], check=False)
    return json.loads((job / "status.json").read_text())["error"]


def test_what_numbers_exclude(tmp_path, sample):
    error = refused(tmp_path, "volume", sample, cloth=cloth(**FITTED), fit={"model": "microflake.v1"})
    assert error["field"] == "fit.model" and "sees a volume" in error["text"]
    error = refused(tmp_path, "radius", sample, cloth=cloth(**FITTED), fit={"fit_radius": True})
    assert error["field"] == "fit.fit_radius" and "fiber_radius_um" in error["text"]


def test_a_contained_model_hands_on_its_cloth(tmp_path, sample):
    """The screening of the model that contains the other has its cloth twice, whatever the order in the job."""
    result = run(make_job(tmp_path, "job", sample), cloth=cloth(**FITTED), photographs=photographs(sample),
                 fit={"models": ["two_lobe_diffuse.v1", "two_lobe.v1"], "path_budget": 60000, "max_iterations": 2, **OUTPUT})
    outer, inner = result["models"]
    flatness = inner["cloth_numbers"][0]["value"]
    assert [s["values"] for s in outer["cloth_screening"][1:3]] == [[flatness]] * 2
    assert flatness not in [s["values"][0] for s in inner["cloth_screening"]]
