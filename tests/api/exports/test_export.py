"""Exports of a job to other programs: the files, what the result says of them, and whether the other program opens them."""
import csv
import json
import os
import subprocess

import pytest
from daemon_under_test import ROOT, problem, program
from small_cloth import TABLE, start_small_job

pytestmark = pytest.mark.skipif(not os.access(program("selvedge-worker"), os.X_OK), reason="no selvedge-worker in the build folder")
FIT = {"path_budget": 20000, "render_px": 8, "render_samples": 1}
PYTHON = os.path.join(os.path.dirname(os.path.dirname(program("selvedge-worker"))), "exports-python", "bin", "python")
ROW = os.path.join(os.path.dirname(__file__), "..", "..", "bench", "mitsuba_row.py")
PLUG_IN_CHECK = os.path.join(ROOT, "tests", "support", "python", "mitsuba_fiber.py")
PLUG_IN = os.path.join(ROOT, "optimizer", "report", "export", "selvedge_fiber.py")


def document(**more):
    return {"sample": "export", "fibers": {"file": "cloth.hair", "voxel_um": 5}, "measurements": {"file": "rows.csv"}, "fit": dict(FIT, **more),
            "export": {"mitsuba": True}}


def save(real, job, folder):
    files = [f["path"] for f in real.get(f"/v1/jobs/{job}/results").json()["files"] if f["path"].startswith("export/mitsuba/")]
    for path in files:
        (folder / os.path.basename(path)).write_bytes(real.get(f"/v1/jobs/{job}/results/{path}").content)
    return sorted(os.path.basename(p) for p in files)


@pytest.mark.slow
def test_a_scene_for_mitsuba(real, tmp_path):
    job = start_small_job(real, document())
    result = real.wait_state(job, "succeeded", timeout_s=400)["result"]
    assert save(real, job, tmp_path) == ["conversion.json", "exact.xml", "fibers-0.txt", "rows.csv", "scene.xml", "selvedge_fiber.py"]
    (export,) = result["exports"]
    (material,) = export["materials"]
    assert export["format"] == "mitsuba" and material["group"] is None
    assert 0 <= export["rel_rms"] < 0.6 and 0 <= export["row_rel_rms"] < 0.6 and 0 < export["row_rel_rms_se"] < 0.3
    assert len(export["row_rel_errors"]) == len(result["rows"]) and all(0 <= x < 1 for x in export["row_rel_errors"])
    summary, report = (real.get(f"/v1/jobs/{job}/results/{name}").text for name in ("summary.txt", "report.html"))
    worst = max(range(len(result["rows"])), key=export["row_rel_errors"].__getitem__)
    in_words = f"{100 * export['row_rel_errors'][worst]:.1f} %"
    assert export["exact"] and f"at most {in_words} in row {result['rows'][worst]['name']}; exact.xml shows" in summary, summary
    assert f">{in_words}</td>" in report.split("Files for other programs")[1].split("<h2>")[0]
    assert bool(export["warnings"]) == (export["row_rel_rms"] > 0.1) and all(f"warning: {w}" in summary for w in export["warnings"])
    curves = [c for c in (tmp_path / "fibers-0.txt").read_text().split("\n\n") if c.strip()]
    assert len(curves) == result["geometry"]["n_fiber"]
    assert all(len(c.strip().split("\n")) >= 4 for c in curves), "Mitsuba's B-splines have four control points or more"
    rows = list(csv.DictReader((tmp_path / "rows.csv").open()))
    assert [float(r["rendered_g"]) for r in rows] == pytest.approx([r["rendered"][1] for r in result["rows"]], rel=1e-6)
    if not os.access(PYTHON, os.X_OK):
        pytest.skip("the files are right; no Mitsuba to open them with (make test installs it where there is a package index)")
    for form, samples in (("mitsuba", "16"), ("mitsuba_plugin", "2")):
        done = subprocess.run([PYTHON, ROW, form, str(tmp_path), "0", "8", samples], capture_output=True, text=True, check=True)
        assert all(x > 0 for x in map(float, done.stdout.strip("[]\n").split(",")))


def test_the_plug_ins_for_mitsuba_scatter_as_the_models_do():
    """textile.v3 with clear fibers gives all light back; samples have the density that is stated for them."""
    if not os.access(PYTHON, os.X_OK):
        pytest.skip("no Mitsuba (make test installs it where there is a package index)")
    done = subprocess.run([PYTHON, PLUG_IN_CHECK, PLUG_IN], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for view in json.loads(done.stdout):
        assert view["pdf"] == pytest.approx(1, abs=1e-3), view
        assert abs(view["mean"] - view["given_back"]) < 4 * view["se"], view
        if view["model"] == "textile.v3":
            assert view["given_back"] == pytest.approx(1, abs=1e-3), view  # by quadrature: both of its sums are exact to 1e-4


@pytest.mark.slow
def test_what_the_scene_lacks_is_said(real):
    """A square of 40 cm shows more of this small tile than is written, and the plug-in does not see flat sections turn."""
    wanted = {**document(model="textile.v3"), "camera": {"crop_cm": 40},
              "cloth": {"weave": "plain", "tile_warps": 2, "tile_wefts": 2, "yarns": [{"fibers": 6, "fiber_flatness": 2}]}}
    job = real.create({k: v for k, v in wanted.items() if k != "fibers"})
    real.upload(job, "rows.csv", TABLE.encode(), "measurements")
    assert real.post(f"/v1/jobs/{job}/start").status_code == 202
    result = real.wait_state(job, "succeeded", timeout_s=400)["result"]
    assert [w for w in result["warnings"] if "repeats of the tile" in w] and len(result["exports"]) == 1
    for warnings in (result["warnings"], result["exports"][0]["warnings"]):
        assert [w for w in warnings if "takes the flat sections" in w], warnings


def test_a_volume_model_is_not_exported(real):
    result = real.wait_state(start_small_job(real, document(model="microflake.v1")), "succeeded", timeout_s=400)["result"]
    assert result["exports"] == []
    assert [w for w in result["warnings"] if "nothing was exported" in w]


def test_an_export_needs_a_fit(real):
    job = {"sample": "export", "volume": {"files": ["a.tif"]}, "export": {"mitsuba": True}}
    problem(real.post("/v1/jobs", json=job), 422, "invalid", field="export.mitsuba")
